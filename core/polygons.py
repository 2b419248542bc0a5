"""Plain geometry of polygons: neighbors of corners, area vectors, convexity, triangulation, visibility.

Meshes come in compressed rows; batches of loops of one size come as ``points (3,m,B)``, coordinate first
and loop last, which keeps every operation on long contiguous rows.

Area vectors are Newell's (Sutherland, Sproull & Schumacker 1974): the sum of the crosses of a fan from
the face's first vertex, which stays accurate far from the origin. The turn of a corner is the cross of
its two sides, whose unit sum is the polygon normal of the curved polygon paper, equation (12).
Triangulations are optimal ones by dynamic programming over intervals (Gilbert 1979; Klincsek 1980).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curvify.arrays import cross, pick, take_rows
from curvify.mesh import Bools, Floats, Ints

REFLEX = 1e-3  # a corner whose sine is above minus this counts as convex
STRAIGHT = 1e-6  # a corner whose sine is below this has no normal of its own: it would be rounding
STEEP = 0.2  # cosine between a piece and its face that a piece should not fall below
THIN = 1e3  # one over the smallest sine a triangle should have

# What a triangulation avoids before it looks at its objective, worst first.
BACKWARD_COST, TAKEN_COST, STEEP_COST, THIN_COST = 1e15, 1e12, 1e9, 1e6


def next_corners(face_offsets: Ints) -> Ints:
    """The corner after each corner of the same face, ``(C,)``, for ``face_offsets (F+1,)``."""
    following = np.arange(1, int(face_offsets[-1]) + 1)
    starts, ends = _nonempty(face_offsets)
    following[ends - 1] = starts
    return following


def previous_corners(face_offsets: Ints) -> Ints:
    """The corner before each corner of the same face, ``(C,)``, for ``face_offsets (F+1,)``."""
    before = np.arange(-1, int(face_offsets[-1]) - 1)
    starts, ends = _nonempty(face_offsets)
    before[starts] = ends - 1
    return before


def newell_normals(positions: Floats, face_offsets: Ints, face_vertices: Ints) -> Floats:
    """Area vector of each face ``(F,3)``: its length is twice the area. Faces without corners get zero."""
    sizes = np.diff(face_offsets)
    if len(sizes) and sizes.min() >= 3 and sizes.max() <= 4:
        return _diagonal_products(positions, face_offsets, face_vertices)
    firsts = np.repeat(face_offsets[:-1], sizes)
    points = take_rows(positions, face_vertices)
    points = points - take_rows(points, firsts)
    return sum_over_faces(cross(points, take_rows(points, next_corners(face_offsets))), face_offsets)


def _diagonal_products(positions: Floats, face_offsets: Ints, face_vertices: Ints) -> Floats:
    """Area vectors ``(F,3)`` of triangles and quads: the cross of the diagonals, a triangle being a quad whose last
    corner is the first one again.
    """
    first, last = face_offsets[:-1], face_offsets[1:] - 1
    last = pick(last - first == 3, last, first)
    a, b, c, d = (take_rows(positions, face_vertices[corners]) for corners in (first, first + 1, first + 2, last))
    return cross(c - a, d - b)


def sum_over_faces(values: Floats, face_offsets: Ints) -> Floats:
    """Sum of the corner values ``(C,...)`` of each face, ``(F,...)``; zero for faces without corners."""
    total = np.zeros((len(face_offsets) - 1, *values.shape[1:]))
    starts, _ = _nonempty(face_offsets)
    if len(starts):
        total[np.diff(face_offsets) > 0] = np.add.reduceat(values, starts, axis=0)
    return total


def _nonempty(face_offsets: Ints) -> tuple[Ints, Ints]:
    filled: Bools = np.diff(face_offsets) > 0
    return face_offsets[:-1][filled], face_offsets[1:][filled]


class Verdict(NamedTuple):
    """What `judge` finds for each of B loops.

    ``acceptable (B,)``: convex, simple and not turned away; ``sharpest (B,)`` the cosine of the smallest
    corner; ``area (3,B)`` the area vector, twice the area long.
    """

    acceptable: Bools
    sharpest: Floats
    area: Floats


def judge(points: Floats, counts: Ints | None = None, up: bool = False) -> Verdict:
    """Decide for loops ``points (3,m,B)`` whether each is a convex polygon fit for a patch.

    ``counts (B,)`` says how many of the m rows a loop uses, the others repeat its first point. Every corner
    must be convex, up to a small tolerance, seen along the area vector and along the normal of equation
    (12), and the loop must turn around once. With ``up`` the third axis is the normal of the polygon that
    the loop is a piece of, and the loop must face the same way.
    """
    size, loops = points.shape[1:]
    if counts is not None and counts.min(initial=size) == size:
        counts = None
    after, before = np.roll(points, -1, axis=1), np.roll(points, 1, axis=1)
    if counts is not None:
        every = np.arange(loops)
        after[:, counts - 1, every] = points[:, 0]
        before[:, 0] = points[:, counts - 1, every]
    leave, arrive = after - points, points - before
    turn = cross_rows(arrive, leave)
    lengths = np.sqrt(dot_rows(leave, leave) * dot_rows(arrive, arrive))
    area = cross_rows(points - points[:, :1], leave).sum(axis=1)
    if counts is not None:
        used = np.arange(size)[:, None] < counts
        turn *= used
        lengths *= used
    area_size = np.sqrt(dot_rows(area, area))
    normal = area / np.where(area_size > 0, area_size, 1)
    turn_size = np.sqrt(dot_rows(turn, turn))
    turn_size[turn_size <= STRAIGHT * lengths] = np.inf
    mean = (turn / turn_size).sum(axis=1)
    mean_size = np.sqrt(dot_rows(mean, mean))
    cancels = mean_size < 1e-6
    mean = np.where(cancels, normal, mean / np.where(cancels, 1, mean_size))
    along = dot_rows(turn, normal[:, None])
    least = -REFLEX * lengths
    acceptable: Bools = np.all((along >= least) & (dot_rows(turn, mean[:, None]) >= least), axis=0)
    cosines = dot_rows(arrive, leave)
    if size > 4:  # four convex corners cannot turn around twice
        flat = cosines - dot_rows(arrive, normal[:, None]) * dot_rows(leave, normal[:, None])
        angles = np.arctan2(along, flat)
        if counts is not None:
            angles *= used
        acceptable &= angles.sum(axis=0) < 3 * np.pi
    if up:
        acceptable &= area[2] > STEEP * area_size
    lengths[lengths == 0] = np.inf
    return Verdict(acceptable, (-cosines / lengths).max(axis=0), area)


def surely_convex(points: Floats) -> Bools:
    """Which quads ``(3,4,B)`` are convex beyond doubt: no two corners turn about axes more than a right angle apart.

    Their area vector and their normal of equation (12) are sums of these axes, so that `judge` accepts them.
    """
    leave = np.concatenate([points[:, 1:], points[:, :1]], axis=1) - points
    turn = cross_rows(leave, np.concatenate([leave[:, 1:], leave[:, :1]], axis=1))
    result = np.ones(points.shape[2], dtype=bool)
    for i in range(4):
        for j in range(i):
            result &= dot_rows(turn[:, i], turn[:, j]) >= 0
    return result


def cross_rows(a: Floats, b: Floats) -> Floats:
    """Cross product of vectors whose coordinates come first, ``(3,...)``."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.multiply(a[i], b[j], out=result[k])
        result[k] -= a[j] * b[i]
    return result


