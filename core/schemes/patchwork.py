"""Patches of a polygon mesh before their insides are filled: split faces, edge curves, shared normal fields.

Faces are split where no patch can serve them: concave or keyhole outlines, too many sides, and corners or sides
where the patch would fold (Leung, Wang, Zhang, section 2.3; the fold tests are ours, docs/mathematics.md).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from curvify.arrays import as_slice, cross, gather, leading, take_rows, unit_rows, values_of
from curvify.convex import Split, split_at_corners, split_polygons
from curvify.edges import Directions, bending_normals, edge_curves, normal_fields, smooth_tangents
from curvify.mesh import Bools, Floats, Ints
from curvify.pieces import MAX_SIDES, split_notes
from curvify.polygons import newell_normals
from curvify.prepare import Coarse
from curvify.records import field, record
from curvify.sampling import Sampling
from curvify.schemes.base import (
    BezierEdges,
    Edges,
    PatchClass,
    Patches,
    bernstein,
    bernstein_basis,
    bernstein_slope,
    bernstein_slopes,
)
from curvify.schemes.cross_tangents import Sides
from curvify.sectors import Features, end_normals, sides_of_edges
from curvify.topology import Topology, link_half_edges
from curvify.words import count_of

#: A corner of a patch must open by at least the angle with this sine (3 degrees).
LEAST_CORNER_SINE = float(np.sin(np.radians(3.0)))
#: Corners whose sine is below this in size do not open at all.
FLAT_CORNER = 1e-9
#: Rounds of making corners and of splitting folded faces.
ROUNDS = 4
#: Patches looked at together in the fold tests, and normal fields.
WINDOW, CONES = 512, 2048
#: Abscissae at which sides are tested.
PLACES = np.arange(1, 10) / 10


class Inward(Protocol):
    """Cross tangents, as far as the fold test asks: on which side of its edges a patch begins."""

    @property
    def sides(self) -> Sides:
        """Side data of the patches."""

    def towards(self, direction: Floats, t: Floats) -> Floats:
        """Product ``(f,n,m)`` of vectors ``(3,f,n,m)`` at ``t (m,)`` with T, up to a positive factor; the vectors are
        perpendicular to the edge's normal field.
        """


@record
class Patchwork:
    """Pieces of faces with their curves and normals.

    ``topology`` of the pieces; ``split`` where they come from, in terms of the cleaned loops; per edge
    ``curves (3,E,d+1)``; ``fields (3,N,q+1)`` edge normals and ``side_field (C,)`` the one of each half-edge; ``normals
    (C,3)`` of the corners. In memory the points of an edge lie together.
    """

    coarse: Coarse
    features: Features
    split: Split
    topology: Topology
    curves: Floats
    fields: Floats
    side_field: Ints
    normals: Floats
    warnings: list[str] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)

    @classmethod
    def on(
        cls, coarse: Coarse, features: Features, split: Split, frame: Frame, curves: Floats, fields: Floats
    ) -> Patchwork:
        """The pieces of a frame with ``curves (E,d+1,3)`` and ``fields (N,q+1,3)``."""
        curves, fields = curves.transpose(2, 0, 1), fields.transpose(2, 0, 1)
        return cls(coarse, features, split, frame.topology, curves, fields, frame.side_field, frame.normals)

    @cached_property
    def steps(self) -> tuple[Floats, Floats]:
        """Steps ``(3,C)`` from each corner to the next points of its two cubic curves, ahead and back."""
        return _corner_tangents(self.topology, self.coarse.positions, self.curves.transpose(1, 2, 0))

    @cached_property
    def sines(self) -> Floats:
        """Sine ``(C,)`` of the angle between the two steps at each corner, negative where the patch folds there."""
        return _corner_sines(*self.steps, self.normals)

    def corner_points(self, corners: Ints) -> Floats:
        """Positions ``(3,f,n)`` of corners ``(f,n)``."""
        return leading(take_rows(self.coarse.positions, self.topology.vertices[corners]))

    def corner_normals(self, corners: Ints) -> Floats:
        """Normals ``(3,f,n)`` of corners ``(f,n)``."""
        return leading(take_rows(self.normals, corners))

    def side_curves(self, corners: Ints) -> Floats:
        """Bezier points ``(3,f,n,d+1)`` of the half-edges ``(f,n)``, each in its own direction."""
        return self.in_direction(self.curves, self.topology.edge[corners], corners)

    def side_fields(self, corners: Ints) -> Floats:
        """Bezier points ``(3,f,n,q+1)`` of the normal fields of the half-edges ``(f,n)``."""
        return self.in_direction(self.fields, self.side_field[corners], corners)

    def in_direction(self, points: Floats, rows: Ints, corners: Ints) -> Floats:
        """The Bezier points ``(3,f,n,d)`` of some rows of ``points (3,N,d)``, turned where half-edges run backward.

        In memory the faces come last.
        """
        size = points.shape[2]
        stored = points.transpose(1, 2, 0).reshape(-1, 3 * size)
        found = leading(take_rows(stored, rows)).reshape(size, 3, *rows.shape)
        forward = np.asfortranarray(self.topology.forward[corners])
        return np.where(forward, found, found[::-1]).transpose(1, 2, 3, 0)

    def size_classes(self) -> Iterator[tuple[int, Ints]]:
        """Polygon sizes and the pieces ``(f,)`` of each."""
        sizes = self.topology.sizes
        for size in values_of(sizes):
            yield size, np.flatnonzero(sizes == size)

    def patches(self, classes: list[PatchClass], sampling: Callable[[int, int], Sampling]) -> Patches:
        """Everything a backend and the numbering need."""
        edges = BezierEdges(self.curves, self.fields)
        patches = assemble_patches(
            self.coarse, self.split, self.topology, edges, self.side_field, self.normals, sampling
        )
        patches.classes = classes
        patches.warnings += self.warnings
        patches.counts |= self.counts
        return patches


def assemble_patches(
    coarse: Coarse,
    split: Split,
    topology: Topology,
    edges: Edges,
    side_field: Ints,
    normals: Floats,
    sampling: Callable[[int, int], Sampling],
) -> Patches:
    """Patches over the pieces of a split mesh, their classes still missing."""
    loops = coarse.loops
    return Patches(
        positions=coarse.positions,
        topology=topology,
        source_faces=loops.source_faces[split.source_faces],
        source_corners=loops.source_corners[split.source_corners],
        stand_in=coarse.stand_in,
        inner_faces=loops.source_faces[split.diagonal_faces],
        edges=edges,
        side_field=side_field,
        normals=normals,
        classes=[],
        sampling=sampling,
        mesh=coarse.mesh,
        warnings=list(coarse.warnings),
        counts=dict(coarse.counts),
        marks=coarse.marks.counts,
    )


class FoldRule(NamedTuple):
    """``tangents_of(work, corners)`` gives the scheme's cross tangents of some patches; ``blended``: whether they are,
    but for the part along n_c and a positive factor, between those that the neighboring edges ask for.
    """

    tangents_of: Callable[[Patchwork, Ints], Inward]
    blended: bool


def build_patchwork(coarse: Coarse, lengths: str, split_rule: str, rule: FoldRule) -> Patchwork:
    """Split faces until no patch folds that splitting can save, and build all curves.

    ``lengths`` is the rule of ``edges.tangent_lengths``. What still folds is counted and warned of.
    """
    loops = coarse.loops
    split = split_polygons(coarse.positions, loops.offsets, loops.vertices, rule=split_rule, max_sides=MAX_SIDES)
    corners = np.zeros(len(coarse.positions), dtype=bool)
    work = _build(coarse, coarse.features(corners), split, lengths)
    for _ in range(ROUNDS - 1):
        made = _new_corners(work)
        if not made.any():
            break
        corners |= made
        work = _build(coarse, coarse.features(corners), split, lengths)
    for _ in range(ROUNDS):
        bad, folded = _bad_corners(work, rule)
        wide = work.topology.sizes[work.topology.faces] > 3
        if not (bad & wide).any():
            break
        closer = split_at_corners(coarse.positions, split, bad & wide, work.normals)
        if len(closer.face_offsets) == len(split.face_offsets):
            break
        split = closer
        work = _build(coarse, work.features, split, lengths)
    else:
        bad, folded = _bad_corners(work, rule)
    _note_splits(work, folded)
    return work


@record
class Frame:
    """Pieces of faces and what their edges must do, before a scheme draws its curves.

    ``topology`` of the pieces; ``normals (C,3)`` of their corners; per edge, in canonical direction, ``start``, ``end
    (E,3)``, unit end ``tangents (E,2,3)`` and ``bending (E,3)``. Then the edges' sides: ``side_field (C,)`` numbers
    them for every half-edge; ``half_edges (N,)`` names one half-edge of each and ``pairs (N,2,3)`` its end normals in
    canonical direction. The first E are those of the edges' first half-edges; half-edges with other normals, on
    creases, have one of their own.
    """

    topology: Topology
    normals: Floats
    start: Floats
    end: Floats
    tangents: Floats
    bending: Floats
    side_field: Ints
    half_edges: Ints
    pairs: Floats

    @property
    def side_edges(self) -> Ints:
        """Edge of each side ``(N,)``."""
        return self.topology.edge[self.half_edges]


def edge_frame(
    coarse: Coarse,
    features: Features,
    split: Split,
    directions: Directions = smooth_tangents,
    apart: Bools | None = None,
) -> Frame:
    """The frame of the pieces: the features' tangents on the mesh's edges, ``directions`` on diagonals.

    The half-edges of edges ``apart (E,)`` of the mesh have a side each, also where their normals agree.
    """
    positions, base = coarse.positions, coarse.topology
    topology = piece_topology(coarse, split)
    normals = take_rows(features.normals, split.source_corners)
    count = len(base.edges)
    first, _ = sides_of_edges(topology)
    ends = end_normals(topology, normals, first)
    start, end = take_rows(positions, topology.edges[:, 0]), take_rows(positions, topology.edges[:, 1])
    tangents, bending = features.tangents, features.bending
    if len(topology.edges) > count:
        a, b = ends[count:, 0], ends[count:, 1]
        chord = (end - start)[count:]
        area = newell_normals(positions, split.face_offsets, split.face_vertices)[topology.faces[first[count:]]]
        extra = bending_normals(chord, a, b, area)
        across = np.stack([directions(chord, n, extra) for n in (a, b)], axis=1)
        tangents, bending = np.concatenate([tangents, across]), np.concatenate([bending, extra])
    each = np.zeros(len(topology.edges), dtype=bool)
    if apart is not None:
        each[:count] = apart
    side_field, half_edges, pairs = _sides(topology, normals, first, ends, each)
    return Frame(topology, normals, start, end, tangents, bending, side_field, half_edges, pairs)


def _build(coarse: Coarse, features: Features, split: Split, lengths: str) -> Patchwork:
    """Curves and fields of all edges of the pieces."""
    frame = edge_frame(coarse, features, split)
    curves = edge_curves(frame.start, frame.end, frame.tangents[:, 0], frame.tangents[:, 1], lengths)
    edge = as_slice(frame.side_edges)
    fields = normal_fields(curves[edge], frame.pairs[:, 0], frame.pairs[:, 1], frame.bending[edge])
    return Patchwork.on(coarse, features, split, frame, curves, fields)


def _sides(topology: Topology, normals: Floats, first: Ints, ends: Floats, each: Bools) -> tuple[Ints, Ints, Floats]:
    """Sides of edges as in `Frame`: those of the ``first (E,)`` half-edges have the end normals ``ends (E,2,3)``; edges
    of which ``each`` half-edge needs a side of its own.
    """
    side_field = topology.edge.copy()
    some = np.zeros((topology.vertex_count, 3))
    some[topology.vertices] = normals
    several = (normals != some[topology.vertices]).any(axis=1)
    if not several.any() and not each.any():
        return side_field, first, ends
    split = np.zeros(topology.vertex_count, dtype=bool)
    split[topology.vertices[several]] = True
    near = np.flatnonzero(split[topology.vertices] | split[topology.vertices[topology.next]] | each[topology.edge])
    own, edge = end_normals(topology, normals, near), topology.edge[near]
    differs = (own != ends[edge]).any(axis=(1, 2)) | (each[edge] & (near != first[edge]))
    own, near = own[differs], near[differs]
    order = np.argsort(topology.edge[near], kind="stable")
    own, near = own[order], near[order]
    side_field[near] = len(ends) + np.arange(len(near))
    return side_field, np.concatenate([first, near]), np.concatenate([ends, own])


def piece_topology(coarse: Coarse, split: Split) -> Topology:
    """Topology of the pieces: the mesh's edges keep their numbers, diagonals follow."""
    base = coarse.topology
    if len(split.face_vertices) == len(base.vertices) and not len(split.diagonal_faces):
        return base
    inner = split.diagonals >= 0
    edge = np.where(inner, len(base.edges) + split.diagonals, base.edge[split.source_corners])
    heads = np.empty_like(split.face_vertices)
    heads[:-1] = split.face_vertices[1:]
    heads[split.face_offsets[1:] - 1] = split.face_vertices[split.face_offsets[:-1]]
    diagonals = np.empty((len(split.diagonal_faces), 2), dtype=np.int64)
    diagonals[split.diagonals[inner]] = np.stack([split.face_vertices[inner], heads[inner]], axis=1)
    edges = np.concatenate([base.edges, diagonals])
    return link_half_edges(coarse.positions, split.face_offsets, split.face_vertices, edges, edge)


