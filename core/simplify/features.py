"""Creases, normals and flat faces of the coarse mesh, taken from the dense one.

The normal of a sector is the direction most nearly across the tangents of its edges: the smallest eigenvector of the
sum of t t^T. The tangent of a smooth edge at an end is its chord laid into the plane of the dense faces near that
end, on both sides of it; that of a crease or a boundary the direction in which the dense mesh's edges set out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.arrays import distinct
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import perpendicular, sum_by, unit
from curvify.polygons import next_corners
from curvify.simplify.polygons import Polygons, ranges, shapes_of
from curvify.simplify.triangles import Triangles
from curvify.simplify.vsa import Metric, proxies, region_errors
from curvify.topology import Topology, components, corner_links

#: Angle between regions that makes an edge a crease (degrees) where both deviate less than the second (rms).
BENT, EVEN = 40.0, 15.0
#: How far from an edge's end its tangent is measured, as a share of its length.
REACH = 0.3
#: Weight of the tangent of a crease or a boundary.
LINE_WEIGHT = 2.0
#: Edges of a sector with a ratio of the larger eigenvalues below this are nearly collinear.
COLLINEAR = 0.03


def sharp_half_edges(mesh: Triangles, angle: float) -> Bools:
    """Half-edges ``(3F,)`` on the boundary or where the faces meet at more than ``angle`` degrees."""
    other = mesh.normals[np.maximum(mesh.twin, 0) // 3]
    own = np.repeat(mesh.normals, 3, axis=0)
    known = own.any(axis=1) & other.any(axis=1)
    bent = np.einsum("hi,hi->h", own, other) < np.cos(np.radians(angle))
    return (mesh.twin < 0) | (bent & known)


def find_creases(mesh: Triangles, metric: Metric, labels: Ints, polygons: Polygons) -> Bools:
    """Half-edges ``(C,)`` of polygons that are creases, boundaries included.

    An edge is one where most of its path is sharp, or where two even regions meet at a large angle.
    """
    topology = polygons.topology(mesh.positions)
    twin = topology.twin
    count = int(labels.max()) + 1
    normals = proxies(metric, labels, count)
    area = np.bincount(labels, metric.weights, count)
    deviation = np.sqrt(region_errors(metric, labels) / np.maximum(area, 1e-300))
    even = deviation < 2 * np.sin(np.radians(EVEN) / 2)
    own, other = polygons.regions, polygons.regions[np.maximum(twin, 0)]
    bent = np.einsum("ni,ni->n", normals[own], normals[other]) < np.cos(np.radians(BENT))
    crease = _sharp_share(mesh, polygons) > 0.5
    crease |= (own != other) & bent & even[own] & even[other]
    crease[twin < 0] = True
    both = twin >= 0
    crease[both] |= crease[twin[both]]
    return crease


def _sharp_share(mesh: Triangles, polygons: Polygons) -> Floats:
    """Share of each half-edge's path, by length, that is sharp."""
    ahead = _path_ends(polygons)
    steps, which = polygons.path_corners(np.arange(len(polygons.vertices)))
    length = np.linalg.norm(mesh.positions[polygons.steps[steps]] - mesh.positions[ahead], axis=1)
    total = np.bincount(which, length, len(polygons.vertices))
    sharp = np.bincount(which, length * polygons.sharp[steps], len(polygons.vertices))
    return sharp / np.where(total > 0, total, 1.0)


def _path_ends(polygons: Polygons) -> Ints:
    """The vertex at the end of each step of all paths, in the order of `Polygons.path_corners`."""
    steps, which = polygons.path_corners(np.arange(len(polygons.vertices)))
    heads = polygons.vertices[next_corners(polygons.offsets)]
    ends = np.append(polygons.steps[steps[1:]], 0)
    last = np.append(which[1:] != which[:-1], True)
    ends[last] = heads
    return ends


@dataclass(eq=False)
class Ends:
    """Edge ends at which tangents are taken: ``half_edges (n,)`` that leave the ``vertices (n,)``, or arrive there
    where ``arrives``; ``sectors (n,)``; ``regions (n,2)`` on both sides; ``lines (n,)`` creases and boundaries.
    """

    half_edges: Ints
    arrives: Bools
    vertices: Ints
    sectors: Ints
    regions: Ints
    lines: Bools


def sectors_of(topology: Topology, creases: Bools) -> Ints:
    """Sector ``(C,)`` of each corner, 0, 1, ...: corners joined across edges that are no creases."""
    a, b = corner_links(topology)
    one = np.flatnonzero(topology.twin > np.arange(len(topology.twin)))
    smooth = np.tile(~creases[one], 2)
    return distinct(components(len(topology.vertices), a[smooth], b[smooth]))[1]


