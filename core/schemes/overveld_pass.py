"""One pass of normal-based subdivision over triangles: every edge that is to be split gets its middle.

A triangle with 0, 1, 2 or 3 split edges becomes as many triangles and one more. Which edges the new triangles have
follows from the old ones: nothing is searched for. Source: van Overveld, Wyvill, sections 2.3, 2.5 and 3.2.

A *wedge* is a vertex with one of its normals and what else it carries: wedge w below the number of vertices belongs to
vertex w, later ones repeat vertices, in their order, for the other side of a crease or seam.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from curvify.arrays import cross, values_of
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import sum_by, unit
from curvify.records import record
from curvify.schemes.overveld_edges import EdgeCurves, middle_normals, solve_creases, solve_edges
from curvify.topology import canonical_direction


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
        heads = np.roll(self.wedges, -1, axis=1).reshape(-1)
        half_edges = (self.face_edges, self.faces, self.wedges)
        edge, tails, wedges = (array.reshape(-1) for array in half_edges)
        return edge_sides(self.edges, edge, tails, wedges, heads, not len(self.repeats))


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


def edge_sides(edges: Ints, edge: Ints, tails: Ints, wedges: Ints, heads: Ints, smooth: bool) -> EdgeSides:
    """The sides of ``edges (E,2)``.

    Of each half-edge: its ``edge``, the vertex where it starts and the wedges there and at its end, ``tails``,
    ``wedges``, ``heads (C,)``. ``smooth``: no vertex has several wedges.
    """
    if smooth:
        none = np.zeros(0, dtype=np.int64)
        return EdgeSides(edges, none, edge, none, none.reshape(0, 2))
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
    start, end = positions[edges[edge, 0]], positions[edges[edge, 1]]
    one, other = values[sides.pairs[rows, 0]], values[sides.pairs[rows, 1]]
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
    of_sides = np.concatenate([numbers, numbers[sides.extra]])
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


# --- connectivity ---------------------------------------------------------------------------------------------

# Corners of a triangle are nodes 0 to 2, the middle of side i is node 3 + i. Edges: 2 i and 2 i + 1 are the halves of
# side i, 6 + i the whole of it, from 9 on come those inside.


#: Diagonals whose squared lengths agree to this share are equally long.
EQUAL = 1e-9


class Template(NamedTuple):
    """Triangles ``nodes (t,3)`` with ``edges (t,3)``, and the ``inner (j,2)`` nodes of the edges inside."""

    nodes: Ints
    edges: Ints
    inner: Ints


@lru_cache(maxsize=16)
def template(mask: int, turned: bool = False) -> Template:
    """How a triangle is cut whose side i is split where bit i of ``mask`` is set.

    Two split sides leave a quad, which is cut from its first corner, or, ``turned``, from its second.
    """
    count = mask.bit_count()
    if count in (0, 3):
        nodes = [[0, 1, 2]] if not count else [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]
        edges = [[6, 7, 8]] if not count else [[0, 9, 5], [1, 2, 10], [11, 3, 4], [10, 11, 9]]
        inner = [] if not count else [[3, 5], [3, 4], [4, 5]]
        return _turned_template(nodes, edges, inner, 0)
    if count == 1:
        return _turned_template([[0, 3, 2], [3, 1, 2]], [[0, 9, 8], [1, 7, 9]], [[3, 2]], mask.bit_length() - 1)
    first = {3: 0, 6: 1, 5: 2}[mask]
    if turned:
        nodes, edges = [[3, 1, 4], [0, 3, 2], [3, 4, 2]], [[1, 2, 9], [0, 10, 8], [9, 3, 10]]
        return _turned_template(nodes, edges, [[3, 4], [3, 2]], first)
    nodes, edges = [[3, 1, 4], [0, 3, 4], [0, 4, 2]], [[1, 2, 9], [0, 9, 10], [10, 3, 8]]
    return _turned_template(nodes, edges, [[3, 4], [0, 4]], first)


def _turned_template(nodes: list[list[int]], edges: list[list[int]], inner: list[list[int]], by: int) -> Template:
    """A template for side 0 turned to side ``by``."""
    node = np.array([(i + by) % 3 for i in range(3)] + [3 + (i + by) % 3 for i in range(3)])
    halves = [2 * ((i // 2 + by) % 3) + i % 2 for i in range(6)]
    edge = np.array(halves + [6 + (i + by) % 3 for i in range(3)] + [9, 10, 11])
    return Template(node[nodes], edge[edges], node[np.array(inner, dtype=np.int64).reshape(-1, 2)])


def subdivide(mesh: Triangles, rules: Rules) -> Triangles | None:
    """The mesh after one pass, None if no edge is to be split."""
    split = rules.split(mesh.positions, mesh.edges)
    if not split.any():
        return None
    sides = mesh.sides()
    before, plain = len(mesh.positions), int(split.sum())
    position, value = middles(mesh.positions, mesh.values, mesh.edges, sides, np.flatnonzero(split), rules)
    numbers = np.where(split, before + np.cumsum(split) - 1, -1)  # the vertex in the middle of each split edge
    first = before + plain + len(mesh.repeats)
    extra = middle_wedges(mesh.positions, mesh.values, mesh.edges, sides, numbers, first, rules)
    positions = np.concatenate([mesh.positions, position])
    corners = np.concatenate([mesh.faces, numbers[mesh.face_edges]], axis=1)
    wedges = corner_wedges(mesh, sides, extra.of_sides, plain)
    result = _children(mesh, split, numbers, positions, corners, wedges)
    result.values = np.concatenate([mesh.values[:before], value, mesh.values[before:], extra.values])
    result.repeats = np.concatenate([mesh.repeats, numbers[extra.repeated]])
    if rules.midpoint_normal == "geometry":
        normals_from_faces(result, before, len(mesh.repeats))
    return result


def corner_wedges(
    mesh: Triangles, sides: EdgeSides, middle: Ints, plain: int, faces: slice = slice(None)
) -> Ints:
    """Wedges ``(f,6)`` of the corners of ``faces`` and in the middle of their sides, as numbered after a pass with
    ``plain`` new vertices; ``middle (N,)`` are those of the sides of edges.
    """
    corners = mesh.wedges[faces]
    corners = np.where(corners < len(mesh.positions), corners, corners + plain)
    return np.concatenate([corners, middle[sides.of_half_edges.reshape(-1, 3)[faces]]], axis=1)


def _children(
    mesh: Triangles, split: Bools, numbers: Ints, positions: Floats, corners: Ints, wedges: Ints
) -> Triangles:
    """The new triangles and their edges; nodes of each old triangle are ``corners``, ``wedges (F,6)``."""
    groups = cuts(split[mesh.face_edges], positions, corners)
    counts, inner = (np.zeros(len(mesh.faces), dtype=np.int64) for _ in range(2))
    for cut, hit in groups:
        counts[hit], inner[hit] = len(cut.nodes), len(cut.inner)
    starts, inner_starts = np.cumsum(counts) - counts, np.cumsum(inner) - inner
    halves = np.cumsum(1 + split) - 1 - split  # first child of each edge
    outer = int(len(split) + split.sum())
    edges = np.empty((outer + int(inner.sum()), 2), dtype=np.int64)
    edges[halves] = mesh.edges
    edges[halves[split], 1] = numbers[split]
    edges[halves[split] + 1, 0], edges[halves[split] + 1, 1] = numbers[split], mesh.edges[split, 1]
    local = _local_edges(mesh, halves, split)
    faces, face_wedges, face_edges = (np.empty((int(counts.sum()), 3), dtype=np.int64) for _ in range(3))
    for cut, hit in groups:
        places = starts[hit][:, None] + np.arange(len(cut.nodes))
        own = outer + inner_starts[hit][:, None] + np.arange(len(cut.inner))
        edges[own] = corners[hit][:, cut.inner]
        faces[places], face_wedges[places] = corners[hit][:, cut.nodes], wedges[hit][:, cut.nodes]
        face_edges[places] = np.concatenate([local[hit], own], axis=1)[:, cut.edges]
    order = np.argsort(edges.min(axis=1) * len(positions) + edges.max(axis=1), kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    turned = canonical_direction(positions, edges[order])
    source = np.repeat(mesh.source_faces, counts)
    return Triangles(positions, mesh.values, mesh.repeats, faces, face_wedges, rank[face_edges], turned, source)


def _local_edges(mesh: Triangles, halves: Ints, split: Bools) -> Ints:
    """Child edges ``(F,9)`` of the triangles' sides as templates number them: the halves in the side's own direction,
    the whole where it is not split.
    """
    first = halves[mesh.face_edges]
    forward = mesh.faces == mesh.edges[mesh.face_edges, 0]
    cut = split[mesh.face_edges]
    near, far = first + (cut & ~forward), first + (cut & forward)
    return np.concatenate([np.stack([near, far], axis=2).reshape(-1, 6), first], axis=1)


def cuts(split: Bools, positions: Floats, corners: Ints) -> list[tuple[Template, Ints]]:
    """Templates and the triangles that they cut: sides ``split (F,3)``, nodes ``corners (F,6)``.

    What two split sides leave is cut along its shorter diagonal, or that at its lowest vertex.
    """
    masks = split @ np.array([1, 2, 4])
    groups: list[tuple[Template, Ints]] = []
    for mask in values_of(masks):
        hit = np.flatnonzero(masks == mask)
        if mask.bit_count() != 2:
            groups.append((template(mask), hit))
            continue
        whole = (~mask & 7).bit_length() - 1
        a, b = corners[hit, (whole + 1) % 3], corners[hit, whole]
        past_a, past_b = corners[hit, 3 + (whole + 1) % 3], corners[hit, 3 + (whole + 2) % 3]
        first, second = (((positions[p] - positions[q]) ** 2).sum(axis=1) for p, q in ((a, past_b), (past_a, b)))
        turned = np.where(np.abs(first - second) <= EQUAL * first, b < a, second < first)
        groups += [(template(mask, True), hit[turned]), (template(mask), hit[~turned])]
    return groups


def normals_from_faces(mesh: Triangles, before: int, repeats: int) -> None:
    """Replace the normals of the new wedges by those of their triangles, weighted by area; the first ``before``
    vertices and ``repeats`` keep theirs, and so do wedges whose triangles cancel.
    """
    points = mesh.positions[mesh.faces]
    area = cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    total = unit(sum_by(mesh.wedges.reshape(-1), np.repeat(area, 3, axis=0), len(mesh.values)))
    new: Bools = (total != 0).any(axis=1)
    new[:before] = False
    new[len(mesh.positions) : len(mesh.positions) + repeats] = False
    mesh.values[new, :3] = total[new]
