"""Numbers at the vertices of a mesh that tell about its shape, for pictures: heights, bends, curvature."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.errors import OptionError
from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.normals import degrees_between, perpendicular, sum_by, unit
from curvify.polygons import newell_normals, next_corners
from curvify.topology import build_topology, clean_loops, corner_links, weld_vertices

#: What ``vertex_values`` knows, with what stands beside the numbers.
KINDS = {
    "x": "x",
    "y": "y",
    "z": "z",
    "bend": "largest angle between faces, degrees",
    "curvature": "mean curvature, 1 / unit of length",
}


def vertex_values(mesh: PolygonMesh, kind: str, corner_normals: Floats) -> Floats:
    """Values ``(V,)`` of a kind at the vertices; NaN where a vertex is in no face that tells.

    ``corner_normals (C,3)``: unit normals of the surface at the corners, for ``curvature``. Raises OptionError for a
    kind that is not in ``KINDS``.
    """
    makers: dict[str, Callable[[], Floats]] = {
        "bend": lambda: bends(mesh),
        "curvature": lambda: mean_curvatures(mesh, corner_normals),
    }
    if kind not in KINDS:
        raise OptionError(f"values must be one of {', '.join(KINDS)}, not {kind!r}")
    if kind in makers:
        return makers[kind]()
    values: Floats = mesh.positions[:, "xyz".index(kind)].copy()
    return values


def bends(mesh: PolygonMesh) -> Floats:
    """The largest angle in degrees ``(V,)`` between faces that meet at an edge of each vertex; NaN without such edges.

    Seams that a file had to open are closed.
    """
    stand_in = weld_vertices(mesh.positions, mesh.face_offsets, mesh.face_vertices, "auto")
    loops = clean_loops(mesh.face_offsets, stand_in[mesh.face_vertices])
    largest = np.full(mesh.vertex_count, -1.0)
    if len(loops.source_faces):
        topology = build_topology(mesh.positions, loops.offsets, loops.vertices)
        area = newell_normals(mesh.positions, loops.offsets, loops.vertices)
        a, b = corner_links(topology)
        angles = degrees_between(area[topology.faces[a]], area[topology.faces[b]])
        np.maximum.at(largest, topology.vertices[a], angles)
    return np.where(largest < 0, np.nan, largest)[stand_in]


def mean_curvatures(mesh: PolygonMesh, corner_normals: Floats) -> Floats:
    """Mean curvature ``(V,)`` where the surface has the given normals ``(C,3)``: positive where it bulges outward.

    The shape operator at a vertex is the symmetric matrix that best turns the steps to its neighbors, as seen in the
    tangent plane, into the changes of the normal along them (least squares, steps of unit length). Every face counts
    with its own normals, so that a crease adds nothing. NaN at vertices without faces.
    """
    starts, ends = np.arange(mesh.corner_count), next_corners(mesh.face_offsets)
    first, last = np.concatenate([starts, ends]), np.concatenate([ends, starts])
    vertices = mesh.face_vertices[first]
    step = mesh.positions[mesh.face_vertices[last]] - mesh.positions[vertices]
    change = corner_normals[last] - corner_normals[first]
    length = np.linalg.norm(step, axis=1)
    kept = length > 0
    vertices, step, change, length = vertices[kept], step[kept], change[kept], length[kept, None]
    frames = _tangents(mesh, corner_normals)[vertices]
    u, v = np.einsum("nti,ni->tn", frames, step / length)
    along, across = np.einsum("nti,ni->tn", frames, change / length)
    return _half_traces(vertices, u, v, along, across, mesh.vertex_count)


def _tangents(mesh: PolygonMesh, corner_normals: Floats) -> Floats:
    """Two perpendicular unit tangents ``(V,2,3)`` at each vertex."""
    normals = unit(sum_by(mesh.face_vertices, corner_normals, mesh.vertex_count))
    right = perpendicular(normals)
    return np.stack([right, np.cross(normals, right)], axis=1)


def _half_traces(vertices: Ints, u: Floats, v: Floats, along: Floats, across: Floats, count: int) -> Floats:
    """Half the trace ``(count,)`` of the symmetric matrices that best map ``(u,v)`` to ``(along,across)``.

    The unknowns are ``a, b, c`` of ``[[a,b],[b,c]]``: two equations for each step, three normal equations for each
    vertex, with a little added to the diagonal where all steps have one direction.
    """
    zero = np.zeros_like(u)
    rows = np.stack([u * u, u * v, zero, u * v, u * u + v * v, u * v, zero, u * v, v * v], axis=1)
    matrices = np.stack([np.bincount(vertices, row, count) for row in rows.T], axis=1).reshape(-1, 3, 3)
    wanted = sum_by(vertices, np.stack([u * along, u * across + v * along, v * across], axis=1), count)
    weight = np.einsum("vii->v", matrices)
    matrices += 1e-9 * np.maximum(weight, 1.0)[:, None, None] * np.eye(3)
    solved = np.linalg.solve(matrices, wanted[..., None])[..., 0]
    return np.where(weight > 0, (solved[:, 0] + solved[:, 2]) / 2, np.nan)
