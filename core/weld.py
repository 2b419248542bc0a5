"""The numbering of the dense mesh: every point of the surface once, in a place known before it is evaluated.

Vertices are the input's, in their order; then the points of each edge, edges by (smaller id, larger id), from the
smaller id on; then the insides of the faces in their order (first the diagonals of a face that was split, then its
patches). Wedges repeat vertices whose normal or texture coordinate differs between faces, after all vertices, by
(vertex, sector).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from curvify.arrays import values_of
from curvify.mesh import Bools, Floats, Ints
from curvify.records import record
from curvify.sampling import Sampling, edge_abscissae, segments
from curvify.schemes.base import Patches


@record
class Repeats:
    """Wedges beyond the vertices: ``corners (a,)`` are patch corners that show a repeated input vertex, then come
    ``half_edges (b,)`` that show a repeated edge, each ``inner`` wedges, those of one edge interleaved point by
    point: wedge of point j is ``start + stride * j`` in the edge's numbering direction.
    """

    corners: Ints
    half_edges: Ints
    starts: Ints
    strides: Ints


@record
class Numbering:
    """Where everything goes. ``P`` vertices and ``R`` repeats.

    ``edge_starts (E,)`` first vertex of each edge's points, ``reversed (E,)`` whether their order runs against the
    edge's canonical direction; ``patch_starts (p,)`` first vertex of each patch's inside; ``cell_starts (p+1,)``.
    Per patch corner: ``corner_wedges (C,)``, and for the half-edge there ``run_starts``, ``run_strides (C,)``: its
    point j, in its own direction, is wedge start + stride * j. ``base_corners (V,)`` the corner that gives each
    input vertex its normal, -1 for none. ``samplings`` by number of sides.
    """

    level: int
    inner: int
    vertex_count: int
    edge_starts: Ints
    reversed: Bools
    patch_starts: Ints
    cell_starts: Ints
    corner_wedges: Ints
    run_starts: Ints
    run_strides: Ints
    base_corners: Ints
    repeats: Repeats
    samplings: dict[int, Sampling]
    uvs: Floats | None

    @property
    def repeat_count(self) -> int:
        return len(self.repeats.corners) + self.inner * len(self.repeats.half_edges)

    @property
    def face_count(self) -> int:
        return int(self.cell_starts[-1])

    @property
    def abscissae(self) -> Floats:
        """Abscissae of the points of every edge."""
        return edge_abscissae(self.inner + 1)


def predict_faces(patches: Patches, level: int) -> int:
    """Number of faces of the dense mesh, before anything of its size is made."""
    return sum(len(c.patches) * len(patches.sampling(c.sides, 1).cells) for c in patches.classes) * level**2


def cell_sources(patches: Patches, level: int) -> tuple[Ints, Floats]:
    """Patch ``(Q,)`` of each cell of the dense mesh, and the middle of the cell in its domain ``(Q,2)``."""
    samplings = {c.sides: patches.sampling(c.sides, level) for c in patches.classes}
    sizes = patches.topology.sizes
    counts = np.array([len(samplings[int(size)].cells) for size in values_of(sizes)])
    cells = counts[np.searchsorted(values_of(sizes), sizes)]
    starts = np.cumsum(cells) - cells
    centers = np.empty((int(cells.sum()), 2))
    for patch_class in patches.classes:
        middle = samplings[patch_class.sides].centers
        centers[starts[patch_class.patches][:, None] + np.arange(len(middle))] = middle
    return np.repeat(np.arange(len(sizes)), cells), centers


def number_dense_mesh(patches: Patches, level: int) -> Numbering:
    """Numbering of the dense mesh of refinement level k."""
    topology = patches.topology
    inner = segments(level) - 1
    samplings = {c.sides: patches.sampling(c.sides, level) for c in patches.classes}
    points, cells = (np.zeros(len(topology.sizes), dtype=np.int64) for _ in range(2))
    for patch_class in patches.classes:
        points[patch_class.patches] = len(samplings[patch_class.sides].points)
        cells[patch_class.patches] = len(samplings[patch_class.sides].cells)
    edge_starts, patch_starts, total = _starts(patches, points, inner)
    uvs = None if patches.mesh.corner_uvs is None else patches.mesh.corner_uvs[patches.source_corners]
    colors = corner_colors(patches)
    carried = [values for values in (uvs, colors) if values is not None]
    attributes = np.concatenate(carried, axis=1) if carried else None
    corner_wedges, base_corners, corner_repeats = _corner_wedges(patches, attributes, total)
    heads = topology.vertices[topology.next]
    along = topology.vertices < heads
    starts = edge_starts[topology.edge]
    strides = np.ones(len(starts), dtype=np.int64)
    extra = _split_half_edges(patches, attributes)
    offset = total + len(corner_repeats)
    rank, share = _ranks(topology.edge[extra])
    first = offset + inner * (np.arange(len(extra)) - rank) + rank
    starts[extra], strides[extra] = first, share
    repeats = Repeats(corner_repeats, extra, first, share)
    run_starts = np.where(along, starts, starts + strides * (inner - 1))
    run_strides = np.where(along, strides, -strides)
    return Numbering(
        level=level,
        inner=inner,
        vertex_count=total,
        edge_starts=edge_starts,
        reversed=topology.edges[:, 0] > topology.edges[:, 1],
        patch_starts=patch_starts,
        cell_starts=np.concatenate([[0], np.cumsum(cells)]),
        corner_wedges=corner_wedges,
        run_starts=run_starts,
        run_strides=run_strides,
        base_corners=base_corners,
        repeats=repeats,
        samplings=samplings,
        uvs=uvs,
    )


def _starts(patches: Patches, points: Ints, inner: int) -> tuple[Ints, Ints, int]:
    """First vertex of each edge and each patch, and the number of vertices."""
    outer = len(patches.topology.edges) - len(patches.inner_faces)
    first = len(patches.positions) + outer * inner
    before = np.concatenate([[0], np.cumsum(points)])
    diagonals = np.searchsorted(patches.inner_faces, patches.source_faces, side="right")
    patch_starts = first + before[:-1] + inner * diagonals
    earlier = np.searchsorted(patches.source_faces, patches.inner_faces, side="left")
    diagonal_starts = first + before[earlier] + inner * np.arange(len(patches.inner_faces))
    edge_starts = np.concatenate([len(patches.positions) + inner * np.arange(outer), diagonal_starts])
    return edge_starts, patch_starts, int(first + before[-1] + inner * len(patches.inner_faces))


def _differ(rows: Floats, others: Floats) -> Bools:
    """Rows ``(n,c)`` that are not the same numbers; missing ones (NaN) are the same."""
    return ((rows != others) & ~(np.isnan(rows) & np.isnan(others))).any(axis=1)


def corner_colors(patches: Patches) -> Floats | None:
    """Colors of the patch corners ``(C,c)``: those of the vertex that the file has there, also where it was welded."""
    mesh = patches.mesh
    if mesh.vertex_colors is None:
        return None
    return mesh.vertex_colors[mesh.face_vertices[patches.source_corners]].astype(np.float64)


def _corner_wedges(patches: Patches, carried: Floats | None, total: int) -> tuple[Ints, Ints, Ints]:
    """Wedge of each corner, base corner of each vertex, and a corner for each repeat."""
    vertices = patches.topology.vertices
    rows = patches.normals if carried is None else np.concatenate([patches.normals, carried], axis=1)
    own = np.flatnonzero(patches.mesh.face_vertices[patches.source_corners] == vertices)
    return split_wedges(vertices, rows, own, len(patches.positions), total)


def split_wedges(vertices: Ints, rows: Floats, own: Ints, count: int, total: int) -> tuple[Ints, Ints, Ints]:
    """Wedge ``(C,)`` of each corner, base corner ``(count,)`` of each vertex (-1: none), and a corner for each repeat.

    Corners of one of the ``vertices (C,)`` are one wedge where their ``rows (C,c)`` are equal; that of the base corner
    is the vertex itself, the others are numbered from ``total`` on. ``own`` are corners of the vertex itself, not of a
    copy welded to it.
    """
    base = np.full(count, len(vertices))
    np.minimum.at(base, vertices, np.arange(len(vertices)))
    base[vertices[own[::-1]]] = own[::-1]
    wedges = vertices.copy()
    other = np.flatnonzero(_differ(rows, rows[base[vertices]]))
    corners = np.zeros(0, dtype=np.int64)
    if len(other):
        classes = np.unique(np.nan_to_num(rows[other], nan=np.inf), axis=0, return_inverse=True)[1].reshape(-1)
        keys = vertices[other] * (classes.max() + 1) + classes
        _, first, which = np.unique(keys, return_index=True, return_inverse=True)
        order = np.lexsort((first, vertices[other][first]))
        rank = np.empty_like(order)
        rank[order] = np.arange(len(order))
        wedges[other] = total + rank[which.reshape(-1)]
        corners = other[first[order]]
    base[base == len(vertices)] = -1
    return wedges, base, corners


def _split_half_edges(patches: Patches, carried: Floats | None) -> Ints:
    """Half-edges whose normals or carried values differ from those of their edge's first half-edge, by edge."""
    topology = patches.topology
    first = topology.first
    lead = first[topology.edge]
    differs = patches.side_field != patches.side_field[lead]
    if carried is not None:
        along = (topology.forward == topology.forward[lead])[:, None]
        start = np.where(along, carried[lead], carried[topology.next[lead]])
        end = np.where(along, carried[topology.next[lead]], carried[lead])
        differs |= _differ(carried, start) | _differ(carried[topology.next], end)
    extra = np.flatnonzero(differs)
    return extra[np.argsort(topology.edge[extra], kind="stable")]


