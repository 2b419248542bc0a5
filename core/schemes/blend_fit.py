"""Local geometries of the blending scheme: the polynomials on its charts.

Around a smooth vertex the least-squares fit to the vertices of its faces; in a sector the curves of its two features
exactly, and the rest by least squares; in the models ``paper`` and ``paper-fixed`` the paper's points and curves.
Source: Ko, Lee, Lim, Yoon, section IV.1 and equations (2)-(4); sectors are ours (docs/blending.md).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from curvify.arrays import take_rows
from curvify.mesh import Floats, Ints
from curvify.normals import dot, unit
from curvify.schemes.blend_basis import monomials
from curvify.schemes.blend_charts import CONFORMAL, HALF, NARROW, OPENING, POLAR, WIDE, Charts
from curvify.schemes.blend_lines import EndCurves, start_ends
from curvify.topology import Topology

#: Coefficients by name: the monomial that each belongs to.
X, Y, XX, XY, YY, XXY = 3, 1, 6, 4, 2, 7
#: Singular values below this share of the largest count as zero: a valence of two leaves XY open.
RANK = 1e-10


def ring_points(kind: int, faces: int, a: float, step: float) -> Floats:
    """Chart coordinates ``(2m+1 or 2m, 2)`` of the neighbors around a vertex: of its edges, then across its faces.

    ``a`` is the chart's exponent A, ``step`` the angle of a face. Smooth charts have as many edges as faces.
    """
    edges = np.arange(faces if kind in (CONFORMAL, POLAR) else faces + 1) * step
    across = (np.arange(faces) + 0.5) * step
    angle = np.concatenate([edges, across])
    radius = np.concatenate([np.ones(len(edges)), np.full(faces, 2 ** (a / 2))])
    points = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points[np.abs(points) < 1e-15] = 0.0
    return points


@lru_cache(maxsize=512)
def smooth_fit(kind: int, faces: int) -> Floats:
    """The matrix ``(9,2m)`` from the neighbors of a smooth vertex, less the vertex, to its coefficients.

    The full biquadratic for four faces, which is exact there; else total degree 2, whose turns are of its kind.
    """
    a = 4 / faces if kind == CONFORMAL else 1.0
    points = ring_points(kind, faces, a, 2 * np.pi / faces)
    slots = [1, 2, 3, 4, 5, 6, 7, 8] if faces == 4 else [X, Y, XX, XY, YY]
    result = np.zeros((9, 2 * faces))
    result[slots] = np.linalg.pinv(monomials(points[:, 0], points[:, 1])[:, slots], rcond=RANK)
    return result


def neighbors(topology: Topology, positions: Floats, corners: Ints, closed: bool) -> Floats:
    """Vertices around charts with the ``corners (n,m)``, less their own: ``(n,2m,3)`` or, for sectors, (n,2m+1,3)."""
    ids = topology.vertices
    edges = ids[topology.next[corners]]
    if not closed:
        edges = np.concatenate([edges, ids[topology.prev[corners[:, -1:]]]], axis=1)
    across = ids[topology.next[topology.next[corners]]]
    ring = take_rows(positions, np.concatenate([edges, across], axis=1))
    ring -= take_rows(positions, ids[corners[:, :1]])
    return ring


def fit_smooth(charts: Charts, topology: Topology, positions: Floats) -> None:
    """Fill in the coefficients of all smooth charts."""
    charts.coefficients[:, 0] = positions[topology.vertices[charts.rings.first]]
    for kind in (CONFORMAL, POLAR):
        for some, corners in charts.rings.of(np.flatnonzero(charts.kinds == kind)):
            ring = neighbors(topology, positions, corners, closed=True)
            fitted = np.matmul(smooth_fit(kind, corners.shape[1]), ring)
            charts.coefficients[some, 1:] = fitted[:, 1:]


def fit_sectors(charts: Charts, topology: Topology, positions: Floats, curves: EndCurves) -> None:
    """Fill in the coefficients of all sectors, from the ``curves`` of the features. Smooth charts come first."""
    for kind in (HALF, NARROW, WIDE):
        for some, corners in charts.rings.of(np.flatnonzero(charts.kinds == kind)):
            ring = neighbors(topology, positions, corners, closed=False)
            first = start_ends(topology)[corners[:, 0]]
            last = start_ends(topology)[topology.prev[corners[:, -1]]] ^ 1
            if kind == HALF:
                fitted = _half_plane(charts, topology, corners, ring, curves.at(first))
            else:
                fitted = _wedge(kind, ring, curves.at(first), curves.at(last))
            charts.coefficients[some, 1:] = fitted[:, 1:]


def _half_plane(charts: Charts, topology: Topology, corners: Ints, ring: Floats, curve: Floats) -> Floats:
    """Coefficients ``(n,9,3)`` of sectors whose two features are one curve.

    X and X^2 from the curve, Y^2 from the bend that smooth neighbors have towards the vertex, the rest by least
    squares.
    """
    faces = corners.shape[1]
    points = ring_points(HALF, faces, 1.0, np.pi / faces)
    coefficients = np.zeros((len(corners), 9, 3))
    coefficients[:, X], coefficients[:, XX] = curve[:, 1], curve[:, 2]
    coefficients[:, YY] = _neighbors_bend(charts, topology, corners, points, curve[:, 2])
    free = {1: [Y], 2: [Y, XY, XXY]}.get(faces, [Y, XY])
    inside = np.r_[1:faces, faces + 1 : 2 * faces + 1]
    return _fit_rest(coefficients, points[inside], ring[:, inside], free)


def _neighbors_bend(charts: Charts, topology: Topology, corners: Ints, points: Floats, bend: Floats) -> Floats:
    """The coefficient of Y^2 ``(n,3)`` for which the curves to the neighbors bend as they do there."""
    faces = corners.shape[1]
    total, weights = np.zeros((len(corners), 3)), np.zeros((len(corners), 1))
    for i in range(1, faces):
        there = topology.twin[corners[:, i]]
        known = charts.smooth[charts.rings.chart[there]][:, None]
        back = charts.at(there, wanted=[XX])[:, 0]
        x, y = points[i]
        total += np.where(known, (back - x * x * bend) * y * y, 0.0)
        weights += known * y**4
    return np.divide(total, weights, out=np.zeros_like(total), where=weights > 0)


def _wedge(kind: int, ring: Floats, first: Floats, last: Floats) -> Floats:
    """Coefficients ``(n,9,3)`` of sectors between two features of their own: along X and along Y."""
    faces = (ring.shape[1] - 1) // 2
    points = ring_points(kind, faces, 1.0, OPENING[kind] / faces)
    coefficients = np.zeros((len(ring), 9, 3))
    coefficients[:, X], coefficients[:, XX] = first[:, 1], first[:, 2]
    coefficients[:, Y], coefficients[:, YY] = last[:, 1] * (1 if kind == NARROW else -1), last[:, 2]
    inside = np.r_[1:faces, faces + 1 : 2 * faces + 1]
    return _fit_rest(coefficients, points[inside], ring[:, inside], [XY])


def _fit_rest(coefficients: Floats, points: Floats, ring: Floats, free: list[int]) -> Floats:
    """Fit the ``free`` coefficients to what the others leave of the ``ring (n,r,3)`` at chart ``points (r,2)``."""
    basis = monomials(points[:, 0], points[:, 1])
    left = ring - np.matmul(basis, coefficients)
    coefficients[:, free] = np.matmul(np.linalg.pinv(basis[:, free], rcond=RANK), left)
    return coefficients


def soften(charts: Charts, topology: Topology, sharpness: Floats) -> None:
    """Turn the two sides of creases towards each other where their ``sharpness (V,)`` at the vertex is below 1.

    Only where a crease passes through: there the derivatives across it are mixed with their mean, the other side's
    taken as long as the own, so that at 0 both share a plane.
    """
    rings = charts.rings
    half = np.flatnonzero(charts.kinds == HALF)
    beyond = topology.twin[topology.prev[rings.last[half]]]
    other = rings.chart[beyond]
    share = sharpness[topology.vertices[rings.first[half]]]
    soft = (beyond >= 0) & (charts.kinds[other] == HALF) & (rings.first[other] == beyond) & (share < 1)
    half, other, share = half[soft], other[soft], share[soft, None, None]
    slots, sign = [Y, XY, XXY], np.array([-1.0, 1.0, -1.0])[:, None]  # the other side looks back along both axes
    own, far = charts.coefficients[half], charts.coefficients[other]
    along = unit(own[:, X])
    lengths = [np.linalg.norm(c[:, Y] - dot(c[:, Y], along) * along, axis=1)[:, None, None] for c in (own, far)]
    ratio = np.divide(lengths[0], lengths[1], out=np.ones_like(share), where=lengths[1] > 0)
    own, far = own[:, slots], sign * ratio * far[:, slots]
    far[rings.sizes[half] != 2, 2] = 0.0  # X^2 Y turns into other monomials but for quarter turns
    mean = (own + far) / 2
    charts.coefficients[half[:, None], slots] = mean + share * (own - mean)


def fit_paper_curves(
    charts: Charts, topology: Topology, positions: Floats, crease: Ints, around: Ints, fixed: bool
) -> None:
    """The quadratic Bezier curves of equations (3) and (4), for each corner at a vertex with two features.

    ``crease (n,)`` are the corners, each a chart, ``around (n,2)`` the edge ends of their vertex's two features.
    As printed the curve passes the vertex by; ``fixed`` takes it through, with half the parameter speed.
    """
    ends = start_ends(topology)
    here = np.stack([ends[crease], ends[topology.prev[crease]] ^ 1], axis=1)
    sign = (here[:, :, None] == around[:, None]) @ np.array([-1.0, 1.0])
    before, after = (positions[topology.edges.reshape(-1)[around[:, i] ^ 1]] for i in range(2))
    vertex = positions[topology.vertices[crease]]
    middle = 2 * vertex - (before + after) / 2 if fixed else vertex
    slope, bend = after - before, before - 2 * middle + after
    sx, sy = ((0.5 if fixed else 1.0) * sign.T)[:, :, None]
    target = charts.rings.chart[crease]
    charts.coefficients[target, 0] = (before + 2 * middle + after) / 4
    charts.coefficients[target, X], charts.coefficients[target, Y] = slope * sx, slope * sy
    charts.coefficients[target, XX], charts.coefficients[target, YY] = bend * sx * sx, bend * sy * sy
    charts.coefficients[target, XY] = 2 * bend * sx * sy
