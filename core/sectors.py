"""Sectors, line tangents and corner vertices: the normals and end tangents that all schemes build on.

A *sector* is a run of faces around a vertex with one normal; creases and boundaries separate sectors.
Two crease or boundary edges that pass through a vertex share one *line tangent*, so that a rim stays smooth
and, when it is planar, planar. A *corner* vertex has a tangent plane for each of its faces.
Source: Leung, Wang, Zhang, sections 2 and 3, on a general model of our own (docs/mathematics.md).
"""

from __future__ import annotations

import numpy as np

from curvify.arrays import cross, distinct, pick, take_rows
from curvify.edges import ALONG, LEAST_ADVANCE, Directions, bending_normals, smooth_tangents
from curvify.marks import ResolvedMarks
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import SAME_NORMAL, degrees_between, dot, perpendicular, sector_normals, sum_by, unit
from curvify.records import record
from curvify.topology import Topology, components, corner_links

#: The largest turn of a line at a vertex where it still runs on smoothly (degrees).
BOUNDARY_TURN = 75.0
CREASE_TURN = 100.0


#: Straight edges at a vertex whose directions span less than this (the square of an angle) are one line, or one plane.
ONE_LINE = 1e-14
#: Normals whose cosine with a tangent is above this are not perpendicular to it.
TILTED = 1e-6
#: Normals of a crease's two sides whose cross product is shorter than this do not tell where the crease runs.
NO_TURN = 1e-7


@record
class Features:
    """What the surface must do at vertices and edge ends.

    ``normals (C,3)`` unit, one per face corner, bitwise equal within a sector; ``tangents (E,2,3)`` unit
    directions along the canonical direction at the two ends of each edge; ``bending (E,3)`` normal of the
    plane each edge bends in; ``sharp (E,2)`` where the faces' normals differ at an end of an interior edge;
    ``corners (V,)`` the corner vertices; ``adjusted``, how many corners could not keep their normal; ``unfitted
    (C,3)`` the sectors' normals as they were before they were made perpendicular to the curves.
    """

    normals: Floats
    tangents: Floats
    bending: Floats
    sharp: Bools
    corners: Bools
    adjusted: int
    unfitted: Floats


def label_sectors(topology: Topology, fans: Ints, crease: Floats) -> Ints:
    """Sector label ``(C,)`` of each corner: corners of a vertex joined across edge ends that are no crease.

    ``crease (E,2)`` is the sharpness at the ends of the edges. One crease alone parts nothing: it ends in a dart.
    """
    if not crease.any():
        return fans
    one = np.flatnonzero(topology.twin > np.arange(len(topology.twin)))
    edges, start = topology.edge[one], np.where(topology.forward[one], 0, 1)
    smooth = np.concatenate([crease[edges, start], crease[edges, 1 - start]]) == 0
    a, b = corner_links(topology)
    return components(len(topology.vertices), a[smooth], b[smooth])


def resolve_features(
    topology: Topology,
    positions: Floats,
    area: Floats,
    fans: Ints,
    sectors: Ints,
    given: Floats | None,
    marks: ResolvedMarks,
    corners: Bools,
    directions: Directions = smooth_tangents,
) -> Features:
    """Resolve normals and tangents from the ``given (C,3)`` unit corner normals and the marks.

    ``area (F,3)`` are the faces' area vectors, ``fans`` and ``sectors (C,)`` label the corners. Rows of ``given`` are
    zero where the normal is to be computed; None: everywhere. ``corners (V,)`` are vertices that must be corners.
    ``directions`` is the scheme's rule for edge ends where nothing is sharp and no mark bends the edge.
    """
    normals, computed = _starting_normals(topology, positions, area, sectors, given, marks)
    sharp = sharp_ends(topology, sectors)
    lines, turned = line_tangents(topology, positions, sharp, marks.straight)
    lined = np.linalg.norm(lines, axis=1) > 0
    tangled = _touched(topology, topology.nonmanifold)
    turned[topology.vertices[~computed]] = False
    corners = corners | (tangled & ~lined) | (marks.corner > 0) | turned
    _straighten_lines(topology, normals, lines, lined & ~corners, computed, sharp)
    straight = _straight_planes(topology, positions, sectors, marks.straight, np.where(corners[:, None], 0.0, lines))
    corners |= straight.torn
    straight.apply(normals)
    if ((marks.crease > 0) & (marks.crease < 1)).any():
        _soften(topology, normals, fans, sectors, sharp, marks.crease)
        straight.apply(normals)
    ends = _edge_ends(topology, positions, area, normals, sharp)
    points = corner_points(topology, sharp, marks.corner)
    tangents, bending = end_tangents(ends, lines, sharp, corners, points, marks, directions)
    fitted, adjusted = _fit_normals(topology, normals, tangents, corners)
    return Features(fitted, tangents, bending, sharp, corners, adjusted, normals)