def dot_rows(a: Floats, b: Floats) -> Floats:
    """Dot product of vectors whose coordinates come first, ``(3,...)``."""
    total = np.asarray(a[0] * b[0])
    total += a[1] * b[1]
    total += a[2] * b[2]
    return total


def edge_keys(a: Ints, b: Ints) -> Ints:
    """One number for each pair of vertices, whichever comes first."""
    return np.minimum(a, b) * 2**32 + np.maximum(a, b)


def is_in(keys: Ints, sorted_keys: Ints) -> Bools:
    """Which ``keys``, of any shape, are among the ``sorted_keys (K,)``."""
    if not len(sorted_keys):
        return np.zeros(keys.shape, dtype=bool)
    found = np.minimum(np.searchsorted(sorted_keys, keys), len(sorted_keys) - 1)
    return np.asarray(sorted_keys[found] == keys)


def lay_flat(points: Floats) -> Floats:
    """Turn loops ``(3,m,B)`` so that each one's area vector is the third axis, and scale it to length 1.

    The first point becomes the origin. The loops must have an area.
    """
    local = points - points[:, :1]
    area = cross_rows(local, np.roll(local, -1, axis=1)).sum(axis=1)
    size = np.sqrt(dot_rows(area, area))
    up = area / size
    axis = np.zeros_like(up)
    axis[np.argmin(np.abs(up), axis=0), np.arange(up.shape[1])] = 1
    side = cross_rows(axis, up)
    side = side / np.sqrt(dot_rows(side, side))
    frame = [side, cross_rows(up, side), up]
    return np.stack([dot_rows(local, row[:, None]) for row in frame]) / np.sqrt(size)


