"""`curvify info`."""

from __future__ import annotations

import json
from pathlib import Path

SAMPLES = Path(__file__).parents[2] / "sample_meshes"


def test_for_people(call, folder):
    result = call("info", "cube.obj")
    assert (result.code, result.err) == (0, "")
    text = result.out.decode()
    assert text.startswith("cube.obj\n  vertices    8\n  faces       6: 6 quads\n")
    assert "1 piece, closed, genus 0, area 24, volume 8" in text
    assert "--scheme gregory --level 5 would make 600 faces on 6 patches" in text
    assert "odd" not in text


def test_for_programs(call, folder):
    found = json.loads(call("info", SAMPLES / "torus.obj", "--json", "-k", "2").out)
    assert (found["schema"], found["command"]) == (1, "info")
    assert found["shape"]["genus"] == 1
    assert found["refine"]["faces"] == 36 * 4 * 2**2
    assert found["refine"]["warnings"] == []


def test_what_refine_would_do(call, folder):
    text = call("info", "dart.obj").out.decode()
    assert "1 face concave" in text
    assert "warning     1 concave face split into convex pieces, first: 0" in text
    assert "warning" not in call("info", "dart.obj", "-q").out.decode()


def test_options_of_refine_count(call, folder):
    marks = SAMPLES / "pawn-sharp.json"
    text = call("info", SAMPLES / "pawn.obj", "--marks", marks).out.decode()
    assert "from marks: 56 creases, 1 flat face" in text
    assert "from angle" in call("info", SAMPLES / "pawn.obj", "--sharp-angle", "40").out.decode()
    assert call("info", "cube.obj", "--alpha", "2").code == 2  # what refine would not take


def test_defects_are_listed(call, folder):
    text = Path("cube.obj").read_text().replace("f 4 1 5 8\n", "f 1 4 5\nv 9 9 9\n")
    Path("odd.obj").write_text(text)
    out = call("info", "odd.obj").out.decode()
    assert "9, 1 of them in no face" in out
    assert "edges of one face" in out
    assert "whose faces run the same way" in out


def test_points_only(call, folder):
    Path("points.obj").write_text("v 0 0 0\nv 1 0 0\n")
    result = call("info", "points.obj")
    assert result.code == 0
    assert "would refuse: the mesh has no faces, only 2 points" in result.out.decode()


def test_attributes(call, folder):
    points = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nvt 0 0\nvn 0 0 1\n"
    Path("rich.obj").write_text(points + "usemtl a\nf 1/1/1 2/1/1 3\n")
    text = call("info", "rich.obj").out.decode()
    assert "normals at 2 of 3 corners, texture coordinates at 2 of 3 corners, vertex colors (3 x" in text
    assert "1 material (a)" in text


def test_large_meshes_are_not_refined_for_a_look(call, folder, monkeypatch):
    monkeypatch.setattr("curvify.cli.info.MOST_FACES", 5)
    assert "was not tried: the mesh has more than 5 faces" in call("info", "cube.obj").out.decode()
