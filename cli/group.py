"""The group of commands, each imported when it runs or its help is shown, and the look of the help pages."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import Any

import click

from curvify import __version__

#: Every command, with the line that `curvify --help` shows; the command is ``command`` in the module of its name.
COMMANDS = {
    "refine": "Turn a coarse polygon mesh into a dense mesh of a smooth surface.",
    "simplify": "Turn a dense triangle mesh into few convex polygons that refine back to it.",
    "fit": "Fit a coarse mesh to a dense one, so that its surface comes back to it.",
    "batch": "Refine many meshes in parallel.",
    "info": "Show what a mesh is like and what refine would do with it.",
    "check": "Check that a mesh is what it should be; the exit code tells.",
    "compare": "Compare two meshes; the exit code tells whether they agree.",
    "render": "Draw meshes side by side into a PNG picture.",
    "view": "Write a web page that shows meshes, to turn, zoom and compare.",
    "curves": "Write the curves of a surface: edges, rims, silhouettes, cells.",
    "repair": "Mend what refine only warns of.",
    "split": "Cut concave and many-sided faces into convex ones.",
    "marks": "Write the sharp features of a mesh as a marks file.",
    "schemes": "List the surface schemes and their options.",
    "backends": "List what can evaluate surfaces: the processor, and the GPU that was found.",
}


class Option(click.Option):
    """An option with the heading that it stands under in the help."""

    def __init__(self, *args: Any, heading: str = "Other", **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.heading = heading


class Command(click.Command):
    """A command whose help shows options under headings, and examples: ``(what it does, command line)``."""

    def __init__(self, *args: Any, examples: Iterable[tuple[str, str]] = (), **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.examples = tuple(examples)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse; every error knows the command, whose help it points to."""
        try:
            return super().parse_args(ctx, args)
        except click.UsageError as error:
            error.ctx = error.ctx or ctx
            raise

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options under their headings, in the order of the command; those of click itself come last."""
        sections: dict[str, list[tuple[str, str]]] = {}
        options = [parameter for parameter in self.get_params(ctx) if isinstance(parameter, click.Option)]
        for option in sorted(options, key=lambda option: not isinstance(option, Option)):
            record = option.get_help_record(ctx)
            if record is not None:
                sections.setdefault(getattr(option, "heading", "Other"), []).append(record)
        for heading, records in sections.items():
            with formatter.section(heading):
                formatter.write_dl(records, col_max=28)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the examples as they are: they are there to be copied."""
        with formatter.section("Examples"):
            for purpose, line in self.examples:
                formatter.write(f"  # {purpose}\n  {line}\n")


class Commands(click.Group):
    """The commands of ``COMMANDS``."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of the help."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of a name, from its module."""
        if cmd_name not in COMMANDS:
            return None
        found = import_module(f"curvify.cli.{cmd_name}").command
        assert isinstance(found, click.Command)
        return found

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that the first argument names; a near miss is told what it may have meant."""
        if args[0] not in COMMANDS and not args[0].startswith("-"):
            from difflib import get_close_matches

            close = get_close_matches(args[0], COMMANDS, n=1)
            if "." in args[0]:  # a file
                close = [f"curvify refine {' '.join(args)}"]
            meant = f" Did you mean '{close[0]}'?" if close else ""
            ctx.fail(f"No such command '{args[0]}'.{meant}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write names and short helps without importing the commands."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=Commands,
    no_args_is_help=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="'curvify COMMAND --help' explains a command and shows examples.",
)
@click.version_option(__version__, prog_name="curvify", message="%(prog)s %(version)s")
def curvify() -> None:
    """Turn coarse polygon meshes into dense meshes of smooth curved surfaces.

    The surface passes exactly through the vertices of the mesh, is smooth wherever no sharp feature is asked for, and
    has no cracks where the mesh has none.
    """