def triangulate(
    points: Floats, ids: Ints | None = None, taken: Bools | None = None, goals: int = 3
) -> tuple[Ints, Floats]:
    """Triangulate flat loops ``points (3,m,B)`` (see `lay_flat`) as well as can be, by ``goals`` measures.

    The measures: few diagonals at reflex corners; small sum of one over the smallest sine; short diagonals.
    ``ids (m,B)``: no triangle may hold one id twice; ``taken (m,m,B)`` are diagonals to avoid. Returns the
    ends of the diagonals ``(goals,B,m-3,2)`` and the cost ``(goals,B)``, at least ``BACKWARD_COST`` where a
    triangle must run backwards and infinite where an id must repeat.

    A loop whose triangles all run forwards needs no test of visibility: the triangles cover a point as
    often as the loop winds around it, once. That holds for loops that touch themselves as well.
    """
    size, loops = points.shape[1:]
    leave = np.roll(points, -1, axis=1) - points
    arrive = np.roll(leave, 1, axis=1)
    lengths = np.sqrt(dot_rows(leave, leave) * dot_rows(arrive, arrive))
    reflex = cross_rows(arrive, leave)[2] < -REFLEX * lengths
    best = np.zeros((goals, size, size, loops))
    choice = np.zeros((goals, size, size, loops), dtype=np.int16)
    for gap in range(2, size):
        first = np.arange(size - gap)
        low = np.repeat(first, gap - 1)
        middle = low + np.tile(np.arange(1, gap), size - gap)
        high = low + gap
        total = best[:, low, middle] + best[:, middle, high]
        total += _triangle_costs(points[:, low], points[:, middle], points[:, high], goals)
        if ids is not None:
            same = (ids[low] == ids[middle]) | (ids[middle] == ids[high]) | (ids[high] == ids[low])
            total[:, same] = np.inf
        total = total.reshape(goals, size - gap, gap - 1, loops)
        pick = np.argmin(total, axis=2)
        cost = np.take_along_axis(total, pick[:, :, None], axis=2)[:, :, 0]
        if gap < size - 1:
            span = points[:, gap:] - points[:, :-gap]
            steps = [reflex[gap:] | reflex[:-gap], np.zeros_like(span[0]), np.sqrt(dot_rows(span, span))]
            cost += np.stack(steps[:goals])
            if taken is not None:
                cost += TAKEN_COST * taken[first, first + gap]
        best[:, first, first + gap] = cost
        choice[:, first, first + gap] = pick + first[:, None] + 1
    return _read_diagonals(choice), best[:, 0, size - 1]


def _triangle_costs(a: Floats, b: Floats, c: Floats, goals: int) -> Floats:
    ab, bc, ca = b - a, c - b, a - c
    normal = cross_rows(ab, bc)
    area = np.sqrt(dot_rows(normal, normal))
    squares = np.stack([dot_rows(ab, ab), dot_rows(bc, bc), dot_rows(ca, ca)])
    # One over the sine of the smallest angle: the two longest sides over twice the area.
    longest = np.sqrt(squares.prod(axis=0) / np.maximum(squares.min(axis=0), 1e-300))
    thinness = np.minimum(longest / np.maximum(area, 1e-300), THIN_COST)
    avoid = BACKWARD_COST * (normal[2] <= 0) + STEEP_COST * (normal[2] <= STEEP * area)
    avoid += THIN_COST * (thinness > THIN)
    return np.asarray(np.stack([1e-4 * thinness, thinness, 1e-3 * thinness][:goals]) + avoid)


