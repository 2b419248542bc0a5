"""Curves on a dense mesh, for drawings: edges of the coarse mesh, rims, silhouettes, cells.

Each is a set of segments, which ``chained`` joins into polylines.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from curvify.arrays import distinct
from curvify.errors import OptionError
from curvify.mesh import DenseMesh, Floats, Ints

KINDS = ("edges", "rims", "silhouette", "cells")


@dataclass(eq=False)
class Segments:
    """Straight pieces of curves: ``points (n,3)``, ``ends (s,2)`` indices of points."""

    points: Floats
    ends: Ints


@dataclass(eq=False)
class _Sides:
    """Sides of the cells: ``edge (q,s)`` numbers them, ``ends (e,2)`` their vertices, ``first`` and ``last (e,)`` the
    first and last cell side at each, as an index into the flattened sides: the same one on a rim.
    """

    edge: Ints
    ends: Ints
    first: Ints
    last: Ints


def curves(dense: DenseMesh, kind: str, view: ArrayLike = (1, 1, 1)) -> Segments:
    """Segments of one kind of curves on a dense mesh.

    ``edges``: where the cells of two input faces meet, and rims. ``rims``: where only one cell is. ``silhouette``:
    where the surface turns away from a viewer far away in the direction ``view``. ``cells``: the sides of all cells.
    Raises OptionError for an unknown kind or a view without a direction.
    """
    if kind not in KINDS:
        raise OptionError(f"no curves '{kind}'; there are {', '.join(KINDS)}")
    if kind == "silhouette":
        return _silhouette(dense, view)
    sides = _sides(dense)
    chosen = np.ones(len(sides.ends), dtype=bool)
    if kind != "cells":
        chosen = sides.first == sides.last
    if kind == "edges" and dense.source_faces is not None:
        size = dense.faces.shape[1]
        chosen |= dense.source_faces[sides.first // size] != dense.source_faces[sides.last // size]
    return Segments(dense.positions.astype(np.float64), sides.ends[chosen])


def _sides(dense: DenseMesh) -> _Sides:
    tails, heads = dense.faces.astype(np.int64), np.roll(dense.faces, -1, axis=1).astype(np.int64)
    key = np.minimum(tails, heads) * dense.vertex_count + np.maximum(tails, heads)
    keys, edge = distinct(key.reshape(-1))
    first, last = np.empty(len(keys), dtype=np.int64), np.empty(len(keys), dtype=np.int64)
    order = np.arange(len(edge))
    first[edge[::-1]] = order[::-1]
    last[edge] = order
    ends = np.stack([keys // dense.vertex_count, keys % dense.vertex_count], axis=1)
    return _Sides(edge.reshape(tails.shape), ends, first, last)


def _silhouette(dense: DenseMesh, view: ArrayLike) -> Segments:
    """The zero set of (normal . view), linear in triangles, and creases between front and back.

    Wedges, not vertices, carry the normals, so that the two sides of a crease do not disturb each other.
    """
    direction = np.asarray(view, dtype=np.float64).reshape(-1)
    if direction.shape != (3,) or not np.isfinite(direction).all() or not direction.any():
        raise OptionError("the view must be a direction of three numbers that are not all 0")
    facing = dense.normals.astype(np.float64) @ direction
    positions = dense.positions[dense.wedge_vertices].astype(np.float64)
    smooth = _zero_set(positions, dense.face_wedges.astype(np.int64), facing)
    sharp = _outline_creases(dense, direction)
    offset = len(smooth.points)
    return Segments(
        np.concatenate([smooth.points, dense.positions.astype(np.float64)]),
        np.concatenate([smooth.ends, sharp + offset]),
    )


def _zero_set(positions: Floats, cells: Ints, values: Floats) -> Segments:
    """Where values at the corners of cells, linear in between, are zero; quads are cut from their first corner."""
    triangles = cells if cells.shape[1] == 3 else cells[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    front = values[triangles] >= 0
    triangles = triangles[front.any(axis=1) & ~front.all(axis=1)]
    tails, heads = triangles, np.roll(triangles, -1, axis=1)
    crossed = (values[tails] >= 0) != (values[heads] >= 0)
    low, high = np.minimum(tails, heads)[crossed], np.maximum(tails, heads)[crossed]
    keys, point = distinct(low * len(positions) + high)  # two crossings for each triangle, side by side
    low, high = keys // len(positions), keys % len(positions)
    share = (values[low] / (values[low] - values[high]))[:, None]
    return Segments(positions[low] + share * (positions[high] - positions[low]), point.reshape(-1, 2))


def _outline_creases(dense: DenseMesh, direction: Floats) -> Ints:
    """Vertices ``(s,2)`` of cell sides with other wedges on either side, one of which faces away."""
    if not len(dense.repeats):
        return np.zeros((0, 2), dtype=np.int64)
    sides, size = _sides(dense), dense.faces.shape[1]
    wedges = np.sort(np.stack([dense.face_wedges, np.roll(dense.face_wedges, -1, axis=1)], axis=2), axis=2)
    wedges = wedges.reshape(-1, 2)
    crease = (wedges[sides.first] != wedges[sides.last]).any(axis=1)
    points = dense.positions[dense.faces].astype(np.float64)
    front = np.cross(points[:, 2] - points[:, 0], points[:, -1] - points[:, 1]) @ direction >= 0
    return sides.ends[crease & (front[sides.first // size] != front[sides.last // size])]


def chained(segments: Segments) -> list[list[int]]:
    """Polylines through the points of segments, as long as no more than two meet; closed ones end where they start."""
    ahead: defaultdict[int, list[int]] = defaultdict(list)
    for a, b in segments.ends.tolist():
        if a != b:
            ahead[a].append(b)
            ahead[b].append(a)
    left = {frozenset((a, b)) for a, around in ahead.items() for b in around}

    def walk(start: int) -> list[int]:
        line = [start]
        while True:
            following = [b for b in ahead[line[-1]] if frozenset((line[-1], b)) in left]
            if not following or (len(line) > 1 and len(ahead[line[-1]]) != 2):
                return line
            left.remove(frozenset((line[-1], following[0])))
            line.append(following[0])

    ends = [point for point, around in ahead.items() if len(around) != 2]
    lines = [walk(point) for point in ends for _ in ahead[point]]
    lines += [walk(point) for point in ahead]  # what is left runs in circles
    return [line for line in lines if len(line) > 1]
