"""`curvify compare`: the golden-file tool."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import curvify
from opengl import device_or_skip


@pytest.fixture
def pair(call):
    """Two dense cubes with the same faces that differ a little, and a finer one."""
    for name, options in (("a.ply", []), ("b.ply", ["--cross-tangent", "smooth"]), ("fine.ply", ["-k", "9"])):
        assert call("refine", "cube.obj", name, *options).code == 0


def test_equal_files_agree(call, pair):
    result = call("compare", "a.ply", "a.ply")
    assert (result.code, result.err) == (0, "")
    assert "a.ply: positions: yes: equal" in result.out.decode()


def test_a_difference_is_1_and_names_the_worst_vertex(call, pair):
    result = call("compare", "a.ply", "b.ply")
    assert (result.code, result.err) == (1, "")
    assert "b.ply: positions: no: up to 0." in result.out.decode()
    assert "at vertex " in result.out.decode()
    assert call("compare", "a.ply", "b.ply", "-q").out == b""


def test_tolerances(call, pair):
    a, b = curvify.read("a.ply"), curvify.read("b.ply")
    far = np.linalg.norm(a.positions - b.positions, axis=1).max()
    share = 100 * far / np.linalg.norm(np.ptp(a.positions, axis=0))
    loose = ["--normal-tolerance", "30"]
    for tolerance, code in ((1.01 * far, 0), (0.99 * far, 1), (f"{1.01 * share}%", 0), (f"{0.99 * share}%", 1)):
        assert call("compare", "a.ply", "b.ply", "--tolerance", tolerance, *loose).code == code
    assert call("compare", "a.ply", "b.ply", "--tolerance", 1.01 * far).code == 1  # the normals
    for wrong in ("-1", "much", "nan", "%"):
        result = call("compare", "a.ply", "b.ply", "--tolerance", wrong)
        assert (result.code, result.err.count("\n")) == (2, 1)


def test_other_faces_are_a_difference_unless_surfaces_are_asked_for(call, pair):
    result = call("compare", "a.ply", "fine.ply")
    assert result.code == 1
    assert "A has 602 vertices and 600 faces, B has 1,946" in result.out.decode()
    assert "--surface" in result.out.decode()
    measured = call("compare", "a.ply", "fine.ply", "--surface", "--samples", "5000")
    assert measured.code == 0
    assert "rms" in measured.out.decode()
    for tolerance, code in (("2%", 0), ("0.0001%", 1)):
        args = ("--surface", "--samples", "5000", "--tolerance", tolerance)
        assert call("compare", "a.ply", "fine.ply", *args).code == code


def test_json(call, pair):
    result = call("compare", "a.ply", "b.ply", "--json")
    answer = json.loads(result.out)
    assert (result.code, answer["passed"], answer["a"], answer["b"]) == (1, False, "a.ply", "b.ply")
    assert [check["name"] for check in answer["checks"]] == ["topology", "positions", "normals"]
    answer = json.loads(call("compare", "a.ply", "fine.ply", "--json", "--surface", "--samples", "999").out)
    assert answer["passed"]
    assert 0 < answer["apart"]["rms"] < answer["apart"]["hausdorff"] < 0.2


def test_a_heat_map(call, pair):
    result = call("compare", "a.ply", "fine.ply", "--surface", "--samples", "99", "--heatmap", "heat.ply")
    assert "heat.ply: the lightest color stands for 0.0" in result.out.decode()
    heat = curvify.read("heat.ply")
    assert heat.faces() == curvify.read("fine.ply").faces()
    assert len(np.unique(heat.vertex_colors, axis=0)) > 10
    for name in ("heat.jpg", "nowhere/heat.ply", "nowhere/heat.png"):
        result = call("compare", "a.ply", "b.ply", "--heatmap", name)
        assert (result.code, result.out) == (2, b"")


def test_a_heat_map_as_a_picture(call, pair):
    device_or_skip().close()
    assert call("compare", "a.ply", "a.ply", "--heatmap", "same.png").code == 0
    result = call("compare", "a.ply", "b.ply", "--heatmap", "heat.png")
    assert (result.code, result.err) == (1, "")
    same, heat = (np.asarray(Image.open(name)).astype(int) for name in ("same.png", "heat.png"))
    assert heat.shape == same.shape and heat.shape[1] == 1200
    assert len(np.unique(heat[:500].reshape(-1, 3), axis=0)) > 2 * len(np.unique(same[:500].reshape(-1, 3), axis=0))


def test_standard_input(process, call, pair):
    result = process("compare", "a.ply", "-", stdin=Path("a.ply").read_bytes())
    assert result.code == 0
    assert result.out.startswith(b"stdin: topology: yes")
    assert call("compare", "-", "-").code == 2
    named = process("compare", "cube.obj", "-", "--input-format", "obj", stdin=Path("cube.obj").read_bytes())
    assert named.code == 0


def test_what_cannot_be_compared_is_2(call, pair):
    Path("points.obj").write_text("v 0 0 0\n")
    for args in (["a.ply", "absent.ply"], ["a.ply", "points.obj"], ["a.ply", "cube.blend"]):
        result = call("compare", *args)
        assert (result.code, result.out, result.err.count("\n")) == (2, b"", 1)
