"""Polygons into triangles by diagonals, for schemes, files and searches that know triangles only.

The rule depends on a polygon's positions and vertex ids, not on the corner that is listed first: quads are cut along
their shorter diagonal, or at their reflex corner; larger polygons by ear clipping (mapbox_earcut) in the plane of their
area vector. Polygons that this would cut along an edge of the mesh or another's diagonal, as beside a vertex of two
edges, are cut by the splitter of convex polygons, which avoids that: an edge must not come to have four sides. The
pieces come as a ``convex.Split``, so that triangles keep their source faces and corners as the convex pieces do.

Two places have reasons of their own: `simplify` begins with the well-shaped triangles of the splitter, which takes
longer; pictures (`gpu.triangles`) show quads halved at one corner, fast, and nobody counts the edges of those.
"""

from __future__ import annotations

import numpy as np

from curvify.arrays import values_of
from curvify.convex import Split, cut_along, split_polygons
from curvify.mesh import Bools, Floats, Ints, PolygonMesh
from curvify.polygons import cross_rows, dot_rows, edge_keys, is_in, judge, lay_flat, next_corners

#: Diagonals whose squared lengths agree to this share are equally long.
EQUAL = 1e-9


def triangulate_polygons(
    positions: Floats, face_offsets: Ints, face_vertices: Ints, concave_only: bool = False
) -> tuple[Split, Ints]:
    """Cut faces with more than 3 corners into triangles, all of them or only those that are not convex.

    Returns the pieces and the faces for which ears did not do, which are cut into a fan.
    """
    offsets, vertices = np.asarray(face_offsets, dtype=np.int64), np.asarray(face_vertices, dtype=np.int64)
    sizes = np.diff(offsets)
    corners: Ints
    pairs: list[Ints] = [np.zeros((0, 2), dtype=np.int64)]
    fanned: list[Ints] = [np.zeros(0, dtype=np.int64)]
    for size in values_of(sizes[sizes > 3]):
        faces: Ints = np.flatnonzero(sizes == size)
        listed = offsets[faces] + np.arange(size)[:, None]
        turned = (np.argmin(vertices[listed], axis=0) + np.arange(size)[:, None]) % size
        corners = np.take_along_axis(listed, turned, axis=0)
        points: Floats = positions.T[:, vertices[corners]]
        if concave_only:
            wanted = np.flatnonzero(~judge(points).acceptable)
            faces, corners, points = faces[wanted], corners[:, wanted], points[:, :, wanted]
        if not len(faces):
            continue
        if size == 4:
            ends, failed = _quad_diagonals(points, vertices[corners], offsets, vertices), faces[:0]
        else:
            ends, failed = _ear_diagonals(points, faces)
        pairs.append(np.take_along_axis(corners.T[:, None], ends, axis=2).reshape(-1, 2))
        fanned.append(failed)
    reasons = np.zeros(len(sizes), dtype=np.uint8)
    cuts = _without_doubles(positions, offsets, vertices, np.concatenate(pairs))
    return cut_along(offsets, vertices, cuts, reasons), np.concatenate(fanned)


def triangle_corners(mesh: PolygonMesh) -> Ints:
    """Corners ``(T,3)`` of triangles that cover the faces, in face order: n-2 for a face with n corners."""
    split, _ = triangulate_polygons(mesh.positions, mesh.face_offsets, mesh.face_vertices)
    whole = np.repeat(np.diff(split.face_offsets) == 3, np.diff(split.face_offsets))
    return split.source_corners[whole].reshape(-1, 3)


def _without_doubles(positions: Floats, offsets: Ints, vertices: Ints, pairs: Ints) -> Ints:
    """The diagonals ``pairs (D,2)`` of corners, those of faces replaced that would run along an edge or another one."""
    if not len(pairs):
        return pairs
    keys = edge_keys(*vertices[pairs].T)
    order = np.argsort(keys, kind="stable")
    double = is_in(keys, np.sort(edge_keys(vertices, vertices[next_corners(offsets)])))
    double[order[1:]] |= keys[order[1:]] == keys[order[:-1]]
    owner = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))[pairs[:, 0]]
    kept = ~np.isin(owner, owner[double])
    if kept.all():
        return pairs
    first = cut_along(offsets, vertices, pairs[kept], np.zeros(len(offsets) - 1, dtype=np.uint8))
    rest = split_polygons(positions, first.face_offsets, first.face_vertices, max_sides=3)
    here, ends = np.flatnonzero(rest.diagonals >= 0), next_corners(rest.face_offsets)
    here = here[np.argsort(rest.diagonals[here], kind="stable")][::2]  # each has two sides
    added = first.source_corners[rest.source_corners[np.stack([here, ends[here]], axis=1)]]
    return np.concatenate([pairs[kept], added])


