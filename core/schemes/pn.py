"""The scheme ``pn``: curved PN triangles, a cubic per triangle with normals of its own.

Source: Vlachos, Peters, Boyd, Mitchell, "Curved PN Triangles" (I3D 2001). The surface is continuous, its tangent plane
is not: only the normals hide the kinks.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.normals import dot, unit
from curvify.options import MeshOptions
from curvify.prepare import Coarse, prepare_mesh
from curvify.schemes.base import Patches
from curvify.schemes.construction import Construction, DeviceForm
from curvify.schemes.domain import jet_product
from curvify.schemes.frames import Frame
from curvify.schemes.patchwork import Patchwork
from curvify.schemes.triangles import (
    all_corners,
    block_form,
    jet_power,
    projected_legs,
    quadratic_fields,
    quadratic_inputs,
    triangle_patches,
    triangle_pieces,
)

name = "pn"
summary = "curved PN triangles: interpolates vertices; normals of its own hide its kinks"
source = "Vlachos, Peters, Boyd, Mitchell: Curved PN Triangles"
faces = "triangles; other polygons are triangulated"
continuity = "C0"
keeps = "vertices, given normals, creases, rims"
normals = ("quadratic",)


@dataclass(frozen=True)
class Options(MeshOptions):
    """There are none but those of all schemes."""


def prepare(mesh: PolygonMesh | Coarse, options: Options | None = None) -> Patches:
    """Patches for every face of the mesh. Raises MeshError where there is nothing to refine."""
    options = options or Options()
    pieces = triangle_pieces(prepare_mesh(mesh, options))
    frame = pieces.frame
    fields = quadratic_fields(frame.pairs, reflected_normals(frame), pieces.sides_facing)
    work = pieces.with_curves(cubic_curves(frame), fields)
    work.warnings += pieces.coarse.unused_marks((), name)
    work.construction = Construction(
        name, partial(quadratic_inputs, work, frame.tangents), {"CURVE_POINTS": 4, "FIELD_POINTS": 3, "VECTORS": 3}
    )
    corners = all_corners(work)
    device = DeviceForm(work.construction, corners[:, 0], "column", 10)
    surface = block_form(name, cubic_columns, lambda rows: cubic_controls(work, corners[rows]), 10, device)
    return triangle_patches(work, surface)


def cubic_curves(frame: Frame) -> Floats:
    """Bezier points ``(E,4,3)`` of the edges: a third of the chord, projected onto each end tangent."""
    out, back = projected_legs(frame)
    return np.stack([frame.start, frame.start + out / 3, frame.end - back / 3, frame.end], axis=1)


def reflected_normals(frame: Frame) -> Floats:
    """Control normal ``(N,3)`` in the middle of each side: the mean of the end normals mirrored in the plane across
    the edge.
    """
    edge = frame.side_edges
    chord = (frame.end - frame.start)[edge]
    total = frame.pairs.sum(axis=1)
    square = dot(chord, chord)
    return unit(total - 2 * dot(chord, total) / np.where(square > 0, square, 1.0) * chord)


def cubic_columns(coordinates: Floats) -> Floats:
    """Bernstein polynomials of degree 3: corners, the first and the second point of each side, the center."""
    ahead = np.roll(coordinates, -1, axis=1)
    square = jet_power(coordinates, 2)
    center = jet_product(jet_product(coordinates[:, 0], coordinates[:, 1]), coordinates[:, 2])
    return np.concatenate(
        [
            jet_power(coordinates, 3),
            3 * jet_product(square, ahead),
            3 * jet_product(coordinates, np.roll(square, -1, axis=1)),
            6 * center[:, None],
        ],
        axis=1,
    )


def cubic_controls(work: Patchwork, corners: Ints) -> Floats:
    """Control points ``(3,f,10)`` of the triangles with the given corners ``(f,3)``."""
    points, curves = work.corner_points(corners), work.side_curves(corners)
    outline = np.concatenate([curves[..., 1], curves[..., 2]], axis=2)
    center = 1.5 * outline.mean(axis=2) - 0.5 * points.mean(axis=2)
    return np.concatenate([points, outline, center[..., None]], axis=2)
