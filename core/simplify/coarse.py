"""The polygons as a mesh of its own: vertices, normals and marks taken from the dense mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.mesh import Bools, Ints, Marks, PolygonMesh
from curvify.simplify.features import sector_normals, sectors_of
from curvify.simplify.flats import facet_creases, level, planes_of, set_apart, straight_lines
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
    topology = polygons.topology(dense.positions)
    planes = planes_of(dense, labels, polygons)
    creases = creases | facet_creases(planes, topology)
    normals = sector_normals(dense, labels, polygons, creases)
    once = (topology.twin < 0) | (topology.twin > np.arange(len(creases)))
    ends = number[np.stack([polygons.vertices, polygons.vertices[topology.next]], axis=1)]
    edges = ends[creases & once & (topology.twin >= 0)]
    normals = level(normals, sectors_of(topology, creases), planes, topology)
    apart = set_apart(planes, topology, creases)
    straight = straight_lines(dense.positions, polygons, topology, creases, planes, apart)
    mesh = PolygonMesh(
        positions=dense.positions[used],
        face_offsets=polygons.offsets,
        face_vertices=number[polygons.vertices],
        corner_normals=normals,
        marks=Marks(
            crease_edges=edges,
            crease_sharpness=np.ones((len(edges), 2)),
            straight_edges=ends[straight & once],
            flat_faces=np.flatnonzero(apart),
        ),
    )
    return Drawn(mesh, polygons, creases, np.flatnonzero(used))
