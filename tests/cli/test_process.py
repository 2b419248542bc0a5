"""What only shows in a process of its own: imports, signals, pipes, closed streams."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
from click import __file__ as click_file

import curvify
from curvify.cli.group import COMMANDS
from surfaces import torus

CURVIFY = [sys.executable, "-c", "from curvify.cli.main import main; main()"]
LONG = ["-k", "400"]  # minutes
SAMPLES = Path(__file__).parents[2] / "sample_meshes"


def imported(*args: str) -> set[str]:
    """Modules that a command line imports."""
    code = f"""
import atexit, sys
atexit.register(lambda: print(*sorted(sys.modules), file=sys.__stderr__))
sys.argv = ["curvify", *{list(args)!r}]
from curvify.cli.main import main
main()
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, timeout=60, check=True)
    return set(ended.stderr.decode().split())


def test_version_imports_nothing_but_itself(process):
    result = process("--version")
    assert (result.code, result.err) == (0, "")
    assert result.out == b"curvify 0.1.0\n"
    assert not imported("--version") & {"click", "numpy", "curvify.cli.group"}


@pytest.mark.parametrize("args", [["--help"], *([name, "--help"] for name in COMMANDS)])
def test_help_imports_click_only(args):
    assert Path(click_file).exists()
    found = imported(*args)
    assert "click" in found
    assert not found & {"numpy", "tqdm", "trimesh", "igl", "distributed", "multiprocessing", "curvify.mesh"}


def test_help_of_the_group_imports_no_command():
    assert not imported("--help") & {"curvify.cli.refine", "curvify.cli.split", "curvify.cli.options"}


def test_looking_at_a_mesh_imports_no_heavy_library(folder):
    for args in (["info", "cube.obj"], ["check", "cube.obj", "--convex"], ["compare", "cube.obj", "cube.obj"]):
        assert not imported(*args) & {"trimesh", "scipy", "igl", "tqdm", "multiprocessing", "distributed", "moderngl"}


def test_refine_imports_what_it_needs(folder):
    for name in ("dense.ply", "dense.obj"):
        found = imported("refine", "cube.obj", name)
        assert "numpy" in found
        heavy = {"trimesh", "scipy", "numba", "moderngl", "pymeshlab", "tqdm", "networkx", "curvify.gpu"}
        assert not found & heavy
        spare = {"numpy.ma", "numpy.random", "numpy.fft", "numpy.polynomial", "logging", "concurrent.futures"}
        ours = {"dissect", "subdivision", "shading", "quality", "trim", "simplify", "cli.report", "formats.ply_read"}
        assert not found & (spare | {f"curvify.{name}" for name in ours})


def test_refining_folded_and_concave_faces_imports_no_more_than_that(folder):
    shutil.copy(SAMPLES / "l_part.obj", folder)
    text = (SAMPLES / "pawn.obj").read_text()
    turned = text.replace("\nf ", "\nvn 1 0 .2\nvn .2 1 0\nvn 0 .2 1\nf ", 1).splitlines()
    faces = [i for i, line in enumerate(turned) if line.startswith("f ")]
    for i in faces:
        turned[i] = " ".join(["f", *(f"{c}//{int(c) % 3 + 1}" for c in turned[i].split()[1:])])
    (folder / "folded.obj").write_text("\n".join(turned) + "\n")
    for name, out in (("l_part.obj", "dense.ply"), ("folded.obj", "dense.obj")):
        found = imported("refine", name, out, "-k", "1", "--sharp-from", "normals")
        assert not found & {"numpy.ma", "numpy.random", "numpy.polynomial", "scipy", "trimesh", "networkx"}


def test_linear_algebra_runs_on_one_thread():
    code = "import os, sys; sys.argv = ['curvify', 'schemes']; from curvify.cli import main\n"
    code += "try: main.main()\nexcept SystemExit: print([os.environ[name] for name in main.THREAD_VARIABLES])"
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "7"}
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, env=environment, check=True)
    assert ended.stdout.decode().splitlines()[-1] == "['1', '1', '1']"


