"""`curvify repair`: meshes with defects in, the same without in."""

from __future__ import annotations

from typing import Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

EXAMPLES = (
    ("What is wrong, and the same mended", "curvify info coarse.obj && curvify repair coarse.obj mended.obj -v"),
    (
        "Close holes of up to 12 edges and refine what comes of it",
        "curvify repair coarse.obj - --holes 12 --output-format ply | curvify refine - dense.ply",
    ),
)


@click.command(name="repair", cls=Command, examples=EXAMPLES, short_help=COMMANDS["repair"])
@options.in_and_out
@options.with_options(
    options.option(
        "Repair",
        "--holes",
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        metavar="N",
        help="Close holes of up to this many edges, each with one polygon.",
    ),
    options.weld,
    options.input_format,
    options.output_format,
    options.precision,
    options.as_text,
    options.no_clobber,
    options.messages,
)
def command(**given: Any) -> None:
    """Mend what refine only warns of.

    Seams are closed; faces without area, repeated ones and walls inside a body are removed; faces are turned to the
    side of their neighbors; bodies and surfaces that only touch at edges and vertices come apart; closed pieces that
    are inside out are turned; unused vertices are removed. Polygons, normals, texture coordinates, colors, materials,
    groups and marks are kept; no vertex is moved. What was done is told on stderr.
    """
    repair_file(**given)


def repair_file(
    input: str,
    output: str,
    holes: int,
    weld: str | None,
    input_format: str | None,
    output_format: str | None,
    precision: str,
    ascii: bool,
    no_clobber: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Read, mend, write. Raises CurvifyError."""
    import numpy as np

    from curvify.cli import files
    from curvify.cli.console import Console
    from curvify.errors import FormatError, MeshError, OptionError
    from curvify.formats import write_mesh
    from curvify.repair import repair_mesh

    console = Console(quiet, verbose)
    format = files.check_output(output, output_format, no_clobber)
    if ascii and format != "ply":
        raise OptionError(f"--ascii is for PLY; {format} has no such choice")
    files.check_input(input, input_format)
    mesh = files.read_input(input, input_format)
    name = files.shown_name(input, "stdin")
    with files.naming(name, MeshError):
        mended, notes = repair_mesh(mesh, weld or "auto", holes)
    for text in mesh.warnings:
        console.warn(f"{name}: {text}")
    for text in notes or ["nothing to mend"]:
        console.tell(f"{name}: {text}")
    kind = mesh.position_dtype if precision == "input" else np.dtype(precision)
    with files.naming(files.shown_name(output, "stdout"), FormatError):
        write_mesh(mended, output, format, ascii=ascii, dtype=kind)
