"""Fewer polygons: neighbors merged while they stay convex and nearly planar, and vertices that do nothing dropped.

Both work in rounds: all candidates are judged at once, and of those that touch one another the best goes first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.arrays import distinct
from curvify.mesh import Bools, Floats, Ints
from curvify.simplify.borders import segment_distance
from curvify.simplify.polygons import Polygons, Shapes, first_of_each, ranges, shapes_of
from curvify.topology import Topology

#: The most sides that a merged polygon may have.
MOST_SIDES = 10


@dataclass(frozen=True)
class Limits:
    """What merging may do: the largest height range over size, the least cosine between the two polygons."""

    unevenness: float
    cosine: float


#: Merging that costs nothing, and what may be tried where there are still too many polygons.
FREE = Limits(0.02, 0.99)
PRESSED = (Limits(0.04, 0.95), Limits(0.08, 0.9), Limits(0.12, 0.8), Limits(0.2, 0.6))


def merge(positions: Floats, polygons: Polygons, kept: Bools, limits: Limits, target: int) -> tuple[Polygons, Ints]:
    """Merge neighbors until there are ``target`` polygons or none can be merged within the limits.

    ``kept (C,)`` are half-edges to keep. With the polygons comes the half-edge ``(C',)`` that each of theirs was.
    """
    was = np.arange(len(polygons.vertices))
    while polygons.count > target:
        shapes = shapes_of(positions, polygons.vertices, polygons.sides)
        topology = polygons.topology(positions)
        ends = _shared_chains(polygons, topology, kept[was])
        if not len(ends[0]):
            break
        loops, sizes = _merged_loops(polygons, topology, *ends)
        one, other = topology.faces[ends[0]], topology.faces[topology.twin[ends[0]]]
        cost = _costs(positions, polygons, shapes, (one, other), loops, sizes, limits)
        chosen = _best_apart(cost, one, other, polygons.count)[: polygons.count - target]
        if not len(chosen):
            break
        polygons, half_edges = _replace(polygons, one[chosen], other[chosen], *_pick(loops, sizes, chosen))
        was = was[half_edges]
    return polygons, was


def _shared_chains(polygons: Polygons, topology: Topology, creases: Bools) -> tuple[Ints, Ints, Ints]:
    """Pairs of polygons that share one unbroken chain without a crease.

    For each pair the last and the first half-edge of the chain in one of them, and the number of its edges.
    """
    twin, face = topology.twin, topology.faces
    shared = np.flatnonzero((twin >= 0) & (face < face[twin]))
    key = face[shared] * np.int64(polygons.count) + face[twin[shared]]
    names, pair = distinct(key)
    own = np.full(len(twin), -1)
    own[shared] = pair
    before, after = topology.prev[shared], topology.next[shared]
    # The chain goes on at a vertex where the two polygons are alone.
    runs_in = (own[before] == pair) & (twin[before] == topology.next[twin[shared]])
    runs_out = (own[after] == pair) & (topology.prev[twin[shared]] == twin[after])
    chains = np.bincount(pair[~runs_in], minlength=len(names))
    sharp = np.bincount(pair[creases[shared]], minlength=len(names)) > 0
    good = (chains == 1) & ~sharp
    first, last = np.full(len(names), -1), np.full(len(names), -1)
    first[pair[~runs_in]] = shared[~runs_in]
    last[pair[~runs_out]] = shared[~runs_out]
    length = np.bincount(pair, minlength=len(names))
    small = np.minimum(polygons.sides[names // polygons.count], polygons.sides[names % polygons.count])
    good &= length < small
    return last[good], first[good], length[good]


def _merged_loops(polygons: Polygons, topology: Topology, last: Ints, first: Ints, length: Ints) -> tuple[Ints, Ints]:
    """Half-edges of the unions, loop by loop, and the loops' sizes."""
    parts = []
    for begin in (last, topology.twin[first]):
        face = topology.faces[begin]
        offset, sides = polygons.offsets[face], polygons.sides[face]
        parts.append((begin - offset + 1, offset, sides, sides - length))
    sizes = parts[0][3] + parts[1][3]
    flat, pair = ranges(np.zeros_like(sizes), sizes)
    in_first = flat < parts[0][3][pair]
    step = np.where(in_first, flat, flat - parts[0][3][pair])
    begin, offset, sides, _ = (np.where(in_first, a[pair], b[pair]) for a, b in zip(*parts, strict=True))
    return offset + (begin + step) % sides, sizes


def _costs(
    positions: Floats,
    polygons: Polygons,
    shapes: Shapes,
    pairs: tuple[Ints, Ints],
    loops: Ints,
    sizes: Ints,
    limits: Limits,
) -> Floats:
    """What each union costs, infinite where it is not allowed: slivers and flat pairs come first."""
    one, other = pairs
    cosine = np.einsum("pi,pi->p", shapes.normals[one], shapes.normals[other])
    possible = np.flatnonzero((cosine > limits.cosine) & (sizes <= MOST_SIDES) & (sizes >= 3))
    cost = np.full(len(sizes), np.inf)
    if not len(possible):
        return cost
    part, part_sizes = _pick(loops, sizes, possible)
    union = shapes_of(positions, polygons.vertices[part], part_sizes)
    one, other = one[possible], other[possible]
    fine = union.acceptable & (union.unevenness < limits.unevenness)
    for side in (one, other):
        fine &= np.einsum("pi,pi->p", union.normals, shapes.normals[side]) > limits.cosine
    loss = np.maximum(shapes.areas[one] + shapes.areas[other] - union.areas, 0)
    loss += 1e-6 * np.minimum(shapes.areas[one], shapes.areas[other])
    thin = np.minimum(shapes.least_sines[one], shapes.least_sines[other])
    cost[possible] = np.where(fine, loss * (0.2 + thin), np.inf)
    return cost


def _pick(loops: Ints, sizes: Ints, chosen: Ints) -> tuple[Ints, Ints]:
    """The chosen ones of loops in compressed rows."""
    first = np.cumsum(sizes) - sizes
    return loops[ranges(first[chosen], sizes[chosen])[0]], sizes[chosen]


def _best_apart(cost: Floats, one: Ints, other: Ints, count: int) -> Ints:
    """Pairs that are the best of all that touch either of their polygons, best first."""
    order = np.argsort(cost, kind="stable")
    order = order[np.isfinite(cost[order])]
    rank = np.arange(len(order))
    best = np.full(count, len(order))
    np.minimum.at(best, one[order], rank)
    np.minimum.at(best, other[order], rank)
    return order[(best[one[order]] == rank) & (best[other[order]] == rank)]


def _replace(polygons: Polygons, one: Ints, other: Ints, loops: Ints, sizes: Ints) -> tuple[Polygons, Ints]:
    """Put unions in the place of their first polygons; the polygons and the old half-edge of each of theirs."""
    kept = np.ones(polygons.count, dtype=bool)
    kept[one] = kept[other] = False
    stay = np.flatnonzero(kept)
    corners, _ = ranges(polygons.offsets[stay], polygons.sides[stay])
    every = np.concatenate([corners, loops])
    every_sizes = np.concatenate([polygons.sides[stay], sizes])
    half_edges, new_sizes = _pick(every, every_sizes, np.argsort(np.concatenate([stay, one]), kind="stable"))
    offsets = np.concatenate([[0], np.cumsum(new_sizes)])
    return polygons.regrouped(offsets, half_edges), half_edges


def drop_vertices(positions: Floats, polygons: Polygons, creases: Bools, tolerance: float) -> tuple[Polygons, Bools]:
    """Drop vertices between two polygons only, or one on a boundary, as long as nothing is lost by that.

    Both polygons must keep 3 sides and stay convex, the new edge must not exist, and on creases and boundaries the
    path must stay within ``tolerance`` of it.
    """
    while True:
        topology = polygons.topology(positions)
        here = _idle_half_edges(polygons, topology, creases)
        if not len(here):
            return polygons, creases
        here = _droppable(positions, polygons, topology, here, creases, tolerance)
        if not len(here):
            return polygons, creases
        gone = np.concatenate([here, topology.next[topology.twin[here]][topology.twin[here] >= 0]])
        polygons, half_edges = _without(polygons, topology, gone)
        creases = creases[half_edges]


def _idle_half_edges(polygons: Polygons, topology: Topology, creases: Bools) -> Ints:
    """Half-edges that leave a vertex of two polygons, or of one on a boundary: one for each such vertex."""
    twin = topology.twin
    leaving, before = np.arange(len(twin)), topology.prev
    degree = np.bincount(topology.edges.reshape(-1), minlength=topology.vertex_count)
    two = degree[polygons.vertices] == 2
    inner = (twin >= 0) & (twin[before] >= 0)
    pair = inner & two & (leaving < topology.next[twin])
    rim = (twin < 0) & (twin[before] < 0) & two
    return np.flatnonzero((pair | rim) & (creases == creases[before]))


def _droppable(
    positions: Floats, polygons: Polygons, topology: Topology, here: Ints, creases: Bools, tolerance: float
) -> Ints:
    """Those of the idle corners ``here`` that may go at once: no two of them in one polygon."""
    vertices, face = polygons.vertices, topology.faces
    before, after = vertices[topology.prev[here]], vertices[topology.next[here]]
    point = positions[vertices[here]]
    gap = segment_distance(point, positions[before], positions[after])
    gap = np.maximum(gap, _path_gap(positions, polygons, topology, here))
    rim = topology.twin[here] < 0
    fine = ~((creases[here] | rim) & (gap > tolerance))
    count = np.int64(len(positions))
    edge_names = np.sort(topology.edges.min(axis=1) * count + topology.edges.max(axis=1))
    name = np.minimum(before, after) * count + np.maximum(before, after)
    fine &= edge_names[np.minimum(np.searchsorted(edge_names, name), len(edge_names) - 1)] != name
    sides = [here, np.where(rim, here, topology.next[topology.twin[here]])]
    for side in sides:
        fine &= polygons.sides[face[side]] > 3
    here, gap = here[fine], gap[fine]
    sides = [side[fine] for side in sides]
    good = np.ones(len(here), dtype=bool)
    for side in sides:
        good &= _convex_without(positions, polygons, topology, side)
    here, gap = here[good], gap[good]
    one, other = face[sides[0][good]], face[sides[1][good]]
    name = name[fine][good]
    chosen = _best_apart(gap, one, other, polygons.count)
    first = first_of_each(name[chosen])
    return here[chosen[first]]


def _path_gap(positions: Floats, polygons: Polygons, topology: Topology, here: Ints) -> Floats:
    """How far the paths into and out of each corner leave the edge that would replace them."""
    start = positions[polygons.vertices[topology.prev[here]]]
    end = positions[polygons.vertices[topology.next[here]]]
    gap = np.zeros(len(here))
    for half_edges in (topology.prev[here], here):
        steps, which = polygons.path_corners(half_edges)
        distance = segment_distance(positions[polygons.steps[steps]], start[which], end[which])
        np.maximum.at(gap, which, distance)
    return gap


def _convex_without(positions: Floats, polygons: Polygons, topology: Topology, corners: Ints) -> Bools:
    """Whether the polygon of each corner stays convex, and turned the same way, without it."""
    face = topology.faces[corners]
    sizes = polygons.sides[face] - 1
    step, which = ranges(np.ones_like(sizes), sizes)
    offset, sides = polygons.offsets[face], polygons.sides[face]
    loop = offset[which] + (corners[which] - offset[which] + step) % sides[which]
    shapes = shapes_of(positions, polygons.vertices[loop], sizes)
    old = shapes_of(positions, polygons.vertices[ranges(offset, sides)[0]], sides)
    turned = np.einsum("pi,pi->p", shapes.normals, old.normals)
    return shapes.acceptable & (turned > 0.9) & (shapes.least_sines > 1e-2)


def _without(polygons: Polygons, topology: Topology, gone: Ints) -> tuple[Polygons, Ints]:
    """Polygons without the corners ``gone``, whose paths join those before them."""
    before = topology.prev[gone]
    first, one = polygons.path_corners(before)
    second, two = polygons.path_corners(gone)
    order = np.argsort(np.concatenate([2 * one, 2 * two + 1]), kind="stable")
    joined = np.concatenate([first, second])[order]
    sizes = polygons.sizes.copy()
    starts = polygons.starts.copy()
    sizes[before] += polygons.sizes[gone]
    starts[before] = len(polygons.steps) + np.cumsum(sizes[before]) - sizes[before]
    kept = np.ones(len(polygons.vertices), dtype=bool)
    kept[gone] = False
    half_edges = np.flatnonzero(kept)
    offsets = np.concatenate([[0], np.cumsum(kept)])[polygons.offsets]
    longer = Polygons(
        polygons.offsets,
        polygons.vertices,
        polygons.regions,
        starts,
        sizes,
        np.concatenate([polygons.steps, polygons.steps[joined]]),
        np.concatenate([polygons.sharp, polygons.sharp[joined]]),
    )
    return longer.regrouped(offsets, half_edges), half_edges
