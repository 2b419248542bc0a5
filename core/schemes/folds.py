"""Patches of a polygon mesh that do not fold: faces are split from the corners where their patch would.

A patch folds at a corner that opens too little, and along a side from which it leaves outwards (Leung, Wang, Zhang,
section 2.3, split concave faces; the tests are ours, docs/mathematics.md).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.arrays import as_slice, cross, unit_rows
from curvify.convex import Split, split_at_corners, split_polygons
from curvify.edges import edge_curves, normal_fields
from curvify.mesh import Bools, Floats, Ints
from curvify.pieces import MAX_SIDES, split_notes
from curvify.prepare import Coarse
from curvify.schemes.base import bernstein, bernstein_basis, bernstein_slope, bernstein_slopes
from curvify.schemes.cross_tangents import PaperTangent, dot
from curvify.schemes.frames import edge_frame
from curvify.schemes.patchwork import Patchwork
from curvify.sectors import Features
from curvify.words import count_of

#: A corner of a patch must open by at least the angle with this sine (3 degrees).
LEAST_CORNER_SINE = float(np.sin(np.radians(3.0)))
#: Corners whose sine is below this in size do not open at all.
FLAT_CORNER = 1e-9
#: Rounds of making corners and of splitting folded faces.
ROUNDS = 4
#: Patches, and half-edges, looked at together.
WINDOW, SIDES = 512, 2048
#: Abscissae at which sides are tested: the same from either end.
PLACES = np.arange(1, 10) / 10

#: How far the patches of a work point inwards at each side ``(C,)``: the smallest (C' x T).n_c at the ``PLACES``, up to
#: a positive factor.
Inward = Callable[[Patchwork], Floats]


def build_patchwork(coarse: Coarse, lengths: str, split_rule: str, inward: Inward) -> Patchwork:
    """Split faces until no patch folds that splitting can save, and build all curves.

    ``lengths`` is the rule of ``edges.tangent_lengths``, ``inward`` the test of sides for the scheme's cross tangents.
    What still folds is counted and warned of.
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
        bad, folded = _bad_corners(work, inward)
        wide = work.topology.sizes[work.topology.faces] > 3
        if not (bad & wide).any():
            break
        closer = split_at_corners(coarse.positions, split, bad & wide, work.normals)
        if len(closer.face_offsets) == len(split.face_offsets):
            break
        split = closer
        work = _build(coarse, work.features, split, lengths)
    else:
        bad, folded = _bad_corners(work, inward)
    _note_splits(work, folded)
    return work



def _build(coarse: Coarse, features: Features, split: Split, lengths: str) -> Patchwork:
    """Curves and fields of all edges of the pieces."""
    frame = edge_frame(coarse, features, split)
    curves = edge_curves(frame.start, frame.end, frame.tangents[:, 0], frame.tangents[:, 1], lengths)
    edge = as_slice(frame.side_edges)
    fields = normal_fields(curves[edge], frame.pairs[:, 0], frame.pairs[:, 1], frame.bending[edge])
    return Patchwork.on(coarse, features, split, frame, curves, fields)


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


def _bad_corners(work: Patchwork, inward: Inward) -> tuple[Bools, Bools]:
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
    sides = np.flatnonzero(inward(work) <= 0)
    folded[topology.faces[sides]] = True
    after = topology.next[sides]
    bad[np.where(sines[sides] <= sines[after], sides, after)] = True
    return bad, folded


def blended_inward(share: Callable[[Floats], Floats], work: Patchwork) -> Floats:
    """``Inward`` for cross tangents that are, up to the part along n_c and a positive factor, blends h a + (1 - h) b of
    those that the neighboring edges ask for at the ends of a side: neither makes a difference.

    ``share`` is h, with h(t) + h(1-t) = 1. Sides that surely point inwards get 1.
    """
    topology = work.topology
    least = np.ones(len(topology.edge))
    unsure = np.flatnonzero(~_surely_inward(work))
    h = share(PLACES)[:, None]
    out, back = work.steps
    for begin in range(0, len(unsure), SIDES):
        sides = unsure[begin : begin + SIDES]
        forward = topology.forward[sides]
        a, b = np.take(back, sides, axis=1), np.take(out, topology.next[sides], axis=1)
        starts, ends = np.where(forward, a, b), np.where(forward, b, a)
        across = _across_edges(work, topology.edge[sides], work.side_field[sides])
        along = (across * (h * starts[:, None] + (1 - h) * ends[:, None])).sum(axis=0)
        least[sides] = np.where(forward, along.min(axis=0), -along.max(axis=0))
    return least


