"""How a device builds gregory patches: what goes up, and how its programs are called (gpu/shaders/gregory.glsl)."""

from __future__ import annotations

from functools import partial

import numpy as np

from curvify.edges import ALONG
from curvify.mesh import Floats, Ints
from curvify.normals import dot, unit
from curvify.records import replaced
from curvify.schemes.base import Basis
from curvify.schemes.construction import (
    Construction,
    DeviceForm,
    Inputs,
    Pass,
    SideFrame,
    assemble_inputs,
    linear_columns,
    side_frame,
    smooth_rule,
)
from curvify.schemes.gregory_basis import center_row, side_speed
from curvify.schemes.patchwork import Patchwork

#: Texels that a device makes for each side of a patch, and the first of them that hold its normal field.
SIDE_TEXELS = {"precise": 11, "smooth": 10, "linear": 16, "quadratic": 16}
FIELD_AT = {"precise": 0, "smooth": 0, "linear": 3, "quadratic": 3}


def device_construction(work: Patchwork, kind: str, lengths: str) -> Construction:
    """How a device builds edges whose tangents have the given ``lengths``, and cross tangents of a ``kind``."""
    marked = kind in ("linear", "quadratic") and bool(work.coarse.marks.edge_normals.any())
    constants = {"CURVE_POINTS": 4, "FIELD_POINTS": 4, "VECTORS": 3 + marked, "SIDE_TEXELS": SIDE_TEXELS[kind]}
    constants |= {kind.upper(): 1, lengths.upper(): 1}
    return Construction("gregory", partial(device_inputs, work, marked), constants)


def device_inputs(work: Patchwork, marked: bool) -> Inputs:
    """What a device builds a surface from: for sharp features, and edges where a fallback serves, the end tangents, the
    bending normal where it takes the place of the end normals, and with ``marked`` the edge normals.
    """
    frame = side_frame(work)
    curves = np.moveaxis(work.curves, 0, -1)
    tangents = unit(np.stack([curves[:, 1] - curves[:, 0], curves[:, 3] - curves[:, 2]], axis=1))
    others = np.zeros((len(frame.edges), 1 + marked, 3))
    rows, others_bending = _bent_fields(work, frame)
    others[rows, 0] = others_bending
    if marked:
        of_edges = work.coarse.marks.edge_normals
        outer = np.flatnonzero(frame.edges < len(of_edges))
        others[outer, 1] = of_edges[frame.edges[outer]]
    return assemble_inputs(work, frame, tangents, smooth_rule, others)


def _bent_fields(work: Patchwork, frame: SideFrame) -> tuple[Ints, Floats]:
    """Sides ``(b,)`` whose normal field starts and ends with one vector instead of the end normals, and that ``(b,3)``.

    The part across the edge of the vector that a field starts with is what the field lets see of it.
    """
    along, pairs = frame.along, frame.pairs
    lengthwise = np.einsum("nei,ni->ne", pairs, along)
    across = np.maximum(1 - lengthwise**2, 0.0)
    cosine = dot(pairs[:, 0], pairs[:, 1])[:, 0] - lengthwise.prod(axis=1)
    rows = np.flatnonzero((across.min(axis=1) < (2 * ALONG) ** 2) | (cosine < -0.9 * np.sqrt(across.prod(axis=1))))
    along, normal = along[rows], pairs[rows, 0]
    edges = frame.edges[rows]
    field = work.fields[:, rows, 0].T
    chord = (work.curves[:, edges, 3] - work.curves[:, edges, 0]).T
    ahead = 3 * dot((work.curves[:, edges, 1] - work.curves[:, edges, 0]).T, chord)
    vector = (field - dot(field, along) * along) / np.where(ahead > 0, ahead, 1.0)
    bent = np.linalg.norm(vector - (normal - dot(normal, along) * along), axis=1) > 1e-6
    return rows[bent], vector[bent]


def device_form(work: Patchwork, corners: Ints, uneven: bool, kind: str, shapes: Floats) -> DeviceForm:
    """How a device builds the patches with corners ``(f,n)``; ``shapes (f,)`` is the number that shapes each."""
    assert work.construction is not None
    n = corners.shape[1]
    numbers: dict[str, float | tuple[float, ...]] = {}
    columns = 5 * n
    if kind == "precise":
        columns += 1 + (n != 4) * n
        basis = center_row(n, uneven)
        blocks = np.zeros(6)
        blocks[: columns // n] = basis.linear[0, 0, :-1:n]  # all sides have the same weights at the center
        numbers["speed_slopes"] = tuple(side_speed(n, np.array([0.0, 1.0]))[1].tolist())
        numbers["center_row"] = (*blocks.tolist(), float(basis.weights[0, 0, 0]), *basis.ends[0, 0, 0].tolist())
    return DeviceForm(
        work.construction,
        corners[:, 0],
        "column",
        columns,
        _passes(kind),
        shapes,
        "read_sides",
        (0, 2 if kind in ("precise", "smooth") else 4),
        _folded_columns,
        numbers,
    )


def _passes(kind: str) -> tuple[Pass, ...]:
    """Where the center goes; the sides; what moves the center there."""
    target = Pass("targets", "target_record", 1, False)
    sides = Pass("made", "side_record", SIDE_TEXELS[kind], True)
    center = Pass("centers", "center_record", 1, False)
    return (target, sides, center) if kind == "precise" else (sides, center)


def _folded_columns(basis: Basis) -> Floats:
    """The columns ``(3,S,L)`` of a patch, those of the legs with what they give as ends of the cross tangents.

    T_k(0) is three times the last leg of the side before, backward, T_k(1) three times the first of the side after.
    """
    columns, n = basis.linear.copy(), basis.weights.shape[2]
    columns[..., 2 * n : 3 * n] += 3 * np.roll(basis.ends[..., 0], -1, axis=2)
    columns[..., n : 2 * n] += 3 * np.roll(basis.ends[..., 1], 1, axis=2)
    return columns


def normal_form(surface: DeviceForm, sides: int, kind: str) -> DeviceForm:
    """How it builds the paper's approximate normals over the patches of a ``surface``: corner and edge normals."""
    return replaced(
        surface,
        column="normal_column",
        columns=sides,
        fields="edge_normals",
        slots=(FIELD_AT[kind], 1),
        table=linear_columns,
    )
