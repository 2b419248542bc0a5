"""Half-edge topology of polygon loops: welding, edges, twins, components.

Half-edge ``c`` leaves corner ``c`` and ends at the next corner of its face. Every array is built by
sorting, never by a walk, so that a million corners cost a handful of numpy calls.
"""

from __future__ import annotations

import numpy as np

from curvify.arrays import distinct, pick, take_rows
from curvify.mesh import Bools, Floats, Ints
from curvify.polygons import newell_normals, next_corners, previous_corners
from curvify.records import record

#: Squared length below which an edge has none: what is divided by it would overflow.
NO_LENGTH = 1e-280


@record
class Loops:
    """Face loops on welded vertices, fit for building a surface.

    ``offsets (F+1,)``, ``vertices (C,)``; ``source_corners (C,)`` and ``source_faces (F,)`` name the corner
    and the face of the input mesh that each one came from.
    """

    offsets: Ints
    vertices: Ints
    source_corners: Ints
    source_faces: Ints


@record
class Topology:
    """Edges and neighbors of face loops.

    ``edges (E,2)`` vertex ids in the *canonical direction*: from the end with the lexicographically smaller
    position, so that two copies of an edge at one place get the same curve, bit for bit. Edges are ordered by
    (smaller id, larger id). Per corner ``(C,)``: ``next``, ``prev``; ``edge`` of its half-edge; ``forward``,
    whether that runs in the canonical direction; ``twin``, the opposite half-edge, -1 on a boundary.
    Per edge ``(E,)``: ``first`` and ``last``, its half-edges in the order of the corners, the same one on a plain
    boundary; ``uses``, the number of half-edges; ``interior``, whether they are two in opposite directions. Every other
    edge is a boundary for each of its faces.
    """

    offsets: Ints
    vertices: Ints
    vertex_count: int
    next: Ints
    prev: Ints
    edges: Ints
    edge: Ints
    forward: Bools
    twin: Ints
    first: Ints
    last: Ints
    uses: Ints
    interior: Bools

    @property
    def sizes(self) -> Ints:
        return np.diff(self.offsets)

    @property
    def faces(self) -> Ints:
        """Face of each corner ``(C,)``."""
        return np.repeat(np.arange(len(self.offsets) - 1), self.sizes)

    @property
    def nonmanifold(self) -> Bools:
        """Edges ``(E,)`` that several faces use without being neighbors there."""
        return (self.uses > 1) & ~self.interior


def components(count: int, a: Ints, b: Ints) -> Ints:
    """Label ``(count,)`` of the connected component of each node, its smallest node, for the links a-b."""
    label = np.arange(count)
    while len(a):
        low = np.minimum(label[a], label[b])
        np.minimum.at(label, label[a], low)
        np.minimum.at(label, label[b], low)
        while not np.array_equal(jumped := label[label], label):
            label = jumped
        apart = label[a] != label[b]
        a, b = a[apart], b[apart]
    return label


