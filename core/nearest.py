"""Nearest points on triangle meshes, by the tree of libigl, and even samples of surfaces."""

from __future__ import annotations

from typing import Any

import numpy as np

from curvify.arrays import by_component, cross, take_rows
from curvify.errors import MeshError
from curvify.mesh import Floats, Ints
from curvify.normals import length
from curvify.records import record

#: The plastic number, whose powers spread points evenly over a square.
PLASTIC = 1.32471795724474602596


@record
class Nearest:
    """Nearest points on a triangle mesh, to be asked for often: the tree is built once."""

    positions: Floats
    sized: Ints
    triangles: Ints
    tree: Any

    @classmethod
    def of(cls, positions: Floats, triangles: Ints) -> Nearest:
        """The tree of a mesh. Triangles ``(F,3)`` without area count for nothing; MeshError where none has any."""
        import igl

        sized = np.flatnonzero(double_areas(positions, triangles) > 0)
        if not len(sized):
            raise MeshError("no face has an area; there is no surface to measure from")
        corners = np.ascontiguousarray(positions, dtype=np.float64)
        kept = np.ascontiguousarray(triangles[sized], dtype=np.int64)
        tree = igl.AABB()
        tree.init(corners, kept)
        return cls(corners, sized, kept, tree)

    def __call__(self, points: Floats) -> tuple[Floats, Ints, Floats]:
        """Distance ``(n,)`` of points ``(n,3)``, the nearest triangle ``(n,)`` and the place there ``(n,3)``."""
        square, hit, place = self.tree.squared_distance(
            self.positions, self.triangles, np.ascontiguousarray(points, dtype=np.float64)
        )
        return np.sqrt(square), self.sized[hit], place


def nearest_points(points: Floats, positions: Floats, triangles: Ints) -> tuple[Floats, Ints, Floats]:
    """Distance ``(n,)`` of points ``(n,3)`` from a triangle mesh, the nearest triangle ``(n,)`` and the place there
    ``(n,3)``. Triangles ``(F,3)`` without area count for nothing. Raises MeshError where none has any.
    """
    return Nearest.of(positions, triangles)(points)


def spread(positions: Floats, triangles: Ints, count: int) -> tuple[Ints, Floats]:
    """``count`` points spread evenly by area: triangle ``(n,)`` and barycentric weights ``(n,3)`` of each.

    Always the same ones: triangles at equal steps of the summed area, places in them by the plastic number's sequence
    (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
    """
    total = np.cumsum(double_areas(positions, triangles))
    owners = np.searchsorted(total, (np.arange(count) + 0.5) / count * total[-1])
    u, v = np.mod(np.arange(1, count + 1)[:, None] / np.array([PLASTIC, PLASTIC**2]), 1).T
    over = u + v > 1
    u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
    return np.minimum(owners, len(total) - 1), np.stack([1 - u - v, u, v], axis=1)


def places_on(positions: Floats, triangles: Ints, weights: Floats) -> Floats:
    """Points ``(n,3)`` with barycentric ``weights (n,3)`` in the ``triangles (n,3)``."""
    return np.einsum("nk,nki->ni", weights, positions[triangles])


def double_areas(positions: Floats, triangles: Ints) -> Floats:
    """Twice the area of each triangle ``(F,)``."""
    a, b, c = corners_of(positions, triangles)
    return length(cross(b - a, c - a))


def corners_of(positions: Floats, triangles: Ints) -> list[Floats]:
    """The three corners ``(F,3)`` of each triangle."""
    rows = by_component(positions)
    return [take_rows(rows, triangles[:, i]) for i in range(3)]
