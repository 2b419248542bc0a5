"""From polygons to what a GPU draws: triangles on wedges, and the polygons' own edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.arrays import cross, distinct
from curvify.convex import split_polygons
from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.polygons import next_corners
from curvify.topology import weld_vertices


@dataclass(eq=False)
class Triangles:
    """Triangles ``triangles (T,3)`` on wedges: a vertex ``vertices (W,)`` with a normal ``normals (W,3)`` float32."""

    vertices: Ints
    normals: Floats
    triangles: Ints


def shown_faces(mesh: PolygonMesh) -> PolygonMesh:
    """The mesh without its holes: faces that only complete the topology."""
    if not len(mesh.marks.hole_faces):
        return mesh
    kept = np.ones(mesh.face_count, dtype=bool)
    kept[mesh.marks.hole_faces] = False
    corners = np.repeat(kept, mesh.face_sizes)
    return PolygonMesh(
        mesh.positions,
        np.concatenate([[0], np.cumsum(mesh.face_sizes[kept])]).astype(np.int64),
        mesh.face_vertices[corners],
        corner_normals=None if mesh.corner_normals is None else mesh.corner_normals[corners],
    )


def to_triangles(mesh: PolygonMesh, corner_normals: Floats) -> Triangles:
    """Triangles that fill the polygons of a mesh, with the given normals ``(C,3)`` of its corners.

    Concave polygons are cut at their concave corners; corners of a vertex that share a normal share a wedge.
    """
    corners = triangulate_corners(mesh)
    vertices, wedge, normals = _wedges(mesh, corner_normals.astype(np.float32))
    return Triangles(vertices, normals, wedge[corners])


def _wedges(mesh: PolygonMesh, corner_normals: Floats) -> tuple[Ints, Ints, Floats]:
    """Vertex of each wedge ``(W,)``, wedge of each corner ``(C,)``, normal of each wedge ``(W,3)``.

    Wedges are the vertices with the normal of their first corner, and every corner that has another one.
    """
    count = mesh.vertex_count
    normals = np.zeros((count, 3), dtype=np.float32)
    normals[mesh.face_vertices[::-1]] = corner_normals[::-1]
    others = np.flatnonzero((normals[mesh.face_vertices] != corner_normals).any(axis=1))
    wedge = mesh.face_vertices.copy()
    wedge[others] = count + np.arange(len(others))
    vertices = np.concatenate([np.arange(count), mesh.face_vertices[others]])
    return vertices, wedge, np.concatenate([normals, corner_normals[others]])


def triangulate_corners(mesh: PolygonMesh) -> Ints:
    """Corners of the triangles ``(T,3)`` that fill the polygons, those of triangles first, then of quads."""
    sizes, starts = mesh.face_sizes, mesh.face_offsets[:-1]
    threes = starts[sizes == 3][:, None] + np.arange(3)
    fours = starts[sizes == 4][:, None] + np.arange(4)
    return np.concatenate([threes, _halves(mesh.positions, mesh.face_vertices, fours), _fans(mesh)])


def _halves(positions: Floats, vertices: Ints, quads: Ints) -> Ints:
    """Two triangles ``(2Q,3)`` for each quad of corners ``(Q,4)``, cut from a concave corner where there is one."""
    points = positions[vertices[quads.T]]
    area = cross(points[2] - points[0], points[3] - points[1])
    turned = np.zeros(len(quads), dtype=bool)
    for corner in (1, 3):
        turn = cross(points[corner] - points[corner - 1], points[(corner + 1) % 4] - points[corner])
        turned |= np.einsum("qi,qi->q", turn, area) < 0
    quads = np.where(turned[:, None], np.roll(quads, -1, axis=1), quads)
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def _fans(mesh: PolygonMesh) -> Ints:
    """Triangles ``(n,3)`` of corners for the faces with more than four sides: fans in their convex pieces."""
    wide = np.flatnonzero(mesh.face_sizes > 4)
    sizes = mesh.face_sizes[wide]
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    corners = np.repeat(mesh.face_offsets[wide] - offsets[:-1], sizes) + np.arange(offsets[-1])
    most = int(sizes.max(initial=3))
    split = split_polygons(mesh.positions, offsets, mesh.face_vertices[corners], max_sides=most)
    firsts = np.repeat(split.face_offsets[:-1], np.diff(split.face_offsets))
    every = np.arange(len(firsts))
    middle = every[(every > firsts) & (next_corners(split.face_offsets) != firsts)]
    return corners[split.source_corners[np.stack([firsts[middle], middle, middle + 1], axis=1)]]


def polygon_edges(mesh: PolygonMesh) -> Ints:
    """The edges of the polygons ``(E,2)`` as vertex ids, each once, also where a file had to repeat their vertices."""
    tails = weld_vertices(mesh.positions, mesh.face_offsets, mesh.face_vertices, "auto")[mesh.face_vertices]
    heads = tails[next_corners(mesh.face_offsets)]
    low, high = np.minimum(tails, heads), np.maximum(tails, heads)
    keys, _ = distinct(low * mesh.vertex_count + high)
    return np.stack([keys // mesh.vertex_count, keys % mesh.vertex_count], axis=1)


def used_vertices(mesh: PolygonMesh) -> Ints:
    """The vertices that faces use, ascending."""
    used = np.zeros(mesh.vertex_count, dtype=bool)
    used[mesh.face_vertices] = True
    return np.flatnonzero(used)
