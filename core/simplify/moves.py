"""Vertices of polygons moved one by one: what lies around them, and which moves may be made at once."""

from __future__ import annotations

import numpy as np

from curvify.mesh import Bools, Floats, Ints
from curvify.simplify.polygons import ranges, shapes_of
from curvify.topology import Topology

#: Cosine that a polygon must keep with itself, and the least sine of its corners, when one of its vertices moves.
TURNED, THIN = 0.95, 0.05


def corners_at(topology: Topology, vertices: Ints) -> tuple[Ints, Ints]:
    """All corners at ``vertices (n,)``, vertex by vertex, and the index of the vertex of each among the n."""
    order = np.argsort(topology.vertices, kind="stable")
    first = np.searchsorted(topology.vertices[order], np.arange(topology.vertex_count + 1))
    rows, which = ranges(first[vertices], np.diff(first)[vertices])
    return order[rows], which


def keeps_shapes(
    positions: Floats, topology: Topology, vertices: Ints, targets: Ints, left: float = np.inf
) -> Bools:
    """Whether the polygons around each of ``vertices (n,)`` stay convex, turned as they were and no needles when it
    takes the place of its vertex of ``targets (n,)``; its old place must be nearer to their planes than ``left``.

    A polygon that has the target already loses a corner; one that then has only two is gone.
    """
    corners, which = corners_at(topology, vertices)
    face = topology.faces[corners]
    rows, piece = ranges(topology.offsets[face], topology.sizes[face])
    tail, head = vertices[which][piece], targets[which][piece]
    loop = topology.vertices[rows]
    moves = loop == tail
    beside = np.bincount(piece, loop == head, len(face)) > 0
    kept = ~(moves & beside[piece])
    sizes = np.bincount(piece[kept], minlength=len(face))
    whole = sizes >= 3
    kept &= whole[piece]
    old = shapes_of(positions, loop, topology.sizes[face])
    new = shapes_of(positions, np.where(moves, head, loop)[kept], sizes[whole])
    fine = new.acceptable & (new.least_sines > np.minimum(THIN, old.least_sines[whole]))
    fine &= np.einsum("pi,pi->p", new.normals, old.normals[whole]) > TURNED
    step = positions[vertices[which][whole]] - positions[targets[which][whole]]
    fine &= np.abs(np.einsum("pi,pi->p", new.normals, step)) < left
    good = np.ones(len(vertices), dtype=bool)
    good[which[whole][~fine]] = False
    return good


def apart(topology: Topology, vertices: Ints) -> Bools:
    """Which of ``vertices (n,)``, best first, are the best of all that touch any of the polygons around them."""
    corners, which = corners_at(topology, vertices)
    best = np.full(len(topology.offsets) - 1, len(vertices))
    np.minimum.at(best, topology.faces[corners], which)
    return np.bincount(which, best[topology.faces[corners]] < which, len(vertices)) == 0