def _straighten_lines(
    topology: Topology, normals: Floats, lines: Floats, lined: Bools, computed: Bools, sharp: Bools
) -> None:
    """Make the normals of vertices ``lined (V,)`` perpendicular to their lines, in place: computed ones, and all
    where faces are no neighbors.

    Not where a crease runs into a rim: no plane holds both, and the rim turns there.
    """
    if not lined.any():
        return
    rim = _touched(topology, ~topology.interior)
    tangled = _touched(topology, topology.nonmanifold)
    crossed = rim & ~tangled & _touched(topology, sharp[:, 0] | sharp[:, 1])
    at = topology.vertices
    chosen = (lined & ~crossed)[at] & (tangled[at] | computed)
    if chosen.any():
        t, old = lines[at[chosen]], normals[chosen]
        normals[chosen] = unit(old - dot(old, t) * t)


def _starting_normals(
    topology: Topology, positions: Floats, area: Floats, sectors: Ints, given: Floats | None, marks: ResolvedMarks
) -> tuple[Floats, Bools]:
    """Normal ``(C,3)`` of each corner's sector, and where it is computed ``(C,)`` rather than given.

    A sector beside a mark that parts faces whose given normals agree, or in a flat face, gets a computed one.
    """
    everywhere = np.ones(len(sectors), dtype=bool)
    if given is None:
        return sector_normals(positions, topology.offsets, topology.vertices, area, sectors, marks.flat), everywhere
    normals = _means(sectors, given)
    wanted = np.zeros(len(sectors), dtype=bool)
    wanted[sectors[~normals.any(axis=1)]] = True
    wanted[sectors[np.repeat(marks.flat, topology.sizes)]] = True
    if marks.crease.any():
        a, b = corner_links(topology)
        apart = sectors[a] != sectors[b]
        a, b = a[apart], b[apart]
        alike = degrees_between(normals[a], normals[b]) <= SAME_NORMAL
        wanted[sectors[a[alike]]] = True
        wanted[sectors[b[alike]]] = True
    computed = wanted[sectors]
    if computed.any():
        own = sector_normals(positions, topology.offsets, topology.vertices, area, sectors, marks.flat)
        normals[computed] = own[computed]
    return normals, computed


def _means(sectors: Ints, given: Floats) -> Floats:
    """Mean ``(C,3)`` of the given unit normals of each sector; bit by bit the normal itself where they are equal."""
    lead = take_rows(given, sectors)  # a sector is labeled by its first corner
    differs = np.zeros(len(sectors), dtype=bool)
    differs[sectors[(given != lead).any(axis=1)]] = True
    if not differs.any():
        return lead
    means = unit(sum_by(sectors, given, len(sectors)))[sectors]
    return np.where(differs[sectors][:, None], means, lead)


@record
class StraightPlanes:
    """Sectors with straight edges: their normals must be perpendicular to those.

    ``corners (c,)`` and the row ``which (c,)`` of each; ``rank (s,)`` 1 for one direction, 2 for a plane; ``axis
    (s,3)`` that direction, or the normal of the plane. ``torn (V,)``: vertices whose straight edges span space.
    """

    corners: Ints
    which: Ints
    rank: Ints
    axis: Floats
    torn: Bools

    def apply(self, normals: Floats) -> None:
        """Make the normals ``(C,3)`` of these sectors perpendicular to their straight edges, in place."""
        if not len(self.corners):
            return
        old, axis, rank = normals[self.corners], self.axis[self.which], self.rank[self.which][:, None]
        flattened = unit(old - dot(old, axis) * axis)
        upright = axis * np.where(dot(old, axis) < 0, -1.0, 1.0)
        normals[self.corners] = np.where(rank == 1, flattened, np.where(rank == 2, upright, old))


