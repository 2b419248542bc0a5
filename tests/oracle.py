"""Gregory patches straight from their equations, one polygon, one point at a time: slow, plain, and independent.

Everything is written for complex numbers, so that a derivative is the imaginary part of the value at a point moved
by a tiny imaginary step (Squire and Trapp 1998): exact to rounding, and nothing is differentiated by hand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import comb

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.complex128]
Field = Callable[[complex], Vector]
STEP = 1e-30


def derivative(function: Field, t: float) -> Vector:
    """Derivative of a function of one variable."""
    return np.asarray(function(t + 1j * STEP)).imag / STEP


def dot(a: Vector, b: Vector) -> complex:
    """Dot product without conjugation."""
    return complex((a * b).sum())


def normalized(a: Vector) -> Vector:
    return a / np.sqrt(dot(a, a))


def bezier(points: list[Vector], t: complex) -> Vector:
    degree = len(points) - 1
    return sum(comb(degree, i) * t**i * (1 - t) ** (degree - i) * p for i, p in enumerate(points))


# --- the domain: equations (2)-(4) --------------------------------------------------------------------------------


def corners(n: int) -> npt.NDArray[np.float64]:
    angle = 2 * np.pi * np.arange(n) / n
    return np.stack([np.cos(angle), np.sin(angle)], axis=1) / (2 * np.sin(np.pi / n))


def distances(n: int, x: Vector) -> list[complex]:
    """Distance to each side, 0 on it."""
    result = []
    for k in range(n):
        here, there = corners(n)[k], corners(n)[(k + 1) % n]
        along = there - here
        d = dot(np.array([-along[1], along[0]]), x - here)
        result.append(d.imag * 1j if abs(d.real) < 1e-14 else d)
    return result


def coordinates(n: int, x: Vector) -> tuple[list[complex], list[complex], list[complex]]:
    """u, v and w of every corner."""
    d = distances(n, x)
    u = []
    for k in range(n):
        total = d[k - 1] + d[(k + 1) % n]
        u.append(d[k - 1] / total if abs(total) > 1e-14 else 0.5)
    v = [1 - u[k - 1] for k in range(n)]
    weights = []
    for k in range(n):
        product: complex = 1.0
        for j in range(n):
            if j not in ((k - 1) % n, k):
                product *= d[j] ** 2
        weights.append(product)
    return u, v, [weight / sum(weights) for weight in weights]


# --- Gregory's patch: equations (1) and (3) ----------------------------------------------------------------------


def gregory(n: int, p: list[Vector], curves: list[Field], tangents: list[Field], x: Vector) -> Vector:
    """The blend of the corner interpolators for side curves C_k and cross tangents T_k."""
    u, v, w = coordinates(n, x)
    total = 0 * p[0]
    for k in range(n):
        uk, vk, t = u[k], v[k], u[k - 1]
        a, b = tangents[k](0.0), tangents[k - 1](1.0)
        a_slope, b_slope = derivative(tangents[k], 0.0), -derivative(tangents[k - 1], 1.0)
        r = -p[k] - vk * a - uk * b
        r = r + curves[k](uk) + vk * tangents[k](uk) + curves[k - 1](t) + uk * tangents[k - 1](t)
        if uk + vk != 0:
            r = r - uk * vk * (vk * a_slope + uk * b_slope) / (uk + vk)
        total = total + w[k] * r
    return total


# --- side data: equations (5)-(11) --------------------------------------------------------------------------------


@dataclass
class Side:
    """One side of a polygon: Bezier points, the normal field n_c, the ends asked of the cross tangent."""

    points: list[Vector]
    normal: Field
    chord: Vector

    def curve(self, t: complex) -> Vector:
        return bezier(self.points, t)


def make_side(p: Vector, q: Vector, n_p: Vector, n_q: Vector, circle: bool) -> Side:
    e = q - p
    mean = (n_p + n_q) / 2
    ends = []
    for normal in (n_p, n_q):
        t = normalized(np.cross(normal, np.cross(e, mean)))
        length = np.sqrt(dot(e, e))
        ends.append(t * (2 * length / (1 + dot(t, e) / length) if circle else length))
    points = [p, p + ends[0] / 3, q - ends[1] / 3, q]
    hodograph = [3 * (b - a) for a, b in pairwise(points)]

    def field(t: complex) -> Vector:
        return np.cross(bezier(hodograph, t), np.cross((1 - t) * n_p + t * n_q, e))

    return Side(points, field, e)


def across(y: Vector, normal: Vector) -> Vector:
    return y - normal * dot(normal, y) / dot(normal, normal)


def speed(n: int, t: complex) -> complex:
    """s_n(t): how fast a quadratic surface leaves a side of the regular polygon."""
    if n == 4:
        return 1.0 + 0 * t
    if n == 3:
        return (1 - t) ** 2 + t**2
    g = 2 * np.cos(2 * np.pi / n)
    return ((1 - t) ** 2 + t**2) / ((1 - t) ** 2 / (1 + g * t) + t**2 / (1 + g * (1 - t)))


class Patch:
    """The patch of one polygon with points and unit normals ``(n,3)``, its edges open."""

    def __init__(self, points: npt.NDArray[np.float64], normals: npt.NDArray[np.float64], kind: str) -> None:
        self.n, self.kind = len(points), kind
        self._at_center: Vector | None = None
        n = self.n
        self.p = [np.asarray(point, dtype=complex) for point in points]
        self.normals = [np.asarray(normal, dtype=complex) for normal in normals]
        circle = kind in ("smooth", "precise")
        self.sides = [
            make_side(self.p[k], self.p[(k + 1) % n], self.normals[k], self.normals[(k + 1) % n], circle)
            for k in range(n)
        ]
        self.starts = [-3 * (self.p[k] - self.sides[k - 1].points[2]) for k in range(n)]
        self.ends = [3 * (self.sides[(k + 1) % n].points[1] - self.p[(k + 1) % n]) for k in range(n)]
        self.area = normalized(
            sum(normalized(np.cross(self.p[(k + 1) % n] - self.p[k], self.p[k - 1] - self.p[k])) for k in range(n))
        )
        self.gains = [0.0] * n
        if kind in ("smooth", "precise"):
            self.gains = [self._smooth_gain(k) if kind == "smooth" else self._precise_gain(k) for k in range(n)]

    # cross tangents

    def tangent(self, k: int) -> Field:
        if self.kind in ("smooth", "precise"):
            return lambda t: self._blend(k, t, self.gains[k])
        return self._paper(k)

    def _blend(self, k: int, t: complex, gain: float) -> Vector:
        if self.kind == "smooth":
            h, b, f = (1 - t) * (0.25 + 0.75 * (1 - t) * (1 + 2 * t)), 16 * t**2 * (1 - t) ** 2, 1.0
        else:
            h, b, f = 1 - t, 4 * t * (1 - t), speed(self.n, t)
        y = h * self.starts[k] + (1 - h) * self.ends[k]
        return f * (1 + gain * b) * across(y, self.sides[k].normal(t))

    def _smooth_gain(self, k: int) -> float:
        middle = self._blend(k, 0.5, 0.0)
        mean = (np.sqrt(dot(self.starts[k], self.starts[k])) + np.sqrt(dot(self.ends[k], self.ends[k]))) / 2
        c = np.sqrt(dot(middle, middle)) / mean
        return (0.5 if self.n <= 4 else 1.0) * float(np.clip((1 - (c**2).real) / 2, 0, 0.2))

    def _precise_gain(self, k: int) -> float:
        share = {3: 0.0, 4: 0.15}.get(self.n, 0.3)
        y = self._blend(k, 0.5, 0.0) / speed(self.n, 0.5)
        reach = self.center() - self.sides[k].curve(0.5)
        far, fast = np.sqrt(dot(reach, reach)).real, np.sqrt(dot(y, y)).real
        cosine = max(dot(reach, y).real / (far * fast), 0.5)
        return float(np.clip(share * (4 * np.sin(np.pi / self.n) ** 2 * far / (fast * cosine) - 1), -0.5, 1))

    def _paper(self, k: int) -> Field:
        n, side = self.n, self.sides[k]
        first = (self.normals[k - 1] + self.normals[k]) / 2
        last = (self.normals[(k + 1) % n] + self.normals[(k + 2) % n]) / 2
        middle = (first + last) / 2 if self.kind == "linear" else self.area

        def plain(t: complex) -> Vector:
            inner = (2 * t - 1) * (t - 1) * first + 4 * t * (1 - t) * middle + t * (2 * t - 1) * last
            x = (1 - t) * self.p[k - 1] + t * self.p[(k + 2) % n] - side.curve(t)
            direction = np.cross(np.cross(inner, x), side.normal(t))
            return direction * np.sqrt(dot(x, x) / dot(direction, direction))

        start, end = self.starts[k] - plain(0.0), self.ends[k] - plain(1.0)
        return lambda t: plain(t) + across((1 - t) * start + t * end, side.normal(t))

    # the patch

    def __call__(self, x: npt.ArrayLike, corrected: bool = True) -> Vector:
        place = np.asarray(x, dtype=complex)
        tangents = [self.tangent(k) for k in range(self.n)]
        curves = [side.curve for side in self.sides]
        plain = gregory(self.n, self.p, curves, tangents, place)
        if self.kind != "precise" or not corrected:
            return plain
        if self._at_center is None:
            origin = np.zeros(2, dtype=complex)
            self._at_center = gregory(self.n, self.p, curves, tangents, origin) + self._correction(origin)
        return plain + self._correction(place) + self._bump(place) * (self.center() - self._at_center)

    def jet(self, x: npt.ArrayLike, corrected: bool = True) -> npt.NDArray[np.float64]:
        """Value, derivative by xi and derivative by eta ``(3,3)``."""
        by_xi, by_eta = (self(np.asarray(x) + 1j * STEP * axis, corrected) for axis in np.eye(2))
        return np.array([by_xi.real, by_xi.imag / STEP, by_eta.imag / STEP])

    def center(self) -> Vector:
        p, normals = np.array(self.p), np.array(self.normals)
        mean = p.mean(axis=0)
        area = normalized(np.cross(p - mean, np.roll(p, -1, axis=0) - mean).sum(axis=0))
        total = normals.sum(axis=0)
        m = area if np.sqrt(dot(total, total).real) < 0.2 * self.n else normalized(total)
        axis = normalized(m + max(dot(m, area).real, 0.0) ** 4 * area)
        lifts = [
            -dot(mean - pk, nk + axis) / max(1 + dot(nk, axis).real, 0.5) for pk, nk in zip(p, normals, strict=True)
        ]
        return mean + axis * np.mean(lifts)

    def _bump(self, x: Vector) -> complex:
        apothem = 1 / (2 * np.tan(np.pi / self.n))
        return complex(np.prod([(d / apothem) ** 2 for d in distances(self.n, x)]))

    def _correction(self, x: Vector) -> Vector:
        """Section C: what the plain patch misses of each monomial, times the monomials that fit the sides."""
        n = self.n
        if n == 4:
            return np.zeros(3, dtype=complex)
        degree = 4 if n in (5, 6) else 3
        exponents = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
        missing = np.array([defect(n, i, j, x[0], x[1]) for i, j in exponents])
        rows = np.array([monomial_data(n, i, j) for i, j in exponents]).T
        fit = np.linalg.pinv(rows, rcond=1e-9)
        sides, p = self.sides, self.p
        data = [
            *p,
            *[3 * (s.points[1] - s.points[0]) for s in sides],
            *[3 * (s.points[3] - s.points[2]) for s in sides],
            *[self.tangent(k)(0.5) / speed(n, 0.5) for k in range(n)],
        ]
        return (missing @ fit) @ np.array(data)


@cache
def defect(n: int, i: int, j: int, xi: complex, eta: complex) -> complex:
    """A monomial minus the plain patch through its own side data."""
    c = corners(n)

    def value(y: Vector) -> Vector:
        return np.array([y[0] ** i * y[1] ** j])

    def curve(k: int) -> Field:
        return lambda t: value((1 - t) * c[k] + t * c[(k + 1) % n])

    def tangent(k: int) -> Field:
        def at(t: complex) -> Vector:
            y = (1 - t) * c[k] + t * c[(k + 1) % n]
            along = (1 - t) * (c[k - 1] - c[k]) + t * (c[(k + 2) % n] - c[(k + 1) % n])
            return speed(n, t) * (gradient(i, j, y) * along).sum()[None]

        return at

    p = [value(point.astype(complex)) for point in c]
    x = np.array([xi, eta])
    plain = gregory(n, p, [curve(k) for k in range(n)], [tangent(k) for k in range(n)], x)
    return complex((value(x) - plain)[0])


def gradient(i: int, j: int, y: Vector) -> Vector:
    by_x = i * y[0] ** max(i - 1, 0) * y[1] ** j
    by_y = y[0] ** i * j * y[1] ** max(j - 1, 0)
    return np.array([by_x, by_y])


def monomial_data(n: int, i: int, j: int) -> list[float]:
    """Values at the corners, derivatives along the sides at both ends, derivatives across in the middles."""
    c = corners(n)
    values = [c[k][0] ** i * c[k][1] ** j for k in range(n)]
    starts = [gradient(i, j, c[k]) @ (c[(k + 1) % n] - c[k]) for k in range(n)]
    ends = [gradient(i, j, c[(k + 1) % n]) @ (c[(k + 1) % n] - c[k]) for k in range(n)]
    middles = []
    for k in range(n):
        inward = ((c[k - 1] - c[k]) + (c[(k + 2) % n] - c[(k + 1) % n])) / 2
        middles.append(gradient(i, j, (c[k] + c[(k + 1) % n]) / 2) @ inward)
    return [*values, *starts, *ends, *middles]
