"""`curvify marks`: the sharp features of a mesh, from all its sources, as a file to edit."""

from __future__ import annotations

from typing import Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

EXAMPLES = (
    ("What makes edges of coarse.obj sharp, as a list to edit", "curvify marks coarse.obj sharp.json"),
    ("Edges at which the faces turn by more than 40 degrees", "curvify marks coarse.obj sharp.json --sharp-angle 40"),
    (
        "The list alone decides",
        "curvify marks coarse.obj - > own.json && curvify refine coarse.obj d.ply --marks own.json --sharp-from none",
    ),
)


@click.command(name="marks", cls=Command, examples=EXAMPLES, short_help=COMMANDS["marks"])
@options.in_and_out
@options.with_options(
    options.marks,
    options.sharp_angle,
    options.sharp_from,
    options.weld,
    options.input_format,
    options.no_clobber,
    options.messages,
)
def command(**given: Any) -> None:
    """Write the sharp features of a mesh as a marks file.

    Shape controls go with them. Creases come from the tags of IN, from normals that differ across an edge, from
    smoothing groups and from --sharp-angle; the strongest source that names an edge decides. OUT is JSON; '-' is
    standard output. Edit it and give it to 'curvify refine --marks': what it says holds over IN, and alone with
    --sharp-from none.
    """
    marks_file(**given)


def marks_file(
    input: str,
    output: str,
    marks: str | None,
    sharp_angle: float | None,
    sharp_from: str | None,
    weld: str | None,
    input_format: str | None,
    no_clobber: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Read, gather, write. Raises CurvifyError."""
    from curvify.cli import files
    from curvify.cli.console import Console
    from curvify.errors import MeshError
    from curvify.formats.marks_json import marks_text, read_marks
    from curvify.options import MeshOptions
    from curvify.prepare import prepare_mesh
    from curvify.words import count_of

    console = Console(quiet, verbose)
    chosen = {"weld": weld, "sharp_from": sharp_from, "sharp_angle": sharp_angle}
    plain = {name: value for name, value in chosen.items() if value is not None}
    MeshOptions(**plain)  # type: ignore[arg-type]
    files.check_target(output, no_clobber)
    extra = None if marks is None else read_marks(marks)
    mesh, name = files.open_input(input, input_format)
    with files.naming(name, MeshError):
        coarse = prepare_mesh(mesh, MeshOptions(**plain, marks=extra))  # type: ignore[arg-type]
    for text in coarse.warnings:
        console.warn(f"{name}: {text}")
    found = coarse.found_marks()
    files.write_bytes(marks_text(found).encode(), output)
    for source, counts in coarse.marks.counts.items():
        console.explain(f"{name}: {source}: {', '.join(count_of(n, kind) for kind, n in counts.items())}")
    listed = ", ".join(count_of(n, f"{kind} mark") for kind, n in found.counts().items())
    if not listed:
        console.tell(f"{name}: no marks found; --sharp-angle 40 finds edges where faces turn by more than 40 degrees")
    console.explain(f"{files.shown_name(output, 'stdout')}: {listed or 'no marks'}")
