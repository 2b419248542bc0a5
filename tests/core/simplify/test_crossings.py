"""Crossings: found where surfaces run through each other, and only there."""

from __future__ import annotations

import numpy as np

import dense_meshes
from curvify.mesh import PolygonMesh
from curvify.simplify import Options, search, simplify
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


def thin_shell() -> PolygonMesh:
    """A sphere in a sphere, with so little room between that few polygons of one cut the other."""
    outer = dense_meshes.sphere(12)
    triangles = outer.face_vertices.reshape(-1, 3)
    points = np.concatenate([outer.positions, 0.9 * outer.positions])
    return dense_meshes.mesh_of(points, np.concatenate([triangles, triangles[:, ::-1] + outer.vertex_count]))


def test_regions_of_polygons_that_cross_are_halved(monkeypatch):
    assert not crosses_itself(prepare_triangles(thin_shell())[0])
    assert simplify(thin_shell(), Options(proxies=48)).counts["crossings"] == 0
    monkeypatch.setattr(search, "UNTANGLING", 0)
    assert simplify(thin_shell(), Options(proxies=48)).counts["crossings"] > 0


def test_the_number_wanted_goes_before_crossings_and_those_are_told():
    result = simplify(thin_shell(), Options(faces=60))
    assert result.mesh.face_count <= 60 * (1 + search.CLOSE)
    assert result.counts["crossings"] > 0
    assert [text for text in result.warnings if text.startswith("polygons cross each other in")]
    assert "so does the input" not in " ".join(result.warnings)
