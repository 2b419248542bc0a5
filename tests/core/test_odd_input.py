"""Input that no modeller should write and every tool meets: an answer or a plain error, never nonsense."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import curvify
from curvify.mesh import PolygonMesh
from surfaces import (
    CROSS_TANGENTS,
    check_sound,
    cube,
    degrees,
    flat_grid,
    icosahedron,
    l_prism,
    mixed_ball,
    noisy,
    octahedron,
    open_edges,
    prism,
    refined,
    soup,
    torus,
    unit,
    with_vertex_normals,
)

each_tangent = pytest.mark.parametrize("kind", CROSS_TANGENTS)


def warned(surface: curvify.Surface, words: str) -> bool:
    return any(words in text for text in surface.warnings)


# --- nothing to refine --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("positions", "faces", "words"),
    [
        ([], [], "nothing in it"),
        ([[0, 0, 0], [1, 0, 0]], [], "only 2 points"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1], [1, 2]], "fewer than 3"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 1], [2, 2, 2]], "fewer than 3"),
        ([[1, 1, 1]] * 3, [[0, 1, 2]], "fewer than 3"),
    ],
)
def test_a_mesh_without_faces_is_an_error(positions: list[list[float]], faces: list[list[int]], words: str) -> None:
    with pytest.raises(curvify.MeshError, match=words):
        curvify.surface(PolygonMesh.from_faces(positions, faces))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_coordinates_that_are_no_numbers_are_an_error(value: float) -> None:
    mesh = cube()
    mesh.positions[5, 1] = value
    with pytest.raises(curvify.MeshError, match="vertex 5 has a coordinate"):
        curvify.surface(mesh)


@pytest.mark.parametrize("index", [-1, 8])
def test_indices_out_of_range_are_an_error(index: int) -> None:
    mesh = cube()
    mesh.face_vertices[3] = index
    with pytest.raises(curvify.MeshError, match=f"vertex {index}"):
        curvify.surface(mesh)


@pytest.mark.parametrize("scale", [1e70, 1e-70])
def test_meshes_too_large_or_too_small_to_compute_with_are_an_error(scale: float) -> None:
    mesh = cube()
    with pytest.raises(curvify.MeshError, match="scale"):
        curvify.surface(mesh.with_(positions=scale * mesh.positions))


@each_tangent
@pytest.mark.parametrize("scale", [1e-29, 1e20, 9e29])
def test_sizes_near_the_limits_still_work(scale: float, kind: str) -> None:
    mesh = noisy(mixed_ball(), 0.02)
    dense = refined(mesh.with_(positions=scale * mesh.positions), 2, cross_tangent=kind)
    plain = refined(mesh, 2, cross_tangent=kind)
    check_sound(dense, closed=True)
    assert np.abs(dense.positions / scale - plain.positions).max() < 1e-12


def test_a_mesh_far_from_the_origin_keeps_its_shape() -> None:
    mesh = noisy(mixed_ball(), 0.02)
    shift = np.array([1e6, -2e6, 3e6])
    far, near = refined(mesh.with_(positions=mesh.positions + shift), 3), refined(mesh, 3)
    assert np.abs(far.positions - shift - near.positions).max() < 1e-8
    assert degrees(far.normals, near.normals).max() < 1e-5


# --- vertices -----------------------------------------------------------------------------------------------------


def test_vertices_in_no_face_are_kept_without_a_normal_and_counted() -> None:
    mesh = cube()
    positions = np.concatenate([[[9.0, 9, 9]], mesh.positions, [[8.0, 8, 8]]])
    surface = curvify.surface(mesh.with_(positions=positions, face_vertices=mesh.face_vertices + 1))
    dense = surface.refine(2)
    assert surface.patches.counts["unreferenced_vertices"] == 2
    assert np.array_equal(dense.positions[:10], positions)
    assert not dense.normals[[0, 9]].any()
    plain = refined(mesh, 2)
    assert np.abs(dense.positions[10:] - plain.positions[8:]).max() < 1e-15
    check_sound(dense, closed=True)


def test_repeated_corners_are_dropped() -> None:
    mesh = cube()
    faces = mesh.faces()
    doubled = [[v for v in f for _ in range(2)] if i % 2 else [*f, f[0]] for i, f in enumerate(faces)]
    dense = refined(PolygonMesh.from_faces(mesh.positions, doubled), 2)
    plain = refined(mesh, 2)
    assert np.array_equal(dense.positions, plain.positions)
    assert np.array_equal(dense.faces, plain.faces)


def test_faces_with_two_corners_are_dropped_with_a_warning() -> None:
    mesh = cube()
    faces = [[0, 1], *mesh.faces(), [3, 3, 5]]
    surface = curvify.surface(PolygonMesh.from_faces(mesh.positions, faces))
    assert warned(surface, "2 faces with fewer than 3 distinct corners dropped, first: 0")
    dense = surface.refine(2)
    assert dense.source_faces is not None
    assert np.unique(dense.source_faces).tolist() == [1, 2, 3, 4, 5, 6]
    check_sound(dense, closed=True)


@pytest.mark.parametrize("weld", ["auto", "always", "never"])
def test_an_edge_without_length_joins_its_ends(weld: str) -> None:
    mesh = cube()
    faces = mesh.faces()
    # vertex 8 lies on vertex 0 and stands between it and the next corner of the first face
    first = [v for w in faces[0] for v in ([0, 8] if w == 0 else [w])]
    doubled = PolygonMesh.from_faces([*mesh.positions, mesh.positions[0]], [first, *faces[1:]])
    surface = curvify.surface(doubled, weld=weld)
    dense = surface.refine(2)
    check_sound(dense, closed=True)
    assert np.abs(dense.positions[9:] - refined(mesh, 2).positions[8:]).max() < 1e-15
    assert np.array_equal(dense.positions[8], mesh.positions[0])


def test_a_vertex_on_the_middle_of_an_edge_is_a_corner_of_180_degrees() -> None:
    """A T-junction on one side only: the long edge and the two short ones stay open to each other."""
    points = [[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [1, 0, 0], [0, -1, 0], [2, -1, 0]]
    mesh = PolygonMesh.from_faces(points, [[0, 4, 1, 2, 3], [5, 6, 1, 0]])
    dense = refined(mesh, 3)
    check_sound(dense)
    assert np.abs(dense.positions[:, 2]).max() < 1e-15


# --- faces --------------------------------------------------------------------------------------------------------


@each_tangent
def test_a_face_without_area_is_refined_flat_with_a_warning(kind: str) -> None:
    points = [[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [2, 1, 0]]
    surface = curvify.surface(PolygonMesh.from_faces(points, [[0, 1, 2], [0, 2, 4, 3]]), cross_tangent=kind)
    assert warned(surface, "1 face without area, first: 0; the surface there only follows its edges")
    dense = surface.refine(3)
    assert np.isfinite(dense.normals).all()
    assert np.abs(dense.positions[:, 2]).max() < 1e-14
    assert dense.positions[:, 0].min() > -1e-12
    assert dense.positions[:, 0].max() < 2 + 1e-12


@each_tangent
def test_a_mesh_of_nothing_but_faces_without_area_stays_finite(kind: str) -> None:
    dense = refined(sliver(), 2, cross_tangent=kind)
    assert np.isfinite(dense.positions).all()
    assert np.isfinite(dense.normals).all()


def test_faces_without_area_have_unit_normals() -> None:
    check_sound(refined(sliver(), 2))


def test_a_face_with_a_spike_has_unit_normals() -> None:
    """A triangle and a spike that leaves it from a corner and comes back."""
    points = [[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]]
    check_sound(refined(PolygonMesh.from_faces(points, [[0, 1, 2, 0, 3]]), 2))


def sliver() -> PolygonMesh:
    """Two triangles on one line."""
    return PolygonMesh.from_faces([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], [[0, 1, 2], [1, 2, 3]])


@pytest.mark.parametrize("count", [3, 4, 5])
@each_tangent
def test_several_faces_on_an_edge_share_one_curve(kind: str, count: int) -> None:
    angle = np.linspace(0, 4.5, count)
    points = [[0, 0, 0.0], [0, 0, 1], *[[np.cos(a), np.sin(a), 0.4] for a in angle]]
    mesh = PolygonMesh.from_faces(points, [[0, 1, 2 + i] if i % 2 else [1, 0, 2 + i] for i in range(count)])
    surface = curvify.surface(mesh, cross_tangent=kind)
    assert warned(surface, "1 edge with more than two faces")
    assert warned(surface, "first: 0-1")
    dense = surface.refine(3)
    check_sound(dense)
    shared = [tuple(e) for e in np.sort(dense.faces[:, [0, 1, 1, 2, 2, 3, 3, 0]].reshape(-1, 2), axis=1).tolist()]
    assert sorted(shared.count(e) for e in set(shared))[-6:] == [count] * 6


@each_tangent
def test_fans_that_meet_in_a_vertex_only_are_kept_apart(kind: str) -> None:
    one = octahedron()
    other = one.positions + np.array([2.0, 0, 0])
    positions = np.concatenate([one.positions, other])
    faces = one.faces() + [[v + 6 for v in f] for f in one.faces()]
    faces = [[0 if v == 9 else v for v in f] for f in faces]
    surface = curvify.surface(PolygonMesh.from_faces(positions, faces), cross_tangent=kind)
    assert surface.patches.counts["vertices_with_several_fans"] == 1
    dense = surface.refine(2)
    check_sound(dense, closed=True)
    wedges = np.unique(dense.face_wedges[dense.faces == 0])
    assert len(wedges) == 2
    assert np.abs(np.sort(dense.normals[wedges][:, 0]) - [-1, 1]).max() < 1e-12


@each_tangent
def test_a_moebius_strip_is_refined(kind: str) -> None:
    count = 12
    points = []
    for i in range(count):
        a = 2 * np.pi * i / count
        for s in (-0.3, 0.3):
            r = 1 + s * np.cos(a / 2)
            points.append([r * np.cos(a), r * np.sin(a), s * np.sin(a / 2)])
    faces = [[2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2] for i in range(count - 1)]
    faces.append([2 * count - 2, 2 * count - 1, 0, 1])
    surface = curvify.surface(PolygonMesh.from_faces(points, faces), cross_tangent=kind)
    assert warned(surface, "faces that run the same way")
    dense = surface.refine(2)
    check_sound(dense)
    spans = np.linalg.norm(dense.positions[dense.faces] - dense.positions[dense.faces[:, :1]], axis=2)
    assert spans.max() < 0.5


def test_a_closed_mesh_that_is_inside_out_is_refined_with_a_warning() -> None:
    mesh = cube()
    turned = PolygonMesh.from_faces(mesh.positions, [f[::-1] for f in mesh.faces()])
    surface = curvify.surface(turned)
    assert warned(surface, "inside out")
    assert not warned(curvify.surface(mesh), "inside out")
    assert np.abs(surface.refine(1).normals[:8] + unit(mesh.positions)).max() < 1e-12


def test_a_face_that_visits_a_vertex_twice_is_cut() -> None:
    """A square with a square hole, joined by a slit."""
    outer, inner = [[0, 0], [3, 0], [3, 3], [0, 3]], [[1, 1], [1, 2], [2, 2], [2, 1]]
    mesh = PolygonMesh.from_faces([[x, y, 0] for x, y in outer + inner], [[0, 1, 2, 3, 0, 4, 5, 6, 7, 4]])
    surface = curvify.surface(mesh)
    assert warned(surface, "visits a vertex twice")
    dense = surface.refine(3)
    check_sound(dense)
    p = dense.positions[dense.faces]
    area = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])[:, 2].sum() / 2
    assert area == pytest.approx(8, rel=1e-12)


@pytest.mark.parametrize("weld", ["auto", "always", "never"])
def test_a_face_that_touches_itself_in_a_point_is_finite(weld: str) -> None:
    """Corners 0 and 3 are two vertices at one place."""
    points = [[0, 0, 0], [1, -1, 0], [1, 1, 0], [0, 0, 0], [-1, 1, 0], [-1, -1, 0]]
    check_sound(refined(PolygonMesh.from_faces(points, [list(range(6))]), 2, weld=weld))


@each_tangent
@pytest.mark.parametrize("sides", [200, 1000])
def test_caps_of_many_sides_are_planar(sides: int, kind: str) -> None:
    mesh = prism(sides, radius=2.0)
    normals = mesh.positions[mesh.face_vertices] * [0.5, 0.5, 0]
    normals[-2 * sides : -sides] = [0, 0, -1]
    normals[-sides:] = [0, 0, 1]
    surface = curvify.surface(mesh.with_(corner_normals=normals), cross_tangent=kind, sharp_from="normals")
    assert warned(surface, "2 faces with more than 64 sides split")
    dense = surface.refine(1)
    check_sound(dense, closed=True)
    assert dense.source_faces is not None
    for face, height in ((sides, 0.0), (sides + 1, 1.0)):
        assert np.abs(dense.positions[dense.faces[dense.source_faces == face], 2] - height).max() < 1e-13
    assert np.hypot(*dense.positions[:, :2].T).max() < 2.001


def test_split_normals_of_a_fine_cylinder_keep_its_rims_sharp() -> None:
    mesh = prism(1000)
    normals = mesh.positions[mesh.face_vertices] * [1, 1, 0]
    normals[-2000:-1000] = [0, 0, -1]
    normals[-1000:] = [0, 0, 1]
    assert len(refined(mesh.with_(corner_normals=normals), 1).repeats)


@pytest.mark.parametrize("sides", [64, 65, 200])
def test_prisms_of_many_sides_without_normals_are_closed_and_finite(sides: int) -> None:
    check_sound(refined(prism(sides), 2), closed=True)


@pytest.mark.parametrize("sides", [16, 64, 65, 70, 100, 200])
def test_the_cap_of_a_round_prism_rises_alike_for_every_number_of_sides(sides: int) -> None:
    assert refined(prism(sides), 2).positions[:, 2].max() == pytest.approx(1.43, abs=0.1)


@each_tangent
def test_a_concave_solid_is_refined_closed(kind: str) -> None:
    surface = curvify.surface(l_prism(), cross_tangent=kind)
    assert warned(surface, "2 concave faces split into convex pieces")
    check_sound(surface.refine(3), closed=True)


def test_flat_concave_faces_stay_planar() -> None:
    mesh = l_prism()
    sizes = mesh.face_sizes
    p = [mesh.positions[f] for f in mesh.faces()]
    normals = unit([np.cross(f - f.mean(axis=0), np.roll(f, -1, axis=0) - f.mean(axis=0)).sum(axis=0) for f in p])
    dense = refined(mesh.with_(corner_normals=np.repeat(normals, sizes, axis=0)), 3, sharp_from="normals")
    assert dense.source_faces is not None
    start = np.array([f[0] for f in p])[dense.source_faces]
    off = ((dense.positions[dense.faces] - start[:, None]) * normals[dense.source_faces][:, None]).sum(axis=2)
    assert np.abs(off).max() < 1e-14
    check_sound(dense, closed=True)


# --- normals ------------------------------------------------------------------------------------------------------


@each_tangent
def test_opposite_normals_at_the_ends_of_an_edge_give_a_finite_surface(kind: str) -> None:
    mesh = flat_grid(2, 2)
    normals = np.tile([0.0, 0, 1], (9, 1))
    normals[4] = [0, 0, -1]
    dense = refined(with_vertex_normals(mesh, normals), 3, sharp_from="normals", cross_tangent=kind)
    check_sound(dense)


@each_tangent
def test_normals_along_an_edge_give_a_finite_surface(kind: str) -> None:
    mesh = flat_grid(2, 2)
    normals = np.tile([0.0, 0, 1], (9, 1))
    normals[4] = [1.0, 0, 0]
    dense = refined(with_vertex_normals(mesh, normals), 3, sharp_from="normals", cross_tangent=kind)
    check_sound(dense)
    lone = curvify.PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    for normal in ([1.0, 0, 0], [0.0, -1, 0], [1.0, 1, 0], [0, 0, -1.0]):
        tipped = with_vertex_normals(lone, np.tile(normal, (3, 1)))
        check_sound(refined(tipped, 2, sharp_from="normals", cross_tangent=kind))


BASES = {
    "icosahedron": icosahedron,
    "cube": cube,
    "mixed": mixed_ball,
    "torus": lambda: torus(5, 4),
    "concave": l_prism,
}


@settings(max_examples=30)
@given(
    name=st.sampled_from(sorted(BASES)),
    kind=st.sampled_from(CROSS_TANGENTS),
    seed=st.integers(0, 2**32 - 1),
    shake=st.sampled_from([0.0, 0.1, 0.5]),
    per_corner=st.booleans(),
)
def test_any_given_normals_give_a_finite_closed_surface(
    name: str, kind: str, seed: int, shake: float, per_corner: bool
) -> None:
    generator = np.random.default_rng(seed)
    mesh = noisy(BASES[name](), shake, seed)
    count = mesh.corner_count if per_corner else mesh.vertex_count
    normals = unit(generator.standard_normal((count, 3)))
    if not per_corner:
        normals = normals[mesh.face_vertices]
    mesh = mesh.with_(corner_normals=normals)
    check_sound(refined(mesh, 2, sharp_from="normals", cross_tangent=kind), closed=True)


@settings(max_examples=30)
@given(
    name=st.sampled_from(sorted(BASES)),
    kind=st.sampled_from(CROSS_TANGENTS),
    seed=st.integers(0, 2**32 - 1),
    shake=st.sampled_from([0.2, 0.5, 2.0]),
)
def test_any_positions_give_a_finite_closed_surface(name: str, kind: str, seed: int, shake: float) -> None:
    check_sound(refined(noisy(BASES[name](), shake, seed), 2, cross_tangent=kind), closed=True)


@settings(max_examples=60)
@given(
    points=st.lists(st.tuples(*[st.integers(-1, 1)] * 3), min_size=3, max_size=8),
    loops=st.lists(st.lists(st.integers(0, 7), min_size=1, max_size=6), min_size=1, max_size=6),
    weld=st.sampled_from(["auto", "always", "never"]),
    kind=st.sampled_from(CROSS_TANGENTS),
)
def test_any_polygons_on_a_tiny_lattice_are_refined_or_refused(
    points: list[tuple[int, int, int]], loops: list[list[int]], weld: str, kind: str
) -> None:
    """Coincident points, repeated faces, slits, spikes, folded and flat faces, everything at once."""
    faces = [[v % len(points) for v in loop] for loop in loops]
    mesh = PolygonMesh.from_faces(points, faces)
    try:
        surface = curvify.surface(mesh, weld=weld, cross_tangent=kind)
    except curvify.MeshError:
        return
    dense = surface.refine(2)
    assert np.isfinite(dense.positions).all()
    assert np.array_equal(dense.wedge_vertices[dense.face_wedges], dense.faces)
    length = np.linalg.norm(dense.normals, axis=1)
    assert np.minimum(length, np.abs(length - 1)).max() < 1e-14
    assert np.abs(dense.positions).max() < 1e3
    assert dense.face_count == surface.face_count(2)


def test_a_soup_of_concave_faces_closes() -> None:
    dense = refined(soup(l_prism()), 2)
    assert not open_edges(dense.faces)
