"""The scheme ``png1``: three cubic triangles blended into one patch whose tangent planes its neighbors share.

Source: Fuenfzig, Mueller, Hansford, Farin, "PNG1 Triangles for Tangent Plane Continuous Surfaces on the GPU"; what
differs from the print, and why, is in docs/triangles.md.

Along a side the derivative into the patch is s(t) C'(t) + h(t) W(t): the curve C and the quadratic W, quarter turns of
its control legs, belong to the edge, only s and h to the triangle. So both triangles have the tangent plane of C' and
W, and the edge's normal is C' x W.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from curvify.arrays import cross
from curvify.errors import OptionError
from curvify.mesh import Bools, Floats, Ints, PolygonMesh
from curvify.normals import dot, unit
from curvify.options import MeshOptions
from curvify.prepare import Coarse, prepare_mesh
from curvify.records import record
from curvify.sampling import triangle_sampling
from curvify.schemes.base import Form, PatchClass, Patches, bernstein_basis, bernstein_product, elevated
from curvify.schemes.frames import Frame
from curvify.schemes.patchwork import Patchwork
from curvify.schemes.png1_basis import png1_columns
from curvify.schemes.png1_device import NO_PLANE, device_construction, device_form, device_inputs
from curvify.schemes.triangles import (
    TrianglePieces,
    all_corners,
    block_form,
    quadratic_fields,
    quadratic_normals,
    triangle_features,
    triangle_pieces,
)
from curvify.sectors import Features
from curvify.words import count_of

NORMALS = ("exact", "smooth")
CREASE_UNITS = ("absolute", "edge")
#: A leg and a normal whose cross product is below this share of the leg are parallel.
PARALLEL = 1e-9

name = "png1"
summary = "blended cubic triangles: interpolates vertices and normals, smooth everywhere"
source = "Fuenfzig, Mueller, Hansford, Farin: PNG1 Triangles for Tangent Plane Continuous Surfaces on the GPU"
faces = "triangles; other polygons are triangulated"
continuity = "G1"
keeps = "vertices, given normals, creases, rims"
normals = NORMALS


@dataclass(frozen=True)
class Options(MeshOptions):
    """``normals``: ``exact``, or ``smooth`` ones that vary quadratically; ``kappa`` lifts the insides along every
    crease that has no lift of its own (negative: a sharper ridge), a length or, with ``crease_units`` ``edge``, a share
    of the edge's length.
    """

    normals: str = "exact"
    kappa: float = 0.0
    crease_units: str = "absolute"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.normals not in NORMALS:
            raise OptionError(f"normals of png1 must be one of {', '.join(NORMALS)}, not {self.normals!r}")
        if self.crease_units not in CREASE_UNITS:
            raise OptionError(f"crease_units must be one of {', '.join(CREASE_UNITS)}, not {self.crease_units!r}")
        if not np.isfinite(self.kappa):
            raise OptionError(f"kappa must be a finite number, not {self.kappa}")


def prepare(mesh: PolygonMesh | Coarse, options: Options | None = None) -> Patches:
    """Patches for every face of the mesh. Raises MeshError where there is nothing to refine."""
    options = options or Options()
    coarse = prepare_mesh(mesh, options)
    features = triangle_features(coarse)
    creases, kappas = crease_lifts(coarse, features, options)
    pieces = triangle_pieces(coarse, features, creases | coarse.topology.nonmanifold)
    frame = pieces.frame
    curves = chord_curves(frame)
    planes = middle_planes(pieces)
    turns = quarter_turns(frame, curves, planes)
    work = pieces.with_curves(curves, cross_fields(pieces, curves, turns))
    work.warnings += pieces.coarse.unused_marks(("kappa",), name)
    build = Construction(work, np.ascontiguousarray(np.moveaxis(turns, -1, 0)), pieces.facing, kappas)
    _bend_lifted_fields(build, frame)
    _note_folds(work, pieces)
    smooth = smooth_fields(work, frame) if options.normals == "smooth" else None
    turned = np.zeros(0, dtype=np.int64) if smooth is None else smooth.turned
    inputs = partial(device_inputs, work, pieces.facing, frame.tangents, planes, build.lifts, turned)
    work.construction = device_construction(work, inputs, smooth is not None)
    return work.patches(_classes(build, smooth), triangle_sampling)


def _classes(build: Construction, smooth: SmoothFields | None) -> list[PatchClass]:
    """Triangles with smooth normals, and those with exact ones."""
    work = build.work
    corners = all_corners(work)

    def surface(patches: Ints) -> Form:
        own = corners[patches]
        return block_form(name, png1_columns, lambda rows: build.control_points(own[rows]), 21, device_form(work, own))

    every = np.arange(len(corners))
    if smooth is None:
        return [PatchClass(3, every, surface(every))]
    plain, rest = every[~smooth.awkward], every[smooth.awkward]
    classes = [
        PatchClass(3, plain, surface(plain), quadratic_normals(work, smooth.middles, plain)),
        PatchClass(3, rest, surface(rest)),
    ]
    return [patch_class for patch_class in classes if len(patch_class.patches)]


def crease_lifts(coarse: Coarse, features: Features, options: Options) -> tuple[Bools, Floats]:
    """Which edges ``(E,)`` of the mesh are creases or have a lift, and their lifts kappa ``(E,)`` as lengths."""
    topology, marked = coarse.topology, ~np.isnan(coarse.marks.kappa)
    sharp = features.sharp.any(axis=1)
    kappas = np.where(marked, np.nan_to_num(coarse.marks.kappa), np.where(sharp, options.kappa, 0.0))
    if options.crease_units == "edge":
        chord = coarse.positions[topology.edges[:, 1]] - coarse.positions[topology.edges[:, 0]]
        kappas *= np.linalg.norm(chord, axis=1)
    return sharp | marked, kappas


def middle_planes(pieces: TrianglePieces) -> Floats:
    """Normals ``(N,3)``, not of unit length, about which the middle legs of the sides turn (equation 4): those of both
    triangles in equal parts where the edge is smooth, of a crease that of the side's own, and between, by sharpness.
    """
    frame, marks = pieces.frame, pieces.coarse.marks
    topology, total = frame.topology, pieces.sides_facing
    edges, twins = frame.side_edges, topology.twin[frame.half_edges]
    soft = np.flatnonzero((twins >= 0) & (edges < len(marks.kappa)))
    soft = soft[frame.side_field[twins[soft]] != soft]
    of_edge = edges[soft]
    sharpness = np.where(pieces.features.sharp[of_edge], marks.crease[of_edge], 0.0).mean(axis=1)
    sharpness[~np.isnan(marks.kappa[of_edge])] = 1.0
    total[soft] += (1 - sharpness[:, None]) * pieces.facing[topology.faces[twins[soft]]]
    return total


def chord_curves(frame: Frame) -> Floats:
    """Bezier points ``(E,4,3)`` of the edges: end legs a third of the chord long."""
    third = np.linalg.norm(frame.end - frame.start, axis=1, keepdims=True) / 3
    out, back = third * frame.tangents[:, 0], third * frame.tangents[:, 1]
    return np.stack([frame.start, frame.start + out, frame.end - back, frame.end], axis=1)


def quarter_turns(frame: Frame, curves: Floats, facing: Floats) -> Floats:
    """Bezier points ``(N,3,3)`` of W on each side: the curve's legs turned a quarter to the left of the canonical
    direction, the outer ones in the tangent planes, the middle one (equations 3 to 5) in the plane across ``facing
    (N,3)``, the sum of the normals of its triangles.
    """
    legs = np.diff(curves, axis=1)[frame.side_edges]
    along = unit(legs[:, 1])
    flat = np.linalg.norm(facing - dot(facing, along) * along, axis=1, keepdims=True) <= NO_PLANE
    middle = np.where(flat, frame.pairs.sum(axis=1), facing)
    outer = []
    for leg, normal in ((legs[:, 0], frame.pairs[:, 0]), (legs[:, 2], frame.pairs[:, 1])):
        parallel = np.linalg.norm(cross(normal, leg), axis=1, keepdims=True) <= PARALLEL * np.linalg.norm(
            leg, axis=1, keepdims=True
        )
        outer.append(_turned(leg, np.where(parallel, middle, normal)))
    return np.stack([outer[0], _turned(legs[:, 1], middle), outer[1]], axis=1)


def _turned(legs: Floats, normals: Floats) -> Floats:
    """Legs ``(N,3)`` turned a quarter about the normals, at their length; zero where they are parallel to them."""
    return np.linalg.norm(legs, axis=1, keepdims=True) * unit(cross(normals, legs))


def cross_fields(pieces: TrianglePieces, curves: Floats, turns: Floats) -> Floats:
    """Bezier points ``(N,5,3)`` of C' x W on each side.

    Where that vanishes, on edges without length and along normals, the end normals are interpolated.
    """
    frame = pieces.frame
    fields = bernstein_product(np.diff(curves, axis=1)[frame.side_edges], turns, cross)
    length = np.linalg.norm(np.einsum("tq,nqi->nti", bernstein_basis(4, np.arange(9) / 8).T, fields), axis=2)
    lost = length.min(axis=1) <= PARALLEL * length.max(axis=1)
    pairs = frame.pairs[lost]
    plain = quadratic_fields(pairs, pairs.mean(axis=1), pieces.sides_facing[lost])
    fields[lost] = elevated(plain, 4)
    return fields


class Sides(NamedTuple):
    """The sides of some triangles, each in its own direction: corner ``points (3,f,3)``, ``curves (3,f,3,4)``, ``legs``
    and ``turns (3,f,3,3)``, and the parts along (s) and across (h) the legs of the derivatives into the triangle at the
    start, ``red (2,f,3)``, and at the end, ``blue``.
    """

    points: Floats
    curves: Floats
    legs: Floats
    turns: Floats
    red: Floats
    blue: Floats


@record
class Construction:
    """What control points are made of: the pieces with their curves, ``turns (3,N,3)`` of their sides, ``facing (T,3)``
    of the triangles and ``kappas (E,)`` of the mesh's edges.
    """

    work: Patchwork
    turns: Floats
    facing: Floats
    kappas: Floats

    def lifts(self, half_edges: Ints) -> Floats:
        """Lifts ``(...)`` of half-edges; none on diagonals."""
        edges = self.work.topology.edge[half_edges]
        outer = edges < len(self.kappas)
        return np.where(outer, self.kappas[np.where(outer, edges, 0)], 0.0)

    def sides(self, corners: Ints) -> Sides:
        """The sides of the triangles with corners ``(f,3)``."""
        work = self.work
        points, curves = work.corner_points(corners), work.side_curves(corners)
        forward = work.topology.forward[corners][..., None]
        turns = work.in_direction(self.turns, work.side_field[corners], corners) * np.where(forward, 1.0, -1.0)
        legs = np.diff(curves, axis=3)
        start = np.roll(curves[..., 2], 1, axis=2) - points
        end = np.roll(curves[..., 1], -1, axis=2) - curves[..., 2]
        return Sides(points, curves, legs, turns, _parts(start, legs, turns, 0), _parts(end, legs, turns, 2))

    def control_points(self, corners: Ints) -> Floats:
        """Control points ``(3,f,21)`` of the triangles with corners ``(f,3)``, in the order of ``png1_columns``."""
        sides = self.sides(corners)
        curves, legs, turns = sides.curves, sides.legs, sides.turns
        lift = self.lifts(corners) * self.facing[self.work.topology.faces[corners[:, 0]]].T[..., None]

        def carried(base: int, parts: Floats) -> Floats:
            """The triangle's derivative of another leg, carried to a leg, with the edge's lift."""
            return curves[..., base] + parts[0] * legs[..., base] + parts[1] * turns[..., base] + lift

        return np.concatenate(
            [
                sides.points,
                curves[..., 1],
                curves[..., 2],
                carried(0, sides.blue),
                carried(2, sides.red),
                carried(1, sides.red),
                carried(1, sides.blue),
            ],
            axis=2,
        )


def _parts(vectors: Floats, legs: Floats, turns: Floats, leg: int) -> Floats:
    """Parts ``(2,f,n)`` of vectors ``(3,f,n)`` along a leg and its quarter turn, over the leg's squared length."""
    square = np.einsum("cfn,cfn->fn", legs[..., leg], legs[..., leg])
    square[square == 0] = 1.0
    both = (legs[..., leg], turns[..., leg])
    return np.stack([np.einsum("cfn,cfn->fn", vectors, base) / square for base in both])


