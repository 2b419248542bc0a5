"""One pass of normal-based subdivision over triangles: every edge that is to be split gets its middle.

A triangle with 0, 1, 2 or 3 split edges becomes as many triangles and one more. Which edges the new triangles have
follows from the old ones: nothing is searched for. All work is done stretch by stretch, so that little is held besides
the old mesh and the new one. Source: van Overveld, Wyvill, sections 2.3, 2.5 and 3.2.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from curvify.arrays import ranking
from curvify.mesh import Bools, Floats, Ints
from curvify.records import record
from curvify.schemes.overveld_cuts import Template, cuts, template
from curvify.schemes.overveld_pass import (
    EdgeSides,
    FaceNormals,
    Rules,
    Triangles,
    Wedges,
    middle_wedges,
    middles,
    windows,
)
from curvify.topology import canonical_direction


@record
class Pass:
    """A pass over a ``mesh`` that has begun.

    ``rows (r,)`` are the edges that are split, ``numbers (E,)`` the new vertex in the middle of each edge (-1: none);
    ``sides`` of the edges, ``extra`` wedges in their middles. Where it has to be ``held``, ``positions (V+r,3)`` of all
    vertices and ``values (r,3+c)`` in the middles.
    """

    mesh: Triangles
    rules: Rules
    rows: Ints
    numbers: Ints
    sides: EdgeSides
    extra: Wedges
    positions: Floats | None = None
    values: Floats | None = None

    @property
    def vertex_count(self) -> int:
        """Vertices after the pass."""
        return len(self.mesh.positions) + len(self.rows)

    @property
    def repeats(self) -> Ints:
        """The vertex of each wedge beyond the vertices after the pass."""
        return np.concatenate([self.mesh.repeats, self.numbers[self.extra.repeated]])

    @property
    def whole(self) -> bool:
        """Whether every edge is split."""
        return len(self.rows) == len(self.numbers)

    def face_counts(self, part: slice = slice(None)) -> Ints:
        """Triangles ``(f,)`` that each of some faces becomes."""
        edges = self.mesh.face_edges[part]
        if self.whole:
            return np.full(len(edges), 4)
        return 1 + (self.numbers[edges] >= 0).sum(axis=1)

    @property
    def face_count(self) -> int:
        """Faces after the pass."""
        if self.whole:
            return 4 * len(self.mesh.faces)
        return sum(int(self.face_counts(part).sum()) for part in windows(len(self.mesh.faces)))

    def middles(self, part: slice | Ints) -> tuple[Floats, Floats]:
        """Positions ``(m,3)`` and values ``(m,3+c)`` of some of the new vertices, counted from 0."""
        mesh = self.mesh
        if self.positions is not None and self.values is not None:
            return self.positions[len(mesh.positions) :][part], self.values[part]
        return middles(mesh.positions, mesh.values, mesh.edges, self.sides, self.rows[part], self.rules)

    def hold(self) -> Pass:
        """Compute all new vertices, with their normals from geometry where the rules say so."""
        mesh, before = self.mesh, len(self.mesh.positions)
        positions = np.empty((self.vertex_count, 3))
        values = np.empty((len(self.rows), mesh.values.shape[1]))
        positions[:before] = mesh.positions
        for part in windows(len(self.rows)):
            positions[before:][part], values[part] = self.middles(part)
        self.positions, self.values = positions, values
        if self.rules.midpoint_normal == "geometry":
            sums = FaceNormals(self.vertex_count + len(mesh.repeats) + len(self.extra.kept))
            for part in windows(len(mesh.faces)):
                sums.add(positions, *self.triangles(part))
            sums.store(values, before)
            sums.store(self.extra.values, self.vertex_count + len(mesh.repeats))
        return self

    def corners(self, part: slice) -> Ints:
        """Vertices ``(f,6)`` at the corners of some faces and in the middle of their sides."""
        return np.concatenate([self.mesh.faces[part], self.numbers[self.mesh.face_edges[part]]], axis=1)

    def wedges(self, part: slice) -> Ints:
        """Wedges ``(f,6)`` likewise, as numbered after the pass."""
        mesh = self.mesh
        corners = mesh.wedges[part]
        corners = np.where(corners < len(mesh.positions), corners, corners + len(self.rows))
        middle = self.extra.of_sides[self.sides.of_half_edges.reshape(-1, 3)[part]]
        return np.concatenate([corners, middle], axis=1)

    def cuts(self, corners: Ints) -> list[tuple[Template, Ints]]:
        """Templates and the faces that they cut, of some faces with the vertices ``corners (f,6)``."""
        if self.whole:
            return [(template(7), np.arange(len(corners)))]
        assert self.positions is not None
        return cuts(corners[:, 3:] >= 0, self.positions, corners)

    def triangles(self, part: slice) -> tuple[Ints, Ints]:
        """Vertices and wedges ``(t,3)`` of the triangles that some faces become."""
        corners = self.corners(part)
        parts = [(cut.nodes, hit) for cut, hit in self.cuts(corners)]
        vertices = spread(corners, parts)
        return vertices, spread(self.wedges(part), parts) if len(self.mesh.repeats) else vertices

    def is_last(self) -> bool:
        """Whether no edge is to be split in the next pass."""
        assert self.positions is not None
        if self.rules.max_edge is None:
            return False
        for part in windows(len(self.rows)):
            ends, middle = self.mesh.edges[self.rows[part]], self.numbers[self.rows[part]]
            if any(self.rules.split(self.positions, np.stack([end, middle], axis=1)).any() for end in ends.T):
                return False
        for part in windows(len(self.mesh.faces)):
            corners = self.corners(part)
            for cut, hit in self.cuts(corners):
                if self.rules.split(self.positions, corners[hit][:, cut.inner].reshape(-1, 2)).any():
                    return False
        return True

    def children(self) -> Triangles:
        """The mesh after the pass."""
        if self.positions is None:
            self.hold()
        assert self.positions is not None and self.values is not None
        mesh, before = self.mesh, len(self.mesh.positions)
        values = np.concatenate([mesh.values[:before], self.values, mesh.values[before:], self.extra.values])
        faces, wedges, face_edges, edges, source = _connect(self)
        _sort_edges(self.positions, edges, face_edges)
        return Triangles(self.positions, values, self.repeats, faces, wedges, face_edges, edges, source)


def begin_pass(mesh: Triangles, rules: Rules) -> Pass | None:
    """A pass over the mesh, None if no edge is to be split."""
    split = rules.split(mesh.positions, mesh.edges)
    rows = np.flatnonzero(split)
    if not len(rows):
        return None
    kind = index_type(2 * len(mesh.edges) + 3 * len(mesh.faces) + len(mesh.values))
    rows, sides = rows.astype(kind), mesh.sides()
    numbers = np.full(len(split), -1, dtype=kind)
    numbers[rows] = len(mesh.positions) + np.arange(len(rows), dtype=kind)
    first = len(mesh.positions) + len(rows) + len(mesh.repeats)
    extra = middle_wedges(mesh.positions, mesh.values, mesh.edges, sides, numbers, first, rules)
    return Pass(mesh, rules, rows, numbers, sides, extra)


def index_type(count: int) -> type[np.signedinteger[Any]]:
    """The type of numbers below ``count``: with 4 bytes where that is enough."""
    return np.int32 if count < 2**31 else np.int64


def spread(values: Ints, parts: list[tuple[Ints, Ints]]) -> Ints:
    """Values of new triangles ``(t,3)``, face by face, from those of faces ``(f,m)``: ``parts`` hold which of these the
    triangles of some faces take ``(j,3)``, and the faces.
    """
    if len(parts) == 1:
        nodes = parts[0][0]
        return np.take(values, nodes.reshape(-1), axis=1).reshape(-1, 3)
    counts = np.empty(len(values), dtype=np.int64)
    for nodes, hit in parts:
        counts[hit] = len(nodes)
    starts = np.cumsum(counts) - counts
    result = np.empty((int(counts.sum()), 3), dtype=values.dtype)
    for nodes, hit in parts:
        result[starts[hit][:, None] + np.arange(len(nodes))] = values[hit][:, nodes]
    return result


def _connect(step: Pass) -> tuple[Ints, Ints, Ints, Ints, Ints]:
    """Vertices, wedges and edges ``(T,3)`` of the new triangles, their edges ``(E,2)``, halves of old ones first, in no
    order and direction yet, and their source faces.
    """
    mesh, kind = step.mesh, step.numbers.dtype
    split = step.numbers >= 0
    total, outer = step.face_count, len(split) + len(step.rows)
    halves = (np.arange(len(split)) + np.cumsum(split) - split).astype(kind)  # first child of each edge
    edges = np.empty((outer + total - len(mesh.faces), 2), dtype=kind)
    edges[halves] = mesh.edges
    first, middle = halves[step.rows], step.numbers[step.rows]
    edges[first, 1] = middle
    edges[first + 1, 0], edges[first + 1, 1] = middle, mesh.edges[step.rows, 1]
    faces, face_edges = (np.empty((total, 3), dtype=kind) for _ in range(2))
    wedges = np.empty_like(faces) if len(mesh.repeats) else faces
    source = np.empty(total, dtype=mesh.source_faces.dtype)
    end = 0
    for part in windows(len(mesh.faces)):
        corners = step.corners(part)
        groups, counts = step.cuts(corners), step.face_counts(part)
        begin, end = end, end + int(counts.sum())
        nodes = [(cut.nodes, hit) for cut, hit in groups]
        faces[begin:end] = spread(corners, nodes)
        if len(mesh.repeats):
            wedges[begin:end] = spread(step.wedges(part), nodes)
        inner = counts - 1
        own = (outer + begin - part.start + np.cumsum(inner) - inner)[:, None] + np.arange(3)
        local = np.concatenate([_local_edges(mesh, halves, split, part), own], axis=1)
        face_edges[begin:end] = spread(local, [(cut.edges, hit) for cut, hit in groups])
        for cut, hit in groups:
            edges[own[hit][:, : len(cut.inner)]] = corners[hit][:, cut.inner]
        source[begin:end] = np.repeat(mesh.source_faces[part], counts)
    return faces, wedges, face_edges, edges, source


def _local_edges(mesh: Triangles, halves: Ints, split: Bools, part: slice) -> Ints:
    """Child edges ``(f,9)`` of the sides of some faces as templates number them: the halves in the side's own
    direction, the whole where it is not split.
    """
    sides = mesh.face_edges[part]
    first, cut = halves[sides], split[sides]
    forward = mesh.faces[part] == mesh.edges[:, 0][sides]
    near, far = first + (cut & ~forward), first + (cut & forward)
    return np.concatenate([np.stack([near, far], axis=2).reshape(-1, 6), first], axis=1)


def _sort_edges(positions: Floats, edges: Ints, face_edges: Ints) -> None:
    """Bring edges ``(E,2)`` into the order of (smaller id, larger id) and into canonical direction, in place, and
    renumber them in the faces.
    """
    keys = np.minimum(edges[:, 0], edges[:, 1]).astype(np.int64)
    keys *= len(positions)
    keys += np.maximum(edges[:, 0], edges[:, 1])
    order = ranking(keys)
    del keys
    rank = np.empty(len(order), dtype=edges.dtype)
    rank[order] = np.arange(len(order), dtype=edges.dtype)
    ordered = edges[order]
    del order
    for part in windows(len(edges)):
        edges[part] = canonical_direction(positions, ordered[part])
    for part in windows(len(face_edges)):
        face_edges[part] = rank[face_edges[part]]
