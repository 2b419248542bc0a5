"""The first pass of normal-based subdivision, over polygons of any size: afterwards there are only triangles.

A quad becomes 8 triangles around its center, a polygon with n > 4 sides 4 n around its apex; where some edges are not
split, the corners and middles of the outline make a fan about the center. Source: van Overveld, Wyvill, sections 2.5
and 2.6; normals inside, diagonals and fans are ours (docs/triangles.md).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curvify.arrays import cross, distinct, values_of
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import dot, unit
from curvify.records import record
from curvify.schemes.overveld_cuts import cuts
from curvify.schemes.overveld_pass import (
    EdgeSides,
    FaceNormals,
    Rules,
    Triangles,
    edge_sides,
    middle_wedges,
    middles,
    plain_sides,
    solve_sides,
)
from curvify.topology import Topology, canonical_direction

#: Weights of a cubic and of its derivative at 1/2.
_VALUE, _SLOPE = np.array([1, 3, 3, 1]) / 8, np.array([-1, -1, 1, 1]) * 0.75


@record
class Polygons:
    """The coarse mesh: ``topology`` of its convex polygons, the last edges of which are diagonals of cut faces
    ``inner_faces (D,)``, ascending; ``positions (V,3)``; wedges as in ``Triangles``, ``wedges (C,)`` those of the
    corners; ``source_faces (P,)``.
    """

    positions: Floats
    values: Floats
    repeats: Ints
    topology: Topology
    wedges: Ints
    source_faces: Ints
    inner_faces: Ints

    def as_triangles(self) -> Triangles | None:
        """The same mesh if it has only triangles and no cut faces."""
        topology = self.topology
        if len(self.inner_faces) or (topology.sizes != 3).any():
            return None
        faces, wedges, edges = (array.reshape(-1, 3) for array in (topology.vertices, self.wedges, topology.edge))
        return Triangles(
            self.positions, self.values, self.repeats, faces, wedges, edges, topology.edges, self.source_faces
        )

    def sides(self) -> EdgeSides:
        """The sides of the edges."""
        topology = self.topology
        if not len(self.repeats):
            return plain_sides(topology.edges, topology.edge)
        heads = self.wedges[topology.next]
        return edge_sides(topology.edges, topology.edge, topology.vertices, self.wedges, heads)


class _Numbers(NamedTuple):
    """New vertices of a pass: ``total`` vertices afterwards, ``middles (E,)`` the one on each split edge (-1: none),
    ``inside (P,)`` the first one inside each polygon.
    """

    total: int
    middles: Ints
    inside: Ints


def subdivide_polygons(mesh: Polygons, rules: Rules, apex: float) -> Triangles:
    """The mesh after the first pass. ``apex`` moves apexes from the mean of the inner control points (0) to that of the
    corners (1).
    """
    topology, before = mesh.topology, len(mesh.positions)
    split = rules.split(mesh.positions, topology.edges)
    sides = mesh.sides()
    inside = _inside_counts(topology, split)
    numbers = _number(mesh, split, inside)
    position, value = middles(mesh.positions, mesh.values, topology.edges, sides, np.flatnonzero(split), rules)
    positions, values = np.empty((numbers.total, 3)), np.empty((numbers.total, mesh.values.shape[1]))
    positions[:before], values[:before] = mesh.positions, mesh.values[:before]
    places = numbers.middles[split]
    positions[places], values[places] = position, value
    for place, points, own in _insides(mesh, sides, inside, numbers.inside, rules, apex):
        positions[place], values[place] = points, own
    first = numbers.total + len(mesh.repeats)
    extra = middle_wedges(mesh.positions, mesh.values, topology.edges, sides, numbers.middles, first, rules)
    faces, wedges, source = _triangles(mesh, split, numbers, extra.of_sides[sides.of_half_edges], positions)
    values = np.concatenate([values, mesh.values[before:], extra.values])
    repeats = np.concatenate([mesh.repeats, numbers.middles[extra.repeated]])
    heads = np.roll(faces, -1, axis=1)
    keys, edge = distinct((np.minimum(faces, heads) * numbers.total + np.maximum(faces, heads)).reshape(-1))
    edges = canonical_direction(positions, np.stack(np.divmod(keys, numbers.total), axis=1))
    result = Triangles(positions, values, repeats, faces, wedges, edge.reshape(-1, 3), edges, source)
    if rules.midpoint_normal == "geometry":
        sums = FaceNormals(len(values))
        sums.add(positions, faces, wedges)
        sums.store(values[before : numbers.total], before)
        sums.store(values[first:], first)
    return result


def _inside_counts(topology: Topology, split: Bools) -> Ints:
    """Number of new vertices inside each polygon ``(P,)``: none in a triangle, the center, and spokes if n > 4 sides
    are all split.
    """
    sizes = topology.sizes
    whole = np.logical_and.reduceat(split[topology.edge], topology.offsets[:-1])
    return np.where(sizes == 3, 0, 1 + np.where(whole & (sizes > 4), sizes, 0))


def _number(mesh: Polygons, split: Bools, inside: Ints) -> _Numbers:
    """Number the new vertices: middles of edges, then face by face those of its diagonals and of its pieces."""
    outer = len(split) - len(mesh.inner_faces)
    first = len(mesh.positions) + int(split[:outer].sum())
    across = np.concatenate([[0], np.cumsum(split[outer:])])
    before = np.concatenate([[0], np.cumsum(inside)])
    middles = np.where(split, len(mesh.positions) + np.cumsum(split) - 1, -1)
    earlier = np.searchsorted(mesh.source_faces, mesh.inner_faces, side="left")
    middles[outer:] = np.where(split[outer:], first + across[:-1] + before[earlier], -1)
    starts = first + before[:-1] + across[np.searchsorted(mesh.inner_faces, mesh.source_faces, side="right")]
    return _Numbers(first + int(before[-1] + across[-1]), middles, starts)


def _insides(
    mesh: Polygons, sides: EdgeSides, counts: Ints, starts: Ints, rules: Rules, apex: float
) -> list[tuple[Ints, Floats, Floats]]:
    """Places, positions and values of the vertices inside polygons, by size."""
    topology = mesh.topology
    every = np.arange(len(topology.edges))
    curves = solve_sides(mesh.positions, mesh.values, topology.edges, sides, every, rules.edge_rule)[0]
    first, second = (np.ascontiguousarray(points) for points in curves.controls())
    forward = topology.forward[:, None]
    out = np.where(forward, first[topology.edge], second[topology.edge])
    back = np.where(forward, second[topology.edge], first[topology.edge])
    found = []
    for size in values_of(topology.sizes):
        if size == 3:
            continue
        polygons = np.flatnonzero(topology.sizes == size)
        corners = topology.offsets[polygons][:, None] + np.arange(size)
        points, values = mesh.positions[topology.vertices[corners]], mesh.values[mesh.wedges[corners]]
        inner = out[corners] + np.roll(back[corners], 1, axis=1) - points
        if size == 4:
            center, normal = _quad_center(points, out[corners], back[corners], inner)
        else:
            center = apex * points.mean(axis=1) + (1 - apex) * inner.mean(axis=1)
            arms = inner - center[:, None]
            normal = unit(cross(arms, np.roll(arms, -1, axis=1)).sum(axis=1)) + 0.0
        middle = values.mean(axis=1)
        lost = ~normal.any(axis=1, keepdims=True)
        mean = unit(middle[:, :3])
        middle[:, :3] = np.where(lost, np.where(mean.any(axis=1, keepdims=True), mean, values[:, 0, :3]), normal)
        found.append((starts[polygons], center, middle))
        spoked = np.flatnonzero(counts[polygons] > 1)
        if len(spoked):
            spokes = (points + 2 * inner + center[:, None])[spoked] / 4
            values = _spoke_values(points[spoked], values[spoked], center[spoked], middle[spoked])
            places = starts[polygons[spoked]][:, None] + 1 + np.arange(size)
            found.append((places.reshape(-1), spokes.reshape(-1, 3), values.reshape(len(spoked) * size, -1)))
    return found


def _quad_center(points: Floats, out: Floats, back: Floats, inner: Floats) -> tuple[Floats, Floats]:
    """Centers and unit normals ``(f,3)`` of bicubic quads: corners, the controls after and before the sides' ends, and
    the inner ones ``(f,4,3)``.
    """
    p, i = np.moveaxis(points, 1, 0), np.moveaxis(inner, 1, 0)
    a, b = np.moveaxis(out, 1, 0), np.moveaxis(back, 1, 0)
    net = np.stack(
        [
            np.stack([p[0], a[0], b[0], p[1]]),
            np.stack([b[3], i[0], i[1], a[1]]),
            np.stack([a[3], i[3], i[2], b[1]]),
            np.stack([p[3], b[2], a[2], p[2]]),
        ]
    )
    center, along, across = (
        np.einsum("r,s,rsfi->fi", row, column, net)
        for row, column in ((_VALUE, _VALUE), (_VALUE, _SLOPE), (_SLOPE, _VALUE))
    )
    return center, unit(cross(along, across)) + 0.0


def _spoke_values(points: Floats, values: Floats, center: Floats, middle: Floats) -> Floats:
    """Values ``(f,n,3+c)`` halfway between corners and apex: normals the mean of both across the line between."""
    total = values + middle[:, None]
    result = total / 2
    away = center[:, None] - points
    square = dot(away, away)
    plain = total[..., :3]
    normal = unit(plain - dot(plain, away) / np.where(square > 0, square, 1.0) * away)
    normal = np.where(normal.any(axis=2, keepdims=True), normal, unit(plain))
    result[..., :3] = np.where(normal.any(axis=2, keepdims=True), normal, values[..., :3]) + 0.0
    return result


def _triangles(
    mesh: Polygons, split: Bools, numbers: _Numbers, middle_wedges: Ints, positions: Floats
) -> tuple[Ints, Ints, Ints]:
    """Vertices, wedges ``(F,3)`` and source faces of the new triangles, polygon by polygon."""
    topology = mesh.topology
    before = len(mesh.positions)
    corner_wedges = np.where(mesh.wedges < before, mesh.wedges, mesh.wedges + numbers.total - before)
    groups: list[tuple[Ints, Ints, Ints]] = []
    for size in values_of(topology.sizes):
        polygons = np.flatnonzero(topology.sizes == size)
        corners = topology.offsets[polygons][:, None] + np.arange(size)
        inside = numbers.inside[polygons][:, None] + np.arange(1 + size)
        vertices = np.concatenate([topology.vertices[corners], numbers.middles[topology.edge[corners]], inside], axis=1)
        wedges = np.concatenate([corner_wedges[corners], middle_wedges[corners], inside], axis=1)
        cut = split[topology.edge[corners]]
        if size == 3:
            parts = [(local.nodes, hit) for local, hit in cuts(cut, positions, vertices[:, :6])]
        else:
            parts = _polygon_cuts(cut)
        groups += [(polygons[hit], vertices[hit][:, nodes], wedges[hit][:, nodes]) for nodes, hit in parts]
    counts = np.zeros(len(topology.sizes), dtype=np.int64)
    for faces, nodes, _ in groups:
        counts[faces] = nodes.shape[1]
    starts = np.cumsum(counts) - counts
    corners_of, wedges_of = np.empty((2, int(counts.sum()), 3), dtype=np.int64)
    for faces, nodes, own in groups:
        places = starts[faces][:, None] + np.arange(nodes.shape[1])
        corners_of[places], wedges_of[places] = nodes, own
    return corners_of, wedges_of, np.repeat(mesh.source_faces, counts)


def _polygon_cuts(split: Bools) -> list[tuple[Ints, Ints]]:
    """Triangles ``(t,3)`` for polygons of one size, by which sides are ``split (f,n)``, and the polygons.

    Nodes: corners, middles of sides, center, middles of spokes.
    """
    size = split.shape[1]
    keys = split @ (1 << np.arange(size, dtype=object)) if size > 62 else split @ (1 << np.arange(size))
    patterns, which = np.unique(keys, return_inverse=True)
    result: list[tuple[Ints, Ints]] = []
    for index in range(len(patterns)):
        hit = np.flatnonzero(which == index)
        own = split[hit[0]]
        i = np.arange(size)
        after, before = (i + 1) % size, (i - 1) % size
        middle, spoke, center = size + i, 2 * size + 1 + i, np.full(size, 2 * size)
        if not own.all():
            ring = np.stack([i, middle], axis=1)[np.stack([np.ones(size, dtype=bool), own], axis=1)]
            nodes = np.stack([ring, np.roll(ring, -1), np.full(len(ring), 2 * size)], axis=1)
        elif size == 4:
            nodes = np.stack([i, middle, middle[before], middle, center, middle[before]], axis=1).reshape(-1, 3)
        else:
            parts = [i, middle, spoke, middle, after, spoke[after], spoke[after], center, spoke]
            nodes = np.stack([*parts, middle, spoke[after], spoke], axis=1).reshape(-1, 3)
        result.append((nodes, hit))
    return result
