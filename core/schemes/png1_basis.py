"""Basis tables of PNG1 triangles: the control functions of the paper, gathered by control point.

Source: Fuenfzig, Mueller, Hansford, Farin, section 3.2, equation (6) and the blending functions after it. With
x, y, z the barycentric coordinates of a side's start, its end and the corner across, the columns are

    corners x^3;  q1: 3 x^2 y g(z);  q2: 3 x y^2 g(z);  Xba: 3 x^2 z h(y);  Xab: 3 y^2 z h(x);
    Ma: 6 x^3 y^2 z (1-y) / (sigma tau);  Mb: 6 x^2 y^3 z (1-x) / (sigma tau)

with g(t) = (1-t)^2 / (t^2 + (1-t)^2), h = 1 - g, sigma = xy + yz + zx, tau = x + y - 2xy. They are not negative and sum
to 1. Ma and Mb vanish at the corners with their derivatives, which are their limits there.
"""

from __future__ import annotations

import numpy as np

from curvify.mesh import Floats
from curvify.schemes.domain import jet_compose, jet_product


def png1_columns(coordinates: Floats) -> Floats:
    """Jets ``(3,21,S)`` of the columns: corners, then q1, q2, Xba, Xab, Ma, Mb of the three sides each."""
    x, y, z = (np.roll(coordinates, -step, axis=1) for step in range(3))
    xx, yy, xy = jet_product(x, x), jet_product(y, y), jet_product(x, y)
    near, far_x, far_y = _near(z), _far(x), _far(y)
    sigma = xy + jet_product(y, z) + jet_product(z, x)
    below = jet_product(sigma, x + y - 2 * xy)
    inner = jet_product(jet_product(xx, yy), z)
    return np.concatenate(
        [
            jet_product(xx, x),
            3 * jet_product(jet_product(xx, y), near),
            3 * jet_product(jet_product(x, yy), near),
            3 * jet_product(jet_product(xx, z), far_y),
            3 * jet_product(jet_product(yy, z), far_x),
            6 * _quotient(jet_product(jet_product(inner, x), _rest(y)), below),
            6 * _quotient(jet_product(jet_product(inner, y), _rest(x)), below),
        ],
        axis=1,
    )


def _rest(jet: Floats) -> Floats:
    """Jet of 1 - t."""
    result = -jet
    result[0] += 1
    return result


def _near(jet: Floats) -> Floats:
    """Jet of g(t)."""
    t = jet[0]
    total = t**2 + (1 - t) ** 2
    return jet_compose((1 - t) ** 2 / total, -2 * t * (1 - t) / total**2, jet)


def _far(jet: Floats) -> Floats:
    """Jet of h(t) = 1 - g(t)."""
    return _near(_rest(jet))


def _quotient(above: Floats, below: Floats) -> Floats:
    """Jet of a quotient, zero where ``below`` is."""
    none = below[0] == 0
    safe = np.where(none, 1.0, below[0])
    value = above[0] / safe
    result = np.concatenate([value[None], (above[1:] - value * below[1:]) / safe])
    result[:, none] = 0.0
    return result
