"""Basis tables of n-sided Gregory patches, and of the corrections that make them precise.

Source: Leung, Wang, Zhang, equations (1), (3), (4) (J. Gregory's corner interpolators), written as one linear
combination per face; the polynomial correction and the center function are ours (docs/mathematics.md).
Per side k of a face the control vectors are, in this order, the corner p_k, the legs Q0_k - p_k and Q1_k - p_{k+1} of
its edge's Bezier points (legs, since points of many-sided patches would have large weights that cancel), the
derivative of the cross tangent at its two ends, T'_k(0), T'_k(1); then, for the corrected patch, T_k(1/2)/s(1/2)
(n != 4) and one vector that moves the center. The cross tangents are the side fields, for the corrected patch over
s_n, which stands in their weights.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from curvify.mesh import Floats, Ints
from curvify.sampling import domain_corners
from curvify.schemes.base import Basis, bernstein_basis, bernstein_slopes
from curvify.schemes.domain import Domain, domain_jets, jet_compose, jet_product


def gregory_basis(sides: int, points: Floats, corrected: bool, uneven: bool = False) -> Basis:
    """Tables of the patch at ``points (S,2)``, with the polynomial correction and the center if ``corrected``.

    ``uneven`` polygons get a correction of the first degree. With a correction, which is most of the work, points that
    are n turns of the first of them, as those of a sampling are, take the work of those only.
    """
    size = _points_turned(sides, points) if corrected and sides != 4 else 0
    if not size:
        return _basis_at(sides, points, corrected, uneven)
    chosen = np.concatenate([points[:size], points[sides * size :]])
    return _turned(_basis_at(sides, chosen, corrected, uneven), sides, size)


def _points_turned(sides: int, points: Floats) -> int:
    """Of how many first points ``points (S,2)`` are n turns, apart from the center at their end; 0 if they are not."""
    size = len(points) // sides
    turns = points[: sides * size].reshape(sides, size, 2)
    same = np.allclose(turns, turns[0] @ np.swapaxes(_rotations(sides), 1, 2), rtol=0, atol=1e-12)
    return size if same and not points[sides * size :].any() else 0


def _rotations(sides: int) -> Floats:
    """The turns ``(n,2,2)`` of the domain onto itself, the first by nothing."""
    angle = 2 * np.pi * np.arange(sides) / sides
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([cosine, -sine, sine, cosine], axis=-1).reshape(sides, 2, 2)


def _turned(first: Basis, sides: int, size: int) -> Basis:
    """The tables at all turns of the first ``size`` points of ``first``, and then at its others.

    At a point turned by one corner, side k counts as much as side k - 1 at the point itself, and gradients are turned.
    """
    count = sides * size + first.linear.shape[1] - size
    rotations = _rotations(sides)

    def turn(jets: Floats) -> Floats:
        """Jets ``(3,size+r,b,n,...)``, the same for each of b kinds of columns, at all points."""
        result = np.empty((3, count, *jets.shape[2:]))
        result[:, sides * size :] = jets[:, size:]
        for j, rotation in enumerate(rotations):
            rolled = np.roll(jets[:, :size], j, axis=3)
            part = result[:, j * size : (j + 1) * size]
            part[0] = rolled[0]
            part[1:] = np.tensordot(rotation, rolled[1:], 1)
        return result

    kinds = first.linear.shape[2] // sides
    linear = np.empty((3, count, first.linear.shape[2]))
    blocks = turn(first.linear[..., : kinds * sides].reshape(3, -1, kinds, sides))
    linear[..., : kinds * sides] = blocks.reshape(3, count, -1)
    single = first.linear[..., kinds * sides :]  # of the center: the same for all sides
    linear[..., kinds * sides :] = turn(single[..., None])[..., 0]
    weights, abscissae = (turn(jets[:, :, None])[:, :, 0] for jets in (first.weights, first.abscissae))
    return Basis(linear, weights, abscissae, turn(first.ends[:, :, None])[:, :, 0])


def _basis_at(sides: int, points: Floats, corrected: bool, uneven: bool) -> Basis:
    """Tables of the patch at any ``points (S,2)``; see ``gregory_basis``."""
    domain = domain_jets(sides, points)
    blocks = _plain_columns(domain)
    weights = _field_weights(domain)
    if corrected:
        weights = jet_product(weights, jet_compose(*side_speed(sides, domain.u[0]), domain.u))
        if sides != 4:
            p, tau0, tau1, middle = _correction(sides, points, domain, uneven)
            blocks[0] += p
            blocks[1] += 3 * tau0
            blocks[2] -= 3 * tau1
            blocks.append(middle)
        blocks.append(_center_bump(domain))
    return _basis(np.concatenate(blocks, axis=1), weights, domain.u, _end_weights(domain))


def _basis(linear: Floats, weights: Floats, u: Floats, ends: Floats) -> Basis:
    """Jets ``(3,c,S)`` and, of the ends, ``(2,3,n,S)``, with the samples before the columns."""
    linear, weights, u = (np.ascontiguousarray(np.swapaxes(jets, 1, 2)) for jets in (linear, weights, u))
    return Basis(linear, weights, u, np.ascontiguousarray(ends.transpose(1, 3, 2, 0)))


def _end_weights(domain: Domain) -> Floats:
    """Weights of T_k(0) and T_k(1): jets ``(2,3,n,S)``."""
    return np.stack([-jet_product(domain.w, domain.v), -np.roll(jet_product(domain.w, domain.u), -1, axis=1)])


def edge_normal_basis(sides: int, points: Floats) -> Basis:
    """Tables of the paper's approximate normals (section 4.3): the unit edge normals blended like the curves.

    Control vectors are the corner normals, side fields the unit edge normals. Only values are given.
    """
    domain = domain_jets(sides, points)
    both = domain.w + np.roll(domain.w, -1, axis=1)
    return _basis(-domain.w, both, domain.u, np.zeros((2, *domain.w.shape)))


def _field_weights(domain: Domain) -> Floats:
    """Weight of T_k(u_k): w_k v_k + w_{k+1} u_{k+1}, as jets ``(3,n,S)``."""
    return jet_product(domain.w, domain.v) + np.roll(jet_product(domain.w, domain.u), -1, axis=1)


def _plain_columns(domain: Domain) -> list[Floats]:
    """Columns of p, Q0 - p, Q1 - p_{k+1}, T'(0), T'(1): jets ``(3,n,S)`` each."""
    u, v, w = domain.u, domain.v, domain.w
    both = w + np.roll(w, -1, axis=1)
    values = bernstein_basis(3, u[0])
    slopes = bernstein_slopes(3, u[0])
    curve = [jet_product(both, jet_compose(values[i], slopes[i], u)) for i in range(4)]
    at_start = _twist(u, v)
    at_end = _twist(v, u)
    return [
        curve[0] + curve[1] + np.roll(curve[2] + curve[3], 1, axis=1) - w,
        curve[1],
        curve[2],
        -jet_product(w, at_start),
        np.roll(jet_product(w, at_end), -1, axis=1),
    ]


def _twist(u: Floats, v: Floats) -> Floats:
    """Jet of u v^2 / (u + v), Gregory's twist term, which vanishes with its slopes at u = v = 0."""
    total = u[0] + v[0]
    safe = np.where(total > 0, total, 1.0)
    result = np.empty_like(u)
    result[0] = u[0] * v[0] ** 2 / safe
    by_u = v[0] ** 3 / safe**2
    by_v = (u[0] * v[0] ** 2 + 2 * u[0] ** 2 * v[0]) / safe**2
    result[1:] = by_u * u[1:] + by_v * v[1:]
    return result


