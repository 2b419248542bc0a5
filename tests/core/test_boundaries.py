"""Open rims: planar where the input is, smooth where it turns little, straight where it is straight."""

from __future__ import annotations

import numpy as np
import pytest

import curvify
from curvify.mesh import PolygonMesh
from surfaces import (
    CROSS_TANGENTS,
    cylinder,
    directed_edges,
    flat_grid,
    half_edge_polynomials,
    open_edges,
    refined,
    unit,
    vase,
)

each_tangent = pytest.mark.parametrize("kind", CROSS_TANGENTS)


@each_tangent
def test_the_rims_of_a_vase_are_planar(kind: str) -> None:
    mesh = vase()
    dense = refined(mesh, 4, cross_tangent=kind)
    rim = np.unique(list(open_edges(dense.faces)))
    height = dense.positions[rim, 2]
    top = mesh.positions[:, 2].max()
    assert np.minimum(np.abs(height), np.abs(height - top)).max() < 1e-14
    assert len(rim) == 2 * 10 * 8


@each_tangent
def test_the_rims_of_a_vase_are_smooth(kind: str) -> None:
    """The two rim curves that meet at a rim vertex have one tangent there."""
    mesh = vase()
    patches = curvify.surface(mesh, cross_tangent=kind).patches
    topology = patches.topology
    rim = np.flatnonzero(topology.twin < 0)
    leaving: dict[int, list[np.ndarray]] = {}
    for corner, curve in zip(rim, half_edge_polynomials(patches, rim)[0], strict=True):
        leaving.setdefault(int(topology.vertices[corner]), []).append(unit(curve[1] - curve[0]))
        leaving.setdefault(int(topology.vertices[topology.next[corner]]), []).append(unit(curve[2] - curve[3]))
    assert len(leaving) == 20
    for one, other in leaving.values():
        assert np.abs(one + other).max() < 1e-12


@each_tangent
def test_rim_normals_are_perpendicular_to_the_rim(kind: str) -> None:
    dense = refined(vase(), 3, cross_tangent=kind)
    neighbors = dict(open_edges(dense.faces))
    before = {b: a for a, b in neighbors.items()}
    for vertex in range(10):
        along = unit(dense.positions[neighbors[vertex]] - dense.positions[before[vertex]])
        assert abs(along @ dense.normals[vertex]) < 1e-3


@each_tangent
@pytest.mark.parametrize("triangles", [False, True])
def test_a_flat_open_square_stays_a_flat_square(kind: str, triangles: bool) -> None:
    mesh = flat_grid(3, 3, triangles)
    dense = refined(mesh, 3, cross_tangent=kind)
    assert np.array_equal(dense.positions[:, 2], np.zeros(dense.vertex_count))
    assert np.abs(dense.normals - [0, 0, 1]).max() < 1e-14
    rim = dense.positions[np.unique(list(open_edges(dense.faces))), :2]
    assert np.minimum(np.abs(rim), np.abs(rim - 1)).min(axis=1).max() < 1e-15
    assert dense.positions[:, :2].min() > -1e-15
    assert dense.positions[:, :2].max() < 1 + 1e-15


@each_tangent
def test_a_single_polygon_keeps_straight_sides(kind: str) -> None:
    """A lone flat hexagon: its vertices have one face, so its corners stay corners."""
    angle = np.pi / 3 * np.arange(6)
    mesh = PolygonMesh.from_faces(np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1), [list(range(6))])
    dense = refined(mesh, 3, cross_tangent=kind)
    assert np.abs(dense.positions[:, 2]).max() < 1e-15
    edge_points = dense.positions[6 : 6 + 6 * 5, :2]
    apothem = np.cos(np.pi / 6)
    across = np.stack([edge_points @ [np.cos(a), np.sin(a)] for a in np.pi / 6 + angle]).max(axis=0)
    assert np.abs(across - apothem).max() < 1e-15


def test_the_rim_of_an_open_cylinder_is_a_circle() -> None:
    dense = refined(cylinder(12), 4)
    rim = dense.positions[np.unique(list(open_edges(dense.faces)))]
    assert np.abs(np.hypot(rim[:, 0], rim[:, 1]) - 1).max() < 1e-5


def test_a_rim_that_turns_sharply_keeps_its_corner() -> None:
    """A strip folded round the corner of a square keeps that corner: the turn is 90 degrees."""
    ring = [[1.0, 0], [2, 0], [2, 1], [1, 1], [0, 1], [0, 0]]
    mesh = PolygonMesh.from_faces([[x, y, 0] for x, y in ring], [[0, 1, 2, 3], [0, 3, 4, 5]])
    dense = refined(mesh, 3)
    assert np.abs(dense.positions[:, 2]).max() < 1e-15
    assert dense.positions.min() > -1e-15
    assert np.maximum(dense.positions[:, 0] - 2, dense.positions[:, 1] - 1).max() < 1e-15


def test_every_rim_edge_is_used_once() -> None:
    dense = refined(vase(), 2)
    assert set(directed_edges(dense.faces).values()) == {1}
