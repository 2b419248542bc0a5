"""What refinement costs against the number of faces, the level, the kind of polygons, threads and the output.

    python benchmarks/scaling.py --curvify COMMAND --runs 3

Whole processes, taking turns. A tiny mesh takes its turn in every table: what it costs is the start, and is taken away
so that the numbers tell what one more vertex costs.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from processes import Costs, find_curvify, machine, make_mesh, markdown, reader, run, run_to_file

#: Corners of the coarse mesh where nothing else is said: about a million vertices at level 8.
CORNERS = 16384
LEVEL = 8
COLUMNS = ("faces in", "vertices out", "CPU s", "CPU ns per vertex", "wall s", "peak MB", "page faults")


@dataclass(frozen=True)
class Case:
    """One row of a table."""

    name: str
    kind: str = "quads"
    corners: int = CORNERS
    level: int = LEVEL
    threads: int = 1
    output: str = "ply"


#: Hardly more than starting and ending.
START = Case("start", corners=64, level=1)
TABLES = {
    "Number of faces": [
        Case(f"{corners // 4:,} quads", corners=corners) for corners in (1024, 4096, 16384, 65536, 262144)
    ],
    "Level": [Case(f"level {level}", level=level) for level in (1, 2, 3, 5, 8, 12, 16, 20)],
    "Kind of polygons": [
        Case(kind, kind=kind)
        for kind in ("triangles", "quads", "pentagons", "hexagons", "octagons", "dodecagons", "mixed")
    ],
    "Threads": [
        Case(f"{corners // 4:,} quads, {count} thread{'s' if count > 1 else ''}", corners=corners, threads=count)
        for corners in (16384, 65536)
        for count in (1, 2)
    ],
    "Output": [
        Case("PLY file", output="ply"),
        Case("PLY to a pipe", output="pipe"),
        Case("PLY to a pipe, 2 threads", output="pipe", threads=2),
        Case("OBJ file", output="obj"),
    ],
}


def command(curvify: str, source: Path, case: Case, target: str) -> list[str]:
    """The command line of a case."""
    options = ["--level", str(case.level), "--threads", str(case.threads), "--precision", "float32", "--quiet"]
    return [curvify, "refine", str(source), target, *options]


def run_case(curvify: str, source: Path, case: Case, costs: Costs, folder: Path) -> None:
    """Run a case once."""
    target = folder / f"out-{len(costs.runs)}.{'obj' if case.output == 'obj' else 'ply'}"
    if case.output != "pipe":
        run_to_file(command(curvify, source, case, str(target)), target, costs)
        return
    with reader() as pipe:
        costs.runs.append(run([*command(curvify, source, case, "-"), "--output-format", "ply"], stdout=pipe))


def measure(curvify: str, cases: list[Case], runs: int, folder: Path) -> list[tuple[Case, int, Costs]]:
    """Run the start and all cases of a table in turn; with each the number of its input faces."""
    results = []
    for case in [START, *cases]:
        source = make_mesh(sys.executable, case.kind, case.corners, folder)
        results.append((case, source, Costs()))
    for _ in range(runs):
        for case, source, costs in results:
            run_case(curvify, source, case, costs, folder)
    written = {(source, case.level): costs.vertices for case, source, costs in results if case.output != "pipe"}
    for case, source, costs in results:
        costs.vertices = written[source, case.level]  # a pipe is not counted: a file beside it holds the same mesh
    return [(case, count_faces(source), costs) for case, source, costs in results]


def count_faces(path: Path) -> int:
    """Faces of an OBJ file."""
    with path.open("rb") as file:
        return sum(line.startswith(b"f ") for line in file)


def row(name: str, faces: int, costs: Costs, start: float) -> list[str]:
    """One row of a table: medians, and least processor time beyond the start for each vertex."""
    beyond = max(costs.least("cpu") - start, 0.0)
    return [
        name,
        f"{faces:,}",
        f"{costs.vertices:,}",
        f"{costs.median('cpu'):.3f}",
        f"{beyond / costs.vertices * 1e9:.0f}" if beyond else "",
        f"{costs.median('wall'):.3f}",
        f"{costs.median('peak'):.0f}",
        f"{costs.median('faults'):,.0f}",
    ]


def main() -> None:
    """Measure and print all tables, or those asked for."""
    parser = argparse.ArgumentParser(description="What refinement costs against the size and kind of its task.")
    parser.add_argument("--curvify", metavar="COMMAND", help="curvify to measure, not an editable installation")
    parser.add_argument("--runs", type=int, default=3, help="runs of each case (3)")
    parser.add_argument("--only", default="", help="only tables whose titles contain this")
    parser.add_argument("--folder", type=Path, help="where the files go (a temporary folder)")
    given = parser.parse_args()
    curvify = find_curvify(given.curvify)
    with tempfile.TemporaryDirectory(dir=given.folder) as name:
        folder = Path(name)
        print(f"{given.runs} runs, level {LEVEL} and 1 thread unless said, {machine()}")
        for title, cases in TABLES.items():
            if given.only.lower() not in title.lower():
                continue
            results = measure(curvify, cases, given.runs, folder)
            print(f"\n### {title}\n")
            start = results[0][2].least("cpu")
            rows = [row(case.name, faces, costs, start) for case, faces, costs in results]
            print(markdown(("", *COLUMNS), rows), flush=True)


if __name__ == "__main__":
    main()
