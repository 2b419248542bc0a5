"""Where patches are sampled: points of the domain and local cells, per polygon size and level.

A patch with n sides lives over the regular n-gon with sides of length 1 (Leung, Wang, Zhang, section 1.2),
its corner X_0 on the positive xi axis. Every mesh edge is cut into segments; the points on edges belong to
the edges, so a sampling holds the interior points only, and cells index corners, edge points and interior
points of one patch in this order. No basis values here: the same sampling serves every scheme.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from curvify.mesh import Floats, Ints
from curvify.records import record


@record
class Sampling:
    """The samples of one patch.

    ``points (S,2)`` interior points of the domain; ``blend (S,n)`` what each corner contributes to a value
    carried over the patch (texture coordinates, colors); ``cells (Q,s)`` local indices: corner c is c, point j
    of side c is n + c * inner + j (j from corner c on, ``inner`` = segments - 1 points a side), interior point
    i follows. ``centers (Q,2)`` the middle of each cell in the domain.
    """

    sides: int
    inner: int
    points: Floats
    blend: Floats
    cells: Ints
    centers: Floats


def segments(level: int) -> int:
    """Segments of every edge at refinement level k: 2k."""
    return 2 * level


def edge_abscissae(count: int) -> Floats:
    """Where an edge of ``count`` segments is sampled inside, ``(count-1,)``, from its start to its end."""
    return np.arange(1, count) / count


def domain_corners(sides: int) -> Floats:
    """Corners ``(n,2)`` of the regular polygon with sides of length 1, counter-clockwise."""
    angle = 2 * np.pi * np.arange(sides) / sides
    radius = 0.5 / np.sin(np.pi / sides)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


@lru_cache(maxsize=256)
def kite_sampling(sides: int, level: int) -> Sampling:
    """A grid of level x level quads on the kite of each corner: n k^2 cells (Leung, Wang, Zhang, 4.1)."""
    k, n = level, sides
    inner = 2 * k - 1
    a, b = (grid.ravel() for grid in np.meshgrid(np.arange(1, k + 1), np.arange(1, k), indexing="ij"))
    weights = np.concatenate([_kite_weights(n, c, a / k, b / k) for c in range(n)] + [np.full((1, n), 1 / n)])
    corners = domain_corners(n)
    local = _kite_indices(n, k)
    cells = np.stack(
        [local[:, :-1, :-1], local[:, 1:, :-1], local[:, 1:, 1:], local[:, :-1, 1:]], axis=-1
    ).reshape(-1, 4)
    points = weights @ corners
    points[-1] = 0.0
    steps = (np.arange(k) + 0.5) / k
    ca, cb = (grid.ravel() for grid in np.meshgrid(steps, steps, indexing="ij"))
    centers = np.concatenate([_kite_weights(n, c, ca, cb) for c in range(n)]) @ corners
    for array in (points, weights, cells, centers):
        array.setflags(write=False)
    return Sampling(n, inner, points, weights, cells, centers)


@lru_cache(maxsize=64)
def triangle_sampling(sides: int, level: int) -> Sampling:
    """A triangle cut into (2 level)^2 triangles by lines parallel to its sides, row by row from side 0.

    Row j holds the points with third barycentric coordinate j/n, n = 2 level; ``blend`` are these coordinates. There is
    nothing for any other number of ``sides``.
    """
    n = segments(level)
    row, column = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    weights = np.stack([n - row - column, column, row], axis=-1) / n
    inside = (row > 0) & (column > 0) & (row + column < n)
    local = _lattice_indices(n)
    up = [(slice(0, n), slice(0, n)), (slice(0, n), slice(1, n + 1)), (slice(1, n + 1), slice(0, n))]
    down = [up[1], (slice(1, n + 1), slice(1, n + 1)), up[2]]
    fits = np.stack([(row + column)[:-1, :-1] < n, (row + column)[:-1, :-1] < n - 1], axis=-1)

    def both(grid: Any) -> Any:
        """Values of the lattice at the corners of its triangles, the upright one of each square first."""
        halves = [np.stack([grid[place] for place in triangle], axis=2) for triangle in (up, down)]
        return np.stack(halves, axis=2)[fits]

    cells, middles, weights = both(local), both(weights).mean(axis=1), weights[inside]
    corners = domain_corners(sides)
    points, centers = weights @ corners, middles @ corners
    for array in (points, weights, cells, centers):
        array.setflags(write=False)
    return Sampling(sides, n - 1, points, weights, cells, centers)


def _lattice_indices(n: int) -> Ints:
    """Local index ``(n+1,n+1)`` of the lattice points of a triangle by row and column; -1 outside of it."""
    local = np.full((n + 1, n + 1), -1, dtype=np.int64)
    step = np.arange(1, n)
    local[0, 0], local[0, n], local[n, 0] = 0, 1, 2
    local[0, step] = 3 + step - 1
    local[step, n - step] = 3 + (n - 1) + step - 1
    local[step, 0] = 3 + 2 * (n - 1) + (n - step) - 1
    row, column = (grid.ravel() for grid in np.meshgrid(step, step, indexing="ij"))
    inside = row + column < n
    local[row[inside], column[inside]] = 3 * n + np.arange(inside.sum())
    return local


def _kite_weights(n: int, corner: int, a: Floats, b: Floats) -> Floats:
    """Weights ``(S,n)`` of the corners at points of a corner's kite: bilinear between the corner, the middles
    of its two sides and the center, ``a`` along the side that leaves the corner.
    """
    weights = np.repeat((a * b / n)[:, None], n, axis=1)
    ahead, behind = (corner + 1) % n, (corner - 1) % n
    weights[:, corner] += (1 - a) * (1 - b) + a * (1 - b) / 2 + (1 - a) * b / 2
    weights[:, ahead] += a * (1 - b) / 2
    weights[:, behind] += (1 - a) * b / 2
    return weights


def _kite_indices(n: int, k: int) -> Ints:
    """Local index ``(n,k+1,k+1)`` of the grid points of every kite."""
    inner = 2 * k - 1
    first = n + n * inner
    local = np.empty((n, k + 1, k + 1), dtype=np.int64)
    step = np.arange(1, k + 1)
    for c in range(n):
        local[c, 0, 0] = c
        local[c, 1:, 0] = n + c * inner + step - 1
        local[c, 0, 1:] = n + (c - 1) % n * inner + (2 * k - step) - 1
        local[c, 1:, 1:k] = first + c * k * (k - 1) + np.arange(k * (k - 1)).reshape(k, k - 1)
    for c in range(n):
        local[c, 1:k, k] = local[(c - 1) % n, k, 1:k]
        local[c, k, k] = first + n * k * (k - 1)
    return local
