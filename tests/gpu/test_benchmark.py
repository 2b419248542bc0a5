"""The benchmark of the GPU runs on any device, and its watch sees what the backend does."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from curvify.gpu.device import Device

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "gpu.py"


@pytest.mark.parametrize("scheme", ["gregory", "blend"])
def test_every_column_is_measured(scheme: str, device: Device) -> None:
    options = ["--faces", "30", "--levels", "2", "--runs", "1", "--schemes", scheme, "--no-papers"]
    ended = subprocess.run([sys.executable, str(BENCHMARK), *options], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    assert device.renderer in ended.stdout
    titles, _, row = (line.strip("| ").split(" | ") for line in ended.stdout.splitlines() if line.startswith("|"))
    found = dict(zip(titles, row, strict=True))
    assert found["scheme"] == scheme
    assert all(float(cell.replace(",", "")) >= 0 for name, cell in found.items() if name != "scheme")
    assert float(found["kernel ms"]) > 0


def test_what_is_too_large_is_named(device: Device) -> None:
    options = ["--faces", "30", "--levels", "2,9", "--schemes", "pn", "--no-papers", "--most", "800", "--runs", "1"]
    ended = subprocess.run([sys.executable, str(BENCHMARK), *options], capture_output=True, text=True, check=False)
    assert "left out: pn, 30 faces, level 9" in ended.stdout
    assert ended.stdout.count("| pn |") == 1
