"""The coarse polygons while they are being made: loops over vertices of the dense mesh.

Every half-edge remembers the region on its side and the *path* of dense edges that it stands for, so that later
steps can ask how sharp the dense mesh is along an edge and how far the edge is from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.mesh import Bools, Floats, Ints
from curvify.polygons import judge
from curvify.topology import Topology, build_topology


@dataclass(eq=False)
class Polygons:
    """Polygons in compressed rows, with what they came from.

    ``offsets (P+1,)``, ``vertices (C,)`` of the dense mesh; ``regions (C,)`` the region beside each half-edge. The
    path of half-edge ``c`` is ``steps[starts[c]:starts[c] + sizes[c]]``, vertices from its tail to the one before
    its head; ``sharp`` tells of each step whether the dense mesh is sharp there. A diagonal is a path of one step.
    """

    offsets: Ints
    vertices: Ints
    regions: Ints
    starts: Ints
    sizes: Ints
    steps: Ints
    sharp: Bools

    @property
    def count(self) -> int:
        return len(self.offsets) - 1

    @property
    def sides(self) -> Ints:
        """Sides of each polygon ``(P,)``."""
        return np.diff(self.offsets)

    def regrouped(self, offsets: Ints, half_edges: Ints) -> Polygons:
        """Polygons made of the half-edges of these."""
        return Polygons(
            offsets,
            self.vertices[half_edges],
            self.regions[half_edges],
            self.starts[half_edges],
            self.sizes[half_edges],
            self.steps,
            self.sharp,
        )

    def recut(self, offsets: Ints, half_edges: Ints, diagonals: Bools, vertices: Ints) -> Polygons:
        """Polygons made of the half-edges of these, or of diagonals that leave their tails, on other vertices.

        The path of a diagonal is one step. Where a vertex has taken the place of another, paths that left this begin
        with a step to it.
        """
        moved = ~diagonals & (vertices != self.vertices[half_edges])
        extra = diagonals | moved
        sizes = np.where(diagonals, 1, self.sizes[half_edges] + moved)
        rows, which = ranges(self.starts[half_edges[moved]], self.sizes[half_edges[moved]])
        added, owner = np.flatnonzero(extra), np.flatnonzero(moved)[which]
        order = np.argsort(np.concatenate([added, owner]), kind="stable")
        steps = np.concatenate([vertices[added], self.steps[rows]])[order]
        sharp = np.concatenate([np.zeros(len(added), dtype=bool), self.sharp[rows]])[order]
        starts = self.starts[half_edges]
        starts[extra] = len(self.steps) + np.cumsum(sizes[extra]) - sizes[extra]
        return Polygons(
            offsets,
            vertices,
            self.regions[half_edges],
            starts,
            sizes,
            np.concatenate([self.steps, steps]),
            np.concatenate([self.sharp, sharp]),
        )

    def topology(self, positions: Floats) -> Topology:
        """Edges and twins, on the vertices of the dense mesh."""
        return build_topology(positions, self.offsets, self.vertices)

    def path_corners(self, half_edges: Ints) -> tuple[Ints, Ints]:
        """All steps of the paths of ``half_edges (n,)``: their indices into ``steps``, and which path each is of."""
        return ranges(self.starts[half_edges], self.sizes[half_edges])


def ranges(starts: Ints, sizes: Ints) -> tuple[Ints, Ints]:
    """The numbers ``starts[i] .. starts[i] + sizes[i] - 1`` of all i, one after the other, and the i of each."""
    which = np.repeat(np.arange(len(sizes)), sizes)
    within = np.arange(len(which)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    return starts[which] + within, which


def first_of_each(keys: Ints) -> Ints:
    """Indices of the first of each set of equal keys, ascending."""
    order = np.argsort(keys, kind="stable")
    return np.sort(order[np.diff(keys[order], prepend=-1) != 0])


def pillows(vertices: Ints, sizes: Ints) -> Ints:
    """Loops of ``sizes (B,)`` on the very vertices of another one; each of a pair."""
    first = np.cumsum(sizes) - sizes
    found = [np.zeros(0, dtype=np.int64)]
    for size in np.flatnonzero(np.bincount(sizes)):
        rows = np.flatnonzero(sizes == size)
        loops = np.sort(vertices[first[rows][:, None] + np.arange(size)], axis=1)
        order = np.lexsort(loops.T)
        same = (loops[order[1:]] == loops[order[:-1]]).all(axis=1)
        found += [rows[order[1:][same]], rows[order[:-1][same]]]
    return np.concatenate(found)


def padded(loops: Ints, sizes: Ints) -> Ints:
    """Rows ``(m,B)`` of loops given one after the other; rows that a loop does not use repeat its first item."""
    first = np.cumsum(sizes) - sizes
    row = np.arange(int(sizes.max(initial=0)))[:, None]
    return loops[first + np.where(row < sizes, row, 0)]


@dataclass(eq=False)
class Shapes:
    """What loops are like: ``acceptable (B,)`` convex and simple; ``normals (B,3)`` unit; ``areas (B,)``;
    ``unevenness (B,)`` the height range over the size; ``least_sines (B,)`` sine of the smallest corner, of triangles
    of the smallest one.
    """

    acceptable: Bools
    normals: Floats
    areas: Floats
    unevenness: Floats
    least_sines: Floats


def shapes_of(positions: Floats, loops: Ints, sizes: Ints) -> Shapes:
    """Shapes of loops ``loops (sum(sizes),)`` of vertices, judged in batches of similar size."""
    count = len(sizes)
    first = np.cumsum(sizes) - sizes
    shapes = Shapes(
        np.zeros(count, dtype=bool), np.zeros((count, 3)), np.zeros(count), np.zeros(count), np.zeros(count)
    )
    for low, high in ((3, 3), (4, 4), (5, 6), (7, 10), (11, 20), (21, int(sizes.max(initial=0)))):
        rows = np.flatnonzero((sizes >= low) & (sizes <= high))
        if len(rows):
            corners, _ = ranges(first[rows], sizes[rows])
            _judge_into(shapes, rows, positions, loops[corners], sizes[rows])
    return shapes


def _judge_into(shapes: Shapes, rows: Ints, positions: Floats, loops: Ints, sizes: Ints) -> None:
    ids = padded(loops, sizes)
    points = np.moveaxis(positions[ids], 2, 0)
    acceptable, sharpest, area = judge(points, sizes)
    length = np.linalg.norm(area, axis=0)
    normal = area / np.where(length > 0, length, 1.0)
    heights = np.einsum("imb,ib->mb", points - points[:, :1], normal)
    extent = np.linalg.norm(points.max(axis=1) - points.min(axis=1), axis=0)
    ordered = np.sort(np.where(np.arange(len(ids))[:, None] < sizes, ids, -1 - np.arange(len(ids))[:, None]), axis=0)
    simple = (ordered[1:] != ordered[:-1]).all(axis=0)
    shapes.acceptable[rows] = acceptable & simple & (sizes >= 3)
    shapes.normals[rows] = normal.T
    shapes.areas[rows] = length / 2
    shapes.unevenness[rows] = np.ptp(heights, axis=0) / np.where(extent > 0, extent, 1.0)
    shapes.least_sines[rows] = np.sqrt(np.maximum(1 - np.minimum(sharpest, 1.0) ** 2, 0)) * (sharpest > -1)
