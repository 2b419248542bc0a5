"""Which corners share one normal and one texture coordinate, for files that index both together."""

from __future__ import annotations

import numpy as np

from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.records import record


def unique_rows(rows: Floats) -> tuple[Ints, Ints]:
    """Bitwise distinct rows of ``rows (n,c)`` in order of first appearance.

    Returns ``first (u,)``, a row index for each distinct row, and ``which (n,)``, so that
    ``rows[first][which]`` equals ``rows`` bit by bit. All NaN count as equal.
    """
    rows = np.where(np.isnan(rows), np.array(np.nan, dtype=rows.dtype), rows)
    bits = rows.view(np.dtype(f"i{rows.dtype.itemsize}"))
    key = np.zeros(len(rows), dtype=np.int64)
    for column in bits.T:
        values, ranks = np.unique(column, return_inverse=True)
        key = np.unique(key * len(values) + ranks, return_inverse=True)[1]
    return first_appearance(key)


def first_appearance(key: Ints) -> tuple[Ints, Ints]:
    """Distinct values of ``key (n,)`` numbered by first appearance: index of the first, number of each."""
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[which]


@record
class Wedges:
    """Vertices repeated for their further normals and uvs.

    Wedge ``w < V`` is vertex ``w`` with the attributes of its first corner; the rest follow in
    (vertex, first corner) order. ``vertices (W,)``; ``corners (W,)`` a corner that shows the
    attributes, -1 where a vertex is in no face; ``face_wedges (C,)``.
    """

    vertices: Ints
    corners: Ints
    face_wedges: Ints


def split_vertices(mesh: PolygonMesh, dtype: np.dtype[np.floating], uvs: bool = True) -> Wedges:
    """Wedges of ``mesh`` once its normals (and uvs) are rounded to ``dtype``."""
    count = mesh.vertex_count
    key = np.zeros(mesh.corner_count, dtype=np.int64)
    for attribute in (mesh.corner_normals, mesh.corner_uvs if uvs else None):
        if attribute is not None:
            which = unique_rows(attribute.astype(dtype))[1]
            key = np.unique(key * (int(which.max(initial=0)) + 1) + which, return_inverse=True)[1]
    key = key * max(count, 1) + mesh.face_vertices
    first, which = first_appearance(key)
    owner = mesh.face_vertices[first]
    leaders = first_appearance(owner)[0]
    later = np.ones(len(first), dtype=bool)
    later[leaders] = False
    others = np.flatnonzero(later)
    others = others[np.argsort(owner[others], kind="stable")]
    corners = np.full(count, -1, dtype=np.int64)
    corners[owner[leaders]] = first[leaders]
    number = np.empty(len(first), dtype=np.int64)
    number[leaders] = owner[leaders]
    number[others] = count + np.arange(len(others))
    vertices = np.concatenate([np.arange(count), owner[others]])
    return Wedges(vertices, np.concatenate([corners, first[others]]), number[which])


def wedge_rows(wedges: Wedges, attribute: Floats, missing: float) -> Floats:
    """One row for each wedge ``(W,c)`` from a corner attribute ``(C,c)``; zeros where there is no face,
    ``missing`` where the corner has none.
    """
    out = np.zeros((len(wedges.corners), attribute.shape[1]), dtype=attribute.dtype)
    used = wedges.corners >= 0
    out[used] = attribute[wedges.corners[used]]
    out[np.isnan(out).any(axis=1)] = missing
    return out