@pytest.mark.parametrize("threads", ["1", "2"])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_stopped_run_leaves_nothing(folder, number, code, threads):
    before = sorted(folder.iterdir())
    command = [*CURVIFY, "refine", "cube.obj", "dense.ply", *LONG, "--threads", threads]
    # Background jobs of a shell ignore interrupts and pass that on: start from the default.
    default = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=default) as running:
        deadline = time.monotonic() + 30
        while sorted(folder.iterdir()) == before and running.poll() is None and time.monotonic() < deadline:
            time.sleep(0.02)
        assert sorted(folder.iterdir()) != before  # the temporary file is there
        running.send_signal(number)
        out, err = running.communicate(timeout=30)
    assert running.returncode == code
    assert out == b""
    assert err.count(b"\n") == 1
    assert err.startswith(b"curvify: ")
    assert sorted(folder.iterdir()) == before


def test_ignored_hangups_stay_ignored(folder):
    code = "import signal, sys; signal.signal(signal.SIGHUP, signal.SIG_IGN); sys.argv = ['curvify', 'schemes']\n"
    code += "from curvify.cli.main import main\ntry: main()\nfinally: print(signal.getsignal(signal.SIGHUP).name)"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert ended.stdout.decode().splitlines()[-1] == "SIG_IGN"


@pytest.mark.parametrize("format", ["ply", "obj"])
def test_a_reader_that_leaves_is_no_error(shell, format):
    result = shell(
        f"curvify refine cube.obj - --output-format {format} -k 60 | head -c 100 | wc -c; echo ${{PIPESTATUS[0]}}"
    )
    assert result.out.split() == [b"100", b"0"]
    assert result.err == ""


def test_small_output_to_a_reader_that_left(shell):
    result = shell("(sleep 0.5; curvify schemes --json; echo $? >&2) | true")
    assert result.err == "0\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_no_room_on_standard_output(shell):
    for command in ("refine cube.obj - --output-format ply", "schemes", "--version"):
        result = shell(f"curvify {command} > /dev/full")
        assert result.code == 2
        assert result.err.startswith("curvify: error: ")
        assert "no space left" in result.err
        assert result.err.count("\n") == 1


def test_closed_streams(shell):
    result = shell("curvify refine cube.obj - --output-format ply >&-")
    assert (result.code, result.err) == (2, "curvify: error: standard output is closed\n")
    assert shell("curvify refine - dense.ply --input-format obj <&-").err.startswith("curvify: error: ")
    assert shell("curvify refine dart.obj dense.ply 2>&-").code == 0
    result = shell("curvify refine dart.obj - --output-format ply 2>&-")
    assert result.out.startswith(b"ply\n")
    assert shell("curvify refine absent.obj dense.ply 2>&-").out == b""


def test_devices_are_written_straight(shell):
    result = shell("curvify refine cube.obj /dev/stdout --output-format ply -k 1")
    assert result.code == 0
    assert result.out.startswith(b"ply\n")
    assert shell("curvify refine cube.obj /dev/null --output-format ply --report -").code == 0


def test_standard_output_holds_data_only(process):
    result = process("refine", "dart.obj", "-", "--output-format", "ply", "-v")
    assert result.code == 0
    assert "warning" in result.err
    assert b"curvify" not in result.out


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak memory of a process is read from /proc")
def test_a_million_faces_take_little_memory(folder: Path) -> None:
    curvify.write(torus(64, 64), "coarse.ply")
    code = "from curvify.cli.main import main; from pathlib import Path\n"
    code += "try: main()\nfinally: print(Path('/proc/self/status').read_text())"
    arguments = ["refine", "coarse.ply", "dense.ply", "--level", "8", "--threads", "2", "--quiet"]
    ended = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, check=True, timeout=60)
    assert b"element face 1048576" in (folder / "dense.ply").read_bytes()[:1000]
    peak = next(int(line.split()[1]) for line in ended.stdout.decode().splitlines() if line.startswith("VmHWM"))
    assert peak < 110_000, "kilobytes; the file has 53,000, and 70,000 were enough when this was written"


def test_the_installed_command_ends_with_the_code_and_the_whole_output(folder: Path) -> None:
    command = [sys.executable, "-c", "from curvify.cli.main import command; command()"]
    ended = subprocess.run(
        [*command, "refine", "cube.obj", "-", "--output-format", "obj"], capture_output=True, timeout=60, check=True
    )
    assert ended.stdout.count(b"\nf ") == 6 * 100
    assert subprocess.run([*command, "refine", "none.obj", "x.ply"], capture_output=True, check=False).returncode == 2
    assert b"curvify" in subprocess.run([*command, "--version"], capture_output=True, check=True).stdout