def _corner_tangents(topology: Topology, positions: Floats, curves: Floats) -> tuple[Floats, Floats]:
    """Steps ``(3,C)`` from each corner to the next points of its two curves ``(E,4,3)``: ahead and back."""
    point = gather(positions, topology.vertices).T
    stored = curves.reshape(-1, 3)
    forward = topology.forward
    out = gather(stored, 4 * topology.edge + np.where(forward, 1, 2)).T - point
    before = topology.prev
    back = gather(stored, (4 * topology.edge + np.where(forward, 2, 1))[before]).T - point
    return out, back


def _corner_sines(out: Floats, back: Floats, normals: Floats) -> Floats:
    """Sine ``(C,)`` between the two curves at each corner, negative where the patch folds there."""
    lengths = np.sqrt(np.einsum("ic,ic->c", out, out) * np.einsum("ic,ic->c", back, back))
    volume = np.einsum("ic,ci->c", cross(out, back, axis=0), normals)
    return np.divide(volume, lengths, out=np.zeros_like(volume), where=lengths > 0)


def _straight_through(work: Patchwork, corners: Ints) -> Bools:
    """Which of some corners lie between two creases or boundaries: those may pass straight through it."""
    topology, features = work.topology, work.features
    before = topology.prev[corners]
    result = np.ones(len(corners), dtype=bool)
    for half_edges, at_start in ((corners, topology.forward[corners]), (before, ~topology.forward[before])):
        edges = topology.edge[half_edges]
        known = edges < len(features.sharp)
        sharp = features.sharp[np.where(known, edges, 0), np.where(at_start, 0, 1)] & known
        result &= sharp | ~topology.interior[edges]
    return result


