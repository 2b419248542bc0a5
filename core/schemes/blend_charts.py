"""Charts of the blending scheme: one around every smooth vertex, one for every sector at a feature.

A chart lists the faces around its vertex counter-clockwise; the face at place h has its coordinates turned by h times
the chart's step. Source: Ko, Lee, Lim, Yoon, section III.1; polar charts and sectors are ours (docs/blending.md).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from curvify.arrays import by_component, distinct, ranking, take_rows, values_of
from curvify.mesh import Bools, Floats, Ints
from curvify.records import record
from curvify.schemes.blend_basis import EXPONENTS, turning
from curvify.schemes.blend_lines import start_ends
from curvify.topology import Topology

#: Kinds of charts. ``POINT`` and ``CURVE`` are the paper's local geometries at features.
CONFORMAL, POLAR, HALF, NARROW, WIDE, POINT, CURVE = range(7)
#: Opening angle of the sectors.
OPENING = {HALF: np.pi, NARROW: np.pi / 2, WIDE: 1.5 * np.pi}
#: Valences for which ``auto`` takes the paper's conformal charts: the others are smoother, or more even, polar.
CONFORMAL_VALENCES = (3, 6)


@record
class Rings:
    """Charts as runs of corners: the faces of chart i are those of the corners
    ``corners[offsets[i]:offsets[i+1]]``, counter-clockwise; ``chart (C,)`` and ``place (C,)`` of each corner.
    """

    offsets: Ints
    corners: Ints
    chart: Ints
    place: Ints

    @property
    def sizes(self) -> Ints:
        """Faces of each chart ``(N,)``."""
        return np.diff(self.offsets)

    @property
    def first(self) -> Ints:
        """First corner of each chart ``(N,)``."""
        return self.corners[self.offsets[:-1]]

    @property
    def last(self) -> Ints:
        """Last corner of each chart ``(N,)``."""
        return self.corners[self.offsets[1:] - 1]

    def of(self, charts: Ints) -> Iterator[tuple[Ints, Ints]]:
        """Some of the charts ``(n,)`` by their number of faces, with their corners ``(n,m)``."""
        sizes = self.sizes[charts]
        for size in values_of(sizes):
            same = charts[sizes == size]
            yield same, self.corners[self.offsets[same][:, None] + np.arange(size)]


def find_rings(topology: Topology, fans: Ints, cut: Bools) -> Rings:
    """Runs of corners around vertices, cut at the half-edges ``cut (C,)`` that start there and at boundaries.

    ``fans (C,)`` are the labels of ``topology.fans``. Runs all around a vertex start at its first corner.
    """
    following = topology.twin[topology.prev]
    steps = np.where((following < 0) | cut[following], -1, following)
    chart, place = np.full(len(cut), -1), np.zeros(len(cut), dtype=np.int64)
    begins = np.flatnonzero(cut | (topology.twin < 0))
    _walk(steps, begins, chart, place, 0)
    around = np.flatnonzero((chart < 0) & (fans == np.arange(len(cut))))
    _walk(steps, around, chart, place, len(begins))
    sizes = np.bincount(chart)
    order = ranking(chart * int(sizes.max(initial=1)) + place)
    return Rings(np.concatenate([[0], np.cumsum(sizes)]), order, chart, place)


def _walk(following: Ints, corners: Ints, chart: Ints, place: Ints, number: int) -> None:
    """Number the charts that begin at some corners from ``number`` on; as many steps as the longest has faces."""
    here, charts, step = corners, number + np.arange(len(corners)), 0
    while len(here):
        chart[here], place[here] = charts, step
        here, step = following[here], step + 1
        left = here >= 0
        left[left] = chart[here[left]] < 0
        here, charts = here[left], charts[left]


@record
class Charts:
    """Charts with their local geometry.

    ``rings`` of the corners; ``kinds (N,)`` of the charts; ``families (N,)`` index ``exponents (K,2)``, the A and B of
    the chart maps; ``coefficients (N,9,3)`` of the polynomials, as far as they are fitted. The corner at place h of a
    chart is turned by ``matrices[starts[family] + h] (9,9)``.
    """

    rings: Rings
    kinds: Ints
    families: Ints
    exponents: Floats
    coefficients: Floats
    starts: Ints
    matrices: Floats

    def at(self, corners: Ints, further: int | Ints = 0, wanted: Sequence[int] = range(9)) -> Floats:
        """The ``wanted`` coefficients ``(...,w,3)`` in the coordinates of the faces at ``corners (...)``, ``further``
        places on.

        Elementwise: a corner gets the same bits wherever it stands. A coefficient turns with those of its degree only.
        """
        chart = self.rings.chart[corners]
        turn = (self.starts[self.families[chart]] + self.rings.place[corners] + further).reshape(-1)
        chart = chart.reshape(-1)
        own = by_component(take_rows(self.coefficients.reshape(-1, 27), chart)).T.reshape(9, 3, -1)
        result = np.empty((len(wanted), 3, len(chart)))
        for slot, into in enumerate(wanted):
            a, b = EXPONENTS[into]
            result[slot] = 0.0
            for source, (i, j) in enumerate(EXPONENTS):
                if i + j == a + b:
                    result[slot] += self.matrices[:, into, source][turn] * own[source]
        return result.transpose(2, 0, 1).reshape(*corners.shape, len(wanted), 3)

    def exponents_at(self, corners: Ints) -> Floats:
        """A and B ``(...,2)`` of the charts at corners."""
        return self.exponents[self.families[self.rings.chart[corners]]]

    @property
    def smooth(self) -> Bools:
        """Charts ``(N,)`` of smooth vertices."""
        return self.kinds <= POLAR


def make_charts(rings: Rings, kinds: Ints) -> Charts:
    """Charts of the given kinds ``(N,)``, their vertex as the only coefficient yet."""
    widest = int(rings.sizes.max()) + 1
    families, family = distinct(kinds * widest + rings.sizes)
    exponents = np.array([chart_exponents(int(key // widest), int(key % widest)) for key in families])
    places = families % widest + 1
    starts = np.cumsum(places) - places
    step = np.repeat(exponents[:, 1] * np.pi / 2, places)
    matrices = turning(step * (np.arange(len(step)) - np.repeat(starts, places)))
    coefficients = np.zeros((len(kinds), 9, 3))
    return Charts(rings, kinds, family, exponents, coefficients, starts, matrices)


def chart_exponents(kind: int, faces: int) -> tuple[float, float]:
    """A and B of the chart map."""
    if kind == CONFORMAL:
        return 4 / faces, 4 / faces
    if kind == POLAR:
        return 1.0, 4 / faces
    if kind in OPENING:
        return 1.0, 2 * OPENING[kind] / np.pi / faces
    return 1.0, 1.0


def smooth_kinds(sizes: Ints, chart: str) -> Ints:
    """Kind of the charts of smooth vertices with ``sizes (n,)`` faces: ``auto``, ``conformal`` or ``polar``."""
    if chart == "auto":
        low, high = CONFORMAL_VALENCES
        return np.where((sizes >= low) & (sizes <= high), CONFORMAL, POLAR)
    return np.full(len(sizes), {"conformal": CONFORMAL, "polar": POLAR}[chart])


def sector_kinds(topology: Topology, positions: Floats, rings: Rings, charts: Ints, partner: Ints) -> Ints:
    """Kind of each of some sectors ``(n,)``: half a plane between features that continue each other, else a wedge."""
    ends = start_ends(topology)
    first, last = ends[rings.first[charts]], ends[topology.prev[rings.last[charts]]] ^ 1
    through = partner[first] == last
    angle = np.bincount(rings.chart, corner_angles(topology, positions))
    return np.where(through, HALF, np.where(angle[charts] < np.pi, NARROW, WIDE))


def corner_angles(topology: Topology, positions: Floats) -> Floats:
    """Angle ``(C,)`` between the two sides at each corner, at most pi."""
    points = positions[topology.vertices]
    ahead = points[topology.next] - points
    back = points[topology.prev] - points
    sine = np.linalg.norm(np.cross(ahead, back), axis=1)
    return np.arctan2(sine, np.einsum("ci,ci->c", ahead, back))
