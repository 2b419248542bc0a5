"""`curvify batch`: every file done once, none half, and what fails is told."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import click
import pytest

import curvify
from curvify.cli import workers
from curvify.cli.batch import NOT_FORWARDED, command
from curvify.cli.batch_job import Job, job_key
from curvify.cli.refine import command as refine
from curvify.cli.surfaces import refine_values

CURVIFY = [sys.executable, "-c", "from curvify.cli.main import main; main()"]
LINUX = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds workers in /proc")


@pytest.fixture
def assets(folder):
    """Three meshes in two folders."""
    for name in ("a/one", "a/two", "b/three"):
        path = Path(f"assets/{name}.obj")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(Path("cube.obj").read_text())
    return folder


def statuses(report: bytes | str) -> dict[str, str]:
    """Status by the name of the input."""
    return {file["input"]: file["status"] for file in json.loads(report)["files"]}


def outputs() -> list[str]:
    """Everything in the output folder but the stamps."""
    found = [path for path in Path("out").rglob("*") if path.is_file() and ".curvify" not in path.parts]
    return sorted(str(path.relative_to("out")) for path in found)


def batch(*args: object) -> list[str]:
    return ["batch", "assets/**/*.obj", "--output-dir", "out", "-j", "2", *map(str, args)]


def test_files_keep_their_places(call, assets):
    result = call(*batch("-k", "2"))
    assert (result.code, result.out) == (0, b"")
    assert outputs() == ["a/one.ply", "a/two.ply", "b/three.ply"]
    assert curvify.read("out/b/three.ply").face_count == 24 * 4
    table = result.err.splitlines()
    assert table[0].split() == ["file", "faces", "size", "seconds"]
    assert [row.split()[:3] for row in table[1:4]] == [
        [f"assets/{name}.obj", "done", "96"] for name in ("a/one", "a/two", "b/three")
    ]
    assert table[4] == "curvify: 3 done"
    assert call(*batch("-q")).err == ""


def test_the_same_bytes_as_refine(call, assets):
    options = ["-k", "3", "--cross-tangent", "smooth", "--triangulate", "--precision", "float64"]
    assert call(*batch("--suffix", "ply", *options)).code == 0
    assert call("refine", "cube.obj", "one.ply", *options).code == 0
    assert Path("out/a/one.ply").read_bytes() == Path("one.ply").read_bytes()
    assert call(*batch("--suffix", ".obj")).code == 0
    assert curvify.read("out/a/one.obj").face_count == 600


def test_every_option_of_refine_is_forwarded():
    own = {option.name for option in command.params}
    wanted = {option.name for option in refine.params if isinstance(option, click.Option)} - set(NOT_FORWARDED)
    assert wanted <= own
    assert refine_values("i", "o", {"level": 7, "jobs": 3})["level"] == 7
    assert "jobs" not in refine_values("i", "o", {"jobs": 3})


def test_a_failure_stops_the_rest_unless_told_to_go_on(call, assets):
    Path("assets/a/bad.obj").write_text("f 1 2 3\n")
    result = call("batch", "assets/**/*.obj", "--output-dir", "out", "-j", "1", "--report", "-")
    assert result.code == 2
    assert statuses(result.out) == {
        "assets/a/bad.obj": "failed", "assets/a/one.obj": "not run", "assets/a/two.obj": "not run",
        "assets/b/three.obj": "not run",
    }  # fmt: skip
    assert outputs() == []
    result = call(*batch("--keep-going"))
    assert result.code == 2
    assert outputs() == ["a/one.ply", "a/two.ply", "b/three.ply"]
    last = result.err.splitlines()[-1]
    assert last == "curvify: error: 3 done, 1 failed; assets/a/bad.obj:1: face refers to vertex 1, the file has 0"


def test_all_failures_are_told_without_a_table(call, assets):
    for name in ("bad", "worse"):
        Path(f"assets/{name}.obj").write_text("f 1 2 3\n")
    lines = call(*batch("--keep-going", "-q")).err.splitlines()
    assert [line.split()[1:3] for line in lines] == [["error:", "assets/worse.obj:1:"], ["error:", "3"]]
    assert "assets/bad.obj:1:" in lines[1]


def test_warnings_are_shown_and_counted(call, assets):
    Path("assets/dart.obj").write_text(Path("dart.obj").read_text())
    result = call(*batch())
    assert result.code == 0
    assert "curvify: warning: assets/dart.obj: 1 concave face split" in result.err
    assert [row.split()[-2:] for row in result.err.splitlines() if row.startswith("assets/dart")] == [["1", "warning"]]


def test_what_is_done_is_skipped_until_something_changes(call, assets):
    def run(*options: object) -> list[str]:
        result = call(*batch("--skip-existing", "--report", "-", *options))
        assert result.code == 0
        return list(statuses(result.out).values())

    assert run() == ["done"] * 3
    assert run() == ["skipped"] * 3
    assert run("--threads", "1") == ["skipped"] * 3  # which changes no byte
    assert run("-k", "2") == ["done"] * 3
    Path("assets/a/two.obj").write_text(Path("cube.obj").read_text() + "# edited\n")
    assert run("-k", "2") == ["skipped", "done", "skipped"]
    Path("out/a/one.ply").write_text("mine")
    assert run("-k", "2") == ["done", "skipped", "skipped"]
    Path("out/b/three.ply").unlink()
    assert run("-k", "2") == ["skipped", "skipped", "done"]
    for stamp in Path("out/.curvify").rglob("one.ply.json"):
        stamp.write_text("{")
    assert run("-k", "2") == ["done", "skipped", "skipped"]


def test_without_the_option_nothing_is_skipped(call, assets):
    assert call(*batch()).code == 0
    assert set(statuses(call(*batch("--report", "-")).out).values()) == {"done"}


def key(**values: object) -> str:
    """Key of a job on cube.obj."""
    return job_key(Job("cube", refine_values("cube.obj", "out.ply", values), "stamp", True))


def test_the_key_covers_all_that_the_bytes_depend_on(folder, monkeypatch):
    first = key()
    assert first == key(threads=3, quiet=True, max_faces=5)
    keys = {first, key(level=3), key(weld="never"), key(triangulate=True)}
    Path("marks.json").write_text('{"marks": 1}')
    keys.add(key(marks="marks.json"))
    Path("marks.json").write_text('{"marks": 1, "faces": []}')
    keys.add(key(marks="marks.json"))
    monkeypatch.setattr("curvify.cli.batch_job.__version__", "99")
    keys.add(key())
    Path("cube.obj").write_text("")
    keys.add(key())
    assert len(keys) == 8


def test_the_key_covers_the_buffers_of_gltf(folder):
    buffer = {"uri": "points%20here.bin", "byteLength": 3}
    Path("mesh.gltf").write_text(json.dumps({"buffers": [buffer, {"uri": "data:,abc"}, {"byteLength": 1}]}))
    keys = set()
    for content in ("abc", "abd"):
        Path("points here.bin").write_text(content)
        keys.add(job_key(Job("mesh", refine_values("mesh.gltf", "out.ply", {}), "stamp", True)))
    assert len(keys) == 2


def test_patterns_and_names(call, assets):
    Path("assets/a/skin.png").write_text("")
    result = call("batch", "assets/**/*", "--output-dir", "out")
    assert result.code == 0
    assert "1 file of unknown formats left out, first: assets/a/skin.png" in result.err
    assert call("batch", "assets/a/one.obj", "assets/b/three.obj", "--output-dir", "named").code == 0
    assert sorted(str(p) for p in Path("named").rglob("*.ply")) == ["named/a/one.ply", "named/b/three.ply"]
    again = call("batch", "**/*.ply", "--output-dir", "out", "--suffix", ".obj")
    assert again.code == 0  # what lies in out is no input
    assert sorted(str(p) for p in Path("out").rglob("*.obj")) == ["out/named/a/one.obj", "out/named/b/three.obj"]


BAD = {
    "nothing fits": (["assets/*.stl", "--output-dir", "out"], "assets/*.stl"),
    "only outputs fit": (["assets/**/*.obj", "--output-dir", "assets"], "except in assets"),
    "unknown suffix": (["*.obj", "--output-dir", "out", "--suffix", ".blend"], "--suffix .blend: that is no format"),
    "a folder": (["assets/a", "--output-dir", "out"], "give a pattern in quotes, such as 'assets/a/**/*.obj'"),
    "a file to put files in": (["cube.obj", "--output-dir", "cube.obj"], "--output-dir cube.obj: that is a file"),
    "two to one": (["assets/a/*.obj", "assets/b/../a/*.obj", "--output-dir", "out"], "would both go to"),
    "over itself": (["*.obj", "--output-dir", ".", "--suffix", ".obj"], "except in ."),
    "named over itself": (["cube.obj", "--output-dir", ".", "--suffix", ".obj"], "would replace an input"),
    "no folder": (["cube.obj"], "--output-dir"),
    "no pattern": (["--output-dir", "out"], "PATTERN"),
    "report nowhere": (["cube.obj", "--output-dir", "out", "--report", "nowhere/r.json"], "nowhere/r.json"),
    "jobs of Dask": (["cube.obj", "--output-dir", "out", "--dask", "tcp://127.0.0.1:1", "-j", "2"], "--jobs"),
    "all of unknown formats": (["assets/**/*.png", "--output-dir", "out"], "has a format that can be read"),
}


@pytest.mark.parametrize("name", BAD)
def test_one_line_and_nothing_made(call, assets, name):
    Path("assets/skin.png").write_text("")
    before = sorted(assets.rglob("*"))
    args, part = BAD[name]
    result = call("batch", *args)
    assert (result.code, result.out, result.err.count("\n")) == (2, b"", 1)
    assert part in result.err
    assert sorted(assets.rglob("*")) == before


def test_a_missing_file_fails_alone(call, assets):
    result = call("batch", "assets/a/one.obj", "assets/a/none.obj", "--output-dir", "out", "--keep-going")
    assert result.code == 2
    assert "1 done, 1 failed; assets/a/none.obj: cannot read: there is no such file" in result.err
    assert outputs() == ["one.ply"]


# --- processes that die -----------------------------------------------------------------------------------------


def many(count: int) -> None:
    """Many tiny meshes."""
    Path("assets").mkdir()
    for number in range(count):
        Path(f"assets/{number:02}.obj").write_text(Path("cube.obj").read_text() + f"# {number}\n")


def workers_of(pid: int) -> list[int]:
    """Worker processes of a batch."""
    found = []
    for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
        if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
            found.append(int(child))
    return found


def wait_for(what: Callable[[], object], seconds: float = 30) -> None:
    """Wait until something holds."""
    deadline = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def parts() -> list[Path]:
    """Unfinished files."""
    return [path for path in Path("out").rglob(".curvify-*") if path.is_file()]


def check_outputs() -> None:
    """Every file under a target name is whole."""
    expected = Path("expected.ply").read_bytes()
    assert all(Path("out", name).read_bytes() == expected for name in outputs() if name.endswith(".ply"))


@LINUX
def test_a_killed_worker_costs_its_file_only(process, folder):
    many(50)
    level = ["-k", "30"]
    assert process("refine", "cube.obj", "expected.ply", *level).code == 0
    arguments = batch(*level, "--keep-going", "--report", "report.json")
    with subprocess.Popen([*CURVIFY, *arguments], stderr=subprocess.PIPE) as running:
        # In the middle of the batch and of a file: the worker dies while it writes.
        wait_for(lambda: len(outputs()) - len(parts()) >= 5 and parts())
        os.kill(workers_of(running.pid)[0], signal.SIGKILL)
        err = running.communicate(timeout=60)[1].decode()
    found = list(statuses(Path("report.json").read_text()).values())
    assert running.returncode == 2
    assert found.count("done") >= 48  # all but the one that it worked on
    assert found.count("done") + found.count("failed") == 50
    assert "was killed (SIGKILL)" in err
    check_outputs()
    assert parts() == []
    result = process(*batch(*level, "--skip-existing", "--report", "-"))
    assert result.code == 0
    assert list(statuses(result.out).values()).count("done") == found.count("failed")
    assert len(outputs()) == 50
    check_outputs()


@LINUX
def test_a_killed_batch_leaves_what_the_next_one_removes(process, folder):
    many(50)
    level = ["-k", "30"]
    assert process("refine", "cube.obj", "expected.ply", *level).code == 0
    with subprocess.Popen([*CURVIFY, *batch(*level)], stderr=subprocess.DEVNULL) as running:
        wait_for(lambda: len(outputs()) - len(parts()) >= 5 and parts())
        both = workers_of(running.pid)
        for pid in (running.pid, *both):
            os.kill(pid, signal.SIGKILL)
    check_outputs()
    before = len(outputs()) - len(parts())
    assert 5 <= before < 50
    result = process(*batch(*level, "--skip-existing", "--report", "-", "-v"))
    assert result.code == 0
    skipped = list(statuses(result.out).values()).count("skipped")
    assert before - 2 <= skipped <= before  # each worker may have died before its stamp
    assert parts() == []
    assert len(outputs()) == 50
    check_outputs()


@LINUX
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_stopped_batch_cleans_up(folder, number, code):
    many(6)
    default = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731
    with subprocess.Popen(
        [*CURVIFY, *batch("-k", "300")], stderr=subprocess.PIPE, preexec_fn=default, start_new_session=True
    ) as running:
        wait_for(lambda: len(parts()) == 2)
        both = workers_of(running.pid)
        os.killpg(running.pid, number) if number == signal.SIGINT else running.send_signal(number)
        err = running.communicate(timeout=30)[1]
    assert running.returncode == code
    assert err.count(b"\n") == 1
    assert parts() == []
    assert not any(Path(f"/proc/{pid}").exists() for pid in both)


def test_a_worker_that_is_gone_is_replaced(folder):
    worker = workers.Worker()
    worker.process.kill()
    worker.process.join()
    while worker.give(Job("none", {}, "", False)):  # until the pipe notices
        time.sleep(0.01)
    assert not worker.alive


def test_leftovers_of_the_living_stay(folder):
    from curvify.formats.files import atomic_file, remove_leftovers

    Path(".curvify-0123456789ab.part").write_text("left")
    with atomic_file("mine.txt") as out:
        out.write(b"mine")
        assert remove_leftovers(folder) == 1
        assert len(list(folder.glob(".curvify-*.part"))) == 1
    assert Path("mine.txt").read_text() == "mine"
    assert remove_leftovers(folder) == 0


# --- more than one machine --------------------------------------------------------------------------------------


def test_no_scheduler(call, assets, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("curvify.cli.batch_dask.PATIENCE", "1s")
    result = call("batch", "assets/**/*.obj", "--output-dir", "out", "--dask", "tcp://127.0.0.1:1")
    assert result.code == 2
    assert "no Dask scheduler at tcp://127.0.0.1:1" in result.err


def test_no_dask(call, assets, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    result = call("batch", "assets/**/*.obj", "--output-dir", "out", "--dask", "tcp://127.0.0.1:1")
    assert (result.code, "pip install 'distributed>=2024.1'" in result.err) == (2, True)


def test_nothing_is_lost_when_a_dask_worker_dies(call, process, folder):
    distributed = pytest.importorskip("distributed", reason="needs the extra dask")
    many(30)
    level = ["-k", "20"]
    assert process("refine", "cube.obj", "expected.ply", *level).code == 0
    settings = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": 50}
    with distributed.LocalCluster(**settings) as cluster:
        arguments = ["batch", "assets/*.obj", "--output-dir", "out", "--dask", cluster.scheduler_address, *level]
        with subprocess.Popen([*CURVIFY, *arguments, "--report", "report.json"], stderr=subprocess.PIPE) as running:
            wait_for(lambda: len(list(Path("out").glob("*.ply"))) >= 3)
            os.kill(cluster.workers[0].pid, signal.SIGKILL)
            err = running.communicate(timeout=60)[1].decode()
        assert (running.returncode, err.splitlines()[-1]) == (0, "curvify: 30 done")
        assert set(statuses(Path("report.json").read_text()).values()) == {"done"}
        check_outputs()
        assert (len(outputs()), parts()) == (30, [])
        Path("assets/00.obj").write_text("f 1 2 3\n")
        result = call(*arguments, "--skip-existing", "--report", "-", "--keep-going")
        assert result.code == 2
        assert sorted(statuses(result.out).values()) == ["failed"] + ["skipped"] * 29
