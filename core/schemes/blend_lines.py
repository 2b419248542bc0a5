"""Feature lines of the blending scheme: which edges are sharp at their ends, and which of them continue each other.

Creases, boundaries and marked corners cut the faces around a vertex into sectors. A crease that ends alone at a
vertex, a dart, does not count there. Two features that continue each other at a vertex share one parabola through it
and its two neighbors; any other leaves the vertex on a curve of its own. Source: Ko, Lee, Lim, Yoon, section IV, on
edges; the rest is ours (docs/blending.md).
"""

from __future__ import annotations

import numpy as np

from curvify.arrays import values_of
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import unit
from curvify.records import record
from curvify.sectors import BOUNDARY_TURN, CREASE_TURN
from curvify.topology import Topology, fans

#: Among three or more features at a vertex, two continue each other if they turn by less than this (degrees).
JUNCTION_TURN = 45.0
#: Straight edges continue each other only if they turn by no more than this (degrees).
IN_LINE = 0.01


@record
class Lines:
    """Features of a mesh with C corners and E edges.

    ``start (C,)``, ``end (C,)``: whether the edge of each half-edge is a feature where that starts and ends.
    ``partner (2E,)``: the edge end that continues each edge end, -1 for none; edge end 2e is the canonical start of
    edge e, 2e + 1 its end. ``fans (C,)`` the fan of each corner; ``counts (C,)`` how many features meet there: 1 at a
    dart, at least 3 at a marked corner. ``lone (E,)``: sharp edges without any effect, darts at both ends.
    """

    start: Bools
    end: Bools
    partner: Ints
    fans: Ints
    counts: Ints
    lone: Bools

    def around(self, topology: Topology) -> tuple[Ints, Ints]:
        """The features at each fan, by fan: a corner of the fan and the edge end, each ``(n,)``."""
        ends = start_ends(topology)
        opening = np.flatnonzero(self.start)
        closing = np.flatnonzero(topology.twin[topology.prev] < 0)
        corners = np.concatenate([opening, closing])
        features = np.concatenate([ends[opening], ends[topology.prev[closing]] ^ 1])
        order = np.lexsort((features, self.fans[corners]))
        return corners[order], features[order]


@record
class FeatureMarks:
    """What makes features: ``sharp (E,2)`` ends of edges, ``straight (E,)`` edges, ``corners (V,)``;
    ``boundary_corners``: whether boundaries may turn, and the only face at a boundary vertex keeps its corner.
    """

    sharp: Bools
    straight: Bools
    corners: Bools
    boundary_corners: bool = True


def start_ends(topology: Topology) -> Ints:
    """The edge end ``(C,)`` at which each half-edge starts; with the last bit turned, where it ends."""
    return 2 * topology.edge + ~topology.forward


def find_lines(topology: Topology, positions: Floats, marks: FeatureMarks) -> Lines:
    """Features from marks; boundaries are features."""
    ends = start_ends(topology)
    boundary = topology.twin < 0
    around = fans(topology)
    sharp_at = marks.sharp.reshape(-1)
    start, end = boundary | sharp_at[ends], boundary | sharp_at[ends ^ 1]
    last = boundary[topology.prev]  # where an open fan ends
    count = np.bincount(around, start, len(start)) + np.bincount(around, last, len(start))
    counts = count[around].astype(np.int64)
    marked = marks.corners[topology.vertices]
    every = marked & (counts < 2)
    start = (start & (counts != 1)) | every
    end = (end & (counts != 1)[topology.next]) | every[topology.next]
    effective = np.zeros(len(topology.edges), dtype=bool)
    effective[topology.edge[start | end]] = True
    counts[marked] = np.maximum(counts[marked], 3)
    partner = np.full(2 * len(topology.edges), -1)
    lines = Lines(start, end, partner, around, counts, marks.sharp.any(axis=1) & ~effective)
    _pair_in_fans(lines, topology, positions, marks)
    _pair_nonmanifold(lines, topology, positions, marks)
    return lines


def directions(topology: Topology, positions: Floats, ends: Ints) -> Floats:
    """Vector ``(n,3)`` along its edge from each of the edge ends ``(n,)``."""
    edges = topology.edges[ends >> 1]
    here = ends & 1
    rows = np.arange(len(ends))
    return positions[edges[rows, 1 - here]] - positions[edges[rows, here]]


