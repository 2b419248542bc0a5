"""From polygons to quads: every polygon of n sides becomes n of them, unless all are quads already.

The middles of edges and faces are placed by arcs: from each end the circle that leaves the vertex across its normal,
or along its line, and reaches the middle. Exact on planes, and for regular polygons on spheres. Source: ours
(docs/blending.md); the blending scheme needs quads.
"""

from __future__ import annotations

import numpy as np

from curvify.mesh import Bools, Floats, Ints
from curvify.normals import dot, sum_by, unit
from curvify.polygons import sum_over_faces
from curvify.records import record
from curvify.topology import Topology, build_topology

#: The longest way of a middle from the straight one, as a share of half the edge or of the face's mean radius.
LARGEST_OFFSET = 0.75


@record
class Quads:
    """A quad mesh that covers a polygon mesh with C corners.

    ``positions`` and ``topology`` of the quads. Each corner of the polygons has a *kite* between it, the middles of
    its two sides and the middle of the face: ``kites (C,4)`` are the corners of the quad that holds it, counter-
    clockwise from the polygon's own, and ``extent`` the part of the quad's sides that it takes: 1 where it is the
    quad, 1/2 where the polygon is. ``sides (C,p)`` the half-edges of quads, one or two, that make each side.
    """

    positions: Floats
    topology: Topology
    kites: Ints
    extent: float
    sides: Ints


def whole_quads(positions: Floats, topology: Topology) -> Quads:
    """A mesh of quads as it is."""
    corners = np.arange(len(topology.vertices))
    kites = 4 * (corners // 4)[:, None] + (corners[:, None] + np.arange(4)) % 4
    return Quads(positions, topology, kites, 0.5, corners[:, None])


def split_to_quads(positions: Floats, topology: Topology, middles: Floats, centers: Floats) -> Quads:
    """As many quads for each polygon as it has sides, one at each corner, which is its first.

    New vertices follow the old ones: ``middles (E,3)`` of the edges, then ``centers (F,3)`` of the faces.
    """
    count, edges = topology.vertex_count, len(topology.edges)
    corners = np.arange(len(topology.vertices))
    faces = np.stack(
        [
            topology.vertices,
            count + topology.edge,
            count + edges + topology.faces,
            count + topology.edge[topology.prev],
        ],
        axis=1,
    )
    points = np.concatenate([positions, middles, centers])
    offsets = 4 * np.arange(len(corners) + 1)
    quads = build_topology(points, offsets, faces.reshape(-1))
    kites = 4 * corners[:, None] + np.arange(4)
    sides = np.stack([4 * corners, 4 * topology.next + 3], axis=1)
    return Quads(points, quads, kites, 1.0, sides)


def arc_offsets(chord: Floats, normals: Floats) -> Floats:
    """Way ``(n,3)`` from the end of each chord to the arc that leaves its start across a unit normal."""
    length = np.sqrt(dot(chord, chord))
    along = np.divide(chord, length, out=np.zeros_like(chord), where=length > 0)
    sine = np.clip(-dot(normals, along), -1.0, 1.0)
    return unit(normals - dot(normals, along) * along) * length * np.tan(np.arcsin(sine) / 2)


def tangent_offsets(chord: Floats, tangents: Floats) -> Floats:
    """The same for the arc that leaves the chord's start along a unit tangent; zero tangents give none."""
    length = np.sqrt(dot(chord, chord))
    along = np.divide(chord, length, out=np.zeros_like(chord), where=length > 0)
    across = tangents - dot(tangents, along) * along
    sine, cosine = np.sqrt(dot(across, across)), dot(tangents, along)
    return unit(across) * length * np.tan(np.arctan2(sine, cosine) / 2)


def _limited(offset: Floats, radius: Floats) -> Floats:
    """Offsets ``(n,3)`` not longer than their share of ``radius (n,1)``."""
    length = np.sqrt(dot(offset, offset))
    longest = LARGEST_OFFSET * radius
    return offset * np.divide(longest, length, out=np.ones_like(length), where=length > longest)


def edge_middles(
    positions: Floats, topology: Topology, normals: Floats, tangents: Floats, feature: Bools
) -> Floats:
    """Middle ``(E,3)`` of each edge: by the line's ``tangents (2E,3)`` where it is a ``feature (E,)``, else by the
    ``normals (C,3)`` of the corners on both its sides.
    """
    start, end = positions[topology.edges[:, 0]], positions[topology.edges[:, 1]]
    middle = (start + end) / 2
    ends = 2 * topology.edge + ~topology.forward
    at_ends = np.concatenate([normals, normals[topology.next]])
    across = unit(sum_by(np.concatenate([ends, ends ^ 1]), at_ends, 2 * len(topology.edges)))
    offset = np.zeros_like(middle)
    for side, point in ((0, start), (1, end)):
        by_line = tangent_offsets(middle - point, tangents[side::2])
        offset += np.where(feature[:, None], by_line, arc_offsets(middle - point, across[side::2])) / 2
    half = np.sqrt(dot(end - start, end - start)) / 2
    return middle + _limited(offset, half)


def face_centers(positions: Floats, topology: Topology, normals: Floats) -> Floats:
    """Middle ``(F,3)`` of each face by the ``normals (C,3)`` of its corners."""
    points, sizes = positions[topology.vertices], topology.sizes[:, None]
    mean = sum_over_faces(points, topology.offsets) / sizes
    chord = np.repeat(mean, topology.sizes, axis=0) - points
    offset = sum_over_faces(arc_offsets(chord, normals), topology.offsets) / sizes
    radius = sum_over_faces(np.sqrt(dot(chord, chord)), topology.offsets) / sizes
    return mean + _limited(offset, radius)
