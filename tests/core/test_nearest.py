"""Nearest points are those of known shapes, triangles without area count for nothing; samples are even."""

from __future__ import annotations

import numpy as np
import pytest

from curvify.errors import MeshError
from curvify.nearest import nearest_points, places_on, spread

SQUARE = np.array([[0, 0, 0], [3, 0, 0], [3, 1, 0], [0, 1, 0]], dtype=float), np.array([[0, 1, 2], [0, 2, 3]])


def test_nearest_points_of_a_rectangle_are_the_clipped_ones():
    queries = np.random.default_rng(4).uniform(-2, 4, (300, 3))
    clipped = np.clip(queries, [0, 0, 0], [3, 1, 0])
    distance, triangle, place = nearest_points(queries, *SQUARE)
    assert place == pytest.approx(clipped, abs=1e-12)
    assert distance == pytest.approx(np.linalg.norm(clipped - queries, axis=1), abs=1e-12)
    above = clipped[:, 1] > clipped[:, 0] / 3 + 1e-9
    below = clipped[:, 1] < clipped[:, 0] / 3 - 1e-9
    assert (triangle[above] == 1).all()
    assert (triangle[below] == 0).all()
    assert above.any()
    assert below.any()


def test_triangles_without_area_count_for_nothing():
    positions, triangles = SQUARE
    needles = np.concatenate([[[0, 0, 1], [2, 2, 2]], triangles])
    found = nearest_points(np.array([[1.0, 0.1, 5.0], [3.0, 1.0, 0.0]]), positions, needles)
    assert found[0] == pytest.approx([5, 0])
    assert found[1][0] == 2


def test_a_mesh_without_area_is_refused():
    with pytest.raises(MeshError, match="no face has an area"):
        nearest_points(SQUARE[0], SQUARE[0], np.array([[0, 1, 1], [2, 2, 2]]))


def test_samples_are_in_proportion_to_area_and_on_the_surface():
    positions, triangles = SQUARE
    owners, weights = spread(positions, triangles, 4000)
    samples = places_on(positions, triangles[owners], weights)
    assert np.bincount(owners).tolist() == [2000, 2000]
    assert weights.min() >= 0
    assert weights.sum(axis=1) == pytest.approx(1)
    assert samples.mean(axis=0) == pytest.approx([1.5, 0.5, 0], abs=0.02)
    assert (samples[:, 2] == 0).all()
    assert np.histogram2d(samples[:, 0], samples[:, 1], bins=(6, 2))[0].min() > 280
