"""How a device builds PNG1 triangles: what goes up, and how its programs are called (gpu/shaders/png1.glsl)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.arrays import take_rows
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import dot, unit
from curvify.polygons import newell_normals
from curvify.schemes.construction import (
    Construction,
    DeviceForm,
    Inputs,
    Pass,
    SideFrame,
    assemble_inputs,
    projected_rule,
    side_frame,
)
from curvify.schemes.patchwork import Patchwork

#: Texels that a device makes for each side of a patch.
SIDE_TEXELS = 7
#: A triangle is too thin for single precision to tell its normal when its area is less than this share of the square of
#: its longest side.
THIN = 1e-3
#: How much longer than ``NO_PLANE`` a normal across an edge must be for single precision.
NEARLY = 1e3


#: A mean of two face normals that is shorter than this across the edge gives no plane.
NO_PLANE = 1e-6


def device_construction(work: Patchwork, make_inputs: Callable[[], Inputs], smooth: bool) -> Construction:
    """How a device builds the edges, their normal fields, and the control points of a ``work``, which is complete."""
    points = work.fields.shape[2]
    constants = {"CURVE_POINTS": 4, "FIELD_POINTS": points, "VECTORS": 4, "SIDE_TEXELS": SIDE_TEXELS}
    if smooth:
        constants["SMOOTH_NORMALS"] = 1
    return Construction("png1", make_inputs, constants, field_texels=3 * -(-points // 4) + 1)


def device_form(work: Patchwork, corners: Ints) -> DeviceForm:
    """How a device builds the triangles with corners ``(f,3)`` of a work."""
    assert work.construction is not None
    return DeviceForm(work.construction, corners[:, 0], "column", 21, (Pass("made", "side_record", SIDE_TEXELS, True),))


def device_inputs(
    work: Patchwork, facing: Floats, tangents: Floats, planes: Floats, lifts_of: Callable[[Ints], Floats], turned: Ints
) -> Inputs:
    """What a device builds a surface from whose triangles have unit normals ``facing (T,3)``, and edges unit end
    ``tangents (E,2,3)``.

    ``planes (N,3)`` are the normals about which middle legs turn, which it is told where they are not the sum of the
    normals of its triangles, or that is not known to enough digits; ``lifts_of`` half-edges it gets as shares of the
    chords; ``turned (t,)`` are the sides that keep exact normals among smooth ones.
    """
    frame, topology = side_frame(work), work.topology
    twins = topology.twin[frame.half_edges]
    shared = (twins >= 0) & (work.side_field[twins] == np.arange(len(twins)))
    faces, thin = topology.faces, _thin_triangles(work)
    own, other = faces[frame.half_edges], faces[twins]
    total = facing[own] + np.where(shared[:, None], facing[other], 0.0)
    unsure = thin[own] | (shared & thin[other])
    size = _reach(work, frame, planes)
    told = unsure | (planes != total).any(axis=1) | (size <= NEARLY * NO_PLANE)
    others = np.zeros((len(frame.edges), 2, 3))
    others[told, 0] = np.where((size <= NO_PLANE)[:, None], frame.pairs.sum(axis=1), planes)[told]
    lifts = lifts_of(frame.half_edges)
    lifted = np.flatnonzero(lifts)
    others[lifted, 1, 0] = lifts[lifted] / frame.lengths[lifted]
    others[lifted, 1, 1] = unsure[lifted]
    inputs = assemble_inputs(work, frame, tangents, projected_rule, others)
    inputs.links = _links(work, frame, np.where(shared, twins, -1), turned)
    return inputs


def _thin_triangles(work: Patchwork) -> Bools:
    """Triangles ``(T,)`` that are thin."""
    topology = work.topology
    area = newell_normals(work.coarse.positions, topology.offsets, topology.vertices)
    points = take_rows(work.coarse.positions, topology.vertices.reshape(-1, 3))
    sides = np.roll(points, -1, axis=1) - points
    return np.linalg.norm(area, axis=1) < THIN * dot(sides, sides).max(axis=(1, 2))


def _reach(work: Patchwork, frame: SideFrame, planes: Floats) -> Floats:
    """Lengths ``(N,)`` of the parts of normals ``(N,3)`` across the middle legs of their sides."""
    middle = (work.curves[:, :, 2] - work.curves[:, :, 1]).T[frame.edges]
    along = unit(middle)
    return np.linalg.norm(planes - dot(planes, along) * along, axis=1)


def _links(work: Patchwork, frame: SideFrame, twins: Ints, turned: Ints) -> Ints:
    """For each side the vertices across it, left and right, or -1; its half-edge; 1 for those ``turned (t,)``.

    ``twins (N,)`` are the half-edges that share sides, or -1.
    """
    topology, half_edges = work.topology, frame.half_edges
    across = topology.vertices[topology.prev]
    own, other = across[half_edges], np.where(twins >= 0, across[twins], -1)
    forward = topology.forward[half_edges]
    links = np.stack([np.where(forward, own, other), np.where(forward, other, own), half_edges, 0 * own], axis=1)
    links[turned, 3] = 1
    return links
