"""Regions to convex polygons, mended until every polygon is one that a patch can fill.

Each region's border becomes a polygon of its anchors, which the shared splitter cuts into convex pieces. Where that
fails the region gets more anchors or is cut in two, and all is done again; in the end stand the input's triangles.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from curvify.convex import DOUBLED, UNSPLIT, Split, split_polygons
from curvify.errors import MeshError
from curvify.mesh import Bools, Floats, Ints
from curvify.simplify.borders import Borders, Chords, Tolerance, chords_of, farthest, find_anchors, region_borders
from curvify.simplify.polygons import Polygons, pillows, shapes_of
from curvify.simplify.regions import bisect, make_discs
from curvify.simplify.triangles import Triangles
from curvify.simplify.vsa import Metric, proxies, two_means

#: Rounds after which something must be wrong: every round cuts or refines what has failed.
ROUNDS = 60
#: A region is too curved where more than this share of its area is turned by more than this cosine away.
CURVED_SHARE, CURVED = 0.03, 0.5
#: Cosine that must remain between a polygon and its region.
FACING = 0.2
#: Chords that leave their border by more than this share of their length may get another anchor.
BULGING = 0.03
#: Least sine of a triangle's corners.
NEEDLE = 1e-3


@dataclass(eq=False)
class Partition:
    """Regions ``labels (F,)`` of a mesh on their way to polygons; ``forced (V,)`` anchors; ``tries (K,)``."""

    mesh: Triangles
    metric: Metric
    sharp_edges: Bools
    tolerance: Tolerance
    rule: str
    labels: Ints
    forced: Bools = field(init=False)
    tries: Ints = field(init=False)

    def __post_init__(self) -> None:
        self.forced = np.zeros(len(self.mesh.positions), dtype=bool)
        self.tries = np.zeros(self.count, dtype=np.int64)

    @property
    def count(self) -> int:
        return int(self.labels.max()) + 1

    @property
    def normals(self) -> Floats:
        """Normal of each region ``(K,3)``."""
        return proxies(self.metric, self.labels, self.count)

    def relabel(self, labels: Ints, cut: Ints | tuple[()]) -> None:
        """Take labels with more regions; those ``cut`` begin anew, as the fresh ones do."""
        fresh = int(labels.max()) + 1 - self.count
        self.labels = labels
        self.tries[np.asarray(cut, dtype=np.int64)] = 0
        self.tries = np.concatenate([self.tries, np.zeros(fresh, dtype=np.int64)])


def polygonize(partition: Partition) -> Polygons:
    """Convex polygons for all regions; the partition is mended on the way.

    A region of one face is taken as it is, needle or not. Raises MeshError if that does not come to an end.
    """
    flatten(partition)
    for _ in range(ROUNDS):
        partition.relabel(make_discs(partition.mesh, partition.labels), ())
        mesh, normals = partition.mesh, partition.normals
        borders = region_borders(mesh, partition.labels, normals, partition.sharp_edges)
        anchors = find_anchors(mesh, borders, partition.forced, partition.tolerance)
        chords = chords_of(borders, anchors)
        offsets = np.searchsorted(chords.regions, np.arange(partition.count + 1))
        split = split_polygons(mesh.positions, offsets, chords.ends[:, 0], rule=partition.rule)
        failed = _failed_regions(partition, split, normals)
        if not failed.any():
            return _polygons(borders, chords, split)
        _mend(partition, failed, borders, chords)
    raise MeshError("no valid polygons were found for this mesh; please report it")


def flatten(partition: Partition) -> None:
    """Cut regions of which too much turns away from their normal."""
    for _ in range(ROUNDS):
        curved = np.flatnonzero(_too_curved(partition))
        if not len(curved):
            return
        labels = two_means(partition.mesh, partition.metric, partition.labels, curved)
        if int(labels.max()) + 1 == partition.count:
            return
        partition.relabel(labels, curved)


def _too_curved(partition: Partition) -> Bools:
    mesh, labels, count = partition.mesh, partition.labels, partition.count
    cosine = np.einsum("fi,fi->f", mesh.normals, partition.normals[labels])
    away = np.bincount(labels, mesh.areas * (cosine < CURVED), count)
    several = np.bincount(labels, minlength=count) > 1
    return several & (away > CURVED_SHARE * np.bincount(labels, mesh.areas, count))


def _failed_regions(partition: Partition, split: Split, normals: Floats) -> Bools:
    """Regions ``(K,)`` whose pieces no patch could fill, or that lie on the vertices of others."""
    sizes = np.diff(split.face_offsets)
    region = split.source_faces
    shapes = shapes_of(partition.mesh.positions, split.face_vertices, sizes)
    facing = np.einsum("pi,pi->p", shapes.normals, normals[region])
    bad = ~shapes.acceptable | (facing <= FACING) | ((sizes == 3) & (shapes.least_sines < NEEDLE))
    failed: Bools = (split.reasons & (UNSPLIT | DOUBLED)) != 0
    failed[region[bad]] = True
    failed[region[pillows(split.face_vertices, sizes)]] = True
    return failed & (np.bincount(partition.labels, minlength=partition.count) > 1)


def _mend(partition: Partition, failed: Bools, borders: Borders, chords: Chords) -> None:
    """Give failed regions more anchors where that may help, the first two times; else cut them in two."""
    mesh = partition.mesh
    gap, place = farthest(mesh, borders, chords)
    length = np.linalg.norm(mesh.positions[chords.ends[:, 1]] - mesh.positions[chords.ends[:, 0]], axis=1)
    rows = np.flatnonzero(failed[chords.regions] & (partition.tries[chords.regions] < 2))
    rows = rows[gap[rows] > BULGING * length[rows]]
    rows = rows[np.lexsort((rows, -gap[rows] / length[rows], chords.regions[rows]))]
    region = chords.regions[rows]
    rank = np.arange(len(rows)) - np.searchsorted(region, region)
    rows = rows[3 * rank < np.bincount(region, minlength=len(failed))[region]]
    partition.forced[borders.tails[place[rows]]] = True
    helped = np.zeros(len(failed), dtype=bool)
    helped[chords.regions[rows]] = True
    partition.tries += failed
    cut = np.flatnonzero(failed & ~helped)
    if len(cut):
        partition.relabel(bisect(mesh, partition.labels, cut), cut)


def _polygons(borders: Borders, chords: Chords, split: Split) -> Polygons:
    """The pieces with their regions and paths."""
    chord = split.source_corners
    diagonal = split.diagonals >= 0
    steps = borders.tails[chords.order]
    size = np.where(diagonal, 1, chords.sizes[chord])
    start = chords.starts[chord].copy()
    # A diagonal's one step must not take the sharpness of the chord that leaves its corner.
    start[diagonal] = len(steps) + np.arange(int(diagonal.sum()))
    steps = np.concatenate([steps, split.face_vertices[diagonal]])
    sharp = np.concatenate([borders.sharp[chords.order], np.zeros(int(diagonal.sum()), dtype=bool)])
    region = np.repeat(split.source_faces, np.diff(split.face_offsets))
    return Polygons(split.face_offsets, split.face_vertices, region, start, size, steps, sharp)
