"""Marked meshes against numbers that another implementation made (tests/data)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import curvify
from curvify.formats.marks_json import parse_marks
from curvify.mesh import PolygonMesh
from surfaces import half_edge_polynomials

CASES = json.loads((Path(__file__).resolve().parents[1] / "data" / "gregory_marks.json").read_text())
PAIRS = [pytest.param(case, kind, id=f"{case['name']}-{kind}") for case in CASES for kind in case["schemes"]]
each_case = pytest.mark.parametrize(("case", "kind"), PAIRS)
#: The vertices of the torus are rounded to 8 digits and its flat face is planar only so far.
ROUNDED = 5e-9
#: Faces at the torus's two corner vertices: there the reference leans n_int on normals from before the corners'.
AT_CORNERS = (0, 16, 23)


def make(case: dict[str, Any], kind: str) -> curvify.Surface:
    mesh = PolygonMesh.from_faces(case["vertices"], case["faces"])
    return curvify.surface(mesh, cross_tangent=kind, marks=parse_marks(case["marks"], case["name"]))


@each_case
def test_normals_and_curves_agree_with_the_reference(case: dict[str, Any], kind: str) -> None:
    data, patches = case["schemes"][kind], make(case, kind).patches
    tolerance = ROUNDED if "torus" in case["name"] else 1e-14
    assert np.abs(patches.normals - data["normals"]).max() < tolerance
    curves, _ = half_edge_polynomials(patches, np.arange(len(patches.topology.vertices)))
    for column, name in ((1, "Q0"), (2, "Q1")):
        assert np.abs(curves[:, column] - data[name]).max() < 1e-14


@each_case
def test_points_and_normals_agree_with_the_reference(case: dict[str, Any], kind: str) -> None:
    data = case["schemes"][kind]["samples"]
    faces, points = np.array(data["face"]), np.stack([data["xi"], data["eta"]], axis=1)
    position, normal = make(case, kind).evaluate(faces, points)
    torus = "torus" in case["name"]
    kept = ~np.isin(faces, AT_CORNERS) if torus and kind in ("linear", "quadratic") else np.full(len(faces), True)
    tolerance = ROUNDED if torus else 1e-14
    assert np.abs(position - data["point"])[kept].max() < tolerance
    expected = np.array([[np.nan] * 3 if n is None else n for n in data["normal"]], dtype=float)
    kept &= ~np.isnan(expected).any(axis=1)  # where the derivatives are parallel, at the corner of a disc
    assert np.abs(normal - expected)[kept].max() < 10 * tolerance