def _ranks(groups: Ints) -> tuple[Ints, Ints]:
    """Place of each entry within its run of equal values, and the length of the run."""
    if not len(groups):
        return groups, groups
    fresh = np.concatenate([[True], groups[1:] != groups[:-1]])
    starts = np.flatnonzero(fresh)
    lengths = np.diff(np.append(starts, len(groups)))
    return np.arange(len(groups)) - np.repeat(starts, lengths), np.repeat(lengths, lengths)


def repeat_vertices(numbering: Numbering, patches: Patches) -> Ints:
    """The vertex ``(R,)`` that each repeat repeats."""
    repeats, topology = numbering.repeats, patches.topology
    starts = numbering.edge_starts[topology.edge[repeats.half_edges]]
    steps = np.arange(numbering.inner)
    places = repeats.starts[:, None] + repeats.strides[:, None] * steps
    result = np.empty(numbering.repeat_count, dtype=np.int64)
    result[: len(repeats.corners)] = topology.vertices[repeats.corners]
    result[places - numbering.vertex_count] = starts[:, None] + steps
    return result


def cells_of(numbering: Numbering, patches: Patches, first: int, last: int) -> Ints:
    """Wedges ``(q,s)`` of the cells of patches first to last, in order."""
    sizes = patches.topology.sizes[first:last]
    begin = numbering.cell_starts[first]
    parts = list(_cells_by_size(numbering, patches, first, sizes))
    if len(parts) == 1:
        return parts[0][1].reshape(-1, parts[0][1].shape[-1])
    result = np.empty((int(numbering.cell_starts[last] - begin), parts[0][1].shape[-1]), dtype=parts[0][1].dtype)
    for rows, cells in parts:
        places = numbering.cell_starts[first + rows] - begin
        result[places[:, None] + np.arange(cells.shape[1])] = cells
    return result


