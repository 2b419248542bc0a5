"""Comparing meshes: every kind of difference is found and named, and distances are those of known surfaces."""

from __future__ import annotations

import numpy as np
import pytest

import curvify
from bodies import boxes
from curvify.compare import compare_meshes, compare_surfaces
from curvify.deviation import deviations, heat_map, surfaces_apart
from curvify.formats.dense import to_polygon_mesh
from curvify.mesh import PolygonMesh
from curvify.palette import VALUE_COLORS
from surfaces import icosahedron, torus, uv_sphere


@pytest.fixture
def rich():
    """A mesh with every attribute."""
    mesh = torus(6, 5)
    corners = np.arange(mesh.corner_count)
    return mesh.with_(
        corner_normals=mesh.positions[mesh.face_vertices],
        corner_uvs=np.stack([corners / 7 % 1, corners / 5 % 1], axis=1),
        vertex_colors=np.arange(3 * mesh.vertex_count).reshape(-1, 3).astype(np.uint8),
        face_materials=np.arange(mesh.face_count) % 2,
        material_names=("stone", "wood"),
    )


def answers(a, b, *tolerances):
    return {finding.name: finding for finding in compare_meshes(a, b, *tolerances)}


def test_a_mesh_equals_itself(rich):
    found = answers(rich, rich)
    assert set(found) == {"topology", "positions", "normals", "texture coordinates", "colors", "materials"}
    assert all(finding.passed for finding in found.values())


def test_the_worst_vertex_is_named(rich):
    moved = rich.positions.copy()
    moved[3] += [0, 0, 1e-3]
    moved[7] += [0, 2e-3, 0]
    other = rich.with_(positions=moved)
    finding = answers(rich, other)["positions"]
    assert not finding.passed
    assert finding.where == (7, 3)
    assert finding.measured == pytest.approx(2e-3)
    assert "vertex 7" in finding.reason
    assert not answers(rich, other, 1.5e-3)["positions"].passed
    assert answers(rich, other, 1.5e-3)["positions"].where == (7,)
    assert answers(rich, other, 2.1e-3)["positions"].passed


def test_one_unit_in_the_last_place_is_a_difference_without_a_tolerance(rich):
    moved = rich.positions.copy()
    moved[4, 1] = np.nextafter(moved[4, 1], 9)
    assert answers(rich, rich.with_(positions=moved))["positions"].where == (4,)
    assert answers(rich, rich.with_(positions=moved), 1e-12)["positions"].passed


def test_every_attribute_is_compared(rich):
    normals, uvs, colors = rich.corner_normals.copy(), rich.corner_uvs.copy(), rich.vertex_colors.copy()
    normals[2] += 0.1
    uvs[5] += 0.01
    colors[6] += 1
    changes = {
        "normals": {"corner_normals": normals},
        "texture coordinates": {"corner_uvs": uvs},
        "colors": {"vertex_colors": colors},
        "materials": {"material_names": ("stone", "steel")},
    }
    for name, change in changes.items():
        found = answers(rich, rich.with_(**change))
        assert [n for n, finding in found.items() if not finding.passed] == [name]
    assert answers(rich, rich.with_(corner_normals=None))["normals"].reason == "only A has them"
    assert answers(rich, rich.with_(vertex_colors=colors), 1e-6)["colors"].passed
    assert answers(rich, rich.with_(corner_normals=normals), 1e-6, 20)["normals"].passed
    assert not answers(rich, rich.with_(corner_normals=normals), 1e-6)["normals"].passed


def test_a_normal_that_is_missing_is_a_difference(rich):
    normals = rich.corner_normals.copy()
    normals[2] = np.nan
    missing = rich.with_(corner_normals=normals)
    assert not answers(rich, missing, 1.0, 180)["normals"].passed
    assert answers(missing, missing)["normals"].passed


def test_other_topology_ends_the_comparison(rich):
    (finding,) = compare_meshes(rich, icosahedron())
    assert (finding.name, finding.passed) == ("topology", False)
    faces = rich.faces()
    faces[4] = faces[4][1:] + faces[4][:1]
    (finding,) = compare_meshes(rich, PolygonMesh.from_faces(rich.positions, faces))
    assert finding.where == (4,)


def test_distances_between_spheres():
    def sphere(radius):
        dense = to_polygon_mesh(curvify.refine(uv_sphere(), level=4))
        scale = radius / np.linalg.norm(dense.positions, axis=1, keepdims=True)
        return dense.with_(positions=dense.positions * scale)

    apart = surfaces_apart(sphere(1.0), sphere(1.1), samples=20_000)
    assert apart.hausdorff == pytest.approx(0.1, rel=0.02)
    assert apart.share == pytest.approx(0.1 / np.sqrt(12), rel=0.02)  # the first has a diagonal of 2 sqrt(3)
    assert apart.rms == pytest.approx(0.1, rel=0.02)
    assert apart.mean == pytest.approx(0.1, rel=0.02)
    assert apart.normal_most < 1
    assert apart == surfaces_apart(sphere(1.0), sphere(1.1), samples=20_000)


def test_the_distance_counts_both_ways():
    one, two = boxes((0, 0, 0)), boxes((0, 0, 0), (3, 0, 0))
    for a, b in ((one, two), (two, one)):
        apart = surfaces_apart(a, b, samples=5000)
        assert apart.hausdorff == pytest.approx(3)
        assert apart.at[0] == pytest.approx(4)


def test_other_faces_on_the_same_surface_are_no_distance():
    quads = boxes((0, 0, 0))
    triangles = PolygonMesh.from_faces(
        quads.positions, [part for a, b, c, d in quads.faces() for part in ([a, b, d], [b, c, d])]
    )
    apart = surfaces_apart(quads, triangles, samples=5000)
    assert apart.hausdorff < 1e-12
    assert apart.normal_most < 1e-6
    findings, _ = compare_surfaces(quads, triangles, 1e-9, 0.1, 5000)
    assert [finding.passed for finding in findings] == [True, True]
    assert compare_surfaces(quads, triangles, None)[0] == []


def test_a_tolerance_decides_about_surfaces():
    moved = boxes((0.01, 0, 0))
    assert not compare_surfaces(boxes((0, 0, 0)), moved, 0.009)[0][0].passed
    assert compare_surfaces(boxes((0, 0, 0)), moved, 0.011)[0][0].passed


def test_no_surface_no_distance():
    flat = PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    with pytest.raises(curvify.MeshError, match="no face with an area"):
        surfaces_apart(flat, boxes((0, 0, 0)))


def test_deviations_of_vertices():
    mesh = boxes((0, 0, 0))
    shifted = mesh.with_(positions=mesh.positions + np.array([0.5, 0, 0]))
    np.testing.assert_allclose(deviations(shifted, mesh), 0.5)  # from the same vertex
    inside = deviations(shifted, mesh, surface=True)  # from the nearest place
    np.testing.assert_allclose(np.sort(inside), [0, 0, 0, 0, 0.5, 0.5, 0.5, 0.5], atol=1e-12)


def test_a_heat_map_goes_from_the_first_color_to_the_last():
    mesh = boxes((0, 0, 0))
    colors = heat_map(mesh, np.arange(8.0), 7.0).vertex_colors
    first, last = (list(bytes.fromhex(color[1:])) for color in (VALUE_COLORS[0], VALUE_COLORS[-1]))
    assert colors[0].tolist() == first
    assert colors[-1].tolist() == last
    assert heat_map(mesh, np.zeros(8), 0.0).vertex_colors.tolist() == [first] * 8
    light = colors @ np.array([0.2126, 0.7152, 0.0722])
    assert (np.diff(light) > 0).all()
