"""`curvify curves`: lines that other programs can read."""

from __future__ import annotations

from pathlib import Path


def lines_of(text: str) -> dict[str, list[list[int]]]:
    """Lines by object, their indices checked against the points."""
    found: dict[str, list[list[int]]] = {}
    points = 0
    for row in text.splitlines():
        kind, *rest = row.split()
        if kind == "o":
            found[rest[0]] = []
        elif kind == "v":
            points += 1
        else:
            assert kind == "l"
            found[list(found)[-1]].append([int(index) for index in rest])
    used = {index for lines in found.values() for line in lines for index in line}
    assert used == set(range(1, points + 1))
    return found


def test_edges_and_silhouette_unless_told_otherwise(call, folder):
    result = call("curves", "cube.obj", "lines.obj", "-k", "2", "-v")
    assert (result.code, result.out) == (0, b"")
    found = lines_of(Path("lines.obj").read_text())
    assert list(found) == ["edges", "silhouette"]
    assert [len(line) for line in found["edges"]] == [5] * 12
    assert "12 lines of edges" in result.err


def test_a_choice_and_standard_output(call, folder):
    result = call("curves", "dart.obj", "-", "--rims", "--cells", "-k", "1", "-q")
    assert (result.code, result.err) == (0, "")
    found = lines_of(result.out.decode())
    assert list(found) == ["rims", "cells"]
    assert len(found["rims"]) == 1
    assert {len(line) for line in found["cells"]} == {2}


def test_what_cannot_be(call, folder):
    before = sorted(folder.iterdir())
    for args in (["lines.ply"], ["lines.obj", "--view", "0", "0", "0"], ["nowhere/lines.obj"]):
        result = call("curves", "cube.obj", *args)
        assert (result.code, result.err.count("\n")) == (2, 1)
    assert sorted(folder.iterdir()) == before
    Path("lines.obj").write_text("mine")
    assert call("curves", "cube.obj", "lines.obj", "--no-clobber").code == 2
    assert Path("lines.obj").read_text() == "mine"