def _bend_lifted_fields(build: Construction, frame: Frame) -> None:
    """Normals of the sides with a lift: there the derivative into the triangle leaves the plane of C' and W.

    Times (x^2 + y^2) / 3 it is (x^2 h_a + y^2 h_b) W + 2 kappa N_T x y (1 - x y), up to a part along C'.
    """
    lifts = build.lifts(frame.half_edges)
    rows = np.flatnonzero(lifts)
    if not len(rows):
        return
    work, half_edges = build.work, frame.half_edges[rows]
    topology = work.topology
    faces, every = topology.faces[half_edges], np.arange(len(rows))
    side = half_edges - topology.offsets[faces]
    sides = build.sides(topology.offsets[faces][:, None] + np.arange(3))
    legs, turns = (np.moveaxis(part[:, every, side], 0, -1) for part in (sides.legs, sides.turns))
    inward = np.stack([sides.red[1, every, side], np.zeros(len(rows)), sides.blue[1, every, side]], axis=1)
    slope = bernstein_product(inward[..., None], turns)
    slope += np.array([0, 1 / 2, 1 / 3, 1 / 2, 0])[:, None] * (lifts[rows, None] * build.facing[faces])[:, None]
    own = bernstein_product(legs, slope, cross)
    backward = ~topology.forward[half_edges]
    own[backward] = own[backward, ::-1]
    fields = elevated(np.moveaxis(work.fields, 0, -1), 6)
    fields[rows] = own
    work.fields = np.ascontiguousarray(np.moveaxis(fields, -1, 0))


