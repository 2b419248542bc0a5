"""Curves on dense meshes, where they are known."""

from __future__ import annotations

import numpy as np
import pytest

import curvify
from bodies import boxes
from curvify.curves import chained, curves
from surfaces import cylinder, mixed_ball, torus


def test_edges_are_those_of_the_coarse_mesh():
    mesh = mixed_ball()
    dense = curvify.refine(mesh, level=3)
    lines = chained(curves(dense, "edges"))
    assert {len(line) for line in lines} == {7}
    ends = {frozenset((line[0], line[-1])) for line in lines}
    expected = {frozenset(p) for face in mesh.faces() for p in zip(face, face[1:] + face[:1], strict=True)}
    assert ends == expected


def test_rims_are_closed_curves():
    dense = curvify.refine(cylinder(6), level=2)
    segments = curves(dense, "rims")
    lines = chained(segments)
    assert [len(line) for line in lines] == [25, 25]
    assert all(line[0] == line[-1] for line in lines)
    assert set(np.round(segments.points[np.concatenate(lines), 2], 9)) == {0.0, 1.0}
    assert chained(curves(curvify.refine(torus(), level=2), "rims")) == []


def test_cells_have_all_sides():
    dense = curvify.refine(torus(), level=2)
    assert len(curves(dense, "cells").ends) == 2 * dense.face_count


def test_the_silhouette_of_a_torus_from_above_is_two_circles():
    dense = curvify.refine(torus(12, 8), level=6)
    segments = curves(dense, "silhouette", (0, 0, 1))
    lines = chained(segments)
    assert len(lines) == 2
    assert all(line[0] == line[-1] for line in lines)
    assert np.abs(segments.points[np.concatenate(lines), 2]).max() < 1e-9


def test_the_silhouette_of_a_sphere_lies_across_the_view():
    view = np.array([1.0, -2.0, 0.5])
    mesh = mixed_ball()
    dense = curvify.refine(mesh, level=8)
    segments = curves(dense, "silhouette", view)
    points = segments.points[np.concatenate(chained(segments))]
    assert np.abs(points @ view / np.linalg.norm(view)).max() < 0.05


def test_creases_between_front_and_back_belong_to_the_silhouette():
    dense = curvify.refine(boxes((0, 0, 0)), level=1, sharp_angle=30)
    segments = curves(dense, "silhouette", (1, 2, 3))
    (line,) = chained(segments)
    assert line[0] == line[-1]
    corners = segments.points[line][::2]
    assert len(corners) == 7  # a hexagon
    assert not ({(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)} & {tuple(corner) for corner in np.round(corners, 9)})


def test_what_cannot_be():
    dense = curvify.refine(boxes((0, 0, 0)), level=1)
    with pytest.raises(curvify.OptionError, match="isophotes"):
        curves(dense, "isophotes")
    for view in ((0, 0, 0), (1, 2), (np.nan, 0, 1)):
        with pytest.raises(curvify.OptionError, match="direction"):
            curves(dense, "silhouette", view)