def _new_corners(work: Patchwork) -> Bools:
    """Vertices ``(V,)`` to make corners: folded, on at least two creases or boundaries, normals computed."""
    made = np.zeros(len(work.coarse.positions), dtype=bool)
    if work.coarse.given is not None:
        return made
    base, features = work.coarse.topology, work.features
    line = features.sharp | ~base.interior[:, None]
    lines = np.bincount(base.edges[line], minlength=len(made))
    made[work.topology.vertices[work.sines < -FLAT_CORNER]] = True
    return made & (lines >= 2) & ~features.corners


def _bad_corners(work: Patchwork, rule: FoldRule) -> tuple[Bools, Bools]:
    """Corners ``(C,)`` from which their faces should be split, and the pieces ``(P,)`` that fold.

    A corner is bad if it opens too little, unless two creases or boundaries pass straight through it by
    construction; a side is bad if its cross tangent does not point inwards, and counts for its narrower corner.
    """
    topology, sines = work.topology, work.sines
    bad = sines <= LEAST_CORNER_SINE
    flat = np.flatnonzero(np.abs(sines) < FLAT_CORNER)
    bad[flat[_straight_through(work, flat)]] = False
    folded = np.zeros(len(topology.offsets) - 1, dtype=bool)
    folded[topology.faces[bad & (sines < FLAT_CORNER)]] = True
    unsure = np.ones(len(folded), dtype=bool)
    if rule.blended:
        unsure = np.bincount(topology.faces[~_surely_inward(work)], minlength=len(folded)) > 0
    for size, patches in work.size_classes():
        patches = patches[unsure[patches]]
        for begin in range(0, len(patches), WINDOW):
            rows = patches[begin : begin + WINDOW]
            corners = topology.offsets[rows][:, None] + np.arange(size)
            inward = _least_inward(rule.tangents_of(work, corners))
            face, side = np.nonzero(inward <= 0)
            if len(face):
                folded[rows[face]] = True
                one, other = corners[face, side], corners[face, (side + 1) % size]
                bad[np.where(sines[one] <= sines[other], one, other)] = True
    return bad, folded


