"""`--backend gpu` and `curvify backends` on a device."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import curvify
from curvify.cli.main import run

TORUS = Path(__file__).parents[2] / "sample_meshes" / "torus.obj"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch, device):
    """A folder to write to; and a device, or these tests are of no use."""
    monkeypatch.chdir(tmp_path)


def test_refine_on_the_gpu(device, capsys):
    assert run(["refine", str(TORUS), "cpu.ply", "--backend", "cpu"]) == 0
    assert run(["refine", str(TORUS), "gpu.ply", "--backend", "gpu", "-v", "--report", "report.json"]) == 0
    told = capsys.readouterr().err
    assert f"backend gpu ({device.renderer}), " in told
    assert "sent to the GPU: vectors 864 bytes, indices " in told
    assert "control vectors built on the GPU for 36 patches, on the CPU for 0; " in told
    assert "evaluated on the CPU: 0 patches, 0 edges" in told
    report = json.loads(Path("report.json").read_text())
    assert report["backend"]["name"] == "gpu"
    assert report["backend"]["renderer"] == device.renderer
    assert report["bytes_sent_to_gpu"] == sum(report["gpu"]["sent"].values()) > 0
    assert report["gpu"]["sent"]["vectors"] == 24 * 36
    assert report["gpu"]["sent"]["controls"] == 0
    assert report["gpu"]["patches"] == {"built_on_gpu": 36, "built_on_cpu": 0, "evaluated_on_cpu": 0}
    assert report["gpu"]["edges"] == {"evaluated_on_gpu": 72, "evaluated_on_cpu": 0}
    assert report["gpu"]["received"] > 0
    assert report["vertex_deviation"] == 0
    wanted, found = curvify.read("cpu.ply"), curvify.read("gpu.ply")
    assert np.array_equal(wanted.face_vertices, found.face_vertices)
    assert np.abs(wanted.positions - found.positions).max() < 1e-6


def test_what_the_gpu_does_not_build_is_told(capsys):
    assert run(["refine", str(TORUS), "out.ply", "--backend", "gpu", "--scheme", "blend", "-v"]) == 0
    told = capsys.readouterr().err
    assert "control vectors built on the GPU for 0 patches, on the CPU for 36; " in told
    assert run(["refine", str(TORUS), "out.ply", "--backend", "gpu", "--weld-normals", "-v"]) == 0
    assert "; evaluated on the CPU: 0 patches, 72 edges" in capsys.readouterr().err


def test_a_pipe_takes_the_same_bytes(capfdbinary):
    assert run(["refine", str(TORUS), "dense.ply", "--backend", "gpu"]) == 0
    capfdbinary.readouterr()
    assert run(["refine", str(TORUS), "-", "--output-format", "ply", "--backend", "gpu"]) == 0
    sys.stdout.flush()
    assert capfdbinary.readouterr().out == Path("dense.ply").read_bytes()


def test_backends_lists_the_device(device, capsys):
    assert run(["backends"]) == 0
    text = capsys.readouterr().out
    assert f"gpu: {device.renderer}, {'hardware' if device.hardware else 'software'}" in text
    assert f"OpenGL {device.version}" in text
    assert text.splitlines()[-1].startswith(f"auto: {'gpu' if device.hardware else 'cpu'}")


def test_backends_for_a_program(device, capsys):
    assert run(["backends", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["auto"] == ("gpu" if device.hardware else "cpu")
    facts = found["gpu"]
    assert facts.pop("available") is True
    assert facts == json.loads(json.dumps(device.facts()))
