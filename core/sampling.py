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
from curvify.records import field, record


@record
class Sampling:
    """The samples of one patch.

    ``points (S,2)`` interior points of the domain; ``blend (S,n)`` what each corner contributes to a value
    carried over the patch (texture coordinates, colors); ``cells (Q,s)`` local indices: corner c is c, point j
    of side c is n + c * inner + j (j from corner c on, ``inner`` = segments - 1 points a side), interior point
    i follows. ``centers (Q,2)`` the middle of each cell in the domain. ``kite (m,2)`` the points of a kite that are
    its own, in the unit square: interior points ``c * m`` to ``(c + 1) * m`` are those of the kite at corner c, the
    last one is the middle of the patch; none where a sampling has no kites.
    """

    sides: int
    inner: int
    points: Floats
    blend: Floats
    cells: Ints
    centers: Floats
    kite: Floats = field(default_factory=lambda: np.zeros((0, 2)))


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
    kite = np.stack([a, b], axis=1) / k
    for array in (points, weights, cells, centers, kite):
        array.setflags(write=False)
    return Sampling(n, inner, points, weights, cells, centers, kite)


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


def kite_coordinates(sides: int, points: Floats) -> tuple[Ints, Floats, Floats]:
    """The kite of a patch that holds each of the domain points ``(m,2)``, and where it lies there.

    Corner ``(m,)`` of the kite; coordinates ``(m,2)`` in the unit square, whose sides are bilinear in the kite: the
    corner at (0, 0), the middle of the side that leaves it at (1, 0), the middle of the patch at (1, 1); and their
    derivatives ``(m,2,2)`` by xi and eta.
    """
    turn = 2 * np.pi / sides
    kite = np.rint(np.arctan2(points[:, 1], points[:, 0]) / turn).astype(np.int64) % sides
    corner = domain_corners(sides)
    radius, half = corner[0, 0], np.pi / sides
    across = radius * np.cos(half) * np.sin(half)
    ex = corner[kite] / radius
    ey = np.stack([-ex[:, 1], ex[:, 0]], axis=1)
    x, y = np.einsum("mi,mi->m", points, ex) / radius, np.einsum("mi,mi->m", points, ey) / across
    # x = 1 - (a + b) (1 - c) + a b (1 - 2c) and y = a - b, with c = cos(half)^2
    c = np.cos(half) ** 2
    p = (1 - 2 * c) / 4
    q, r = 1 - c, 1 - p * y * y - x
    total = 2 * r / (q + np.sqrt(np.maximum(q * q - 4 * p * r, 0.0)))
    a, b = (np.clip((total + sign * y) / 2, 0.0, 1.0) for sign in (1, -1))
    x_a, x_b = -q + b * (1 - 2 * c), -q + a * (1 - 2 * c)
    determinant = -(x_a + x_b)
    by_x = np.stack([np.full_like(a, -1.0), np.full_like(a, -1.0)], axis=1) / determinant[:, None] / radius
    by_y = np.stack([-x_b, x_a], axis=1) / determinant[:, None] / across
    slopes = by_x[:, :, None] * ex[:, None] + by_y[:, :, None] * ey[:, None]
    return kite, np.stack([a, b], axis=1), slopes
