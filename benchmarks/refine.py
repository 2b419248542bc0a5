"""Refinement from file to file, side by side with other tools: whole processes, taking turns.

    python benchmarks/refine.py --curvify COMMAND --peers PYTHON --runs 5 --sizes 1M,5M

Every tool reads the same OBJ (those that know only triangles: one with as many vertices) and writes the binary PLY
that its library writes fastest. See benchmarks/README.md for what can and what cannot be compared.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from processes import HERE, Costs, find_curvify, machine, make_mesh, markdown, run_to_file

#: Vertices of the coarse mesh, by about the number of vertices that come out.
SIZES = {"64k": 256, "1M": 4096, "5M": 20164}
#: Segments of an edge of the coarse mesh: curvify's level is half of that, subdivision halves edges.
SEGMENTS = 16
HALVINGS = 4
#: Scripts in peers/, by module that they need.
PEERS = {
    "pymeshlab": {"pymeshlab Loop": "pymeshlab_loop.py"},
    "igl": {"libigl Loop": "libigl_loop.py", "libigl upsample": "libigl_upsample.py"},
    "trimesh": {"trimesh midpoint": "trimesh_midpoint.py"},
    "vtkmodules": {"vtk linear": "vtk_linear.py"},
}
COLUMNS = (
    "tool",
    "wall s, median (min)",
    "CPU s, median (min)",
    "CPU-s per M vertices",
    "peak MB",
    "file MB",
    "wall / OpenSubdiv",
    "CPU / OpenSubdiv",
)


@dataclass
class Tool:
    """A competitor: the command for an input and an output file."""

    name: str
    command: Callable[[str, str], list[str]]
    triangles: bool = False
    costs: Costs = field(default_factory=Costs)


def curvify_tools(command: str, threads: list[int]) -> list[Tool]:
    """curvify, once for each number of threads."""

    def tool(count: int) -> Tool:
        options = ["--level", str(SEGMENTS // 2), "--threads", str(count), "--precision", "float32", "--quiet"]
        name = f"curvify, {count} thread{'s' if count > 1 else ''}"
        return Tool(name, lambda source, target: [command, "refine", source, target, *options])

    return [tool(count) for count in threads]


def opensubdiv_tools() -> list[Tool]:
    """The driver of OpenSubdiv's Bfr, built where its headers are."""
    program = build_driver(HERE.parent / "build" / "osd_bfr")
    if program is None:
        return []
    return [Tool("OpenSubdiv Bfr", lambda source, target: [str(program), source, target, str(SEGMENTS)])]


def build_driver(program: Path) -> Path | None:
    """Compile ``osd_bfr.cpp`` unless that was done; None and a line saying so where it cannot be."""
    source = HERE / "osd_bfr.cpp"
    if program.exists() and program.stat().st_mtime > source.stat().st_mtime:
        return program
    if shutil.which("g++") is None:
        print("skipped: OpenSubdiv Bfr (no g++)", file=sys.stderr)
        return None
    program.parent.mkdir(exist_ok=True)
    command = ["g++", "-O3", "-std=c++17", str(source), "-o", str(program), "-losdCPU"]
    made = subprocess.run(command, capture_output=True, text=True, check=False)
    if made.returncode:
        print(f"skipped: OpenSubdiv Bfr ({made.stderr.strip().splitlines()[0]})", file=sys.stderr)
        return None
    return program


def peer_tools(python: str) -> list[Tool]:
    """The scripts of peers/ whose libraries the interpreter has; the others are named."""
    tools = []
    for module, scripts in PEERS.items():
        if not has_module(python, module):
            print(f"skipped: {', '.join(scripts)} ({python} has no {module})", file=sys.stderr)
            continue
        tools += [Tool(name, peer_command(python, script), triangles=True) for name, script in scripts.items()]
    return tools


def has_module(python: str, module: str) -> bool:
    """Whether an interpreter finds a module."""
    code = f"import importlib.util, sys; sys.exit(importlib.util.find_spec('{module}') is None)"
    return subprocess.run([python, "-c", code], check=False).returncode == 0


def peer_command(python: str, script: str) -> Callable[[str, str], list[str]]:
    """The command of a script in peers/."""
    path = str(HERE / "peers" / script)
    return lambda source, target: [python, path, source, target, str(HALVINGS)]


def measure(tools: list[Tool], vertices: int, runs: int, folder: Path, python: str) -> None:
    """Run all tools in turn, once to warm up and then ``runs`` times."""
    quads = make_mesh(python, "quads", 4 * vertices, folder)
    triangles = make_mesh(python, "triangles", 6 * vertices, folder)
    for tool in tools:
        tool.costs = Costs()
    for turn in range(runs + 1):
        for number, tool in enumerate(tools):
            target = folder / f"out-{turn}-{number}.ply"
            source = triangles if tool.triangles else quads
            run_to_file(tool.command(str(source), str(target)), target, tool.costs, counted=turn > 0)


def table(tools: list[Tool]) -> str:
    """The results as markdown; ratios are of medians."""
    base = next((tool.costs for tool in tools if tool.name.startswith("OpenSubdiv")), None)
    rows = []
    for tool in tools:
        costs = tool.costs
        row = [tool.name]
        row += [f"{costs.median(name):.3f} ({costs.least(name):.3f})" for name in ("wall", "cpu")]
        row.append(f"{costs.median('cpu') / costs.vertices * 1e6:.3f}")
        row += [f"{costs.median('peak'):.0f}", f"{costs.megabytes:.0f}"]
        row += [f"{costs.median(name) / base.median(name):.2f}" if base else "" for name in ("wall", "cpu")]
        rows.append(row)
    return markdown(COLUMNS, rows)


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description="Refinement from file to file, side by side with other tools.")
    parser.add_argument("--curvify", metavar="COMMAND", help="curvify to measure, not an editable installation")
    parser.add_argument("--peers", metavar="PYTHON", default=sys.executable, help="interpreter with the other tools")
    parser.add_argument("--runs", type=int, default=5, help="runs of each tool that count (5)")
    parser.add_argument("--sizes", default="1M,5M", help=f"output sizes (1M,5M), of {', '.join(SIZES)}")
    parser.add_argument("--threads", default="1,2", help="threads of curvify (1,2)")
    parser.add_argument("--only", default="", help="only tools whose names contain one of these")
    parser.add_argument("--folder", type=Path, help="where the files go (a temporary folder)")
    return parser.parse_args()


def main() -> None:
    """Measure and print one table for each size."""
    given = arguments()
    threads = [int(count) for count in given.threads.split(",")]
    tools = curvify_tools(find_curvify(given.curvify), threads) + opensubdiv_tools() + peer_tools(given.peers)
    parts = given.only.lower().split(",")
    tools = [tool for tool in tools if any(part in tool.name.lower() for part in parts)]
    with tempfile.TemporaryDirectory(dir=given.folder) as folder:
        for size in given.sizes.split(","):
            before = os.getloadavg()[0]
            measure(tools, SIZES[size], given.runs, Path(folder), given.peers)
            print(f"\n{size} vertices out, {given.runs} runs, {machine()} (at the start {before:.1f})\n")
            print(table(tools), flush=True)


if __name__ == "__main__":
    main()
