"""Lighter stand-ins for very large inputs: quadric decimation (Garland & Heckbert 1997), checked.

Decimation may tear or close a mesh; what comes back counts only if it has the topology of what went in.
"""

from __future__ import annotations

import numpy as np

from curvify.mesh import PolygonMesh
from curvify.normals import sum_by, unit
from curvify.simplify.triangles import Triangles, face_components, prepare_triangles
from curvify.words import count_of

#: Meshes up to this many triangles are taken as they are, and larger ones reduced to it.
LARGE = 120_000
#: Triangles to leave for each polygon wanted.
PER_POLYGON = 40


def lightened(dense: Triangles, wanted: int, notes: list[str]) -> Triangles:
    """The mesh, or a decimated one where it is very large for ``wanted`` polygons.

    A decimated face takes the mean normal of the faces it stands for. What was done is added to ``notes``.
    """
    target = max(LARGE, PER_POLYGON * wanted)
    if dense.face_count <= 2 * target:
        return dense
    for count in (target, 2 * target):
        light = _decimated(dense, count)
        if _same_topology(light, dense):
            _take_normals(light, dense)
            notes.append(
                f"{count_of(dense.face_count, 'triangle')} decimated to {light.face_count:,} first; "
                "vertices are near those of the input, not among them"
            )
            return light
    return dense


def _decimated(dense: Triangles, count: int) -> Triangles:
    import fast_simplification

    middle, size = dense.positions.mean(axis=0), max(dense.diagonal, 1e-300)
    points, faces = fast_simplification.simplify(
        ((dense.positions - middle) / size).astype(np.float32),
        dense.vertices.astype(np.int32),
        target_count=count,
    )
    positions = points.astype(np.float64) * size + middle
    mesh = PolygonMesh(positions, 3 * np.arange(len(faces) + 1), faces.reshape(-1).astype(np.int64))
    return prepare_triangles(mesh, "never")[0]


def _same_topology(light: Triangles, dense: Triangles) -> bool:
    same = light.euler_number == dense.euler_number and light.is_closed == dense.is_closed
    return same and int(face_components(light).max()) == int(face_components(dense).max())


def _take_normals(light: Triangles, dense: Triangles) -> None:
    """Give each face the mean normal of the original faces that are nearest to it."""
    from scipy.spatial import cKDTree

    nearest = cKDTree(light.centroids).query(dense.centroids)[1]
    mean = unit(sum_by(nearest, dense.normals * dense.areas[:, None], light.face_count))
    known = mean.any(axis=1)
    light.normals[known] = mean[known]
