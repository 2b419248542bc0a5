"""The last resort at corners that fold: straight creases, normals that lean less."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from curvify.mesh import Floats, Marks, PolygonMesh
from curvify.normals import unit
from curvify.simplify.folds import folded_corners
from curvify.simplify.relax import lean_less, relax_folded, straighten_folded


def roof(turn: float) -> PolygonMesh:
    """A flat triangle and another nearly in its plane, whose normals put the crease between them off its chord."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.4, 0], [0.5, -0.4, 0.002]], dtype=float)
    normals = np.tile([0.0, 0.0, 1.0], (6, 1))
    normals[5] = unit(np.array([[0.3, 0.2, 1.0]]))
    normals[3:5] = unit(np.array([[-np.sin(turn), 0.3 * np.sin(turn), np.cos(turn)]]))
    marks = Marks(crease_edges=np.array([[0, 1]]), crease_sharpness=np.ones((1, 2)), flat_faces=np.array([0]))
    return PolygonMesh(
        positions, np.array([0, 3, 6]), np.array([0, 1, 2, 1, 0, 3]), corner_normals=normals, marks=marks
    )


def fan(lean: float) -> PolygonMesh:
    """A hexagon of triangles, level, with a normal at its middle that leans by so many degrees."""
    angles = np.arange(6) * np.pi / 3
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(6)], axis=1)
    corners = np.stack([np.zeros(6, dtype=int), 1 + np.arange(6), 1 + (np.arange(6) + 1) % 6], axis=1)
    normals = np.tile([0.0, 0.0, 1.0], (6, 3, 1))
    normals[:, 0] = [np.sin(np.radians(lean)), 0, np.cos(np.radians(lean))]
    return PolygonMesh(
        np.concatenate([np.zeros((1, 3)), ring]),
        np.arange(7) * 3,
        corners.reshape(-1),
        corner_normals=normals.reshape(-1, 3),
    )


def count(mesh: PolygonMesh) -> int:
    return int(folded_corners(mesh).reversed.sum())


@pytest.mark.parametrize("turn", [0.02, 0.1])
def test_a_crease_of_a_flat_polygon_is_made_straight(turn):
    mesh = roof(turn)
    assert count(mesh) > 0
    mended = straighten_folded(mesh)
    assert count(mended) == 0
    np.testing.assert_array_equal(np.sort(mended.marks.straight_edges, axis=1), [[0, 1]])


def test_a_crease_that_is_not_of_a_flat_polygon_keeps_its_curve():
    mesh = roof(0.02)
    mesh.marks.flat_faces = np.zeros(0, dtype=np.int64)
    assert straighten_folded(mesh) is mesh


def test_a_crease_keeps_its_curve_where_polygons_would_err_more():
    mesh = roof(0.02)

    def errors(worse: float) -> Callable[[PolygonMesh], Floats]:
        return lambda changed: np.array([0.1, worse if len(changed.marks.straight_edges) else 0.2])

    assert not len(straighten_folded(mesh, errors(0.3)).marks.straight_edges)
    assert count(straighten_folded(mesh, errors(0.2))) == 0


@pytest.mark.parametrize("lean", [100, 110, 120])
def test_normals_that_lean_too_far_are_turned_back_as_little_as_helps(lean):
    mesh = fan(lean)
    assert count(mesh) == 4
    mended = lean_less(mesh)
    assert count(mended) == 0
    middle = mended.corner_normals.reshape(6, 3, 3)[:, 0]
    np.testing.assert_array_equal(middle, np.tile(middle[0], (6, 1)))
    left = np.degrees(np.arccos(middle[0, 2]))
    assert 40 < left < 90
    np.testing.assert_array_equal(mended.positions, mesh.positions)


def test_a_mesh_without_folds_stays_the_same():
    mesh = fan(60)
    assert relax_folded(mesh) is mesh
