"""Normals of the coarse mesh: of corners, of sectors, and what to make of normals that a file gives.

Source: Leung, Wang, Zhang, section 2; the corner rule is one of our own for warped and concave polygons
(docs/mathematics.md): the cross of the two sides for triangles and quads, the area normal otherwise.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.arrays import cross, take_rows
from curvify.mesh import Bools, Floats, Ints
from curvify.polygons import next_corners, previous_corners

#: Corner normals closer than this are one normal (degrees).
SAME_NORMAL = 0.1
#: Corner normals closer than this to their face's are a flat-shaded export (degrees).
FLAT_SHADED = 0.5
#: Vectors that are compared before all of them.
LOOK = 1 << 14


def unit(vectors: Floats) -> Floats:
    """Vectors ``(...,3)`` scaled to length 1; those without length stay zero."""
    size = length(vectors)
    size[size == 0] = 1.0
    return vectors / size[..., None]


def length(vectors: Floats) -> Floats:
    """Lengths ``(...)`` of vectors ``(...,3)``."""
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))


def dot(a: Floats, b: Floats) -> Floats:
    """Dot product over the last axis, which is kept with length 1."""
    return np.einsum("...i,...i->...", a, b)[..., None]


def perpendicular(direction: Floats) -> Floats:
    """Some unit vector ``(...,3)`` across each unit direction."""
    axis = np.eye(3)[np.abs(direction).argmin(axis=-1)]
    return unit(axis - dot(axis, direction) * direction)


def degrees_between(a: Floats, b: Floats) -> Floats:
    """Angle between vectors ``(...,3)`` in degrees, accurate for small angles too."""
    ua, ub = unit(a), unit(b)
    return np.degrees(2 * np.arctan2(length(ua - ub), length(ua + ub)))


def corner_normals(
    positions: Floats, offsets: Ints, vertices: Ints, area: Floats, flat: Bools | None = None
) -> tuple[Floats, Floats]:
    """Unit normal ``(C,3)`` and interior angle ``(C,)``, in radians, of each face at each of its corners.

    ``area (F,3)`` are the faces' area vectors. Triangles and quads: the cross of the two sides, turned to the side of
    the area normal, which itself serves where the sides are collinear. Larger polygons: the area normal, since the
    crosses of a warped polygon can cancel at a vertex. Zero where the face has no area. The angle of a reflex corner
    is above pi.
    """
    sizes = np.diff(offsets)
    points = take_rows(positions, vertices)
    ahead = take_rows(points, next_corners(offsets)) - points
    back = -take_rows(ahead, previous_corners(offsets))
    crosses = cross(ahead, back)
    sine, cosine = length(crosses), np.einsum("ci,ci->c", ahead, back)
    face_normals = take_rows(unit(area), np.repeat(np.arange(len(sizes)), sizes))
    reflex = np.einsum("ci,ci->c", crosses, face_normals) < 0
    straight = sine <= 1e-12 * np.abs(cosine)
    angles = np.arctan2(sine, cosine)
    angles[reflex] = 2 * np.pi - angles[reflex]
    size = sine.copy()
    size[reflex] *= -1.0
    size[straight] = 1.0
    normals = crosses / size[:, None]
    own = straight | np.repeat(sizes > 4 if flat is None else (sizes > 4) | flat, sizes)
    normals[own] = face_normals[own]
    return normals, angles


def sum_by(labels: Ints, values: Floats, count: int) -> Floats:
    """Sum of the rows of ``values (n,3)`` that carry each label ``(count,3)``."""
    return np.array([np.bincount(labels, values[:, i], count) for i in range(3)], dtype=np.float64).T


def sector_normals(
    positions: Floats, offsets: Ints, vertices: Ints, area: Floats, sectors: Ints, flat: Bools | None = None
) -> Floats:
    """Computed normal of each corner's sector ``(C,3)``: the mean of its corner normals weighted by angle.

    ``area (F,3)`` are the faces' area vectors, ``sectors (C,)`` labels corners by their sector, ``flat (F,)`` are
    faces that are to be flat. Where the sum vanishes, the area normal of the largest face of the sector serves.
    """
    normals, angles = corner_normals(positions, offsets, vertices, area, flat)
    total = sum_by(sectors, normals * angles[:, None], len(vertices))
    vanishing: Bools = np.all(np.abs(total) < 1e-9, axis=1)
    if vanishing.any() and vanishing[sectors].any():
        of_corner = np.repeat(area, np.diff(offsets), axis=0)
        order = np.argsort(np.einsum("ci,ci->c", of_corner, of_corner), kind="stable")
        largest = np.zeros_like(total)
        largest[sectors[order]] = of_corner[order]
        total[vanishing] = largest[vanishing]
    result = take_rows(unit(total), sectors)
    lost = np.flatnonzero(~result.any(axis=1))
    if len(lost):
        result[lost] = _any_normals(positions, offsets, vertices, sectors, lost)
    return result


def _any_normals(positions: Floats, offsets: Ints, vertices: Ints, sectors: Ints, corners: Ints) -> Floats:
    """For corners in faces without area only: a unit vector across one side of their sector ``(k,3)``."""
    points = positions[vertices]
    along = unit(points[next_corners(offsets)] - points)
    chosen = np.zeros_like(along)
    chosen[sectors[corners[::-1]]] = along[corners[::-1]]
    return perpendicular(chosen[sectors[corners]])


def _all_within(limit: float, a: Floats, b: Floats, which: Ints) -> bool:
    """Whether no vector ``a (n,3)`` is more than ``limit`` degrees from its own of ``b``, row ``which (n,)``; one
    without length there is no matter. The first ones mostly tell already.
    """
    for rows in (slice(LOOK), slice(LOOK, None)):
        own = take_rows(b, which[rows])
        if bool(((degrees_between(a[rows], own) > limit) & own.any(axis=1)).any()):
            return False
    return True


def is_flat_shaded(
    normals: Floats, offsets: Ints, area: Floats, links: Callable[[], tuple[Ints, Ints]]
) -> bool:
    """Whether given corner normals ``(C,3)`` only repeat the faces' own: a flat-shaded export.

    True when every face has one normal for all its corners, or every corner normal equals its face's, given by the
    area vectors ``area (F,3)``, within half a degree, and corners side by side at an edge, ``links()``, never share
    one where their faces differ (they do on a fine smooth mesh).
    """
    sizes = np.diff(offsets)
    if _all_within(SAME_NORMAL, normals, normals, np.repeat(offsets[:-1], sizes)):
        return True
    faces = np.repeat(np.arange(len(sizes)), sizes)
    if not _all_within(FLAT_SHADED, normals, area, faces):
        return False
    a, b = links()
    bent = degrees_between(take_rows(area, faces[a]), take_rows(area, faces[b])) > SAME_NORMAL
    return not bool((degrees_between(normals[a[bent]], normals[b[bent]]) <= SAME_NORMAL).any())