def _least_inward(tangent: Inward) -> Floats:
    """Smallest (C' x T).n_c ``(f,n)`` at some abscissae of each side, up to a positive factor."""
    across = cross(bernstein(tangent.sides.fields, PLACES), bernstein_slope(tangent.sides.curves, PLACES), axis=0)
    return tangent.towards(across, PLACES).min(axis=-1)


def _surely_inward(work: Patchwork) -> Bools:
    """Half-edges ``(C,)`` that ``_least_inward`` need not look at.

    All its vectors n_c x C' lie in one cone, and the cross tangents, between those at the ends, in another, so close
    that no two of them are perpendicular.
    """
    topology = work.topology
    edges = np.empty(work.fields.shape[1], dtype=np.int64)
    edges[work.side_field] = topology.edge
    axes, spread = (np.concatenate(parts, axis=-1) for parts in zip(*_cones(work, edges), strict=True))
    axis = gather(axes.T, work.side_field).T
    out, back = work.steps
    start = np.einsum("ic,ic->c", axis, unit_rows(back))
    end = np.einsum("ic,ic->c", axis, unit_rows(out))[topology.next]
    nearest = np.minimum(start, end)
    nearest = np.where(topology.forward, nearest, -np.maximum(start, end))
    spread = spread[work.side_field]
    # cosines a, b of angles below 90 degrees: their sum is below 90 where a^2 + b^2 > 1
    return (nearest > 0) & (spread > 0) & (nearest**2 + spread**2 > 1 + 1e-9)


