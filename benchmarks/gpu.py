"""The GPU backend beside the CPU's, in one run: where its time goes, samples a second, and the papers' own figures.

    python benchmarks/gpu.py
    python benchmarks/gpu.py --faces 1000 --levels 5,10 --schemes gregory,blend --no-papers

For each scheme, number of faces and level: the device's time for programs by timer queries; seconds for uploads and for
reading back until they are done; a whole refinement, from a prepared surface to records that nobody keeps, and into a
PLY file; the same on the CPU. What is sent the first time includes tables and coefficients that stay there. Then the
rows of three papers beside ours, on meshes with as many faces: the papers' own are not public. On a software renderer
CPU seconds are what counts: it uses all processors. Cases with more samples than ``--most`` are left out and named.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import curvify
import meshes
from curvify.backends import Backend, CpuBackend
from curvify.gpu.evaluate import GpuBackend
from curvify.mesh import PolygonMesh
from curvify.sinks import DenseLayout
from device_time import DeviceTime, copy_rate, watch_device

#: The tiling that each scheme is measured on, and its corners.
TILINGS = {"gregory": "quads", "blend": "quads", "png1": "triangles", "pn": "triangles", "phong": "triangles"}
CORNERS = {"triangles": 3, "quads": 4, "pentagons": 5}
#: Samples of a case, at most, unless told: on a GPU, and on a processor that acts as one.
MOST = {True: 200_000_000, False: 1_500_000}
#: Bytes that are copied to see how fast a device is, likewise.
COPIED = {True: 1 << 28, False: 1 << 24}
#: Paper 000, Table 1: model, polygons, corners, milliseconds at k = 3 and 5 on a GeForce GTX 295.
GREGORY_ROWS = (
    ("Torus", 36, 144, 79, 80),
    ("Chessman", 90, 368, 85, 87),
    ("Monkey", 500, 1968, 87, 111),
    ("Head", 1360, 5358, 115, 159),
    ("Frog", 1776, 7054, 125, 184),
    ("Dinosaur", 2382, 12146, 193, 327),
    ("Armadillo", 2384, 12206, 191, 325),
    ("Rabbit", 2451, 12474, 192, 331),
)
#: Paper 003, Table 3: mesh, faces, frames a second on a GeForce 6800 Ultra and on a Pentium 4; 30 x 30 samples a face.
BLEND_ROWS = (("(a)", 32, 438.2, 25.40), ("(c)", 179, 73.0, 3.84), ("(e)", 442, 30.1, 1.48))
#: Paper 002, section 4: triangles, segments, frames a second of PN and of PNG1 on a GeForce 8800 GTX.
TRIANGLE_ROWS = ((200, 8, 316.5, 138.5), (200, 10, 214, 93), (1084, 8, 61.8, 20), (1084, 10, 42, 14))


#: Columns of the table of schemes.
TITLES = (
    "scheme",
    "faces",
    "level",
    "samples",
    "kernel ms",
    "M samples/s",
    "GB/s written",
    "MB sent first",
    "MB sent again",
    "upload ms",
    "readback ms",
    "whole ms",
    "into a file ms",
    "CPU backend ms",
    "CPU s: GPU over CPU backend",
)
#: Columns of our own figures in the papers' tables.
OURS = "kernel ms | whole ms | CPU backend ms"


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


@dataclass
class Case:
    """What one case took: medians in seconds, bytes."""

    samples: int
    kernel: float
    upload: float
    readback: float
    first_sent: int
    sent: int
    whole: float
    whole_cpu: float
    file: float
    cpu: float
    cpu_seconds: float


def torus(kind: str, faces: int) -> PolygonMesh:
    """A torus of about so many triangles, quads or pentagons."""
    positions, polygons = meshes.torus(kind, faces * CORNERS[kind])
    return PolygonMesh.from_faces(positions, np.concatenate(polygons).tolist())


def timed(surface: curvify.Surface, level: int, backend: Backend) -> tuple[float, float, int]:
    """Seconds, CPU seconds and samples of one evaluation."""
    wall, cpu = time.perf_counter(), time.process_time()
    layout = surface.stream(Nowhere(), level, np.float32, backend=backend, max_faces=1 << 40)
    return time.perf_counter() - wall, time.process_time() - cpu, layout.vertex_count


class Bench:
    """An open device under watch."""

    def __init__(self, gpu: GpuBackend, watch: DeviceTime, runs: int, most: int | None) -> None:
        self.gpu, self.watch, self.runs = gpu, watch, runs
        self.hardware = gpu.device.hardware
        self.most = MOST[self.hardware] if most is None else most
        self.left_out: list[str] = []

    def case(self, scheme: str, kind: str, faces: int, level: int) -> Case | None:
        """Measure one case; None where it is too large."""
        mesh = torus(kind, faces)
        samples = (
            int(mesh.face_sizes.sum()) * level**2 * (1 if CORNERS[kind] > 3 or scheme in ("gregory", "blend") else 2)
        )
        if samples > self.most:
            self.left_out.append(f"{scheme}, {faces:,} faces, level {level}: about {samples:,} samples")
            return None
        surface = curvify.surface(mesh, scheme)
        runs: dict[str, list[tuple[float, float, int]]] = {"cpu": [], "gpu": []}
        before = self.gpu.bytes_sent
        timed(surface, level, self.gpu)  # compiles, sends what is sent once
        first_sent = self.gpu.bytes_sent - before
        for _ in range(self.runs):
            runs["cpu"].append(timed(surface, level, CpuBackend()))
            runs["gpu"].append(timed(surface, level, self.gpu))
        with self.watch.running() as watch:
            timed(surface, level, self.gpu)
        cpu, gpu = ([statistics.median(run[i] for run in runs[name]) for i in (0, 1)] for name in ("cpu", "gpu"))
        return Case(
            runs["gpu"][0][2],
            watch.device["kernel"],
            watch.wall["upload"],
            watch.wall["readback"],
            first_sent,
            watch.bytes["upload"],
            gpu[0],
            gpu[1],
            self.into_file(surface, level),
            cpu[0],
            cpu[1],
        )

    def into_file(self, surface: curvify.Surface, level: int) -> float:
        """Seconds of a refinement into a PLY file, which is then deleted."""
        with tempfile.TemporaryDirectory() as folder:
            begun = time.perf_counter()
            surface.write(Path(folder) / "dense.ply", level, backend=self.gpu, max_faces=1 << 40)
            return time.perf_counter() - begun


def schemes_table(bench: Bench, schemes: list[str], sizes: list[int], levels: list[int]) -> None:
    """Every scheme, number of faces and level; 24 bytes are written for each sample."""
    rates = bench.gpu.products.run(copy_rate, bench.gpu.device, COPIED[bench.hardware])
    written, back = (rate / 1e9 for rate in rates)
    print(f"A copy on the device writes {written:.3g} GB/s; {back:.3g} GB/s come back.\n")
    print("| " + " | ".join(TITLES) + " |\n|--|" + "--:|" * (len(TITLES) - 1))
    for scheme in schemes:
        for faces in sizes:
            for level in levels:
                case = bench.case(scheme, TILINGS[scheme], faces, level)
                if case is None:
                    continue
                rate = case.samples / max(case.kernel, 1e-9)
                cells = [
                    f"{scheme}", f"{faces:,}", f"{level}", f"{case.samples:,}", f"{1e3 * case.kernel:.2f}",
                    f"{rate / 1e6:.1f}", f"{24 * rate / 1e9:.3g}", f"{case.first_sent / 1e6:.2f}",
                    f"{case.sent / 1e6:.2f}", f"{1e3 * case.upload:.2f}", f"{1e3 * case.readback:.2f}",
                    f"{1e3 * case.whole:.1f}",
                    f"{1e3 * case.file:.1f}", f"{1e3 * case.cpu:.1f}", f"{case.whole_cpu / case.cpu_seconds:.2f}",
                ]  # fmt: skip
                print("| " + " | ".join(cells) + " |", flush=True)


def papers_tables(bench: Bench) -> None:
    """The papers' own rows, and ours on a torus of as many faces."""
    print("\nn-sided Gregory patches, Table 1 of their paper (GeForce GTX 295): milliseconds at k = 3 and 5\n")
    print(f"| model | polygons | k | paper ms | {OURS} |\n|--|" + "--:|" * 6)
    for name, polygons, corners, *paper in GREGORY_ROWS:
        kind = "pentagons" if corners > 4.5 * polygons else "quads"
        for level, milliseconds in zip((3, 5), paper, strict=True):
            print_row(bench.case("gregory", kind, polygons, level), f"{name} | {polygons:,} | {level} | {milliseconds}")
    print("\nBlending surfaces, Table 3 of their paper (GeForce 6800 Ultra; Pentium 4): 30 x 30 samples a face\n")
    print(f"| mesh | faces | paper GPU ms | paper CPU ms | {OURS} |\n|--|" + "--:|" * 6)
    for name, faces, gpu, cpu in BLEND_ROWS:
        print_row(bench.case("blend", "quads", faces, 15), f"{name} | {faces} | {1e3 / gpu:.2f} | {1e3 / cpu:.1f}")
    print("\nPN and PNG1 triangles, section 4 of the paper on PNG1 (GeForce 8800 GTX)\n")
    print(f"| scheme | triangles | segments | paper ms | {OURS} |\n|--|" + "--:|" * 6)
    for faces, segments, *frames in TRIANGLE_ROWS:
        for scheme, rate in zip(("pn", "png1"), frames, strict=True):
            case = bench.case(scheme, "triangles", faces, segments // 2)
            print_row(case, f"{scheme} | {faces:,} | {segments} | {1e3 / rate:.1f}")


def print_row(case: Case | None, begin: str) -> None:
    """A row of the papers' tables."""
    if case is not None:
        ours = " | ".join(f"{1e3 * seconds:.2f}" for seconds in (case.kernel, case.whole, case.cpu))
        print(f"| {begin} | {ours} |", flush=True)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--faces", default="1000,10000,100000")
    parser.add_argument("--levels", default="5,10,20")
    parser.add_argument("--schemes", default=",".join(TILINGS))
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--most", type=int, help="samples of a case, at most")
    parser.add_argument("--no-papers", action="store_true", help="leave out the papers' rows")
    given = parser.parse_args()
    sizes, levels = ([int(number) for number in text.split(",")] for text in (given.faces, given.levels))
    begun = time.perf_counter()
    try:
        gpu = GpuBackend()
    except curvify.errors.DeviceError as error:
        sys.exit(f"nothing to measure: {error}")
    with gpu:
        watch = watch_device(gpu.device)
        kind = "a GPU" if gpu.device.hardware else "software: the device's time is the processor's"
        print(f"{gpu.device.renderer} ({gpu.device.version}), {kind}; {os.cpu_count()} processors, load", end=" ")
        print(f"{os.getloadavg()[0]:.1f}; opened in {time.perf_counter() - begun:.2f} s\n")
        bench = Bench(gpu, watch, given.runs, given.most)
        schemes_table(bench, given.schemes.split(","), sizes, levels)
        if not given.no_papers:
            papers_tables(bench)
    for what in bench.left_out:
        print(f"\nleft out: {what}", end="")
    print()


if __name__ == "__main__":
    main()
