"""The domain of an n-sided Gregory patch: distances, corner coordinates and blending weights with derivatives.

Source: Leung, Wang, Zhang, equations (2)-(4), for a regular polygon with sides of length 1. A *jet* is an
array whose leading axis holds value, derivative by xi, derivative by eta.
"""

from __future__ import annotations

import numpy as np

from curvify.mesh import Floats
from curvify.records import record
from curvify.sampling import domain_corners


def jet_product(a: Floats, b: Floats) -> Floats:
    """Product of two jets."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    result[0] = a[0] * b[0]
    result[1:] = a[1:] * b[0] + a[0] * b[1:]
    return result


def jet_compose(values: Floats, slopes: Floats, jet: Floats) -> Floats:
    """Jet of f(x) where ``values`` = f(jet[0]) and ``slopes`` = f'(jet[0])."""
    return np.concatenate([values[None], slopes[None] * jet[1:]])


def apothem(sides: int) -> float:
    """Distance of the sides from the center."""
    return 0.5 / np.tan(np.pi / sides)


@record
class Domain:
    """Jets ``(3,n,S)`` at S points: ``u[k]``, ``v[k]`` of corner k and its weight ``w[k]``; ``distance[k]`` to
    side k, in units of the apothem.
    """

    u: Floats
    v: Floats
    w: Floats
    distance: Floats


def domain_jets(sides: int, points: Floats) -> Domain:
    """Coordinates and weights at ``points (S,2)`` of the closed domain."""
    distance = _distances(sides, points)
    before, after = np.roll(distance, 1, axis=1), np.roll(distance, -1, axis=1)
    u = _ratio(before, after)
    v = -np.roll(u, 1, axis=1)
    v[0] += 1
    return Domain(u, v, _weights(distance), distance)


def _distances(sides: int, points: Floats) -> Floats:
    """Jets ``(3,n,S)`` of the distances to the sides over the apothem; rounding noise on a side is cleared."""
    corners = domain_corners(sides)
    along = np.roll(corners, -1, axis=0) - corners
    inward = np.stack([-along[:, 1], along[:, 0]], axis=1) / apothem(sides)
    distance = np.empty((3, sides, len(points)))
    distance[0] = inward @ points.T + 1.0
    distance[0][np.abs(distance[0]) < 1e-14] = 0.0
    distance[1:] = inward.T[:, :, None]
    return distance


def _ratio(a: Floats, b: Floats) -> Floats:
    """Jet of a / (a + b), with 1/2 and no slope where both vanish (only for n = 3, where the weight does too)."""
    total = a + b
    defined = total[0] > 1e-14
    safe = np.where(defined, total[0], 1.0)
    result = np.empty_like(a)
    result[0] = np.where(defined, a[0] / safe, 0.5)
    result[1:] = np.where(defined, (a[1:] * b[0] - a[0] * b[1:]) / safe**2, 0.0)
    return result


def _weights(distance: Floats) -> Floats:
    """Jets ``(3,n,S)`` of w_k = W_k / sum W, W_k the product of the squared distances to the other sides."""
    sides = distance.shape[1]
    squares = jet_product(distance, distance)
    ahead = _running_products(squares)
    behind = _running_products(squares[:, ::-1])
    products = np.empty_like(distance)
    products[:, 0] = _running_products(squares[:, 1:])[:, sides - 2]
    for k in range(1, sides):
        products[:, k] = jet_product(ahead[:, k - 1], behind[:, sides - 1 - k])
    total = products.sum(axis=1, keepdims=True)
    result = np.empty_like(products)
    result[0] = products[0] / total[0]
    result[1:] = (products[1:] - result[0] * total[1:]) / total[0]
    return result


def _running_products(factors: Floats) -> Floats:
    """Jets ``(3,m+1,S)``: entry i is the product of the first i of the jets ``(3,m,S)``."""
    result = np.zeros((3, factors.shape[1] + 1, factors.shape[2]))
    result[0, 0] = 1.0
    for i in range(factors.shape[1]):
        result[:, i + 1] = jet_product(result[:, i], factors[:, i])
    return result
