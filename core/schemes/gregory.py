"""The scheme ``gregory``: n-sided Gregory patches that interpolate positions and normals and meet with G1.

Source: Leung, Wang, Zhang, "Localized Construction of Curved Surfaces from Polygon Meshes: A Simple and
Practical Approach on GPU", sections 2 and 4; J. Gregory's n-sided patches. What differs from the print, and why,
is in docs/mathematics.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from curvify.arrays import ahead, behind, cross, unit_rows
from curvify.errors import OptionError
from curvify.mesh import Bools, Floats, Ints, PolygonMesh
from curvify.options import MeshOptions
from curvify.prepare import Coarse, prepare_mesh
from curvify.records import record
from curvify.sampling import kite_sampling
from curvify.schemes.base import Basis, Form, PatchClass, Patches, bernstein
from curvify.schemes.cross_tangents import PaperTangent, ProjectedBlend, Sides, dot, start_share
from curvify.schemes.folds import blended_inward, build_patchwork, paper_inward
from curvify.schemes.gregory_basis import center_row, edge_normal_basis, gregory_basis, side_speed
from curvify.schemes.gregory_device import device_construction, device_form, normal_form
from curvify.schemes.patchwork import Patchwork

CROSS_TANGENTS = ("precise", "smooth", "linear", "quadratic")
NORMALS = ("exact", "paper")
#: A side that is more than this share of a polygon's outline makes it uneven.
LARGE_SHARE = 0.3

name = "gregory"
summary = "n-sided Gregory patches: interpolates vertices and normals, smooth everywhere"
source = "Leung, Wang, Zhang: Localized Construction of Curved Surfaces from Polygon Meshes"
faces = "any polygons; concave ones and those over 64 sides are split"
keeps = "vertices, given normals, creases, rims"
continuity = "G1"
normals = NORMALS


@dataclass(frozen=True)
class Options(MeshOptions):
    """``cross_tangent``: how fast patches leave their sides; ``alpha`` > 0 the fullness of ``quadratic``, ``bulge``
    of ``precise`` and ``smooth``; ``normals``: ``exact`` or the ``paper``'s approximation; ``split_rule`` for concave
    faces. The others are those of all schemes.
    """

    cross_tangent: str = "precise"
    alpha: float = 1.0
    bulge: float = 0.0
    normals: str = "exact"
    split_rule: str = "best"

    def __post_init__(self) -> None:
        super().__post_init__()
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
        if not np.isfinite(self.bulge):
            raise OptionError(f"bulge must be a finite number, not {self.bulge}")
        if self.bulge and self.cross_tangent not in ("precise", "smooth"):
            raise OptionError("bulge shapes the cross tangents 'precise' and 'smooth'; 'quadratic' has alpha for it")

    @property
    def tangent_lengths(self) -> str:
        """The length rule of the edge curves: the paper's chord, or the circle's."""
        return "chord" if self.cross_tangent in ("linear", "quadratic") else "circle"


def prepare(mesh: PolygonMesh | Coarse, options: Options | None = None) -> Patches:
    """Patches for every face of the mesh. Raises MeshError where there is nothing to refine."""
    options = options or Options()
    coarse = prepare_mesh(mesh, options)
    work = patchwork_of(coarse, options)
    work.construction = device_construction(work, options.cross_tangent, options.tangent_lengths)
    shape = face_shapes(work, options)
    used = {"precise": ("bulge",), "smooth": ("bulge",), "quadratic": ("alpha",)}.get(options.cross_tangent, ())
    work.warnings += coarse.unused_marks(used, f"gregory with {options.cross_tangent} cross tangents")
    classes = []
    for sides, patches in work.size_classes():
        corners = work.topology.offsets[patches][:, None] + np.arange(sides)
        uneven = is_uneven(work.corner_points(corners))
        for group in (False, True):
            rows = np.flatnonzero(uneven == group)
            if len(rows):
                classes.append(_patch_class(work, shape, patches[rows], corners[rows], group, options))
    return work.patches(classes, kite_sampling)


def patchwork_of(coarse: Coarse, options: Options) -> Patchwork:
    """The curves over a mesh, with its faces cut where patches would fold."""

    def tangents_of(work: Patchwork, corners: Ints) -> PaperTangent:
        points, sides = patch_sides(work, corners)
        patches = np.searchsorted(work.topology.offsets, corners[:, 0])
        alpha = face_shapes(work, options).alpha[patches]
        return paper_tangent(sides, points, side_normals(work, corners), options.cross_tangent, alpha)

    inward = (
        partial(blended_inward, partial(start_share, options.cross_tangent))
        if blended(options)
        else partial(paper_inward, tangents_of)
    )
    return build_patchwork(coarse, options.tangent_lengths, options.split_rule, inward)


def blended(options: Options) -> bool:
    """Whether cross tangents are blends of those at the ends."""
    return options.cross_tangent in ("precise", "smooth")


def is_uneven(points: Floats) -> Bools:
    """Polygons ``(3,f,n)`` one side of which is more than ``LARGE_SHARE`` of the outline; of 7 sides at least."""
    if points.shape[2] < 7:
        return np.zeros(points.shape[1], dtype=bool)
    sides = np.roll(points, -1, axis=2) - points
    lengths = np.sqrt(dot(sides, sides))
    return lengths.max(axis=1) > LARGE_SHARE * lengths.sum(axis=1)


@record
class FaceShapes:
    """How far each patch swells: ``bulge (P,)`` and ``alpha (P,)``."""

    bulge: Floats
    alpha: Floats


def face_shapes(work: Patchwork, options: Options) -> FaceShapes:
    """The options, but for faces with a mark of their own. Raises OptionError for a bulge that would fold."""
    marks, source = work.coarse.marks, work.split.source_faces
    bulge = np.where(np.isnan(marks.bulge), options.bulge, marks.bulge)
    alpha = np.where(np.isnan(marks.alpha), options.alpha, marks.alpha)
    if options.cross_tangent == "smooth" and bulge.min(initial=0.0) <= -1:
        raise OptionError(f"a bulge of {bulge.min():g} folds the patches of 'smooth'; it must be above -1")
    return FaceShapes(bulge[source], alpha[source])


def _patch_class(
    work: Patchwork, shape: FaceShapes, patches: Ints, corners: Ints, uneven: bool, options: Options
) -> PatchClass:
    corrected = options.cross_tangent == "precise"
    sides = corners.shape[1]
    bulge, alpha = shape.bulge[patches], shape.alpha[patches]
    device = device_form(work, corners, uneven, options.cross_tangent, bulge if blended(options) else alpha)
    surface = Form(
        ("gregory", sides, corrected, uneven),
        partial(_surface_basis, sides, corrected, uneven),
        lambda rows: GregoryControls.build(
            work, corners[rows], uneven, options.cross_tangent, bulge[rows], alpha[rows]
        ),
        points=sides,
        device=device,
    )
    if options.normals == "exact":
        return PatchClass(sides, patches, surface)
    normals = Form(
        ("edge normals", sides),
        partial(edge_normal_basis, sides),
        lambda rows: NormalControls(work, corners[rows]),
        device=normal_form(device, sides, options.cross_tangent),
    )
    return PatchClass(sides, patches, surface, normals)


def _surface_basis(sides: int, corrected: bool, uneven: bool, points: Floats) -> Basis:
    return gregory_basis(sides, points, corrected, uneven)


CrossTangent = ProjectedBlend | PaperTangent


@record
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
    def build(
        cls, work: Patchwork, corners: Ints, uneven: bool, kind: str, bulge: Floats, alpha: Floats
    ) -> GregoryControls:
        """Controls of the patches with the given corners ``(f,n)``, ``bulge`` and ``alpha (f,)``."""
        return cls.of(*cross_tangents(work, corners, kind, bulge, alpha), uneven)

    @classmethod
    def of(cls, points: Floats, tangent: CrossTangent, target: Floats | None, uneven: bool) -> GregoryControls:
        """Controls from corner ``points (3,f,n)``, cross tangents and, for ``precise``, center points ``(3,f)``."""
        n = points.shape[2]
        t = np.array([0.0, 1.0])
        value, slope = tangent.field_derivatives(t)
        middle = tangent.fields(np.array([0.5]))[..., 0]
        curves = tangent.sides.curves
        corrected = target is not None
        if corrected:
            slope = slope + value * side_speed(n, t)[1]  # T' = s F' + s' F, and s = 1 at the ends
        legs = curves[..., 1] - points, curves[..., 2] - np.roll(points, -1, axis=2)
        blocks = [points, *legs, slope[..., 0], slope[..., 1]]
        if corrected and n != 4:
            blocks.append(middle)
        rows = np.zeros((n * len(blocks) + corrected, 3, points.shape[1]))
        for i, block in enumerate(blocks):
            rows[n * i : n * (i + 1)] = block.transpose(2, 0, 1)
        if target is not None:
            basis = center_row(n, uneven)
            center = np.tensordot(basis.linear[0, 0], rows, 1) + middle @ basis.weights[0, 0]
            center += value[..., 0] @ basis.ends[0, 0, :, 0] + value[..., 1] @ basis.ends[0, 0, :, 1]
            rows[-1] = target - center
        return cls(rows.transpose(1, 2, 0), tangent)


def cross_tangents(
    work: Patchwork, corners: Ints, kind: str, bulge: Floats, alpha: Floats
) -> tuple[Floats, CrossTangent, Floats | None]:
    """Corner points ``(3,f,n)``, cross tangents and, for ``precise``, the center point ``(3,f)`` of patches."""
    points, sides = patch_sides(work, corners)
    if kind == "smooth":
        return points, smooth_tangent(sides, bulge), None
    if kind == "precise":
        target = center_point(points, work.corner_normals(corners), bulge)
        return points, precise_tangent(sides, target), target
    return points, paper_tangent(sides, points, side_normals(work, corners), kind, alpha), None


def side_normals(work: Patchwork, corners: Ints) -> Floats:
    """Normals ``(3,f,n)`` of the sides of patches with corners ``(f,n)``: marked ones, or the mean of their ends'."""
    normals = work.corner_normals(corners)
    means = (normals + np.roll(normals, -1, axis=2)) / 2
    marked = work.coarse.marks.edge_normals
    if marked.any():
        edge = work.topology.edge[corners]
        own = np.where((edge < len(marked))[..., None], marked[np.minimum(edge, len(marked) - 1)], 0.0)
        own = np.moveaxis(own, -1, 0)
        means = np.where(own.any(axis=0), own, means)
    return means


