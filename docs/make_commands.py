"""Write docs/commands/: a page for each command, from what its --help says. Run by ``make docs``."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import click

from curvify.cli.group import COMMANDS, Command

FOLDER = Path(__file__).resolve().parent / "commands"
NOTE = "<!-- Made by docs/make_commands.py from the command itself: run `make docs` after a change. -->"
EXIT_CODES = (
    "Exit codes: 0 done, 1 the answer of `check` or `compare` is no, 2 it could not be done (one line says why), "
    "130 interrupted."
)


def pages() -> dict[str, str]:
    """Text of each page by its file name."""
    found = {f"{name}.md": page(name) for name in COMMANDS}
    return {"README.md": overview(), **found}


def overview() -> str:
    """The list of all commands."""
    rows = [f"| [`curvify {name}`]({name}.md) | {line} |" for name, line in COMMANDS.items()]
    return "\n".join([NOTE, "", "# Commands", "", "| command | what it does |", "|---|---|", *rows, "", EXIT_CODES, ""])


def page(name: str) -> str:
    """The page of a command: what it does, its options under their headings, its examples."""
    command = import_module(f"curvify.cli.{name}").command
    assert isinstance(command, Command)
    first, _, rest = (command.help or "").partition("\n\n")
    arguments = [parameter for parameter in command.params if isinstance(parameter, click.Argument)]
    usage = " ".join(["curvify", name, "[OPTIONS]", *(str(argument.metavar) for argument in arguments)])
    parts = [NOTE, "", f"# curvify {name}", "", " ".join(first.split()), "", f"    {usage}", ""]
    for paragraph in rest.split("\n\n"):
        if paragraph.strip():
            parts += [" ".join(paragraph.split()), ""]
    parts += ["## Examples", "", "```sh"]
    for purpose, line in command.examples:
        parts += [f"# {purpose}", line]
    parts += ["```", "", "## Options", ""]
    for heading, rows in options(command).items():
        parts += [f"**{heading}**", "", "| option | |", "|---|---|", *rows, ""]
    return "\n".join([*parts, EXIT_CODES, "", "[All commands](README.md)", ""])


def options(command: Command) -> dict[str, list[str]]:
    """Rows of the options under each heading."""
    found: dict[str, list[str]] = {}
    for option in command.params:
        if isinstance(option, click.Option):
            cell = f"`{signature(option)}`".replace("|", "\\|")
            help = escaped(" ".join((option.help or "").split()))
            found.setdefault(getattr(option, "heading", "Other"), []).append(f"| {cell} | {help}{default(option)} |")
    return found


def signature(option: click.Option) -> str:
    """``-k, --level K``."""
    names = ", ".join(option.opts)
    if option.is_flag:
        return names
    if option.metavar:
        return f"{names} {option.metavar}"
    if isinstance(option.type, click.Choice):
        return f"{names} {'|'.join(option.type.choices)}"
    return f"{names} {option.type.name.upper()}"


def default(option: click.Option) -> str:
    """The default, where the help shows one."""
    if not option.show_default or option.is_flag:
        return ""
    value = option.default
    return f" Default: `{' '.join(map(str, value)) if isinstance(value, tuple) else value}`."


def escaped(text: str) -> str:
    """Text of a table's cell."""
    return text.replace("|", "\\|").replace("*", "\\*").replace("<", "&lt;")


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    written = pages()
    for path in FOLDER.glob("*.md"):
        if path.name not in written:
            path.unlink()
    for name, text in written.items():
        (FOLDER / name).write_text(text, encoding="utf-8")
