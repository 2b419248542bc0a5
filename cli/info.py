"""`curvify info`: what a mesh is like, and what refine would do with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options
from curvify.cli.answers import print_json
from curvify.cli.group import COMMANDS, Command
from curvify.cli.surfaces import with_refine_options

if TYPE_CHECKING:
    from curvify.cli.surfaces import Asked
    from curvify.mesh import PolygonMesh
    from curvify.prepare import Coarse

EXAMPLES = (
    ("What is in this file, and would refine complain?", "curvify info coarse.obj"),
    ("The same for a program", "curvify info coarse.obj --json"),
    ("What would a finer surface take?", "curvify info coarse.obj --level 20"),
)
#: Refine is tried on meshes of up to this many faces: beyond, that would take longer than all the rest.
MOST_FACES = 100_000


@with_refine_options(headings=(options.SURFACE, options.SHARP, options.MESH))
@click.command(name="info", cls=Command, examples=EXAMPLES, short_help=COMMANDS["info"])
@options.only_in
@options.with_options(options.as_json, options.quiet)
def command(**given: Any) -> None:
    """Show what a mesh is like and what refine would do with it.

    Counts, sizes, pieces, holes and genus, edges that join no two faces, how planar and convex the faces are, what the
    file says beside the shape, and marks by their source. Then what refine would warn of, how many faces it would cut
    and how many it would make, with the options given. Vertices, edges and faces are counted from 0.
    """
    info_file(**given)


def info_file(input: str, input_format: str | None, as_json: bool, quiet: bool, **refine_options: Any) -> None:
    """Read, look, print. Raises CurvifyError for a file that cannot be read."""
    from curvify.cli import files
    from curvify.cli.surfaces import asked_for
    from curvify.errors import MeshError
    from curvify.inspection import describe_prepared
    from curvify.prepare import prepare_mesh

    mesh, name = files.open_input(input, input_format)
    asked = asked_for(refine_options)
    try:
        coarse = prepare_mesh(mesh, asked.mesh_options())
    except MeshError:
        coarse = None
    answer = {"input": input, **describe_prepared(mesh, coarse), "refine": prediction(mesh, coarse, asked)}
    if as_json:
        print_json("info", answer)
    else:
        from curvify.cli.info_text import as_text

        click.echo(as_text(name, answer, quiet))


def prediction(mesh: PolygonMesh, coarse: Coarse | None, asked: Asked) -> dict[str, Any]:
    """What refine would do: counts and warnings, or the error that it would end with, or why it was not tried."""
    from curvify.errors import CurvifyError

    told = {"scheme": asked.scheme, "level": asked.level}
    if mesh.face_count > MOST_FACES:
        reason = f"the mesh has more than {MOST_FACES:,} faces; 'curvify refine' with --dry-run tries"
        return {**told, "not_tried": reason}
    try:
        made = asked.surface(coarse or mesh)
    except CurvifyError as error:
        return {**told, "error": str(error)}
    split = {name: count for name, count in made.patches.counts.items() if name.endswith("_faces") and count}
    return {
        **told,
        "patches": len(made.sides),
        "faces": made.face_count(asked.level),
        "cut_or_odd": split,
        "warnings": made.warnings,
    }