def _cones(work: Patchwork, edges: Ints) -> Iterator[tuple[Floats, Floats]]:
    """For each normal field, by windows: the unit vector n_c x C' in the middle of its edge ``(3,w)``, and the smallest
    cosine ``(w,)`` between it and those at the other places, 0 where one vanishes.
    """
    values, slopes = bernstein_basis(3, PLACES).T, bernstein_slopes(3, PLACES).T
    for begin in range(0, len(edges), CONES):
        rows = edges[begin : begin + CONES]
        fields = np.ascontiguousarray(work.fields[:, begin : begin + CONES].transpose(2, 0, 1)).reshape(4, -1)
        curves = np.ascontiguousarray(work.curves[:, as_slice(rows)].transpose(2, 0, 1)).reshape(4, -1)
        normal, speed = (
            (basis @ points).reshape(-1, 3, len(rows)).transpose(1, 0, 2)
            for basis, points in ((values, fields), (slopes, curves))
        )
        across = unit_rows(cross(normal, speed, axis=0))
        axis = across[:, len(PLACES) // 2]
        yield axis, np.einsum("itc,ic->tc", across, axis).min(axis=0)


def _note_splits(work: Patchwork, folded: Bools) -> None:
    """Warnings and counts of what was split and of what still folds."""
    split, loops = work.split, work.coarse.loops
    work.counts.update({f"{reason}_faces": number for reason, number in split.counts.items()})
    work.warnings += split_notes(split, source_faces=loops.source_faces)
    work.counts["folded_patches"] = int(folded.sum())
    counts, notes = work.coarse.note_features(work.features)
    work.counts |= counts
    if folded.any():
        first = loops.source_faces[split.source_faces[np.flatnonzero(folded)[0]]]
        number = int(folded.sum())
        work.warnings.append(
            f"{count_of(number, 'patch folds', 'patches fold')}, first in face {first}: "
            "the normals there turn too far for the polygon"
        )
    work.warnings += notes
