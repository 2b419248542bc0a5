"""Regions that can become polygons: every one a disc with a simple border.

A region is a disc when its Euler number is 1 and no vertex starts two of its border half-edges. Others are cut in
two, by the geodesic Voronoi cells of two far faces, until none is left; a single triangle is a disc.
"""

from __future__ import annotations

import numpy as np

from curvify.arrays import distinct
from curvify.mesh import Bools, Floats, Ints
from curvify.simplify.triangles import Triangles

#: Least distance between neighbors, as a share of the diagonal, so that faces at one place lie apart too.
LEAST_STEP = 1e-9


def border_half_edges(mesh: Triangles, labels: Ints) -> Bools:
    """Half-edges ``(3F,)`` with another region, or nothing, on their other side."""
    own = np.repeat(labels, 3)
    return (mesh.twin < 0) | (own != own[mesh.twin])


def not_discs(mesh: Triangles, labels: Ints) -> Bools:
    """Regions ``(K,)`` that are no discs with a simple border."""
    count = int(labels.max()) + 1
    own = np.repeat(labels, 3)
    border = border_half_edges(mesh, labels)
    keys = own * np.int64(len(mesh.positions)) + mesh.tails
    corner_keys, _ = distinct(keys)
    vertices = np.bincount(corner_keys // len(mesh.positions), minlength=count)
    faces = np.bincount(labels, minlength=count)
    rim = np.bincount(own[border], minlength=count)
    euler = vertices - (3 * faces + rim) // 2 + faces
    starts = np.sort(keys[border])
    pinched = np.zeros(count, dtype=bool)
    pinched[starts[1:][starts[1:] == starts[:-1]] // len(mesh.positions)] = True
    return (euler != 1) | pinched


def make_discs(mesh: Triangles, labels: Ints) -> Ints:
    """Cut regions until all are discs; the new halves get the labels after the last."""
    while (bad := np.flatnonzero(not_discs(mesh, labels))).size:
        labels = bisect(mesh, labels, bad)
    return labels


def bisect(mesh: Triangles, labels: Ints, chosen: Ints) -> Ints:
    """Cut each of the connected regions ``chosen`` in two connected halves, about equally far from two far faces.

    The new halves get the labels after the last; regions of one face stay.
    """
    count = int(labels.max()) + 1
    number = np.full(count, -1)
    number[chosen] = np.arange(len(chosen))
    faces = np.flatnonzero(number[labels] >= 0)
    local = np.full(mesh.face_count, -1)
    local[faces] = np.arange(len(faces))
    own = number[labels[faces]]
    graph = _dual_graph(mesh, labels, local, len(faces))
    order = np.argsort(own, kind="stable")
    first = order[np.searchsorted(own[order], np.arange(len(chosen)))]
    one = _farthest(_distances(graph, first)[0], own, len(chosen))
    other = _farthest(_distances(graph, one)[0], own, len(chosen))
    source = _distances(graph, np.concatenate([one, other]))[1]
    far = np.zeros(len(faces), dtype=bool)
    far[other] = True
    second = far[source] & (one != other)[own]
    result = labels.copy()
    fresh = np.cumsum(one != other) - 1
    result[faces[second]] = count + fresh[own[second]]
    return result


def _dual_graph(mesh: Triangles, labels: Ints, local: Ints, count: int) -> object:
    from scipy.sparse import coo_array

    pairs = mesh.dual_edges
    inside = (labels[pairs[:, 0]] == labels[pairs[:, 1]]) & (local[pairs[:, 0]] >= 0)
    a, b = pairs[inside].T
    step = np.linalg.norm(mesh.centroids[a] - mesh.centroids[b], axis=1)
    step = np.maximum(step, LEAST_STEP * max(mesh.diagonal, 1e-300))
    return coo_array((step, (local[a], local[b])), shape=(count, count)).tocsr()


def _distances(graph: object, starts: Ints) -> tuple[Floats, Ints]:
    """Distance of each node from the nearest start, and which start that is."""
    from scipy.sparse.csgraph import dijkstra

    distance, _, source = dijkstra(graph, directed=False, indices=starts, min_only=True, return_predecessors=True)
    return distance, source.astype(np.int64)


def _farthest(distance: Floats, own: Ints, count: int) -> Ints:
    """The farthest node of each group; of several the first."""
    order = np.lexsort((np.arange(len(own)), -distance, own))
    return order[np.searchsorted(own[order], np.arange(count))]
