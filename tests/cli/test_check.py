"""`curvify check`: the exit code is the answer."""

from __future__ import annotations

import json
from pathlib import Path

import click

from curvify.checks import CONDITIONS, LIMITS
from curvify.cli.check import CONDITION, command


def test_yes_is_0(call, folder):
    result = call("check", "cube.obj", "--watertight", "--planar", "0.1")
    assert (result.code, result.err) == (0, "")
    assert result.out.decode() == "cube.obj: watertight: yes\ncube.obj: planar 0.1: yes: up to 0 degrees\n"


def test_no_is_1_and_says_where(call, folder):
    result = call("check", "dart.obj", "--watertight", "--convex", "--oriented")
    assert (result.code, result.err) == (1, "")
    assert result.out.decode().splitlines() == [
        "dart.obj: watertight: no: 4 edges of one face only: edge 0-1, 0-3, 1-2, 2-3",
        "dart.obj: oriented: yes",
        "dart.obj: convex: no: 1 face is concave or touches itself: face 0",
    ]
    quiet = call("check", "dart.obj", "--watertight", "-q")
    assert (quiet.code, quiet.out) == (1, b"")


def test_large_limits_are_written_out(call, folder):
    result = call("check", "cube.obj", "--max-faces", "1000000")
    assert result.out.decode() == "cube.obj: max-faces 1,000,000: yes: 6 faces\n"


def test_json(call, folder):
    result = call("check", "dart.obj", "--convex", "--max-sides", "3", "--json")
    assert result.code == 1
    answer = json.loads(result.out)
    assert (answer["passed"], [check["name"] for check in answer["checks"]]) == (False, ["convex", "max_sides"])
    assert answer["checks"][1] == {
        "name": "max_sides", "passed": False, "reason": "up to 4 sides in 1 face", "limit": 3.0, "measured": 4.0,
        "count": 1, "kind": "face", "where": [0],
    }  # fmt: skip


def test_what_cannot_be_answered_is_2(call, folder):
    Path("points.obj").write_text("v 0 0 0\n")
    for args in (["cube.obj"], ["absent.obj", "--convex"], ["points.obj", "--convex"], ["cube.obj", "--planar", "-1"]):
        result = call("check", *args)
        assert (result.code, result.out) == (2, b"")
        assert result.err.count("\n") == 1
    assert "--watertight" in call("check", "cube.obj").err


def test_seams_are_closed_unless_told_otherwise(call, folder):
    assert call("refine", "cube.obj", "soup.stl", "-k", "1").code == 0
    assert call("check", "soup.stl", "--watertight").code == 0
    assert call("check", "soup.stl", "--watertight", "--weld", "never").code == 1


def test_a_pipe(shell):
    result = shell("curvify refine cube.obj - --output-format ply | curvify check - --watertight --positive-volume")
    assert (result.code, result.err) == (0, "")
    assert result.out.startswith(b"stdin: watertight: yes\n")


def test_every_condition_has_its_option():
    options = [p for p in command.params if isinstance(p, click.Option) and getattr(p, "heading", "") == CONDITION]
    assert [option.name for option in options] == list(CONDITIONS)
    assert [option.name for option in options if not option.is_flag] == list(LIMITS)