def sector_normals(mesh: Triangles, labels: Ints, polygons: Polygons, creases: Bools) -> Floats:
    """Unit normal of each corner ``(C,3)``, one for each sector."""
    topology = polygons.topology(mesh.positions)
    sectors = sectors_of(topology, creases)
    count = int(sectors.max()) + 1
    ring_pairs, ring = _ring_normals(mesh, labels, polygons, topology, sectors, count)
    ends = _edge_ends(polygons, topology, sectors, creases)
    tangents = np.where(
        ends.lines[:, None],
        _line_directions(mesh, polygons, topology, ends),
        _surface_directions(mesh, labels, topology, ends, ring_pairs, ring),
    )
    weight = np.where(ends.lines, LINE_WEIGHT, 1.0)
    spread = np.stack(
        [
            np.bincount(ends.sectors, weight * tangents[:, i] * tangents[:, j], count)
            for i in range(3)
            for j in range(3)
        ],
        axis=1,
    )
    values, vectors = np.linalg.eigh(spread.reshape(-1, 3, 3))
    normals = vectors[:, :, 0] * np.where(np.einsum("si,si->s", vectors[:, :, 0], ring) < 0, -1.0, 1.0)[:, None]
    along = vectors[:, :, 2]
    weak = (values[:, 1] < COLLINEAR * values[:, 2]) | (np.einsum("si,si->s", normals, ring) < 0.3)
    across = unit(ring - np.einsum("si,si->s", ring, along)[:, None] * along)
    normals[weak] = across[weak]
    lost = ~normals.any(axis=1)
    normals[lost] = perpendicular(along[lost])
    return normals[sectors]


def _ring_normals(
    mesh: Triangles, labels: Ints, polygons: Polygons, topology: Topology, sectors: Ints, count: int
) -> tuple[tuple[Ints, Ints], Floats]:
    """Pairs of coarse vertices and dense faces around them, and each sector's mean normal of these ``(S,3)``.

    Where the faces cancel, the polygons' own normals serve.
    """
    used = np.zeros(len(mesh.positions), dtype=bool)
    used[polygons.vertices] = True
    corner = np.flatnonzero(used[mesh.tails])
    vertex, face = mesh.tails[corner], corner // 3
    kinds = np.int64(int(labels.max()) + 1)
    keys = np.concatenate([polygons.vertices * kinds + polygons.regions] * 2)
    keys[len(polygons.vertices) :] = polygons.vertices * kinds + polygons.regions[topology.prev]
    order = np.argsort(keys, kind="stable")
    wanted = vertex * kinds + labels[face]
    found = order[np.minimum(np.searchsorted(keys[order], wanted), len(order) - 1)]
    known = keys[found] == wanted
    sector = np.concatenate([sectors, sectors])[found]
    normals = mesh.normals * mesh.areas[:, None]
    ring = unit(sum_by(sector[known], normals[face[known]], count))
    shapes = shapes_of(mesh.positions, polygons.vertices, polygons.sides)
    own = sum_by(sectors, (shapes.normals * shapes.areas[:, None])[topology.faces], count)
    lost = ~ring.any(axis=1)
    ring[lost] = unit(own)[lost]
    return (vertex, face), ring


def _edge_ends(polygons: Polygons, topology: Topology, sectors: Ints, creases: Bools) -> Ends:
    """The ends of all edges: once for smooth ones, once for each side for the others."""
    half_edges = np.arange(len(topology.twin))
    once = half_edges[creases | (half_edges < topology.twin)]
    twin = topology.twin[once]
    regions = np.stack([polygons.regions[once], polygons.regions[np.where(twin < 0, once, twin)]], axis=1)
    heads = topology.next[once]
    return Ends(
        np.concatenate([once, once]),
        np.repeat([False, True], len(once)),
        np.concatenate([polygons.vertices[once], polygons.vertices[heads]]),
        np.concatenate([sectors[once], sectors[heads]]),
        np.concatenate([regions, regions]),
        np.concatenate([creases[once], creases[once]]),
    )


def _chords(mesh: Triangles, topology: Topology, ends: Ends) -> Floats:
    """Vectors from each end's vertex to the other end."""
    tails, heads = topology.vertices[ends.half_edges], topology.vertices[topology.next[ends.half_edges]]
    step = mesh.positions[heads] - mesh.positions[tails]
    return np.where(ends.arrives[:, None], -step, step)


