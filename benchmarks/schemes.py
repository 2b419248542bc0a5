"""All schemes side by side: how close, how smooth, how costly. The table of docs/choosing-a-scheme.md.

    python benchmarks/schemes.py [--curvify COMMAND] [--runs 3]

Distances are rms over all vertices of the dense mesh, 16 segments an edge, in % of the radius (of the tube for the
torus), from meshes whose vertices and normals lie on a sphere, a torus or a cylinder. Kinks are the largest angle
between the patches on both sides of an edge, by their own derivatives, over a smooth mesh of triangles to hexagons;
overveld has no patches. Processor time and peak memory are those of whole processes, one thread, on a torus of 8,192
triangles with 32 segments an edge, time less that of a run with 2 segments: the smallest of some runs.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from processes import Costs, find_curvify, machine, make_mesh, markdown, run_to_file

ROOT = Path(__file__).resolve().parents[1]
#: Corners of the coarse mesh that costs are measured on; the levels of distances and of costs.
CORNERS, LEVEL, COSTLY, LOW = 24576, 8, 16, 1
COLUMNS = (
    "scheme",
    "sphere, icosahedron",
    "sphere, 12 pentagons, 20 hexagons",
    "torus, 12x8 quads",
    "torus, 24x16x2 triangles",
    "cylinder, 10x2 triangles",
    "kinks",
    "CPU µs by vertex",
    "peak MB",
)


def qualities(scheme: str) -> list[str]:
    """Distances in %, and kinks in degrees."""
    import numpy as np

    import curvify
    from accuracy import CASES
    from curvify.quality import edge_angles

    cases = ("icosahedron", "truncated icosahedron", "torus 12x8", "torus 24x16 triangles", "cylinder 10 triangles")
    cells = []
    for name in cases:
        case = CASES[name]
        dense = curvify.refine(case.make(), scheme, LEVEL, sharp_from="normals")
        cells.append(f"{100 * float(np.sqrt(np.mean(case.error(dense.positions) ** 2))):.2g} %")
    if scheme == "overveld":
        return [*cells, "halve with every pass"]
    angles = edge_angles(curvify.surface(curvify.read(ROOT / "sample_meshes" / "mixed.obj"), scheme).patches).angles
    return [*cells, f"{angles.max():.1g}°" if angles.max() < 1e-3 else f"{angles.max():.1f}°"]


def costs(curvify: str, mesh: Path, schemes: Sequence[str], runs: int) -> dict[str, list[str]]:
    """Processor time by vertex in microseconds, and peak memory in MB. The schemes take turns."""
    target = mesh.with_suffix(".ply")
    found: dict[tuple[str, int], Costs] = {(scheme, k): Costs() for scheme in schemes for k in (COSTLY, LOW)}
    for _ in range(runs):
        for (scheme, k), cost in found.items():
            line = [curvify, "refine", str(mesh), str(target), "--scheme", scheme, "-k", str(k), "--threads", "1", "-q"]
            run_to_file(line, target, cost)
    cells = {}
    for scheme in schemes:
        large, small = found[scheme, COSTLY], found[scheme, LOW]
        by_vertex = (large.least("cpu") - small.least("cpu")) / (large.vertices - small.vertices)
        cells[scheme] = [f"{1e6 * by_vertex:.2f}", f"{large.median('peak'):.0f}"]
    return cells


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--curvify", help="the command to measure; by default the one beside this Python")
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    curvify = find_curvify(arguments.curvify)
    schemes = ("gregory", "blend", "png1", "pn", "phong", "overveld")
    with tempfile.TemporaryDirectory() as folder:
        mesh = make_mesh(sys.executable, "triangles", CORNERS, Path(folder))
        cost = costs(curvify, mesh, schemes, arguments.runs)
    rows = [[f"`{scheme}`", *qualities(scheme), *cost[scheme]] for scheme in schemes]
    print(markdown(COLUMNS, rows))
    print(f"\n{machine()}")


if __name__ == "__main__":
    main()
