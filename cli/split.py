"""`curvify split`: polygons in, convex polygons out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

if TYPE_CHECKING:
    from curvify.convex import Split
    from curvify.mesh import PolygonMesh

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
    from curvify.cli.console import Console, count
    from curvify.convex import split_polygons
    from curvify.errors import FormatError, MeshError, OptionError
    from curvify.formats import write_mesh

    console = Console(quiet, verbose)
    format = files.check_output(output, output_format, no_clobber)
    if ascii and format != "ply":
        raise OptionError(f"--ascii is for PLY; {format} has no such choice")
    files.check_input(input, input_format)
    mesh = files.read_input(input, input_format)
    name = files.shown_name(input, "stdin")
    if not mesh.face_count:
        raise MeshError(f"{name}: the mesh has no faces; give a mesh with polygons")
    split = split_polygons(
        mesh.positions, mesh.face_offsets, mesh.face_vertices, rule=split_rule or "best", max_sides=max_sides
    )
    for text in [*mesh.warnings, *split_warnings(split, max_sides)]:
        console.warn(f"{name}: {text}")
    pieces = pieces_of(mesh, split)
    target = files.shown_name(output, "stdout")
    kind = mesh.position_dtype if precision == "input" else np.dtype(precision)
    with files.naming(target, FormatError):
        write_mesh(pieces, output, format, ascii=ascii, dtype=kind)
    console.explain(f"{target}: {count(mesh.face_count, 'face')} became {pieces.face_count:,}")


def pieces_of(mesh: PolygonMesh, split: Split) -> PolygonMesh:
    """The mesh with its faces cut; what a corner or face carries goes to its pieces."""
    import numpy as np

    corners, faces = split.source_corners, split.source_faces

    def carried(values: Any, source: Any) -> Any:
        return None if values is None else values[source]

    marks = mesh.marks
    return mesh.with_(
        face_offsets=split.face_offsets,
        face_vertices=split.face_vertices,
        corner_normals=carried(mesh.corner_normals, corners),
        corner_uvs=carried(mesh.corner_uvs, corners),
        face_materials=carried(mesh.face_materials, faces),
        face_groups=carried(mesh.face_groups, faces),
        face_smoothing=carried(mesh.face_smoothing, faces),
        marks=type(marks)(
            **{
                **vars(marks),
                "flat_faces": np.flatnonzero(np.isin(faces, marks.flat_faces)),
                "hole_faces": np.flatnonzero(np.isin(faces, marks.hole_faces)),
            }
        ),
    )


def split_warnings(split: Split, max_sides: int) -> list[str]:
    """What was cut and what could not be, each with its first face."""
    from curvify.cli.console import count

    texts = {
        "concave": ("concave face", "concave faces", "split into convex pieces"),
        "keyhole": ("face that visits a vertex twice", "faces that visit a vertex twice", "split into simple pieces"),
        "many_sided": (f"face with more than {max_sides} sides", f"faces with more than {max_sides} sides", "split"),
        "unsplit": ("face that no diagonal can make convex", "faces that no diagonal can make convex", "left as is"),
        "doubled": ("face", "faces", "cut along an existing edge, for want of any other diagonal"),
    }
    counts, first = split.counts, split.first
    return [
        f"{count(counts[reason], one, many)} {outcome}, first: {first[reason]}"
        for reason, (one, many, outcome) in texts.items()
        if counts.get(reason)
    ]
