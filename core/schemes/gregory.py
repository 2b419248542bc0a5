"""The scheme ``gregory``: n-sided Gregory patches that interpolate positions and normals and meet with G1.

Source: Leung, Wang, Zhang, "Localized Construction of Curved Surfaces from Polygon Meshes: A Simple and
Practical Approach on GPU", sections 2 and 4; J. Gregory's n-sided patches. What differs from the print, and why,
is in docs/mathematics.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from curvify.arrays import cross, unit_rows
from curvify.errors import OptionError
from curvify.mesh import Bools, Floats, Ints, PolygonMesh
from curvify.prepare import prepare_mesh
from curvify.sampling import kite_sampling
from curvify.schemes.base import Basis, Form, PatchClass, Patches, bernstein
from curvify.schemes.cross_tangents import PaperTangent, ProjectedBlend, Sides, dot
from curvify.schemes.gregory_basis import center_row, edge_normal_basis, gregory_basis, side_speed
from curvify.schemes.patchwork import Patchwork, build_patchwork

CROSS_TANGENTS = ("precise", "smooth", "linear", "quadratic")
NORMALS = ("exact", "paper")
#: A side that is more than this share of a polygon's outline makes it uneven.
LARGE_SHARE = 0.3

name = "gregory"
summary = "n-sided Gregory patches: interpolates vertices and normals, smooth everywhere"
source = "Leung, Wang, Zhang: Localized Construction of Curved Surfaces from Polygon Meshes"
faces = "any polygons; concave ones and those over 64 sides are split"
continuity = "G1"
normals = NORMALS


@dataclass(frozen=True)
class Options:
    """``cross_tangent``: how fast patches leave their sides; ``alpha`` > 0 the fullness of ``quadratic``;
    ``normals``: ``exact`` or the ``paper``'s approximation; ``weld``, ``sharp_from`` as in ``prepare_mesh``;
    ``split_rule`` for concave faces.
    """

    cross_tangent: str = "precise"
    alpha: float = 1.0
    normals: str = "exact"
    weld: str = "auto"
    sharp_from: str = "auto"
    split_rule: str = "best"

    def __post_init__(self) -> None:
        if self.cross_tangent not in CROSS_TANGENTS:
            raise OptionError(f"cross_tangent must be one of {', '.join(CROSS_TANGENTS)}, not {self.cross_tangent!r}")
        if self.normals not in NORMALS:
            raise OptionError(f"normals of gregory must be one of {', '.join(NORMALS)}, not {self.normals!r}")
        if not (self.alpha > 0 and np.isfinite(self.alpha)):
            raise OptionError(
                f"alpha must be a positive number, not {self.alpha}: at 0 and below the patches fold at their sides"
            )
        if self.alpha != 1.0 and self.cross_tangent != "quadratic":
            raise OptionError("alpha shapes the cross tangent 'quadratic' only; give --cross-tangent quadratic with it")

    @property
    def tangent_lengths(self) -> str:
        """The length rule of the edge curves: the paper's chord, or the circle's."""
        return "chord" if self.cross_tangent in ("linear", "quadratic") else "circle"


def prepare(mesh: PolygonMesh, options: Options | None = None) -> Patches:
    """Patches for every face of the mesh. Raises MeshError where there is nothing to refine."""
    options = options or Options()
    coarse = prepare_mesh(mesh, options.weld, options.sharp_from)

    def inward(work: Patchwork, corners: Ints) -> CrossTangent:
        points, sides = patch_sides(work, corners)
        if options.cross_tangent in ("precise", "smooth"):  # their fullness does not change the side
            return ProjectedBlend(sides, options.cross_tangent, np.zeros(corners.shape))
        return paper_tangent(sides, points, work.corner_normals(corners), options)

    work = build_patchwork(coarse, options.tangent_lengths, options.split_rule, inward)
    classes = []
    for sides, patches in work.size_classes():
        corners = work.topology.offsets[patches][:, None] + np.arange(sides)
        uneven = is_uneven(work.corner_points(corners))
        for group in (False, True):
            rows = np.flatnonzero(uneven == group)
            if len(rows):
                classes.append(_patch_class(work, patches[rows], corners[rows], group, options))
    return work.patches(classes, kite_sampling)


def is_uneven(points: Floats) -> Bools:
    """Polygons ``(3,f,n)`` one side of which is more than ``LARGE_SHARE`` of the outline; of 7 sides at least."""
    if points.shape[2] < 7:
        return np.zeros(points.shape[1], dtype=bool)
    sides = np.roll(points, -1, axis=2) - points
    lengths = np.sqrt(dot(sides, sides))
    return lengths.max(axis=1) > LARGE_SHARE * lengths.sum(axis=1)


def _patch_class(work: Patchwork, patches: Ints, corners: Ints, uneven: bool, options: Options) -> PatchClass:
    corrected = options.cross_tangent == "precise"
    sides = corners.shape[1]
    surface = Form(
        ("gregory", sides, corrected, uneven),
        partial(_surface_basis, sides, corrected, uneven),
        lambda rows: GregoryControls.build(work, corners[rows], uneven, options),
    )
    if options.normals == "exact":
        return PatchClass(sides, patches, surface)
    blended = Form(
        ("edge normals", sides), partial(edge_normal_basis, sides), lambda rows: NormalControls(work, corners[rows])
    )
    return PatchClass(sides, patches, surface, blended)


def _surface_basis(sides: int, corrected: bool, uneven: bool, points: Floats) -> Basis:
    return gregory_basis(sides, points, corrected, uneven)


CrossTangent = ProjectedBlend | PaperTangent


@dataclass(eq=False)
class GregoryControls:
    """Control vectors ``linear (3,f,L)`` of some patches, and their cross tangents."""

    linear: Floats
    tangent: CrossTangent

    def take(self, rows: Ints) -> GregoryControls:
        """Those of some of the patches."""
        return GregoryControls(self.linear[:, rows], self.tangent.take(rows))

    def fields(self, t: Floats) -> Floats:
        """Cross tangents ``(3,f,n,m)``."""
        return self.tangent.fields(t)

    def field_derivatives(self, t: Floats) -> tuple[Floats, Floats]:
        """Cross tangents and their derivatives."""
        return self.tangent.field_derivatives(t)

    @classmethod
    def build(cls, work: Patchwork, corners: Ints, uneven: bool, options: Options) -> GregoryControls:
        """Controls of the patches with the given corners ``(f,n)``."""
        n = corners.shape[1]
        points, tangent, target = cross_tangents(work, corners, options)
        t = np.array([0.0, 0.5, 1.0])
        value, slope = tangent.field_derivatives(t)
        curves = tangent.sides.curves
        corrected = target is not None
        if corrected:
            slope = slope + value * side_speed(n, t)[1]  # T' = s F' + s' F, and s = 1 at the ends
        blocks = [points, curves[..., 1], curves[..., 2], slope[..., 0], slope[..., 2]]
        if corrected and n != 4:
            blocks.append(value[..., 1])
        linear = np.zeros((3, len(corners), n * len(blocks) + corrected))
        for i, block in enumerate(blocks):
            linear[..., n * i : n * (i + 1)] = block
        if target is not None:
            basis = center_row(n, uneven)
            center = linear @ basis.linear[0, 0] + value[..., 1] @ basis.weights[0, 0]
            center += value[..., 0] @ basis.ends[0, 0, :, 0] + value[..., 2] @ basis.ends[0, 0, :, 1]
            linear[..., -1] = target - center
        return cls(linear, tangent)


def cross_tangents(
    work: Patchwork, corners: Ints, options: Options
) -> tuple[Floats, CrossTangent, Floats | None]:
    """Corner points ``(3,f,n)``, cross tangents and, for ``precise``, the center point ``(3,f)`` of patches."""
    points, sides = patch_sides(work, corners)
    if options.cross_tangent == "smooth":
        return points, smooth_tangent(sides), None
    normals = work.corner_normals(corners)
    if options.cross_tangent == "precise":
        target = center_point(points, normals)
        return points, precise_tangent(sides, target), target
    return points, paper_tangent(sides, points, normals, options), None


def patch_sides(work: Patchwork, corners: Ints) -> tuple[Floats, Sides]:
    """Corner points ``(3,f,n)`` and side data of patches."""
    points = work.corner_points(corners)
    curves, fields = work.side_curves(corners), work.side_fields(corners)
    start = 3 * (np.roll(curves[..., 2], 1, axis=2) - points)
    end = 3 * np.roll(curves[..., 1] - points, -1, axis=2)
    return points, Sides(curves, fields, start, end)


def precise_tangent(sides: Sides, target: Floats) -> ProjectedBlend:
    """``precise``: fullness K per side from the distance of the center point ``target (3,f)``."""
    n = sides.start.shape[2]
    plain = ProjectedBlend(sides, "precise", np.zeros(sides.start.shape[1:]))
    share = {3: 0.0, 4: 0.15}.get(n, 0.3)
    if share == 0.0:
        return plain
    half = np.array([0.5])
    middle = plain.blend(half)[..., 0]
    reach = target[..., None] - bernstein(sides.curves, half)[..., 0]
    far, speed = np.sqrt(dot(reach, reach)), np.sqrt(dot(middle, middle))
    both = far * speed
    cosine = np.maximum(_quotient(dot(reach, middle), both), 0.5)
    gain = share * (4 * np.sin(np.pi / n) ** 2 * _quotient(far, speed * cosine) - 1)
    return ProjectedBlend(sides, "precise", np.clip(gain, -0.5, 1.0))


def smooth_tangent(sides: Sides) -> ProjectedBlend:
    """``smooth``: fullness K from what the projection takes away in the middle of each side."""
    n = sides.start.shape[2]
    middle = ProjectedBlend(sides, "smooth", np.zeros(sides.start.shape[1:])).blend(np.array([0.5]))[..., 0]
    mean = (np.sqrt(dot(sides.start, sides.start)) + np.sqrt(dot(sides.end, sides.end))) / 2
    kept = _quotient(dot(middle, middle), mean**2)
    share = 0.5 if n <= 4 else 1.0
    return ProjectedBlend(sides, "smooth", share * np.clip((1 - kept) / 2, 0.0, 0.2))


def paper_tangent(sides: Sides, points: Floats, normals: Floats, options: Options) -> PaperTangent:
    """``linear`` and ``quadratic`` (equations (8) and (9)): n_int through the neighboring edges' normals."""
    edge = (normals + np.roll(normals, -1, axis=2)) / 2
    first, last = np.roll(edge, 1, axis=2), np.roll(edge, -1, axis=2)
    if options.cross_tangent == "linear":
        guides = np.stack([first, last], axis=-1)
    else:
        middle = options.alpha * polygon_normal(points)[..., None]
        guides = np.stack([first, 2 * middle - (first + last) / 2, last], axis=-1)
    return PaperTangent.build(sides, points, guides)


