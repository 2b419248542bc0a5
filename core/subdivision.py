"""Recursive schemes to a dense mesh: passes in memory, the last one block by block into the sink.

The last pass makes three quarters of the vertices. Its blocks depend on nothing but the mesh before it, so that is all
that is ever held; besides, where normals come from the new triangles, or edges stop at a length, the new vertices.
Where the only pass is one over polygons, its result is held instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from typing import Any

import numpy as np

from curvify.backends import Backend, open_backend
from curvify.errors import OptionError
from curvify.jobs import assign, vertex_type
from curvify.mesh import Floats
from curvify.refinement import JobsFor, Refinable
from curvify.sampling import segments
from curvify.schemes.overveld import MOST_PASSES, Recursion
from curvify.schemes.overveld_children import Pass, begin_pass
from curvify.schemes.overveld_pass import WINDOW, Triangles, windows
from curvify.schemes.overveld_polygons import subdivide_polygons
from curvify.sinks import DenseLayout, Sink
from curvify.threads import Job
from curvify.topology import Topology


class Subdivision(Refinable):
    """A recursive scheme over a polygon mesh, ready to be refined.

    ``positions (V,3)``, ``topology`` and ``counts`` of the mesh; there is no surface to evaluate.
    """

    def __init__(self, recursion: Recursion, scheme: str) -> None:
        self.recursion, self.scheme, self.warnings = recursion, scheme, list(recursion.warnings)
        self._latest: tuple[int, Triangles] | None = None  # passes done, and the mesh after them
        self._begun: Pass | None = None  # the next one, where it is known

    @property
    def positions(self) -> Floats:
        """Positions ``(V,3)`` of the input's vertices."""
        return self.recursion.polygons.positions

    @property
    def topology(self) -> Topology:
        """Topology of the input, its faces whole."""
        return self.recursion.topology

    @property
    def counts(self) -> dict[str, int]:
        """Counts for the report."""
        return self.recursion.counts

    @property
    def marks(self) -> dict[str, dict[str, int]]:
        """Number of marks by source and kind."""
        return self.recursion.marks

    @property
    def cell_size(self) -> int:
        """Corners of the dense mesh's faces."""
        return 3

    def depth(self, level: int) -> int:
        """Passes at a level: those asked for, or as many as give at least the level's segments."""
        options = self.recursion.options
        if options.depth is not None:
            return options.depth
        return MOST_PASSES if options.max_edge is not None else math.ceil(math.log2(segments(level)))

    def amount(self, level: int) -> str:
        """The level in words."""
        longest = self.recursion.options.max_edge
        return f"depth {self.depth(level)}" if longest is None else f"a longest edge of {longest:g}"

    def face_count(self, level: int, enough: int | None = None) -> int:
        """Faces of the dense mesh at a level; some number above ``enough`` if there are more than that."""
        if self.recursion.options.max_edge is None:
            sizes = self.recursion.polygons.topology.sizes
            first = int(np.where(sizes == 3, 4, np.where(sizes == 4, 8, 4 * sizes)).sum())
            return first * 4 ** (self.depth(level) - 1)
        step = self._last_pass(self.depth(level), enough)
        return len(self._reached(0)[1].faces) if step is None else step.face_count

    def _reached(self, passes: int) -> tuple[int, Triangles]:
        """The mesh after at least so many passes, or as many as there are; how many those are."""
        polygons, options = self.recursion.polygons, self.recursion.options
        if self._latest is None:
            whole = polygons.as_triangles()
            first = None if whole is None else (0, whole)
            self._latest = first or (1, subdivide_polygons(polygons, options.rules, options.apex))
        while self._latest[0] < passes:
            step = begin_pass(self._latest[1], options.rules)
            if step is None:
                break
            self._latest = (self._latest[0] + 1, step.children())
            del step
        return self._latest

    def _last_pass(self, depth: int, enough: int | None = None) -> Pass | None:
        """The last pass, held, where edges stop at a length: the one of number ``depth``, or that after which no edge
        is longer; some pass that makes more than ``enough`` faces. None where the mesh that was reached is finished.
        """
        while True:
            done, mesh = self._reached(0)
            if done >= depth:
                return None
            step = self._begun or begin_pass(mesh, self.recursion.options.rules)
            if step is None or (enough is not None and step.face_count > enough):
                return step
            self._begun = step if step.positions is not None else step.hold()
            if done + 1 == depth or step.is_last():
                return step
            self._begun, self._latest = None, (done + 1, step.children())
            del step, mesh  # the mesh before is not held while the next pass begins

    def open_backend(self, name: str, samples: int) -> AbstractContextManager[Backend]:
        """The CPU, whatever the size. Raises OptionError for another backend: nothing here is a table."""
        if name == "gpu":
            raise OptionError(f"the scheme {self.scheme} runs on the CPU only; leave out --backend gpu")
        return open_backend("cpu", samples)

    def _work(self, level: int, dtype: np.dtype[Any]) -> tuple[DenseLayout, JobsFor]:
        """Layout and jobs of the dense mesh; they are the same for any backend."""
        options, depth = self.recursion.options, self.depth(level)
        if self._latest is not None and self._latest[0] > depth:
            self._latest = self._begun = None
        if options.max_edge is not None:
            step = self._last_pass(depth)
        else:
            done, mesh = self._reached(depth - 1)
            step = begin_pass(mesh, options.rules) if done < depth else None
            if step is not None and options.midpoint_normal == "geometry":
                step.hold()
        work = _Blocks(self._reached(0)[1], step, vertex_type(self.recursion.mesh, self.recursion.has_uvs, dtype))
        layout = DenseLayout(
            work.vertex_count, work.repeats, work.face_count, self.cell_size, work.record, self.recursion.mesh
        )
        return layout, lambda backend: work.jobs()


