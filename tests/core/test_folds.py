"""Whether patches leave their sides inwards: what angles tell is true, and tells nearly all."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from curvify.mesh import PolygonMesh
from curvify.prepare import prepare_mesh
from curvify.schemes.base import bernstein, bernstein_slope
from curvify.schemes.cross_tangents import start_share
from curvify.schemes.folds import PLACES, _surely_inward, blended_inward, build_patchwork
from curvify.schemes.gregory import patch_sides
from curvify.schemes.patchwork import Patchwork
from surfaces import cube, icosahedron, mixed_ball, noisy, prism, torus, vase

MESHES = [torus(12, 8), icosahedron(), mixed_ball(), vase(), cube(), prism(7), noisy(torus(12, 8), 0.05)]


def patchwork(mesh: PolygonMesh, kind: str = "precise") -> Patchwork:
    inward = partial(blended_inward, partial(start_share, kind))
    return build_patchwork(prepare_mesh(mesh), "circle", "best", inward)


def least_inward(work: Patchwork, kind: str) -> np.ndarray:
    """(C' x T).n_c ``(C,)``, the smallest at the places, straight from the definition."""
    result = np.empty(len(work.topology.edge))
    h = start_share(kind, PLACES)
    for size, patches in work.size_classes():
        corners = work.topology.offsets[patches][:, None] + np.arange(size)
        _, sides = patch_sides(work, corners)
        tangent = sides.start[..., None] * h + sides.end[..., None] * (1 - h)
        normal, speed = bernstein(sides.fields, PLACES), bernstein_slope(sides.curves, PLACES)
        triple = np.einsum("cfnm,cfnm->fnm", np.cross(speed, tangent, axis=0), normal)
        result[corners] = triple.min(axis=-1)
    return result


@pytest.mark.parametrize("kind", ["precise", "smooth"])
@pytest.mark.parametrize("mesh", MESHES)
def test_the_test_of_sides_is_the_triple_product(mesh: PolygonMesh, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    work = patchwork(mesh, kind)
    expected = least_inward(work, kind)
    sure = _surely_inward(work)
    assert (expected[sure] > 0).all()
    monkeypatch.setattr("curvify.schemes.folds._surely_inward", lambda work: np.zeros_like(sure))
    found = blended_inward(partial(start_share, kind), work)
    np.testing.assert_allclose(3 * found, expected, atol=1e-12 * np.abs(expected).max())  # cross tangents are 3 steps


def test_a_mesh_that_bends_gently_needs_no_other_test(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a side was looked at place by place")

    monkeypatch.setattr("curvify.schemes.folds._across_edges", refuse)
    patchwork(noisy(torus(24, 16), 0.005))
