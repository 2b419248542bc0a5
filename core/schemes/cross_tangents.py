"""Cross tangents of Gregory patches: the side fields T_k(t), in four kinds.

``linear`` and ``quadratic`` are the paper's (Leung, Wang, Zhang, equations (8)-(11)), with end corrections that
keep T(0) and T(1) on the neighboring edges for every normal. ``smooth`` and ``precise`` are ours
(docs/mathematics.md): a blend of the two end tangents, projected across the edge normal, with no square root.
All are perpendicular to the edge's normal field, which both faces share: that is what makes the surface G1.
Arrays run (component, face, side, abscissa).
"""

from __future__ import annotations

import numpy as np

from curvify.mesh import Bools, Floats, Ints
from curvify.records import record
from curvify.schemes.base import bernstein, bernstein_basis, bernstein_slope, bernstein_slopes

#: Weight of the smooth step in the blend of ``smooth``.
SMOOTH_STEP = 0.75
#: The smallest positive number.
SMALLEST = 5e-324


def dot(a: Floats, b: Floats) -> Floats:
    """Dot product over the leading axis."""
    return np.einsum("c...,c...->...", a, b)


def _dots(a: Floats, b: Floats) -> Floats:
    """Dot products ``(m,f,n)`` of vectors ``(m,3,f,n)``."""
    return np.einsum("mcfn,mcfn->mfn", a, b)


@record
class Sides:
    """Side data of some faces: ``curves`` and ``fields (3,f,n,4)`` Bezier points along each side in the face's
    direction; ``start``, ``end (3,f,n)`` the cross tangents that the neighboring edges ask for at its ends.
    """

    curves: Floats
    fields: Floats
    start: Floats
    end: Floats

    def take(self, rows: Ints) -> Sides:
        """Those of some of the faces."""
        return Sides(self.curves[:, rows], self.fields[:, rows], self.start[:, rows], self.end[:, rows])


def _abscissa_first(t: Floats) -> Floats:
    """Abscissae ``(m,)``, ``(n,m)`` or ``(f,n,m)`` as ``(m,1,1)``, ``(m,1,n)`` or ``(m,f,n)``."""
    first = t.transpose(t.ndim - 1, *range(t.ndim - 1))
    return first.reshape(len(first), *([1] * (3 - t.ndim)), *first.shape[1:])


def _abscissa_last(values: Floats) -> Floats:
    """Vectors ``(m,3,f,n)`` as ``(3,f,n,m)``."""
    return values.transpose(1, 2, 3, 0)


def _polynomials(points: Floats, basis: Floats) -> Floats:
    """Polynomials ``(m,3,f,n)`` with Bezier points ``(3,f,n,d+1)`` for a basis ``(d+1,m,1|f,1|n)``."""
    if basis.shape[2:] == (1, 1):
        rows = points.transpose(3, 0, 2, 1)
        product = basis.reshape(len(basis), -1).T @ rows.reshape(len(basis), -1)
        return product.reshape(-1, *rows.shape[1:]).swapaxes(2, 3)
    total = points[..., 0] * basis[0][:, None]
    for i in range(1, len(basis)):
        total += points[..., i] * basis[i][:, None]
    return total


def projection(normal: Floats, y: Floats, square: Floats) -> Floats:
    """Coefficient ``(m,f,n)`` of n_c in y: (n_c.y) / (n_c.n_c), where ``square`` is n_c.n_c.

    Where the normal vanishes so does the product, and with it the quotient.
    """
    return _dots(normal, y) / np.maximum(square, SMALLEST)


def start_share(kind: str, t: Floats) -> Floats:
    """The share h(t) of the start in the blends ``precise`` and ``smooth``; h(t) + h(1-t) = 1."""
    if kind == "precise":
        return 1 - t
    lam = SMOOTH_STEP
    return (1 - t) * ((1 - lam) + lam * (1 - t) * (1 + 2 * t))


def share_slope(kind: str, t: Floats) -> Floats:
    """h'(t)."""
    if kind == "precise":
        return -np.ones_like(t)
    return -(1 - SMOOTH_STEP) - 6 * SMOOTH_STEP * t * (1 - t)


