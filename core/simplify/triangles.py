"""The dense mesh as an oriented 2-manifold of triangles, made by cutting only.

Half-edge ``h = 3 f + i`` runs from corner ``i`` of triangle ``f`` to the next corner. Where the input is not a
manifold (edges with several faces, faces that run the same way, vertices where surfaces only touch) it is opened:
every fan of faces around a vertex gets a vertex of its own (Gueziec, Taubin, Lazarus & Horn 2001).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from curvify.arrays import cross, distinct
from curvify.convex import split_polygons
from curvify.errors import MeshError
from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.normals import unit
from curvify.topology import Topology, build_topology, clean_loops, components, fans, weld_vertices
from curvify.words import count_of


@dataclass(eq=False)
class Triangles:
    """An oriented manifold of triangles.

    ``positions (V,3)``, ``vertices (F,3)``; ``twin (3F,)`` the opposite half-edge, -1 on a boundary; ``normals
    (F,3)`` unit, zero without area; ``areas (F,)``; ``centroids (F,3)``.
    """

    positions: Floats
    vertices: Ints
    twin: Ints
    normals: Floats = field(init=False)
    areas: Floats = field(init=False)
    centroids: Floats = field(init=False)

    def __post_init__(self) -> None:
        a, b, c = (self.positions[self.vertices[:, i]] for i in range(3))
        area = cross(b - a, c - a)
        self.normals = unit(area)
        self.areas = np.linalg.norm(area, axis=1) / 2
        self.centroids = (a + b + c) / 3

    @property
    def face_count(self) -> int:
        return len(self.vertices)

    @property
    def tails(self) -> Ints:
        """Vertex that each half-edge leaves ``(3F,)``."""
        return self.vertices.reshape(-1)

    @property
    def heads(self) -> Ints:
        """Vertex that each half-edge ends at ``(3F,)``."""
        return self.vertices[:, [1, 2, 0]].reshape(-1)

    @property
    def neighbors(self) -> Ints:
        """Face across each side ``(F,3)``, -1 on a boundary."""
        return np.where(self.twin < 0, -1, self.twin // 3).reshape(-1, 3)

    @property
    def dual_edges(self) -> Ints:
        """Faces on the two sides of each interior edge ``(D,2)``."""
        one = np.flatnonzero(self.twin > np.arange(len(self.twin)))
        return np.stack([one // 3, self.twin[one] // 3], axis=1)

    @property
    def euler_number(self) -> int:
        """Vertices less edges plus faces."""
        edges = (len(self.twin) + int((self.twin < 0).sum())) // 2
        return len(self.positions) - edges + len(self.vertices)

    @property
    def is_closed(self) -> bool:
        """Whether there is no boundary."""
        return bool((self.twin >= 0).all())

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.positions, axis=0)))


def prepare_triangles(mesh: PolygonMesh, weld: str = "auto") -> tuple[Triangles, list[str]]:
    """The triangles of a polygon mesh, cut open to a manifold, and a sentence for whatever was changed.

    ``weld`` as for refining. Raises MeshError where no triangle with an area is left.
    """
    mesh.validate()
    notes: list[str] = []
    positions = np.ascontiguousarray(mesh.positions, dtype=np.float64)
    stand_in = weld_vertices(positions, mesh.face_offsets, mesh.face_vertices, weld)
    loops = clean_loops(mesh.face_offsets, stand_in[mesh.face_vertices])
    dropped = mesh.face_count - len(loops.source_faces)
    if dropped:
        notes.append(f"{count_of(dropped, 'face')} with fewer than 3 distinct corners dropped")
    offsets, vertices = loops.offsets, loops.vertices
    if len(vertices) != 3 * (len(offsets) - 1):
        split = split_polygons(positions, offsets, vertices, max_sides=3)
        offsets, vertices = split.face_offsets, split.face_vertices
    triangles = vertices[offsets[:-1][np.diff(offsets) == 3, None] + np.arange(3)]
    triangles = _without_doubles(triangles, notes)
    if not len(triangles):
        raise MeshError("the mesh has no face with 3 distinct corners; there is nothing to simplify")
    cut = _cut(positions, triangles, notes)
    if not cut.areas.any():
        raise MeshError("no face of the mesh has an area; there is nothing to simplify")
    return cut, notes


def _without_doubles(triangles: Ints, notes: list[str]) -> Ints:
    """The triangles without repeated corners, and the first only of those on the same three vertices."""
    ordered = np.sort(triangles, axis=1)
    proper = (ordered[:, 0] != ordered[:, 1]) & (ordered[:, 1] != ordered[:, 2])
    triangles, ordered = triangles[proper], ordered[proper]
    order = np.lexsort(ordered.T[::-1])
    same = (ordered[order[1:]] == ordered[order[:-1]]).all(axis=1)
    if same.any():
        notes.append(f"{count_of(int(same.sum()), 'face')} on the vertices of another dropped")
        triangles = np.delete(triangles, order[1:][same], axis=0)
    return triangles


def _cut(positions: Floats, triangles: Ints, notes: list[str]) -> Triangles:
    """Open whatever is not manifold: one vertex for each fan, until nothing changes."""
    offsets: Ints = 3 * np.arange(len(triangles) + 1)
    topology = build_topology(positions, offsets, triangles.reshape(-1))
    cut = int(topology.nonmanifold.sum())
    if cut:
        notes.append(f"{count_of(cut, 'edge')} with more than two faces or with faces that run the same way cut open")
    while True:
        roots, label = distinct(fans(topology))
        owners = topology.vertices[roots]
        order = np.argsort(owners, kind="stable")  # vertices keep the order of the input
        owners, label = owners[order], np.argsort(order, kind="stable")[label]
        positions = positions[owners]
        topology = build_topology(positions, offsets, label)
        if len(distinct(fans(topology))[0]) > len(owners):
            continue
        if not topology.nonmanifold.any():
            break
        positions, topology = _separate(positions, topology)
        offsets = topology.offsets
    touching = len(owners) - len(np.flatnonzero(np.bincount(owners)))
    if touching and not cut:
        notes.append(f"{count_of(touching, 'vertex', 'vertices')} where surfaces only touch taken apart")
    return Triangles(positions, topology.vertices.reshape(-1, 3), topology.twin)


def _separate(positions: Floats, topology: Topology) -> tuple[Floats, Topology]:
    """Halve the first side of every face that still shares an edge with strangers, at a midpoint of its own."""
    half_edges = np.flatnonzero(topology.nonmanifold[topology.edge])
    first = half_edges[np.flatnonzero(np.diff(half_edges // 3, prepend=-1))]
    faces, i = first // 3, first % 3
    triangles = topology.vertices.reshape(-1, 3)
    a, b, c = (triangles[faces, (i + k) % 3] for k in range(3))
    middle = len(positions) + np.arange(len(first))
    positions = np.concatenate([positions, (positions[a] + positions[b]) / 2])
    triangles = triangles.copy()
    triangles[faces] = np.stack([a, middle, c], axis=1)
    triangles = np.concatenate([triangles, np.stack([middle, b, c], axis=1)])
    offsets = 3 * np.arange(len(triangles) + 1)
    return positions, build_topology(positions, offsets, triangles.reshape(-1))


def face_components(mesh: Triangles) -> Ints:
    """Component ``(F,)`` of each face, 0, 1, ... by their first faces."""
    pairs = mesh.dual_edges
    return distinct(components(mesh.face_count, pairs[:, 0], pairs[:, 1]))[1]