def _center_bump(domain: Domain) -> Floats:
    """Jet ``(3,1,S)`` of the product of the squared distances over the apothem: 1 at the center."""
    square = domain.distance[:, 0]
    for k in range(1, domain.distance.shape[1]):
        square = jet_product(square, domain.distance[:, k])
    return jet_product(square, square)[:, None]


# --- the polynomial correction -----------------------------------------------------------------------------


def correction_degree(sides: int, uneven: bool = False) -> int:
    """Degree of the polynomials that the corrected patch of n sides reproduces: 0 for none (n = 4).

    Where one of many sides takes a large share of the outline, the regular domain is a poor map of the polygon and
    a higher degree overshoots: half of a 65-gon's cap rose to 2.3 times its height.
    """
    return 1 if uneven else {3: 3, 4: 0, 5: 4, 6: 4}.get(sides, 3)


def side_speed(sides: int, t: Floats) -> tuple[Floats, Floats]:
    """s_n(t) and its derivative: the speed of the patch across side k over that of a linear cross tangent."""
    if sides == 4:
        return np.ones_like(t), np.zeros_like(t)
    a, b = (1 - t) ** 2, t**2
    total, total_slope = a + b, 4 * t - 2
    if sides == 3:
        return total, total_slope
    g = 2 * np.cos(2 * np.pi / sides)
    p, q = 1 + g * t, 1 + g * (1 - t)
    under = a / p + b / q
    under_slope = (-2 * (1 - t) * p - g * a) / p**2 + (2 * t * q + g * b) / q**2
    return total / under, (total_slope * under - total * under_slope) / under**2


@lru_cache(maxsize=64)
def _monomials(degree: int) -> Ints:
    """Exponents ``(m,2)`` of the monomials up to a total degree."""
    return np.array([(i, total - i) for total in range(degree + 1) for i in range(total, -1, -1)])


def _powers(x: Floats, degree: int) -> Floats:
    """Powers 0 to ``degree`` of ``x (...)`` with their first two derivatives: ``(3,degree+1,...)``."""
    result = np.zeros((3, degree + 1, *x.shape))
    result[0, 0] = 1.0
    for i in range(1, degree + 1):
        np.multiply(result[0, i - 1], x, out=result[0, i])
        for order in (1, 2):
            np.multiply(result[order - 1, i - 1], i, out=result[order, i])
    return result


