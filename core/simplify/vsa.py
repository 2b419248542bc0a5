"""Variational shape approximation: faces in regions that are nearly planar and not too long.

The L2,1 error of a face t in a region with proxy normal N is A_t |n_t - N|^2 (Cohen-Steiner, Alliez & Desbrun 2004);
with S the sum of A_t n_t, the best proxy is S / |S| and a region's error 2 (A - |S|). A term w A_t |c_t - C|^2 keeps
regions compact, which the refined surface rewards: edges along a flat direction carry normals that twist.

Regions are made by doubling, each split being a 2-means of normals, and improved by exchanging faces across their
borders: every move is judged by the exact change of the error of both regions, whole sweeps at a time. That reaches
lower errors than best-first flooding, in plain array arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from curvify.mesh import Bools, Floats, Ints
from curvify.normals import sum_by, unit
from curvify.simplify.triangles import Triangles

#: Sweeps of exchange after each doubling, at the end, and with the compactness term.
LEVEL_SWEEPS, SWEEPS, COMPACT_SWEEPS = 6, 40, 40
#: Sweeps between two looks for regions that have come apart.
SETTLE_EVERY = 8
#: Gains below this share of a face's weight are rounding.
LEAST_GAIN = 1e-12

Progress = Callable[[float], None]


@dataclass(eq=False)
class Metric:
    """What regions are judged by: each face's moments, ``weights (F,)`` its area, ``normals (F,3)`` the area vector,
    ``centers (F,3)`` area times centroid; ``compactness`` the weight w of the second moment.
    """

    weights: Floats
    normals: Floats
    centers: Floats
    compactness: float = 0.0

    @classmethod
    def of(cls, mesh: Triangles) -> Metric:
        """The metric of a mesh, without compactness; centroids are measured from the middle of the mesh."""
        middle = mesh.centroids.mean(axis=0)
        weights = mesh.areas
        return cls(weights, mesh.normals * weights[:, None], (mesh.centroids - middle) * weights[:, None])

    def compact(self, labels: Ints, factor: float) -> Metric:
        """The metric with w = factor (E / A) / (A / K) for the regions that are there."""
        count = int(labels.max()) + 1
        area = float(self.weights.sum())
        energy = float(region_errors(self, labels).sum())
        weight = factor * energy * count / area**2 if area > 0 else 0.0
        return Metric(self.weights, self.normals, self.centers, weight)


def region_errors(metric: Metric, labels: Ints) -> Floats:
    """L2,1 error of each region ``(K,)`` about its own best proxy."""
    count = int(labels.max()) + 1
    total = np.bincount(labels, metric.weights, count)
    return np.maximum(2 * (total - np.linalg.norm(sum_by(labels, metric.normals, count), axis=1)), 0.0)


def proxies(metric: Metric, labels: Ints, count: int) -> Floats:
    """Proxy normal of each region ``(K,3)``."""
    return unit(sum_by(labels, metric.normals, count))


def cluster(mesh: Triangles, metric: Metric, count: int, labels: Ints, progress: Progress | None = None) -> Ints:
    """Split the regions ``labels (F,)`` until there are ``count``, or no error is left; labels of the result."""
    had = int(labels.max()) + 1
    while (now := int(labels.max()) + 1) < count:
        split = _split_worst(mesh, metric, labels, count - now)
        grown = int(split.max()) + 1
        if grown == now:
            break
        labels = exchange(mesh, metric, split, LEVEL_SWEEPS)
        if progress is not None:
            progress(np.log(grown / had) / np.log(count / had))
    return labels


def _split_worst(mesh: Triangles, metric: Metric, labels: Ints, allowance: int) -> Ints:
    """Split in two, at once, the regions with the largest errors."""
    count = int(labels.max()) + 1
    errors = region_errors(metric, labels)
    errors[errors <= 1e-12 * np.bincount(labels, metric.weights, count)] = 0
    chosen = np.argsort(-errors, kind="stable")[:allowance]
    least = max(1, allowance // 8)
    worth = errors[chosen] >= errors.mean() / 2
    worth[:least] = True
    chosen = chosen[worth & (errors[chosen] > 0)]
    if not len(chosen):
        return labels
    return two_means(mesh, metric, labels, chosen)


def two_means(mesh: Triangles, metric: Metric, labels: Ints, chosen: Ints, rounds: int = 4) -> Ints:
    """Split each of the ``chosen`` regions by a 2-means of its normals, from its worst face; labels of the result.

    The new halves get the labels after the last; a region whose faces all agree stays whole.
    """
    count = int(labels.max()) + 1
    number = np.full(count, -1)
    number[chosen] = np.arange(len(chosen))
    faces = np.flatnonzero(number[labels] >= 0)
    own = number[labels[faces]]
    first = proxies(metric, labels, count)[chosen]
    gap = np.einsum("fi,fi->f", mesh.normals[faces], first[own])
    cost = mesh.areas[faces] * (1 - gap)
    order = np.lexsort((faces, -cost, own))
    worst = faces[order[np.searchsorted(own[order], np.arange(len(chosen)))]]
    second = mesh.normals[worst]
    part: Bools = np.zeros(len(faces), dtype=bool)
    for _ in range(rounds):
        part = np.einsum("fi,fi->f", mesh.normals[faces], second[own] - first[own]) > 0
        first, second = (unit(sum_by(own[side], metric.normals[faces[side]], len(chosen))) for side in (~part, part))
    sizes = np.bincount(own, minlength=len(chosen))
    ones = np.bincount(own[part], minlength=len(chosen))
    proper = (ones > 0) & (ones < sizes)
    part &= proper[own]
    result = labels.copy()
    result[faces[part]] = count + (np.cumsum(proper) - 1)[own[part]]
    return settle(mesh, metric, result)


def exchange(mesh: Triangles, metric: Metric, labels: Ints, sweeps: int) -> Ints:
    """Move faces across the borders of regions while that lowers the error; regions stay connected."""
    neighbors = mesh.neighbors
    count = int(labels.max()) + 1
    labels = labels.copy()
    moved = 0
    for sweep in range(sweeps):
        faces, targets = _moves(metric, neighbors, labels, count, sweep)
        labels[faces] = targets
        moved += len(faces)
        if (sweep + 1) % SETTLE_EVERY == 0 or not len(faces):
            labels = settle(mesh, metric, labels)
            if not len(faces):
                break
    return compressed(settle(mesh, metric, labels))


def _moves(metric: Metric, neighbors: Ints, labels: Ints, count: int, sweep: int) -> tuple[Ints, Ints]:
    """Faces that change region in one sweep, and their new regions: no two of them are neighbors."""
    across = np.where(neighbors < 0, labels[:, None], labels[neighbors])
    faces, side = np.nonzero(across != labels[:, None])
    targets = across[faces, side]
    gain = _gains(metric, labels, count, faces, targets)
    first = np.flatnonzero(np.diff(faces, prepend=-1))
    best = np.maximum.reduceat(gain, first) if len(first) else gain
    width = np.diff(np.append(first, len(faces)))
    chosen = np.flatnonzero((gain == np.repeat(best, width)) & (gain > LEAST_GAIN * metric.weights[faces]))
    chosen = chosen[np.diff(faces[chosen], prepend=-1) != 0]
    faces, targets = faces[chosen], targets[chosen]
    # Of neighbors that both want to move, the one with the larger number of a hash does.
    rank = np.full(len(labels) + 1, -1, dtype=np.int64)
    rank[faces] = ((faces + 1) * 2654435761 + sweep * 40503) % 4294967291
    free = rank[faces] > rank[neighbors[faces]].max(axis=1)
    return faces[free], targets[free]


def _gains(metric: Metric, labels: Ints, count: int, faces: Ints, targets: Ints) -> Floats:
    """How much the error falls when each of the ``faces (n,)`` alone moves to its region of ``targets (n,)``."""
    mass = np.bincount(labels, metric.weights, count)
    total = sum_by(labels, metric.normals, count)
    length = np.sqrt(np.einsum("ki,ki->k", total, total))
    own = labels[faces]
    step = metric.normals[faces]
    left, joined = total[own] - step, total[targets] + step
    gain = np.sqrt(np.einsum("ni,ni->n", left, left)) - length[own]
    gain += np.sqrt(np.einsum("ni,ni->n", joined, joined)) - length[targets]
    gain *= 2
    if metric.compactness > 0:
        weight = metric.weights[faces]
        middle = sum_by(labels, metric.centers, count) / np.maximum(mass, 1e-300)[:, None]
        place = metric.centers[faces] / np.maximum(weight, 1e-300)[:, None]
        away, towards = place - middle[own], place - middle[targets]
        rest = np.maximum(mass[own] - weight, 1e-9 * mass[own])
        leave = mass[own] / np.maximum(rest, 1e-300) * np.einsum("ni,ni->n", away, away)
        join = mass[targets] / np.maximum(mass[targets] + weight, 1e-300) * np.einsum("ni,ni->n", towards, towards)
        gain += metric.compactness * weight * (leave - join)
    gain[np.bincount(labels, minlength=count)[own] < 2] = -np.inf
    return gain


def settle(mesh: Triangles, metric: Metric, labels: Ints) -> Ints:
    """Make every region connected: its largest part stays, the others join the neighbor that costs least."""
    labels = labels.copy()
    for _ in range(20):
        pairs = mesh.dual_edges
        inside = labels[pairs[:, 0]] == labels[pairs[:, 1]]
        part = linked(mesh.face_count, pairs[inside])
        area = np.bincount(part, metric.weights)
        size = np.bincount(part)
        owner = np.empty(len(area), dtype=np.int64)
        owner[part] = labels
        order = np.lexsort((np.arange(len(area)), -size, -area, owner))
        stays = np.zeros(len(area), dtype=bool)
        stays[order[np.diff(owner[order], prepend=-1) > 0]] = True
        if stays.all():
            break
        target = _cheapest_neighbors(metric, labels, part, stays, pairs[~inside])
        loose = target >= 0
        if not loose.any():
            break
        labels = np.where(loose[part], target[part], labels)
    return labels


def _cheapest_neighbors(metric: Metric, labels: Ints, part: Ints, stays: Bools, pairs: Ints) -> Ints:
    """Region that each loose part joins, -1 for parts that stay or have no neighbor that stays."""
    count = int(labels.max()) + 1
    normals = proxies(metric, labels, count)
    vector = sum_by(part, metric.normals, len(stays))
    a, b = np.concatenate([pairs, pairs[:, ::-1]]).T
    usable = ~stays[part[a]] & stays[part[b]]
    loose, region = part[a[usable]], labels[b[usable]]
    worth = np.einsum("ni,ni->n", vector[loose], normals[region])
    order = np.lexsort((region, -worth, loose))
    first = order[np.diff(loose[order], prepend=-1) > 0]
    target = np.full(len(stays), -1)
    target[loose[first]] = region[first]
    return target


def linked(count: int, pairs: Ints) -> Ints:
    """Component ``(count,)`` of each node under the links ``pairs (n,2)``."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def compressed(labels: Ints) -> Ints:
    """Labels renumbered 0, 1, ... without gaps, in their order."""
    used = np.bincount(labels) > 0
    return (np.cumsum(used) - 1)[labels]
