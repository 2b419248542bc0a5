"""Marks files: read, written, and refused with the place of what is wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import curvify
from curvify.formats.marks_json import marks_text, parse_marks, read_marks
from curvify.mesh import Marks

FULL = Marks(
    crease_edges=np.array([[0, 1], [5, 2]]),
    crease_sharpness=np.array([[1.0, 1.0], [0.25, 0.1]]),
    straight_edges=np.array([[0, 1]]),
    corner_vertices=np.array([3]),
    corner_sharpness=np.array([0.5]),
    flat_faces=np.array([1]),
    hole_faces=np.array([2]),
    bent_edges=np.array([[4, 5]]),
    edge_normals=np.array([[0.0, 0.1, -2.0]]),
    curled_edges=np.array([[0, 1]]),
    kappas=np.array([-0.5]),
    bulged_faces=np.array([1]),
    bulges=np.array([0.2]),
    full_faces=np.array([1]),
    alphas=np.array([2.0]),
)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    (tmp_path / "m.json").write_text(marks_text(FULL), encoding="utf-8")
    again = read_marks(tmp_path / "m.json")
    for name, values in vars(FULL).items():
        if name not in ("crease_edges", "crease_sharpness"):
            np.testing.assert_array_equal(getattr(again, name), values, name)
    assert again.crease_edges.tolist() == [[0, 1], [2, 5]]  # from the smaller vertex
    assert again.crease_sharpness.tolist() == [[1, 1], [0.1, 0.25]]


def test_one_entry_holds_all_that_is_said_of_a_place() -> None:
    content = json.loads(marks_text(FULL))
    assert content["edges"][0] == {"vertices": [0, 1], "crease": 1.0, "straight": True, "kappa": -0.5}
    assert content["faces"][0] == {"face": 1, "flat": True, "bulge": 0.2, "alpha": 2.0}
    assert len(marks_text(FULL).splitlines()) == 13


def test_no_marks() -> None:
    assert json.loads(marks_text(Marks())) == {"marks": 1}
    assert parse_marks({"marks": 1}, "m").counts() == {}


def test_switches_may_be_off_and_sharpness_may_be_a_switch() -> None:
    marks = parse_marks(
        {
            "marks": 1,
            "edges": [{"vertices": [0, 1], "crease": True, "straight": False}, {"vertices": [1, 2], "crease": [0, 1]}],
            "faces": [{"face": 0, "flat": False}],
        },
        "m",
    )
    assert marks.crease_sharpness.tolist() == [[1, 1], [0, 1]]
    assert marks.counts() == {"crease": 2}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not a JSON file"),
        ("[1]", 'must be an object with "marks": 1'),
        ('{"marks": 2}', 'must be an object with "marks": 1'),
        ('{"marks": 1, "edge": []}', "unknown key 'edge'"),
        ('{"marks": 1, "edges": {}}', "edges must be a list"),
        ('{"marks": 1, "edges": [{"crease": 1}]}', r"edges\[0\]: must be an object with 'vertices'"),
        ('{"marks": 1, "edges": [{"vertices": [1, 1], "crease": 1}]}', r"edges\[0\]: .*two different vertices"),
        ('{"marks": 1, "edges": [{"vertices": [1, -2], "crease": 1}]}', r"edges\[0\]: -2 is not the number"),
        ('{"marks": 1, "edges": [{"vertices": [1, 2], "crease": 2}]}', r"edges\[0\]: 'crease' must be from 0"),
        ('{"marks": 1, "edges": [{"vertices": [1, 2], "crease": [1, 1, 1]}]}', "one for each end"),
        ('{"marks": 1, "edges": [{"vertices": [1, 2], "normal": [0, 0, 0]}]}', "must not be zero"),
        ('{"marks": 1, "edges": [{"vertices": [1, 2], "flat": true}]}', "unknown mark 'flat'; known are crease"),
        ('{"marks": 1, "vertices": [{"vertex": true, "corner": 1}]}', "True is not the number"),
        ('{"marks": 1, "faces": [{"face": 1, "hole": 1}]}', "'hole' must be true or false"),
        ('{"marks": 1, "faces": [{"face": 1, "alpha": 0}]}', "must be above 0"),
        ('{"marks": 1, "faces": [{"face": 1, "bulge": NaN}]}', "must be a number"),
        ('{"marks": 1, "faces": [{"face": 1, "bulge": "big"}]}', "must be a number, not 'big'"),
    ],
)
def test_what_cannot_be_understood_is_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "wrong.json"
    path.write_text(text)
    with pytest.raises(curvify.FormatError, match=message) as caught:
        read_marks(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(curvify.FormatError, match=r"none\.json"):
        read_marks(tmp_path / "none.json")
