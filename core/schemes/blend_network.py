"""A quad mesh with its charts: what the blending surface is evaluated from, inside faces and along edges.

Along an edge only the charts of its ends have a say, and only the coefficients along the edge and of the first
derivative across it. Source: Ko, Lee, Lim, Yoon, equations (1) and (5); how the edges follow is ours
(docs/blending.md).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from curvify.arrays import cross, distinct, unit_rows
from curvify.mesh import Floats, Ints
from curvify.records import record
from curvify.schemes.base import Basis, Form, KiteForms, LinearControls, linear_basis
from curvify.schemes.blend_basis import ACROSS, ALONG, COLUMNS, corner_jets, edge_jets, face_jets
from curvify.schemes.blend_charts import Charts
from curvify.schemes.blend_lines import EndCurves, start_ends
from curvify.schemes.quads import Quads
from curvify.topology import Topology

#: Squared sine below which the derivatives along and across an edge count as parallel.
PARALLEL = 1e-20
#: How far inside a face its normal is taken where its edge has none.
NUDGE = 1e-4


@record
class Network:
    """Quads, their charts and the order of the blending function."""

    quads: Quads
    charts: Charts
    order: int

    def kite_forms(self, topology: Topology, patches: Ints) -> KiteForms:
        """The surface over some patches ``(f,)`` of one size."""
        first = topology.offsets[patches]
        kites = self.quads.kites[first[:, None] + np.arange(topology.sizes[patches[0]])]
        families = self.charts.families[self.charts.rings.chart[kites]]
        count = len(self.charts.exponents)
        keys = families.reshape(-1, 4) @ count ** np.arange(4)
        chosen, which = distinct(keys)
        forms = [self._form(tuple(int(key // count**i % count) for i in range(4))) for key in chosen]
        return KiteForms(forms, which.reshape(families.shape[:2]), first, self)

    def _form(self, families: tuple[int, ...]) -> Form:
        exponents = tuple((float(a), float(b)) for a, b in self.charts.exponents[list(families)])
        extent = self.quads.extent
        basis = partial(_kite_basis, self.order, exponents, extent)
        return Form(("blend", self.order, extent, exponents), basis, self.controls, points=4)

    def controls(self, corners: Ints) -> LinearControls:
        """Controls of the kites at some corners of the patches ``(f,)``: the columns of ``face_jets``."""
        coefficients = self.charts.at(self.quads.kites[corners]).reshape(len(corners), 36, 3)
        return LinearControls(np.ascontiguousarray(np.moveaxis(coefficients[:, COLUMNS], -1, 0)))

    def face_jets(self, corners: Ints, uv: Floats) -> Floats:
        """Jets ``(3,n,3)`` at one point ``uv (n,2)`` of each of some quads, given by all ``corners (n,4)`` from the one
        at (0, 0) on; for few points: no tables.
        """
        u, v = uv[:, 0], uv[:, 1]
        places = (u, v), (v, 1 - u), (1 - u, 1 - v), (1 - v, u)
        total = np.zeros((3, len(uv), 3))
        for i, (x, y) in enumerate(places):
            a, b = self.charts.exponents_at(corners[:, i]).T
            jets = np.einsum("osq,qsc->oqc", corner_jets(self.order, a, b, x, y), self.charts.at(corners[:, i]))
            by_u, by_v = ((1, 2), (-2, 1), (-1, -2), (2, -1))[i]
            total[0] += jets[0]
            total[1] += np.sign(by_u) * jets[abs(by_u)]
            total[2] += np.sign(by_v) * jets[abs(by_v)]
        return total


def _kite_basis(
    order: int, exponents: tuple[tuple[float, float], ...], extent: float, points: Floats
) -> Basis:
    jets = face_jets(order, exponents, extent * points)
    jets[1:] *= extent
    return linear_basis(jets)


@record
class BlendEdges:
    """Edges of a blending surface; each is one or two edges of its quads.

    ``corners (2Q,)`` and ``further (2Q,)``: a corner at each edge end of the quads, and how many places on in its chart
    the edge lies; ``curves`` of the features, if all faces there share them; ``ends (E,2p)`` the quads' edge ends that
    each edge passes, in canonical direction; ``half_edges (N,)`` the half-edge of each normal field. ``corner_normals
    (C,3)``: unit normals of the faces' corners, for where the surface has none.
    """

    network: Network
    topology: Topology
    corners: Ints
    further: Ints
    curves: EndCurves | None
    ends: Ints
    half_edges: Ints
    corner_normals: Floats

    def points(self, edges: Ints, t: Floats) -> Floats:
        """Points ``(3,e,m)``."""
        result = np.empty((3, len(edges), t.shape[-1]))
        for piece, rows, columns, x in self._pieces(len(edges), t):
            ends = self.ends[edges[rows]]
            first, last = self._terms(ends[:, 2 * piece], x), self._terms(ends[:, 2 * piece + 1], 1 - x)
            result[:, rows[:, None], columns] = first[0] + last[0]
        return result

    def pieces(self, t: Floats) -> tuple[Ints, Floats]:
        """The piece of an edge on which each ``t (...)`` lies, and where on it."""
        count = self.ends.shape[1] // 2
        which = np.minimum((t * count).astype(np.int64), count - 1)
        return which, count * t - which

    def _pieces(self, count: int, t: Floats) -> list[tuple[int, Ints, Ints, Floats]]:
        """For each piece of the edges: its number, rows and columns of samples that lie in it, and where on it."""
        which, x = self.pieces(t)
        found: list[tuple[int, Ints, Ints, Floats]] = []
        for piece in range(self.ends.shape[1] // 2):
            if t.ndim == 1:
                rows, columns = np.arange(count), np.flatnonzero(which == piece)
                places = x[columns]
            else:
                rows, columns = np.flatnonzero(which[:, 0] == piece), np.arange(1)
                places = x[rows]
            if len(rows) and len(columns):
                found.append((piece, rows, columns, places))
        return found

    def _terms(self, ends: Ints, x: Floats) -> tuple[Floats, Floats]:
        """What the charts at edge ends ``(e,)`` add at the distance ``x`` from them: values and derivatives by x."""
        charts, corners = self.network.charts, self.corners[ends]
        values, slopes, _ = edge_jets(self.network.order, charts.exponents_at(corners)[:, :1], x)
        rays = charts.at(corners, self.further[ends], ALONG)
        if self.curves is not None:
            known = np.flatnonzero(self.curves.row[ends] >= 0)
            rays[known] = self.curves.at(ends[known])
        rays = np.moveaxis(rays, -1, 0)
        return _combine(rays, values), _combine(rays, slopes)

    def normals(self, fields: Ints, t: Floats) -> Floats:
        """Unit normals ``(3,e,m)``."""
        half_edges = self.half_edges[fields]
        result = np.empty((3, len(fields), t.shape[-1]))
        for piece, rows, columns, x in self._pieces(len(fields), t):
            result[:, rows[:, None], columns] = self._piece_normals(half_edges[rows], piece, x)
        return result

    def _piece_normals(self, half_edges: Ints, piece: int, x: Floats) -> Floats:
        """Normals ``(3,h,m)`` of the faces of some half-edges at places ``x`` of a piece of their edges."""
        topology, network = self.topology, self.network
        forward = topology.forward[half_edges][:, None]
        ends = self.ends[topology.edge[half_edges]]
        along = self._terms(ends[:, 2 * piece], x)[1] - self._terms(ends[:, 2 * piece + 1], 1 - x)[1]
        sides = network.quads.sides[half_edges]
        side = np.where(forward[:, 0], sides[:, piece], sides[:, -1 - piece])
        there = network.quads.topology.next[side]
        along_side = np.where(forward, x, 1 - x)
        across = self._across(side, 0, along_side) - self._across(there, 1, 1 - along_side)
        normal = cross(along, across, axis=0) * np.where(forward, 1.0, -1.0)
        square = np.einsum("cem,cem->em", normal, normal)
        speeds = np.einsum("cem,cem->em", along, along) * np.einsum("cem,cem->em", across, across)
        row, column = np.nonzero(~(square > PARALLEL * speeds))
        if len(row):
            at = np.broadcast_to(along_side, square.shape)[row, column]
            normal[:, row, column] = self._nudged(half_edges[row], side[row], at)
        return unit_rows(normal)

    def _across(self, corners: Ints, further: int, x: Floats) -> Floats:
        """Derivative ``(3,h,m)`` to the left that a corner's chart adds, at the distance ``x (h,m)`` from it along its
        first side, or with ``further`` = 1 along its second.
        """
        a, b = self.network.charts.exponents_at(corners).T
        jets = edge_jets(self.network.order, a[:, None], x)[2]
        rays = self.network.charts.at(corners, further, ACROSS) * b[:, None, None]
        return _combine(np.moveaxis(rays, -1, 0), jets)

    def _nudged(self, half_edges: Ints, sides: Ints, x: Floats) -> Floats:
        """Normals ``(3,n)`` a little inside the faces; where there are none either, those of the faces' corners."""
        following = self.network.quads.topology.next
        around = [sides]
        for _ in range(3):
            around.append(following[around[-1]])
        corners = np.stack(around, axis=1)
        inside = np.stack([np.clip(x, NUDGE, 1 - NUDGE), np.full_like(x, NUDGE)], axis=1)
        _, by_u, by_v = self.network.face_jets(corners, inside)
        normal = cross(by_u, by_v)
        square = (normal**2).sum(axis=1)
        none = ~(square > PARALLEL * (by_u**2).sum(axis=1) * (by_v**2).sum(axis=1))
        normal[none] = (self.corner_normals[half_edges] + self.corner_normals[self.topology.next[half_edges]])[none]
        return normal.T


