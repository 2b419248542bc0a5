"""The contract of the dense mesh: numbering, interpolation, watertightness by index, counts, carried values."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

import curvify
from curvify.mesh import DenseMesh, PolygonMesh
from curvify.polygons import newell_normals
from surfaces import (
    check_sound,
    cube,
    cylinder,
    degrees,
    directed_edges,
    dodecahedron,
    domain_polygon,
    flat_grid,
    icosahedron,
    l_prism,
    mixed_ball,
    noisy,
    on_sphere,
    open_edges,
    refined,
    torus,
    unit,
    vase,
)

CLOSED: dict[str, Callable[[], PolygonMesh]] = {
    "icosahedron": icosahedron,
    "cube": cube,
    "dodecahedron": dodecahedron,
    "mixed": lambda: noisy(mixed_ball(), 0.02),
    "torus": lambda: torus(9, 6),
    "concave": l_prism,
}
OPEN: dict[str, Callable[[], PolygonMesh]] = {
    "vase": vase,
    "grid": lambda: flat_grid(3, 2),
    "cylinder": lambda: cylinder(5, 2, triangles=True),
}
each_closed = pytest.mark.parametrize("name", CLOSED)


def mesh_edges(mesh: PolygonMesh) -> list[tuple[int, int]]:
    """Undirected edges in the order that the contract gives them."""
    return sorted({(min(a, b), max(a, b)) for f in mesh.faces() for a, b in zip(f, f[1:] + f[:1], strict=True)})


# --- interpolation and watertightness -----------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", [*CLOSED, *OPEN])
def test_input_vertices_come_first_with_the_bits_they_had(name: str, dtype: type) -> None:
    mesh = {**CLOSED, **OPEN}[name]()
    dense = refined(mesh, level=2, dtype=dtype)
    assert dense.positions.dtype == dense.normals.dtype == dtype
    assert np.array_equal(dense.positions[: mesh.vertex_count], mesh.positions.astype(dtype))


def test_given_vertex_normals_are_interpolated() -> None:
    mesh = on_sphere(noisy(mixed_ball(), 0.02))
    dense = refined(mesh, level=1)
    assert np.abs(dense.normals[: mesh.vertex_count] - unit(mesh.positions)).max() < 1e-12


def test_given_normals_need_not_have_unit_length() -> None:
    mesh = on_sphere(cube())
    scaled = mesh.with_(corner_normals=mesh.corner_normals * np.geomspace(1e-30, 1e30, 24)[:, None])
    assert np.abs(refined(scaled, level=2).normals - refined(mesh, level=2).normals).max() < 1e-13


@each_closed
def test_closed_meshes_stay_closed_by_index(name: str) -> None:
    dense = refined(CLOSED[name](), level=3)
    check_sound(dense, closed=True)


@pytest.mark.parametrize("name", OPEN)
def test_open_meshes_are_open_along_their_rims_only(name: str) -> None:
    mesh = OPEN[name]()
    level = 3
    dense = refined(mesh, level=level)
    check_sound(dense)
    flat = [(a, b) for f in mesh.faces() for a, b in zip(f, f[1:] + f[:1], strict=True)]
    rim = [e for e in flat if e[::-1] not in flat]
    assert len(open_edges(dense.faces)) == 2 * level * len(rim)


@each_closed
def test_no_two_vertices_of_a_dense_mesh_are_one_point(name: str) -> None:
    dense = refined(CLOSED[name](), level=3)
    assert len(np.unique(dense.positions, axis=0)) == dense.vertex_count


# --- numbering ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("level", range(1, 6))
@pytest.mark.parametrize("name", ["mixed", "cube", "torus", "icosahedron"])
def test_counts_follow_from_the_coarse_mesh(name: str, level: int) -> None:
    mesh = CLOSED[name]()
    surface = curvify.surface(mesh)
    dense = surface.refine(level)
    inside = sum(n * level * (level - 1) + 1 for n in mesh.face_sizes.tolist())
    assert dense.vertex_count == mesh.vertex_count + len(mesh_edges(mesh)) * (2 * level - 1) + inside
    assert dense.face_count == mesh.corner_count * level**2 == surface.face_count(level)
    assert dense.faces.shape[1] == 4


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", ["mixed", "torus"])
def test_edge_points_follow_the_vertices_edge_by_edge_from_the_smaller_id(name: str, dtype: type) -> None:
    mesh = CLOSED[name]()
    level = 4
    inner = 2 * level - 1
    surface = curvify.surface(mesh)
    dense = surface.refine(level, dtype)
    neighbors = directed_edges(dense.faces)
    exact = {}
    for patch, face in enumerate(mesh.faces()):
        corners = domain_polygon(len(face))
        for k, a in enumerate(face):
            exact[(a, face[(k + 1) % len(face)])] = (patch, corners[k], corners[(k + 1) % len(face)])
    t = np.arange(1, inner + 1)[:, None] / (inner + 1)
    ids, places = [], []
    for number, (low, high) in enumerate(mesh_edges(mesh)):
        first = mesh.vertex_count + number * inner
        chain = [low, *range(first, first + inner), high]
        assert all((a, b) in neighbors and (b, a) in neighbors for a, b in pairwise(chain))
        patch, start, end = exact[(low, high)]
        ids += [patch] * inner
        places.append((1 - t) * start + t * end)
    position, normal = surface.evaluate(np.array(ids), np.concatenate(places))
    stored = slice(mesh.vertex_count, mesh.vertex_count + len(ids))
    limit = 1e-13 if dtype is np.float64 else 1e-7
    assert np.abs(dense.positions[stored] - position).max() < limit
    assert np.abs(dense.normals[stored] - normal).max() < max(limit, 1e-12)


@each_closed
def test_the_insides_of_faces_follow_face_by_face(name: str) -> None:
    mesh = CLOSED[name]()
    level = 3
    dense = refined(mesh, level=level)
    assert dense.source_faces is not None
    start = end = mesh.vertex_count + len(mesh_edges(mesh)) * (2 * level - 1)
    for face in range(mesh.face_count):
        inside = np.unique(dense.faces[dense.source_faces == face])
        inside = inside[inside >= start]
        assert inside.tolist() == list(range(end, end + len(inside)))
        end += len(inside)
    assert end == dense.vertex_count


def test_points_on_the_diagonals_of_a_split_face_belong_to_its_inside() -> None:
    mesh = l_prism()
    surface = curvify.surface(mesh)
    level = 2
    dense = surface.refine(level)
    pieces = np.bincount(surface.source_faces, minlength=mesh.face_count)
    assert pieces.tolist() == [1] * 6 + [pieces[6], pieces[7]]
    assert min(pieces[6:]) > 1
    shared = len(mesh_edges(mesh)) * (2 * level - 1)
    sizes = [surface.sides[surface.source_faces == f] for f in range(mesh.face_count)]
    inside = sum(sum(n * level * (level - 1) + 1 for n in s) + (len(s) - 1) * (2 * level - 1) for s in sizes)
    assert dense.vertex_count == mesh.vertex_count + shared + inside


@each_closed
def test_cells_come_in_the_order_of_their_faces(name: str) -> None:
    dense = refined(CLOSED[name](), level=2)
    assert dense.source_faces is not None
    assert (np.diff(dense.source_faces) >= 0).all()


@each_closed
def test_dense_faces_run_as_the_coarse_ones(name: str) -> None:
    dense = refined(CLOSED[name](), level=4)
    area = newell_normals(dense.positions, 4 * np.arange(dense.face_count + 1), dense.faces.reshape(-1))
    mean = dense.normals[dense.face_wedges].sum(axis=1)
    assert ((area * mean).sum(axis=1) > 0).all()


def test_indices_have_32_bits() -> None:
    dense = refined(torus(), level=2)
    assert dense.faces.dtype == dense.face_wedges.dtype == np.int32


def sharp_cube() -> PolygonMesh:
    mesh = cube()
    normals = unit(newell_normals(mesh.positions, mesh.face_offsets, mesh.face_vertices))
    return mesh.with_(corner_normals=np.repeat(normals, 4, axis=0))


def check_repeats(mesh: PolygonMesh, dense: DenseMesh, corner_repeats: int, edge_repeats: int) -> None:
    """Repeats are sorted by vertex: those of input vertices first, then those of edge points."""
    assert len(dense.repeats) == corner_repeats + edge_repeats
    assert (np.diff(dense.repeats) >= 0).all()
    assert (dense.repeats[:corner_repeats] < mesh.vertex_count).all()
    assert (dense.repeats[corner_repeats:] >= mesh.vertex_count).all()


def test_repeats_follow_all_vertices_in_the_order_of_vertex_and_sector() -> None:
    mesh = sharp_cube()
    level = 2
    dense = refined(mesh, level=level, sharp_from="normals")
    check_repeats(mesh, dense, 8 * 2, 12 * (2 * level - 1))
    check_sound(dense, closed=True)
    per_vertex = {v: [v, *(dense.vertex_count + np.flatnonzero(dense.repeats == v))] for v in range(8)}
    corners = {v: [c for c, w in enumerate(mesh.face_vertices) if w == v] for v in range(8)}
    for v in range(8):
        assert mesh.corner_normals is not None
        assert np.abs(dense.normals[per_vertex[v]] - mesh.corner_normals[corners[v]]).max() < 1e-15


def test_wedges_of_a_cell_carry_the_normal_of_its_own_side() -> None:
    mesh = sharp_cube()
    dense = refined(mesh, level=3, sharp_from="normals")
    assert dense.source_faces is not None
    assert mesh.corner_normals is not None
    own = mesh.corner_normals[::4][dense.source_faces]
    assert degrees(dense.normals[dense.face_wedges], own[:, None]).max() < 1e-12


# --- carried values -----------------------------------------------------------------------------------------------


def colored_grid(dtype: type) -> PolygonMesh:
    mesh = flat_grid(3, 2)
    colors = np.random.default_rng(4).uniform(0, 255, (mesh.vertex_count, 3))
    uvs = 5 * mesh.positions[mesh.face_vertices, :2] + 1
    return mesh.with_(vertex_colors=colors.astype(dtype), corner_uvs=uvs)


def test_colors_are_exact_at_vertices_and_linear_along_edges() -> None:
    mesh = colored_grid(np.float64)
    level = 3
    dense = refined(mesh, level=level)
    assert dense.colors is not None
    assert mesh.vertex_colors is not None
    colors = mesh.vertex_colors.astype(float)
    assert np.array_equal(dense.colors[: mesh.vertex_count], colors)
    t = np.arange(1, 2 * level)[:, None] / (2 * level)
    for number, (low, high) in enumerate(mesh_edges(mesh)):
        first = mesh.vertex_count + number * (2 * level - 1)
        expected = (1 - t) * colors[low] + t * colors[high]
        assert np.abs(dense.colors[first : first + 2 * level - 1] - expected).max() < 1e-12


def test_eight_bit_colors_are_rounded_to_the_nearest() -> None:
    dense = refined(colored_grid(np.uint8), level=2)
    assert dense.colors is not None
    assert dense.colors.dtype == np.uint8
    whole = colored_grid(np.uint8)
    assert whole.vertex_colors is not None
    smooth = refined(whole.with_(vertex_colors=whole.vertex_colors.astype(np.float64)), level=2)
    assert smooth.colors is not None
    assert np.abs(dense.colors.astype(float) - smooth.colors).max() <= 0.5 + 1e-9


def test_texture_coordinates_follow_a_flat_mesh() -> None:
    """Carried values are bilinear on each kite, so affine coordinates of a flat quad grid stay affine."""
    mesh = colored_grid(np.float64)
    dense = refined(mesh, level=3)
    assert dense.uvs is not None
    assert not len(dense.repeats)
    assert np.abs(dense.uvs - 5 * dense.positions[:, :2] - 1).max() < 1e-12


def seam_torus() -> PolygonMesh:
    """A torus whose texture coordinates jump from 1 to 0 across one meridian and one parallel."""
    around, tube = 8, 5
    mesh = torus(around, tube)
    uvs = []
    for j in range(tube):
        for i in range(around):
            uvs += [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]]
    return mesh.with_(corner_uvs=np.array(uvs) / [around, tube])


def test_a_texture_seam_keeps_the_surface_and_repeats_the_seam_only() -> None:
    mesh = seam_torus()
    level = 3
    plain = refined(mesh.with_(corner_uvs=None), level=level)
    dense = refined(mesh, level=level)
    assert np.array_equal(plain.positions, dense.positions)
    assert np.array_equal(plain.faces, dense.faces)
    seam_edges, seam_vertices = 8 + 5, 8 + 5 - 1
    check_repeats(mesh, dense, seam_vertices + 2, seam_edges * (2 * level - 1))
    assert np.array_equal(dense.normals[dense.vertex_count :], dense.normals[dense.repeats])
    assert dense.uvs is not None
    spans = np.ptp(dense.uvs[dense.face_wedges], axis=1)
    assert np.abs(spans - np.array([1 / 8, 1 / 5]) / (2 * level)).max() < 1e-12


def test_texture_coordinates_that_are_missing_become_zero() -> None:
    mesh = flat_grid(2, 1)
    uvs = np.full((8, 2), np.nan)
    uvs[:4] = 0.5
    dense = refined(mesh.with_(corner_uvs=uvs), level=2)
    assert dense.uvs is not None
    assert np.isfinite(dense.uvs).all()


def test_materials_and_groups_follow_the_faces() -> None:
    mesh = cube().with_(
        face_materials=np.array([0, 1, 0, 1, 0, -1]), material_names=("steel", "wood"),
        face_groups=np.arange(6), group_names=tuple("abcdef"),
    )
    dense = refined(mesh, level=2)
    assert dense.source_faces is not None
    assert dense.face_materials is not None
    assert dense.face_materials.tolist() == [mesh.face_materials[f] for f in dense.source_faces]
    assert dense.face_groups is not None
    assert dense.face_groups.tolist() == dense.source_faces.tolist()
    assert dense.material_names == ("steel", "wood")


# --- the front door -----------------------------------------------------------------------------------------------


def test_the_function_of_the_package_does_what_a_surface_does() -> None:
    for _ in range(2):
        dense = curvify.refine(cube(), level=2, dtype=np.float32)
        assert np.array_equal(dense.positions, refined(cube(), 2, np.float32).positions)


@pytest.mark.parametrize("level", [0, -1, 1.5])
def test_a_level_that_is_no_positive_whole_number_is_refused(level: float) -> None:
    with pytest.raises(curvify.OptionError, match="level"):
        refined(cube(), level=level)


def test_too_many_faces_are_refused_before_memory_is_taken() -> None:
    surface = curvify.surface(cube())
    assert surface.face_count(100_000) == 240_000_000_000
    with pytest.raises(curvify.LimitError, match="240,000,000,000 faces"):
        surface.refine(level=100_000)
    with pytest.raises(curvify.LimitError, match="limit of 95"):
        surface.refine(level=2, max_faces=95)
    assert surface.refine(level=2, max_faces=96).face_count == 96


def test_other_types_and_options_are_refused() -> None:
    with pytest.raises(curvify.OptionError, match="precision"):
        refined(cube(), dtype=np.int32)
    with pytest.raises(curvify.OptionError, match="no option fullness; it has alpha"):
        refined(cube(), fullness=1)
    with pytest.raises(curvify.OptionError, match="cross_tangent"):
        refined(cube(), cross_tangent="rough")
    with pytest.raises(curvify.OptionError, match="no scheme 'nurbs'"):
        curvify.surface(cube(), scheme="nurbs")
    with pytest.raises(curvify.OptionError, match="alpha"):
        refined(cube(), cross_tangent="quadratic", alpha=0)
    with pytest.raises(curvify.OptionError, match="quadratic"):
        refined(cube(), alpha=2)
    with pytest.raises(curvify.OptionError, match="weld"):
        refined(cube(), weld="sometimes")
    with pytest.raises(curvify.OptionError, match="sharp_from"):
        refined(cube(), sharp_from="feeling")