def polygon_normal(points: Floats) -> Floats:
    """Unit mean ``(3,f)`` of the unit corner crosses of polygons ``(3,f,n)``: equation (12)."""
    ahead, behind = np.roll(points, -1, axis=2) - points, np.roll(points, 1, axis=2) - points
    return unit_rows(unit_rows(cross(ahead, behind, axis=0)).sum(axis=2))


def center_point(points: Floats, normals: Floats) -> Floats:
    """Where the middle of each patch goes, ``(3,f)``: exact on spheres with regular polygons and on cylinders."""
    middle = points.mean(axis=2)
    offsets = middle[..., None] - points
    ahead = np.roll(offsets, -1, axis=2)
    area = unit_rows(cross(offsets, ahead, axis=0).sum(axis=2))
    total = normals.sum(axis=2)
    weak = np.sqrt(dot(total, total)) < 0.2 * points.shape[2]
    mean = np.where(weak, area, unit_rows(total))
    axis = unit_rows(mean + np.maximum(dot(mean, area), 0.0) ** 4 * area)
    along = -dot(offsets, normals + axis[..., None]) / np.maximum(1 + dot(normals, axis[..., None]), 0.5)
    return middle + axis * along.mean(axis=1)


@dataclass(eq=False)
class NormalControls:
    """Controls of the paper's approximate normals: corner normals and unit edge normals."""

    work: Patchwork
    corners: Ints

    def take(self, rows: Ints) -> NormalControls:
        """Those of some of the patches."""
        return NormalControls(self.work, self.corners[rows])

    @property
    def linear(self) -> Floats:
        return self.work.corner_normals(self.corners)

    def fields(self, t: Floats) -> Floats:
        """Unit edge normals ``(3,f,n,m)``."""
        return unit_rows(bernstein(self.work.side_fields(self.corners), t))

    def field_derivatives(self, t: Floats) -> tuple[Floats, Floats]:
        """Not needed: these normals are values."""
        raise NotImplementedError


def _quotient(a: Floats, b: Floats) -> Floats:
    """Quotient a / b, zero where b is zero."""
    return np.divide(a, b, out=np.zeros(np.broadcast_shapes(a.shape, b.shape)), where=b != 0)