def position_classes(positions: Floats) -> Ints:
    """Class ``(n,)`` of each row of ``positions (n,3)``: equal numbers for bit-equal rows (0 and -0 are equal)."""
    order = np.lexsort(positions.T)
    ordered = positions[order]
    fresh = np.ones(len(order), dtype=bool)
    fresh[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    classes = np.empty(len(order), dtype=np.int64)
    classes[order] = np.cumsum(fresh) - 1
    return classes


def weld_vertices(positions: Floats, offsets: Ints, vertices: Ints, mode: str) -> Ints:
    """The vertex ``(V,)`` that stands for each vertex: the smallest id of those that are one point.

    ``always`` merges all bit-equal positions. ``auto`` merges the ends of two open half-edges that have
    bit-equal end positions and run in opposite directions, when there are just two such. ``never`` keeps
    the file's topology. The ends of an edge without length, and corners of one face at one place, are one point in
    every mode.
    """
    count = len(positions)
    if mode == "always":
        classes = position_classes(positions)
        first = np.full(count, count)
        np.minimum.at(first, classes, np.arange(count))
        return first[classes]
    heads = vertices[next_corners(offsets)]
    step = take_rows(positions, vertices) - take_rows(positions, heads)
    short = (np.einsum("ci,ci->c", step, step) < NO_LENGTH) & (vertices != heads)
    links = [np.stack([vertices[short], heads[short]]), *_pinches(positions, offsets, vertices)]
    if mode == "auto":
        links += _stitches(positions, vertices, heads)
    a, b = np.concatenate(links, axis=1)
    return components(count, a, b)


def _pinches(positions: Floats, offsets: Ints, vertices: Ints) -> list[Ints]:
    """Vertex pairs ``(2,k)`` at one place in one face: where an outline touches itself."""
    sizes = np.diff(offsets)
    quads = offsets[:-1][sizes == 4]
    pairs = []
    for corners in (quads, quads + 1):
        ends = vertices[corners], vertices[corners + 2]
        touch = np.flatnonzero((take_rows(positions, ends[0]) == take_rows(positions, ends[1])).all(axis=1))
        pairs.append(np.stack([ends[0][touch], ends[1][touch]]))
    corners = np.flatnonzero(np.repeat(sizes > 4, sizes))
    if len(corners):
        face = np.repeat(np.arange(len(sizes)), sizes)[corners]
        place = position_classes(positions[vertices[corners]])
        order = np.lexsort((place, face))
        same = (face[order][1:] == face[order][:-1]) & (place[order][1:] == place[order][:-1])
        pairs.append(np.stack([vertices[corners[order[:-1][same]]], vertices[corners[order[1:][same]]]]))
    return pairs


def _stitches(positions: Floats, tails: Ints, heads: Ints) -> list[Ints]:
    """Vertex pairs to merge so that open half-edges become twins: two arrays ``(2,k)``, one per end."""
    count = len(positions)
    key = np.minimum(tails, heads) * count + np.maximum(tails, heads)
    inverse = distinct(key)[1]
    open_ = np.flatnonzero(np.bincount(inverse)[inverse] == 1)
    if not len(open_):
        return []
    ends, place = distinct(np.concatenate([tails[open_], heads[open_]]))
    tail, head = position_classes(positions[ends])[place].reshape(2, -1)
    apart = tail != head
    open_, tail, head = open_[apart], tail[apart], head[apart]
    low, up = np.minimum(tail, head), tail < head
    order = np.lexsort((~up, np.maximum(tail, head), low))
    pair_key = (low * (len(ends) + 1) + np.maximum(tail, head))[order]
    starts = np.flatnonzero(np.concatenate([[True], pair_key[1:] != pair_key[:-1]]))
    two = np.diff(np.append(starts, len(order))) == 2
    first, second = order[starts[two]], order[starts[two] + 1]
    opposite = up[first] != up[second]
    one, other = open_[first[opposite]], open_[second[opposite]]
    return [np.stack([tails[one], heads[other]]), np.stack([heads[one], tails[other]])]


def clean_loops(offsets: Ints, vertices: Ints) -> Loops:
    """Loops without repeated consecutive corners, and without the faces that have fewer than 3 left."""
    corners = np.arange(len(vertices))
    faces = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    kept = np.ones(len(offsets) - 1, dtype=bool)
    while True:
        repeated = vertices == vertices[next_corners(offsets)]
        small = np.diff(offsets) < 3
        drop = repeated | small[faces]
        if not drop.any() and not small.any():
            break
        kept_rows = np.flatnonzero(kept)
        kept[kept_rows[small]] = False
        renumber = np.cumsum(~small) - 1
        corners, vertices, faces = corners[~drop], vertices[~drop], renumber[faces[~drop]]
        sizes = np.bincount(faces, minlength=int((~small).sum()))
        offsets = np.concatenate([[0], np.cumsum(sizes)])
    return Loops(offsets, vertices, corners, np.flatnonzero(kept))


def build_topology(positions: Floats, offsets: Ints, vertices: Ints) -> Topology:
    """Topology of loops without repeated consecutive vertices, for positions ``(V,3)``."""
    count = len(positions)
    heads = vertices[next_corners(offsets)]
    key = np.minimum(vertices, heads) * count + np.maximum(vertices, heads)
    keys, edge = distinct(key)
    edges = np.stack([keys // count, keys % count], axis=1)
    return link_half_edges(positions, offsets, vertices, edges, edge)


def link_half_edges(positions: Floats, offsets: Ints, vertices: Ints, edges: Ints, edge: Ints) -> Topology:
    """Topology where the edge of each half-edge ``edge (C,)`` is known; ``edges (E,2)`` in any direction."""
    edges = canonical_direction(positions, edges)
    forward = vertices == edges[edge, 0]
    uses = np.bincount(edge, minlength=len(edges))
    ups = np.bincount(edge[forward], minlength=len(edges))
    interior = (uses == 2) & (ups == 1)
    first, last = _first_and_last(edge, len(edges))
    twin = np.full(len(vertices), -1)
    one, other = first[interior], last[interior]
    twin[one], twin[other] = other, one
    following, before = next_corners(offsets), previous_corners(offsets)
    return Topology(
        offsets, vertices, len(positions), following, before, edges, edge, forward, twin, first, last, uses, interior
    )


def _first_and_last(edge: Ints, count: int) -> tuple[Ints, Ints]:
    """First and last half-edge of each edge ``(E,)``."""
    half_edges = np.arange(len(edge))
    first, last = (np.empty(count, dtype=np.int64) for _ in range(2))
    first[edge[::-1]] = half_edges[::-1]
    last[edge] = half_edges
    return first, last


def canonical_direction(positions: Floats, edges: Ints) -> Ints:
    """The edges ``(E,2)`` turned so that each starts at its lexicographically smaller position, ties by id."""
    low, high = np.minimum(edges[:, 0], edges[:, 1]), np.maximum(edges[:, 0], edges[:, 1])
    step = take_rows(positions, high) - take_rows(positions, low)
    first = step[:, 0].copy()
    for i in (1, 2):
        level = np.flatnonzero(first == 0)
        first[level] = step[level, i]
    turn = first < 0
    return np.stack([pick(turn, high, low), pick(turn, low, high)]).T


def is_closed(topology: Topology) -> bool:
    """Whether every edge joins two faces that run opposite ways along it."""
    return bool(len(topology.edges)) and bool(topology.interior.all())


def signed_volume(positions: Floats, offsets: Ints, vertices: Ints, area: Floats | None = None) -> float:
    """Volume enclosed by closed loops, negative where they face inwards.

    Each face counts as the fan of triangles about the mean of its corners. ``area (F,3)``: the faces' area vectors,
    where they are known.
    """
    if area is None:
        area = newell_normals(positions, offsets, vertices)
    points = take_rows(positions - positions.mean(axis=0), vertices)
    sizes = np.diff(offsets)
    shares = take_rows(area / sizes[:, None], np.repeat(np.arange(len(sizes)), sizes))
    return float(np.einsum("ci,ci->", points, shares) / 6)


def fans(topology: Topology) -> Ints:
    """Label ``(C,)`` of the fan of each corner: corners of a vertex joined across interior edges."""
    a, b = corner_links(topology)
    return components(len(topology.vertices), a, b)


def corner_links(topology: Topology) -> tuple[Ints, Ints]:
    """Corners that lie side by side at the ends of the interior edges: two arrays, both ends of each edge."""
    one = np.flatnonzero(topology.twin > np.arange(len(topology.twin)))
    other = topology.twin[one]
    return np.concatenate([one, topology.next[one]]), np.concatenate([topology.next[other], other])
