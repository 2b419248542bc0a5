"""What a surface is worth, in numbers: continuity across edges, volume, size.

The angle across an edge is measured from the two faces' own derivatives, signed, never from the edge normal that
they share, so that a fold shows as an angle near 180 degrees.
"""

from __future__ import annotations

import numpy as np

from curvify import evaluate
from curvify.arrays import cross, values_of
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import degrees_between
from curvify.records import record
from curvify.sampling import domain_corners
from curvify.schemes.base import Patches
from curvify.topology import is_closed, signed_volume

#: Fractions of an edge at which continuity is measured.
PLACES = (0.1, 0.3, 0.5, 0.7, 0.9)


@record
class EdgeAngles:
    """Continuity across interior edges: ``edges (e,)``, ``angles (e,m)`` in degrees between the faces' normals,
    ``gaps (e,m)`` the distance between the faces' positions, ``smooth (e,)`` whether the edge should be smooth.
    """

    edges: Ints
    angles: Floats
    gaps: Floats
    smooth: Bools


def edge_angles(patches: Patches, places: tuple[float, ...] = PLACES, most: int | None = None) -> EdgeAngles:
    """Measure continuity across the interior edges, all of them or ``most`` spread over the mesh."""
    topology = patches.topology
    one = np.flatnonzero(topology.twin > np.arange(len(topology.twin)))
    if most is not None and len(one) > most:
        one = one[np.linspace(0, len(one) - 1, most).astype(np.int64)]
    other = topology.twin[one]
    t = np.array(places)
    here = _side_samples(patches, one, t)
    there = _side_samples(patches, other, 1 - t)
    shape = (len(one), len(t))
    angles = degrees_between(here[1], there[1]).reshape(shape)
    gaps = np.linalg.norm(here[0] - there[0], axis=1).reshape(shape)
    smooth = patches.side_field[one] == patches.side_field[other]
    return EdgeAngles(topology.edge[one], angles, gaps, smooth)


def _side_samples(patches: Patches, half_edges: Ints, t: Floats) -> tuple[Floats, Floats]:
    """Positions and normals ``(h*m,3)`` from the derivatives of each half-edge's own patch at ``t (m,)``."""
    topology = patches.topology
    ids = topology.faces[half_edges]
    sides = topology.sizes[ids]
    side = half_edges - topology.offsets[ids]
    points = np.empty((len(half_edges), len(t), 2))
    for size in values_of(sides):
        rows = np.flatnonzero(sides == size)
        corners = domain_corners(size)
        start, end = corners[side[rows]], corners[(side[rows] + 1) % size]
        points[rows] = start[:, None] * (1 - t)[:, None] + end[:, None] * t[:, None]
    position, by_xi, by_eta = evaluate.evaluate_at(patches, np.repeat(ids, len(t)), points.reshape(-1, 2))
    return position, cross(by_xi, by_eta)


def volume_ratio(patches: Patches, positions: Floats, faces: Ints) -> float | None:
    """Volume of the dense mesh over that of the coarse one, None unless the coarse mesh is closed."""
    topology = patches.topology
    if not is_closed(topology):
        return None
    coarse = signed_volume(patches.positions, topology.offsets, topology.vertices)
    offsets = np.arange(len(faces) + 1) * faces.shape[1]
    dense = signed_volume(positions.astype(np.float64), offsets, faces.reshape(-1))
    return dense / coarse if coarse else None
