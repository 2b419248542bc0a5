"""Flat polygons: where the dense mesh is flat the surface must be, whatever curves beside it.

A vertex normal that leans by a degree bulges a large flat polygon by more than the whole mesh is off elsewhere. So the
sectors of flat polygons take the normals of their planes, edges between two planes are creases, and polygons that
only creases and their like surround are marked flat. One dense triangle is always flat, and says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.marks import COPLANAR
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import degrees_between, sum_by, unit
from curvify.simplify.borders import segment_distance
from curvify.simplify.features import sectors_of
from curvify.simplify.polygons import Polygons, shapes_of
from curvify.simplify.triangles import Triangles
from curvify.simplify.vsa import Metric, proxies
from curvify.topology import Topology

#: Faces turned by less than this from a plane (degrees) lie in it; a polygon is flat where this share of its area does,
#: of as many faces as the third.
FLAT, SHARE, EVIDENCE = 1.0, 0.8, 3
#: Two planes meet in a crease where they turn by this many times of what their faces do.
FACETED = 4.0
#: Paths that leave their edges by less than this share of the length are straight.
STRAIGHT = 1e-3
#: Lines with a ratio of the eigenvalues of their directions' spread below the first are one, and below the second turn.
ONE_LINE, TURNING = 1e-12, 0.1
#: Normals that differ by less than this (degrees) do not tell well where a crease between them runs.
BLUNT = 10.0


@dataclass(eq=False)
class Planes:
    """How flat polygons are: ``whole (P,)`` where all dense faces lie in one plane, ``flat (P,)`` where most do;
    ``told (P,)`` by enough faces; ``normals (P,3)`` of the plane, unit; ``tilts (P,)`` how far (degrees) the faces are
    turned from that, of flat ones those that lie in it; ``areas (P,)``.
    """

    whole: Bools
    flat: Bools
    told: Bools
    normals: Floats
    tilts: Floats
    areas: Floats


def planes_of(mesh: Triangles, labels: Ints, polygons: Polygons) -> Planes:
    """The planes of polygons on the regions ``labels (F,)``; one of several regions has that of the largest."""
    count = int(labels.max()) + 1
    metric = Metric.of(mesh)
    normals = proxies(metric, labels, count)
    for reach in (5 * FLAT, FLAT):
        near = degrees_between(mesh.normals, normals[labels]) < reach
        mean = unit(sum_by(labels[near], metric.normals[near], count))
        normals = np.where(mean.any(axis=1, keepdims=True), mean, normals)
    turned = np.where(mesh.areas > 0, degrees_between(mesh.normals, normals[labels]), 0.0)
    area = np.bincount(labels, mesh.areas, count)
    inside = turned < FLAT
    share = np.bincount(labels, mesh.areas * inside, count) / np.maximum(area, 1e-300)
    most, tilts = np.zeros(count), np.zeros(count)
    np.maximum.at(most, labels, turned)
    np.maximum.at(tilts, labels[inside], turned[inside])
    faces = np.bincount(labels, minlength=count)
    owner = np.repeat(np.arange(polygons.count), polygons.sides)
    region = np.zeros(polygons.count, dtype=np.int64)
    order = np.lexsort((-polygons.regions, area[polygons.regions], owner))
    region[owner[order]] = polygons.regions[order]
    away = degrees_between(normals[polygons.regions], normals[region[owner]])
    shapes = shapes_of(mesh.positions, polygons.vertices, polygons.sides)
    off = degrees_between(shapes.normals, normals[region])

    def every(fine: Bools) -> Bools:
        return np.bincount(owner[~fine], minlength=polygons.count) == 0

    told = faces[region] >= EVIDENCE
    flat = every((share[polygons.regions] > SHARE) & (away < FLAT)) & told
    turns = np.zeros(polygons.count)
    np.maximum.at(turns, owner, most[polygons.regions] + away)
    tilts = np.where(flat, tilts[region], turns)
    return Planes((turns < FLAT) & (off < FLAT), flat, told, normals[region], tilts, shapes.areas)


def facet_creases(planes: Planes, topology: Topology) -> Bools:
    """Half-edges ``(C,)`` where a flat polygon meets another that is flatter than the turn between them."""
    face = topology.faces
    other = face[np.maximum(topology.twin, 0)]
    turn = degrees_between(planes.normals[face], planes.normals[other])
    apart = turn > np.maximum(BLUNT, FACETED * (planes.tilts[face] + planes.tilts[other]))
    flat = (planes.flat[face] | planes.flat[other]) & planes.told[face] & planes.told[other]
    return (topology.twin >= 0) & flat & apart


def flat_rims(planes: Planes, topology: Topology, least: float) -> Bools:
    """Half-edges ``(C,)`` where flat polygons of at least the area ``least`` end, another plane or none beyond."""
    face = topology.faces
    other = face[np.maximum(topology.twin, 0)]
    alike = planes.flat[face] & planes.flat[other]
    alike &= degrees_between(planes.normals[face], planes.normals[other]) < FLAT
    large = planes.flat & (planes.areas >= least)
    return (topology.twin < 0) | ((large[face] | large[other]) & ~alike)


def straight_lines(
    positions: Floats, polygons: Polygons, topology: Topology, creases: Bools, planes: Planes, apart: Bools
) -> Bools:
    """Half-edges ``(C,)`` to mark as straight: ``creases (C,)`` and boundaries that stand for several steps, none of
    which leaves them by a share `STRAIGHT`; between polygons ``apart (P,)`` those that turn by less than `BLUNT`, the
    others being straight as it is.

    None where two of them turn a little: the normal of the sector between would have to be across both.
    """
    every, twin = np.arange(len(polygons.vertices)), topology.twin
    start, end = positions[polygons.vertices], positions[polygons.vertices[topology.next]]
    rows, which = polygons.path_corners(every)
    gap = np.zeros(len(every))
    np.maximum.at(gap, which, segment_distance(positions[polygons.steps[rows]], start[which], end[which]))
    straight = (polygons.sizes > 1) & (gap < STRAIGHT * np.linalg.norm(end - start, axis=1))
    straight &= creases | (twin < 0)
    face, other = topology.faces, topology.faces[np.maximum(twin, 0)]
    turn = degrees_between(planes.normals[face], planes.normals[other])
    both = (twin >= 0) & apart[face] & apart[other]
    straight = np.where(both, turn < BLUNT, straight)
    rims = (apart[face] | apart[other]) & ~(both & (turn < COPLANAR))
    return straight & ~_bent(start, end, topology, sectors_of(topology, creases | rims), straight)


def _bent(start: Floats, end: Floats, topology: Topology, sectors: Ints, straight: Bools) -> Bools:
    """The ``straight (C,)`` half-edges, from ``start`` to ``end (C,3)``, at a sector where they turn a little."""
    rows = np.flatnonzero(straight)
    along = unit(end[rows] - start[rows])
    ends = sectors[np.concatenate([rows, topology.next[rows]])]
    count = int(sectors.max()) + 1
    products = np.tile(along[:, :, None] * along[:, None, :], (2, 1, 1))
    spread = np.stack([sum_by(ends, products[:, i], count) for i in range(3)], axis=1)
    values = np.linalg.eigvalsh(spread)
    odd = (values[:, 1] > ONE_LINE * values[:, 2]) & (values[:, 1] < TURNING * values[:, 2])
    odd |= values[:, 0] > ONE_LINE * values[:, 2]
    bent = straight & (odd[sectors] | odd[sectors[topology.next]])
    both = np.flatnonzero(topology.twin >= 0)
    bent[both] |= bent[topology.twin[both]]
    return bent


def level(normals: Floats, sectors: Ints, planes: Planes, topology: Topology) -> Floats:
    """The normals ``(C,3)``, those of ``sectors (C,)`` with flat polygons replaced by the mean of their planes'.

    Not where that is far off: the surface bends there within the sector, and what it is next to the plane is unknown.
    """
    face = topology.faces
    weight = np.where(planes.flat, planes.areas, 0.0)
    mean = unit(sum_by(sectors, planes.normals[face] * weight[face, None], int(sectors.max()) + 1))[sectors]
    near = mean.any(axis=1) & (degrees_between(mean, normals) < BLUNT)
    return np.where(near[:, None], mean, normals)


def set_apart(planes: Planes, topology: Topology, creases: Bools) -> Bools:
    """Polygons ``(P,)`` in one plane each side of which is a crease, a boundary or shared with another of them."""
    beside = (topology.twin >= 0) & planes.whole[topology.faces[np.maximum(topology.twin, 0)]]
    open_ = np.bincount(topology.faces, ~(creases | beside), len(planes.whole))
    return planes.whole & (open_ == 0)
