"""`curvify simplify`: files in and out, one command or two, its report, its errors."""

from __future__ import annotations

import json

import pytest

import curvify
import dense_meshes


@pytest.fixture
def torus(folder):
    curvify.write(dense_meshes.torus(32, 16), folder / "torus.obj")
    return folder / "torus.obj"


def test_refining_with_simplify_gives_the_bytes_of_two_commands(call, folder, torus):
    assert call("simplify", torus, "few.obj", "--faces", 24).code == 0
    assert call("refine", "few.obj", "two.ply", "-k", 2).code == 0
    assert call("refine", torus, "one.ply", "--simplify", 24, "-k", 2).code == 0
    assert (folder / "one.ply").read_bytes() == (folder / "two.ply").read_bytes()


def test_what_is_not_fitted_lies_on_the_input(call, folder, torus):
    assert call("simplify", torus, "few.ply", "--faces", 24, "--fit", "none", "--precision", "float64").code == 0
    dense = {tuple(point) for point in curvify.read(torus).positions}
    assert all(tuple(point) in dense for point in curvify.read(folder / "few.ply").positions)


def test_two_runs_give_the_same_bytes(call, process, folder, torus):
    assert call("simplify", torus, "one.ply", "--faces", 24).code == 0
    assert process("simplify", torus, "two.ply", "--faces", 24).code == 0
    assert (folder / "one.ply").read_bytes() == (folder / "two.ply").read_bytes()


@pytest.mark.parametrize("suffix", ["obj", "ply"])
def test_normals_and_marks_are_written(call, folder, suffix):
    assert call("simplify", "cube.obj", f"few.{suffix}", "--faces", 6).code == 0
    mesh = curvify.read(folder / f"few.{suffix}")
    assert mesh.face_count == 6
    assert mesh.corner_normals is not None
    assert len(mesh.marks.crease_edges) >= 12
    assert mesh.marks.flat_faces.tolist() == list(range(6))
    result = call("refine", f"few.{suffix}", "dense.ply", "--report", "-")
    assert json.loads(result.out)["volume_ratio"] == pytest.approx(1, rel=1e-6)


def test_the_report_tells_how_far_polygons_and_surface_are(call, torus):
    result = call("simplify", torus, "few.obj", "--faces", 40, "--report", "-")
    report = json.loads(result.out)
    assert report["counts"]["faces"] == pytest.approx(40, abs=4)
    assert report["counts"]["triangles"] == 1024
    assert 0 < report["distances"]["refined"]["rms"] < 0.7 * report["distances_before_fit"]["refined"]["rms"]
    assert report["options"]["fit"] == "full"
    assert all(steps == sorted(steps, reverse=True) for steps in report["fit"]["residuals"])


def test_a_largest_error_is_held_or_told(call, torus):
    result = call("simplify", torus, "few.obj", "--faces", 20, "--max-error", "0.0001", "--report", "-")
    assert result.code == 0
    assert "more faces may" in result.err
    report = json.loads(result.out)
    assert report["options"]["max_error"] == pytest.approx(0.0001 / 4.0, rel=0.05)
    assert report["fit"]["max_error"] > report["options"]["max_error"]


def test_compactness_proxies_and_angle_have_their_say(call, folder, torus):
    plain = call("simplify", torus, "a.obj", "--proxies", 30, "--fit", "none").code
    assert call("simplify", torus, "b.obj", "--proxies", 30, "--compactness", 0, "--fit", "none").code == plain == 0
    assert call("simplify", torus, "c.obj", "--proxies", 30, "--sharp-angle", 5, "--fit", "none").code == 0
    texts = [(folder / name).read_bytes() for name in ("a.obj", "b.obj", "c.obj")]
    assert len(set(texts)) == 3
    assert b"t crease" in texts[2]
    assert b"t crease" not in texts[0]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["few.obj"], "give --faces"),
        (["few.obj", "--faces", 9, "--proxies", 9], "either"),
        (["few.obj", "--faces", 0], "--faces"),
        (["few.obj", "--faces", 9, "--fit", "none", "--max-error", "1%"], "needs a fit"),
        (["few.obj", "--faces", 9, "--max-error", "0"], "closer than 0"),
        (["few.obj", "--faces", 9, "--ascii"], "--ascii is for PLY"),
        (["few.xyz", "--faces", 9], "unknown suffix"),
        (["few.obj", "--faces", 9, "--report", "few.obj"], "OUT and --report cannot be the same"),
        (["-", "--faces", 9, "--output-format", "ply", "--report", "-"], "cannot both be standard output"),
    ],
)
def test_errors(call, folder, arguments, says):
    result = call("simplify", "cube.obj", *arguments)
    assert (result.code, result.out) == (2, b"")
    assert says in result.err
    assert len(result.err.splitlines()) == 1
    assert not (folder / "few.obj").exists()


def test_faces_without_area_are_refused(call, folder):
    (folder / "level.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3\nf 2 3 4\n")
    result = call("simplify", "level.obj", "few.obj", "--faces", 1)
    assert (result.code, result.out) == (2, b"")
    assert "level.obj: no face of the mesh has an area" in result.err


@pytest.mark.parametrize(("name", "lost"), [("few.stl", "polygons, normals and creases"), ("few.off", "normals and")])
def test_formats_that_cannot_hold_the_result_are_a_warning(call, folder, name, lost):
    result = call("simplify", "cube.obj", name, "--faces", 6, "--fit", "none")
    assert result.code == 0
    assert f"{name}: {name[-3:]} keeps no {lost}" in result.err
    assert (folder / name).exists()


def test_more_faces_than_there_are_is_a_warning(call):
    result = call("simplify", "cube.obj", "few.obj", "--faces", 100)
    assert result.code == 0
    assert "more faces would add nothing" in result.err
