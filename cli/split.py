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
    options.polygons_out,
)
def command(**given: Any) -> None:
    """Cut concave and many-sided faces into convex ones.

    Faces that visit a vertex twice are cut too; all others stay as they are, and no vertex is added, moved or
    renumbered. Normals, texture coordinates, colors, materials, groups and marks are kept. The suffixes of IN and OUT
    tell their formats; '-' is standard input or output.
    """
    split_file(**given)


def split_file(input: str, split_rule: str | None, max_sides: int, quiet: bool, verbose: bool, **ends: Any) -> None:
    """Read, split, write. Raises CurvifyError."""
    from curvify.cli.console import Console
    from curvify.cli.polygons import Ends, change_file
    from curvify.pieces import split_mesh
    from curvify.words import count_of

    console, there = Console(quiet, verbose), Ends({"IN": input}, **ends)
    mesh, pieces = change_file(
        lambda mesh: split_mesh(mesh, split_rule or "best", max_sides), console.warn, console, there
    )
    console.explain(f"{there.target}: {count_of(mesh.face_count, 'face')} became {pieces.face_count:,}")
