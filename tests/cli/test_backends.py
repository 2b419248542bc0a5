"""`curvify backends` and `--backend`, without OpenGL: what there is then, and what is said."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

NO_LIBRARIES = {"GLCONTEXT_LINUX_LIBEGL": "libnone.so", "GLCONTEXT_LINUX_LIBGL": "libnone.so"}


@pytest.fixture(params=["switched off", "not installed"])
def without_opengl(request, monkeypatch):
    """No OpenGL, whatever the machine has."""
    monkeypatch.delenv("CURVIFY_GL", raising=False)
    for name, value in ({"CURVIFY_GL": "none"} if request.param == "switched off" else NO_LIBRARIES).items():
        monkeypatch.setenv(name, value)


def test_backends_without_opengl(call, without_opengl):
    result = call("backends")
    assert (result.code, result.err) == (0, "")
    lines = result.out.decode().splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("cpu: ")
    assert lines[1].startswith("gpu: none: ")
    assert lines[2] == "auto: cpu"


def test_backends_without_opengl_for_a_program(call, without_opengl):
    found = json.loads(call("backends", "--json").out)
    assert found["auto"] == "cpu"
    assert found["cpu"]["processors"] >= 1
    assert set(found["gpu"]) == {"available", "reason"}
    assert found["gpu"]["available"] is False


def test_the_gpu_without_opengl_is_an_error_of_one_line(call, without_opengl):
    result = call("refine", "cube.obj", "dense.ply", "--backend", "gpu")
    assert (result.code, result.out) == (2, b"")
    assert result.err.startswith("curvify: error: ")
    assert result.err.count("\n") == 1
    assert not Path("dense.ply").exists()


@pytest.mark.parametrize("large", [False, True])
def test_auto_without_opengl_is_the_cpu(call, without_opengl, large, monkeypatch):
    if large:
        monkeypatch.setattr("curvify.backends.LARGE", 1)
    result = call("refine", "cube.obj", "dense.ply", "--backend", "auto", "-v", "--threads", 1)
    assert result.code == 0
    assert "curvify: backend cpu, 1 thread\n" in result.err


def test_auto_loads_no_opengl_for_small_work(folder):
    code = "import sys; from curvify.cli.main import run; run(sys.argv[1:]); print('moderngl' in sys.modules)"
    ended = subprocess.run(
        [sys.executable, "-c", code, "refine", "cube.obj", "dense.ply"], capture_output=True, text=True, check=True
    )
    assert ended.stdout == "False\n"