def _read_diagonals(choice: Ints) -> Ints:
    """Walk down the intervals from the whole loop; ``choice (goals,m,m,B)`` gives ``(goals,B,m-3,2)``."""
    goals, size, _, loops = choice.shape
    goal, loop = (part.ravel() for part in np.indices((goals, loops)))
    low, high = np.zeros_like(goal), np.full_like(goal, size - 1)
    found = []
    while len(goal):
        middle = choice[goal, low, high, loop].astype(np.int64)
        goal, loop = np.tile(goal, 2), np.tile(loop, 2)
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        wide = high - low > 1
        goal, loop, low, high = goal[wide], loop[wide], low[wide], high[wide]
        found.append(((goal * loops + loop) * size + low) * size + high)
    keys = np.sort(np.concatenate(found)) % (size * size)
    return np.asarray(np.stack(np.divmod(keys, size), axis=-1).reshape(goals, loops, size - 3, 2))


def visible(points: Floats, start: Ints, end: Ints, loop: Ints) -> Bools:
    """Whether corner ``end (K,)`` is seen from corner ``start (K,)`` inside loop ``loop (K,)``.

    ``points (2|3,m,B)`` are flat loops. A sight line that touches another corner on its way, or runs along
    a side at either end, is blocked.
    """
    x, y = points[0][:, loop], points[1][:, loop]
    every = np.arange(len(start))
    seen = _opens_to(x, y, start, end) & _opens_to(x, y, end, start)
    ax, ay, bx, by = x[start, every], y[start, every], x[end, every], y[end, every]
    nx, ny = np.roll(x, -1, axis=0), np.roll(y, -1, axis=0)
    here = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    crossing = here * np.roll(here, -1, axis=0) <= 0
    crossing &= ((nx - x) * (ay - y) - (ny - y) * (ax - x)) * ((nx - x) * (by - y) - (ny - y) * (bx - x)) <= 0
    # Sides that start or end where the sight line does cannot block it; the corners above decide.
    ends = ((x == ax) & (y == ay)) | ((x == bx) & (y == by))
    crossing &= ~(ends | np.roll(ends, -1, axis=0))
    return np.asarray(seen & ~crossing.any(axis=0))


def _opens_to(x: Floats, y: Floats, corner: Ints, target: Ints) -> Bools:
    """Whether the target lies in the angle of the corner, and clearly so."""
    size, every = x.shape

    def arm(k: Ints) -> tuple[Floats, Floats]:
        at = k % size, np.arange(every)
        return x[at] - x[corner, at[1]], y[at] - y[corner, at[1]]

    (dx, dy), (ax, ay), (bx, by) = arm(target), arm(corner + 1), arm(corner - 1)
    after, before = dx * ay - dy * ax, dx * by - dy * bx
    inside = np.where(ax * by - ay * bx > 0, (after < 0) & (before > 0), (after < 0) | (before > 0))
    for sine, cosine, length in (
        (after, dx * ax + dy * ay, np.hypot(ax, ay)),
        (before, dx * bx + dy * by, np.hypot(bx, by)),
    ):
        inside &= (np.abs(sine) > np.hypot(dx, dy) * length / THIN) | (cosine < 0)
    return np.asarray(inside)


def link_darts(tail: Ints, head: Ints, span: Ints, size: Ints) -> Ints:
    """The dart that follows each dart around its piece, for polygons with diagonals, ``(N,)``.

    A dart runs from corner ``tail`` to corner ``head``, ``span`` corners further on in a polygon of ``size``
    corners. Darts are the sides of the polygons and both directions of diagonals that do not cross.
    """
    # Around a corner, darts sorted by span sweep its inside from the next corner to the previous one; the
    # dart after a -> b is the one just before b -> a in that order.
    wide = int(size.max(initial=0)) + 1
    keys = tail * wide + span
    order = np.argsort(keys)
    return np.asarray(order[np.searchsorted(keys[order], head * wide + size - span) - 1])


def all_distinct(ids: Ints, counts: Ints | None = None) -> Bools:
    """Whether the ids of each loop ``(m,B)`` differ; only the first ``counts (B,)`` rows where given."""
    if counts is not None:
        row = np.arange(len(ids))[:, None]
        ids = np.where(row < counts, ids, -1 - row)
    ids = np.sort(ids, axis=0)
    return np.asarray((ids[1:] != ids[:-1]).all(axis=0))
