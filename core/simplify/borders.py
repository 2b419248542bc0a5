"""Borders of regions as polygons: which of their vertices become corners.

The choice is one flag for each vertex of the dense mesh, so that the regions on both sides of a border agree on it
whatever they look like otherwise: there can be no crack. Between two flagged vertices, *anchors*, runs a *chord*.
Source: Cohen-Steiner, Alliez & Desbrun 2004, section 4, with rules of our own for discs, doubles and tolerances.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.mesh import Bools, Floats, Ints
from curvify.simplify.regions import border_half_edges
from curvify.simplify.triangles import Triangles

#: A chord is split where its border leaves it by more than this share of its length, weighted by the bend there.
SHARE = 0.35
#: The least weight of the bend between two regions.
LEAST_BEND = 0.35


@dataclass(eq=False)
class Borders:
    """The border loops of disc regions, region by region.

    ``half_edges (B,)`` in the order of the loops, ``offsets (K+1,)``; ``tails (B,)`` their vertices, ``edges (B,)``
    one number for the two half-edges of an edge; ``rim (B,)`` on the mesh's boundary, ``sharp (B,)`` along a dense
    edge that is a crease or a boundary; ``bend (B,)`` the sine between the proxies of the two regions, 1 above a
    right angle and on the rim.
    """

    half_edges: Ints
    offsets: Ints
    tails: Ints
    edges: Ints
    rim: Bools
    sharp: Bools
    bend: Floats

    @property
    def regions(self) -> Ints:
        """Region of each border half-edge ``(B,)``."""
        return np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))


def region_borders(mesh: Triangles, labels: Ints, normals: Floats, sharp_edges: Bools) -> Borders:
    """Borders of regions that are discs; ``normals (K,3)`` of the regions, ``sharp_edges (3F,)`` half-edges."""
    half_edges = np.flatnonzero(border_half_edges(mesh, labels))
    own = labels[half_edges // 3]
    keys = own * np.int64(len(mesh.positions)) + mesh.tails[half_edges]
    order = np.argsort(keys)
    after = order[np.searchsorted(keys[order], own * np.int64(len(mesh.positions)) + mesh.heads[half_edges])]
    loop = _in_order(after, own)
    half_edges = half_edges[loop]
    offsets = np.concatenate([[0], np.cumsum(np.bincount(own, minlength=len(normals)))])
    twin = mesh.twin[half_edges]
    rim = twin < 0
    other = labels[np.maximum(twin, 0) // 3]
    cosine = np.einsum("ni,ni->n", normals[labels[half_edges // 3]], normals[other])
    bend = np.where(rim | (cosine < 0), 1.0, np.sqrt(np.maximum(1 - cosine**2, 0)))
    edges = np.where(rim, half_edges, np.minimum(half_edges, twin))
    return Borders(half_edges, offsets, mesh.tails[half_edges], edges, rim, sharp_edges[half_edges], bend)


def _in_order(after: Ints, own: Ints) -> Ints:
    """The nodes of the cycles ``after``, one for each group ``own``, group by group, each from its smallest node."""
    count = len(after)
    group_count = int(own.max()) + 1
    first = np.full(group_count, count)
    np.minimum.at(first, own, np.arange(count))
    # Steps to the end of each cycle, cut open before its first node, by doubling the stride.
    last = after == first[own]
    steps = np.where(last, 0, 1)
    jump = np.where(last, np.arange(count), after)
    while (steps[jump] > 0).any():
        steps = steps + steps[jump]
        jump = jump[jump]
    return np.lexsort((-steps, own))


@dataclass(eq=False)
class Chords:
    """Chords between anchors: ``order (B,)`` places of the borders, each loop from an anchor on; ``starts (n,)``
    where in that order each chord starts; ``ends (n,2)`` its two vertices; ``regions (n,)``.
    """

    order: Ints
    starts: Ints
    ends: Ints
    regions: Ints

    @property
    def sizes(self) -> Ints:
        """Dense edges of each chord ``(n,)``."""
        return np.diff(np.append(self.starts, len(self.order)))


def chords_of(borders: Borders, anchors: Bools) -> Chords:
    """The chords that ``anchors (V,)`` make of borders, every one of which has an anchor."""
    flagged = anchors[borders.tails]
    sizes = np.diff(borders.offsets)
    place = np.flatnonzero(flagged)
    first = place[np.searchsorted(place, borders.offsets[:-1])]
    shift = np.repeat(first - borders.offsets[:-1], sizes)
    begin = np.repeat(borders.offsets[:-1], sizes)
    order = begin + (np.arange(len(shift)) - begin + shift) % np.repeat(sizes, sizes)
    starts = np.flatnonzero(flagged[order])
    tails = borders.tails[order[starts]]
    regions = borders.regions[order[starts]]
    following = np.append(starts[1:], 0)
    closes = np.diff(regions, append=-1) != 0
    heads = borders.tails[order[following]]
    heads[closes] = borders.tails[first[regions[closes]]]
    return Chords(order, starts, np.stack([tails, heads], axis=1), regions)


@dataclass(frozen=True)
class Tolerance:
    """How far a border may leave its chord, as lengths: ``sharp`` on creases and boundaries, ``smooth`` elsewhere; and
    ``share`` of the chord's length, see `SHARE`.
    """

    sharp: float
    smooth: float
    share: float = SHARE


def find_anchors(mesh: Triangles, borders: Borders, forced: Bools, tolerance: Tolerance) -> Bools:
    """Anchors ``(V,)``: where borders meet or the mesh's boundary begins, ``forced (V,)``, and where chords need them.

    They leave every region at least 3 corners, and no two chords the same two ends.
    """
    once = borders.rim | (borders.half_edges == borders.edges)
    heads = mesh.heads[borders.half_edges]
    degree = np.bincount(borders.tails[once], minlength=len(mesh.positions))
    degree += np.bincount(heads[once], minlength=len(mesh.positions))
    anchors = (degree != 2) & (degree > 0) | forced
    anchors = _seed_bare_loops(mesh, borders, anchors)
    while True:
        chords = chords_of(borders, anchors)
        gap, place = farthest(mesh, borders, chords)
        split = _leaves_its_border(mesh, borders, chords, gap, tolerance)
        if not split.any():
            split = _too_few(borders, chords, gap) | _doubles(mesh, borders, chords)
            if not split.any():
                return anchors
        anchors[borders.tails[place[split]]] = True


def _seed_bare_loops(mesh: Triangles, borders: Borders, anchors: Bools) -> Bools:
    """Give loops with fewer than two anchors the vertices that lie farthest apart."""
    anchors = anchors.copy()
    regions = borders.regions
    count = len(borders.offsets) - 1
    points = mesh.positions[borders.tails]
    for least in (1, 2):
        flagged = anchors[borders.tails]
        bare = np.bincount(regions[flagged], minlength=count) < least
        if not bare.any():
            continue
        sizes = np.maximum(np.diff(borders.offsets), 1)
        reference = np.stack([np.bincount(regions, points[:, i], count) for i in range(3)], axis=1) / sizes[:, None]
        reference[regions[flagged]] = points[flagged]
        distance = np.linalg.norm(points - reference[regions], axis=1)
        rows = np.flatnonzero(bare[regions])
        order = rows[np.lexsort((borders.tails[rows], -distance[rows], regions[rows]))]
        anchors[borders.tails[order[np.diff(regions[order], prepend=-1) > 0]]] = True
    return anchors


def farthest(mesh: Triangles, borders: Borders, chords: Chords) -> tuple[Floats, Ints]:
    """How far each border leaves its chord ``(n,)``, and the place in the borders where; -1 on chords of one edge."""
    sizes = chords.sizes
    chord = np.repeat(np.arange(len(sizes)), sizes)
    inner = np.ones(len(chord), dtype=bool)
    inner[chords.starts] = False
    rows, chord = chords.order[inner], chord[inner]
    start, end = mesh.positions[chords.ends[chord, 0]], mesh.positions[chords.ends[chord, 1]]
    vertex = borders.tails[rows]
    distance = segment_distance(mesh.positions[vertex], start, end)
    order = np.lexsort((vertex, -distance, chord))
    first = order[np.diff(chord[order], prepend=-1) > 0]
    gap, place = np.full(len(sizes), -1.0), np.full(len(sizes), -1)
    gap[chord[first]], place[chord[first]] = distance[first], rows[first]
    return gap, place


def segment_distance(points: Floats, start: Floats, end: Floats) -> Floats:
    """Distance ``(n,)`` of points from segments, all ``(n,3)``."""
    along = end - start
    length = np.einsum("ni,ni->n", along, along)
    t = np.einsum("ni,ni->n", points - start, along) / np.where(length > 0, length, 1.0)
    return np.linalg.norm(points - start - np.clip(t, 0, 1)[:, None] * along, axis=1)


def _leaves_its_border(
    mesh: Triangles, borders: Borders, chords: Chords, gap: Floats, tolerance: Tolerance
) -> Bools:
    first = chords.order[chords.starts]
    length = np.linalg.norm(mesh.positions[chords.ends[:, 1]] - mesh.positions[chords.ends[:, 0]], axis=1)
    closed = chords.ends[:, 0] == chords.ends[:, 1]
    bend = np.maximum(borders.bend[first], LEAST_BEND)
    sharp = np.add.reduceat(borders.sharp[chords.order].astype(np.int64), chords.starts) * 2 > chords.sizes
    allowed = np.where(sharp, tolerance.sharp, tolerance.smooth)
    # A gap that is rounding asks for nothing, however short the chord.
    rounding = 1e-9 * mesh.diagonal
    strays = (gap > rounding) & ((gap * bend > tolerance.share * length) | (gap > allowed))
    return (gap >= 0) & (strays | closed)


def _too_few(borders: Borders, chords: Chords, gap: Floats) -> Bools:
    """For every region with fewer than 3 chords: its chord that leaves its border most."""
    few = np.bincount(chords.regions, minlength=len(borders.offsets) - 1) < 3
    rows = np.flatnonzero(few[chords.regions])
    order = rows[np.lexsort((rows, -gap[rows], chords.regions[rows]))]
    split = np.zeros(len(gap), dtype=bool)
    split[order[np.diff(chords.regions[order], prepend=-1) > 0]] = True
    return split & (gap >= 0)


def _doubles(mesh: Triangles, borders: Borders, chords: Chords) -> Bools:
    """Chords whose two ends another, shorter chord joins already."""
    names = np.minimum.reduceat(borders.edges[chords.order], chords.starts)
    low, high = chords.ends.min(axis=1), chords.ends.max(axis=1)
    points = mesh.positions[mesh.tails[borders.half_edges]]
    steps = np.linalg.norm(points - mesh.positions[mesh.heads[borders.half_edges]], axis=1)
    length = np.add.reduceat(steps[chords.order], chords.starts)
    single = chords.sizes == 1
    # Both sides of a chord must come to one verdict, so the length is the smaller of the two sums.
    shared = np.full(int(names.max()) + 1, np.inf)
    np.minimum.at(shared, names, length)
    order = np.lexsort((names, shared[names], ~single, high, low))
    new_pair = (np.diff(low[order], prepend=-1) != 0) | (np.diff(high[order], prepend=-1) != 0)
    keeper = names[order][np.maximum.accumulate(np.where(new_pair, np.arange(len(order)), 0))]
    double = np.zeros(len(low), dtype=bool)
    double[order] = names[order] != keeper
    return double & ~single