def _monomial_derivatives(degree: int, points: Floats) -> tuple[Floats, Floats, Floats]:
    """Monomials at ``points (...,2)``: values ``(m,...)``, gradients ``(m,...,2)``, Hessians ``(m,...,2,2)``."""
    i, j = _monomials(degree).T
    px, py = _powers(points[..., 0], degree)[:, i], _powers(points[..., 1], degree)[:, j]
    value = px[0] * py[0]
    gradient = np.stack([px[1] * py[0], px[0] * py[1]], axis=-1)
    mixed = px[1] * py[1]
    rows = [np.stack([px[2] * py[0], mixed], axis=-1), np.stack([mixed, px[0] * py[2]], axis=-1)]
    return value, gradient, np.stack(rows, axis=-2)


@lru_cache(maxsize=64)
def correction_fit(sides: int, uneven: bool = False) -> Floats:
    """L ``(m,4n)``: the polynomial that fits positions and tangents at the corners and T in the side middles."""
    degree = correction_degree(sides, uneven)
    corners = domain_corners(sides)
    after = np.roll(corners, -1, axis=0)
    along = after - corners
    across = ((np.roll(corners, 1, axis=0) - corners) + (np.roll(corners, -2, axis=0) - after)) / 2
    value, gradient, _ = _monomial_derivatives(degree, corners)
    _, gradient_after, _ = _monomial_derivatives(degree, after)
    _, gradient_middle, _ = _monomial_derivatives(degree, (corners + after) / 2)
    rows = np.concatenate(
        [
            value,
            np.einsum("mki,ki->mk", gradient, along),
            np.einsum("mki,ki->mk", gradient_after, along),
            np.einsum("mki,ki->mk", gradient_middle, across),
        ],
        axis=1,
    )
    return np.linalg.pinv(rows.T, rcond=1e-9)


def _correction(sides: int, points: Floats, domain: Domain, uneven: bool) -> list[Floats]:
    """Columns for p, tau0, tau1 and T(1/2)/s(1/2): jets ``(3,n,S)`` each, zero with their slopes on all sides."""
    missing = _monomial_defects(points, domain, correction_degree(sides, uneven))
    table = np.einsum("dms,mc->dcs", missing, correction_fit(sides, uneven))
    return np.split(table, 4, axis=1)


def _monomial_defects(points: Floats, domain: Domain, degree: int) -> Floats:
    """Jets ``(3,m,S)`` of each monomial minus the plain patch through its own side data."""
    sides = domain.u.shape[1]
    value, gradient, _ = _monomial_derivatives(degree, points)
    defect = np.concatenate([value[None], np.moveaxis(gradient, -1, 0)])
    u, v, w = domain.u, domain.v, domain.w
    both, weights = w + np.roll(w, -1, axis=1), _field_weights(domain)
    curve, curve_slope, tangent, tangent_slope = _monomial_sides(sides, degree, u[0])
    defect -= jet_product(both[:, None], jet_compose(curve, curve_slope, u[:, None])).sum(axis=2)
    defect -= jet_product(weights[:, None], jet_compose(tangent, tangent_slope, u[:, None])).sum(axis=2)
    curve, _, tangent, slope = _monomial_sides(sides, degree, np.tile([0.0, 1.0], (sides, 1)))
    starts = [w, jet_product(w, v), jet_product(w, _twist(u, v))]
    ends = [np.roll(jet_product(w, jets), -1, axis=1) for jets in (u, -_twist(v, u))]
    at_ends = [curve[..., 0], tangent[..., 0], slope[..., 0], tangent[..., 1], slope[..., 1]]
    return defect + np.einsum("dks,mk->dms", np.concatenate([*starts, *ends], axis=1), np.concatenate(at_ends, axis=1))


def _monomial_sides(sides: int, degree: int, t: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Monomials along all sides at ``t (n,S)``: curve, its derivative, cross tangent, its derivative, ``(m,n,S)``."""
    start = domain_corners(sides)
    end, before, after = np.roll(start, -1, axis=0), np.roll(start, 1, axis=0), np.roll(start, -2, axis=0)
    along, t = end - start, t[..., None]
    across = (1 - t) * (before - start)[:, None] + t * (after - end)[:, None]
    turn = (after - end) - (before - start)
    value, gradient, hessian = _monomial_derivatives(degree, start[:, None] + t * along[:, None])
    speed, speed_slope = side_speed(sides, t[..., 0])
    plain = (gradient * across).sum(axis=-1)
    bend = (hessian * across[..., :, None]).sum(axis=-2)
    slope = (bend * along[:, None] + gradient * turn[:, None]).sum(axis=-1)
    slopes = (gradient * along[:, None]).sum(axis=-1)
    return value, slopes, speed * plain, speed_slope * plain + speed * slope


@lru_cache(maxsize=64)
def center_row(sides: int, uneven: bool) -> Basis:
    """The tables of the corrected patch at the center of the domain."""
    return gregory_basis(sides, np.zeros((1, 2)), True, uneven)
