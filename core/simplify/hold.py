"""Steps of a fit held back where they would break polygons.

The fit knows patches, not the polygons below them: it may make those concave, and bring surfaces that are close to each
other through one another. Most concave polygons can be cut. Around the others, and around polygons that have come to
cross, vertices go back on their way until the polygons are whole again; where they started, they were.
"""

from __future__ import annotations

import numpy as np

from curvify.arrays import distinct
from curvify.convex import DOUBLED, FOLDED, UNSPLIT, split_polygons
from curvify.mesh import Bools, Ints, PolygonMesh
from curvify.pieces import MAX_SIDES
from curvify.polygons import is_in
from curvify.simplify.crossings import crossing_polygons
from curvify.simplify.polygons import shapes_of

#: Share of its way that a vertex keeps each time, the share below which it goes back all of it, and how often.
KEPT, LEAST, ROUNDS = 0.5, 0.1, 12


def held_back(before: PolygonMesh, after: PolygonMesh, rule: str, cut: bool = True) -> PolygonMesh:
    """The mesh ``after`` a fit, with vertices nearer to where they were ``before`` around polygons that it broke.

    Both have the same faces. ``rule`` is that of `split_polygons`; without ``cut`` no polygon is to become concave,
    otherwise none that diagonals cannot mend. Polygons that were broken before do not count.
    """
    share, way = np.ones(before.vertex_count), after.positions - before.positions
    if not way.any():
        return after
    sound, crossed = _convex(before), _pairs(before)
    mesh = after
    for _ in range(ROUNDS):
        broken = sound & (_beyond_cuts(mesh, rule) if cut else ~_convex(mesh))
        broken[_faces_of(_pairs(mesh), crossed, mesh.face_count)] = True
        touched = distinct(mesh.face_vertices[broken[mesh.corner_faces]])[0]
        touched = touched[(share[touched] > 0) & way[touched].any(axis=1)]
        if not len(touched):
            break
        share[touched] *= KEPT
        share[share < LEAST] = 0.0
        mesh = after.with_(positions=before.positions + share[:, None] * way)
    return mesh


def _convex(mesh: PolygonMesh) -> Bools:
    """Polygons ``(P,)`` that patches can fill."""
    return shapes_of(mesh.positions, mesh.face_vertices, mesh.face_sizes).acceptable


def _beyond_cuts(mesh: PolygonMesh, rule: str) -> Bools:
    """Polygons ``(P,)`` that are concave and that no diagonal of their own makes convex."""
    split = split_polygons(mesh.positions, mesh.face_offsets, mesh.face_vertices, rule=rule, max_sides=MAX_SIDES)
    return (split.reasons & (UNSPLIT | FOLDED | DOUBLED)) > 0


def _pairs(mesh: PolygonMesh) -> Ints:
    """Sorted keys of pairs of polygons that cross."""
    pairs = np.sort(crossing_polygons(mesh), axis=1)
    return distinct(pairs[:, 0] * np.int64(mesh.face_count) + pairs[:, 1])[0]


def _faces_of(pairs: Ints, known: Ints, count: int) -> Ints:
    """Polygons of the pairs that are not among the ``known`` ones."""
    return np.concatenate(np.divmod(pairs[~is_in(pairs, known)], count))