def _cells_by_size(
    numbering: Numbering, patches: Patches, first: int, sizes: Ints
) -> Iterator[tuple[Ints, Ints]]:
    """For each polygon size: the patches (counted from ``first``) and their cells ``(f,Q,s)``."""
    offsets = patches.topology.offsets
    wide = numbering.vertex_count + numbering.repeat_count >= 2**31
    kind = np.int64 if wide else np.int32
    for size in values_of(sizes):
        rows = np.flatnonzero(sizes == size)
        sampling = numbering.samplings[size]
        corners = offsets[first + rows][:, None] + np.arange(size)
        ends = size * (1 + numbering.inner)
        local = np.empty((len(rows), ends + len(sampling.points)), dtype=kind)
        local[:, :size] = numbering.corner_wedges[corners]
        starts, strides = (values[corners].astype(kind) for values in (numbering.run_starts, numbering.run_strides))
        runs = local[:, size:ends].reshape(len(rows), size, numbering.inner)
        np.multiply(strides[..., None], np.arange(numbering.inner, dtype=kind), out=runs)
        runs += starts[..., None]
        inside = numbering.patch_starts[first + rows].astype(kind)
        np.add(inside[:, None], np.arange(len(sampling.points), dtype=kind), out=local[:, ends:])
        yield rows, np.take(local, sampling.cells, axis=1, mode="clip")