def patch_sides(work: Patchwork, corners: Ints) -> tuple[Floats, Sides]:
    """Corner points ``(3,f,n)`` and side data of patches."""
    points = work.corner_points(corners)
    return points, sides_of(points, work.side_curves(corners), work.side_fields(corners))


def sides_of(points: Floats, curves: Floats, fields: Floats) -> Sides:
    """Side data of patches with corners ``(3,f,n)`` from ``curves`` and ``fields (3,f,n,4)``."""
    start = 3 * (behind(curves[..., 2]) - points)
    end = 3 * ahead(curves[..., 1] - points)
    return Sides(curves, fields, start, end)


def precise_tangent(sides: Sides, target: Floats) -> ProjectedBlend:
    """``precise``: fullness K per side from the distance of the center point ``target (3,f)``."""
    n = sides.start.shape[2]
    plain = ProjectedBlend(sides, "precise", np.zeros(sides.start.shape[1:]))
    share = {3: 0.0, 4: 0.15}.get(n, 0.3)
    if share == 0.0:
        return plain
    middle = plain.blend(np.array([0.5]))[..., 0]
    p0, p1, p2, p3 = sides.curves.transpose(3, 0, 1, 2)
    reach = target[..., None] - (p0 + 3 * (p1 + p2) + p3) / 8
    far, speed = np.sqrt(dot(reach, reach)), np.sqrt(dot(middle, middle))
    both = far * speed
    cosine = np.maximum(_quotient(dot(reach, middle), both), 0.5)
    gain = share * (4 * np.sin(np.pi / n) ** 2 * _quotient(far, speed * cosine) - 1)
    return ProjectedBlend(sides, "precise", np.clip(gain, -0.5, 1.0))


