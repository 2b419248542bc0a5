"""What the schemes over triangles share: pieces, barycentric tables, and normals of their own.

A triangle has corners 0, 1, 2; side k runs from corner k to the next, and its opposite corner is the one after that.
Tables are made as jets: value, derivative by xi, derivative by eta (``schemes.domain``).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.convex import Split
from curvify.edges import OPPOSITE, projected_tangents
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import dot, unit
from curvify.polygons import newell_normals
from curvify.prepare import Coarse
from curvify.records import record
from curvify.sampling import domain_corners, triangle_sampling
from curvify.schemes.base import Basis, Form, LinearControls, PatchClass, Patches, linear_basis
from curvify.schemes.construction import DeviceForm, Inputs, assemble_inputs, projected_rule, side_frame
from curvify.schemes.domain import jet_product
from curvify.schemes.frames import Frame, edge_frame
from curvify.schemes.patchwork import Patchwork
from curvify.sectors import Features
from curvify.triangulation import triangulate_polygons
from curvify.words import count_of

#: How much closer than opposite normals may come before single precision cannot tell.
NEARLY = 0.02


@record
class TrianglePieces:
    """A mesh cut into triangles: ``features`` of the mesh, ``split`` into pieces, their ``frame`` of edges, and the
    unit normal ``facing (T,3)`` of each triangle, zero where it has no area.
    """

    coarse: Coarse
    features: Features
    split: Split
    frame: Frame
    facing: Floats
    fanned: Ints

    @property
    def sides_facing(self) -> Floats:
        """Sum ``(N,3)`` of the unit normals of the triangles of each side of an edge: one, or two that share it."""
        topology = self.frame.topology
        half_edges = self.frame.half_edges
        total = self.facing[topology.faces[half_edges]]
        twins = topology.twin[half_edges]
        both = np.flatnonzero(twins >= 0)
        both = both[self.frame.side_field[twins[both]] == both]
        total[both] += self.facing[topology.faces[twins[both]]]
        return total

    def with_curves(self, curves: Floats, fields: Floats) -> Patchwork:
        """The pieces with ``curves (E,d+1,3)`` on their edges and ``fields (N,q+1,3)`` on their sides."""
        work = Patchwork.on(self.coarse, self.features, self.split, self.frame, curves, fields)
        sizes = np.diff(self.split.source_offsets)
        counts, notes = self.coarse.note_features(self.features)
        work.counts.update(counts, triangulated_faces=int((sizes > 3).sum()))
        work.warnings += notes
        source = self.coarse.loops.source_faces
        if len(self.fanned):
            first = source[self.fanned.min()]
            work.warnings.append(
                f"{count_of(len(self.fanned), 'face')} without a proper triangulation cut into a fan, first: {first}"
            )
        return work


def triangle_features(coarse: Coarse) -> Features:
    """Normals and end tangents, the latter in the chord's projection where nothing is sharp."""
    return coarse.features(directions=projected_tangents)


def triangle_pieces(
    coarse: Coarse, features: Features | None = None, apart: Bools | None = None
) -> TrianglePieces:
    """Cut a mesh into triangles; normals come from the polygons, before. ``apart (E,)`` as in ``edge_frame``."""
    loops = coarse.loops
    split, fanned = triangulate_polygons(coarse.positions, loops.offsets, loops.vertices)
    features = features or triangle_features(coarse)
    frame = edge_frame(coarse, features, split, projected_tangents, apart)
    facing = unit(newell_normals(coarse.positions, split.face_offsets, split.face_vertices))
    return TrianglePieces(coarse, features, split, frame, facing, fanned)


def projected_legs(frame: Frame) -> tuple[Floats, Floats]:
    """Chords ``(E,3)`` projected onto the tangents at the start and at the end of each edge."""
    chord = frame.end - frame.start
    start, end = frame.tangents[:, 0], frame.tangents[:, 1]
    return dot(chord, start) * start, dot(chord, end) * end