def _straight_planes(
    topology: Topology, positions: Floats, sectors: Ints, straight: Bools, lines: Floats
) -> StraightPlanes:
    """Directions of the straight edges in each sector, with the line ``lines (V,3)`` through its vertex."""
    torn = np.zeros(topology.vertex_count, dtype=bool)
    half_edges = np.flatnonzero(straight[topology.edge])
    if not len(half_edges):
        none = np.zeros(0, dtype=np.int64)
        return StraightPlanes(none, none, none, np.zeros((0, 3)), torn)
    chord = unit(positions[topology.vertices[topology.next[half_edges]]] - positions[topology.vertices[half_edges]])
    at = np.concatenate([half_edges, topology.next[half_edges]])
    labels, which = distinct(sectors[at])
    spread = np.zeros((len(labels), 3, 3))
    np.add.at(spread, which, np.tile(chord[:, :, None] * chord[:, None, :], (2, 1, 1)))
    through = lines[topology.vertices[labels]]
    spread += through[:, :, None] * through[:, None, :]
    size, axes = np.linalg.eigh(spread)
    rank = (size > ONE_LINE * size[:, 2:]).sum(axis=1)
    torn[topology.vertices[labels[rank == 3]]] = True
    axis = np.where(rank[:, None] == 1, axes[:, :, 2], axes[:, :, 0])
    row = np.full(len(sectors), -1)
    row[labels] = np.arange(len(labels))
    corners = np.flatnonzero(row[sectors] >= 0)
    return StraightPlanes(corners, row[sectors[corners]], rank, axis, torn)


def _soften(
    topology: Topology, normals: Floats, fans: Ints, sectors: Ints, sharp: Bools, crease: Floats
) -> None:
    """Move the normals of a vertex's sectors towards their mean by what its sharpest crease lacks, in place.

    Replaces (16), (17): with two sectors the cross product of their normals, along which the crease runs, keeps its
    direction.
    """
    half_edges = np.arange(len(topology.edge))
    start = np.where(topology.forward, 0, 1)
    sharpness = np.where(sharp, crease, 0.0)
    most = np.zeros(len(sectors))
    np.maximum.at(most, fans, sharpness[topology.edge, start])
    np.maximum.at(most, fans[topology.next], sharpness[topology.edge, 1 - start])
    most = most[fans]
    soft = (most > 0) & (most < 1)
    first = half_edges == sectors
    mean = unit(sum_by(fans[first], normals[first], len(fans)))[fans[soft]]
    g = most[soft, None]
    normals[soft] = unit((1 - g) * mean + g * normals[soft])


def sharp_ends(topology: Topology, sectors: Ints) -> Bools:
    """Ends ``(E,2)`` of interior edges where the two faces lie in different sectors."""
    sharp = np.zeros((len(topology.edges), 2), dtype=bool)
    one = np.flatnonzero((topology.twin >= 0) & topology.forward)
    other = topology.twin[one]
    edges = topology.edge[one]
    sharp[edges, 0] = sectors[one] != sectors[topology.next[other]]
    sharp[edges, 1] = sectors[topology.next[one]] != sectors[other]
    return sharp


def _touched(topology: Topology, edges: Bools) -> Bools:
    """Vertices ``(V,)`` at an end of the marked edges ``(E,)``."""
    touched = np.zeros(topology.vertex_count, dtype=bool)
    touched[topology.edges[edges]] = True
    return touched


