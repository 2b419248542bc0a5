"""Edges of normal-based subdivision: where the middle of an edge goes, and its normal.

Source: van Overveld, Wyvill, "An algorithm for polygon subdivision based on vertex normals", sections 2.4 and 2.7, as
corrected in docs/triangles.md. An edge knows its two ends and their normals, nothing else; where an end has a normal on
each side, on a crease, the curve is perpendicular to both. Everything is elementwise, so that equal edges get equal
bits wherever they stand; rows ``(e,3)`` are fastest in memory column by column (``arrays.by_component``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curvify.arrays import cross
from curvify.mesh import Floats

EDGE_RULES = ("curvature", "stretched")
MIDPOINT_NORMALS = ("quad", "perp", "avg", "geometry")
#: A common perpendicular of two normals that advances along the edge by less than this cosine is no tangent.
LEAST_ADVANCE = 0.05


def dot(a: Floats, b: Floats) -> Floats:
    """Dot products ``(e,1)`` of rows ``(e,3)``, column by column; the middle one last, as numpy adds up single rows."""
    return (a[:, :1] * b[:, :1] + a[:, 2:] * b[:, 2:]) + a[:, 1:2] * b[:, 1:2]


def unit(vectors: Floats) -> Floats:
    """Rows ``(e,3)`` scaled to length 1; those without length stay zero."""
    length = np.sqrt(dot(vectors, vectors))
    length[length == 0] = 1.0
    return vectors / length


class EdgeCurves(NamedTuple):
    """Cubic edges ``(e,3)``: ends, and the multiples of the normals at the start and at the end that shape them."""

    start: Floats
    end: Floats
    pull: Floats
    push: Floats
    rule: str

    def middle(self) -> Floats:
        """Points ``(e,3)`` at 1/2: equations (4), (5) or (8), (9) put into the cubic."""
        share = 3 / 8 if self.rule == "curvature" else 3.0
        return (self.start + self.end) / 2 - share * (self.pull + self.push)

    def controls(self) -> tuple[Floats, Floats]:
        """The two inner Bezier points ``(e,3)``: equations (8), (9), or (4), (5)."""
        a, b, pull, push = self.start, self.end, self.pull, self.push
        if self.rule == "curvature":
            return (2 * a + b - 2 * pull - push) / 3, (a + 2 * b - pull - 2 * push) / 3
        return (3 * a + b) / 4 - 5 * pull - 3 * push, (a + 3 * b) / 4 - 3 * pull - 5 * push

    def tangent(self) -> Floats:
        """Directions ``(e,3)`` of the cubics at 1/2."""
        first, second = self.controls()
        return self.end - self.start + second - first


def solve_edges(start: Floats, end: Floats, n0: Floats, n3: Floats, rule: str) -> EdgeCurves:
    """Curves perpendicular to unit normals at their ends, of least curvature or as stretched as can be."""
    chord = end - start
    c, a, b = dot(n0, n3), dot(n0, chord), dot(n3, chord)
    if rule == "curvature":
        det = 4 - c * c
        return EdgeCurves(start, end, (2 * a + c * b) / det * n0, (-2 * b - c * a) / det * n3, rule)
    det = 4 * (25 - 9 * c * c)
    return EdgeCurves(start, end, (5 * a + 3 * c * b) / det * n0, (-5 * b - 3 * c * a) / det * n3, rule)


def solve_creases(start: Floats, end: Floats, pairs: Floats, others: Floats, rule: str) -> EdgeCurves:
    """Curves perpendicular to the normals of both sides at their ends: ``pairs``, ``others (e,2,3)``.

    With P, Q the projections onto the normals at the start and the end, the multipliers A and B of the normals are the
    solution of 2 A + P B = P d, Q A + 2 B = -Q d (curvature), or 5 A + 3 P B = P d/4, 3 Q A + 5 B = -Q d/4.
    """
    chord = end - start
    p, q = (_normal_space(chord, pairs[:, k], others[:, k]) for k in (0, 1))
    own, across, share = (2.0, 1.0, 1.0) if rule == "curvature" else (5.0, 3.0, 0.25)
    pd, qd = (share * (matrix @ chord[..., None]) for matrix in (p, q))
    system = own * own * np.eye(3) - across * across * (q @ p)
    push = np.linalg.solve(system, -own * qd - across * (q @ pd))
    pull = (pd - across * (p @ push)) / own
    return EdgeCurves(start, end, pull[..., 0], push[..., 0], rule)


def _normal_space(chord: Floats, one: Floats, other: Floats) -> Floats:
    """Projections ``(e,3,3)`` onto the span of two normals, or onto their mean where the edge cannot be across both."""
    mean = unit(one + other)
    mean = np.where(mean.any(axis=1, keepdims=True), mean, one)
    apart = unit(one - other)
    along = unit(cross(one, other))
    apart = np.where(np.abs(dot(along, unit(chord))) < LEAST_ADVANCE, 0.0, apart)
    return mean[:, :, None] * mean[:, None] + apart[:, :, None] * apart[:, None]


def middle_normals(curves: EdgeCurves, n0: Floats, n3: Floats, kind: str) -> Floats:
    """Unit normals ``(e,3)`` of one side at the middles of edges.

    ``quad``: the paper's quadratic interpolation, its factor 3 for least curvature, 8/3 for stretched edges;
    ``perp``: the mean across the curve; ``avg``: the mean. ``geometry`` begins with ``quad``.
    """
    total = n0 + n3
    if kind == "avg":
        result = unit(total)
    else:
        if kind == "perp":
            away, factor = curves.tangent(), 1.0
        else:
            away, factor = curves.end - curves.start, 1.5 if curves.rule == "curvature" else 4 / 3
        square = dot(away, away)
        result = unit(total - factor * dot(total, away) / np.where(square > 0, square, 1.0) * away)
    lost = np.flatnonzero(~result.any(axis=1))
    if len(lost):
        mean = unit(total[lost])
        result[lost] = np.where(mean.any(axis=1, keepdims=True), mean, n0[lost])
    return result + 0.0  # no negative zeros, for equal bytes
