"""The surface against numbers that another implementation made (tests/data)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import curvify
from curvify import evaluate
from curvify.mesh import PolygonMesh
from curvify.schemes.gregory_basis import _monomials, correction_fit
from surfaces import half_edge_polynomials, with_vertex_normals

DATA = Path(__file__).resolve().parents[1] / "data"
MESHES = json.loads((DATA / "gregory.json").read_text())
FITS = json.loads((DATA / "correction_fit.json").read_text())
CASES = [pytest.param(mesh, kind, id=f"{mesh['name']}-{kind}") for mesh in MESHES for kind in mesh["schemes"]]
each_case = pytest.mark.parametrize(("mesh", "kind"), CASES)


def make(mesh: dict[str, Any], kind: str) -> curvify.Surface:
    polygons = PolygonMesh.from_faces(mesh["vertices"], mesh["faces"])
    polygons = with_vertex_normals(polygons, np.array(mesh["vertex_normals"]))
    return curvify.surface(polygons, cross_tangent=kind, sharp_from="normals")


def sample_points(data: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    return np.array(data["face"]), np.stack([data["xi"], data["eta"]], axis=1)


@each_case
def test_points_and_normals_agree_with_the_reference(mesh: dict[str, Any], kind: str) -> None:
    data = mesh["schemes"][kind]["samples"]
    position, normal = make(mesh, kind).evaluate(*sample_points(data))
    assert np.abs(position - data["point"]).max() < 1e-12
    assert np.abs(normal - np.array(data["normal"], dtype=float)).max() < 1e-12


@each_case
def test_derivatives_agree_with_the_reference(mesh: dict[str, Any], kind: str) -> None:
    data = mesh["schemes"][kind]["samples"]
    _, by_xi, by_eta = evaluate.evaluate_at(make(mesh, kind).patches, *sample_points(data))
    assert np.abs(by_xi - data["dxi"]).max() < 1e-12
    assert np.abs(by_eta - data["deta"]).max() < 1e-12


@each_case
def test_edge_curves_agree_with_the_reference(mesh: dict[str, Any], kind: str) -> None:
    patches = make(mesh, kind).patches
    curves, _ = half_edge_polynomials(patches, np.arange(len(patches.topology.vertices)))
    data = mesh["schemes"][kind]
    for column, name in ((1, "Q0"), (2, "Q1")):
        assert np.abs(curves[:, column] - np.concatenate(data[name])).max() < 1e-13


@pytest.mark.parametrize(("mesh", "kind"), [c for c in CASES if "kappa" in c.values[0]["schemes"][c.values[1]]])
def test_fullness_agrees_with_the_reference(mesh: dict[str, Any], kind: str) -> None:
    patches = make(mesh, kind).patches
    (only,) = patches.classes
    controls: Any = only.surface.controls(np.arange(len(only.patches)))
    assert np.abs(controls.tangent.gains - mesh["schemes"][kind]["kappa"]).max() < 1e-13


@pytest.mark.parametrize("mesh", [m for m in MESHES if "precise" in m["schemes"]], ids=lambda mesh: mesh["name"])
def test_the_middle_of_a_precise_patch_is_the_reference_center(mesh: dict[str, Any]) -> None:
    surface = make(mesh, "precise")
    count = len(surface.sides)
    position, _ = surface.evaluate(np.arange(count), np.zeros((count, 2)))
    assert np.abs(position - mesh["schemes"]["precise"]["center"]).max() < 1e-13


@pytest.mark.parametrize("sides", sorted(FITS, key=int))
def test_the_polynomial_fit_agrees_with_the_reference(sides: str) -> None:
    expected = FITS[sides]
    fit = correction_fit(int(sides))
    degree = max(i + j for i, j in expected["monomials"])
    order = [_monomials(degree).tolist().index(ij) for ij in expected["monomials"]]
    assert fit.shape == (len(order), 4 * int(sides))
    assert np.abs(fit[order] - expected["L"]).max() < 1e-10
