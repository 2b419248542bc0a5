"""Polygons become triangles that fill them, edges stay those of the polygons, normals are the ones asked for."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from curvify.errors import OptionError
from curvify.gpu.shading import shading_normals
from curvify.gpu.triangles import polygon_edges, shown_faces, to_triangles, triangulate_corners
from curvify.mesh import Marks, PolygonMesh
from curvify.polygons import newell_normals
from surfaces import cube, icosahedron, unit, uv_sphere

OUTLINES = {
    "triangle": [[0, 0], [1, 0], [0, 1]],
    "square": [[0, 0], [1, 0], [1, 1], [0, 1]],
    "dart": [[0, 0], [2, -1], [0, 2], [-2, -1]],
    "dart, turned": [[2, -1], [0, 2], [-2, -1], [0, 0]],
    "house": [[0, 0], [2, 0], [2, 1], [1, 2], [0, 1]],
    "L": [[0, 0], [2, 0], [2, 1], [1, 1], [1, 3], [0, 3]],
    "star": [[np.cos(k * np.pi / 5) * (1 + k % 2), np.sin(k * np.pi / 5) * (1 + k % 2)] for k in range(10)],
    "comb": [[0, 0], [7, 0], [7, 3], [6, 3], [6, 1], [4, 1], [4, 3], [3, 3], [3, 1], [1, 1], [1, 3], [0, 3]],
    "circle": [[np.cos(a), np.sin(a)] for a in np.linspace(0, 2 * np.pi, 100, endpoint=False)],
}


def outlines() -> PolygonMesh:
    """All outlines in one mesh."""
    points = [[*point, float(k)] for k, outline in enumerate(OUTLINES.values()) for point in outline]
    ends = np.cumsum([0, *map(len, OUTLINES.values())]).tolist()
    return PolygonMesh.from_faces(points, [list(range(*pair)) for pair in pairwise(ends)])


def test_triangles_fill_each_polygon_without_overlap():
    mesh = outlines()
    corners = triangulate_corners(mesh)
    assert len(corners) == (mesh.face_sizes - 2).sum()
    face = mesh.corner_faces[corners]
    assert (face == face[:, :1]).all()
    points = mesh.positions[mesh.face_vertices[corners]]
    area = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])[:, 2]
    # None runs backwards, and together they have the polygon's area: they cover it once.
    assert (area > -1e-12).all()
    expected = newell_normals(mesh.positions, mesh.face_offsets, mesh.face_vertices)[:, 2]
    np.testing.assert_allclose(np.bincount(face[:, 0], area), expected, rtol=1e-12)


def test_edges_are_those_of_the_polygons():
    edges = polygon_edges(cube())
    assert edges.shape == (12, 2)
    lengths = np.linalg.norm(np.diff(cube().positions[edges], axis=1), axis=2)
    np.testing.assert_allclose(lengths, 2 / np.sqrt(3))  # no diagonal among them
    assert len(polygon_edges(outlines())) == outlines().corner_count


def test_corners_with_one_normal_share_a_wedge():
    mesh = cube()
    smooth = to_triangles(mesh, shading_normals(mesh, "smooth"))
    assert len(smooth.vertices) == 8
    np.testing.assert_allclose(smooth.normals, mesh.positions, atol=1e-6)
    flat = to_triangles(mesh, shading_normals(mesh, "flat"))
    for triangle in flat.triangles:
        points, normals = mesh.positions[flat.vertices[triangle]], flat.normals[triangle]
        own = np.cross(points[1] - points[0], points[2] - points[0])
        np.testing.assert_allclose(normals, [unit(own)] * 3, atol=1e-6)


def test_holes_are_not_shown():
    mesh = cube().with_(marks=Marks(hole_faces=np.array([1, 4])), corner_normals=np.arange(72.0).reshape(24, 3))
    shown = shown_faces(mesh)
    assert shown.faces() == [face for k, face in enumerate(mesh.faces()) if k not in (1, 4)]
    np.testing.assert_array_equal(shown.corner_normals[:8], mesh.corner_normals[[0, 1, 2, 3, 8, 9, 10, 11]])
    assert shown_faces(cube()).face_count == 6


def test_coarse_meshes_are_flat_and_fine_ones_smooth_where_nothing_else_is_said():
    for mesh in (cube(), icosahedron()):
        np.testing.assert_allclose(shading_normals(mesh), shading_normals(mesh, "flat"), atol=1e-12)
    fine = uv_sphere(64, 32)
    outward = fine.positions[fine.face_vertices]
    assert np.degrees(np.arccos((shading_normals(fine) * outward).sum(axis=1).clip(-1, 1))).max() < 0.5


def test_sharp_edges_of_a_fine_mesh_stay():
    count = 60
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    ring = np.c_[np.cos(angles), np.sin(angles)]
    points = np.concatenate([np.c_[ring, np.full(count, z)] for z in (0.0, 0.5)])
    sides = [[k, (k + 1) % count, count + (k + 1) % count, count + k] for k in range(count)]
    mesh = PolygonMesh.from_faces(points, [*sides, list(range(count, 2 * count)), list(range(count))[::-1]])
    normals = shading_normals(mesh)
    np.testing.assert_allclose(normals[: 4 * count, 2], 0, atol=1e-12)
    np.testing.assert_allclose((normals[: 4 * count] * points[mesh.face_vertices[: 4 * count]])[:, :2].sum(axis=1), 1)
    np.testing.assert_allclose(np.abs(normals[4 * count :, 2]), 1)


def test_normals_of_the_file_are_used_as_they_are():
    given = np.tile([0.0, 0.0, 2.0], (24, 1))
    given[5] = np.nan
    normals = shading_normals(cube().with_(corner_normals=given))
    np.testing.assert_array_equal(normals[5], 0)
    np.testing.assert_array_equal(np.delete(normals, 5, axis=0), np.tile([0, 0, 1], (23, 1)))
    assert not np.array_equal(shading_normals(cube().with_(corner_normals=given), "flat"), normals)


def test_a_word_that_is_no_shading():
    with pytest.raises(OptionError, match="auto, flat, smooth"):
        shading_normals(cube(), "round")


def test_faces_that_are_none_do_not_matter():
    mesh = PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 0, 0], [0, 1, 1, 0], [0, 1]])
    assert not np.isnan(shading_normals(mesh)).any()
    np.testing.assert_allclose(shading_normals(mesh)[:3], [[0, 0, 1]] * 3)
    assert to_triangles(mesh, shading_normals(mesh)).triangles.shape[1] == 3
