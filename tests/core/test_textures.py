"""Texture coordinates over the dense mesh: exact at corners, seams kept, no area lost, for polygons of any size."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import curvify
from curvify.mesh import Marks, PolygonMesh
from curvify.prepare import prepare_mesh
from surfaces import dodecahedron, mixed_ball, prism, refined, truncated_icosahedron

LEVEL = 3
INNER = 2 * LEVEL - 1


def with_charts(mesh: PolygonMesh, cut: Callable[[int], int]) -> PolygonMesh:
    """The mesh mapped by a skew projection, faces shifted by their chart ``cut(face)``: seams between charts."""
    flat = mesh.positions @ np.array([[0.3, 0.1], [0.05, 0.4], [-0.2, 0.15]])
    shift = np.array([[3.0 * cut(face), 0.0] for face in range(mesh.face_count)])
    return mesh.with_(corner_uvs=flat[mesh.face_vertices] + shift[mesh.corner_faces])


def areas(uvs: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Signed areas of the polygons of these sizes whose corners follow each other."""
    starts = np.cumsum(sizes) - sizes
    result = []
    for start, size in zip(starts, sizes, strict=True):
        x, y = uvs[start : start + size].T
        result.append(0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    return np.array(result)


@pytest.mark.parametrize("make", [mixed_ball, dodecahedron, truncated_icosahedron, lambda: prism(9)])
@pytest.mark.parametrize("charts", [1, 3, 1000])
def test_the_area_of_every_face_and_the_uv_of_every_corner_survive(
    make: Callable[[], PolygonMesh], charts: int
) -> None:
    mesh = with_charts(make(), lambda face: face % charts)
    dense = refined(mesh, LEVEL)
    assert dense.uvs is not None
    assert dense.source_faces is not None
    assert mesh.corner_uvs is not None
    cells = areas(dense.uvs[dense.face_wedges].reshape(-1, 2), np.full(dense.face_count, 4))
    found = np.bincount(dense.source_faces, cells)
    assert np.abs(found - areas(mesh.corner_uvs, mesh.face_sizes)).max() < 1e-12
    at = dense.wedge_vertices
    there = {(int(v), *uv) for v, uv in zip(at, dense.uvs.round(12).tolist(), strict=True) if v < mesh.vertex_count}
    wanted = zip(mesh.face_vertices.tolist(), mesh.corner_uvs.round(12).tolist(), strict=True)
    assert all((v, *uv) in there for v, uv in wanted)


@pytest.mark.parametrize("creased", [False, True])
def test_a_seam_is_a_seam_at_every_point_and_nothing_else_is(creased: bool) -> None:
    mesh = with_charts(mixed_ball(), lambda face: face % 3)
    topology = prepare_mesh(mesh).topology
    if creased:  # seams and creases cross each other
        edges = topology.edges[::5]
        mesh = mesh.with_(marks=Marks(crease_edges=edges, crease_sharpness=np.ones((len(edges), 2))))
    dense = curvify.surface(mesh).refine(LEVEL)
    assert dense.uvs is not None
    moved = (dense.uvs[dense.vertex_count :] != dense.uvs[dense.repeats]).any(axis=1)
    on_seam = np.zeros(dense.vertex_count, dtype=bool)
    on_seam[dense.repeats[moved]] = True
    one = np.flatnonzero(topology.twin >= 0)
    faces = topology.faces
    seam = np.zeros(len(topology.edges), dtype=bool)
    seam[topology.edge[one]] = faces[one] % 3 != faces[topology.twin[one]] % 3
    assert 0 < seam.sum() < len(seam)
    points = on_seam[mesh.vertex_count : mesh.vertex_count + INNER * len(seam)].reshape(len(seam), INNER)
    assert np.array_equal(points, np.repeat(seam[:, None], INNER, axis=1))
    assert not on_seam[mesh.vertex_count + INNER * len(seam) :].any()
