"""The help teaches: every command has examples, and they work."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import click
import pytest

from curvify.cli.group import COMMANDS, Command, Option
from opengl import device_or_skip

DISC = Path(__file__).parents[2] / "sample_meshes" / "disc.png"
FOUND = {name: import_module(f"curvify.cli.{name}").command for name in COMMANDS}
EXAMPLES = [(name, line) for name, command in FOUND.items() for _, line in command.examples]


@pytest.mark.parametrize(("name", "line"), EXAMPLES)
def test_examples_work_as_they_are_shown(call, shell, folder, name, line):
    if name == "render":
        device_or_skip().close()
    for place in ("coarse.obj", "assets/a/coarse.obj", "assets/b/coarse.obj"):
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        (folder / place).write_text((folder / "cube.obj").read_text())
    assert call("refine", "coarse.obj", "golden.ply").code == 0
    (folder / "disc.png").write_bytes(DISC.read_bytes())
    assert f"  {line}\n" in call(name, "--help").out.decode()
    result = shell(line)
    assert (result.code, [text for text in result.err.splitlines() if "error" in text]) == (0, [])


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command(call, name):
    result = call(name, "--help")
    assert (result.code, result.err) == (0, "")
    assert call(name, "-h").out == result.out
    text = result.out.decode()
    assert COMMANDS[name] in " ".join(text.split())
    assert "Examples:" in text
    assert max(map(len, text.splitlines())) <= 120


def test_help_of_the_group(call):
    text = call("--help").out.decode()
    for name, line in COMMANDS.items():
        assert f"{name} " in text
        assert line in " ".join(text.split())
    assert call("-h").out.decode() == text


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_is_explained(name):
    command = FOUND[name]
    assert isinstance(command, Command)
    assert command.get_short_help_str(200) == COMMANDS[name]
    assert len(command.examples) >= 2
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert isinstance(parameter, Option)
            assert parameter.help


def test_choices_of_options_are_those_of_the_library():
    from curvify.convex import RULES
    from curvify.options import SHARP_SOURCES, WELD_MODES
    from curvify.refinement import MAX_FACES
    from curvify.schemes import NAMES
    from curvify.schemes.gregory import CROSS_TANGENTS, NORMALS
    from curvify.schemes.overveld_edges import EDGE_RULES, MIDPOINT_NORMALS
    from curvify.schemes.png1 import CREASE_UNITS
    from curvify.schemes.png1 import NORMALS as PNG1_NORMALS

    parameters = {parameter.name: parameter for parameter in FOUND["refine"].params}
    choices = {name: tuple(p.type.choices) for name, p in parameters.items() if isinstance(p.type, click.Choice)}
    assert choices["scheme"] == NAMES
    assert choices["cross_tangent"] == CROSS_TANGENTS
    assert set(choices["normals"]) == set(NORMALS) | set(PNG1_NORMALS)
    assert choices["crease_units"] == CREASE_UNITS
    assert choices["edge_rule"] == EDGE_RULES
    assert choices["midpoint_normal"] == MIDPOINT_NORMALS
    assert choices["sharp_from"] == SHARP_SOURCES
    assert choices["weld"] == WELD_MODES
    assert choices["split_rule"] == RULES
    assert parameters["max_faces"].default == MAX_FACES


def test_version(call):
    assert call("--version").out == b"curvify 0.1.0\n"


def test_shells_can_complete(process):
    import os

    environment = os.environ | {"_CURVIFY_COMPLETE": "bash_complete", "COMP_WORDS": "curvify ref", "COMP_CWORD": "1"}
    result = process(env=environment)
    assert result.code == 0
    assert b"refine" in result.out