def _across_edges(work: Patchwork, edges: Ints, fields: Ints) -> Floats:
    """n_c x C' ``(3,t,w)`` at the ``PLACES`` of ``edges (w,)`` with normal ``fields (w,)``."""
    normal, speed = (
        (basis.T @ _planes(points).reshape(len(basis), -1)).reshape(-1, 3, len(edges)).swapaxes(0, 1)
        for basis, points in (
            (bernstein_basis(3, PLACES), work.fields[:, fields]),
            (bernstein_slopes(3, PLACES), work.curves[:, edges]),
        )
    )
    return cross(normal, speed, axis=0)


def _planes(points: Floats) -> Floats:
    """Bezier points ``(3,w,d)`` as ``(d,3,w)``."""
    return np.ascontiguousarray(points.transpose(2, 0, 1))


def _surely_inward(work: Patchwork) -> Bools:
    """Half-edges ``(C,)`` whose blended cross tangents point inwards all along, told by angles.

    n_c and C' lie within angles a, b of those in the middle of the edge, since their Bezier points do, and are
    perpendicular: n_c x C' lies within 2a + b of that in the middle. The cross tangents lie between those at the ends,
    within an angle c of the same. Where 2a + b + c is less than a right angle, no two of them are perpendicular.
    As x <= (pi/2) sqrt(2) sin(x/2) up to a right angle, the sum of the sines of the halves may be 1/sqrt(2).
    """
    topology = work.topology
    edges = np.empty(work.fields.shape[1], dtype=np.int64)
    edges[work.side_field] = topology.edge
    axes, spread = np.empty((3, len(edges))), np.empty(len(edges))
    for begin in range(0, len(edges), SIDES):
        part = slice(begin, begin + SIDES)
        axes[:, part], spread[part] = _cones(work.fields[:, part], work.curves[:, as_slice(edges[part])])
    axis = np.take(axes, work.side_field, axis=1)
    out, back = (unit_rows(steps) for steps in work.steps)
    sign = 2.0 * topology.forward - 1.0
    start = np.einsum("ic,ic->c", axis, back) * sign
    end = np.einsum("ic,ic->c", axis, np.take(out, topology.next, axis=1)) * sign
    return spread[work.side_field] + _half_sine(np.minimum(start, end)) < np.sqrt(0.5)


def _cones(fields: Floats, curves: Floats) -> tuple[Floats, Floats]:
    """Of normal fields and their edges ``(3,w,4)``: the unit vector n_c x C' in the middle ``(3,w)``, and sin a/2 + sin
    a/2 + sin b/2 for the angles a, b that n_c and C' stay within, infinite where one vanishes.
    """
    normals, points = _planes(fields), _planes(curves)
    legs = points[1:] - points[:-1]
    normal, speed = normals[0] + 3 * (normals[1] + normals[2]) + normals[3], legs[0] + 2 * legs[1] + legs[2]
    with np.errstate(invalid="ignore", divide="ignore"):
        a, b = (_widest(vectors, middle) for vectors, middle in ((normals, normal), (legs, speed)))
    return unit_rows(cross(normal, speed, axis=0)), 2 * a + b


def _widest(vectors: Floats, middle: Floats) -> Floats:
    """Sin x/2 ``(w,)`` of the largest angle x between one of ``vectors (d,3,w)`` and ``middle (3,w)``."""
    along = np.einsum("dcw,cw->dw", vectors, middle)
    along /= np.sqrt(np.einsum("dcw,dcw->dw", vectors, vectors))
    return _half_sine(along.min(axis=0) / np.sqrt(np.einsum("cw,cw->w", middle, middle)))


def _half_sine(cosine: Floats) -> Floats:
    """Sin x/2 from cos x; infinite where x is above a right angle or not a number."""
    return np.where(cosine >= 0, np.sqrt(np.maximum(1 - cosine, 0.0) / 2), np.inf)


def paper_inward(tangents_of: Callable[[Patchwork, Ints], PaperTangent], work: Patchwork) -> Floats:
    """``Inward`` for the paper's cross tangents; ``tangents_of`` gives those of patches with the corners ``(f,n)``."""
    least = np.empty(len(work.topology.edge))
    for size, patches in work.size_classes():
        for begin in range(0, len(patches), WINDOW):
            corners = work.topology.offsets[patches[begin : begin + WINDOW]][:, None] + np.arange(size)
            tangent = tangents_of(work, corners)
            sides = tangent.sides
            across = cross(bernstein(sides.fields, PLACES), bernstein_slope(sides.curves, PLACES), axis=0)
            least[corners] = dot(across, tangent.fields(PLACES)).min(axis=-1)
    return least


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
