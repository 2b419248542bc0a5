"""Gregory patches taken apart: every face with its own corners, so that each can be moved alone.

A patch depends on the positions and normals of its own corners and, across creases, on the normals of the faces
beside it. Here the patches of one size are functions of arrays of these, so that derivatives for all of them come from
a few evaluations. The formulas are those of `refine`: what `edges`, `sectors` and `schemes.gregory` hold.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from curvify.arrays import cross, leading, unit_rows
from curvify.edges import edge_curves, normal_fields, smooth_tangents
from curvify.evaluate import PARALLEL, exact_values
from curvify.marks import ResolvedMarks
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import unit
from curvify.records import record, replaced
from curvify.sampling import edge_abscissae, kite_sampling
from curvify.schemes.base import Basis, bernstein_basis, bernstein_slopes
from curvify.schemes.cross_tangents import Sides, start_share
from curvify.schemes.folds import PLACES
from curvify.schemes.gregory import (
    CrossTangent,
    GregoryControls,
    center_point,
    precise_tangent,
    sides_of,
    smooth_tangent,
)
from curvify.schemes.gregory_basis import gregory_basis
from curvify.sectors import EdgeEnds, end_tangents, is_tilted, upright_normals

#: Bernstein polynomials of sides and their derivatives where `refine` looks for folds.
NORMAL_AT, SPEED_AT = bernstein_basis(3, PLACES), bernstein_slopes(3, PLACES)
#: The level at which patches are sampled: 6 n + 1 points each.
LEVEL = 2


@record
class Apart:
    """Patches of one size and kind: what does not change while corners move.

    ``faces (f,)``; ``corners (f,n)`` of the topology and ``across (f,n,2)`` the corners beyond each side, at its start
    and its end, the patch's own where nothing is sharp; ``sharp (f,n,2)`` where these have another normal; ``interior
    (f,n)``; ``lines (f,n,3)`` tangents of the lines through the corners; ``pointed``, ``stiff (f,n)`` and ``weight
    (f,n)`` as in `sectors`; ``bent (f,n,3)``, ``straight (f,n)`` marks; ``beside (f,n,3)`` area vectors; ``bulge
    (f,)``; ``kind`` of the cross tangents, ``uneven`` as in `gregory.is_uneven`.
    """

    faces: Ints
    corners: Ints
    across: Ints
    sharp: Bools
    interior: Bools
    lines: Floats
    pointed: Bools
    stiff: Bools
    weight: Floats
    bent: Floats
    straight: Bools
    beside: Floats
    bulge: Floats
    kind: str
    uneven: bool

    @property
    def sides(self) -> int:
        return self.corners.shape[1]

    def take(self, rows: Ints) -> Apart:
        """Some of the patches, each as often as it is named."""
        return replaced(self, **{name: getattr(self, name)[rows] for name in _PER_PATCH})

    def samples(self, points: Floats, normals: Floats, others: Floats) -> tuple[Floats, Floats]:
        """Samples ``(f,6n+1,3)`` of the patches, and the sines ``(f,n,3)`` with which they open.

        ``points`` and ``normals (f,n,3)`` of the corners, ``others (f,n,2,3)`` the normals beyond the sides. Samples
        are those of level 2: corners, the inner points of sides, inner points.
        """
        shape = self._shape(points, normals, others)
        return _join(shape, exact_values(self._controls(shape), self._basis, 1)[0]), shape.sines

    def with_normals(self, points: Floats, normals: Floats, others: Floats) -> tuple[Floats, Floats, Floats, Bools]:
        """The samples, the unit normals there ``(f,6n+1,3)``, zero where derivatives are parallel, the sines, and the
        corners ``(f,n)`` that cannot keep their normals.
        """
        shape = self._shape(points, normals, others)
        values, by_xi, by_eta = exact_values(self._controls(shape), self._basis)
        across = cross(by_xi, by_eta, axis=0)
        parallel = (across**2).sum(axis=0) <= PARALLEL * (by_xi**2).sum(axis=0) * (by_eta**2).sum(axis=0)
        inside = unit_rows(np.where(parallel, 0.0, across))
        along = unit_rows(_on_sides(shape.sides.fields))
        corner = leading(shape.normals)
        found = np.concatenate([corner, along.reshape(*along.shape[:2], -1), inside], axis=2)
        return _join(shape, values), np.moveaxis(found, 0, -1), shape.sines, shape.adjusted

    def openings(self, points: Floats, normals: Floats, others: Floats) -> tuple[Floats, Bools]:
        """The sines and the corners that cannot keep their normals, without samples."""
        shape = self._shape(points, normals, others)
        return shape.sines, shape.adjusted

    @property
    def _basis(self) -> Basis:
        return _basis(self.sides, self.kind == "precise", self.uneven)

    def _shape(self, points: Floats, normals: Floats, others: Floats) -> Shape:
        count, n = self.corners.shape
        here = np.arange(count * n).reshape(count, n)
        edges = np.stack([here, np.roll(here, -1, axis=1)], axis=2).reshape(-1, 2)
        own = normals.reshape(-1, 3)[edges]
        sharp = self.sharp.reshape(-1, 2)
        several = np.flatnonzero(sharp.any(axis=1))
        beyond = np.where(sharp[several, :, None], others.reshape(-1, 2, 3)[several], own[several])
        start, end = points.reshape(-1, 3)[edges.T]
        ends = EdgeEnds(
            edges, end - start, own.copy(), several, beyond, self.beside.reshape(-1, 3), self.interior.ravel()
        )
        marks = ResolvedMarks.none(count * n, 0, 0)
        marks.edge_normals, marks.straight = self.bent.reshape(-1, 3), self.straight.ravel()
        tangents, bending = end_tangents(
            ends,
            self.lines.reshape(-1, 3),
            sharp,
            self.stiff.ravel(),
            (self.pointed.ravel(), self.weight.ravel()),
            marks,
            smooth_tangents,
        )
        out, back = tangents[:, 0], -tangents[np.roll(here, 1, axis=1).ravel(), 1]
        upright, stiff = normals.reshape(-1, 3), self.stiff.ravel()
        tilted = is_tilted(upright, out, back)
        refit = np.flatnonzero(tilted | stiff)
        if len(refit):
            upright = upright.copy()
            upright[refit] = upright_normals(upright[refit], out[refit], back[refit])
        corner_sines = np.einsum("ci,ci->c", cross(out, back), upright).reshape(count, n)
        curves = edge_curves(start, end, tangents[:, 0], tangents[:, 1], "circle")
        fields = normal_fields(curves, upright[edges[:, 0]], upright[edges[:, 1]], bending)
        sides = sides_of(leading(points), _per_side(curves, n), _per_side(fields, n))
        return Shape(
            corner=leading(points),
            normals=upright.reshape(count, n, 3),
            sides=sides,
            sines=np.stack([corner_sines, side_sines(sides, self.kind), turn_sines(points)], axis=2),
            adjusted=tilted.reshape(count, n) & ~self.stiff,
        )

    def _controls(self, shape: Shape) -> GregoryControls:
        """The patches between their sides."""
        sides = shape.sides
        tangent: CrossTangent
        target: Floats | None
        if self.kind == "precise":
            target = center_point(shape.corner, leading(shape.normals), self.bulge)
            tangent = precise_tangent(sides, target)
        else:
            target, tangent = None, smooth_tangent(sides, self.bulge)
        return GregoryControls.of(shape.corner, tangent, target, self.uneven)


_PER_PATCH = tuple(name for name in Apart.__annotations__ if name not in ("kind", "uneven"))


@record
class Shape:
    """What patches are made of: ``corner (3,f,n)`` points, ``normals (f,n,3)``, ``sides``; ``sines (f,n,3)`` with which
    they open at the corners and along the sides, and polygons turn; corners ``adjusted (f,n)`` that lost their normals.
    """

    corner: Floats
    normals: Floats
    sides: Sides
    sines: Floats
    adjusted: Bools


def side_sines(sides: Sides, kind: str) -> Floats:
    """The least sine ``(f,n)`` between each side and the blend of the tangents across it, seen along its normals.

    Where it is not above 0, `refine` cuts the polygon: see `schemes.folds.blended_inward`.
    """
    normal, speed = sides.fields @ NORMAL_AT, sides.curves @ SPEED_AT
    inward = cross(normal, speed, axis=0)
    h = start_share(kind, PLACES)
    tangent = sides.start[..., None] * h + sides.end[..., None] * (1 - h)
    square = (inward**2).sum(axis=0) * (tangent**2).sum(axis=0)
    sines = (inward * tangent).sum(axis=0) / np.sqrt(np.maximum(square, 1e-300))
    return np.asarray(sines.min(axis=-1))


def turn_sines(points: Floats) -> Floats:
    """The sine ``(f,n)`` by which polygons ``(f,n,3)`` turn at each corner, seen along their area vectors."""
    leave, arrive = np.roll(points, -1, axis=1) - points, points - np.roll(points, 1, axis=1)
    normal = unit(cross(points, np.roll(points, -1, axis=1)).sum(axis=1))
    square = (leave**2).sum(axis=2) * (arrive**2).sum(axis=2)
    turn = np.einsum("fki,fi->fk", cross(arrive, leave), normal)
    return np.asarray(turn / np.sqrt(np.maximum(square, 1e-300)))


def _per_side(points: Floats, n: int) -> Floats:
    """Bezier points ``(f*n,4,3)`` as ``(3,f,n,4)``, in memory the faces last."""
    return leading(points.reshape(-1, n, 4, 3))


def _on_sides(points: Floats) -> Floats:
    """Values ``(3,f,n,3)`` of Bezier polynomials ``(3,f,n,4)`` at the inner points of sides."""
    return points @ bernstein_basis(3, edge_abscissae(2 * LEVEL))


def _join(shape: Shape, inside: Floats) -> Floats:
    """Corners, points of sides and inner points ``(3,f,m)`` as samples ``(f,6n+1,3)``."""
    along = _on_sides(shape.sides.curves)
    return np.moveaxis(np.concatenate([shape.corner, along.reshape(*along.shape[:2], -1), inside], axis=2), 0, -1)


@lru_cache(maxsize=64)
def _basis(sides: int, corrected: bool, uneven: bool) -> Basis:
    return gregory_basis(sides, kite_sampling(sides, LEVEL).points, corrected, uneven)


@lru_cache(maxsize=64)
def sample_triangles(sides: int) -> Ints:
    """Triangles ``(2 n LEVEL^2,3)`` between the samples of a patch."""
    cells = kite_sampling(sides, LEVEL).cells
    return np.concatenate([cells[:, :3], cells[:, [0, 2, 3]]])