@record
class SmoothFields:
    """The smooth normals of section 3.3: control normals ``middles (3,N)`` of the sides, those sides ``turned (t,)``
    that keep their exact normals, and the triangles ``awkward (T,)`` where smooth ones could vanish.
    """

    middles: Floats
    turned: Ints
    awkward: Bools


def smooth_fields(work: Patchwork, frame: Frame) -> SmoothFields:
    """Put smooth normals on the sides of a work.

    The quadratic normals on a side meet the exact one in its middle. They cannot vanish while the end normals are less
    than 90 degrees off that; other sides keep their exact normals.
    """
    exact = np.moveaxis(work.fields, 0, -1)
    degree = exact.shape[1] - 1
    middle = unit(np.einsum("q,nqi->ni", bernstein_basis(degree, np.array([0.5]))[:, 0], exact))
    smooth = np.stack([frame.pairs[:, 0], 2 * middle - frame.pairs.mean(axis=1), frame.pairs[:, 1]], axis=1)
    turned = np.flatnonzero(dot(frame.pairs, middle[:, None])[..., 0].min(axis=1) <= 0)
    middles = np.ascontiguousarray(smooth[:, 1].T)
    corners = all_corners(work)
    controls = np.concatenate([work.corner_normals(corners), middles[:, work.side_field[corners]]], axis=2)
    awkward = np.einsum("cfk,cf->fk", controls, controls.sum(axis=2)).min(axis=1) <= 0
    awkward |= np.isin(work.side_field[corners], turned).any(axis=1)
    if len(turned):
        smooth = elevated(smooth, degree)
        smooth[turned] = exact[turned]
    work.fields = np.ascontiguousarray(np.moveaxis(smooth, -1, 0))
    return SmoothFields(middles, turned, awkward)


def _note_folds(work: Patchwork, pieces: TrianglePieces) -> None:
    """Count the corners whose normal points away from their triangle: the surface folds there."""
    facing = pieces.facing[work.topology.faces]
    folded = np.flatnonzero((np.einsum("ci,ci->c", work.normals, facing) <= 0) & facing.any(axis=1))
    work.counts["folded_corners"] = len(folded)
    if len(folded):
        first = pieces.coarse.loops.source_faces[pieces.split.source_faces[work.topology.faces[folded[0]]]]
        work.warnings.append(
            f"the surface folds at {count_of(len(folded), 'corner')}, first in face {first}: "
            "the normals there turn too far for the triangle"
        )
