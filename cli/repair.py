"""`curvify repair`: meshes with defects in, the same without in."""

from __future__ import annotations

from typing import Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command
from curvify.cli.parameters import Whole

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
        type=Whole(min=0),
        default=0,
        show_default=True,
        metavar="N",
        help="Close holes of up to this many edges, each with one polygon.",
    ),
    options.weld,
    options.polygons_out,
)
def command(**given: Any) -> None:
    """Mend what refine only warns of.

    Seams are closed; faces without area, repeated ones and walls inside a body are removed; faces are turned to the
    side of their neighbors; bodies and surfaces that only touch at edges and vertices come apart; closed pieces that
    are inside out are turned; unused vertices are removed. Polygons, normals, texture coordinates, colors, materials,
    groups and marks are kept; no vertex is moved. What was done is told on stderr.
    """
    repair_file(**given)


def repair_file(input: str, holes: int, weld: str | None, quiet: bool, verbose: bool, **ends: Any) -> None:
    """Read, mend, write. Raises CurvifyError."""
    from curvify.cli.console import Console
    from curvify.cli.polygons import Ends, change_file
    from curvify.mesh import PolygonMesh
    from curvify.repair import repair_mesh

    def mend(mesh: PolygonMesh) -> tuple[PolygonMesh, list[str]]:
        mended, notes = repair_mesh(mesh, weld or "auto", holes)
        return mended, notes or ["nothing to mend"]

    console = Console(quiet, verbose)
    change_file(mend, console.tell, console, Ends({"IN": input}, **ends))
