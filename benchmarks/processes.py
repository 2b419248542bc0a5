"""Running whole processes and measuring what they take.

Nothing heavy is imported here: until a child has started its program, its peak memory is that of its parent.
"""

from __future__ import annotations

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).parent
#: Libraries under a tool start no threads of their own, so that processor time can be compared.
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True)
class Cost:
    """What one process took: seconds, processor seconds, peak memory in MB, page faults without disk."""

    wall: float
    cpu: float
    peak: float
    faults: int


@dataclass
class Costs:
    """The costs of several runs of one command, and its output: file in MB, vertices."""

    runs: list[Cost] = field(default_factory=list)
    megabytes: float = 0.0
    vertices: int = 0

    def median(self, name: str) -> float:
        """Median of one field of the costs."""
        return float(statistics.median(getattr(cost, name) for cost in self.runs))

    def least(self, name: str) -> float:
        """Minimum of one field of the costs."""
        return float(min(getattr(cost, name) for cost in self.runs))


def run(command: Sequence[str], stdout: int | None = None) -> Cost:
    """Run a command to its end; its output goes nowhere or to the descriptor ``stdout``. Exits where it fails."""
    with tempfile.TemporaryFile() as errors:
        actions: list[tuple[int, ...] | tuple[int, int, str, int, int]] = [
            (os.POSIX_SPAWN_OPEN, 0, os.devnull, os.O_RDONLY, 0),
            (os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0),
            (os.POSIX_SPAWN_DUP2, errors.fileno(), 2),
        ]
        if stdout is not None:
            actions[1] = (os.POSIX_SPAWN_DUP2, stdout, 1)
        start = time.perf_counter()
        process = os.posix_spawnp(command[0], list(command), {**os.environ, **ONE_THREAD}, file_actions=actions)
        status, usage = os.wait4(process, 0)[1:]
        wall = time.perf_counter() - start
        if status:
            errors.seek(0)
            text = errors.read().decode(errors="replace").strip()
            sys.exit(f"{' '.join(command)} failed ({os.waitstatus_to_exitcode(status)}): {text[-2000:]}")
    scale = 1e6 if sys.platform == "darwin" else 1e3
    return Cost(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / scale, usage.ru_minflt)


def run_to_file(command: Sequence[str], target: Path, costs: Costs, *, counted: bool = True) -> None:
    """Run a command that writes ``target``, note its cost, and delete the file: replacing one costs time too."""
    cost = run(command)
    if counted:
        costs.runs.append(cost)
    costs.megabytes = target.stat().st_size / 1e6
    costs.vertices = count_vertices(target)
    target.unlink()


def count_vertices(path: Path) -> int:
    """Vertices of a PLY file by its header, of an OBJ file by its lines."""
    with path.open("rb") as file:
        if path.suffix == ".obj":
            return sum(line.startswith(b"v ") for line in file)
        for line in file:
            if line.startswith(b"element vertex"):
                return int(line.split()[2])
    raise ValueError(f"{path}: no vertex count in the header")


@contextmanager
def reader() -> Iterator[int]:
    """The end to write to of a pipe that another process empties."""
    with subprocess.Popen(["cat"], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as process:
        assert process.stdin is not None
        yield process.stdin.fileno()
        process.stdin.close()


def make_mesh(python: str, kind: str, corners: int, folder: Path) -> Path:
    """A mesh of ``meshes.py`` as a file; made by another process, as it takes numpy."""
    path = folder / f"{kind}-{corners}.obj"
    subprocess.run([python, str(HERE / "meshes.py"), kind, str(corners), str(path)], check=True)
    return path


def find_curvify(command: str | None) -> str:
    """The command that was asked for, else the one beside this Python, else the one on the path."""
    beside = str(Path(sys.executable).with_name("curvify"))
    found = shutil.which(command) if command else shutil.which(beside) or shutil.which("curvify")
    if found is None:
        sys.exit(f"{command or 'curvify'} is not installed; install it or give --curvify COMMAND")
    return found


def machine() -> str:
    """The machine in words: cores, year, load."""
    return f"{os.cpu_count()} cores, {time.localtime().tm_year}, load {os.getloadavg()[0]:.1f}"


def markdown(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A markdown table: the first column to the left, the others to the right."""
    lines = [columns, ["--", *["--:"] * (len(columns) - 1)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