@record
class ProjectedBlend:
    """T = f(t) (1 + K b(t)) Y, Y the part across n_c of h(t) T(0) + (1 - h(t)) T(1).

    ``precise``: f = s_n, b = 4t(1-t), h = 1-t. ``smooth``: f = 1, b = 16 t^2 (1-t)^2, h a smoother step.
    ``gains (f,n)`` is K. The side field is T/f: f is the same for all faces, and stands in the basis.
    Inside, the abscissa is the first axis, ``(m,3,f,n)``; in memory the faces are the last.
    """

    sides: Sides
    kind: str
    gains: Floats

    def take(self, rows: Ints) -> ProjectedBlend:
        """Those of some of the faces."""
        return ProjectedBlend(self.sides.take(rows), self.kind, self.gains[rows])

    def blend(self, t: Floats) -> Floats:
        """Y at ``t``: ``(3,f,n,m)``."""
        return _abscissa_last(self._blend(_abscissa_first(t)))

    def fields(self, t: Floats) -> Floats:
        """T/f at ``t (m,)``, ``(n,m)`` or ``(f,n,m)``: ``(3,f,n,m)``."""
        t = _abscissa_first(t)
        y = self._blend(t)
        y *= self._fullness(t)[0][:, None]
        return _abscissa_last(y)

    def field_derivatives(self, t: Floats) -> tuple[Floats, Floats]:
        """T/f and its derivative at ``t``."""
        t = _abscissa_first(t)
        y, y_slope = self._blend_with_slope(t)
        factor, slope = (values[:, None] for values in self._fullness(t))
        y_slope *= factor
        y_slope += slope * y
        y *= factor
        return _abscissa_last(y), _abscissa_last(y_slope)

    def _blend(self, t: Floats) -> Floats:
        """Y ``(m,3,f,n)``."""
        h = start_share(self.kind, t)[:, None]
        normal = _polynomials(self.sides.fields, bernstein_basis(3, t))
        y = self.sides.start * h
        y += self.sides.end * (1 - h)
        normal *= projection(normal, y, _dots(normal, normal))[:, None]
        y -= normal
        return y

    def _blend_with_slope(self, t: Floats) -> tuple[Floats, Floats]:
        """Y and Y' ``(m,3,f,n)``."""
        h, h_slope = (share(self.kind, t)[:, None] for share in (start_share, share_slope))
        start, end = self.sides.start, self.sides.end
        normal = _polynomials(self.sides.fields, bernstein_basis(3, t))
        normal_slope = _polynomials(self.sides.fields, bernstein_slopes(3, t))
        return project_with_slope(start * h + end * (1 - h), (start - end) * h_slope, normal, normal_slope)

    def _fullness(self, t: Floats) -> tuple[Floats, Floats]:
        """1 + K b and its derivative ``(m,f,n)``."""
        b, b_slope = 4 * t * (1 - t), 4 - 8 * t
        if self.kind == "precise":
            return 1 + self.gains * b, self.gains * b_slope
        return 1 + self.gains * b**2, self.gains * (2 * b * b_slope)


def project_with_slope(y: Floats, y_slope: Floats, normal: Floats, normal_slope: Floats) -> tuple[Floats, Floats]:
    """The part ``(m,3,f,n)`` of y across the normal, and its derivative."""
    square = _dots(normal, normal)
    q = projection(normal, y, square)
    numerator = _dots(normal_slope, y) + _dots(normal, y_slope) - 2 * q * _dots(normal, normal_slope)
    q_slope = numerator * (square > 0) / np.maximum(square, SMALLEST)
    q, q_slope = q[:, None], q_slope[:, None]
    return y - q * normal, y_slope - q_slope * normal - q * normal_slope


