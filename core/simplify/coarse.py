"""The polygons as a mesh of its own: vertices, normals and marks taken from the dense mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.mesh import Bools, Ints, Marks, PolygonMesh
from curvify.simplify.features import flat_polygons, sector_normals
from curvify.simplify.polygons import Polygons
from curvify.simplify.triangles import Triangles


@dataclass(eq=False)
class Drawn:
    """A coarse ``mesh`` with normals and marks, and the ``polygons`` in vertices of the dense mesh that it shows.

    ``creases (C,)`` half-edges; ``vertices (V,)`` of the dense mesh that the mesh's own are.
    """

    mesh: PolygonMesh
    polygons: Polygons
    creases: Bools
    vertices: Ints

    def changed(self, mesh: PolygonMesh, corners: Ints, diagonals: Bools, vertices: Ints) -> Drawn:
        """Another mesh made from this one: of its ``corners (C',)``, with ``diagonals (C',)``, on its ``vertices``."""
        kept = self.vertices[vertices]
        polygons = self.polygons.recut(mesh.face_offsets, corners, diagonals, kept[mesh.face_vertices])
        return Drawn(mesh, polygons, self.creases[corners] & ~diagonals, kept)


def draw(dense: Triangles, labels: Ints, polygons: Polygons, creases: Bools) -> Drawn:
    """The polygons of regions ``labels (F,)`` as a mesh, with normals and marks."""
    used = np.zeros(len(dense.positions), dtype=bool)
    used[polygons.vertices] = True
    number = np.cumsum(used) - 1
    mesh = PolygonMesh(
        positions=dense.positions[used],
        face_offsets=polygons.offsets,
        face_vertices=number[polygons.vertices],
        corner_normals=sector_normals(dense, labels, polygons, creases),
        marks=_marks(dense, labels, polygons, creases, number),
    )
    return Drawn(mesh, polygons, creases, np.flatnonzero(used))


def _marks(dense: Triangles, labels: Ints, polygons: Polygons, creases: Bools, number: Ints) -> Marks:
    """Crease edges, and flat faces that only creases or their like in one plane surround."""
    topology = polygons.topology(dense.positions)
    once = np.flatnonzero(creases & (topology.twin > np.arange(len(creases))))
    edges = number[np.stack([polygons.vertices[once], polygons.vertices[topology.next[once]]], axis=1)]
    flat = flat_polygons(dense, labels, polygons)
    return Marks(
        crease_edges=edges,
        crease_sharpness=np.ones((len(edges), 2)),
        flat_faces=np.flatnonzero(flat & _set_apart(topology.faces, topology.twin, creases, flat)),
    )


def _set_apart(faces: Ints, twin: Ints, creases: Bools, flat: Bools) -> Bools:
    """Faces ``(P,)`` each side of which is a crease, a boundary or shared with a flat face."""
    beside = (twin >= 0) & flat[faces[np.maximum(twin, 0)]]
    open_ = np.bincount(faces, ~(creases | beside), len(flat))
    return open_ == 0