def smooth_tangent(sides: Sides, bulge: Floats) -> ProjectedBlend:
    """``smooth``: fullness K from what the projection takes away in the middle of each side, and ``bulge (f,)``."""
    n = sides.start.shape[2]
    middle = ProjectedBlend(sides, "smooth", np.zeros(sides.start.shape[1:])).blend(np.array([0.5]))[..., 0]
    mean = (np.sqrt(dot(sides.start, sides.start)) + np.sqrt(dot(sides.end, sides.end))) / 2
    kept = _quotient(dot(middle, middle), mean**2)
    share = 0.5 if n <= 4 else 1.0
    return ProjectedBlend(sides, "smooth", share * np.clip((1 - kept) / 2, 0.0, 0.2) + bulge[:, None])


def paper_tangent(sides: Sides, points: Floats, across: Floats, kind: str, alpha: Floats) -> PaperTangent:
    """``linear`` and ``quadratic`` (equations (8) and (9)): n_int through the neighboring sides' normals.

    ``across (3,f,n)`` are the normals of the sides, ``alpha (f,)`` the fullness of ``quadratic``.
    """
    first, last = np.roll(across, 1, axis=2), np.roll(across, -1, axis=2)
    if kind == "linear":
        guides = np.stack([first, last], axis=-1)
    else:
        middle = alpha[:, None] * polygon_normal(points)[..., None]
        guides = np.stack([first, 2 * middle - (first + last) / 2, last], axis=-1)
    return PaperTangent.build(sides, points, guides)


