"""`curvify repair`."""

from __future__ import annotations

from pathlib import Path

import pytest

import curvify


@pytest.fixture
def broken(folder):
    """A cube with a turned face, a repeated one, one without area and an unused vertex."""
    text = Path("cube.obj").read_text().replace("f 4 1 5 8\n", "f 8 5 1 4\nf 1 2 6 5\nf 1 2 1\nv 9 9 9\n")
    Path("broken.obj").write_text(text)


def test_what_is_mended_is_told(call, broken):
    result = call("repair", "broken.obj", "mended.obj")
    assert (result.code, result.out) == (0, b"")
    faces = ("face turned to the side of the others", "face on the vertices of another removed")
    for part in (*faces, "vertex in no face removed"):
        assert f"curvify: broken.obj: 1 {part}" in result.err
    assert call("check", "mended.obj", "--watertight", "--manifold", "--positive-volume", "--no-unused").code == 0
    assert curvify.read("mended.obj").face_count == 6
    assert call("repair", "broken.obj", "mended.obj", "-q").err == ""


def test_nothing_to_mend(call, folder):
    result = call("repair", "cube.obj", "same.ply")
    assert result.err == "curvify: cube.obj: nothing to mend\n"
    assert curvify.read("same.ply").faces() == curvify.read("cube.obj").faces()


def test_holes(call, folder):
    text = Path("cube.obj").read_text().replace("f 4 1 5 8\n", "")
    Path("open.obj").write_text(text)
    assert call("repair", "open.obj", "same.obj").code == 0
    assert curvify.read("same.obj").face_count == 5
    assert "1 hole closed" in call("repair", "open.obj", "closed.obj", "--holes", "4").err
    assert call("check", "closed.obj", "--watertight").code == 0


def test_pipes(process, broken):
    result = process(
        "repair", "-", "-", "--input-format", "obj", "--output-format", "ply", stdin=Path("broken.obj").read_bytes()
    )
    assert result.code == 0
    assert result.out.startswith(b"ply\n")
    assert "stdin: " in result.err


def test_errors(call, broken):
    Path("flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
    negative = ["broken.obj", "out.obj", "--holes", "-1"]
    for args in (["flat.obj", "out.obj"], ["broken.obj", "out.off", "--ascii"], negative):
        result = call("repair", *args)
        assert (result.code, result.err.count("\n")) == (2, 1)
        assert not Path(args[1]).exists()
