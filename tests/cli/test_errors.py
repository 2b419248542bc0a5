"""What cannot be done: exit code 2, one line that says what to do, nothing left behind."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

BAD = {
    "missing file": (["refine", "absent.obj", "dense.ply"], "absent.obj"),
    "directory in": (["refine", "sub.obj", "dense.ply"], "sub.obj"),
    "directory out": (["refine", "cube.obj", "sub.obj"], "sub.obj: cannot write: it is a folder"),
    "missing folder": (["refine", "cube.obj", "nowhere/dense.ply"], "its folder does not exist"),
    "unknown suffix": (["refine", "cube.obj", "dense.xyz"], "unknown suffix '.xyz'"),
    "unknown suffix in": (["refine", "cube.blend", "dense.ply"], "--input-format"),
    "no suffix": (["refine", "cube.obj", "dense"], "--output-format"),
    "unknown format": (["refine", "cube.obj", "dense", "--output-format", "blend"], "'blend'"),
    "format of stdout": (["refine", "cube.obj", "-"], "--output-format ply"),
    "empty file": (["refine", "empty.obj", "dense.ply"], "empty.obj: the file is empty"),
    "a PLY called OBJ": (["info", "ply.obj"], "ply.obj: this is a PLY file, not OBJ"),
    "bytes called OBJ": (["info", "bytes.obj"], "bytes.obj: this is no OBJ file: it is not text"),
    "folder in": (["refine", "sub.obj", "dense.ply"], "sub.obj: cannot read: it is a folder; for many files there is"),
    "folder out": (["refine", "cube.obj", "sub.obj/"], "sub.obj/: cannot write: it is a folder; give the name of"),
    "no command": (["cube.obj", "dense.ply"], "no such command 'cube.obj'. Did you mean 'curvify refine cube.obj den"),
    "gltf out": (["refine", "cube.obj", "dense.gltf"], "dense.gltf: '.gltf' is read but not written; name the format"),
    "level of a half": (["refine", "cube.obj", "dense.ply", "-k", "2.5"], "'2.5' is not a valid whole number"),
    "angle too wide": (["refine", "cube.obj", "dense.ply", "--sharp-angle", "400"], "--sharp-angle must be from 0 to"),
    "angle too wide for curves": (["curves", "cube.obj", "a.obj", "--sharp-angle", "400"], "--sharp-angle must be"),
    "name with blanks": (["refine", "my", "cube.obj", "dense.ply"], "names with blanks need quotes"),
    "two numbers for three": (["curves", "cube.obj", "a.obj", "--view", "1", "2"], "(try 'curvify curves --help')"),
    "no picture": (["render", "cube.obj"], "two names are needed at least"),
    "curves as PLY": (["curves", "cube.obj", "a.ply"], "a.ply: curves are written as OBJ only; give a name that ends"),
    "points only": (["refine", "points.obj", "dense.ply"], "points.obj: the mesh has no faces, only 2 points"),
    "garbage": (["refine", "garbage.ply", "dense.ply"], "garbage.ply"),
    "bad index": (["refine", "index.obj", "dense.ply"], "index.obj:2"),
    "level 0": (["refine", "cube.obj", "dense.ply", "-k", "0"], "curvify refine --help"),
    "level of words": (["refine", "cube.obj", "dense.ply", "-k", "five"], "'five'"),
    "threads 0": (["refine", "cube.obj", "dense.ply", "--threads", "0"], "--threads"),
    "unknown scheme": (["refine", "cube.obj", "dense.ply", "--scheme", "loop"], "gregory"),
    "unknown option": (["refine", "cube.obj", "dense.ply", "--levl", "3"], "--level"),
    "no output": (["refine", "cube.obj"], "OUT"),
    "too many names": (["refine", "cube.obj", "a.ply", "b.ply"], "b.ply"),
    "alpha alone": (["refine", "cube.obj", "dense.ply", "--alpha", "2"], "--cross-tangent quadratic"),
    "alpha 0": (["refine", "cube.obj", "dense.ply", "--cross-tangent", "quadratic", "--alpha", "0"], "alpha"),
    "ascii obj": (["refine", "cube.obj", "dense.obj", "--ascii"], "--ascii"),
    "report twice": (["refine", "cube.obj", "-", "--output-format", "ply", "--report", "-"], "standard output"),
    "report over IN": (["refine", "cube.obj", "dense.ply", "--report", "./cube.obj"], "same file"),
    "report over OUT": (["refine", "cube.obj", "dense.ply", "--report", "./dense.ply"], "same file"),
    "report nowhere": (["refine", "cube.obj", "dense.ply", "--report", "nowhere/r.json"], "nowhere/r.json"),
    "report of nothing": (["refine", "cube.obj", "dense.ply", "--report", "r.json", "--dry-run"], "--dry-run"),
    "too large": (["refine", "large.ply", "dense.ply", "--precision", "float32"], "scale the mesh below"),
    "unknown command": (["refin", "cube.obj", "dense.ply"], "refine"),
    "split empty": (["split", "empty.obj", "dense.ply"], "empty.obj: the file is empty"),
    "split to 2 sides": (["split", "cube.obj", "dense.ply", "--max-sides", "2"], "--max-sides"),
    "split too large": (["split", "large.ply", "dense.ply", "--precision", "float32"], "dense.ply: "),
    "split ascii": (["split", "cube.obj", "dense.off", "--ascii"], "--ascii"),
}


@pytest.fixture
def bad_files(folder):
    """Files that cannot be used."""
    Path("empty.obj").write_text("")
    Path("ply.obj").write_text("ply\nformat ascii 1.0\nend_header\n")
    Path("bytes.obj").write_bytes(bytes(range(256)))
    Path("points.obj").write_text("v 0 0 0\nv 1 0 0\n")
    Path("garbage.ply").write_bytes(bytes(range(256)))
    Path("index.obj").write_text("v 0 0 0\nf 1 2 3\n")
    header = "ply\nformat ascii 1.0\nelement vertex 3\n" + "".join(f"property double {c}\n" for c in "xyz")
    rows = "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1e50 0 0\n0 1e50 0\n3 0 1 2\n"
    Path("large.ply").write_text(header + rows)
    Path("sub.obj").mkdir()


@pytest.mark.parametrize("name", BAD)
def test_one_line_and_nothing_left(call, folder, bad_files, name):
    args, part = BAD[name]
    before = sorted(folder.iterdir())
    result = call(*args)
    assert result.code == 2
    assert result.out == b""
    assert result.err.startswith("curvify: error: ")
    assert result.err.count("\n") == 1
    assert part in result.err
    assert sorted(folder.iterdir()) == before


def test_output_is_checked_before_input_is_read(call, folder):
    assert "dense.xyz" in call("refine", "absent.obj", "dense.xyz").err


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="everything is writable")
def test_a_folder_that_cannot_be_written(call, folder):
    Path("locked").mkdir(mode=0o555)
    result = call("refine", "cube.obj", "locked/dense.ply")
    assert result.code == 2
    assert result.err == "curvify: error: locked/dense.ply: cannot write: permission denied\n"


def test_an_existing_output_survives_an_error(call, bad_files):
    Path("dense.ply").write_text("mine")
    assert call("refine", "garbage.ply", "dense.ply").code == 2
    assert call("refine", "large.ply", "dense.ply", "--precision", "float32").code == 2
    assert Path("dense.ply").read_text() == "mine"


def failing(error):
    """A function that raises."""

    def fail(*args, **options):
        raise error

    return fail


def test_out_of_memory(call, monkeypatch):
    monkeypatch.setattr("curvify.cli.run.refinable", failing(MemoryError()))
    result = call("refine", "cube.obj", "dense.ply")
    assert (result.code, result.err) == (2, "curvify: error: out of memory; choose a lower level\n")


def test_the_unexpected_is_one_line_unless_a_traceback_is_wanted(call, monkeypatch):
    monkeypatch.setattr("curvify.cli.run.refinable", failing(RuntimeError("two\nlines")))
    result = call("refine", "cube.obj", "dense.ply")
    assert result.code == 2
    assert result.err.startswith("curvify: internal error: RuntimeError: two lines; ")
    assert "CURVIFY_TRACEBACK=1" in result.err
    assert result.err.count("\n") == 1
    monkeypatch.setenv("CURVIFY_TRACEBACK", "1")
    assert "Traceback" in call("refine", "cube.obj", "dense.ply").err


def test_an_error_in_a_worker_leaves_nothing(call, folder, monkeypatch):
    monkeypatch.setattr("curvify.formats.dense.PlySink.faces", failing(RuntimeError("no faces")))
    before = sorted(folder.iterdir())
    for threads in (1, 2):
        assert "no faces" in call("refine", "cube.obj", "dense.ply", "--threads", threads).err
    assert sorted(folder.iterdir()) == before


def test_no_arguments_show_the_help_as_an_error(call):
    result = call()
    assert (result.code, result.out) == (2, b"")
    assert "Commands:" in result.err
