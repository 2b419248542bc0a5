"""`curvify fit`: a coarse mesh against a dense one; files, report, errors."""

from __future__ import annotations

import json

import numpy as np
import pytest

import curvify
import dense_meshes
from curvify.simplify import Options, simplify


@pytest.fixture
def pair(folder):
    """A coarse torus of 24 polygons and the dense one it was made from."""
    dense = dense_meshes.torus(32, 16)
    curvify.write(dense, folder / "dense.ply")
    curvify.write(simplify(dense, Options(faces=24)).mesh, folder / "coarse.obj")


def test_the_surface_comes_closer_and_the_faces_stay(call, folder, pair):
    result = call("fit", "coarse.obj", "dense.ply", "fitted.obj", "--report", "-", "-v")
    assert result.code == 0
    report = json.loads(result.out)
    assert report["command"] == "fit"
    assert report["distances"]["refined"]["rms"] < 0.6 * report["distances_before_fit"]["refined"]["rms"]
    assert " steps" in result.err
    before, after = curvify.read(folder / "coarse.obj"), curvify.read(folder / "fitted.obj")
    assert after.faces() == before.faces()
    assert not np.array_equal(after.positions, before.positions)
    assert after.corner_normals is not None


def test_normals_alone_may_be_fitted(call, folder, pair):
    assert call("fit", "coarse.obj", "dense.ply", "fitted.ply", "--fit", "normals", "--precision", "float64").code == 0
    before, after = curvify.read(folder / "coarse.obj"), curvify.read(folder / "fitted.ply")
    assert np.array_equal(after.positions, before.positions)


def test_what_a_coarse_mesh_carries_is_kept(call, folder):
    (folder / "quad.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl red\nf 1/1 2/2 3/3 4/4\n"
    )
    curvify.write(dense_meshes.sheet(12, lambda x, y: 0.1 * x * y), folder / "sheet.ply")
    assert call("fit", "quad.obj", "sheet.ply", "fitted.obj").code == 0
    fitted = curvify.read(folder / "fitted.obj")
    assert fitted.corner_uvs is not None
    assert fitted.material_names == ("red",)
    assert fitted.face_count == 1


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["cube.obj", "missing.ply", "out.obj"], "missing.ply"),
        (["-", "-", "out.obj", "--input-format", "ply"], "cannot both be standard input"),
        (["cube.obj", "cube.obj", "out.obj", "--ascii"], "--ascii is for PLY"),
        (["cube.obj", "cube.obj", "out.obj", "--fit", "none"], "none"),
        (["cube.obj", "cube.obj", "-", "--output-format", "ply", "--report", "-"], "cannot both be standard output"),
        (["cube.obj", "dart.obj", "out.obj", "--report", "dart.obj"], "DENSE and --report cannot be the same"),
    ],
)
def test_errors(call, folder, arguments, says):
    result = call("fit", *arguments)
    assert (result.code, result.out) == (2, b"")
    assert says in result.err
    assert not (folder / "out.obj").exists()


@pytest.fixture
def others(folder, pair):
    """Meshes that do not go with the pair."""
    dense = curvify.read(folder / "dense.ply")
    curvify.write(dense.with_(positions=dense.positions * 1000), folder / "large.ply")
    curvify.write(dense.with_(positions=dense.positions + 100), folder / "far.ply")
    (folder / "level.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3\nf 2 3 4\n")
    (folder / "points.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\n")
    (folder / "corner.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")


@pytest.mark.parametrize(
    ("coarse", "dense", "says"),
    [
        ("coarse.obj", "large.ply", "coarse.obj: it does not lie near the dense mesh"),
        ("coarse.obj", "far.ply", "coarse.obj: it does not lie near the dense mesh"),
        ("coarse.obj", "level.obj", "level.obj: no face of the mesh has an area"),
        ("level.obj", "dense.ply", "level.obj: no face of the mesh has an area"),
        ("points.obj", "dense.ply", "points.obj: the mesh has no faces"),
        ("coarse.obj", "points.obj", "points.obj: the mesh has no face"),
    ],
)
def test_meshes_that_do_not_belong_together_are_refused(call, folder, others, coarse, dense, says):
    result = call("fit", coarse, dense, "fitted.obj")
    assert (result.code, result.out) == (2, b"")
    assert says in result.err
    assert len(result.err.splitlines()) == 1
    assert not (folder / "fitted.obj").exists()


def test_a_surface_that_stays_far_away_is_a_warning(call, folder, others):
    result = call("fit", "corner.obj", "dense.ply", "fitted.obj")
    assert result.code == 0
    assert "dense.ply: the fitted surface stays" in result.err
    assert (folder / "fitted.obj").exists()


def test_the_format_of_standard_input_is_not_that_of_the_other_file(call, folder, pair, monkeypatch):
    with (folder / "coarse.obj").open() as stream:
        monkeypatch.setattr("sys.stdin", stream)
        assert call("fit", "-", "dense.ply", "piped.obj", "--input-format", "obj").code == 0
    assert call("fit", "coarse.obj", "dense.ply", "named.obj").code == 0
    assert (folder / "piped.obj").read_bytes() == (folder / "named.obj").read_bytes()


def test_a_fit_without_simplify_is_refused(call):
    result = call("refine", "cube.obj", "out.ply", "--fit", "full")
    assert result.code == 2
    assert "--simplify" in result.err