def line_tangents(topology: Topology, positions: Floats, sharp: Bools, straight: Bools) -> tuple[Floats, Bools]:
    """Tangent ``(V,3)`` of the line through each vertex, zero where none, and where a crease turns too much.

    A line passes where exactly two boundary edges meet (and more than one face), or exactly two creases and
    no boundary: the tangent of the circle through the vertex and its two neighbors on the line. Where one of its
    edges is straight, the line goes on along it; two straight ones that turn are no line.
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
    rigid = np.repeat(straight[:, None], 2, axis=1)[end][order].reshape(-1, 2).T
    before, after = positions[vertex] - positions[p], positions[q] - positions[vertex]
    turn = degrees_between(before, after)
    lines = np.zeros((count, 3))
    smooth = turn <= np.where(on_rim[vertex], BOUNDARY_TURN, CREASE_TURN)
    smooth &= ~rigid.all(axis=0) | (turn < np.degrees(np.sqrt(ONE_LINE)))
    circle = before / dot(before, before) + after / dot(after, after)
    tangent = unit(np.where(rigid[0][:, None], before, np.where(rigid[1][:, None], after, circle)))
    lines[vertex[smooth]] = tangent[smooth]
    turned = np.zeros(count, dtype=bool)
    turned[vertex[~smooth & on_crease[vertex]]] = True
    return lines, turned


@record
class EdgeEnds:
    """Edges and the normals at their ends, in the edges' direction.

    ``edges (E,2)`` and ``chord (E,3)``; ``normals (E,2,3)`` of the first face; ``several (s,)`` the edges that may have
    other normals on their other side, ``others (s,2,3)``; ``beside (E,3)`` the faces' area vectors, added; ``interior
    (E,)`` as in `Topology`.
    """

    edges: Ints
    chord: Floats
    normals: Floats
    several: Ints
    others: Floats
    beside: Floats
    interior: Bools


def _edge_ends(topology: Topology, positions: Floats, area: Floats, normals: Floats, sharp: Bools) -> EdgeEnds:
    """The ends of the mesh's edges, in canonical direction."""
    chord = take_rows(positions, topology.edges[:, 1]) - take_rows(positions, topology.edges[:, 0])
    first, last = topology.first, topology.last
    several = np.flatnonzero(sharp.any(axis=1) | topology.nonmanifold)
    others = end_normals(topology, normals, last[several])
    beside = take_rows(area, topology.faces[first]) + take_rows(area, topology.faces[last])
    return EdgeEnds(
        topology.edges, chord, end_normals(topology, normals, first), several, others, beside, topology.interior
    )


def end_tangents(
    ends: EdgeEnds,
    lines: Floats,
    sharp: Bools,
    corners: Bools,
    points: tuple[Bools, Floats],
    marks: ResolvedMarks,
    directions: Directions,
) -> tuple[Floats, Floats]:
    """Unit tangents ``(E,2,3)`` and bending normals ``(E,3)`` of edges; the normals of the ends are worked on in place.

    ``sharp (E,2)``; of vertices the ``lines (V,3)`` through them, the ``corners (V,)``, and the ``points`` as from
    ``corner_points``.
    """
    chord, several, mean = ends.chord, ends.several, ends.normals
    one, other = mean[several], ends.others
    mean[several] = np.where((one == other).all(axis=2, keepdims=True), one, (one + other) / 2)
    bending = bending_normals(chord, mean[:, 0], mean[:, 1], ends.beside)
    mean[several] = unit(mean[several])
    bent = np.flatnonzero(marks.edge_normals.any(axis=1))
    bending[bent] = _marked_bending(marks.edge_normals[bent], bending[bent], chord[bent])
    pointed, weight = points
    tangents = np.empty((3, 2, len(chord))).transpose(2, 1, 0)
    lined: Bools = np.asarray(lines.any(axis=1))
    for end in (0, 1):
        at = ends.edges[:, end]
        tangents[:, end] = directions(chord, mean[:, end], bending)
        tangents[bent, end] = smooth_tangents(chord[bent], mean[bent, end], bending[bent])
        split = np.flatnonzero(sharp[several, end])
        rows = several[split]
        along = unit(chord[rows])
        tangents[rows, end] = _crease_tangents(
            along, one[split, end], other[split, end], mean[rows, end], lines[at[rows]]
        )
        rim = np.flatnonzero(~ends.interior & lined[at])
        line = lines[at[rim]]
        line *= np.where(dot(line, chord[rim]) < 0, -1.0, 1.0)
        tangents[rim, end] = unit(line - dot(line, mean[rim, end]) * mean[rim, end])
        stiff = np.flatnonzero(pointed[at] | (corners[at] & (sharp[:, end] | ~ends.interior)))
        share, along = weight[at[stiff], None], unit(chord[stiff])
        tangents[stiff, end] = unit((1 - share) * tangents[stiff, end] + share * along)
    tangents[marks.straight] = unit(chord[marks.straight])[:, None]
    return tangents, bending


def corner_points(topology: Topology, sharp: Bools, marked: Floats) -> tuple[Bools, Floats]:
    """Corner vertices all of whose edges leave along their chords ``(V,)``, and the share of the chords ``(V,)``.

    Those marked with a sharpness ``(V,)`` that fewer than two creases or boundaries run into: the tip of a cone.
    """
    if not marked.any():
        return np.zeros(len(marked), dtype=bool), np.ones(len(marked))
    line = sharp | ~topology.interior[:, None]
    lines = np.bincount(topology.edges[line], minlength=topology.vertex_count)
    return (marked > 0) & (lines < 2), np.where(marked > 0, marked, 1.0)


