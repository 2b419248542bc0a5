"""Meshes between the passes of normal-based subdivision, and the middles of their edges.

Source: van Overveld, Wyvill, sections 2.3 and 3.2. What becomes of the triangles is in ``overveld_children``.

A *wedge* is a vertex with one of its normals and what else it carries: wedge w below the number of vertices belongs to
vertex w, later ones repeat vertices, in their order, for the other side of a crease or seam.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from curvify.arrays import by_component, cross, take_rows
from curvify.mesh import Bools, Floats, Ints
from curvify.records import record
from curvify.schemes.overveld_edges import EdgeCurves, middle_normals, solve_creases, solve_edges, unit

#: Edges or faces that are worked on together: their work arrays stay in cache, and small beside the mesh.
WINDOW = 1 << 15


class Rules(NamedTuple):
    """How an edge is bent, ``edge_rule``, and its middle shaded, ``midpoint_normal``; how long edges may be."""

    edge_rule: str
    midpoint_normal: str
    max_edge: float | None

    def split(self, positions: Floats, edges: Ints) -> Bools:
        """Which edges ``(E,)`` are split."""
        if self.max_edge is None:
            return np.ones(len(edges), dtype=bool)
        chord = positions[edges[:, 1]] - positions[edges[:, 0]]
        return np.einsum("ei,ei->e", chord, chord) > self.max_edge**2


@record
class Triangles:
    """A triangle mesh between two passes.

    ``positions (V,3)``; ``values (W,3+c)`` of the wedges: unit normal, then what is carried; ``repeats (W-V,)`` the
    vertex of each wedge beyond the vertices. ``faces``, ``wedges``, ``face_edges (F,3)``: vertices and wedges of the
    corners, and the edge from each corner to the next; ``edges (E,2)`` in canonical direction, by (smaller id, larger
    id). ``source_faces (F,)`` of the input.
    """

    positions: Floats
    values: Floats
    repeats: Ints
    faces: Ints
    wedges: Ints
    face_edges: Ints
    edges: Ints
    source_faces: Ints

    def sides(self) -> EdgeSides:
        """The sides of the edges."""
        edge = self.face_edges.reshape(-1)
        if not len(self.repeats):
            return plain_sides(self.edges, edge)
        heads = np.roll(self.wedges, -1, axis=1).reshape(-1)
        return edge_sides(self.edges, edge, self.faces.reshape(-1), self.wedges.reshape(-1), heads)


@record
class EdgeSides:
    """Sides of the edges: ``pairs (N,2)`` wedges at the two ends in canonical direction, the first E those of the
    edges' first half-edges, then, for half-edges with other wedges, their own, of ``extra (N-E,)`` edges, ascending.
    ``of_half_edges (C,)`` the side of each half-edge. ``creases (k,)`` are edges with two different sides and ``others
    (k,2)`` the wedges of the second.
    """

    pairs: Ints
    extra: Ints
    of_half_edges: Ints
    creases: Ints
    others: Ints


def plain_sides(edges: Ints, edge: Ints) -> EdgeSides:
    """The sides of ``edges (E,2)`` where every vertex has one wedge: one for both, of the ``edge (C,)`` of each
    half-edge.
    """
    none = np.zeros(0, dtype=np.int64)
    return EdgeSides(edges, none, edge, none, none.reshape(0, 2))


def edge_sides(edges: Ints, edge: Ints, tails: Ints, wedges: Ints, heads: Ints) -> EdgeSides:
    """The sides of ``edges (E,2)``.

    Of each half-edge: its ``edge``, the vertex where it starts and the wedges there and at its end, ``tails``,
    ``wedges``, ``heads (C,)``.
    """
    forward = tails == edges[edge, 0]
    own = np.stack([np.where(forward, wedges, heads), np.where(forward, heads, wedges)], axis=1)
    pairs = np.empty((len(edges), 2), dtype=np.int64)
    pairs[edge[::-1]] = own[::-1]
    differs = np.flatnonzero((own != pairs[edge]).any(axis=1))
    differs = differs[np.argsort(edge[differs], kind="stable")]
    sides = edge.copy()
    sides[differs] = len(edges) + np.arange(len(differs))
    extra = edge[differs]
    last = np.flatnonzero(np.append(extra[1:] != extra[:-1], len(extra) > 0))
    return EdgeSides(np.concatenate([pairs, own[differs]]), extra, sides, extra[last], own[differs[last]])


def solve_sides(
    positions: Floats, values: Floats, edges: Ints, sides: EdgeSides, rows: Ints, rule: str
) -> tuple[EdgeCurves, Floats, Floats]:
    """Curves of the sides ``rows (r,)``, and the values ``(r,3+c)`` at their two ends; one curve for all sides of an
    edge.
    """
    edge = rows
    if len(sides.extra):
        edge = np.concatenate([np.arange(len(edges)), sides.extra])[rows]
    start, end = (by_component(take_rows(positions, edges[edge, i])) for i in range(2))
    one, other = (by_component(take_rows(values, sides.pairs[rows, i])) for i in range(2))
    curves = solve_edges(start, end, one[:, :3], other[:, :3], rule)
    place = np.minimum(np.searchsorted(sides.creases, edge), len(sides.creases) - 1)
    bent = np.flatnonzero(sides.creases[place] == edge) if len(sides.creases) else place[:0]
    if len(bent):
        pairs, others = values[sides.pairs[edge[bent]], :3], values[sides.others[place[bent]], :3]
        solved = solve_creases(start[bent], end[bent], pairs, others, rule)
        curves.pull[bent], curves.push[bent] = solved.pull, solved.push
    return curves, one, other


def middles(
    positions: Floats, values: Floats, edges: Ints, sides: EdgeSides, rows: Ints, rules: Rules
) -> tuple[Floats, Floats]:
    """Positions ``(r,3)`` and values ``(r,3+c)`` in the middle of the edges of the sides ``rows (r,)``."""
    curves, one, other = solve_sides(positions, values, edges, sides, rows, rules.edge_rule)
    value = (one + other) / 2
    value[:, :3] = middle_normals(curves, one[:, :3], other[:, :3], rules.midpoint_normal)
    return curves.middle(), value


class Wedges(NamedTuple):
    """The wedges in the middle of edges after a pass: ``of_sides (N,)`` those of the sides (-1: not split); ``kept
    (k,)`` sides have one beyond the vertices, with ``values (k,3+c)``; it repeats the middle of the edges ``repeated
    (k,)``.
    """

    of_sides: Ints
    kept: Ints
    values: Floats
    repeated: Ints


def middle_wedges(
    positions: Floats,
    values: Floats,
    edges: Ints,
    sides: EdgeSides,
    numbers: Ints,
    first: int,
    rules: Rules,
) -> Wedges:
    """Number the wedges in the middle of edges: ``numbers (E,)`` are the vertices there (-1: not split), wedges beyond
    the vertices count from ``first``. Sides whose values agree in the middle share one.
    """
    of_sides = np.concatenate([numbers, numbers[sides.extra]]) if len(sides.extra) else numbers
    rows = len(edges) + np.flatnonzero(numbers[sides.extra] >= 0)
    if not len(rows):
        return Wedges(of_sides, rows, values[:0], rows)
    edge = sides.extra[rows - len(edges)]
    own = middles(positions, values, edges, sides, rows, rules)[1]
    base = middles(positions, values, edges, sides, edge, rules)[1]
    before = np.concatenate([base[:1], own[:-1]])
    fresh = (own != base).any(axis=1)
    again = np.concatenate([[False], edge[1:] == edge[:-1]]) & (own == before).all(axis=1)
    of_sides[rows[fresh]] = first + np.cumsum(~again[fresh]) - 1
    kept = fresh & ~again
    return Wedges(of_sides, rows[kept], own[kept], edge[kept])


def windows(count: int) -> Iterator[slice]:
    """Stretches of ``count`` things that are worked on together."""
    for first in range(0, count, WINDOW):
        yield slice(first, min(first + WINDOW, count))


class FaceNormals:
    """Normals of wedges from the triangles around them, weighted by area: their sums, ``total (3,W)``."""

    def __init__(self, wedges: int) -> None:
        self.total = np.zeros((3, wedges))

    def add(self, positions: Floats, faces: Ints, wedges: Ints) -> None:
        """Add some triangles: their vertices and wedges ``(f,3)``. They come in the order of the mesh."""
        corners = [by_component(take_rows(positions, faces[:, i])) for i in range(3)]
        area = cross(corners[1] - corners[0], corners[2] - corners[0])
        for i in range(3):
            np.add.at(self.total[i], wedges.reshape(-1), np.repeat(area[:, i], 3))

    def store(self, values: Floats, first: int) -> None:
        """Replace the normals in the values ``(w,3+c)`` of the wedges from ``first`` on, but where triangles cancel."""
        for part in windows(len(values)):
            normals = unit(self.total[:, first + part.start : first + part.stop].T)
            there = (normals != 0).any(axis=1)
            values[part, :3] = np.where(there[:, None], normals, values[part, :3])
