"""`curvify curves`: lines on the surface, for drawings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command
from curvify.cli.surfaces import with_refine_options

if TYPE_CHECKING:
    from curvify.curves import Segments

EXAMPLES = (
    ("Edges and silhouette for a drawing", "curvify curves coarse.obj lines.obj --view 1 -2 1"),
    ("The grid of every patch", "curvify curves coarse.obj grid.obj --cells --level 4"),
)
KIND = "Curves"


@with_refine_options(headings=(options.SURFACE, options.SHARP, options.MESH))
@click.command(name="curves", cls=Command, examples=EXAMPLES, short_help=COMMANDS["curves"])
@options.in_and_out
@options.with_options(
    options.option(KIND, "--edges", is_flag=True, help="Curves over the edges of IN."),
    options.option(KIND, "--rims", is_flag=True, help="Boundaries of the surface only."),
    options.option(KIND, "--silhouette", is_flag=True, help="Where the surface turns away from the viewer."),
    options.option(KIND, "--cells", is_flag=True, help="The grid of every patch: the sides of all cells."),
    options.option(
        KIND,
        "--view",
        nargs=3,
        type=float,
        default=(1.0, 1.0, 1.0),
        show_default=True,
        metavar="X Y Z",
        help="Direction from the mesh to the viewer of --silhouette, who is far away.",
    ),
    options.no_clobber,
    options.messages,
)
def command(**given: Any) -> None:
    """Write the curves of a surface: edges, rims, silhouettes, cells.

    They are lines in an OBJ file. Without a choice, edges and the silhouette. Each kind is an object of its name. OUT
    is an OBJ file, '-' standard output. The level sets how finely curves are cut: 2 K segments for each edge.
    """
    curves_file(**given)


def curves_file(
    input: str,
    output: str,
    edges: bool,
    rims: bool,
    silhouette: bool,
    cells: bool,
    view: tuple[float, float, float],
    input_format: str | None,
    no_clobber: bool,
    quiet: bool,
    verbose: bool,
    **refine_options: Any,
) -> None:
    """Read, refine, find the curves, write them. Raises CurvifyError."""
    from curvify.cli import files
    from curvify.cli.console import Console
    from curvify.cli.surfaces import asked_for
    from curvify.curves import chained, curves
    from curvify.errors import MeshError
    from curvify.words import count_of

    console = Console(quiet, verbose)
    files.check_target(output, no_clobber)
    files.check_suffix(output, ".obj", "curves are written as OBJ only")
    mesh, name = files.open_input(input, input_format)
    asked = asked_for(refine_options)
    with files.naming(name, MeshError):
        made = asked.surface(mesh)
    for text in made.warnings:
        console.warn(f"{name}: {text}")
    dense = made.refine(asked.level, max_faces=asked.max_faces)
    choice = {"edges": edges, "rims": rims, "silhouette": silhouette, "cells": cells}
    kinds = [kind for kind, wanted in choice.items() if wanted] or ["edges", "silhouette"]
    found = {kind: curves(dense, kind, view) for kind in kinds}
    lines = {kind: segments.ends.tolist() if kind == "cells" else chained(segments) for kind, segments in found.items()}
    files.write_bytes(lines_text(found, lines).encode(), output)
    told = ", ".join(f"{count_of(len(lines[kind]), 'line')} of {kind}" for kind in kinds)
    console.explain(f"{files.shown_name(output, 'stdout')}: {told}")


def lines_text(found: dict[str, Segments], lines: dict[str, list[list[int]]]) -> str:
    """Polylines as OBJ, an object for each kind, with the points that they use."""
    text, count = [], 0
    for kind, segments in found.items():
        numbers: dict[int, int] = {}
        for line in lines[kind]:
            for point in line:
                numbers.setdefault(point, count + len(numbers) + 1)
        count += len(numbers)
        text.append(f"o {kind}\n")
        text += [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in segments.points[list(numbers)].tolist()]
        text += ["l " + " ".join(str(numbers[point]) for point in line) + "\n" for line in lines[kind]]
    return "".join(text)
