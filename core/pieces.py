"""A polygon mesh with its difficult faces cut into convex ones, and what there is to say about that."""

from __future__ import annotations

from typing import Any

import numpy as np

from curvify.convex import Split, split_polygons
from curvify.mesh import Ints, PolygonMesh
from curvify.records import replaced
from curvify.words import count_of

#: More sides than this are split before a surface is built.
MAX_SIDES = 64


def split_mesh(mesh: PolygonMesh, rule: str = "best", max_sides: int = MAX_SIDES) -> tuple[PolygonMesh, list[str]]:
    """The mesh with concave, keyhole and many-sided faces cut, and a sentence for each kind.

    Vertices stay as they are; what a corner or a face carries goes to its pieces. ``rule``: ``best`` or ``closest``.
    Raises OptionError for an unknown rule or fewer than 3 sides.
    """
    split = split_polygons(mesh.positions, mesh.face_offsets, mesh.face_vertices, rule=rule, max_sides=max_sides)
    return pieces_of(mesh, split), split_notes(split, max_sides)


def pieces_of(mesh: PolygonMesh, split: Split) -> PolygonMesh:
    """The mesh with its faces cut as ``split`` says."""
    corners, faces = split.source_corners, split.source_faces

    def carried(values: Any, source: Ints) -> Any:
        return None if values is None else values[source]

    return mesh.with_(
        face_offsets=split.face_offsets,
        face_vertices=split.face_vertices,
        corner_normals=carried(mesh.corner_normals, corners),
        corner_uvs=carried(mesh.corner_uvs, corners),
        face_materials=carried(mesh.face_materials, faces),
        face_groups=carried(mesh.face_groups, faces),
        face_smoothing=carried(mesh.face_smoothing, faces),
        marks=replaced(
            mesh.marks,
            flat_faces=np.flatnonzero(np.isin(faces, mesh.marks.flat_faces)),
            hole_faces=np.flatnonzero(np.isin(faces, mesh.marks.hole_faces)),
        ),
    )


def split_notes(split: Split, max_sides: int = MAX_SIDES, source_faces: Ints | None = None) -> list[str]:
    """What was cut and what could not be, each with the first face: by ``source_faces (F,)`` where those are given."""
    wide = f"with more than {max_sides} sides"
    texts = {
        "concave": ("concave face", "concave faces", "split into convex pieces"),
        "keyhole": ("face that visits a vertex twice", "faces that visit a vertex twice", "split into simple pieces"),
        "many_sided": (f"face {wide}", f"faces {wide}", "split"),
        "folding": ("face that would fold", "faces that would fold", "split"),
        "unsplit": ("face that no diagonal can make convex", "faces that no diagonal can make convex", "left as is"),
        "doubled": ("face", "faces", "cut along an existing edge, for want of any other diagonal"),
    }
    counts, first = split.counts, split.first
    notes = []
    for reason, (one, many, outcome) in texts.items():
        if counts.get(reason):
            face = first[reason] if source_faces is None else int(source_faces[first[reason]])
            notes.append(f"{count_of(counts[reason], one, many)} {outcome}, first: {face}")
    return notes
