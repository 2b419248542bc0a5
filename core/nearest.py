"""Nearest points on triangle meshes, exact, through a tree of small pieces; and even samples of surfaces.

Long triangles enter the tree in pieces, so that no piece reaches far beyond its centroid: the nearest triangle is
then among the pieces whose centroids are nearest, and one look at the distance of the last of them proves it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from curvify.arrays import cross
from curvify.mesh import Floats, Ints

#: By how much the number of candidates grows, from 1, where they do not settle it.
GROWTH = 6
#: Query points worked on at once, times candidates.
BLOCK = 400_000


class NearestPoints:
    """Answers where on a triangle mesh the nearest point lies.

    ``positions (V,3)``, ``triangles (F,3)``.
    """

    def __init__(self, positions: Floats, triangles: Ints) -> None:
        from scipy.spatial import cKDTree

        self.corners = positions[triangles]
        pieces, self.faces = _small_pieces(self.corners)
        centers = pieces.mean(axis=1)
        self.reaches = np.sqrt(((pieces - centers[:, None]) ** 2).sum(axis=2).max(axis=1))
        self.tree: Any = cKDTree(centers)

    def query(self, points: Floats) -> tuple[Floats, Ints, Floats]:
        """Nearest point ``(n,3)`` to each of the ``points (n,3)``, its triangle ``(n,)`` and its distance ``(n,)``."""
        places = np.empty((len(points), 3))
        faces = np.full(len(points), len(self.corners))
        distance = np.full(len(points), np.inf)
        open_, seen, count = np.arange(len(points)), 0, 1
        while len(open_):
            count = min(count, len(self.faces))
            rest = []
            for rows in np.array_split(open_, -(-len(open_) * count // BLOCK)):
                far, pieces = self.tree.query(points[rows], np.arange(seen + 1, count + 1))
                row, column = np.nonzero(far - self.reaches[pieces] <= distance[rows, None])
                self._improve(points, rows[row], self.faces[pieces[row, column]], places, faces, distance)
                rest.append(rows[far[:, -1] <= distance[rows] + self.reaches.max()])
            open_ = np.concatenate(rest) if count < len(self.faces) else rows[:0]
            seen, count = count, count * GROWTH
        return places, faces, distance

    def _improve(
        self, points: Floats, rows: Ints, candidates: Ints, places: Floats, faces: Ints, distance: Floats
    ) -> None:
        """Take into account that ``candidates (m,)`` are triangles near the points ``rows (m,)``."""
        found = closest_points(points[rows], self.corners[candidates])
        gap = np.sqrt(((found - points[rows]) ** 2).sum(axis=1))
        # Of equally near triangles the lowest, whatever the order of the tree.
        order = np.lexsort((candidates, gap, rows))
        first = order[np.diff(rows[order], prepend=-1) != 0]
        row, gap, candidate = rows[first], gap[first], candidates[first]
        better = (gap < distance[row]) | ((gap == distance[row]) & (candidate < faces[row]))
        row, first = row[better], first[better]
        places[row], faces[row], distance[row] = found[first], candidates[first], gap[better]


def _small_pieces(corners: Floats) -> tuple[Floats, Ints]:
    """Triangles ``(p,3,3)`` without long sides that cover those given, and the triangle that each lies in."""
    faces = np.arange(len(corners))
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
    area = np.linalg.norm(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    limit = max(1.5 * float(np.median(sides)), 1.2 * float(np.sqrt(area / len(corners))))
    done, owners = [], []
    while len(corners):
        lengths = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        fine = ~(lengths.max(axis=1) > limit)
        done.append(corners[fine])
        owners.append(faces[fine])
        corners, faces, longest = corners[~fine], faces[~fine], lengths[~fine].argmax(axis=1)
        every = np.arange(len(corners))
        a, b, c = (corners[every, (longest + i) % 3] for i in range(3))
        middle = (a + b) / 2
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
        faces = np.concatenate([faces, faces])
    return np.concatenate(done), np.concatenate(owners)


def closest_points(points: Floats, corners: Floats) -> Floats:
    """Point of each triangle ``corners (...,3,3)`` that is nearest to ``points (...,3)``; shapes broadcast."""
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    ab, ac, ap = b - a, c - a, points - a

    def dot(u: Floats, v: Floats) -> Floats:
        return np.einsum("...i,...i->...", u, v)

    aa, ab_ac, cc, pa, pc = dot(ab, ab), dot(ab, ac), dot(ac, ac), dot(ap, ab), dot(ap, ac)
    size = aa * cc - ab_ac**2
    scale = np.where(size > 0, size, 1.0)
    v, w = (cc * pa - ab_ac * pc) / scale, (aa * pc - ab_ac * pa) / scale
    inside = (v >= 0) & (w >= 0) & (v + w <= 1) & (size > 1e-14 * aa * cc)
    best = a + v[..., None] * ab + w[..., None] * ac
    off = np.where(inside, dot(best - points, best - points), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        along = end - start
        square = dot(along, along)
        t = np.clip(dot(points - start, along) / np.where(square > 0, square, 1.0), 0, 1)
        place = start + t[..., None] * along
        gap = dot(place - points, place - points)
        nearer = gap < off
        best = np.where(nearer[..., None], place, best)
        off = np.where(nearer, gap, off)
    return best


def surface_samples(positions: Floats, triangles: Ints, count: int) -> tuple[Floats, Ints]:
    """Points ``(count,3)`` spread over a mesh in proportion to its area, always the same, and their triangles.

    Strata of equal area along the list of triangles, and in each triangle the points of a Kronecker sequence.
    """
    corners = positions[triangles]
    area = np.linalg.norm(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    total = np.cumsum(area)
    faces = np.searchsorted(total, (np.arange(count) + 0.5) / count * total[-1], side="right")
    faces = np.minimum(faces, len(triangles) - 1)
    step = np.arange(1, count + 1)
    u, v = (step * 0.7548776662466927) % 1, (step * 0.5698402909980532) % 1
    fold = u + v > 1
    u, v = np.where(fold, 1 - u, u), np.where(fold, 1 - v, v)
    a, b, c = corners[faces, 0], corners[faces, 1], corners[faces, 2]
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), faces
