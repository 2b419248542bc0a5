"""`--report`: what it says, checked against the files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import curvify
from curvify.polygons import newell_normals
from curvify.topology import signed_volume

TORUS = Path(__file__).parents[2] / "sample_meshes" / "torus.obj"


def volume(path):
    mesh = curvify.read(path)
    area = newell_normals(mesh.positions, mesh.face_offsets, mesh.face_vertices)
    return signed_volume(mesh.positions, mesh.face_offsets, mesh.face_vertices, area)


def test_the_report_of_a_closed_mesh(call, folder):
    result = call("refine", TORUS, "dense.ply", "--report", "report.json", "--threads", "2", "-k", "4")
    assert (result.code, result.out, result.err) == (0, b"", "")
    report = json.loads(Path("report.json").read_text())
    assert report["schema"] == 1
    assert report["curvify"] == curvify.__version__
    assert report["command"] == "refine"
    assert (report["input"], report["output"]) == (str(TORUS), "dense.ply")
    assert (report["scheme"], report["level"]) == ("gregory", 4)
    assert report["options"]["cross_tangent"] == "precise"
    assert report["options"]["precision"] == "float32"
    assert report["backend"] == {"name": "cpu", "threads": 2}
    assert report["counts"]["input"]["faces"] == 36
    size = Path("dense.ply").stat().st_size
    assert report["counts"]["output"] == {"vertices": 2304, "wedges": 2304, "faces": 2304, "bytes": size}
    assert set(report["timings"]) == {"read", "prepare", "open_backend", "evaluate_and_write"}
    assert report["bytes_sent_to_gpu"] == 0
    assert report["gpu"] is None
    assert report["g1"]["edges_measured"] == report["g1"]["edges_smooth"] == 72
    assert 0 <= report["g1"]["mean_degrees"] <= report["g1"]["max_degrees"] < 1e-6
    assert report["vertex_deviation"] == 0
    assert 0 < report["vertex_rounding"] < 1e-6
    assert report["volume_ratio"] == pytest.approx(volume("dense.ply") / volume(TORUS), rel=1e-6)
    assert report["marks"] == {}
    assert report["warnings"] == []


def test_the_report_does_not_depend_on_threads_or_the_sink(call, folder):
    found = []
    for output in ("dense.ply", "dense.obj", "dense.stl", "dense.ply"):
        threads = len(found) + 1
        assert call("refine", TORUS, output, "-k", "40", "--report", "r.json", "--threads", threads).code == 0
        report = json.loads(Path("r.json").read_text())
        found.append([report[name] for name in ("volume_ratio", "vertex_deviation", "vertex_rounding", "g1")])
    assert all(values == found[0] for values in found)


def test_faces_that_come_early_are_measured_in_the_end(folder):
    from curvify.cli.report import Recorder
    from curvify.refinement import surface
    from curvify.sinks import ArraySink

    made = surface(curvify.read("cube.obj"))
    ordered = Recorder(made)
    made.stream(ordered.into(ArraySink()), 3, threads=1)

    class Backwards(Recorder):
        """Gets its faces before its vertices."""

        def begin(self, layout):
            super().begin(layout)
            self.calls = []

        def vertices(self, start, records):
            self.calls.append((start, records))

        def end(self):
            for call in self.calls:
                super().vertices(*call)
            super().end()

    late = Backwards(made.patches)
    made.stream(late.into(ArraySink()), 3, threads=1)
    assert late.volume_ratio == ordered.volume_ratio


def test_a_vertex_that_moves_is_noticed(folder):
    from curvify.cli.report import Recorder
    from curvify.refinement import surface
    from curvify.sinks import ArraySink

    made = surface(curvify.read("cube.obj"))
    recorder = Recorder(made)
    recorder.coarse.positions[3] = 5.0  # the curves still end where it was
    made.stream(recorder.into(ArraySink()), 1)
    assert recorder.deviation == 0
    recorder._expected = recorder._expected + np.array([0, 0, 0.25])
    recorder._missing = 0
    recorder.vertices(0, recorder.sink.records[:8])
    assert recorder.deviation == 0.25


def test_an_open_mesh_has_no_volume(call, folder):
    result = call("refine", "dart.obj", "dense.ply", "--report", "-")
    report = json.loads(result.out)
    assert report["volume_ratio"] is None
    assert report["g1"]["edges_measured"] == 1
    assert report["warnings"] == ["dart.obj: 1 concave face split into convex pieces, first: 0"]
    assert "warning" in result.err


def test_an_open_mesh_without_inner_edges_has_no_angles(call, folder):
    Path("one.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    report = json.loads(call("refine", "one.obj", "dense.ply", "--report", "-").out)
    assert report["g1"] == {"max_degrees": None, "mean_degrees": None, "edges_measured": 0, "edges_smooth": 0}


def test_bytes_are_counted_in_a_pipe(process):
    result = process("refine", "cube.obj", "-", "--output-format", "obj", "--report", "r.json")
    assert result.code == 0
    assert json.loads(Path("r.json").read_text())["counts"]["output"]["bytes"] == len(result.out)


def test_marks_are_counted(call, folder):
    with Path("cube.obj").open("a") as file:
        file.write("t crease 2/1/0 0 1 10.0\nt corner 1/1/0 2 10.0\n")
    report = json.loads(call("refine", "cube.obj", "dense.ply", "--report", "-").out)
    assert report["marks"]["tags"] == {"crease": 1, "corner": 1}


def test_no_report_of_a_failure(call, folder):
    before = sorted(folder.iterdir())
    assert call("refine", "cube.obj", "dense.ply", "--report", "r.json", "--max-faces", "3").code == 2
    assert sorted(folder.iterdir()) == before
