"""`curvify split`: polygons in, convex polygons out."""

from __future__ import annotations

from typing import Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

EXAMPLES = (
    ("Convex faces for a tool that cannot fill concave ones", "curvify split coarse.obj convex.obj"),
    ("Only triangles and quads", "curvify split coarse.obj small.ply --max-sides 4"),
    (
        "In a pipeline",
        "cat coarse.obj | curvify split - - --input-format obj --output-format ply | curvify refine - dense.ply",
    ),
)


@click.command(name="split", cls=Command, examples=EXAMPLES, short_help=COMMANDS["split"])
@options.in_and_out
@options.with_options(
    options.split_rule,
    options.max_sides,
    options.input_format,
    options.output_format,
    options.precision,
    options.as_text,
    options.no_clobber,
    options.messages,
)
def command(**given: Any) -> None:
    """Cut concave and many-sided faces into convex ones.

    Faces that visit a vertex twice are cut too; all others stay as they are, and no vertex is added, moved or
    renumbered. Normals, texture coordinates, colors, materials, groups and marks are kept. The suffixes of IN and OUT
    tell their formats; '-' is standard input or output.
    """
    split_file(**given)


def split_file(
    input: str,
    output: str,
    split_rule: str | None,
    max_sides: int,
    input_format: str | None,
    output_format: str | None,
    precision: str,
    ascii: bool,
    no_clobber: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Read, split, write. Raises CurvifyError."""
    import numpy as np

    from curvify.cli import files
    from curvify.cli.console import Console
    from curvify.errors import FormatError, MeshError, OptionError
    from curvify.formats import write_mesh
    from curvify.pieces import split_mesh
    from curvify.words import count_of

    console = Console(quiet, verbose)
    format = files.check_output(output, output_format, no_clobber)
    if ascii and format != "ply":
        raise OptionError(f"--ascii is for PLY; {format} has no such choice")
    files.check_input(input, input_format)
    mesh = files.read_input(input, input_format)
    name = files.shown_name(input, "stdin")
    if not mesh.face_count:
        raise MeshError(f"{name}: the mesh has no faces; give a mesh with polygons")
    pieces, notes = split_mesh(mesh, split_rule or "best", max_sides)
    for text in [*mesh.warnings, *notes]:
        console.warn(f"{name}: {text}")
    target = files.shown_name(output, "stdout")
    kind = mesh.position_dtype if precision == "input" else np.dtype(precision)
    with files.naming(target, FormatError):
        write_mesh(pieces, output, format, ascii=ascii, dtype=kind)
    console.explain(f"{target}: {count_of(mesh.face_count, 'face')} became {pieces.face_count:,}")
