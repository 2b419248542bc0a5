"""The one edge rule of all schemes: a cubic for every edge, and the normal field that its faces share.

Source: Leung, Wang, Zhang, equations (5)-(7); the circle length and the fallbacks are ours
(docs/mathematics.md). Everything runs along the edge's canonical direction, in plain elementwise
arithmetic, so that equal ends give equal bits wherever the edge stands in the mesh.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.arrays import stacked
from curvify.mesh import Bools, Floats
from curvify.normals import dot, length, perpendicular, unit

#: A tangent must advance along its edge by at least this cosine.
LEAST_ADVANCE = 0.05
#: End normals whose parts across the edge have a cosine below this turn against each other.
OPPOSITE = -0.99
#: A normal whose part across the edge is below this lies along it.
ALONG = 1e-3
#: A chord whose projection along a normal is shorter than this share of it has none.
NO_PROJECTION = 1e-9

#: Unit tangents ``(E,3)`` at edge ends from chords, end normals and bending normals.
Directions = Callable[[Floats, Floats, Floats], Floats]


def bending_normals(chord: Floats, start_normal: Floats, end_normal: Floats, face_normal: Floats) -> Floats:
    """Normal ``(E,3)`` that spans the plane of each edge curve together with its chord (n_e of equation 5).

    The mean of the end normals; where that vanishes or lies along the chord, the mean of their parts across
    it, then the part across it of ``face_normal``, then any perpendicular.
    """
    along = unit(chord)
    result = (start_normal + end_normal) / 2
    weak = np.flatnonzero(_is_weak(result, along))
    if len(weak):
        result[weak] = _spare_bending(along[weak], start_normal[weak], end_normal[weak], face_normal[weak])
    return result


def _spare_bending(along: Floats, start_normal: Floats, end_normal: Floats, face_normal: Floats) -> Floats:
    """Bending normals ``(k,3)`` where the mean of the end normals vanishes or lies along the chord."""
    result = unit(_across(start_normal, along)) + unit(_across(end_normal, along))
    for candidate in (_across(face_normal, along), perpendicular(along)):
        weak = _is_weak(result, along)
        result[weak] = candidate[weak]
    return result


def _is_weak(vectors: Floats, along: Floats) -> Bools:
    """Which vectors ``(E,3)`` have no part across unit ones."""
    return length(_across(vectors, along)) < 1e-9


def _across(vectors: Floats, along: Floats) -> Floats:
    """The parts of vectors ``(E,3)`` across unit ones."""
    return vectors - dot(vectors, along) * along


def smooth_tangents(chord: Floats, normal: Floats, bending: Floats) -> Floats:
    """Unit tangent ``(E,3)`` at an edge end with the given normal: the direction of equations (5) and (6).

    It lies in the plane of the chord and the bending normal and across the end normal. Where it would not
    advance along the edge, the chord projected across the normal takes its place, or the chord itself where
    the normal lies along it.
    """
    along = unit(chord)
    tangent = unit(along * dot(normal, bending) - bending * dot(normal, along))
    stuck = np.flatnonzero(dot(tangent, along)[:, 0] <= LEAST_ADVANCE)
    if len(stuck):
        projected = _across(along[stuck], normal[stuck])
        flat = length(projected)[:, None] < ALONG
        tangent[stuck] = np.where(flat, along[stuck], unit(projected))
    return tangent


def projected_tangents(chord: Floats, normal: Floats, bending: Floats) -> Floats:
    """Unit tangent ``(E,3)`` at an edge end: the chord projected along the end normal, whatever the edge bends in.

    The direction that PN triangles and their kin take (Vlachos et al. 2001); the chord's own where the normal lies
    along it. ``bending`` is not used.
    """
    along = unit(chord)
    projected = _across(along, normal)
    flat = length(projected) <= NO_PROJECTION
    tangent = unit(projected)
    tangent[flat] = along[flat]
    return tangent


def tangent_lengths(chord: Floats, tangent: Floats, rule: str) -> Floats:
    """Length ``(E,1)`` of the derivative at an edge end: ``chord``, or ``circle`` for the arc it approximates."""
    size = length(chord)[:, None]
    if rule == "chord":
        return size
    return 2 * size / (1 + dot(tangent, chord) / size)


def edge_curves(start: Floats, end: Floats, start_tangent: Floats, end_tangent: Floats, rule: str) -> Floats:
    """Bezier points ``(E,4,3)`` of the edge curves with the given ends and unit end tangents."""
    chord = end - start
    first = start + tangent_lengths(chord, start_tangent, rule) * start_tangent / 3
    last = end - tangent_lengths(chord, end_tangent, rule) * end_tangent / 3
    return stacked([start, first, last, end])


def normal_fields(curves: Floats, start_normal: Floats, end_normal: Floats, bending: Floats) -> Floats:
    """Bezier points ``(E,4,3)`` of the normal field C' x (N x e), equation (7); not of unit length.

    ``curves (E,4,3)``, end normals and bending normals ``(E,3)``. The field would vanish where an end normal lies
    along the edge, and inside it where the end normals turn against each other: there the bending normal takes
    their place.
    """
    chord = curves[:, 3] - curves[:, 0]
    along = unit(chord)
    a, b = _across(start_normal, along), _across(end_normal, along)
    replace = (dot(unit(a), unit(b)) < OPPOSITE) | (np.minimum(dot(a, a), dot(b, b)) < ALONG**2)
    m0, m1 = start_normal, end_normal
    if replace.any():
        m0, m1 = np.where(replace, bending, m0), np.where(replace, bending, m1)
    steps = [3 * (curves[:, i + 1] - curves[:, i]) for i in range(3)]
    (s0, s1, s2), (p0, p1, p2), (q0, q1, q2) = ([dot(step, v) for step in steps] for v in (chord, m0, m1))
    return stacked(  # the product of C' with N, of C' x (N x e) = N (C'.e) - e (C'.N)
        [
            m0 * s0 - chord * p0,
            (m1 * s0 + m0 * (2 * s1) - chord * (q0 + 2 * p1)) / 3,
            (m1 * (2 * s1) + m0 * s2 - chord * (2 * q1 + p2)) / 3,
            m1 * s2 - chord * q2,
        ]
    )
