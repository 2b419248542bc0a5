"""Meshes whose faces do not share vertices: stitched, welded or left apart."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import curvify
from curvify.mesh import PolygonMesh
from curvify.sinks import ArraySink
from surfaces import (
    CROSS_TANGENTS,
    check_sound,
    cube,
    icosahedron,
    match,
    mixed_ball,
    noisy,
    on_sphere,
    open_edges,
    refined,
    soup,
    torus,
    unit,
    vase,
    with_vertex_normals,
)

MESHES: dict[str, Callable[[], PolygonMesh]] = {
    "icosahedron": lambda: noisy(icosahedron(), 0.05),
    "mixed": lambda: noisy(mixed_ball(), 0.02),
    "torus": lambda: noisy(torus(7, 5), 0.03),
    "vase": lambda: noisy(vase(7), 0.02),
}


def with_own_normals(mesh: PolygonMesh) -> PolygonMesh:
    """The mesh with the normals that are computed for it as given ones."""
    return with_vertex_normals(mesh, refined(mesh, 1).normals[: mesh.vertex_count])


each_mesh = pytest.mark.parametrize("name", MESHES)


@each_mesh
@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize("weld", ["auto", "always"])
def test_a_soup_of_polygons_has_the_surface_of_the_mesh(name: str, given: bool, weld: str) -> None:
    mesh = MESHES[name]()
    if given:
        mesh = with_own_normals(mesh)
    level = 2
    whole = refined(mesh, level)
    parts = refined(soup(mesh), level, weld=weld)
    # a soup keeps all its vertices; the faces use one of each place
    used = np.unique(parts.faces)
    assert len(used) == whole.vertex_count
    place = match(parts.positions[used], whole.positions, 1e-12)
    assert np.abs(parts.normals[used] - whole.normals[place]).max() < 1e-12
    assert len(open_edges(parts.faces)) == len(open_edges(whole.faces))
    assert parts.face_count == whole.face_count


@each_mesh
def test_vertices_that_were_stitched_keep_their_ids_and_bits(name: str) -> None:
    mesh = soup(MESHES[name]())
    dense = refined(mesh, 2)
    assert np.array_equal(dense.positions[: mesh.vertex_count], mesh.positions)
    whole = refined(MESHES[name](), 2)
    normals = whole.normals[MESHES[name]().face_vertices]
    assert np.abs(dense.normals[: mesh.vertex_count] - normals).max() < 1e-12


@pytest.mark.parametrize("kind", CROSS_TANGENTS)
@each_mesh
def test_faces_left_apart_have_equal_bits_along_both_copies_of_an_edge(name: str, kind: str) -> None:
    mesh = with_own_normals(MESHES[name]())
    level, inner = 2, 3
    apart = refined(soup(mesh), level, weld="never", cross_tangent=kind)
    whole = refined(mesh, level, cross_tangent=kind)
    on_edges = mesh.corner_count * (inner + 1)
    edges = int(curvify.surface(mesh).patches.counts["edges"])
    assert len(open_edges(apart.faces)) == 2 * level * mesh.corner_count
    places = np.unique(apart.positions[:on_edges] + 0.0, axis=0)
    assert len(places) == mesh.vertex_count + inner * edges
    if name != "vase":  # a rim of the whole mesh has line tangents that lone faces cannot know
        match(apart.positions[on_edges:], whole.positions[mesh.vertex_count + inner * edges :], 1e-12)


def test_a_mesh_may_be_stitched_in_part() -> None:
    """Two halves of a cube that share no vertex close along their rims."""
    mesh = cube()
    upper = [f for f in mesh.faces() if any(mesh.positions[f, 2] > 0) and f != mesh.faces()[0]][:3]
    lower = [f for f in mesh.faces() if f not in upper]
    positions = np.concatenate([mesh.positions, mesh.positions])
    halves = PolygonMesh.from_faces(positions, upper + [[v + 8 for v in f] for f in lower])
    surface = curvify.surface(halves)
    assert surface.patches.counts["boundary_edges"] == 0
    assert surface.patches.counts["welded_vertices"] > 0
    check_sound(surface.refine(2), closed=True)


def test_positions_that_differ_in_the_last_bit_are_not_welded() -> None:
    mesh = soup(cube())
    mesh.positions[0] = np.nextafter(mesh.positions[0], 2)
    for weld in ("auto", "always"):
        counts = curvify.surface(mesh, weld=weld).patches.counts
        assert counts["boundary_edges"] > 0


def test_zero_and_minus_zero_are_one_place() -> None:
    mesh = PolygonMesh.from_faces(
        [[0, 0, 0.0], [1, 0, 0], [0, 1, 0], [-0.0, 1, 0], [1, 0, -0.0], [1, 1, 0]], [[0, 1, 2], [4, 5, 3]]
    )
    assert curvify.surface(mesh).patches.counts["boundary_edges"] == 4


def test_two_sheets_that_touch_along_an_edge_four_times_stay_apart() -> None:
    """Four open edges at one place: nobody can tell which belong together."""
    wings = [[0, 0, 1.0], [0, 0, -1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]
    positions = [[0.0, 0, 1], [0, 0, -1]] * 4 + wings[2:]
    faces = [[0, 1, 8], [3, 2, 9], [4, 5, 10], [7, 6, 11]]
    counts = curvify.surface(PolygonMesh.from_faces(positions, faces)).patches.counts
    assert counts["welded_vertices"] == 0
    assert counts["boundary_edges"] == 12


def test_faces_that_run_the_same_way_are_not_stitched() -> None:
    positions = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [1, 0, 0], [0, -1, 0]]
    counts = curvify.surface(PolygonMesh.from_faces(positions, [[0, 1, 2], [3, 4, 5]])).patches.counts
    assert counts["welded_vertices"] == 0


def test_colors_and_normals_of_a_soup_follow_its_corners() -> None:
    mesh = soup(on_sphere(cube()))
    colors = np.arange(3 * mesh.vertex_count, dtype=float).reshape(-1, 3)
    dense = refined(mesh.with_(vertex_colors=colors), 2)
    assert dense.colors is not None
    assert np.array_equal(dense.colors[: mesh.vertex_count], colors)
    assert np.abs(dense.normals[: mesh.vertex_count] - unit(mesh.positions)).max() < 1e-12


def test_colors_of_welded_copies_stay_with_their_faces() -> None:
    mesh = soup(cube())
    shades = np.arange(6, dtype=np.uint8) * 40
    colors = np.repeat(shades, 4)[:, None] * np.ones(3, dtype=np.uint8)
    dense = curvify.refine(mesh.with_(vertex_colors=colors), level=2)
    check_sound(dense, closed=True)
    surface = curvify.surface(mesh.with_(vertex_colors=colors))
    sink = ArraySink()
    surface.stream(sink, 2)
    assert dense.source_faces is not None
    shown = sink.records["color"][dense.face_wedges]
    assert (shown == shades[dense.source_faces][:, None, None]).all()


def test_an_edge_too_short_to_divide_by_is_a_point() -> None:
    points = [[0, 0, 0], [1e-200, 0, 0], [1, 1, 0], [0, 1, 0.2], [0.5, -1, 0]]
    dense = refined(PolygonMesh.from_faces(points, [[0, 1, 2, 3], [1, 0, 4]]), 1)
    assert np.isfinite(dense.positions).all()


def test_every_cell_knows_its_patch_and_where_it_lies_there() -> None:
    mesh = on_sphere(mixed_ball())
    surface = curvify.surface(mesh)
    dense = surface.refine(3)
    assert dense.source_patches is not None
    assert dense.source_parameters is not None
    middle, _ = surface.evaluate(dense.source_patches, dense.source_parameters)
    corners = dense.positions[dense.faces]
    reach = np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    assert (np.linalg.norm(middle - corners.mean(axis=1), axis=1) < 0.2 * reach).all()
