"""`curvify marks` and the options for sharp features."""

from __future__ import annotations

import json
from pathlib import Path

import curvify


def write_tags(*lines: str) -> None:
    with Path("cube.obj").open("a") as file:
        file.write("".join(f"{line}\n" for line in lines))


def test_tags_become_a_marks_file(call, folder):
    write_tags("t crease 3/1/0 0 1 2 7.5", "t flat 1/0/0 1")
    assert call("marks", "cube.obj", "m.json").code == 0
    content = json.loads(Path("m.json").read_text())
    assert content == {
        "marks": 1,
        "edges": [{"vertices": [0, 1], "crease": 0.75}, {"vertices": [1, 2], "crease": 0.75}],
        "faces": [{"face": 1, "flat": True}],
    }


def test_the_file_fed_back_alone_gives_the_same_bytes(call, folder):
    write_tags("t crease 4/1/0 4 5 6 7 10", "t corner 1/1/0 0 5", "t straight 2/0/0 0 4")
    call("marks", "cube.obj", "m.json")
    call("refine", "cube.obj", "tags.ply")
    result = call("refine", "cube.obj", "marks.ply", "--marks", "m.json", "--sharp-from", "none")
    assert (result.code, result.err) == (0, "")
    assert Path("tags.ply").read_bytes() == Path("marks.ply").read_bytes()


def test_an_angle_alone_creases_a_cube(call, folder):
    result = call("marks", "cube.obj", "-", "--sharp-angle", "40", "-v")
    assert len(json.loads(result.out)["edges"]) == 12
    assert "angle: 12 creases" in result.err
    report = json.loads(call("refine", "cube.obj", "d.ply", "--sharp-angle", "40", "--report", "-").out)
    assert report["marks"] == {"angle": {"crease": 12}}
    assert report["counts"]["input"]["crease_edges"] == 12
    assert report["options"]["sharp_angle"] == 40


def test_bulging_and_welded_normals(call, folder):
    call("refine", "cube.obj", "plain.ply", "-k", "2")
    assert call("refine", "cube.obj", "round.ply", "-k", "2", "--bulge", "0.3").code == 0
    plain, swollen = (curvify.read(name).positions for name in ("plain.ply", "round.ply"))
    assert abs(swollen).max() > abs(plain).max() + 0.1
    sharp = ("refine", "cube.obj", "-", "--output-format", "ply", "--sharp-angle", "40", "-k", "2")
    assert b"element vertex 98\n" in call(*sharp, "--weld-normals").out
    assert b"element vertex 150\n" in call(*sharp).out  # 8 corners twice more, 3 points of 12 edges once


def test_a_dry_run_knows_welded_normals(call, folder):
    split = call("refine", "cube.obj", "x.ply", "--sharp-angle", "40", "--dry-run").err
    welded = call("refine", "cube.obj", "x.ply", "--sharp-angle", "40", "--dry-run", "--weld-normals").err
    assert "repeats" in split
    assert "repeats" not in welded


def test_errors_name_the_file_and_the_entry(call, folder):
    Path("m.json").write_text('{"marks": 1, "edges": [{"vertices": [0, 9], "crease": 1}]}')
    result = call("refine", "cube.obj", "x.ply", "--marks", "m.json")
    assert result.code == 2
    assert result.err == "curvify: error: cube.obj: a mark is on vertex 9, the mesh has 8 (counted from 0)\n"
    Path("m.json").write_text('{"marks": 1, "edges": [{"vertices": [0, 1], "creaze": 1}]}')
    result = call("marks", "cube.obj", "x.json", "--marks", "m.json")
    assert result.code == 2
    assert result.err.startswith("curvify: error: m.json: edges[0]: unknown mark 'creaze'")
    assert not Path("x.json").exists()


def test_no_clobber(call, folder):
    Path("m.json").write_text("mine")
    assert call("marks", "cube.obj", "m.json", "--no-clobber").code == 2
    assert Path("m.json").read_text() == "mine"


def test_split_writes_the_marks_of_the_file(call, folder):
    write_tags("t crease 2/2/0 0 1 2.5 10", "t straight 2/0/0 4 5", "t flat 1/0/0 2", "t corner 1/1/0 6 10")
    for name in ("out.obj", "out.ply"):
        assert call("split", "cube.obj", name, "--max-sides", "3").code == 0
        marks = curvify.read(name).marks
        assert marks.counts() == {"crease": 1, "straight": 1, "corner": 1, "flat": 2}
        assert marks.crease_sharpness.tolist() == [[0.25, 1.0]]
