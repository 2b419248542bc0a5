"""`curvify render` from the command line: what comes out, under which name, and what is refused."""

from __future__ import annotations

import io
import os
from pathlib import Path

import click
import numpy as np
import pytest
from PIL import Image

from curvify.cli.render import command, settings_of
from curvify.gpu.camera import VIEWS
from curvify.gpu.scene import FITS, STYLES, Settings
from curvify.gpu.shading import SHADINGS
from opengl import device_or_skip


@pytest.fixture
def opengl() -> None:
    """Skip where nothing can be drawn."""
    device_or_skip().close()


def image(name: str | Path) -> np.ndarray:
    with Image.open(name) as opened:
        assert opened.format == "PNG"
        return np.array(opened)


def test_a_picture(opengl, call, folder):
    result = call("render", "cube.obj", "cube.png")
    assert (result.code, result.out, result.err) == (0, b"", "")
    shown = image("cube.png")
    assert shown.shape == (600, 800, 3)
    assert (shown[0] == 255).all() and (shown[300, 400] < 255).any()
    assert sorted(path.name for path in folder.iterdir()) == ["cube.obj", "cube.png", "dart.obj"]


def test_the_same_bytes_every_time(opengl, call, folder):
    for name in ("a.png", "b.png"):
        assert call("render", "cube.obj", "dart.obj", name, "--style", "zebra", "--size", "60x50").code == 0
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()


def test_several_meshes_have_their_names_under_them(opengl, call, folder):
    assert call("render", "cube.obj", "dart.obj", "cube.obj", "row.png", "--size", "100x80").code == 0
    row = image("row.png")
    assert row.shape[1] == 300 and 80 < row.shape[0] < 120
    assert all((row[80:, k : k + 100] < 200).any() for k in (0, 100, 200))
    line = ("render", "cube.obj", "dart.obj", "column.png", "--columns", "1", "--size", "100x80")
    assert call(*line, "--caption", "", "--caption", "").code == 0
    assert image("column.png").shape == (160, 100, 3)
    wrong = call(*line, "--caption", "one")
    assert wrong.code == 2
    assert "2 INs and 1 captions" in wrong.err


def test_every_option_changes_the_picture(opengl, call, folder):
    tall = [line + ".5" * line.startswith("v") for line in Path("cube.obj").read_text().splitlines()]
    Path("tall.obj").write_text("\n".join(tall))  # half as high again: up matters

    def taken(*options: str) -> bytes:
        assert call("render", "tall.obj", "some.png", "--size", "60x50", *options).code == 0
        return Path("some.png").read_bytes()

    pictures = [
        taken(*options)
        for options in (
            (),
            ("--style", "zebra"),
            ("--style", "zebra", "--stripes", "3"),
            ("--style", "normals"),
            ("--shading", "smooth"),
            ("--wire",),
            ("--control", "dart.obj"),
            ("--color", "gold"),
            ("--view", "top"),
            ("--view", "-30,10"),
            ("--up", "y"),
            ("--background", "#123"),
            ("--field-of-view", "0"),
            ("--caption", "a cube"),
        )
    ]
    assert len(set(pictures)) == len(pictures)
    assert taken("--shading", "flat") == pictures[0]


def test_nothing_behind_it(opengl, call, folder):
    assert call("render", "cube.obj", "cube.png", "--background", "transparent", "--size", "90x80").code == 0
    shown = image("cube.png")
    assert shown.shape == (80, 90, 4)
    assert shown[0, 0, 3] == 0 and shown[40, 45, 3] == 255


def test_pipes(opengl, process, folder):
    data = Path("cube.obj").read_bytes()
    result = process("render", "-", "-", "--input-format", "obj", "--size", "40x30", "-v", stdin=data)
    assert result.code == 0
    assert image(io.BytesIO(result.out)).shape == (30, 40, 3)
    assert "OpenGL" in result.err


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("cube.obj cube.jpg", "cube.jpg: pictures are PNG files"),
        ("cube.obj cube", "cube: pictures are PNG files"),
        ("cube.png", "two names are needed at least"),
        ("cube.obj nowhere/a.png", "its folder does not exist"),
        ("cube.obj taken.png --no-clobber", "taken.png: it exists already"),
        ("none.obj a.png", "none.obj: cannot read"),
        ("cube.xyz a.png", "unknown suffix '.xyz'"),
        ("points.obj a.png", "points.obj: the mesh has no faces"),
        ("cube.obj a.png --control none.obj", "none.obj: cannot read"),
        ("- - a.png", "standard input can be read only once"),
        ("cube.obj a.png --size 800", "--size 800: give width and height"),
        ("cube.obj a.png --size 0x5", "--size 0x5: give width and height"),
        ("cube.obj a.png --size 99999x5", "choose a smaller --size"),
        ("cube.obj a.png --view above", "unknown view 'above'"),
        ("cube.obj a.png --background plaid", "unknown color 'plaid'"),
        ("cube.obj a.png --color #12", "unknown color '#12'"),
        ("cube.obj a.png --field-of-view 170", "field-of-view"),
    ],
)
def test_what_is_refused(opengl, call, folder, line, text):
    Path("taken.png").write_text("mine")
    Path("points.obj").write_text("v 0 0 0\nv 1 0 0\n")
    result = call("render", *line.split())
    assert result.code == 2
    assert result.err.startswith("curvify: error: ") and result.err.count("\n") == 1
    assert text in result.err
    assert Path("taken.png").read_text() == "mine"
    assert not Path("a.png").exists()


def test_without_opengl(process, folder):
    result = process("render", "cube.obj", "cube.png", env=os.environ | {"CURVIFY_GL": "none"})
    assert result.code == 2
    assert result.err.startswith("curvify: error: ") and result.err.count("\n") == 1
    assert not Path("cube.png").exists()


def test_warnings_of_the_file_are_told(opengl, call, folder):
    Path("odd.obj").write_text(Path("cube.obj").read_text() + "f 1 2\n")
    result = call("render", "odd.obj", "odd.png", "--size", "20x20")
    assert result.code == 0
    assert result.err.startswith("curvify: warning: odd.obj: ")
    assert call("render", "odd.obj", "odd.png", "--size", "20x20", "-q").err == ""


def test_choices_and_defaults_are_those_of_the_library():
    parameters = {parameter.name: parameter for parameter in command.params}
    choices = {name: set(p.type.choices) for name, p in parameters.items() if isinstance(p.type, click.Choice)}
    assert choices["style"] == set(STYLES) - {"values", "hidden"}
    assert choices["shading"] == set(SHADINGS)
    assert choices["fit"] == set(FITS)
    assert all(name in parameters["view"].help for name in VIEWS)
    given = command.make_context("render", ["a.obj", "a.png"]).params
    names = ("size", "background", "view", "color", "up", "field_of_view", "fit", "columns", "stripes")
    assert settings_of(**{name: given[name] for name in names}) == Settings()