def _pair_in_fans(lines: Lines, topology: Topology, positions: Floats, marks: FeatureMarks) -> None:
    """Join the features of each fan, straightest first."""
    corner, ends = lines.around(topology)
    fan = lines.fans[corner]
    open_fan = np.zeros(len(topology.vertices), dtype=bool)
    open_fan[lines.fans[topology.twin[topology.prev] < 0]] = True
    faces = np.bincount(lines.fans, minlength=len(open_fan))
    eligible = ~marks.corners[topology.vertices[corner]] & ~topology.nonmanifold[ends >> 1]
    if marks.boundary_corners:
        eligible &= ~(open_fan[fan] & (faces[fan] == 1))
    limit = np.where(open_fan[fan], BOUNDARY_TURN if marks.boundary_corners else 180.0, CREASE_TURN)
    count = np.bincount(fan)[fan]
    pairs: list[tuple[Ints, Ints, Floats]] = []
    for number in values_of(count[count > 1]):
        rows = np.flatnonzero(count == number).reshape(-1, number)
        one, other = np.triu_indices(number, 1)
        i, j = rows[:, one].reshape(-1), rows[:, other].reshape(-1)
        straight = marks.straight[ends >> 1]
        both = eligible[i] & eligible[j] & (straight[i] == straight[j])
        i, j = i[both], j[both]
        turn = _turns(topology, positions, ends[i], ends[j])
        most = np.where(straight[i], IN_LINE, limit[i] if number == 2 else JUNCTION_TURN)
        pairs.append((ends[i[turn <= most]], ends[j[turn <= most]], turn[turn <= most]))
    if pairs:
        _join(lines.partner, *(np.concatenate(part) for part in zip(*pairs, strict=True)))


def _turns(topology: Topology, positions: Floats, a: Ints, b: Ints) -> Floats:
    """Angle in degrees by which the line turns that passes from one edge end to another."""
    along, back = unit(directions(topology, positions, a)), unit(directions(topology, positions, b))
    cosine = -np.einsum("ni,ni->n", along, back)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _join(partner: Ints, a: Ints, b: Ints, turn: Floats) -> None:
    """Greedy matching of the edge ends ``a``, ``b``, straightest pairs first."""
    order = np.lexsort((np.maximum(a, b), np.minimum(a, b), turn))
    a, b = a[order], b[order]
    best = np.empty(len(partner), dtype=np.int64)
    while len(a):
        rank = np.arange(len(a))
        for ends in (a, b):
            best[ends] = len(a)
        for ends in (a, b):
            np.minimum.at(best, ends, rank)
        take = (best[a] == rank) & (best[b] == rank)
        partner[a[take]], partner[b[take]] = b[take], a[take]
        left = (partner[a] < 0) & (partner[b] < 0)
        a, b = a[left], b[left]


def _pair_nonmanifold(lines: Lines, topology: Topology, positions: Floats, marks: FeatureMarks) -> None:
    """Join the two edges of more than two faces at a vertex that has just two: all fans there share their line."""
    edges = np.flatnonzero(topology.nonmanifold & ~marks.straight)
    ends = np.concatenate([2 * edges, 2 * edges + 1])
    vertex = topology.edges.reshape(-1)[ends]
    order = np.argsort(vertex, kind="stable")
    ends, vertex = ends[order], vertex[order]
    two = (np.bincount(vertex, minlength=topology.vertex_count) == 2) & ~marks.corners
    a, b = ends[two[vertex]].reshape(-1, 2).T
    smooth = _turns(topology, positions, a, b) <= CREASE_TURN
    lines.partner[a[smooth]], lines.partner[b[smooth]] = b[smooth], a[smooth]


@record
class EndCurves:
    """Curves v + c1 t + c2 t^2 on which features leave their edge ends: ``values (n,3,3)`` as (v, c1, c2), and the
    ``row (2E,)`` of each edge end, -1 for those that are no feature.
    """

    values: Floats
    row: Ints

    def at(self, ends: Ints) -> Floats:
        """The curves ``(n,3,3)`` of features."""
        return self.values[self.row[ends]]


def end_curves(topology: Topology, positions: Floats, partner: Ints, ends: Ints) -> EndCurves:
    """Curves on which features leave their edge ends ``(n,)``.

    Two that continue each other: the parabola through both neighbors. Otherwise straight, but for the bend that the
    other end has, if it continues a line there.
    """

    def bends(ends: Ints) -> Floats:
        along = directions(topology, positions, ends)
        opposite = directions(topology, positions, partner[ends])
        return np.where((partner[ends] >= 0)[:, None], (along + opposite) / 2, 0.0)

    chord, paired = directions(topology, positions, ends), (partner[ends] >= 0)[:, None]
    bend = np.where(paired, bends(ends), bends(ends ^ 1))
    slope = np.where(paired, (chord - directions(topology, positions, partner[ends])) / 2, chord - bend)
    row = np.full(len(partner), -1)
    row[ends] = np.arange(len(ends))
    return EndCurves(np.stack([positions[topology.edges.reshape(-1)[ends]], slope, bend], axis=1), row)


def line_tangents(topology: Topology, positions: Floats, partner: Ints) -> Floats:
    """Unit tangent ``(2E,3)`` of the line at each edge end, along its edge, zero where none passes: that of the circle
    through the vertex and its neighbors on the line.
    """
    chord = directions(topology, positions, np.arange(len(partner)))
    square = np.einsum("ni,ni->n", chord, chord)[:, None]
    inverse = np.divide(chord, square, out=np.zeros_like(chord), where=square > 0)
    return np.where((partner >= 0)[:, None], unit(inverse - inverse[partner]), 0.0)
