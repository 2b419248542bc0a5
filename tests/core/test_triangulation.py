"""Polygons in triangles: they cover the polygons, keep their corners, and give no edge more sides than it has."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import curvify
from curvify.mesh import PolygonMesh
from curvify.polygons import newell_normals
from curvify.topology import build_topology
from curvify.triangulation import triangle_corners

SAMPLES = Path(__file__).parents[2] / "sample_meshes"


def triangles_of(mesh: PolygonMesh) -> PolygonMesh:
    vertices = mesh.face_vertices[triangle_corners(mesh)]
    return PolygonMesh(mesh.positions, 3 * np.arange(len(vertices) + 1), vertices.reshape(-1))


@pytest.mark.parametrize("name", ["pawn", "vase", "mixed"])
def test_triangles_cover_the_polygons_in_their_order(name):
    mesh = curvify.read(SAMPLES / f"{name}.obj")
    corners = triangle_corners(mesh)
    faces = mesh.corner_faces[corners]
    assert (faces == faces[:, :1]).all()
    assert (np.bincount(faces[:, 0]) == mesh.face_sizes - 2).all()
    assert (np.diff(faces[:, 0]) >= 0).all()
    area = newell_normals(mesh.positions, 3 * np.arange(len(corners) + 1), mesh.face_vertices[corners].reshape(-1))
    summed = np.stack([np.bincount(faces[:, 0], area[:, i]) for i in range(3)], axis=1)
    assert summed == pytest.approx(newell_normals(mesh.positions, mesh.face_offsets, mesh.face_vertices), abs=1e-12)


@pytest.mark.parametrize("height", [0.0, 0.2])
def test_polygons_on_a_vertex_of_two_edges_do_not_share_a_diagonal(height):
    # A flat box: two pentagons, back to back, and between them sides; vertex 4 has two edges only.
    ring = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [-0.1, 1]])
    points = np.concatenate([np.c_[ring, np.full(5, height)], [[1.0, 1.0, -1.0]]])
    faces = [(0, 1, 2, 3, 4), (0, 4, 3, 5), (1, 0, 5), (2, 1, 5), (3, 2, 5)]
    mesh = PolygonMesh(points, np.cumsum([0, *map(len, faces)]), np.concatenate(faces))
    for turn in range(5):
        first = np.roll(mesh.face_vertices[:5], turn)
        turned = triangles_of(mesh.with_(face_vertices=np.concatenate([first, mesh.face_vertices[5:]])))
        topology = build_topology(turned.positions, turned.face_offsets, turned.face_vertices)
        assert turned.face_count == 8
        assert (topology.uses == 2).all()
        assert not topology.nonmanifold.any()
