"""The one edge rule of all schemes: a cubic for every edge, and the normal field that its faces share.

Source: Leung, Wang, Zhang, equations (5)-(7); the circle length and the fallbacks are ours
(docs/mathematics.md). Everything runs along the edge's canonical direction, in plain elementwise
arithmetic, so that equal ends give equal bits wherever the edge stands in the mesh.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.mesh import Floats
from curvify.normals import dot, perpendicular, unit

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

    def across(vectors: Floats) -> Floats:
        return vectors - dot(vectors, along) * along

    result = (start_normal + end_normal) / 2
    candidates = (
        unit(across(start_normal)) + unit(across(end_normal)),
        across(face_normal),
        perpendicular(along),
    )
    for candidate in candidates:
        weak = np.linalg.norm(across(result), axis=-1) < 1e-9
        if not weak.any():
            break
        result = np.where(weak[:, None], candidate, result)
    return result


def smooth_tangents(chord: Floats, normal: Floats, bending: Floats) -> Floats:
    """Unit tangent ``(E,3)`` at an edge end with the given normal: the direction of equations (5) and (6).

    It lies in the plane of the chord and the bending normal and across the end normal. Where it would not
    advance along the edge, the chord projected across the normal takes its place, or the chord itself where
    the normal lies along it.
    """
    along = unit(chord)
    tangent = unit(along * dot(normal, bending) - bending * dot(normal, along))
    projected = along - dot(along, normal) * normal
    flat = np.linalg.norm(projected, axis=-1, keepdims=True) < ALONG
    fallback = np.where(flat, along, unit(projected))
    return np.where(dot(tangent, along) <= LEAST_ADVANCE, fallback, tangent)


def projected_tangents(chord: Floats, normal: Floats, bending: Floats) -> Floats:
    """Unit tangent ``(E,3)`` at an edge end: the chord projected along the end normal, whatever the edge bends in.

    The direction that PN triangles and their kin take (Vlachos et al. 2001); the chord's own where the normal lies
    along it. ``bending`` is not used.
    """
    along = unit(chord)
    projected = along - dot(along, normal) * normal
    flat = np.linalg.norm(projected, axis=-1, keepdims=True) <= NO_PROJECTION
    return np.where(flat, along, unit(projected))


def tangent_lengths(chord: Floats, tangent: Floats, rule: str) -> Floats:
    """Length ``(E,1)`` of the derivative at an edge end: ``chord``, or ``circle`` for the arc it approximates."""
    length = np.sqrt(dot(chord, chord))
    if rule == "chord":
        return length
    return 2 * length / (1 + dot(tangent, chord) / length)


def edge_curves(start: Floats, end: Floats, start_tangent: Floats, end_tangent: Floats, rule: str) -> Floats:
    """Bezier points ``(E,4,3)`` of the edge curves with the given ends and unit end tangents."""
    chord = end - start
    first = start + tangent_lengths(chord, start_tangent, rule) * start_tangent / 3
    last = end - tangent_lengths(chord, end_tangent, rule) * end_tangent / 3
    return np.stack([start, first, last, end], axis=1)


def normal_fields(curves: Floats, start_normal: Floats, end_normal: Floats, bending: Floats) -> Floats:
    """Bezier points ``(E,4,3)`` of the normal field C' x (N x e), equation (7); not of unit length.

    ``curves (E,4,3)``, end normals and bending normals ``(E,3)``. The field would vanish where an end normal lies
    along the edge, and inside it where the end normals turn against each other: there the bending normal takes
    their place.
    """
    chord = curves[:, 3] - curves[:, 0]
    along = unit(chord)
    a = start_normal - dot(start_normal, along) * along
    b = end_normal - dot(end_normal, along) * along
    replace = (dot(unit(a), unit(b)) < OPPOSITE) | (np.minimum(dot(a, a), dot(b, b)) < ALONG**2)
    m0 = np.where(replace, bending, start_normal)
    m1 = np.where(replace, bending, end_normal)
    c0, c1, c2 = (3 * (curves[:, i + 1] - curves[:, i]) for i in range(3))

    def field(derivative: Floats, normal: Floats) -> Floats:
        return normal * dot(derivative, chord) - chord * dot(derivative, normal)

    return np.stack(
        [
            field(c0, m0),
            (field(c0, m1) + 2 * field(c1, m0)) / 3,
            (2 * field(c1, m1) + field(c2, m0)) / 3,
            field(c2, m1),
        ],
        axis=1,
    )
