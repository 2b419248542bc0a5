"""T-junctions drawn into a Y: smooth vertices slid along an edge that leaves a straight line.

Where an edge runs into a straight line of two others, the corner across from it takes 180 degrees of the tangent
plane, and a patch there folds (`folds`). A vertex a little way along that edge, where the dense mesh has one, bends
the line and makes room, at the price of no polygon at all.
"""

from __future__ import annotations

import numpy as np

from curvify.mesh import Bools, Floats, Ints
from curvify.normals import sum_by, unit
from curvify.simplify.moves import apart, corners_at, keeps_shapes
from curvify.simplify.polygons import Polygons, first_of_each, ranges, shapes_of
from curvify.topology import Topology

#: Corners with a sine below the first want room, and have it from the second on (8 and 12 degrees).
TIGHT, ROOM = float(np.sin(np.radians(8.0))), float(np.sin(np.radians(12.0)))
#: How far a vertex may slide, as a share of the edge.
FARTHEST = 0.4
ROUNDS = 3


def slide_vertices(positions: Floats, polygons: Polygons, creases: Bools) -> Polygons:
    """Slide smooth vertices with a corner that wants room to the nearest place on a path that gives it.

    ``positions (V,3)`` of the dense mesh, ``creases (C,)`` half-edges, boundaries among them.
    """
    for _ in range(ROUNDS):
        topology = polygons.topology(positions)
        along, steps = _slides(positions, polygons, topology, creases)
        if not len(along):
            break
        polygons = _slid(polygons, topology, along, steps)
    return polygons


def _slides(positions: Floats, polygons: Polygons, topology: Topology, creases: Bools) -> tuple[Ints, Ints]:
    """Half-edges along which their tails slide at once, and how many steps of their paths."""
    vertices = polygons.vertices
    shapes = shapes_of(positions, vertices, polygons.sides)
    normals = unit(sum_by(vertices, shapes.normals[topology.faces], len(positions)))
    smooth = np.ones(len(positions), dtype=bool)
    lines = creases | (topology.twin < 0)
    smooth[topology.edges[topology.edge[lines]]] = False
    sines = _sines(positions, topology, np.arange(len(vertices)), positions[vertices], normals[vertices])
    tight = np.flatnonzero((sines < TIGHT) & smooth[vertices])
    along, corner = corners_at(topology, vertices[tight])
    other = (along != tight[corner]) & (along != topology.twin[topology.prev[tight]][corner])
    along = along[other]
    rows, which = ranges(polygons.starts[along] + 1, polygons.sizes[along] - 1)
    along, target = along[which], polygons.steps[rows]
    steps = rows - polygons.starts[along]
    tail, head = positions[vertices[along]], positions[vertices[topology.next[along]]]
    far = np.linalg.norm(positions[target] - tail, axis=1)
    near = np.flatnonzero(far < FARTHEST * np.linalg.norm(head - tail, axis=1))
    near = near[_gives_room(positions, topology, normals, vertices[along[near]], target[near])]
    near = near[keeps_shapes(positions, topology, vertices[along[near]], target[near])]
    near = near[np.lexsort((along[near], far[near]))]
    near = near[first_of_each(vertices[along[near]])]
    chosen = near[apart(topology, vertices[along[near]])]
    return along[chosen], steps[chosen]


def _sines(positions: Floats, topology: Topology, corners: Ints, places: Floats, normals: Floats) -> Floats:
    """Sine ``(n,)`` of corners with their vertices at ``places (n,3)``, seen along ``normals (n,3)``."""
    leave = positions[topology.vertices[topology.next[corners]]] - places
    back = positions[topology.vertices[topology.prev[corners]]] - places
    lengths = np.linalg.norm(leave, axis=1) * np.linalg.norm(back, axis=1)
    return np.einsum("ni,ni->n", np.cross(leave, back), normals) / np.maximum(lengths, 1e-300)


def _gives_room(positions: Floats, topology: Topology, normals: Floats, vertices: Ints, targets: Ints) -> Bools:
    """Whether all corners at each of ``vertices (n,)`` have room with it at ``targets (n,)``."""
    corners, which = corners_at(topology, vertices)
    sines = _sines(positions, topology, corners, positions[targets][which], normals[vertices][which])
    return np.bincount(which, sines < ROOM, len(vertices)) == 0


def _slid(polygons: Polygons, topology: Topology, along: Ints, steps: Ints) -> Polygons:
    """The polygons with the tails of half-edges moved along their paths."""
    twin = topology.twin[along]
    starts, sizes = polygons.starts.copy(), polygons.sizes.copy()
    starts[along] += steps
    sizes[along] -= steps
    sizes[twin] -= steps
    moved = np.arange(topology.vertex_count)
    moved[polygons.vertices[along]] = polygons.steps[starts[along]]
    vertices = polygons.vertices.copy()
    vertices[along] = moved[vertices[along]]
    shorter = Polygons(
        polygons.offsets, vertices, polygons.regions, starts, sizes, polygons.steps, polygons.sharp
    )
    every = np.arange(len(vertices))
    return shorter.recut(polygons.offsets, every, np.zeros(len(every), dtype=bool), moved[vertices])