@record
class PaperTangent:
    """The paper's cross tangent: the polygon's chord across the side, turned to be perpendicular to n_c.

    ``points (3,f,n)`` the polygon; ``guides (3,f,n,3)`` the Bezier points of n_int along each side;
    ``spare`` serves the sides ``degenerate (f,n)`` where the chord or its direction vanishes.
    """

    sides: Sides
    points: Floats
    guides: Floats
    spare: ProjectedBlend
    degenerate: Bools
    corrections: tuple[Floats, Floats]

    @classmethod
    def build(cls, sides: Sides, points: Floats, guides: Floats) -> PaperTangent:
        """Find the degenerate sides and the corrections D0, D1 that restore the required ends."""
        gains = np.zeros(points.shape[1:])
        none = np.zeros(points.shape[1:], dtype=bool)
        tangent = cls(sides, points, guides, ProjectedBlend(sides, "smooth", gains), none, (sides.start * 0,) * 2)
        tangent.degenerate = tangent._vanishing()
        ends = tangent.fields(np.array([0.0, 1.0]))
        tangent.corrections = (sides.start - ends[..., 0], sides.end - ends[..., 1])
        return tangent

    def take(self, rows: Ints) -> PaperTangent:
        """Those of some of the faces."""
        first, last = self.corrections
        return PaperTangent(
            self.sides.take(rows),
            self.points[:, rows],
            self.guides[:, rows],
            self.spare.take(rows),
            self.degenerate[rows],
            (first[:, rows], last[:, rows]),
        )

    def _chord(self, t: Floats) -> tuple[Floats, Floats]:
        """x(t), from the curve to the line between the next corners, and its derivative."""
        before, after = np.roll(self.points, 1, axis=2)[..., None], np.roll(self.points, -2, axis=2)[..., None]
        curve = bernstein(self.sides.curves, t)
        curve_slope = bernstein_slope(self.sides.curves, t)
        return (1 - t) * before + t * after - curve, after - before - curve_slope

    def _direction(self, t: Floats) -> tuple[Floats, ...]:
        """x, x', t_c, t_c' (equation 10: (n_int x x) x n_c), n_c, n_c'."""
        x, x_slope = self._chord(t)
        guide, guide_slope = bernstein(self.guides, t), bernstein_slope(self.guides, t)
        normal = bernstein(self.sides.fields, t)
        normal_slope = bernstein_slope(self.sides.fields, t)
        a, b = dot(guide, normal), dot(x, normal)
        a_slope = dot(guide_slope, normal) + dot(guide, normal_slope)
        b_slope = dot(x_slope, normal) + dot(x, normal_slope)
        direction = x * a - guide * b
        slope = x_slope * a + x * a_slope - guide_slope * b - guide * b_slope
        return x, x_slope, direction, slope, normal, normal_slope

    def _vanishing(self) -> Bools:
        """Sides ``(f,n)`` where x or t_c vanishes at one of 17 abscissae, against their largest size."""
        x, _, direction, _, _, _ = self._direction(np.linspace(0, 1, 17))
        result = np.zeros(self.points.shape[1:], dtype=bool)
        for vector in (x, direction):
            size = dot(vector, vector)
            result |= size.min(axis=-1) <= 1e-16 * size.max(axis=-1)
        return result

    def fields(self, t: Floats) -> Floats:
        """T at ``t``: ``(3,f,n,m)``."""
        return self.field_derivatives(t)[0]

    def field_derivatives(self, t: Floats) -> tuple[Floats, Floats]:
        """T and T' at ``t`` (equation 11 with the end corrections)."""
        x, x_slope, direction, slope, normal, normal_slope = self._direction(t)
        size, square = dot(direction, direction), dot(x, x)
        safe = (size > 0) & (square > 0)
        size, square = np.where(safe, size, 1.0), np.where(safe, square, 1.0)
        ratio = np.sqrt(square / size)
        ratio_slope = ratio * (dot(x, x_slope) / square - dot(direction, slope) / size)
        first, last = (c[..., None] for c in self.corrections)
        ends = (1 - t) * first + t * last, np.broadcast_to(last - first, x.shape), normal, normal_slope
        part, part_slope = (
            _abscissa_last(values) for values in project_with_slope(*(v.transpose(3, 0, 1, 2) for v in ends))
        )
        value = ratio * direction + part
        value_slope = ratio * slope + ratio_slope * direction + part_slope
        if self.degenerate.any():
            spare, spare_slope = self.spare.field_derivatives(t)
            value = np.where(self.degenerate[..., None], spare, value)
            value_slope = np.where(self.degenerate[..., None], spare_slope, value_slope)
        return value, value_slope
