"""Recursive schemes to a dense mesh: passes in memory, the last one block by block into the sink.

The last pass makes three quarters of the vertices. Its blocks depend on nothing but the mesh before it, so that is all
that is ever held; where a pass needs its own result (normals from geometry, edges that stop at a length) or is the only
one over polygons, the result is held instead.
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
from curvify.schemes.overveld_pass import Rules, Triangles, corner_wedges, middle_wedges, middles, subdivide, template
from curvify.schemes.overveld_polygons import subdivide_polygons
from curvify.sinks import DenseLayout, Sink
from curvify.threads import Job
from curvify.topology import Topology

#: Vertices or faces in one job.
WINDOW = 1 << 15


class Subdivision(Refinable):
    """A recursive scheme over a polygon mesh, ready to be refined.

    ``positions (V,3)``, ``topology`` and ``counts`` of the mesh; there is no surface to evaluate.
    """

    def __init__(self, recursion: Recursion, scheme: str) -> None:
        self.recursion, self.scheme, self.warnings = recursion, scheme, list(recursion.warnings)
        self._latest: tuple[int, Triangles] | None = None  # passes done, and the mesh after them

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
        while True:
            done, mesh = self._reached(1)
            if done >= self.depth(level):
                return len(mesh.faces)
            split = self.recursion.options.rules.split(mesh.positions, mesh.edges)
            count = len(mesh.faces) + int(split[mesh.face_edges].sum())
            if count == len(mesh.faces) or (enough is not None and count > enough):
                return count
            self._reached(done + 1)

    def _reached(self, passes: int) -> tuple[int, Triangles]:
        """The mesh after at least so many passes, or as many as there are; how many those are."""
        polygons, options = self.recursion.polygons, self.recursion.options
        if self._latest is None:
            whole = polygons.as_triangles()
            first = None if whole is None else (0, whole)
            self._latest = first or (1, subdivide_polygons(polygons, options.rules, options.apex))
        while self._latest[0] < passes:
            finer = subdivide(self._latest[1], options.rules)
            if finer is None:
                break
            self._latest = (self._latest[0] + 1, finer)
        return self._latest

    def open_backend(self, name: str, samples: int) -> AbstractContextManager[Backend]:
        """The CPU, whatever the size. Raises OptionError for another backend: nothing here is a table."""
        if name == "gpu":
            raise OptionError(f"the scheme {self.scheme} runs on the CPU only; leave out --backend gpu")
        return open_backend("cpu", samples)

    def _work(self, level: int, dtype: np.dtype[Any]) -> tuple[DenseLayout, JobsFor]:
        """Layout and jobs of the dense mesh; they are the same for any backend."""
        options, depth = self.recursion.options, self.depth(level)
        held = options.max_edge is not None or options.midpoint_normal == "geometry"
        if self._latest is not None and self._latest[0] > depth - (not held):
            self._latest = None
        done, mesh = self._reached(depth if held else depth - 1)
        record = vertex_type(self.recursion.mesh, self.recursion.has_uvs, dtype)
        work = _Blocks(mesh, None if held or done == depth else options.rules, record)
        layout = DenseLayout(
            work.vertex_count, work.repeats, work.face_count, self.cell_size, record, self.recursion.mesh
        )
        return layout, lambda backend: work.jobs()


class _Blocks:
    """The blocks of a dense mesh: those of ``mesh``, or of what one more pass with ``last`` rules makes of it."""

    def __init__(self, mesh: Triangles, last: Rules | None, record: np.dtype[Any]) -> None:
        self.mesh, self.last, self.record = mesh, last, record
        self.before = len(mesh.positions)
        self.plain = len(mesh.edges) if last else 0
        self.vertex_count = self.before + self.plain
        self.per_face = 4 if last else 1
        self.face_count = len(mesh.faces) * self.per_face
        self.repeats = mesh.repeats
        if last:
            self.sides = mesh.sides()
            numbers, first = self.before + np.arange(self.plain), self.vertex_count + len(mesh.repeats)
            self.extra = middle_wedges(mesh.positions, mesh.values, mesh.edges, self.sides, numbers, first, last)
            self.repeats = np.concatenate([mesh.repeats, numbers[self.extra.repeated]])

    def jobs(self) -> list[tuple[int, Job]]:
        """All jobs in the order of the file, each with its number of samples."""
        jobs: list[tuple[int, Job]] = []

        def add(job: Callable[[int, int, Sink], None], begin: int, end: int, samples: int = 1) -> None:
            for first in range(begin, end, WINDOW):
                last = min(first + WINDOW, end)
                jobs.append(((last - first) * samples, partial(job, first, last)))

        add(self.old, 0, self.before)
        add(self.middles, 0, self.plain)
        add(self.old, self.before, len(self.mesh.values))
        add(self.others, 0, len(self.extra.kept) if self.last else 0)
        add(self.faces, 0, len(self.mesh.faces), self.per_face)
        return jobs

    def old(self, begin: int, end: int, sink: Sink) -> None:
        """Wedges that are there already."""
        vertices = np.concatenate([np.arange(self.before), self.mesh.repeats])[begin:end]
        start = begin if begin < self.before else begin + self.plain
        sink.vertices(start, self._records(self.mesh.positions[vertices], self.mesh.values[begin:end]))

    def middles(self, begin: int, end: int, sink: Sink) -> None:
        """The middles of edges."""
        assert self.last is not None
        mesh, rows = self.mesh, np.arange(begin, end)
        position, values = middles(mesh.positions, mesh.values, mesh.edges, self.sides, rows, self.last)
        sink.vertices(self.before + begin, self._records(position, values))

    def others(self, begin: int, end: int, sink: Sink) -> None:
        """The middles of edges once more, for their other sides."""
        assert self.last is not None
        mesh, edges = self.mesh, self.extra.repeated[begin:end]
        position, _ = middles(mesh.positions, mesh.values, mesh.edges, self.sides, edges, self.last)
        start = self.vertex_count + len(mesh.repeats) + begin
        sink.vertices(start, self._records(position, self.extra.values[begin:end]))

    def _records(self, positions: Floats, values: Floats) -> np.ndarray[Any, Any]:
        records = np.empty(len(positions), dtype=self.record)
        records["position"] = positions
        column = 0
        for name in (self.record.names or ())[1:]:
            width = self.record[name].shape[0]
            assign(records[name], values[:, column : column + width])
            column += width
        return records

    def faces(self, first: int, last: int, sink: Sink) -> None:
        """Triangles of the faces first to last."""
        mesh = self.mesh
        source = np.repeat(mesh.source_faces[first:last], self.per_face)
        wedges = mesh.wedges[first:last]
        if self.last:
            nodes = corner_wedges(mesh, self.sides, self.extra.of_sides, self.plain, slice(first, last))
            wedges = nodes[:, template(7).nodes].reshape(-1, 3)
        sink.faces(first * self.per_face, wedges, source)
