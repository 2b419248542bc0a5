"""Whatever comes in becomes an oriented manifold, by cutting only."""

from __future__ import annotations

import numpy as np
import pytest

import dense_meshes
from curvify.errors import MeshError
from curvify.mesh import PolygonMesh
from curvify.simplify.triangles import face_components, prepare_triangles
from curvify.topology import build_topology, fans


def check_manifold(mesh):
    topology = build_topology(mesh.positions, 3 * np.arange(mesh.face_count + 1), mesh.vertices.reshape(-1))
    assert not topology.nonmanifold.any()
    assert len(np.unique(fans(topology))) == len(mesh.positions)
    assert np.array_equal(topology.twin, mesh.twin)


def test_a_manifold_stays_as_it_is():
    torus = dense_meshes.torus()
    mesh, notes = prepare_triangles(torus)
    assert np.array_equal(mesh.vertices.reshape(-1), torus.face_vertices)
    assert (notes, mesh.is_closed, mesh.euler_number) == ([], True, 0)


@pytest.mark.parametrize(("holes", "euler"), [(0, 2), (1, 0), (3, -4), (6, -10)])
def test_euler_number_tells_the_genus(holes, euler):
    assert prepare_triangles(dense_meshes.plate(holes))[0].euler_number == euler


def test_edges_of_many_faces_and_touching_surfaces_are_cut_open():
    mesh, notes = prepare_triangles(dense_meshes.pinched())
    check_manifold(mesh)
    assert "cut open" in notes[0]
    assert face_components(mesh).max() + 1 >= 3


def test_faces_that_run_against_each_other_are_cut_apart():
    sheet = dense_meshes.sheet(4)
    triangles = sheet.face_vertices.reshape(-1, 3).copy()
    triangles[::2] = triangles[::2, ::-1]
    mesh, notes = prepare_triangles(dense_meshes.mesh_of(sheet.positions, triangles))
    check_manifold(mesh)
    assert len(notes) == 1


def test_an_edge_that_joins_three_faces_elsewhere_joined_is_halved():
    """Both ends of the middle edge have one fan each, so that taking vertices apart is not enough."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.5, 0, 1]], dtype=float)
    faces = [[0, 1, 2], [0, 1, 3], [0, 1, 4], [2, 1, 3], [3, 1, 4], [0, 2, 3], [0, 3, 4]]
    mesh, _ = prepare_triangles(PolygonMesh.from_faces(points, faces))
    check_manifold(mesh)


def test_doubles_and_broken_faces_are_dropped_and_told():
    sheet = dense_meshes.sheet(4)
    faces = [*sheet.faces(), sheet.faces()[0][::-1], [0, 0, 1]]
    mesh, notes = prepare_triangles(PolygonMesh.from_faces(sheet.positions, faces))
    assert mesh.face_count == sheet.face_count
    assert len(notes) == 2


def test_polygons_are_cut_into_triangles():
    mesh, _ = prepare_triangles(PolygonMesh.from_faces(np.eye(3)[[0, 1, 2, 0]] * [[1], [1], [1], [2]], [[0, 1, 2, 3]]))
    assert mesh.face_count == 2


def test_nothing_left_is_an_error():
    with pytest.raises(MeshError, match="nothing to simplify"):
        prepare_triangles(PolygonMesh.from_faces(np.eye(3), [[0, 0, 1]]))
