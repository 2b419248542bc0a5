"""The jobs that make a dense mesh: each evaluates one stretch of it and knows where that goes.

What a job does depends on the mesh and the level only, never on the number of threads.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from curvify.backends import Backend
from curvify.errors import OptionError
from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.schemes.base import PatchClass, Patches
from curvify.sinks import DenseLayout, Sink
from curvify.threads import Job
from curvify.weld import Numbering, cells_of, corner_colors, repeat_vertices

#: Samples in one job: control vectors are made for all of its patches at once, and cost as much to begin as for 500 of
#: them.
WINDOW = 1 << 18
#: Patches that a job has at least at high levels, as long as these are not more samples than LARGEST: tables too large
#: to keep are made for each job.
TOGETHER, LARGEST = 16, 1 << 20
#: Points of edges in one job: few, so that their work arrays stay in cache.
EDGE_WINDOW = 1 << 14
#: Samples that a patch counts for at least.
PATCH = 64
#: What may be left out of the series of a cross tangent, over its length, by output type.
SERIES_TOLERANCE = {"float32": 1e-9, "float64": 1e-14}


def vertex_type(mesh: PolygonMesh, uvs: bool, dtype: np.dtype[Any]) -> np.dtype[np.void]:
    """The record of a wedge in an output type; raises OptionError unless that is float32 or float64."""
    if dtype.name not in SERIES_TOLERANCE:
        raise OptionError(f"the precision must be float32 or float64, not {dtype}")
    kind = dtype.newbyteorder("<")
    fields: list[tuple[Any, ...]] = [("position", kind, 3), ("normal", kind, 3)]
    if uvs:
        fields.append(("uv", kind, 2))
    colors = mesh.vertex_colors
    if colors is not None:
        fields.append(("color", colors.dtype if colors.dtype == np.uint8 else kind, colors.shape[1]))
    return np.dtype(fields)


def dense_layout(patches: Patches, numbering: Numbering, dtype: np.dtype[Any]) -> DenseLayout:
    """Shape of the dense mesh in an output type; raises OptionError unless that is float32 or float64."""
    return DenseLayout(
        numbering.vertex_count,
        repeat_vertices(numbering, patches),
        numbering.face_count,
        next(iter(numbering.samplings.values())).cells.shape[1],
        vertex_type(patches.mesh, numbering.uvs is not None, dtype),
        patches.mesh,
    )


def dense_jobs(
    patches: Patches, numbering: Numbering, layout: DenseLayout, backend: Backend
) -> list[tuple[int, Job]]:
    """All jobs in the order of the file, each with the number of samples it stands for."""
    work = _Evaluation(patches, numbering, layout, backend)
    outer = len(patches.topology.edges) - len(patches.inner_faces)
    repeated = numbering.repeats
    jobs: list[tuple[int, Job]] = []

    def add(job: Callable[[int, int, Sink], None], count: int, samples: int, window: int = WINDOW) -> None:
        step = max(window // max(samples, 1), 1)
        for begin in range(0, count, step):
            end = min(begin + step, count)
            jobs.append(((end - begin) * samples, partial(job, begin, end)))

    add(work.input_vertices, len(patches.positions), 1)
    add(work.edges, outer, numbering.inner, EDGE_WINDOW)
    windows = list(work.windows())
    for first, last in windows:
        jobs.append((work.block(first, last)[1], partial(work.insides, first, last)))
    add(work.repeated_corners, len(repeated.corners), 1)
    add(work.repeated_edges, len(repeated.half_edges), numbering.inner)
    for first, last in windows:
        cells = int(numbering.cell_starts[last] - numbering.cell_starts[first])
        jobs.append((cells // 8, partial(work.faces, first, last)))
    return jobs


class _Evaluation:
    """The jobs of one dense mesh."""

    def __init__(self, patches: Patches, numbering: Numbering, layout: DenseLayout, backend: Backend) -> None:
        self.patches, self.numbering, self.layout, self.backend = patches, numbering, layout, backend
        self.tolerance = SERIES_TOLERANCE[layout.vertex_type["position"].base.name]
        self.colors = corner_colors(patches)
        self.first_half_edges = patches.topology.first
        outer = len(patches.topology.edges) - len(patches.inner_faces)
        self.inner_starts = numbering.edge_starts[outer:]
        self.outer = outer

    def windows(self) -> Iterator[tuple[int, int]]:
        """Patches first to last of each job: about WINDOW samples, whole input faces.

        A patch counts for at least PATCH samples: its control vectors take room of their own.
        """
        starts = self.numbering.patch_starts
        faces = self.patches.source_faces
        fresh = np.concatenate([[True], faces[1:] != faces[:-1]])
        sizes = np.diff(starts, append=self.numbering.vertex_count)
        counted = np.maximum(sizes, PATCH)
        window = max(WINDOW, min(TOGETHER * int(counted.max()), LARGEST))
        group = (np.cumsum(counted) - counted) // window
        heads = np.flatnonzero(fresh)
        bounds = heads[np.concatenate([[True], group[heads][1:] != group[heads][:-1]])]
        yield from itertools.pairwise([*bounds.tolist(), len(starts)])

    def block(self, first: int, last: int) -> tuple[int, int]:
        """First vertex and number of vertices of the insides of patches first to last (whole faces)."""
        return self._begin(first), self._begin(last) - self._begin(first)

    def _begin(self, patch: int) -> int:
        if patch == len(self.numbering.patch_starts):
            return self.numbering.vertex_count
        before = np.searchsorted(self.patches.inner_faces, self.patches.source_faces[patch])
        own = np.searchsorted(self.patches.inner_faces, self.patches.source_faces[patch], side="right")
        return int(self.numbering.patch_starts[patch] - self.numbering.inner * (own - before))

    def _records(self, count: int) -> np.ndarray[Any, Any]:
        return np.empty(count, dtype=self.layout.vertex_type)

    def input_vertices(self, begin: int, end: int, sink: Sink) -> None:
        """The input's own vertices."""
        patches, numbering = self.patches, self.numbering
        records = self._records(end - begin)
        records["position"] = patches.positions[begin:end]
        corners = numbering.base_corners[patches.stand_in[begin:end]]
        used = corners >= 0
        records["normal"] = 0
        records["normal"][used] = patches.normals[corners[used]]
        if numbering.uvs is not None:
            records["uv"] = 0
            records["uv"][used] = np.nan_to_num(numbering.uvs[corners[used]])
        if self.colors is not None:
            records["color"] = self.patches.mesh.vertex_colors[begin:end]  # type: ignore[index]
        sink.vertices(begin, records)

    def edges(self, begin: int, end: int, sink: Sink) -> None:
        """The points of the edges of the input, in the order of its ends' ids."""
        ids = np.arange(begin, end)
        sink.vertices(int(self.numbering.edge_starts[begin]), self._edge_records(ids, ids, self.first_half_edges[ids]))

    def _edge_records(self, edges: Ints, fields: Ints, half_edges: Ints) -> np.ndarray[Any, Any]:
        """Records of edges ``(e * inner,)`` with the given normal fields, carried values from one half-edge each."""
        patches, numbering = self.patches, self.numbering
        t = numbering.abscissae
        records = self._records(len(edges) * len(t)).reshape(len(edges), len(t))
        turn = numbering.reversed[edges][:, None]
        positions, normals = self.backend.edges(patches.edges, edges, fields, t)
        for name, values in (("position", positions), ("normal", normals)):
            along = np.where(turn, values[..., ::-1], values)
            for i in range(3):
                records[name][..., i] = along[i]
        topology = patches.topology
        low = topology.vertices[half_edges] < topology.vertices[topology.next[half_edges]]
        first = np.where(low, half_edges, topology.next[half_edges])
        second = np.where(low, topology.next[half_edges], half_edges)
        for name, values in self._carried():
            a, b = values[first][:, None], values[second][:, None]
            assign(records[name], a * (1 - t)[:, None] + b * t[:, None])
        return records.reshape(-1)

    def _carried(self) -> Iterator[tuple[str, Floats]]:
        """Names and corner values ``(C,c)`` that are carried over edges and patches."""
        if self.numbering.uvs is not None:
            yield "uv", np.nan_to_num(self.numbering.uvs)
        if self.colors is not None:
            yield "color", self.colors

    def insides(self, first: int, last: int, sink: Sink) -> None:
        """The insides of patches first to last, with the diagonals of their faces."""
        patches, numbering = self.patches, self.numbering
        start, count = self.block(first, last)
        records = self._records(count)
        for patch_class in patches.classes:
            begin, end = np.searchsorted(patch_class.patches, [first, last])
            if begin < end:
                self._class_insides(patch_class, np.arange(begin, end), start, records)
        low, high = np.searchsorted(self.inner_starts, [start, start + count])
        if low < high:
            ids = np.arange(self.outer + low, self.outer + high)
            places = (numbering.edge_starts[ids] - start)[:, None] + np.arange(numbering.inner)
            records[places.reshape(-1)] = self._edge_records(ids, ids, self.first_half_edges[ids])
        sink.vertices(start, records)

    def _class_insides(self, patch_class: PatchClass, rows: Ints, start: int, records: np.ndarray[Any, Any]) -> None:
        """Fill in the patches ``rows`` of one class: in place where they lie side by side."""
        sampling = self.numbering.samplings[patch_class.sides]
        samples = len(sampling.points)
        places = self.numbering.patch_starts[patch_class.patches[rows]] - start
        together = len(rows) * samples == len(records)
        target = records if together else self._records(len(rows) * samples)
        target = target.reshape(len(rows), samples)
        self.backend.fill_patches(
            self.patches,
            patch_class,
            rows,
            sampling,
            self.numbering.level,
            self.tolerance,
            target["position"],
            target["normal"],
        )
        corners = self.patches.topology.offsets[patch_class.patches[rows]][:, None] + np.arange(patch_class.sides)
        for name, values in self._carried():
            assign(target[name], sampling.blend @ values[corners])
        if not together:
            records[(places[:, None] + np.arange(samples)).reshape(-1)] = target.reshape(-1)

    def repeated_corners(self, begin: int, end: int, sink: Sink) -> None:
        """Input vertices once more, for their further normals."""
        corners = self.numbering.repeats.corners[begin:end]
        records = self._records(len(corners))
        vertices = self.patches.topology.vertices[corners]
        records["position"] = self.patches.positions[vertices]
        records["normal"] = self.patches.normals[corners]
        for name, values in self._carried():
            records[name] = values[corners]
        sink.vertices(self.numbering.vertex_count + begin, records)

    def repeated_edges(self, begin: int, end: int, sink: Sink) -> None:
        """Edge points once more, for the other side of a crease or seam; whole edges at a time."""
        repeats, topology = self.numbering.repeats, self.patches.topology
        half_edges = repeats.half_edges[begin:end]
        edges = topology.edge[half_edges]
        records = self._edge_records(edges, self.patches.side_field[half_edges], half_edges)
        steps = repeats.strides[begin:end, None] * np.arange(self.numbering.inner)
        places = (repeats.starts[begin:end, None] + steps).reshape(-1)
        if np.array_equal(places, np.arange(places[0], places[0] + len(places))):
            sink.vertices(int(places[0]), records)
        else:
            for place, record in zip(places.tolist(), records, strict=True):
                sink.vertices(place, record.reshape(1))

    def faces(self, first: int, last: int, sink: Sink) -> None:
        """The cells of patches first to last."""
        cells = cells_of(self.numbering, self.patches, first, last)
        counts = np.diff(self.numbering.cell_starts[first : last + 1])
        source_faces = np.repeat(self.patches.source_faces[first:last].astype(np.int32), counts)
        sink.faces(int(self.numbering.cell_starts[first]), cells, source_faces)


def assign(target: np.ndarray[Any, Any], values: Floats) -> None:
    """Store carried values, rounded where the target is an integer."""
    target[...] = np.rint(values) if target.dtype.kind in "iu" else values
