"""The GPU backend beside the CPU's: seconds and CPU seconds for positions and normals, in one run.

    python benchmarks/gpu.py [--faces 10000] [--level 5] [--runs 5]

The mesh is a torus of quads. Opening the device and compiling its programs are timed apart. On a software renderer the
CPU seconds are what counts: it uses all processors. Backends take turns, and the medians are shown.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import curvify
from curvify.backends import Backend, open_backend
from curvify.mesh import PolygonMesh
from curvify.sinks import DenseLayout


class Nowhere:
    """A sink that drops everything."""

    anywhere = True

    def begin(self, layout: DenseLayout) -> None:
        """Nothing to prepare."""

    def vertices(self, start: int, records: object) -> None:
        """Drop them."""

    def faces(self, start: int, wedges: object, source_faces: object) -> None:
        """Drop them."""

    def end(self) -> None:
        """Nothing to finish."""


def torus(faces: int) -> PolygonMesh:
    """A torus of about so many quads."""
    tube = round((faces / 2) ** 0.5)
    around = 2 * tube
    u, v = np.meshgrid(np.arange(around) / around, np.arange(tube) / tube, indexing="ij")
    u, v = 2 * np.pi * u.ravel(), 2 * np.pi * v.ravel()
    radius = 3 + np.cos(v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), np.sin(v)], axis=1)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(around), np.arange(tube), indexing="ij"))
    ahead, over = (i + 1) % around, (j + 1) % tube
    quads = np.stack([i * tube + j, ahead * tube + j, ahead * tube + over, i * tube + over], axis=1)
    return PolygonMesh.from_faces(points, quads.tolist())


def timed(surface: curvify.Surface, level: int, backend: Backend) -> tuple[float, float, int]:
    """Seconds, CPU seconds and samples of one evaluation."""
    wall, cpu = time.perf_counter(), time.process_time()
    layout = surface.stream(Nowhere(), level, np.float32, backend=backend)
    return time.perf_counter() - wall, time.process_time() - cpu, layout.vertex_count


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--faces", type=int, default=10_000)
    parser.add_argument("--level", type=int, default=5)
    parser.add_argument("--runs", type=int, default=5)
    given = parser.parse_args()
    surface = curvify.surface(torus(given.faces))
    start = time.perf_counter()
    with open_backend("gpu", 0) as gpu, open_backend("cpu", 0) as cpu:
        print(f"{gpu.describe()['renderer']}: opened in {time.perf_counter() - start:.2f} s")
        first = {backend.name: timed(surface, given.level, backend) for backend in (gpu, cpu)}
        runs: dict[str, list[tuple[float, float, int]]] = {"cpu": [], "gpu": []}
        for _ in range(given.runs):
            for backend in (cpu, gpu):
                runs[backend.name].append(timed(surface, given.level, backend))
    print("| backend | samples | wall, s | CPU, s | CPU, ns a sample | first run, CPU s |\n|---|--:|--:|--:|--:|--:|")
    middle = {}
    for name, found in runs.items():
        wall, middle[name] = (statistics.median(run[i] for run in found) for i in (0, 1))
        each = 1e9 * middle[name] / found[0][2]
        print(f"| {name} | {found[0][2]:,} | {wall:.3f} | {middle[name]:.3f} | {each:.0f} | {first[name][1]:.3f} |")
    print(f"\nCPU seconds, gpu over cpu: {middle['gpu'] / middle['cpu']:.2f}")


if __name__ == "__main__":
    main()
