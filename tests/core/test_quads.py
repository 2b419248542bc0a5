"""Polygons become quads by arcs: the values of the reference, spheres and planes exactly."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import curvify
from curvify.mesh import Marks, PolygonMesh
from curvify.normals import unit
from curvify.options import MeshOptions
from curvify.prepare import prepare_mesh
from curvify.schemes import blend
from curvify.schemes.blend_lines import line_tangents
from curvify.schemes.quads import edge_middles, face_centers
from surfaces import dodecahedron, flat_grid, icosahedron, tetrahedron, truncated_icosahedron

Array = npt.NDArray[np.float64]
REFERENCE = json.loads((Path(__file__).parents[1] / "data" / "blending.json").read_text())["quadify_cases"]


def quads_of(mesh: PolygonMesh, **options: Any) -> Any:
    """The quads that the surface of a mesh is built on."""
    return blend.build_surface(prepare_mesh(mesh, MeshOptions()), blend.Options(**options)).network.quads


def creased(mesh: PolygonMesh, edges: list[list[int]]) -> PolygonMesh:
    """The mesh with some edges sharp."""
    return mesh.with_(marks=Marks(crease_edges=np.array(edges), crease_sharpness=np.ones((len(edges), 2))))


def max_normals(positions: Array, topology: Any, sectors: npt.NDArray[np.int64]) -> Array:
    """Normals that the reference uses: Max's weights (1999)."""
    points = positions[topology.vertices]
    a, b = points[topology.next] - points, points[topology.prev] - points
    crosses = np.cross(a, b) / ((a**2).sum(1) * (b**2).sum(1))[:, None]
    total = np.zeros_like(crosses)
    np.add.at(total, sectors, crosses)
    return unit(total)[sectors]


@pytest.mark.parametrize("case", REFERENCE, ids=lambda case: case["name"])
def test_the_quads_of_the_reference(case: dict[str, Any]) -> None:
    mesh = PolygonMesh.from_faces(case["vertices"], case["faces"])
    if case["sharp_edges"]:
        mesh = creased(mesh, case["sharp_edges"])
    coarse = prepare_mesh(mesh, MeshOptions())
    topology = coarse.topology
    normals = max_normals(coarse.positions, topology, coarse.sectors)
    work = blend.build_surface(coarse, blend.Options(boundary_corners="smooth"))  # the reference rounds all of them
    feature = ~topology.interior | (coarse.marks.crease > 0).all(axis=1)
    tangents = line_tangents(topology, coarse.positions, work.lines.partner)
    middles = edge_middles(coarse.positions, topology, normals, tangents, feature)
    centers = face_centers(coarse.positions, topology, normals)
    faces = work.network.quads.topology.vertices.reshape(-1, 4)
    made = np.concatenate([coarse.positions, middles, centers])[faces]
    np.testing.assert_allclose(made, np.array(case["quad_vertices"])[case["quad_faces"]], atol=1e-12)


@pytest.mark.parametrize("mesh", [tetrahedron(), icosahedron(), dodecahedron()], ids=["4", "20", "12"])
def test_new_vertices_of_regular_polygons_lie_on_their_sphere(mesh: PolygonMesh) -> None:
    np.testing.assert_allclose(np.linalg.norm(quads_of(mesh).positions, axis=1), 1.0, atol=1e-12)


def test_new_vertices_of_two_kinds_of_polygons_lie_close_to_their_sphere() -> None:
    radius = np.linalg.norm(quads_of(truncated_icosahedron()).positions, axis=1)
    assert np.abs(radius - 1).max() < 5e-3


def test_planes_stay_planes() -> None:
    assert np.abs(quads_of(flat_grid(3, 2, triangles=True)).positions[:, 2]).max() == 0


def test_a_long_offset_is_cut() -> None:
    """Two triangles folded onto each other: the arcs would swing far out."""
    mesh = PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, 1, 0.001]], [[0, 1, 2], [1, 0, 3]])
    positions = quads_of(mesh, boundary_corners="smooth").positions
    assert np.isfinite(positions).all()
    assert np.abs(positions).max() < 2


def test_the_old_vertices_come_first_and_stay() -> None:
    mesh = truncated_icosahedron()
    np.testing.assert_array_equal(quads_of(mesh).positions[: mesh.vertex_count], mesh.positions)


def test_quads_alone_stay_as_they_are() -> None:
    mesh = flat_grid(3, 2)
    quads = quads_of(mesh)
    assert len(quads.positions) == mesh.vertex_count
    assert quads.extent == 0.5


def test_concave_polygons_are_split_first() -> None:
    hexagon = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]]  # the mean of the corners is a corner
    mesh = PolygonMesh.from_faces(hexagon, [[0, 1, 2, 3, 4, 5]])
    surface = curvify.surface(mesh, "blend")
    assert surface.warnings == ["1 concave face split into convex pieces, first: 0"]
    dense = surface.refine(3)
    area = np.cross(
        dense.positions[dense.faces[:, 2]] - dense.positions[dense.faces[:, 0]],
        dense.positions[dense.faces[:, 3]] - dense.positions[dense.faces[:, 1]],
    )
    assert (area[:, 2] > 0).all()
    assert abs(area[:, 2].sum() / 2 - 3) < 1e-9