class _Blocks:
    """The blocks of a dense mesh: those of ``mesh``, or of what its ``last`` pass makes of it."""

    def __init__(self, mesh: Triangles, last: Pass | None, record: np.dtype[Any]) -> None:
        self.mesh, self.last, self.record = mesh, last, record
        self.before = len(mesh.positions)
        self.plain = len(last.rows) if last else 0
        self.vertex_count = self.before + self.plain
        self.repeats = last.repeats if last else mesh.repeats
        counts = [len(mesh.faces[part]) if last is None else int(last.face_counts(part).sum()) for part in self.parts]
        self.face_starts = np.cumsum([0, *counts])
        self.face_count = int(self.face_starts[-1])

    @property
    def parts(self) -> list[slice]:
        """The faces of each job."""
        return list(windows(len(self.mesh.faces)))

    def jobs(self) -> list[tuple[int, Job]]:
        """All jobs in the order of the file, each with its number of samples."""
        jobs: list[tuple[int, Job]] = []

        def add(job: Callable[[int, int, Sink], None], begin: int, end: int) -> None:
            for first in range(begin, end, WINDOW):
                last = min(first + WINDOW, end)
                jobs.append((last - first, partial(job, first, last)))

        add(self.old, 0, self.before)
        add(self.middles, 0, self.plain)
        add(self.old, self.before, len(self.mesh.values))
        add(self.others, 0, len(self.last.extra.kept) if self.last else 0)
        for part, count, start in zip(self.parts, np.diff(self.face_starts), self.face_starts, strict=False):
            jobs.append((int(count), partial(self.faces, part, int(start))))
        return jobs

    def old(self, begin: int, end: int, sink: Sink) -> None:
        """Wedges that are there already."""
        vertices = np.concatenate([np.arange(self.before), self.mesh.repeats])[begin:end]
        start = begin if begin < self.before else begin + self.plain
        sink.vertices(start, self._records(self.mesh.positions[vertices], self.mesh.values[begin:end]))

    def middles(self, begin: int, end: int, sink: Sink) -> None:
        """The middles of edges."""
        assert self.last is not None
        sink.vertices(self.before + begin, self._records(*self.last.middles(slice(begin, end))))

    def others(self, begin: int, end: int, sink: Sink) -> None:
        """The middles of edges once more, for their other sides."""
        assert self.last is not None
        extra, numbers = self.last.extra, self.last.numbers
        positions, _ = self.last.middles(numbers[extra.repeated[begin:end]] - self.before)
        start = self.vertex_count + len(self.mesh.repeats) + begin
        sink.vertices(start, self._records(positions, extra.values[begin:end]))

    def _records(self, positions: Floats, values: Floats) -> np.ndarray[Any, Any]:
        records = np.empty(len(positions), dtype=self.record)
        records["position"] = positions
        column = 0
        for name in (self.record.names or ())[1:]:
            width = self.record[name].shape[0]
            assign(records[name], values[:, column : column + width])
            column += width
        return records

    def faces(self, part: slice, start: int, sink: Sink) -> None:
        """The triangles that some faces become, from number ``start`` on."""
        wedges, source = self.mesh.wedges[part], self.mesh.source_faces[part]
        if self.last:
            wedges, source = self.last.triangles(part)[1], np.repeat(source, self.last.face_counts(part))
        sink.faces(start, wedges, source)
