"""Normals of the coarse mesh: of corners, of sectors, and what to make of normals that a file gives.

Source: Leung, Wang, Zhang, section 2; the corner rule is one of our own for warped and concave polygons
(docs/mathematics.md): the cross of the two sides for triangles and quads, the area normal otherwise.
"""

from __future__ import annotations

import numpy as np

from curvify.mesh import Floats, Ints
from curvify.polygons import corner_crosses, newell_normals, next_corners, previous_corners

#: Corner normals closer than this are one normal (degrees).
SAME_NORMAL = 0.1
#: Corner normals closer than this to their face's are a flat-shaded export (degrees).
FLAT_SHADED = 0.5


def unit(vectors: Floats) -> Floats:
    """Vectors ``(...,3)`` scaled to length 1; those without length stay zero."""
    length = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))[..., None]
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def dot(a: Floats, b: Floats) -> Floats:
    """Dot product over the last axis, which is kept with length 1."""
    return np.einsum("...i,...i->...", a, b)[..., None]


def degrees_between(a: Floats, b: Floats) -> Floats:
    """Angle between vectors ``(...,3)`` in degrees, accurate for small angles too."""
    ua, ub = unit(a), unit(b)
    return np.degrees(2 * np.arctan2(np.linalg.norm(ua - ub, axis=-1), np.linalg.norm(ua + ub, axis=-1)))


def corner_normals(positions: Floats, offsets: Ints, vertices: Ints) -> Floats:
    """Unit normal of each face at each of its corners ``(C,3)``, zero where the face has no area.

    Triangles and quads: the cross of the two sides, turned to the side of the area normal, which itself
    serves where the sides are collinear. Larger polygons: the area normal, since the crosses of a warped
    polygon can cancel at a vertex.
    """
    sizes = np.diff(offsets)
    faces = np.repeat(np.arange(len(sizes)), sizes)
    area = unit(newell_normals(positions, offsets, vertices))[faces]
    crosses = corner_crosses(positions, offsets, vertices)
    points = positions[vertices]
    side = np.linalg.norm(points[next_corners(offsets)] - points, axis=1)
    sine = np.linalg.norm(crosses, axis=1)
    straight = sine <= 1e-12 * side * side[previous_corners(offsets)]
    normals = unit(crosses) * np.where(dot(crosses, area) < 0, -1.0, 1.0)
    own = (straight | (sizes[faces] > 4))[:, None]
    return np.where(own, area, normals)


def corner_angles(positions: Floats, offsets: Ints, vertices: Ints) -> Floats:
    """Interior angle of each corner ``(C,)`` in radians, above pi where the polygon is reflex."""
    sizes = np.diff(offsets)
    faces = np.repeat(np.arange(len(sizes)), sizes)
    crosses = corner_crosses(positions, offsets, vertices)
    points = positions[vertices]
    ahead = points[next_corners(offsets)] - points
    back = points[previous_corners(offsets)] - points
    angle = np.arctan2(np.linalg.norm(crosses, axis=1), np.einsum("ci,ci->c", ahead, back))
    area = newell_normals(positions, offsets, vertices)
    reflex = np.einsum("ci,ci->c", crosses, area[faces]) < 0
    return np.where(reflex, 2 * np.pi - angle, angle)


def sum_by(labels: Ints, values: Floats, count: int) -> Floats:
    """Sum of the rows of ``values (n,3)`` that carry each label ``(count,3)``."""
    return np.stack([np.bincount(labels, values[:, i], count) for i in range(3)], axis=1)


def sector_normals(positions: Floats, offsets: Ints, vertices: Ints, sectors: Ints) -> Floats:
    """Computed normal of each corner's sector ``(C,3)``: the mean of its corner normals weighted by angle.

    ``sectors (C,)`` labels corners by their sector. Where the sum vanishes, the area normal of the largest
    face of the sector serves.
    """
    normals = corner_normals(positions, offsets, vertices)
    weighted = normals * corner_angles(positions, offsets, vertices)[:, None]
    count = len(vertices)
    total = sum_by(sectors, weighted, count)
    vanishing = np.linalg.norm(total, axis=1) < 1e-9
    if vanishing[sectors].any():
        area = newell_normals(positions, offsets, vertices)[np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))]
        order = np.argsort(np.einsum("ci,ci->c", area, area), kind="stable")
        largest = np.zeros_like(total)
        largest[sectors[order]] = area[order]
        total[vanishing] = largest[vanishing]
    return unit(total)[sectors]


def is_flat_shaded(normals: Floats, positions: Floats, offsets: Ints, vertices: Ints) -> bool:
    """Whether given corner normals ``(C,3)`` only repeat the faces' own: a flat-shaded export.

    True when every face has one normal for all its corners, or every corner normal equals its face's area
    normal within half a degree.
    """
    faces = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    first = normals[offsets[:-1]][faces]
    if bool((degrees_between(normals, first) <= SAME_NORMAL).all()):
        return True
    area = newell_normals(positions, offsets, vertices)[faces]
    sized = np.linalg.norm(area, axis=1) > 0
    return bool((degrees_between(normals[sized], area[sized]) <= FLAT_SHADED).all())