def _marked_bending(marked: Floats, own: Floats, chord: Floats) -> Floats:
    """Marked edge normals ``(k,3)``, or the edges' own where a mark lies along its edge."""
    along = unit(chord)
    across = marked - dot(marked, along) * along
    weak = np.linalg.norm(across, axis=1, keepdims=True) < ALONG * np.linalg.norm(marked, axis=1, keepdims=True)
    return np.where(weak, own, marked)


def end_normals(topology: Topology, normals: Floats, half_edges: Ints) -> Floats:
    """Normals ``(E,2,3)`` of the face of the given half-edges at the two ends in canonical direction."""
    tail, head, forward = half_edges, topology.next[half_edges], topology.forward[half_edges]
    ends = np.empty((2, 3, len(half_edges)))
    for end, corners in enumerate((pick(forward, tail, head), pick(forward, head, tail))):
        ends[end] = take_rows(normals, corners).T
    return ends.transpose(2, 0, 1)


def _crease_tangents(along: Floats, left: Floats, right: Floats, mean: Floats, line: Floats) -> Floats:
    """Tangent ``(k,3)`` where two normals meet: their common perpendicular, towards the line or the edge.

    Where the normals agree, as on a crease in a flat place, the line itself, or the edge projected into their plane.
    """
    line = line * np.where(dot(line, along) < 0, -1.0, 1.0)
    has_line = line.any(axis=1, keepdims=True)
    guide = np.where(has_line, line, along)
    across = cross(left, right)
    turn = np.linalg.norm(across, axis=1, keepdims=True)
    projected = unit(along - dot(along, mean) * mean)
    across = np.where(turn < NO_TURN, np.where(has_line, line, projected), unit(across))
    tangent = across * np.where(dot(across, guide) < 0, -1.0, 1.0)
    return np.where(dot(tangent, along) < LEAST_ADVANCE, projected, tangent)


def _fit_normals(
    topology: Topology, normals: Floats, tangents: Floats, corners: Bools
) -> tuple[Floats, int]:
    """Make every corner normal perpendicular to the two edge curves that meet there.

    At corner vertices that defines the normals. Elsewhere the tangents were made for the normals, except
    where no curve could serve all faces of an edge: those corners are counted.
    """
    before, count, forward = topology.prev, len(tangents), topology.forward
    rows = tangents.transpose(2, 1, 0).reshape(3, -1).T  # those at the starts of all edges, then those at their ends
    leave, arrive = topology.edge + count * ~forward, (topology.edge + count * forward)[before]
    out, back = take_rows(rows, leave), take_rows(rows, arrive)
    own = corners[topology.vertices]
    refit = own | is_tilted(normals, out, back)
    if not refit.any():
        return normals, 0
    out = out[refit] * np.where(forward[refit], 1.0, -1.0)[:, None]
    back = back[refit] * np.where(forward[before[refit]], -1.0, 1.0)[:, None]
    normals = normals.copy()
    normals[refit] = upright_normals(normals[refit], out, back)
    return normals, int((refit & ~own).sum())


def is_tilted(normals: Floats, out: Floats, back: Floats) -> Bools:
    """Corners ``(C,)`` whose ``normals`` are not perpendicular to the unit tangents ``out`` and ``back (C,3)``."""
    return np.maximum(np.abs(dot(normals, out)), np.abs(dot(normals, back)))[:, 0] > TILTED


def upright_normals(normals: Floats, out: Floats, back: Floats) -> Floats:
    """Unit vectors ``(k,3)`` perpendicular to the tangents ``out`` and ``back (k,3)``, on the side of ``normals``."""
    upright = cross(out, back)
    flattened = normals - dot(normals, out) * out
    along = np.linalg.norm(flattened, axis=1, keepdims=True) < 1e-6
    flattened = np.where(along, perpendicular(out), unit(flattened))
    collinear = np.linalg.norm(upright, axis=1, keepdims=True) < 1e-6
    fitted = unit(upright) * np.where(dot(upright, normals) < 0, -1.0, 1.0)
    return np.where(collinear, flattened, fitted)