def quadratic_inputs(work: Patchwork, tangents: Floats) -> Inputs:
    """What a device builds triangles from whose edges have end ``tangents (E,2,3)`` and quadratic normal fields.

    Where end normals are nearly opposite it is told the field's middle.
    """
    frame = side_frame(work)
    pairs = frame.pairs
    opposite = dot(pairs[:, 0], pairs[:, 1])[:, 0] < OPPOSITE + NEARLY
    middle = np.where(opposite, work.fields[..., 1], 0.0)
    return assemble_inputs(work, frame, tangents, projected_rule, middle.T[:, None])


def triangle_patches(work: Patchwork, surface: Form) -> Patches:
    """The patches of a work of triangles whose normals are the fields of its sides, which are quadratic."""
    every = np.arange(len(work.topology.sizes))
    normals = quadratic_normals(work, work.fields[..., 1], every)
    return work.patches([PatchClass(3, every, surface, normals)], triangle_sampling)


def all_corners(work: Patchwork) -> Ints:
    """Corners ``(T,3)`` of all triangles."""
    return work.topology.offsets[:-1, None] + np.arange(3)


def block_form(
    key: str,
    columns: Callable[[Floats], Floats],
    vectors: Callable[[Ints], Floats],
    points: int = 0,
    device: DeviceForm | None = None,
) -> Form:
    """A form with the ``columns`` ``(3,L,S)`` of barycentric jets ``(3,3,S)`` and the control ``vectors (3,f,L)``, the
    first ``points`` of which are points.
    """

    def basis(places: Floats) -> Basis:
        return linear_basis(columns(barycentric(places)))

    return Form((key,), basis, lambda rows: LinearControls(vectors(rows)), points, device)


def barycentric(points: Floats) -> Floats:
    """Jets ``(3,3,S)`` of the barycentric coordinates at points ``(S,2)`` of the triangle's domain."""
    corners = domain_corners(3)
    jets = np.empty((3, 3, len(points)))
    jets[0] = 1 / 3 + 2 * corners @ points.T
    jets[1:] = 2 * corners.T[..., None]
    return jets


def jet_power(jet: Floats, power: int) -> Floats:
    """A jet multiplied by itself."""
    result = jet
    for _ in range(power - 1):
        result = jet_product(result, jet)
    return result


def quadratic_columns(coordinates: Floats) -> Floats:
    """Bernstein polynomials of degree 2: the corners', then those of the sides."""
    ahead = np.roll(coordinates, -1, axis=1)
    return np.concatenate([jet_power(coordinates, 2), 2 * jet_product(coordinates, ahead)], axis=1)


def quadratic_normals(work: Patchwork, middle: Floats, patches: Ints) -> Form:
    """Normals of some triangles: quadratics through the corner normals, with control normal ``middle (3,N)`` on each
    side.
    """
    corners = all_corners(work)[patches]

    def vectors(rows: Ints) -> Floats:
        own = corners[rows]
        return np.concatenate([work.corner_normals(own), middle[:, work.side_field[own]]], axis=2)

    construction = work.construction
    device = None if construction is None else DeviceForm(construction, corners[:, 0], "normal_column", 6)
    return block_form("quadratic normals", quadratic_columns, vectors, device=device)


def quadratic_fields(pairs: Floats, middle: Floats, facing: Floats) -> Floats:
    """Quadratic normal fields ``(N,3,3)`` from end normals ``pairs (N,2,3)`` and the control normal ``middle``.

    Where end normals are opposite, so that the field would vanish on its way, the triangles' own normals, ``facing
    (N,3)``, take the middle.
    """
    lost = (dot(pairs[:, 0], pairs[:, 1]) < OPPOSITE) | (np.linalg.norm(middle, axis=1, keepdims=True) < 1e-6)
    return np.stack([pairs[:, 0], np.where(lost, unit(facing), middle), pairs[:, 1]], axis=1)
