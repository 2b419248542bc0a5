"""Regions: errors as the definition has them, never rising, connected, and as good as flat parts allow."""

from __future__ import annotations

import numpy as np
import pytest

import dense_meshes
from curvify.simplify import vsa
from curvify.simplify.regions import bisect, make_discs, not_discs
from curvify.simplify.triangles import Triangles, face_components, prepare_triangles


@pytest.fixture(scope="module")
def torus() -> Triangles:
    return prepare_triangles(dense_meshes.torus())[0]


def regions(mesh: Triangles, count: int) -> np.ndarray:
    return vsa.cluster(mesh, vsa.Metric.of(mesh), count, face_components(mesh))


def parts(mesh: Triangles, labels: np.ndarray) -> int:
    pairs = mesh.dual_edges
    inside = labels[pairs[:, 0]] == labels[pairs[:, 1]]
    return len(np.unique(vsa.linked(mesh.face_count, pairs[inside])))


def test_errors_are_those_of_the_definition(torus):
    labels = regions(torus, 20)
    metric = vsa.Metric.of(torus)
    proxies = vsa.proxies(metric, labels, 20)
    gap = ((torus.normals - proxies[labels]) ** 2).sum(axis=1)
    expected = np.bincount(labels, torus.areas * gap)
    assert vsa.region_errors(metric, labels) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("count", [1, 2, 7, 50])
def test_there_are_as_many_connected_regions_as_asked_for(torus, count):
    labels = regions(torus, count)
    assert np.array_equal(np.unique(labels), np.arange(count))
    assert parts(torus, labels) == count


def test_exchange_lowers_the_error_and_keeps_the_regions_connected(torus):
    metric = vsa.Metric.of(torus)
    labels = bisect(torus, face_components(torus), np.array([0]))
    for _ in range(3):
        labels = bisect(torus, labels, np.arange(labels.max() + 1))
    before = vsa.region_errors(metric, labels).sum()
    after = vsa.exchange(torus, metric, labels, 30)
    assert vsa.region_errors(metric, after).sum() < 0.8 * before
    assert after.max() == labels.max()
    assert parts(torus, after) == labels.max() + 1


def test_compact_regions_have_smaller_moments_and_larger_errors(torus):
    metric = vsa.Metric.of(torus)
    labels = vsa.exchange(torus, metric, regions(torus, 40), 40)
    compact = vsa.exchange(torus, metric.compact(labels, 16), labels, 40)

    def moment(labels: np.ndarray) -> float:
        middle = np.stack([np.bincount(labels, torus.areas * c) for c in torus.centroids.T], axis=1)
        middle /= np.bincount(labels, torus.areas)[:, None]
        return float((torus.areas * ((torus.centroids - middle[labels]) ** 2).sum(axis=1)).sum())

    assert moment(compact) < 0.9 * moment(labels)
    assert vsa.region_errors(metric, compact).sum() > vsa.region_errors(metric, labels).sum()


def test_a_box_is_told_by_six_regions_and_no_more():
    box = prepare_triangles(dense_meshes.boxes(np.ones((1, 1, 1), dtype=bool), 5))[0]
    labels = regions(box, 50)
    assert labels.max() + 1 == 6
    assert vsa.region_errors(vsa.Metric.of(box), labels).sum() == pytest.approx(0, abs=1e-12)


def test_the_error_falls_as_one_over_the_number_of_regions():
    mesh = prepare_triangles(dense_meshes.torus(96, 48))[0]
    metric = vsa.Metric.of(mesh)
    errors = [vsa.region_errors(metric, vsa.exchange(mesh, metric, regions(mesh, k), 40)).sum() for k in (25, 50, 100)]
    assert 1.6 < errors[0] / errors[1] < 2.6
    assert 1.6 < errors[1] / errors[2] < 2.6


@pytest.mark.parametrize("name", ["torus", "sphere", "sheet", "needles"])
def test_whole_surfaces_become_discs(name):
    mesh = prepare_triangles(getattr(dense_meshes, name)())[0]
    labels = make_discs(mesh, face_components(mesh))
    assert not not_discs(mesh, labels).any()
    assert parts(mesh, labels) == labels.max() + 1
    # Only what was no disc was cut, and not far beyond need.
    assert labels.max() + 1 <= {"torus": 12, "sphere": 2, "sheet": 1, "needles": 2}[name]


def test_pinched_regions_are_no_discs():
    mesh = prepare_triangles(dense_meshes.sheet(5))[0]
    x, y = mesh.centroids[:, 0], mesh.centroids[:, 1]
    bowtie = ((x < 0.5) & (y < 0.5)) | ((x > 0.5) & (y > 0.5))
    labels = bowtie.astype(int)
    assert not_discs(mesh, labels).all()
    assert not not_discs(mesh, make_discs(mesh, labels)).any()
