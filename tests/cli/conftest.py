"""Running the command line in this process and in one of its own, in a folder with small meshes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from curvify.cli.main import run

CUBE = """\
v -1 -1 -1
v 1 -1 -1
v 1 1 -1
v -1 1 -1
v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""
#: An arrow head: concave at its last corner.
DART = """\
v 0 0 0
v 2 -1 0
v 0 2 0
v -2 -1 0
f 1 2 3 4
"""
CURVIFY = [sys.executable, "-c", "from curvify.cli.main import main; main()"]


@dataclass
class Result:
    """What came of a command line."""

    code: int
    out: bytes
    err: str


Caller = Callable[..., Result]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with cube.obj and dart.obj."""
    (tmp_path / "cube.obj").write_text(CUBE)
    (tmp_path / "dart.obj").write_text(DART)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("CURVIFY_TRACEBACK", raising=False)
    return tmp_path


@pytest.fixture
def call(folder: Path, capfdbinary: Any) -> Caller:
    """Run a command line in this process."""

    def call(*args: object) -> Result:
        capfdbinary.readouterr()
        code = run([str(arg) for arg in args])
        sys.stdout.flush()
        out, err = capfdbinary.readouterr()
        return Result(code, out, err.decode())

    return call


@pytest.fixture
def process(folder: Path) -> Caller:
    """Run a command line in a process of its own."""

    def process(*args: object, stdin: bytes | Path = b"", **settings: Any) -> Result:
        given: dict[str, Any] = {"stdin": stdin.open("rb")} if isinstance(stdin, Path) else {"input": stdin}
        ended = subprocess.run(
            [*CURVIFY, *map(str, args)], capture_output=True, timeout=60, check=False, **given, **settings
        )
        return Result(ended.returncode, ended.stdout, ended.stderr.decode())

    return process


@pytest.fixture
def shell(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Caller:
    """Run a line of shell in which ``curvify`` is this one."""
    programs = tmp_path_factory.mktemp("programs")
    program = programs / "curvify"
    program.write_text(f"#!/bin/sh\nexec '{CURVIFY[0]}' -c '{CURVIFY[2]}' \"$@\"\n")
    program.chmod(0o755)

    def shell(line: str) -> Result:
        path = f"{programs}{os.pathsep}{os.environ['PATH']}"
        ended = subprocess.run(
            ["bash", "-o", "pipefail", "-c", line],
            env=os.environ | {"PATH": path},
            capture_output=True,
            timeout=60,
            check=False,
        )
        return Result(ended.returncode, ended.stdout, ended.stderr.decode())

    return shell