def _combine(rays: Floats, jets: Floats) -> Floats:
    """Sum ``(3,e,m)`` of three vectors ``(3,e,3)`` times functions ``(e,m,3)``, elementwise."""
    total = rays[..., 0, None] * jets[..., 0]
    for j in (1, 2):
        total += rays[..., j, None] * jets[..., j]
    return total


def blend_edges(
    network: Network,
    topology: Topology,
    first: Ints,
    half_edges: Ints,
    curves: EndCurves | None,
    corner_normals: Floats,
) -> BlendEdges:
    """Edges of the patches' ``topology``; ``first (E,)`` half-edge of each, ``half_edges (N,)`` of the normal fields.

    ``curves`` replace the coefficients at features, so that all faces there share their bits.
    """
    base = network.quads.topology
    starts = start_ends(base)
    ends = starts ^ 1
    corners, further = np.empty((2, 2 * len(base.edges)), dtype=np.int32)
    boundary = np.flatnonzero(base.twin < 0)  # where they end no half-edge starts
    corners[ends[boundary]], further[ends[boundary]] = base.next[boundary], 1
    corners[starts], further[starts] = np.arange(len(starts)), 0
    sides = network.quads.sides[first]
    passed = np.stack([starts[sides], ends[sides]], axis=2).reshape(len(first), -1)
    passed = np.where(topology.forward[first][:, None], passed, passed[:, ::-1])
    return BlendEdges(network, topology, corners, further, curves, passed, half_edges, corner_normals)
