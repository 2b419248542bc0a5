"""Cut single polygons into convex pieces: the three ways to choose diagonals.

``best`` takes the best of three optimal triangulations and deletes diagonals (Hertel & Mehlhorn 1983), which
stays within a few pieces of the minimum (Keil 1985). ``closest`` is the paper's rule (2.4): join a concave
vertex to its closest vertex in sight. Convex polygons with too many sides are halved.

All work on batches of polygons of one size, in the plane of each polygon's area vector.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from curvify.arrays import distinct, values_of
from curvify.mesh import Bools, Floats, Ints
from curvify.polygons import (
    BACKWARD_COST,
    all_distinct,
    dot_rows,
    edge_keys,
    is_in,
    judge,
    link_darts,
    triangulate,
    visible,
)

LARGE = 40  # the triangulation takes time and memory with the cube of the sides: larger loops are cut first

Cut = tuple[Ints, Ints, Ints]  # face of a group, and the rows of the two corners that a diagonal joins
Chooser = Callable[[Ints, Ints], tuple[Ints, Ints]]


class Group(NamedTuple):
    """Faces of one size to cut, each turned to its canonical first corner and laid flat.

    ``faces (B,)``, ``corners (n,B)`` of the source mesh, ``ids (n,B)`` their vertices, ``place (3,n,B)``
    their positions as of `lay_flat`, ``area (B,)`` the squared area; ``convex (B,)`` faces that are fit for a
    patch but for their number of sides, ``simple (B,)`` faces that visit no vertex twice.
    """

    faces: Ints
    corners: Ints
    ids: Ints
    place: Floats
    area: Floats
    convex: Bools
    simple: Bools

    def take(self, which: Ints) -> Group:
        """The faces at ``which (K,)``."""
        return Group(
            self.faces[which],
            self.corners[:, which],
            self.ids[:, which],
            self.place[:, :, which],
            self.area[which],
            self.convex[which],
            self.simple[which],
        )


def cut_group(group: Group, avoid: Ints | None, rule: str, max_sides: int) -> Cut:
    """Cut all faces of a group by the cheapest means that works, the optimal triangulations being the last.

    ``avoid`` are sorted keys of vertex pairs that no diagonal should join. Faces that cannot be cut are in
    none of the diagonals returned.
    """
    found = []
    rest = np.arange(len(group.faces))
    for choose, use in (
        (partial(_halve, group, avoid, max_sides), group.convex & group.simple),
        (partial(_closest, group, avoid, max_sides), np.full(len(rest), rule == "closest")),
    ):
        which = rest[use[rest]]
        if not len(which):
            continue
        (face, a, b), pieces = _cut_until(len(group.ids), which, choose)
        failed = np.zeros(len(group.faces), dtype=bool)
        for loop, at in pieces:
            fine = judge(group.place[:, loop, at], up=True).acceptable & all_distinct(group.ids[loop, at])
            failed[at[~fine | (len(loop) > max_sides)]] = True
        good = ~failed[face]
        found.append((face[good], a[good], b[good]))
        rest = rest[~use[rest] | failed[rest]]
    step = max(1, 200_000 // len(group.ids) ** 2)
    for start in range(0, len(rest), step):
        found.append(_best_cut(group, rest[start : start + step], avoid, max_sides))
    return _join(found)


def _join(cuts: list[Cut]) -> Cut:
    if not cuts:
        nothing = np.zeros(0, dtype=np.int64)
        return nothing, nothing, nothing
    face, a, b = (np.concatenate(part) for part in zip(*cuts, strict=True))
    return face, a, b


def _best_cut(group: Group, which: Ints, avoid: Ints | None, max_sides: int) -> Cut:
    """Fewest pieces, then the largest smallest angle, of three triangulations with diagonals deleted."""
    size = len(group.ids)
    ids, place = group.ids[:, which], group.place[:, :, which]
    names = None if group.simple[which].all() else ids
    pairs, cost = _triangulate(place, ids, names, avoid)
    force = ~group.simple[which] | (size > max_sides)
    valid = (cost < BACKWARD_COST) | (force & np.isfinite(cost))
    for goal in range(1, len(pairs)):  # measures often agree
        for other in range(goal):
            valid[goal] &= (pairs[goal] != pairs[other]).any(axis=(1, 2))
    goals, at = np.nonzero(valid)
    pairs = pairs[goals, at]
    ends = ids[pairs, at[:, None, None]]
    taken: Bools = np.zeros(ends.shape[:2], dtype=bool)
    if avoid is not None:
        taken = _taken(ends[..., 0], ends[..., 1], avoid)
    kept: Bools = np.ones(taken.shape, dtype=bool)
    sharpest: Floats = np.zeros(len(at))
    if size > 4:
        names = None if names is None else names[:, at]
        kept, sharpest = merge(place[:, :, at], pairs, taken, max_sides, names)
    doubled = (taken & kept).sum(axis=1)
    order = np.lexsort((goals, sharpest, kept.sum(axis=1), doubled, at))
    best = order[np.diff(at[order], prepend=-1) > 0]
    row, column = np.nonzero(kept[best])
    chosen = pairs[best[row], column]
    return which[at[best[row]]], chosen[:, 0], chosen[:, 1]


def _triangulate(place: Floats, ids: Ints, names: Ints | None, avoid: Ints | None) -> tuple[Ints, Floats]:
    """`triangulate`, with loops of more than `LARGE` sides cut by short diagonals in sight first."""
    size, faces = place.shape[1:]
    if size <= LARGE:
        taken = None if avoid is None else _taken(ids[:, None], ids[None], avoid)
        return triangulate(place, names, taken, goals=1 if size == 4 else 3)
    (face, a, b), pieces = _cut_until(size, np.arange(faces), partial(_cut_large, place, ids))
    keys = [np.tile((face * size + np.minimum(a, b)) * size + np.maximum(a, b), (3, 1))]
    cost = np.zeros((3, faces))
    for loop, at in pieces:
        part_names = None if names is None else names[loop, at]
        pairs, part_cost = _triangulate(place[:, loop, at], ids[loop, at], part_names, avoid)
        ends = loop[pairs, np.arange(len(at))[:, None, None]]
        part = ((at[:, None] * size + ends.min(axis=3)) * size + ends.max(axis=3)).reshape(len(pairs), -1)
        keys.append(np.broadcast_to(part, (3, part.shape[1])))
        for goal in range(3):
            np.add.at(cost[goal], at, part_cost[min(goal, len(part_cost) - 1)])
    every = np.sort(np.concatenate(keys, axis=1), axis=1) % (size * size)
    return np.stack(np.divmod(every, size), axis=-1).reshape(3, faces, size - 3, 2), cost


def _taken(a: Ints, b: Ints, avoid: Ints) -> Bools:
    return is_in(edge_keys(a, b), avoid)


def _cut_until(size: int, faces: Ints, choose: Chooser) -> tuple[Cut, list[tuple[Ints, Ints]]]:
    """Cut loops in two by the diagonals that ``choose`` names until it names none.

    ``choose(loop (m,K), face (K,))`` returns for each loop a row and how many rows further on the diagonal
    ends, 0 for none. Returns the cuts and the pieces: loops ``(m,K)`` of rows of the group, and their faces.
    """
    open_ = {size: [(np.broadcast_to(np.arange(size)[:, None], (size, len(faces))), faces)]}
    found, pieces = [], []
    while open_:
        size = max(open_)
        parts = open_.pop(size)
        loop = np.concatenate([part[0] for part in parts], axis=1)
        face = np.concatenate([part[1] for part in parts])
        start, span = choose(loop, face) if size > 3 else (face, np.zeros_like(face))
        pieces.append((loop[:, span == 0], face[span == 0]))
        for width in values_of(span[span > 0]):
            at = np.flatnonzero(span == width)
            near = loop[(start[at] + np.arange(width + 1)[:, None]) % size, at]
            far = loop[(start[at] + width + np.arange(size - width + 1)[:, None]) % size, at]
            found.append((face[at], near[0], near[-1]))
            for child in (near, far):
                open_.setdefault(len(child), []).append((child, face[at]))
    return _join(found), [part for part in pieces if len(part[1])]


def _halve(group: Group, avoid: Ints | None, max_sides: int, loop: Ints, face: Ints) -> tuple[Ints, Ints]:
    """The most upright diagonal that cuts a convex loop about in half, in as few pieces as can be."""
    size = len(loop)
    if size <= max_sides:
        return np.zeros_like(face), np.zeros_like(face)
    pieces = -(-(size - 2) // (max_sides - 2))
    part = pieces // 2
    ideal = (size - 2) * part / pieces
    low = max(1, size - 2 - (pieces - part) * (max_sides - 2), round(0.85 * ideal))
    high = min(size - 3, part * (max_sides - 2), round(1.15 * ideal))
    spans = distinct(np.linspace(low, max(low, high), 9).round().astype(np.int64))[0] + 1
    start, span = np.zeros_like(face), np.zeros_like(face)
    for k in range(len(face)):
        points = group.place[:, loop[:, k], face[k]]
        end = (np.arange(size) + spans[:, None]) % size
        line = points[:, end] - points[:, None]
        sharpest = np.full(line.shape[1:], -1.0)
        for shift in (1, -1):
            side = np.roll(points, -shift, axis=1) - points
            sharpest = np.maximum(sharpest, _cosines(side[:, None], line))
            sharpest = np.maximum(sharpest, _cosines(side[:, end], -line))
        if avoid is not None:
            ids = group.ids[loop[:, k], face[k]]
            sharpest += 4.0 * _taken(ids, ids[end], avoid)
        best = int(np.argmin(sharpest))
        start[k], span[k] = best % size, spans[best // size]
    return start, span


def _cosines(a: Floats, b: Floats) -> Floats:
    return dot_rows(a, b) / np.maximum(np.sqrt(dot_rows(a, a) * dot_rows(b, b)), 1e-300)


def _closest(group: Group, avoid: Ints | None, max_sides: int, loop: Ints, face: Ints) -> tuple[Ints, Ints]:
    """The paper's rule (2.4): join the most concave vertex to the closest in sight that is no neighbor."""
    size, every = len(loop), np.arange(len(face))
    points, ids = group.place[:, loop, face], group.ids[loop, face]
    fine = judge(points, up=True).acceptable & all_distinct(ids)
    arrive = points - np.roll(points, 1, axis=1)
    leave = np.roll(arrive, -1, axis=1)
    turn = arrive[0] * leave[1] - arrive[1] * leave[0]
    turn = np.arctan2(turn, arrive[0] * leave[0] + arrive[1] * leave[1])
    start = np.argmin(turn, axis=0)
    gap = points - points[:, start, every][:, None]
    distance = dot_rows(gap, gap)
    for step in (-1, 0, 1):
        distance[(start + step) % size, every] = np.inf
    distance[ids == ids[start, every]] = np.inf
    if avoid is not None:
        distance[_taken(ids, ids[start, every], avoid)] = np.inf
    distance[:, fine | (turn[start, every] >= 0)] = np.inf
    end, at = np.nonzero(np.isfinite(distance))
    for part in np.array_split(np.arange(len(at)), len(at) * size // 1_000_000 + 1):
        blocked = part[~visible(points, start[at[part]], end[part], at[part])]
        distance[end[blocked], at[blocked]] = np.inf
    end = np.argmin(distance, axis=0)
    span = np.where(np.isfinite(distance[end, every]), (end - start) % size, 0)
    many = np.flatnonzero(fine & (size > max_sides))
    if len(many):
        start[many], span[many] = _halve(group, avoid, max_sides, loop[:, many], face[many])
    return start, span


def _cut_large(place: Floats, ids: Ints, loop: Ints, face: Ints) -> tuple[Ints, Ints]:
    """A short diagonal in sight that leaves a good part of the loop on either side, `LARGE` sides at most."""
    size = len(loop)
    start, span = np.zeros_like(face), np.zeros_like(face)
    if size <= LARGE:
        return start, span
    low, high = np.triu_indices(size, 2)
    balance = np.minimum(high - low, size - high + low)
    for k in range(len(face)):
        points, names = place[:, loop[:, k], face[k]], ids[loop[:, k], face[k]]
        gap = points[:, low] - points[:, high]
        usable = (balance > 1) & (names[low] != names[high])
        wish = np.where(usable, dot_rows(gap, gap) + 1e9 * (balance < size // 4), np.inf)
        order = np.argsort(wish, kind="stable")[: np.count_nonzero(usable)]
        pick = order[0]  # nothing in sight: the loop is not simple, any cut will do
        for tries in np.split(order, range(256, min(len(order), 20_000), 256)):
            seen = visible(points[:, :, None], low[tries], high[tries], np.zeros_like(tries))
            if seen.any():
                pick = tries[np.argmax(seen)]
                break
        start[k], span[k] = low[pick], high[pick] - low[pick]
    return start, span


class _Darts(NamedTuple):
    """Sides and diagonals of triangulated loops, which `merge` relinks in place.

    The first n*P darts are the sides, then come the diagonals, low to high end, then the same, high to low.
    """

    tail: Ints  # corner, loop by loop
    after: Ints  # the next dart around the piece
    before: Ints
    sharpest: Floats  # cosine of the smallest corner of the piece
    sides: Ints  # of the piece


def merge(
    points: Floats, diagonals: Ints, taken: Bools, max_sides: int, ids: Ints | None = None
) -> tuple[Bools, Floats]:
    """Delete diagonals of triangulated flat loops while the pieces stay acceptable (Hertel & Mehlhorn 1983).

    ``points (3,n,P)``, ``diagonals (P,n-3,2)``; the sharpest pieces lose a diagonal first, and ``taken
    (P,n-3)`` diagonals before all others. No piece gets more than ``max_sides`` sides or one of ``ids (n,P)``
    twice. Returns which diagonals stay ``(P,n-3)`` and the cosine of the smallest corner left ``(P,)``.
    """
    (size, loops), each = points.shape[1:], diagonals.shape[1]
    place = np.ascontiguousarray(points.transpose(0, 2, 1)).reshape(3, -1)
    names = None if ids is None else np.ascontiguousarray(ids.T).ravel()
    darts = _triangle_darts(place, diagonals, size)
    first, second = size * loops, size * loops + each * loops
    # Of the diagonals of one sharp piece the longest goes first: the order must not hang on the numbering.
    preference = 4.0 * taken + 1e-6 * _diagonal_lengths(points, diagonals)
    kept, untried = np.ones((loops, each), dtype=bool), np.ones((loops, each), dtype=bool)
    while len(active := np.flatnonzero(untried.any(axis=1))):
        choices = first + each * active[:, None] + np.arange(each)
        rank = np.maximum(darts.sharpest[choices], darts.sharpest[choices + each * loops])
        rank += preference[active]
        rank[~untried[active]] = -np.inf
        pick = np.argmax(rank, axis=1)
        untried[active, pick] = False
        dart = choices[np.arange(len(active)), pick]
        dart = dart[darts.sides[dart] + darts.sides[dart + each * loops] - 2 <= max_sides]
        if len(dart):
            gone = _try_without(darts, dart, dart + each * loops, place, names)
            kept.ravel()[gone - first] = False
    along = np.maximum(darts.sharpest[first:second], darts.sharpest[second:]).reshape(loops, each)
    sharpest = darts.sharpest[:first].reshape(loops, size).max(axis=1)
    return kept, np.maximum(sharpest, np.where(kept, along, -1).max(axis=1, initial=-1))


def _triangle_darts(place: Floats, diagonals: Ints, size: int) -> _Darts:
    corner = np.arange(place.shape[1])
    ends = diagonals + size * np.arange(len(diagonals))[:, None, None]
    low, high = ends[..., 0].ravel(), ends[..., 1].ravel()
    tail = np.concatenate([corner, low, high])
    head = np.concatenate([corner + 1 - size * (corner % size == size - 1), high, low])
    after = link_darts(tail, head, (head - tail) % size, np.full_like(tail, size))
    before = np.empty_like(after)
    before[after] = np.arange(len(after))
    here = place[:, tail]
    corners = _cosines(place[:, head] - here, here[:, before] - here)
    sharpest = np.maximum(np.maximum(corners, corners[after]), corners[before])
    return _Darts(tail, after, before, sharpest, np.full_like(tail, 3))


def _diagonal_lengths(points: Floats, diagonals: Ints) -> Floats:
    ends = points[:, diagonals, np.arange(len(diagonals))[:, None, None]]
    line = ends[..., 1] - ends[..., 0]
    return np.asarray(np.sqrt(dot_rows(line, line)))


def _try_without(darts: _Darts, dart: Ints, twin: Ints, place: Floats, names: Ints | None) -> Ints:
    """Join the two pieces at each diagonal, part again those that do not fit; returns the darts joined."""
    after, before = darts.after, darts.before
    total = darts.sides[dart] + darts.sides[twin] - 2
    _link(darts, before[dart], after[twin])
    _link(darts, before[twin], after[dart])
    loop = _walk(after, after[dart], total)
    verdict = judge(place[:, darts.tail[loop]], total, up=True)
    fits = verdict.acceptable
    if names is not None:
        fits &= all_distinct(names[darts.tail[loop]], total)
    darts.sharpest[loop[:, fits]], darts.sides[loop[:, fits]] = verdict.sharpest[fits], total[fits]
    for back in (dart[~fits], twin[~fits]):
        after[before[back]], before[after[back]] = back, back
    return dart[fits]


def _link(darts: _Darts, first: Ints, second: Ints) -> None:
    darts.after[first], darts.before[second] = second, first


def _walk(after: Ints, start: Ints, counts: Ints) -> Ints:
    """Follow loops of ``counts`` darts from ``start``; shorter ones are padded with their first dart."""
    rows = np.empty((int(counts.max()), len(start)), dtype=np.int64)
    rows[0] = start
    for step in range(1, len(rows)):
        rows[step] = after[rows[step - 1]]
    return np.where(np.arange(len(rows))[:, None] < counts, rows, start)
