"""Conditions: met by a sound mesh, each broken by a defect of its own, with the place."""

from __future__ import annotations

import numpy as np
import pytest

import curvify
from bodies import boxes
from curvify.checks import CONDITIONS, LIMITS, check_mesh
from curvify.findings import MOST_PLACES
from curvify.mesh import PolygonMesh
from surfaces import torus

DART = PolygonMesh.from_faces([[0, 0, 0], [2, -1, 0], [0, 2, 0], [-2, -1, 0], [9, 9, 9]], [[0, 1, 2, 3], [0, 2, 1, 3]])
#: Three quads in a strip, bent by 30 and then by 60 degrees.
STAIRS = PolygonMesh.from_faces(
    [[x, y, z] for x, z in ((0, 0), (1, 0), (1 + 0.75**0.5, 0.5), (1 + 0.75**0.5, 1.5)) for y in (0, 1)],
    [[0, 2, 3, 1], [2, 4, 5, 3], [4, 6, 7, 5]],
)
#: Condition, limit, a mesh that breaks it, how often, the first place.
BROKEN = [
    ("watertight", True, boxes((0, 0, 0), missing=[(0, 0)]), 4, (0, 1)),
    ("manifold", True, boxes((0, 0, 0), (1, 1, 0)), 1, (3, 7)),
    ("manifold", True, boxes((0, 0, 0), (1, 1, 1)), 1, 7),
    ("oriented", True, boxes((0, 0, 0), turned=[(0, 0)]), 4, (0, 1)),
    ("positive_volume", True, boxes((0, 0, 0), turned=[(0, k) for k in range(6)]), 0, None),
    ("positive_volume", True, boxes((0, 0, 0), missing=[(0, 0)]), 0, None),
    ("no_degenerate", True, PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 1]]), 1, 1),
    ("no_duplicates", True, DART, 1, 1),
    ("no_unused", True, DART, 1, 4),
    ("convex", True, DART, 2, 0),
    ("planar", 1.0, PolygonMesh.from_faces([[0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 1]], [[0, 1, 2, 3]]), 1, 0),
    ("g1", 29.0, STAIRS, 2, (4, 5)),
    ("max_sides", 3, boxes((0, 0, 0)), 6, 0),
    ("max_faces", 5, boxes((0, 0, 0)), 0, None),
    ("max_pieces", 1, boxes((0, 0, 0), (3, 0, 0)), 0, None),
]


def test_a_sound_mesh_meets_every_condition():
    limits = {"planar": 1e-6, "g1": 90.001, "max_sides": 4, "max_faces": 6, "max_pieces": 1}
    findings = check_mesh(boxes((0, 0, 0)), {name: limits.get(name, True) for name in CONDITIONS})
    assert [finding.name for finding in findings] == list(CONDITIONS)
    assert set(limits) == set(LIMITS)
    assert all(finding.passed for finding in findings)


@pytest.mark.parametrize(("name", "limit", "mesh", "count", "first"), BROKEN)
def test_each_condition_names_what_breaks_it(name, limit, mesh, count, first):
    (finding,) = check_mesh(mesh, {name: limit})
    assert not finding.passed
    assert finding.reason
    assert finding.count == count
    assert (finding.where[0] if finding.where else None) == first
    assert len(finding.where) <= MOST_PLACES


def test_every_condition_is_broken_by_something():
    assert {name for name, *_ in BROKEN} == set(CONDITIONS)


def test_a_kink_in_a_dense_mesh_is_found_and_curvature_is_not():
    dense = curvify.refine(torus(), level=8)
    smooth = PolygonMesh.from_faces(dense.positions, dense.faces.tolist())
    (finding,) = check_mesh(smooth, {"g1": 20.0})
    assert finding.passed
    pulled = smooth.positions.copy()
    pulled[100] += 0.05
    (finding,) = check_mesh(smooth.with_(positions=pulled), {"g1": 20.0})
    assert not finding.passed
    near = np.linalg.norm(pulled[list(finding.where[0])] - pulled[100], axis=1)
    assert near.min() < 0.2


def test_unknown_conditions():
    with pytest.raises(curvify.OptionError, match="round"):
        check_mesh(boxes((0, 0, 0)), {"round": True})
