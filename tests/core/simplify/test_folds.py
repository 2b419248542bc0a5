"""Folds: found where the curves turn back, and taken away by cuts and collapses that change nothing else."""

from __future__ import annotations

import numpy as np
import pytest

import dense_meshes
from curvify.mesh import Marks, PolygonMesh
from curvify.options import MeshOptions
from curvify.prepare import prepare_mesh
from curvify.simplify import Options, simplify
from curvify.simplify.folds import (
    LEAST_SINE,
    collapse_folded,
    folded_corners,
    split_folded_corners,
    unfold,
)
from curvify.topology import build_topology, is_closed


def on_sphere(points: list[list[float]], faces: list[list[int]], **attributes: object) -> PolygonMesh:
    """A mesh of points blown up to the unit sphere, with its normals."""
    positions = np.array(points, dtype=float)
    positions /= np.linalg.norm(positions, axis=1, keepdims=True)
    flat = np.array([v for face in faces for v in face])
    return PolygonMesh.from_faces(positions, faces, corner_normals=positions[flat], **attributes)


def cube() -> tuple[list[list[float]], list[list[int]]]:
    corners = [[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return corners, faces


def cube_with_a_t() -> PolygonMesh:
    """A cube on the sphere whose front is cut from the middle of the bottom edge to that of the top edge."""
    corners, faces = cube()
    faces[2:3] = [[0, 8, 9, 4], [8, 1, 5, 9]]
    faces[0] = [0, 2, 3, 1, 8]
    faces[1] = [4, 9, 5, 7, 6]
    return on_sphere([*corners, [0, -1, -1], [0, -1, 1]], faces)


def euler(mesh: PolygonMesh) -> int:
    topology = build_topology(mesh.positions, mesh.face_offsets, mesh.face_vertices)
    assert is_closed(topology)
    return mesh.vertex_count - len(topology.edges) + mesh.face_count


def test_sines_are_those_of_the_curves():
    mesh = simplify(dense_meshes.torus(), Options(faces=60)).mesh
    coarse = prepare_mesh(mesh, MeshOptions(weld="never"))
    curves = coarse.edge_curves(coarse.features())
    sines = folded_corners(mesh).sines
    for face, loop in enumerate(mesh.faces()):
        for i, vertex in enumerate(loop):
            ahead, back = (_leaving(coarse, curves, vertex, loop[(i + step) % len(loop)]) for step in (1, -1))
            corner = mesh.face_offsets[face] + i
            volume = np.cross(ahead, back) @ mesh.corner_normals[corner]
            assert sines[corner] == pytest.approx(volume / np.linalg.norm(ahead) / np.linalg.norm(back), abs=1e-9)


def _leaving(coarse, curves, vertex: int, other: int) -> np.ndarray:
    """Derivative of the curve from one vertex to another, up to its factor 3."""
    edge = np.flatnonzero((np.sort(coarse.topology.edges, axis=1) == sorted((vertex, other))).all(axis=1))[0]
    points = curves[edge] if coarse.topology.edges[edge, 0] == vertex else curves[edge][::-1]
    return points[1] - points[0]


def test_a_third_edge_into_a_straight_line_is_flagged_and_cut():
    mesh = cube_with_a_t()
    folds = folded_corners(mesh)
    assert set(mesh.face_vertices[folds.flagged]) == {8, 9}
    assert not folds.reversed.any()
    assert np.flatnonzero(folds.polygons(folds.flagged)).tolist() == [0, 1]
    done = split_folded_corners(mesh)
    assert (done.cuts, done.mesh.face_count) == (2, mesh.face_count + 2)
    assert not folded_corners(done.mesh).flagged.any()
    assert np.array_equal(done.mesh.positions, mesh.positions)
    assert np.array_equal(done.mesh.face_vertices, mesh.face_vertices[done.corners])
    assert np.array_equal(done.mesh.corner_normals, mesh.corner_normals[done.corners])
    assert done.diagonals.sum() == 4
    assert euler(done.mesh) == 2


def test_a_mesh_without_folds_stays_as_it_is():
    mesh = on_sphere(*cube())
    done = unfold(mesh)
    assert (done.cuts, done.collapses) == (0, 0)
    assert done.mesh.faces() == mesh.faces()


def test_straight_corners_between_creases_and_in_flat_faces_may_stay():
    corners, faces = cube()
    faces[0], faces[2] = [0, 2, 3, 1, 8], [0, 8, 1, 5, 4]
    pairs = np.array([[0, 8], [8, 1]])
    crease = Marks(crease_edges=pairs, crease_sharpness=np.ones((2, 2)))
    box = PolygonMesh.from_faces([*corners, [0, -1, -1]], faces)
    for marks in (crease, Marks(flat_faces=np.arange(6))):
        folds = folded_corners(box.with_(marks=marks))
        at = box.face_vertices == 8
        assert (folds.sines[at] < LEAST_SINE).all()
        assert folds.straight[at].all()
        assert not folds.flagged[at].any()


def test_smooth_vertices_of_two_edges_go():
    corners, faces = cube()
    faces[0], faces[2] = [0, 2, 3, 1, 8], [0, 8, 1, 5, 4]
    mesh = on_sphere([*corners, [0, -1, -1]], faces, marks=Marks(flat_faces=np.array([4])))
    mesh.positions[8] = mesh.positions[:2].mean(axis=0)
    assert folded_corners(mesh).flagged[mesh.face_vertices == 8].any()
    done = collapse_folded(mesh)
    assert (done.collapses, done.mesh.vertex_count) == (1, 8)
    assert sorted(map(sorted, done.mesh.faces())) == sorted(map(sorted, cube()[1]))
    assert done.vertices.tolist() == list(range(8))
    assert done.mesh.marks.flat_faces.tolist() == [4]
    assert euler(done.mesh) == 2
    assert not folded_corners(done.mesh).flagged.any()


def test_the_short_edge_of_a_folded_triangle_collapses():
    """A fan around the pole whose hub is doubled, one copy with a normal that turns its triangles over."""
    angle = 2 * np.pi * np.arange(6) / 6
    ring = [[np.cos(a), np.sin(a), 0.8] for a in angle]
    points = [*ring, [0.002, 0, 1.3], [-0.002, 0, 1.3], [0, 0, -1]]
    top = [[0, 1, 6], [1, 7, 6], [1, 2, 7], [2, 3, 7], [3, 4, 7], [4, 5, 7], [5, 6, 7], [5, 0, 6]]
    mesh = on_sphere(points, top + [[(i + 1) % 6, i, 8] for i in range(6)])
    normals = mesh.corner_normals.copy()
    normals[mesh.face_vertices == 6] = np.array([0.95, 0, -0.3]) / np.hypot(0.95, 0.3)
    mesh = mesh.with_(corner_normals=normals)
    before = folded_corners(mesh)
    assert before.reversed.any()
    done = unfold(mesh)
    assert done.collapses == 1
    assert done.mesh.vertex_count == mesh.vertex_count - 1
    assert done.vertices.tolist() == [0, 1, 2, 3, 4, 5, 7, 8]
    assert euler(done.mesh) == 2
    assert not folded_corners(done.mesh).flagged.any()
    assert np.array_equal(done.mesh.positions[done.mesh.face_vertices], done.mesh.corner_normals)


def test_a_vertex_that_stands_out_does_not_collapse():
    corners, faces = cube()
    faces[0], faces[2] = [0, 2, 3, 1, 8], [0, 8, 1, 5, 4]
    mesh = on_sphere([*corners, [0, -1, -1]], faces)
    assert collapse_folded(mesh).mesh.faces() == mesh.faces()


def test_what_cannot_be_helped_stays():
    """A tetrahedron with one normal turned inside: no cut and no collapse is possible."""
    mesh = on_sphere([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    normals = mesh.corner_normals.copy()
    normals[mesh.face_vertices == 0] *= -1
    mesh = mesh.with_(corner_normals=normals)
    assert folded_corners(mesh).flagged.any()
    done = unfold(mesh)
    assert done.mesh.faces() == mesh.faces()
