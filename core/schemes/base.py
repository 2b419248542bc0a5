"""What a scheme gives and a backend evaluates: control vectors times basis tables.

A surface form over a polygon domain is

    G(x) = sum_i linear_i(x) c_i  +  sum_k weight_k(x) T_k(u_k(x)) + start_k(x) T_k(0) + end_k(x) T_k(1)

with control vectors ``c_i`` and side fields ``T_k`` that depend on one variable. Most schemes have no side
fields. A backend multiplies tables and control vectors; it needs to know nothing else about a scheme.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from math import comb
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from curvify.arrays import as_slice
from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.records import field, record
from curvify.sampling import Sampling
from curvify.schemes.construction import Construction, DeviceForm
from curvify.topology import Topology

if TYPE_CHECKING:
    from curvify.prepare import Coarse


@record
class Basis:
    """A basis at ``S`` points of a domain; leading axis: value, derivative by xi, derivative by eta.

    ``linear (3,S,L)``; ``weights (3,S,n)`` of the side fields and ``abscissae (3,S,n)``, where on its side each
    field is taken; ``ends (3,S,n,2)`` weights of the fields' values at 0 and 1. Schemes without side fields have
    n = 0 there.
    """

    linear: Floats
    weights: Floats
    abscissae: Floats
    ends: Floats


class Controls(Protocol):
    """Control data of some faces of one class."""

    @property
    def linear(self) -> Floats:
        """Control vectors ``(3,f,L)``."""

    def take(self, rows: Ints) -> Controls:
        """Those of some of the faces."""

    def fields(self, t: Floats) -> Floats:
        """Side fields ``(3,f,n,m)`` at abscissae ``t (m,)`` or ``(...,n,m)`` per side."""

    def field_derivatives(self, t: Floats) -> tuple[Floats, Floats]:
        """Side fields and their derivatives, each ``(3,f,n,m)``, at ``t`` as above."""


@record
class LinearControls:
    """Control vectors ``linear (3,f,L)`` of a form without side fields."""

    linear: Floats

    def take(self, rows: Ints) -> LinearControls:
        """Those of some of the faces."""
        return LinearControls(self.linear[:, rows])

    def fields(self, t: Floats) -> Floats:
        """No fields: ``(3,f,0,m)``."""
        return np.zeros((3, self.linear.shape[1], 0, np.shape(t)[-1]))

    def field_derivatives(self, t: Floats) -> tuple[Floats, Floats]:
        """No fields, no derivatives."""
        return self.fields(t), self.fields(t)


def linear_basis(columns: Floats) -> Basis:
    """The basis of a form without side fields, from the jets ``(3,L,S)`` of its columns."""
    linear = np.ascontiguousarray(np.swapaxes(columns, 1, 2))
    none = np.zeros((*linear.shape[:2], 0))
    return Basis(linear, none, none, none[..., None].repeat(2, axis=-1))


@record
class Form:
    """A vector function on the faces of one class.

    ``key`` identifies the basis (for caches); ``basis(points (S,2))`` gives its tables;
    ``controls(rows)`` the control data of some of the class's faces. The first ``points`` control vectors are points,
    whose weights sum to 1, the others differences of points: a backend of low precision then moves them to an origin
    near each face. With none, positions are evaluated where they are. ``device`` says how a device makes them itself.
    """

    key: Hashable
    basis: Callable[[Floats], Basis]
    controls: Callable[[Ints], Controls]
    points: int = 0
    device: DeviceForm | None = None


@record
class KiteForms:
    """A surface made of one form for each kite of a patch: the quad between a corner, the middles of its two sides
    and the middle of the patch.

    ``forms``, and ``which (f,n)`` of them each kite of the patches has; ``corners (f,)`` the first corner of each
    patch in the topology. Forms live on the unit square, the patch's corner at (0, 0) and its side along the first
    coordinate; their ``controls`` take corners of the topology. ``network`` is what the forms were made from, for
    backends that evaluate it without tables.
    """

    forms: list[Form]
    which: Ints
    corners: Ints
    network: Any


@record
class PatchClass:
    """Patches that share their tables: ``patches (f,)`` ids, ascending, all with ``sides`` sides.

    ``normals`` is None where normals are the cross product of the surface's derivatives.
    """

    sides: int
    patches: Ints
    surface: Form | KiteForms
    normals: Form | None = None


class Edges(Protocol):
    """The curves over the edges of a mesh, and the normals of the surface along them.

    Both are evaluated in the edges' canonical direction, elementwise: an edge gets the same bits wherever it stands.
    """

    def points(self, edges: Ints, t: Floats) -> Floats:
        """Points ``(3,e,m)`` of edges ``(e,)`` at ``t``: ``(m,)`` for all, or ``(e,1)``, one for each."""

    def normals(self, fields: Ints, t: Floats) -> Floats:
        """Unit normals ``(3,e,m)`` of normal fields ``(e,)`` at ``t`` as above."""


@record
class BezierEdges:
    """Cubics and polynomial normals: ``curves (3,E,d+1)`` Bezier points of the edges, ``fields (3,N,q+1)`` of the edge
    normals, which are not of unit length. ``construction``: how a device makes them itself.
    """

    curves: Floats
    fields: Floats
    construction: Construction | None = None

    def points(self, edges: Ints, t: Floats) -> Floats:
        """Points ``(3,e,m)``."""
        return bezier_points(self.curves[:, as_slice(edges)], t)

    def normals(self, fields: Ints, t: Floats) -> Floats:
        """Unit normals ``(3,e,m)``, zero where a field vanishes."""
        normals = bezier_points(self.fields[:, as_slice(fields)], t)
        length = np.sqrt(np.einsum("cem,cem->em", normals, normals))
        length[length == 0] = 1.0
        normals /= length
        return normals


def bezier_points(points: Floats, t: Floats) -> Floats:
    """Values ``(3,e,m)`` of Bezier polynomials ``(3,e,d+1)`` at ``t``: ``(m,)`` for all, or ``(e,1)``, one for each.

    Plain elementwise arithmetic: an edge gets the same bits wherever it stands. In memory the edges come last.
    """
    rows = np.ascontiguousarray(points.transpose(2, 0, 1))
    basis = bernstein_basis(len(rows) - 1, np.atleast_2d(t).T)[:, :, None]
    total = rows[0] * basis[0]
    term = np.empty_like(total)
    for i in range(1, len(rows)):
        total += np.multiply(rows[i], basis[i], out=term)
    return total.transpose(1, 2, 0)


@record
class Patches:
    """A mesh's surface, ready to evaluate.

    ``positions (V,3)`` of the input's vertices, ``stand_in (V,)`` the vertex that each was welded to; ``topology`` of
    the patches (a face may be cut into several); ``source_faces (P,)`` the input face of each patch, ascending;
    ``source_corners (C,)`` the input corner of each patch corner. The last D edges lie inside cut faces,
    ``inner_faces (D,)``, ascending. ``edges``: the E curves over the edges and N normal fields along them, the first E
    those of the edges' first half-edges; ``side_field (C,)`` the one on each half-edge; ``normals (C,3)`` unit normal
    of each patch corner. ``warnings``, ``counts`` and the number of ``marks`` by source and kind for the report.
    """

    positions: Floats
    topology: Topology
    source_faces: Ints
    source_corners: Ints
    stand_in: Ints
    inner_faces: Ints
    edges: Edges
    side_field: Ints
    normals: Floats
    classes: list[PatchClass]
    sampling: Callable[[int, int], Sampling]
    mesh: PolygonMesh
    warnings: list[str] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    marks: dict[str, dict[str, int]] = field(default_factory=dict)


class Scheme(Protocol):
    """A way to make a surface from a polygon mesh. One module per scheme."""

    name: str
    summary: str
    source: str
    faces: str
    keeps: str
    continuity: str
    normals: tuple[str, ...]

    def prepare(self, mesh: PolygonMesh | Coarse, options: Any) -> Any:
        """Patches of the whole mesh, or what a driver of the scheme's own takes; raises CurvifyError where the mesh
        cannot be used.
        """


def bernstein(coefficients: Floats, t: Floats) -> Floats:
    """Bezier polynomials ``(...,d+1)`` at ``t``: a shared ``t (m,)`` gives ``(...,m)`` by one matrix product.

    A ``t`` with more axes is broadcast against ``coefficients[...,0,None]``.
    """
    return _combine(coefficients, bernstein_basis(coefficients.shape[-1] - 1, t))


def bernstein_slope(coefficients: Floats, t: Floats) -> Floats:
    """Derivatives of Bezier polynomials ``(...,d+1)`` at ``t``, as in ``bernstein``."""
    return _combine(coefficients, bernstein_slopes(coefficients.shape[-1] - 1, t))


def _combine(coefficients: Floats, basis: Floats) -> Floats:
    if basis.ndim == 2:
        rows = coefficients.reshape(-1, len(basis)) @ basis
        return rows.reshape(*coefficients.shape[:-1], -1)
    total = coefficients[..., 0, None] * basis[0]
    for i in range(1, len(basis)):
        total += coefficients[..., i, None] * basis[i]
    return total


def bernstein_product(a: Floats, b: Floats, times: Callable[[Floats, Floats], Floats] = np.multiply) -> Floats:
    """Bezier points ``(...,p+q+1,c)`` of the product of polynomials ``a (...,p+1,c)`` and ``b (...,q+1,c)``.

    ``times`` multiplies coefficients; any bilinear product over the last axis will do.
    """
    p, q = a.shape[-2] - 1, b.shape[-2] - 1
    rows: list[Any] = [0.0] * (p + q + 1)
    for i in range(p + 1):
        for j in range(q + 1):
            rows[i + j] = rows[i + j] + comb(p, i) * comb(q, j) / comb(p + q, i + j) * times(a[..., i, :], b[..., j, :])
    return np.stack(rows, axis=-2)


def elevated(points: Floats, degree: int) -> Floats:
    """The Bezier points ``(...,q+1,c)`` of the same polynomials at a higher ``degree``."""
    raise_by = degree + 1 - points.shape[-2]
    return bernstein_product(points, np.ones((raise_by + 1, 1))) if raise_by else points


def bernstein_basis(degree: int, t: Floats) -> Floats:
    """The Bernstein polynomials ``(degree+1, ...)`` at ``t (...)``."""
    return np.stack([comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1)])


def bernstein_slopes(degree: int, t: Floats) -> Floats:
    """Derivatives of the Bernstein polynomials ``(degree+1, ...)`` at ``t (...)``."""
    lower = bernstein_basis(degree - 1, t)
    none = np.zeros_like(lower[:1])
    return degree * (np.concatenate([none, lower]) - np.concatenate([lower, none]))
