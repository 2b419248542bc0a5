"""Schemes on the command line: what each makes, and options that are another scheme's."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import curvify

SAMPLES = Path(__file__).parents[2] / "sample_meshes"
TORUS, CYLINDER, L_PART = (SAMPLES / f"{name}.obj" for name in ("torus", "cylinder", "l_part"))


@pytest.mark.parametrize("suffix", ["ply", "obj", "stl"])
@pytest.mark.parametrize("scheme", ["png1", "pn", "phong", "overveld"])
def test_every_scheme_writes_triangles_and_keeps_the_vertices(call, folder, scheme, suffix):
    result = call("refine", TORUS, f"dense.{suffix}", "--scheme", scheme, "-k", 2)
    assert (result.code, result.out, result.err) == (0, b"", "")
    coarse, dense = curvify.read(TORUS), curvify.read(folder / f"dense.{suffix}")
    expected = 36 * (2 * 4**2 if scheme != "overveld" else 8 * 4)
    assert dense.face_count == expected
    assert set(dense.face_sizes) == {3}
    if suffix != "stl":
        np.testing.assert_array_equal(np.float32(dense.positions[:36]), np.float32(coarse.positions))


@pytest.mark.parametrize(
    ("option", "scheme", "owners"),
    [
        (["--kappa", "0.1"], "gregory", "the scheme png1"),
        (["--kappa", "0"], "pn", "the scheme png1"),
        (["--depth", "2"], "png1", "the scheme overveld"),
        (["--rim"], "phong", "the scheme overveld"),
        (["--planar", "3"], "gregory", "the scheme overveld"),
        (["--alpha", "0.5"], "overveld", "the schemes gregory and phong"),
        (["--normals", "exact"], "pn", "the schemes gregory and png1"),
        (["--cross-tangent", "smooth"], "phong", "the scheme gregory"),
    ],
)
def test_an_option_of_other_schemes_is_an_error_that_names_them(call, option, scheme, owners):
    result = call("refine", TORUS, "dense.ply", "--scheme", scheme, *option)
    assert result.code == 2
    assert result.err == f"curvify: error: {option[0]} is for {owners}, not for {scheme}\n"
    assert not Path("dense.ply").exists()


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--planar", "1,x"], "'x' is no face or range of faces"),
        (["--planar", "9-3"], "'9-3' is no face or range of faces"),
        (["--planar", "0-99999999999"], "is no face or range of faces"),
        (["--planar", "3-"], "'3-' is no face or range of faces"),
        (["--backend", "gpu"], "runs on the CPU only"),
        (["--planar", "999"], "faces are numbered 0 to"),
        (["--max-edge", "-1"], "--max-edge must be a positive length"),
        (["--depth", "99"], "--depth must be from 1 to 24"),
        (["--max-edge", "1e-5", "--max-faces", "9999"], "a longest edge of 1e-05 gives"),
        (["--weld-normals"], "overveld needs its normals"),
    ],
)
def test_what_overveld_cannot_do_is_one_line(call, option, message):
    result = call("refine", TORUS, "dense.ply", "--scheme", "overveld", *option)
    assert result.code == 2
    assert message in result.err
    assert result.err.count("\n") == 1
    assert not Path("dense.ply").exists()


def test_values_that_the_scheme_does_not_have_are_errors(call):
    assert "exact, paper" in call("refine", TORUS, "dense.ply", "--normals", "smooth").err
    assert "exact, smooth" in call("refine", TORUS, "dense.ply", "--scheme", "png1", "--normals", "paper").err
    assert "from 0 to 1" in call("refine", TORUS, "dense.ply", "--scheme", "phong", "--alpha", "2").err


def test_options_reach_their_scheme(call, folder):
    made = {}
    for name, options in {
        "plain": ["--scheme", "png1", "--sharp-angle", "60"],
        "ridge": ["--scheme", "png1", "--sharp-angle", "60", "--kappa", "-0.2"],
        "share": ["--scheme", "png1", "--sharp-angle", "60", "--kappa", "-0.2", "--crease-units", "edge"],
        "shaded": ["--scheme", "png1", "--sharp-angle", "60", "--normals", "smooth"],
        "rim": ["--scheme", "overveld", "--rim"],
        "stretched": ["--scheme", "overveld", "--edge-rule", "stretched"],
        "planar": ["--scheme", "overveld", "--planar", "0"],
        "apex": ["--scheme", "overveld", "--apex", "0.5"],
        "perp": ["--scheme", "overveld", "--midpoint-normal", "perp"],
    }.items():
        result = call("refine", L_PART, f"{name}.ply", "-k", "2", *options)
        assert (result.code, result.out) == (0, b"")
        made[name] = (folder / f"{name}.ply").read_bytes()
    assert made["rim"] == made.pop("apex")  # the part is closed and its concave caps are triangulated
    assert len(set(made.values())) == len(made)


def test_overveld_reports_what_it_can(call):
    result = call("refine", CYLINDER, "dense.ply", "--scheme", "overveld", "--depth", "3", "--report", "-", "-v")
    report = json.loads(result.out)
    assert report["g1"] is None
    assert report["vertex_deviation"] == 0
    assert report["options"]["depth"] == 3
    assert report["counts"]["output"]["faces"] == curvify.read("dense.ply").face_count
    assert "scheme overveld, depth 3" in result.err


def test_png1_reports_its_continuity(call):
    report = json.loads(call("refine", TORUS, "dense.ply", "--scheme", "png1", "--report", "-").out)
    assert report["g1"]["max_degrees"] < 1e-9


def test_a_dry_run_says_what_every_scheme_would_write(call):
    for scheme in ("png1", "overveld"):
        told = call("refine", TORUS, "dense.ply", "--scheme", scheme, "-k", "3", "--dry-run")
        assert told.code == 0
        assert not Path("dense.ply").exists()
        assert call("refine", TORUS, "dense.ply", "--scheme", scheme, "-k", "3").code == 0
        dense = curvify.read("dense.ply")
        assert f"{dense.vertex_count:,} vertices" in told.err
        assert f"{dense.face_count:,} faces" in told.err
        Path("dense.ply").unlink()


def test_marks_without_a_use_are_named(call, folder):
    (folder / "marks.json").write_text(
        json.dumps({"marks": 1, "edges": [{"vertices": [0, 1], "kappa": 0.1}], "faces": [{"face": 0, "bulge": 0.2}]})
    )
    result = call("refine", TORUS, "dense.ply", "--scheme", "pn", "--marks", "marks.json")
    if result.code:
        pytest.fail(result.err)
    assert "1 kappa mark ignored: pn has no use for kappa" in result.err
    assert "1 bulge mark ignored" in result.err
