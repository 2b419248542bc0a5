"""`curvify check`: is a mesh what it should be? The exit code tells."""

from __future__ import annotations

from typing import Any

import click

from curvify.cli import options
from curvify.cli.answers import print_json
from curvify.cli.group import COMMANDS, Command
from curvify.cli.parameters import DEGREES, POSITIVE

EXAMPLES = (
    ("Would a slicer take it?", "curvify check coarse.obj --watertight --manifold --positive-volume"),
    ("In a script: planar convex faces only", "curvify check coarse.obj --convex --planar 0.1 || exit 1"),
    (
        "No kink in a dense mesh, for a program",
        "curvify refine coarse.obj - --output-format ply | curvify check - --g1 20 --json",
    ),
)
CONDITION = "Conditions"


def condition(name: str, help: str, type: Any = None, metavar: str | None = None) -> Any:
    """The option of a condition: a flag, or one with a limit."""
    if type is None:
        return options.option(CONDITION, name, is_flag=True, help=help)
    return options.option(CONDITION, name, type=type, metavar=metavar, help=help)


@click.command(name="check", cls=Command, examples=EXAMPLES, short_help=COMMANDS["check"])
@options.only_in
@options.with_options(
    condition("--watertight", "Every edge joins two faces that run opposite ways along it."),
    condition("--manifold", "No edge has more than two faces; no vertex joins surfaces that share no edge there."),
    condition("--oriented", "Neighboring faces show the same side."),
    condition("--positive-volume", "Closed, and not inside out."),
    condition("--no-degenerate", "Every face has three distinct corners and an area."),
    condition("--no-duplicates", "No two faces have the same vertices."),
    condition("--no-unused", "Every vertex is in a face."),
    condition("--convex", "No face is concave or touches itself: nothing that 'curvify split' would cut for that."),
    condition(
        "--planar",
        "No side of a face leaves the face's plane by more than this many degrees.",
        DEGREES,
        "DEG",
    ),
    condition(
        "--g1",
        "No two faces meet at more than this angle, in degrees, across an edge that is not a crease. In a dense mesh "
        "of a smooth surface, twice the level halves these angles; kinks stay.",
        DEGREES,
        "DEG",
    ),
    condition("--max-sides", "No face has more sides.", POSITIVE, "N"),
    condition("--max-faces", "The mesh has no more faces.", POSITIVE, "N"),
    condition("--max-pieces", "The mesh has no more connected pieces.", POSITIVE, "N"),
    options.weld,
    options.input_format,
    options.as_json,
    options.quiet,
)
def command(**given: Any) -> None:
    """Check that a mesh is what it should be; the exit code tells.

    The exit code is 0 if IN meets all conditions, 1 if it does not, 2 if it cannot be read. One line for each
    condition says why and where: vertices, edges and faces are counted from 0. Seams are closed before anything is
    counted (see --weld). Creases are what refine takes for creases: normals of IN that differ, tags, smoothing groups.
    """
    check_file(**given)


def check_file(
    input: str, weld: str | None, input_format: str | None, as_json: bool, quiet: bool, **conditions: Any
) -> None:
    """Read, check, print; ends the command with 1 if a condition is not met. Raises CurvifyError."""
    asked = {name: value for name, value in conditions.items() if value is not None and value is not False}
    if not asked:
        raise click.UsageError("name at least one condition, for example --watertight", click.get_current_context())

    from curvify.checks import check_mesh
    from curvify.cli import files
    from curvify.cli.console import as_line
    from curvify.errors import MeshError

    mesh, name = files.open_input(input, input_format)
    with files.naming(name, MeshError):
        findings = check_mesh(mesh, asked, weld or "auto")
    passed = all(finding.passed for finding in findings)
    if as_json:
        answer = {"input": input, "passed": passed, "checks": [finding.as_dict() for finding in findings]}
        print_json("check", answer)
    elif not quiet:
        for finding in findings:
            click.echo(as_line(name, finding, finding.name.replace("_", "-")))
    if not passed:
        click.get_current_context().exit(1)