def _surface_directions(
    mesh: Triangles, labels: Ints, topology: Topology, ends: Ends, ring_pairs: tuple[Ints, Ints], ring: Floats
) -> Floats:
    """Chords laid into the plane of the dense faces beside them, near each end; unit ``(n,3)``."""
    chord = _chords(mesh, topology, ends)
    reach = REACH * np.linalg.norm(chord, axis=1)
    smooth = np.flatnonzero(~ends.lines)
    if not len(smooth):
        return chord
    first, count, faces, distance = _faces_near(mesh, ends.vertices[smooth], reach[smooth], ring_pairs)
    pair, which = ranges(first, count)
    end, face = smooth[which], faces[pair]
    near = distance[pair] <= reach[end]
    near &= (labels[face][:, None] == ends.regions[end]).any(axis=1)
    near &= np.einsum("ni,ni->n", mesh.normals[face], ring[ends.sectors[end]]) > 0.2
    end, face = end[near], face[near]
    normal = unit(sum_by(end, mesh.normals[face] * mesh.areas[face][:, None], len(chord)))
    bare = ~normal.any(axis=1)
    normal[bare] = ring[ends.sectors[bare]]
    return unit(chord - np.einsum("ni,ni->n", chord, normal)[:, None] * normal)


def _faces_near(
    mesh: Triangles, vertices: Ints, reach: Floats, ring_pairs: tuple[Ints, Ints]
) -> tuple[Ints, Ints, Ints, Floats]:
    """Dense faces with their centroids within reach of a vertex, and those around it at distance 0.

    For each query the first and the number of its faces; the faces of all and their distances.
    """
    from scipy.spatial import cKDTree

    places, query = distinct(vertices)
    widest = np.zeros(len(places))
    np.maximum.at(widest, query, reach)
    tree = cKDTree(mesh.centroids)
    found = tree.query_ball_point(mesh.positions[places], widest, return_sorted=True)
    sizes = np.fromiter((len(part) for part in found), dtype=np.int64, count=len(found))
    face = np.concatenate([np.asarray(part, dtype=np.int64) for part in found]) if len(found) else sizes
    place = np.repeat(np.arange(len(places)), sizes)
    distance = np.linalg.norm(mesh.centroids[face] - mesh.positions[places[place]], axis=1)
    around = np.searchsorted(places, ring_pairs[0])
    around_fine = (around < len(places)) & (places[np.minimum(around, len(places) - 1)] == ring_pairs[0])
    place = np.concatenate([around[around_fine], place])
    face = np.concatenate([ring_pairs[1][around_fine], face])
    distance = np.concatenate([np.zeros(int(around_fine.sum())), distance])
    order = np.lexsort((distance, face, place))
    key = place[order] * np.int64(mesh.face_count) + face[order]
    order = order[np.diff(key, prepend=-1) != 0]
    first = np.searchsorted(place[order], np.arange(len(places) + 1))
    return first[query], np.diff(first)[query], face[order], distance[order]


def _line_directions(mesh: Triangles, polygons: Polygons, topology: Topology, ends: Ends) -> Floats:
    """Direction from each end to the place on its path at `REACH` of the chord; unit ``(n,3)``."""
    chord = _chords(mesh, topology, ends)
    reach = REACH * np.linalg.norm(chord, axis=1)
    size = polygons.sizes[ends.half_edges]
    step, which = ranges(np.zeros_like(size), size + 1)
    start, arrives = polygons.starts[ends.half_edges][which], ends.arrives[which]
    # Along the path, or back along it from its head.
    index = np.where(arrives, size[which] - step, step)
    inside = index < size[which]
    heads = topology.vertices[topology.next[ends.half_edges]][which]
    path = np.where(inside, polygons.steps[start + np.where(inside, index, 0)], heads)
    points = mesh.positions[path]
    length = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    length[step == 0] = 0.0
    total = np.cumsum(length)
    total -= total[np.cumsum(size + 1) - size - 1][which]
    # The last place within reach, and how far to go from there to the next.
    within = total <= reach[which]
    last = np.cumsum(size + 1) - size - 1 + np.maximum(np.bincount(which, within, len(size)).astype(np.int64) - 1, 0)
    end_of = np.cumsum(size + 1) - 1
    after = np.minimum(last + 1, end_of)
    gap = total[after] - total[last]
    share = np.where(gap > 0, (reach - total[last]) / np.where(gap > 0, gap, 1.0), 0.0)
    place = points[last] + np.clip(share, 0, 1)[:, None] * (points[after] - points[last])
    return unit(place - mesh.positions[ends.vertices])
