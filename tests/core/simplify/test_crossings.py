"""Crossings: found where surfaces run through each other, and only there."""

from __future__ import annotations

import numpy as np

import dense_meshes
from curvify.mesh import PolygonMesh
from curvify.simplify import Options, simplify
from curvify.simplify.crossings import crosses_itself, crossing_polygons
from curvify.simplify.triangles import prepare_triangles


def two_tori(apart: float) -> PolygonMesh:
    torus = dense_meshes.torus(24, 12)
    points = np.concatenate([torus.positions, torus.positions + np.array([apart, 0, 0])])
    triangles = torus.face_vertices.reshape(-1, 3)
    return dense_meshes.mesh_of(points, np.concatenate([triangles, triangles + torus.vertex_count]))


def test_polygons_that_cross_are_found():
    square = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]
    upright = [[1, 1, -1], [1, 1, 1], [1, 3, 1], [1, 3, -1]]
    mesh = PolygonMesh.from_faces(square + upright, [[0, 1, 2, 3], [4, 5, 6, 7]])
    assert set(map(tuple, np.sort(crossing_polygons(mesh), axis=1).tolist())) == {(0, 1)}
    away = PolygonMesh.from_faces(np.add(square + upright, [[0, 0, 0]] * 4 + [[5, 0, 0]] * 4), mesh.faces())
    assert not len(crossing_polygons(away))


def test_neighbors_do_not_cross():
    torus = dense_meshes.torus()
    assert not crosses_itself(prepare_triangles(torus)[0])
    assert not len(crossing_polygons(simplify(torus, Options(faces=60)).mesh))


def test_what_crosses_before_and_after_is_told():
    result = simplify(two_tori(0.7), Options(faces=120))
    assert result.counts["crossings"] > 0
    assert "so does the input" in " ".join(result.warnings)
    assert simplify(two_tori(4.0), Options(faces=120)).counts["crossings"] == 0


def test_polygons_between_which_a_gap_is_thin_are_taken_apart():
    """Two spheres, one inside the other with little room between: few polygons of one would cut the other."""
    outer = dense_meshes.sphere(12)
    triangles = outer.face_vertices.reshape(-1, 3)
    points = np.concatenate([outer.positions, 0.9 * outer.positions])
    shell = dense_meshes.mesh_of(points, np.concatenate([triangles, triangles[:, ::-1] + outer.vertex_count]))
    assert not crosses_itself(prepare_triangles(shell)[0])
    result = simplify(shell, Options(faces=40))
    crossings = result.counts["crossings"]
    assert crossings == 0 or "polygons cross" in " ".join(result.warnings)
