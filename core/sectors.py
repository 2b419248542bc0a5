"""Sectors, line tangents and corner vertices: the normals and end tangents that all schemes build on.

A *sector* is a run of faces around a vertex with one normal; creases and boundaries separate sectors.
Two crease or boundary edges that pass through a vertex share one *line tangent*, so that a rim stays smooth
and, when it is planar, planar. A *corner* vertex has a tangent plane for each of its faces.
Source: Leung, Wang, Zhang, sections 2 and 3, on a general model of our own (docs/mathematics.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.arrays import cross
from curvify.edges import LEAST_ADVANCE, bending_normals, smooth_tangents
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import SAME_NORMAL, degrees_between, dot, perpendicular, sector_normals, sum_by, unit
from curvify.topology import Topology, components, corner_links

#: The largest turn of a line at a vertex where it still runs on smoothly (degrees).
BOUNDARY_TURN = 75.0
CREASE_TURN = 100.0


@dataclass(eq=False)
class Features:
    """What the surface must do at vertices and edge ends.

    ``normals (C,3)`` unit, one per face corner, bitwise equal within a sector; ``tangents (E,2,3)`` unit
    directions along the canonical direction at the two ends of each edge; ``bending (E,3)`` normal of the
    plane each edge bends in; ``sharp (E,2)`` where the faces' normals differ at an end of an interior edge;
    ``corners (V,)`` the corner vertices; ``adjusted``, how many corners could not keep their normal.
    """

    normals: Floats
    tangents: Floats
    bending: Floats
    sharp: Bools
    corners: Bools
    adjusted: int


def resolve_features(
    topology: Topology,
    positions: Floats,
    area: Floats,
    fans: Ints,
    given: Floats | None,
    corners: Bools,
    split_by_normals: bool = True,
) -> Features:
    """Resolve normals and tangents from ``given (C,3)`` unit corner normals, or from the faces where None.

    ``area (F,3)`` are the faces' area vectors, ``fans (C,)`` the fan of each corner. ``corners (V,)`` are vertices
    that must be corners; given normals that differ make creases only if ``split_by_normals``, else they are averaged.
    """
    sectors = fans if given is None or not split_by_normals else _sectors(topology, given)
    if given is None:
        normals = sector_normals(positions, topology.offsets, topology.vertices, area, sectors)
    else:
        normals = unit(sum_by(sectors, given, len(sectors)))[sectors]
    sharp = _sharp_ends(topology, sectors)
    lines, turned = _line_tangents(topology, positions, sharp)
    tangled = _touched(topology, topology.nonmanifold)
    lined = lines.any(axis=1)
    corners = corners | (tangled & ~lined)
    if given is None:
        corners = corners | turned
    straighten = (lined & ~corners & (tangled | (given is None)))[topology.vertices]
    if straighten.any():
        t = lines[topology.vertices[straighten]]
        old = normals[straighten]
        normals[straighten] = unit(old - dot(old, t) * t)
    tangents, bending = _end_tangents(topology, positions, area, normals, lines, sharp, corners)
    normals, adjusted = _fit_normals(topology, normals, tangents, corners)
    return Features(normals, tangents, bending, sharp, corners, adjusted)


def _sectors(topology: Topology, given: Floats) -> Ints:
    """Sector label of each corner: corners joined across the edge ends where their normals are one."""
    a, b = corner_links(topology)
    smooth = degrees_between(given[a], given[b]) <= SAME_NORMAL
    return components(len(topology.vertices), a[smooth], b[smooth])


def _sharp_ends(topology: Topology, sectors: Ints) -> Bools:
    """Ends ``(E,2)`` of interior edges where the two faces lie in different sectors."""
    sharp = np.zeros((len(topology.edges), 2), dtype=bool)
    one = np.flatnonzero((topology.twin >= 0) & topology.forward)
    other = topology.twin[one]
    sharp[topology.edge[one], 0] = sectors[one] != sectors[topology.next[other]]
    sharp[topology.edge[one], 1] = sectors[topology.next[one]] != sectors[other]
    return sharp


def _touched(topology: Topology, edges: Bools) -> Bools:
    """Vertices ``(V,)`` at an end of the marked edges ``(E,)``."""
    touched = np.zeros(topology.vertex_count, dtype=bool)
    touched[topology.edges[edges]] = True
    return touched


def _line_tangents(topology: Topology, positions: Floats, sharp: Bools) -> tuple[Floats, Bools]:
    """Tangent ``(V,3)`` of the line through each vertex, zero where none, and where a crease turns too much.

    A line passes where exactly two boundary edges meet (and more than one face), or exactly two creases and
    no boundary: the tangent of the circle through the vertex and its two neighbors on the line.
    """
    count = topology.vertex_count
    boundary = np.repeat(~topology.interior[:, None], 2, axis=1)
    boundaries = np.bincount(topology.edges[boundary], minlength=count)
    creases = np.bincount(topology.edges[sharp], minlength=count)
    faces = np.bincount(topology.vertices, minlength=count)
    on_rim = (boundaries == 2) & (faces > 1)
    on_crease = (boundaries == 0) & (creases == 2)
    end = (boundary & on_rim[topology.edges]) | (sharp & on_crease[topology.edges])
    at, away = topology.edges[end], topology.edges[:, ::-1][end]
    order = np.lexsort((away, at))
    vertex, (p, q) = at[order][::2], away[order].reshape(-1, 2).T
    before, after = positions[vertex] - positions[p], positions[q] - positions[vertex]
    turn = degrees_between(before, after)
    lines = np.zeros((count, 3))
    smooth = turn <= np.where(on_rim[vertex], BOUNDARY_TURN, CREASE_TURN)
    circle = unit(before / dot(before, before) + after / dot(after, after))
    lines[vertex[smooth]] = circle[smooth]
    turned = np.zeros(count, dtype=bool)
    turned[vertex[~smooth & on_crease[vertex]]] = True
    return lines, turned


def sides_of_edges(topology: Topology) -> tuple[Ints, Ints]:
    """First and last half-edge of each edge ``(E,)``: the same one on a plain boundary."""
    half_edges = np.arange(len(topology.edge))
    first, last = (np.empty(len(topology.edges), dtype=np.int64) for _ in range(2))
    first[topology.edge[::-1]] = half_edges[::-1]
    last[topology.edge] = half_edges
    return first, last


def _end_tangents(
    topology: Topology,
    positions: Floats,
    area: Floats,
    normals: Floats,
    lines: Floats,
    sharp: Bools,
    corners: Bools,
) -> tuple[Floats, Floats]:
    """Unit tangents ``(E,2,3)`` and bending normals ``(E,3)`` of all edges."""
    chord = positions[topology.edges[:, 1]] - positions[topology.edges[:, 0]]
    first, last = sides_of_edges(topology)
    mean = end_normals(topology, normals, first)
    several = np.flatnonzero(sharp.any(axis=1) | topology.nonmanifold)
    one, other = mean[several], end_normals(topology, normals, last[several])
    mean[several] = np.where((one == other).all(axis=2, keepdims=True), one, unit(one + other))
    faces = topology.faces
    bending = bending_normals(chord, mean[:, 0], mean[:, 1], area[faces[first]] + area[faces[last]])
    tangents = np.empty((len(chord), 2, 3))
    for end in (0, 1):
        tangents[:, end] = smooth_tangents(chord, mean[:, end], bending)
        split = np.flatnonzero(sharp[several, end])
        rows = several[split]
        along = unit(chord[rows])
        tangents[rows, end] = _crease_tangents(
            along, one[split, end], other[split, end], mean[rows, end], lines[topology.edges[rows, end]]
        )
        rim = np.flatnonzero(~topology.interior & lines[topology.edges[:, end]].any(axis=1))
        line = lines[topology.edges[rim, end]]
        line *= np.where(dot(line, chord[rim]) < 0, -1.0, 1.0)
        tangents[rim, end] = unit(line - dot(line, mean[rim, end]) * mean[rim, end])
        straight = corners[topology.edges[:, end]] & (sharp[:, end] | ~topology.interior)
        tangents[straight, end] = unit(chord[straight])
    return tangents, bending


def end_normals(topology: Topology, normals: Floats, half_edges: Ints) -> Floats:
    """Normals ``(E,2,3)`` of the face of the given half-edges at the two ends in canonical direction."""
    tail, head = normals[half_edges], normals[topology.next[half_edges]]
    forward = topology.forward[half_edges][:, None]
    return np.stack([np.where(forward, tail, head), np.where(forward, head, tail)], axis=1)


def _crease_tangents(along: Floats, left: Floats, right: Floats, mean: Floats, line: Floats) -> Floats:
    """Tangent ``(k,3)`` where two normals meet: their common perpendicular, towards the line or the edge."""
    line = line * np.where(dot(line, along) < 0, -1.0, 1.0)
    guide = np.where(line.any(axis=1, keepdims=True), line, along)
    across = unit(cross(left, right))
    tangent = across * np.where(dot(across, guide) < 0, -1.0, 1.0)
    projected = unit(along - dot(along, mean) * mean)
    return np.where(dot(tangent, along) < LEAST_ADVANCE, projected, tangent)


def _fit_normals(
    topology: Topology, normals: Floats, tangents: Floats, corners: Bools
) -> tuple[Floats, int]:
    """Make every corner normal perpendicular to the two edge curves that meet there.

    At corner vertices that defines the normals. Elsewhere the tangents were made for the normals, except
    where no curve could serve all faces of an edge: those corners are counted.
    """
    before = topology.prev
    out = tangents[topology.edge, np.where(topology.forward, 0, 1)]
    out = out * np.where(topology.forward, 1.0, -1.0)[:, None]
    back = tangents[topology.edge[before], np.where(topology.forward[before], 1, 0)]
    back = back * np.where(topology.forward[before], -1.0, 1.0)[:, None]
    tilt = np.maximum(np.abs(dot(normals, out)), np.abs(dot(normals, back)))[:, 0]
    own = corners[topology.vertices]
    refit = own | (tilt > 1e-6)
    if not refit.any():
        return normals, 0
    upright = cross(out[refit], back[refit])
    old = normals[refit]
    flattened = old - dot(old, out[refit]) * out[refit]
    along = np.linalg.norm(flattened, axis=1, keepdims=True) < 1e-6
    flattened = np.where(along, perpendicular(out[refit]), unit(flattened))
    collinear = np.linalg.norm(upright, axis=1, keepdims=True) < 1e-6
    fitted = unit(upright) * np.where(dot(upright, old) < 0, -1.0, 1.0)
    fitted = np.where(collinear, flattened, fitted)
    normals = normals.copy()
    normals[refit] = fitted
    return normals, int((refit & ~own).sum())
