"""Nearest points agree with a search of all triangles, whatever their shapes; samples are even."""

from __future__ import annotations

import numpy as np
import pytest

from curvify.nearest import NearestPoints, closest_points, surface_samples


def soup(seed: int, stretch: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-1, 1, (60, 1, 3))
    corners = middle + rng.normal(0, 0.1, (60, 3, 3)) * rng.choice([1, stretch], (60, 1, 3))
    corners[0, 2] = corners[0, 1]  # a needle without area
    return corners.reshape(-1, 3), np.arange(180).reshape(-1, 3)


@pytest.mark.parametrize("stretch", [1, 30])
def test_nearest_is_nearest_of_all(stretch):
    points, triangles = soup(3, stretch)
    queries = np.random.default_rng(4).uniform(-2, 2, (200, 3))
    place, face, distance = NearestPoints(points, triangles).query(queries)
    every = np.linalg.norm(closest_points(queries[:, None], points[triangles]) - queries[:, None], axis=2)
    assert distance == pytest.approx(every.min(axis=1), abs=1e-12)
    assert every[np.arange(200), face] == pytest.approx(distance, abs=1e-12)
    assert np.linalg.norm(place - queries, axis=1) == pytest.approx(distance, abs=1e-12)


def test_closest_points_of_a_triangle_against_a_fine_grid():
    triangle = np.array([[0, 0, 0], [2, 0, 0], [0.5, 1, 0.3]])
    u, v = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201))
    inside = u + v <= 1
    u, v = u[inside][:, None], v[inside][:, None]
    grid = triangle[0] + u * (triangle[1] - triangle[0]) + v * (triangle[2] - triangle[0])
    queries = np.random.default_rng(1).uniform(-2, 3, (50, 3))
    found = np.linalg.norm(closest_points(queries, triangle) - queries, axis=1)
    coarse = np.linalg.norm(grid[:, None] - queries, axis=2).min(axis=0)
    assert (found <= coarse + 1e-12).all()
    assert found == pytest.approx(coarse, abs=0.011)


def test_samples_are_in_proportion_to_area_and_on_the_surface():
    points = np.array([[0, 0, 0], [3, 0, 0], [3, 1, 0], [0, 1, 0]], dtype=float)
    samples, faces = surface_samples(points, np.array([[0, 1, 2], [0, 2, 3]]), 4000)
    assert np.bincount(faces).tolist() == [2000, 2000]
    assert samples.mean(axis=0) == pytest.approx([1.5, 0.5, 0], abs=0.02)
    assert (samples[:, 2] == 0).all()
    assert np.histogram2d(samples[:, 0], samples[:, 1], bins=(6, 2))[0].min() > 280