def _quad_diagonals(points: Floats, ids: Ints, offsets: Ints, vertices: Ints) -> Ints:
    """Ends ``(F,1,2)`` of the diagonal of quads ``(3,4,F)`` with vertices ``ids (4,F)``: the shorter one where both lie
    inside, the other one where that would run along an edge of the mesh or another quad's diagonal.
    """
    leave = np.roll(points, -1, axis=1) - points
    turn = cross_rows(np.roll(leave, 1, axis=1), leave)
    reflex = dot_rows(turn, turn.sum(axis=1)[:, None]) <= 0
    across = points[:, 2:] - points[:, :2]
    first, second = dot_rows(across, across)
    start = np.where(second < first * (1 - EQUAL), 1, 0)
    concave = reflex.any(axis=0)
    start = np.where(concave, np.argmax(reflex, axis=0) % 2, start)
    keys = edge_keys(ids[:2], ids[2:])
    chosen = keys[start, np.arange(len(start))]
    edges = np.sort(edge_keys(vertices, vertices[next_corners(offsets)]))
    order = np.argsort(chosen, kind="stable")
    taken = is_in(chosen, edges)
    taken[order[1:]] |= chosen[order[1:]] == chosen[order[:-1]]
    other = keys[1 - start, np.arange(len(start))]
    start = np.where(taken & ~concave & ~is_in(other, np.sort(np.concatenate([edges, chosen]))), 1 - start, start)
    return np.stack([start, start + 2], axis=1)[:, None]


def _ear_diagonals(points: Floats, faces: Ints) -> tuple[Ints, Ints]:
    """Ends ``(F,n-3,2)`` of the diagonals of polygons ``(3,n,F)``, and those of ``faces (F,)`` that got a fan."""
    from mapbox_earcut import triangulate_float64

    size, count = points.shape[1:]
    steps = np.arange(2, size - 1)
    ends = np.tile(np.stack([np.zeros_like(steps), steps], axis=1), (count, 1, 1))
    flat = _in_plane(points)
    ring = np.array([size])
    triangles = np.full((count, size - 2, 3), -1, dtype=np.int64)
    for face in range(count):  # ears are clipped one polygon at a time
        found = triangulate_float64(flat[face], ring).reshape(-1, 3)
        if len(found) == size - 2:
            triangles[face] = found
    sides = np.stack([triangles, np.roll(triangles, -1, axis=2)], axis=-1).reshape(count, -1, 2)
    low, high = sides.min(axis=2), sides.max(axis=2)
    key = np.where((high - low > 1) & (high - low < size - 1), low * size + high, -1)
    key = np.sort(key, axis=1)[:, -2 * (size - 3) :]
    whole: Bools = (key[:, ::2] == key[:, 1::2]).all(axis=1) & (key[:, 0] >= 0)
    whole &= (np.diff(key[:, ::2], axis=1) > 0).all(axis=1)
    ends[whole] = np.stack(np.divmod(key[whole, ::2], size), axis=-1)
    return ends, faces[~whole]


def _in_plane(points: Floats) -> Floats:
    """Polygons ``(3,n,F)`` in the planes of their area vectors ``(F,n,2)``, contiguous; zero without an area."""
    local = points - points[:, :1]
    area = cross_rows(local, np.roll(local, -1, axis=1)).sum(axis=1)
    flat = np.zeros((points.shape[2], points.shape[1], 2))
    sized = np.flatnonzero(dot_rows(area, area) > 0)
    if len(sized):
        flat[sized] = lay_flat(points[:, :, sized])[:2].transpose(2, 1, 0)
    return flat
