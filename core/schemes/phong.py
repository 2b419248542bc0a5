"""The scheme ``phong``: Phong tessellation, a quadratic per triangle with linearly interpolated normals.

Source: Boubekeur, Alexa, "Phong Tessellation" (SIGGRAPH Asia 2008): every point of the flat triangle is projected onto
the three tangent planes of the corners, and the mean of the projections taken with its barycentric coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from curvify.errors import OptionError
from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.options import MeshOptions
from curvify.prepare import Coarse, prepare_mesh
from curvify.schemes.base import Patches
from curvify.schemes.construction import Construction, DeviceForm
from curvify.schemes.frames import Frame
from curvify.schemes.triangles import (
    all_corners,
    block_form,
    projected_legs,
    quadratic_columns,
    quadratic_fields,
    quadratic_inputs,
    triangle_patches,
    triangle_pieces,
)

name = "phong"
summary = "Phong tessellation: the cheapest curved triangles; interpolates vertices"
source = "Boubekeur, Alexa: Phong Tessellation"
faces = "triangles; other polygons are triangulated"
continuity = "C0"
keeps = "vertices, given normals, creases, rims"
normals = ("linear",)


@dataclass(frozen=True)
class Options(MeshOptions):
    """``alpha`` from 0 (flat) to 1 is the share of the projection."""

    alpha: float = 0.75

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.alpha <= 1:
            raise OptionError(f"alpha of phong must be from 0 to 1, not {self.alpha}")


def prepare(mesh: PolygonMesh | Coarse, options: Options | None = None) -> Patches:
    """Patches for every face of the mesh. Raises MeshError where there is nothing to refine."""
    options = options or Options()
    pieces = triangle_pieces(prepare_mesh(mesh, options))
    frame = pieces.frame
    fields = quadratic_fields(frame.pairs, frame.pairs.mean(axis=1), pieces.sides_facing)
    work = pieces.with_curves(quadratic_curves(frame, options.alpha), fields)
    work.warnings += pieces.coarse.unused_marks((), name)
    work.construction = Construction(
        name,
        partial(quadratic_inputs, work, frame.tangents),
        {"CURVE_POINTS": 3, "FIELD_POINTS": 3, "VECTORS": 3},
        {"alpha": options.alpha},
    )
    corners = all_corners(work)
    device = DeviceForm(work.construction, corners[:, 0], "column", 6)

    def vectors(rows: Ints) -> Floats:
        own = corners[rows]
        return np.concatenate([work.corner_points(own), work.side_curves(own)[..., 1]], axis=2)

    surface = block_form(name, quadratic_columns, vectors, 6, device)
    return triangle_patches(work, surface)


def quadratic_curves(frame: Frame, alpha: float) -> Floats:
    """Bezier points ``(E,3,3)`` of the edges."""
    out, back = projected_legs(frame)
    middle = (frame.start + frame.end) / 2 + alpha / 2 * (out - back)
    return np.stack([frame.start, middle, frame.end], axis=1)