def polygon_normal(points: Floats) -> Floats:
    """Unit mean ``(3,f)`` of the unit corner crosses of polygons ``(3,f,n)``: equation (12)."""
    ahead, behind = np.roll(points, -1, axis=2) - points, np.roll(points, 1, axis=2) - points
    return unit_rows(unit_rows(cross(ahead, behind, axis=0)).sum(axis=2))


def center_point(points: Floats, normals: Floats, bulge: Floats) -> Floats:
    """Where the middle of each patch goes, ``(3,f)``: exact on spheres with regular polygons and on cylinders.

    ``bulge (f,)`` moves it outwards, in units of the mean distance from the corners to their mean.
    """
    middle = points.mean(axis=2)
    offsets = middle[..., None] - points
    area = unit_rows(cross(offsets, ahead(offsets), axis=0).sum(axis=2))
    total = normals.sum(axis=2)
    weak = np.sqrt(dot(total, total)) < 0.2 * points.shape[2]
    mean = np.where(weak, area, unit_rows(total))
    axis = unit_rows(mean + np.maximum(dot(mean, area), 0.0) ** 4 * area)
    along = -dot(offsets, normals + axis[..., None]) / np.maximum(1 + dot(normals, axis[..., None]), 0.5)
    height = along.mean(axis=1)
    if bulge.any():
        height += bulge * np.sqrt(dot(offsets, offsets)).mean(axis=1)
    return middle + axis * height


@record
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
    """Quotient a / b of arrays of one shape, zero where b is zero."""
    return np.divide(a, b, out=np.zeros_like(b), where=b != 0)

