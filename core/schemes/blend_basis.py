"""Tables of the blending scheme: weights, charts, monomials, and how coefficients turn with a chart.

Near a vertex the surface is a polynomial ``P(X, Y) = sum C[3a+b] X^a Y^b``, a, b <= 2, in the coordinates of a chart:
with (x, y) the parameters of a face along the two edges at the corner, r = |(x, y)| and theta their angle,

    X + iY = r^A exp(i (B theta + phi)).

Four of them, weighted with w(x) w(y), make a face. Source: Ko, Lee, Lim, Yoon, "Construction and Rendering of Trimmed
Blending Surfaces with Sharp Features on a GPU", equations (1), (2) and (5). A chart that is turned by phi only turns
the coefficients, so that tables depend on (A, B) alone. A *jet* is an array whose leading axis holds value,
derivative by x, derivative by y.
"""

from __future__ import annotations

from math import comb

import numpy as np

from curvify.mesh import Floats
from curvify.schemes.domain import jet_product

#: Exponents (a, b) of X and Y of the nine monomials, in the order of the coefficients.
EXPONENTS = tuple((a, b) for a in range(3) for b in range(3))
#: Coefficients along the axis Y = 0, and those of the derivative across it.
ALONG, ACROSS = [0, 3, 6], [1, 4, 7]
#: The 36 columns of a face, nine by nine for its corners: first the four points, whose weights sum to 1, then the rest.
COLUMNS = [0, 9, 18, 27, *(9 * corner + i for corner in range(4) for i in range(1, 9))]
#: How the coordinates x, y at corner c of a face follow from its u, v: offset, factor of u, factor of v.
CORNER_COORDINATES = (
    ((0, 1, 0), (0, 0, 1)),
    ((0, 0, 1), (1, -1, 0)),
    ((1, -1, 0), (1, 0, -1)),
    ((1, 0, -1), (0, 1, 0)),
)


def weight(order: int, t: Floats) -> tuple[Floats, Floats]:
    """The blending function w, 1 at t = 0 and 0 at t = 1, and its derivative; ``order`` 3 is the paper's, or 5."""
    if order == 3:
        return 1 + t * t * (2 * t - 3), -6 * t * (1 - t)
    return 1 - t**3 * (10 - 15 * t + 6 * t * t), -30 * (t * (1 - t)) ** 2


def chart_jets(a: float, b: float, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Jets ``(3,S)`` of the chart coordinates X and Y for phi = 0.

    At r = 0, where the derivatives vanish or grow without bound, r^(A-1) counts as 1: so the cross product of the
    surface's derivatives has its true direction there too.
    """
    r, theta = np.hypot(x, y), np.arctan2(y, x)
    away = r > 0
    speed = np.where(away, r, 1.0) ** (a - 1)
    cosine, sine = np.cos(b * theta), np.sin(b * theta)
    along, across = np.divide(x, r, out=np.ones_like(r), where=away), np.divide(y, r, out=np.zeros_like(r), where=away)
    # the derivatives of zeta over r^(A-1) exp(i B theta)
    by_x, by_y = (a * along, -b * across), (a * across, b * along)
    real, imaginary = np.empty((3, len(r))), np.empty((3, len(r)))
    real[0], imaginary[0] = speed * r * cosine, speed * r * sine
    for row, (re, im) in ((1, by_x), (2, by_y)):
        real[row] = speed * (re * cosine - im * sine)
        imaginary[row] = speed * (re * sine + im * cosine)
    return real, imaginary


def corner_jets(order: int, a: float, b: float, x: Floats, y: Floats) -> Floats:
    """Jets ``(3,9,S)`` of w(x) w(y) X^a Y^b at corner coordinates ``x``, ``y (S,)``."""
    first, second = chart_jets(a, b, x, y)
    ones = np.zeros_like(first)
    ones[0] = 1.0
    powers_x = ones, first, jet_product(first, first)
    powers_y = ones, second, jet_product(second, second)
    (wx, dx), (wy, dy) = weight(order, x), weight(order, y)
    blend = np.stack([wx * wy, dx * wy, wx * dy])
    return np.stack([jet_product(blend, jet_product(powers_x[i], powers_y[j])) for i, j in EXPONENTS], axis=1)


def face_jets(order: int, charts: tuple[tuple[float, float], ...], uv: Floats) -> Floats:
    """Jets ``(3,36,S)`` at points ``uv (S,2)`` of the unit square: nine columns for each of its corners, ordered by
    ``COLUMNS``. ``charts`` are (A, B) of the four corners. Derivatives are by u and v.
    """
    u, v = uv[:, 0], uv[:, 1]
    result = np.empty((3, 36, len(uv)))
    for corner, (along_x, along_y) in enumerate(CORNER_COORDINATES):
        x, y = (offset + p * u + q * v for offset, p, q in (along_x, along_y))
        jets = corner_jets(order, *charts[corner], x, y)
        columns = result[:, 9 * corner : 9 * corner + 9]
        columns[0] = jets[0]
        columns[1] = along_x[1] * jets[1] + along_y[1] * jets[2]
        columns[2] = along_x[2] * jets[1] + along_y[2] * jets[2]
    return result[:, COLUMNS]


def turning(angles: Floats) -> Floats:
    """Matrices ``(T,9,9)`` that turn coefficients: P(R z) = (M C)(z) for a turn R by each angle ``(T,)``, in radians.

    Exact where the turned polynomial has no other monomials: for those of total degree 2 at any angle, for all at
    quarter turns.
    """
    c, s = np.cos(angles), np.sin(angles)
    c[np.abs(c) < 1e-15] = 0.0
    s[np.abs(s) < 1e-15] = 0.0
    result = np.zeros((len(angles), 9, 9))
    for column, (a, b) in enumerate(EXPONENTS):
        # X^a Y^b with X = c x - s y and Y = s x + c y
        for i in range(a + 1):
            for j in range(b + 1):
                power_x, power_y = a - i + j, i + b - j
                if power_x <= 2 and power_y <= 2:
                    factor = comb(a, i) * comb(b, j) * c ** (a - i) * (-s) ** i * s**j * c ** (b - j)
                    result[:, 3 * power_x + power_y, column] += factor
    return result


def monomials(x: Floats, y: Floats) -> Floats:
    """The nine monomials ``(...,9)`` at chart coordinates."""
    return np.stack([x**a * y**b for a, b in EXPONENTS], axis=-1)


def edge_jets(order: int, a: Floats, t: Floats) -> tuple[Floats, Floats, Floats]:
    """Along an edge from a vertex with exponent ``a (e,1)`` at parameters ``t``, broadcast: ``(e,m,3)`` each.

    Values of w(t) X^j, their derivatives by t, and w(t) X^j t^(A-1), j = 0 to 2, X = t^A; t^(A-1) counts as 1 at 0.
    """
    w, slope = weight(order, t)
    lower = np.where(t == 0, 1.0, t) ** (a - 1)
    x = lower * t
    speed = a * lower
    values = np.stack([w + 0 * x, w * x, w * x * x], axis=-1)
    slopes = np.stack([slope + 0 * x, slope * x + w * speed, x * (slope * x + 2 * w * speed)], axis=-1)
    return values, slopes, values * lower[..., None]
