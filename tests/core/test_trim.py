"""Trimming: the counts of the reference, round rims, no T-junctions, whatever the image does across edges."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import curvify
from curvify.errors import FormatError, MeshError, OptionError
from curvify.mask import Mask, read_mask
from curvify.mesh import Marks, PolygonMesh
from curvify.polygons import newell_normals, next_corners
from curvify.trimmed import fan_triangles
from surfaces import cube, dodecahedron, flat_grid, mixed_ball

Array = npt.NDArray[np.float64]
REFERENCE = json.loads((Path(__file__).parents[1] / "data" / "blending.json").read_text())
DISC = Path(__file__).parents[2] / "sample_meshes" / "disc.png"


def reference_torus() -> PolygonMesh:
    """8 x 6 quads, radii 2 and 0.8."""
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(8), np.arange(6), indexing="ij"))
    u, v = 2 * np.pi * i / 8, 2 * np.pi * j / 6
    reach = 2 + 0.8 * np.cos(v)
    points = np.stack([reach * np.cos(u), reach * np.sin(u), 0.8 * np.sin(v)], axis=1)
    faces = [
        [a % 8 * 6 + b % 6 for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
        for i in range(8)
        for j in range(6)
    ]
    return PolygonMesh.from_faces(points, faces)


def picture(brightness: Any, size: int = 256) -> Mask:
    """A mask from a function of x to the right and y upward, both 0 to 1."""
    at = (np.arange(size) + 0.5) / size
    x, y = np.meshgrid(at, at[::-1])
    return Mask(np.clip(brightness(x, y), 0, 1))


def disc(radius: float = 0.3, x: float = 0.5, y: float = 0.5) -> Mask:
    """White, a black disc in it."""
    return picture(lambda u, v: (np.hypot(u - x, v - y) - radius) * 64 + 0.5)


def edges_of(mesh: PolygonMesh) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Vertex pairs of the edges, and how many faces each has."""
    heads = mesh.face_vertices[next_corners(mesh.face_offsets)]
    pairs = np.sort(np.stack([mesh.face_vertices, heads], axis=1), axis=1)
    return np.unique(pairs, axis=0, return_counts=True)


def t_junctions(mesh: PolygonMesh) -> int:
    """Vertices that lie inside an edge of a mesh in a plane."""
    edges, _ = edges_of(mesh)
    used = np.unique(mesh.face_vertices)
    start, along = mesh.positions[edges[:, 0]], np.diff(mesh.positions[edges], axis=1)[:, 0]
    square = (along**2).sum(axis=1)
    found = 0
    for point in mesh.positions[used]:
        t = ((point - start) * along).sum(axis=1) / square
        away = np.linalg.norm(point - start - t[:, None] * along, axis=1)
        found += int(((away < 1e-12) & (t > 1e-9) & (t < 1 - 1e-9)).sum())
    return found


def area(mesh: PolygonMesh) -> float:
    """Area of a mesh in the plane z = 0."""
    return float(newell_normals(mesh.positions, mesh.face_offsets, mesh.face_vertices)[:, 2].sum() / 2)


def loops(pairs: npt.NDArray[np.int64]) -> int:
    """Number of connected components of some edges."""
    label = {int(v): int(v) for v in np.unique(pairs)}

    def root(v: int) -> int:
        while label[v] != v:
            v = label[v]
        return v

    for a, b in pairs.tolist():
        label[root(a)] = root(b)
    return len({root(v) for v in label})


def test_the_torus_of_the_reference_clipped() -> None:
    expected = REFERENCE["trim_expectations"]
    surface = curvify.surface(reference_torus(), "blend")
    mesh = surface.trim(disc(), expected["grid_n"] // 2)
    edges, uses = edges_of(mesh)
    assert mesh.vertex_count == expected["vertices"]
    assert mesh.face_count == expected["polygons"]
    assert uses.max() == 2
    assert (uses == 1).sum() == expected["boundary_edges"]
    assert loops(edges[uses == 1]) == expected["boundary_loops"]
    assert mesh.vertex_count - len(edges) + mesh.face_count == expected["euler"]


def test_the_torus_of_the_reference_with_cells_dropped() -> None:
    expected = REFERENCE["trim_expectations"]["drop_mode_n16"]
    mesh = curvify.surface(reference_torus(), "blend").trim(disc(), 8, mode="drop")
    _, uses = edges_of(mesh)
    assert (mesh.vertex_count, mesh.face_count) == (expected["vertices"], expected["polygons"])
    assert (uses == 1).sum() == expected["boundary_edges"]


@pytest.mark.parametrize("scheme", ["blend", "gregory"])
def test_holes_are_round_in_the_parameters(scheme: str) -> None:
    """On a flat grid parameters can be read off the positions."""
    surface = curvify.surface(flat_grid(2, 2), scheme)
    mesh = surface.trim(disc(), 5)
    edges, uses = edges_of(mesh)
    rim = np.unique(edges[uses == 1])
    local = mesh.positions[rim][:, :2] * 2 % 1
    radius = np.linalg.norm(local - 0.5, axis=1)
    hole = radius < 0.45
    assert hole.sum() == 4 * 20
    assert np.abs(radius[hole] - 0.3).max() < REFERENCE["trim_expectations"]["rim_radius_error_max"]
    assert t_junctions(mesh) == 0


@pytest.mark.parametrize("level", [1, 2, 5])
def test_the_disc_of_the_samples_is_as_round_as_promised(level: int) -> None:
    mesh = curvify.surface(flat_grid(1, 1), "blend").trim(read_mask(DISC), level)
    edges, uses = edges_of(mesh)
    radius = np.linalg.norm(mesh.positions[np.unique(edges[uses == 1])][:, :2] - 0.5, axis=1)
    hole = radius[radius < 0.45]
    assert len(hole) >= 4
    assert np.abs(hole / 0.3 - 1).max() < 1e-3


IMAGES = {
    "disc": disc(),
    "disc aside": disc(0.35, 0.1, 0.2),
    "stripe": picture(lambda x, y: (np.abs(x - 0.3 * y - 0.4) - 0.1) * 32 + 0.5),
    "waves": picture(lambda x, y: 0.5 + np.sin(17 * x + 3) * np.cos(13 * y + 1)),
    "half grey": picture(lambda x, y: 0.5 + 0 * x),
}


@pytest.mark.parametrize("image", IMAGES)
@pytest.mark.parametrize("scheme", ["blend", "gregory"])
@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("level", [1, 4])
def test_there_are_no_t_junctions_wherever_the_image_differs_across_edges(
    image: str, scheme: str, triangles: bool, level: int
) -> None:
    surface = curvify.surface(flat_grid(2, 2, triangles), scheme)
    kept = surface.trim(IMAGES[image], level)
    _, uses = edges_of(kept)
    assert uses.max() <= 2
    assert t_junctions(kept) == 0
    areas = newell_normals(kept.positions, kept.face_offsets, kept.face_vertices)[:, 2]
    assert areas.min() > 0
    if image == "half grey":
        assert area(kept) == pytest.approx(1)
    elif image != "waves" and level > 1:  # waves have saddles of just the threshold, a coarse disc is missed
        assert area(kept) + area(surface.trim(IMAGES[image].inverted(), level)) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("mesh", [dodecahedron(), mixed_ball()], ids=["pentagons", "mixed"])
@pytest.mark.parametrize("scheme", ["blend", "gregory"])
def test_polygons_have_a_hole_in_each_of_their_quads(mesh: PolygonMesh, scheme: str) -> None:
    surface = curvify.surface(mesh, scheme)
    sizes = surface.sides
    trimmed = surface.trim(disc(), 3)
    edges, uses = edges_of(trimmed)
    holes = int(np.where(sizes == 4, 1, sizes).sum())
    assert uses.max() == 2
    assert loops(edges[uses == 1]) == holes
    assert trimmed.vertex_count - len(edges) + trimmed.face_count == 2 - holes


# --- texture coordinates --------------------------------------------------------------------------------------


def with_uvs(mesh: PolygonMesh, uvs: Any) -> PolygonMesh:
    """The mesh with texture coordinates from a function of positions and faces, both by corner."""
    return mesh.with_(corner_uvs=np.array(uvs(mesh.positions[mesh.face_vertices], mesh.corner_faces), dtype=float))


@pytest.mark.parametrize("triangles", [False, True])
def test_texture_coordinates_lay_one_image_over_all_faces(triangles: bool) -> None:
    mesh = with_uvs(flat_grid(3, 3, triangles), lambda p, _: p[:, :2])
    trimmed = curvify.surface(mesh, "blend").trim(disc(), 4, mapping="uv")
    edges, uses = edges_of(trimmed)
    assert loops(edges[uses == 1]) == 2
    assert trimmed.corner_uvs is not None
    rim = np.isin(trimmed.face_vertices, edges[uses == 1])
    radius = np.linalg.norm(trimmed.corner_uvs[rim] - 0.5, axis=1)
    assert np.abs(radius[radius < 0.4] - 0.3).max() < 2e-5
    assert t_junctions(trimmed) == 0
    if not triangles:  # whose points do not follow their parameters
        np.testing.assert_allclose(trimmed.corner_uvs, trimmed.positions[trimmed.face_vertices][:, :2], atol=1e-6)


def test_across_a_seam_the_image_jumps_and_the_mesh_stays_joined() -> None:
    """Two islands of texture: the right half of the sheet shows the image turned around."""

    def islands(points: Array, faces: npt.NDArray[np.int64]) -> Array:
        right = (faces % 4 >= 2)[:, None]
        return np.where(right, 1 - points[:, :2] + [0.15, 0.25], points[:, :2])

    mesh = with_uvs(flat_grid(4, 4), islands)
    for mask in (disc(0.3), IMAGES["stripe"], IMAGES["waves"]):
        trimmed = curvify.surface(mesh, "blend").trim(mask, 3, mapping="uv")
        _, uses = edges_of(trimmed)
        assert uses.max() == 2
        assert t_junctions(trimmed) == 0
        assert trimmed.corner_uvs is not None
        seam = np.abs(trimmed.positions[trimmed.face_vertices][:, 0] - 0.5) < 1e-12
        at_seam: dict[int, set[tuple[float, ...]]] = {}
        for vertex, uv in zip(trimmed.face_vertices[seam], trimmed.corner_uvs[seam], strict=True):
            at_seam.setdefault(int(vertex), set()).add(tuple(np.round(uv, 9)))
        assert max(len(found) for found in at_seam.values()) == 2


def test_without_texture_coordinates_there_is_nothing_to_lay_an_image_on() -> None:
    with pytest.raises(MeshError, match="no texture coordinates"):
        curvify.surface(flat_grid(2, 2), "blend").trim(disc(), 2, mapping="uv")
    uvs = np.zeros((16, 2))
    uvs[6] = np.nan
    with pytest.raises(MeshError, match="face 1 has no texture coordinates"):
        curvify.surface(flat_grid(2, 2).with_(corner_uvs=uvs), "blend").trim(disc(), 2, mapping="uv")


# --- what is carried ------------------------------------------------------------------------------------------


def test_vertices_of_the_input_stay_first_also_where_they_are_trimmed() -> None:
    mesh = reference_torus()
    corners = picture(lambda x, y: (0.3 - np.hypot(x - 0.5, y - 0.5)) * 64 + 0.5)
    trimmed = curvify.surface(mesh, "blend").trim(corners, 4)
    np.testing.assert_array_equal(trimmed.positions[: mesh.vertex_count], mesh.positions)
    used = np.unique(trimmed.face_vertices)
    assert used.min() == mesh.vertex_count
    np.testing.assert_array_equal(used, np.arange(mesh.vertex_count, trimmed.vertex_count))


def test_normals_on_a_crease_are_those_of_the_side() -> None:
    mesh = cube()
    pairs = sorted({tuple(sorted(p)) for f in mesh.faces() for p in zip(f, f[1:] + f[:1], strict=True)})
    marks = Marks(crease_edges=np.array(pairs), crease_sharpness=np.ones((len(pairs), 2)))
    for scheme in ("blend", "gregory"):
        trimmed = curvify.surface(mesh.with_(marks=marks), scheme).trim(disc(0.35, 0.1, 0.2), 3)
        faces = newell_normals(trimmed.positions, trimmed.face_offsets, trimmed.face_vertices)
        faces /= np.linalg.norm(faces, axis=1, keepdims=True)
        assert trimmed.corner_normals is not None
        np.testing.assert_allclose(trimmed.corner_normals, faces[trimmed.corner_faces], atol=1e-7)


def test_new_points_lie_on_the_surface_with_its_normals() -> None:
    surface = curvify.surface(mixed_ball(), "blend")
    for mask in (IMAGES["waves"], disc(0.35, 0.1, 0.2)):
        trimmed = surface.trim(mask, 3)
        fine = surface.refine(24)
        new = np.unique(trimmed.face_vertices)[-40:]
        apart = np.linalg.norm(trimmed.positions[new][:, None] - fine.positions, axis=2)
        nearest = apart.argmin(axis=1)
        offset = trimmed.positions[new] - fine.positions[nearest]
        assert np.abs((offset * fine.normals[nearest]).sum(axis=1)).max() < 1e-3
        corner = np.array([np.flatnonzero(trimmed.face_vertices == v)[0] for v in new])
        assert trimmed.corner_normals is not None
        assert (trimmed.corner_normals[corner] * fine.normals[nearest]).sum(axis=1).min() > 0.99


def test_colors_and_materials_are_carried() -> None:
    mesh = flat_grid(2, 2)
    colors = np.rint(255 * mesh.positions).astype(np.uint8)
    painted = mesh.with_(vertex_colors=colors, face_materials=np.array([0, 1, 0, 1]), material_names=("a", "b"))
    trimmed = curvify.surface(painted, "blend").trim(disc(), 4)
    assert trimmed.vertex_colors is not None and trimmed.vertex_colors.dtype == np.uint8
    assert np.abs(trimmed.vertex_colors / 255 - trimmed.positions).max() < 0.003
    assert trimmed.face_materials is not None
    middles = np.array([trimmed.positions[face].mean(axis=0) for face in trimmed.faces()])
    np.testing.assert_array_equal(trimmed.face_materials, middles[:, 0] > 0.5)


def test_triangles_cover_the_same_and_none_is_empty() -> None:
    trimmed = curvify.surface(flat_grid(2, 2), "blend").trim(IMAGES["disc aside"], 3)
    assert trimmed.face_sizes.max() > 4
    triangles = fan_triangles(trimmed)
    assert set(triangles.face_sizes) == {3}
    areas = newell_normals(triangles.positions, triangles.face_offsets, triangles.face_vertices)[:, 2]
    assert areas.min() > 0
    assert areas.sum() / 2 == pytest.approx(area(trimmed), abs=1e-13)
    assert t_junctions(triangles) == 0


# --- images and errors ----------------------------------------------------------------------------------------


def test_images_are_sampled_as_in_the_reference() -> None:
    expected = REFERENCE["image_sampling"]
    mask = Mask(np.array(expected["image"]))
    for sample in expected["samples"]:
        found = mask.sample(np.array([sample["u"], sample["v"]]))
        assert found == pytest.approx(sample["value"], abs=1e-14)


@pytest.mark.parametrize("mode", ["1", "L", "LA", "RGB", "RGBA", "P", "I;16"])
def test_all_kinds_of_png_are_read(mode: str, tmp_path: Path) -> None:
    from PIL import Image

    grey = np.array([[0, 255], [255, 0]], dtype=np.uint8)
    image = Image.fromarray(grey.astype(np.uint16) * 257) if mode == "I;16" else Image.fromarray(grey).convert(mode)
    image.save(tmp_path / "image.png")
    np.testing.assert_allclose(read_mask(tmp_path / "image.png").values, grey / 255, atol=1e-12)


def test_what_is_transparent_is_dark(tmp_path: Path) -> None:
    from PIL import Image

    Image.fromarray(np.array([[[255, 255, 255, 51]]], dtype=np.uint8)).save(tmp_path / "image.png")
    assert read_mask(tmp_path / "image.png").values[0, 0] == pytest.approx(0.2)


def test_files_that_are_no_images_are_refused(tmp_path: Path) -> None:
    (tmp_path / "text.png").write_text("no image")
    (tmp_path / "cut.png").write_bytes(DISC.read_bytes()[:500])
    for name, text in (("text.png", "this is no PNG"), ("cut.png", "cannot be read"), ("no.png", "no such")):
        with pytest.raises(FormatError, match=text):
            read_mask(tmp_path / name)


def test_an_image_that_trims_everything_is_an_error() -> None:
    surface = curvify.surface(flat_grid(2, 2), "blend")
    for mode in ("clip", "drop"):
        with pytest.raises(MeshError, match="trims everything"):
            surface.trim(Mask(np.zeros((2, 2))), 3, mode=mode)


def test_an_image_that_trims_nothing_leaves_the_dense_mesh() -> None:
    surface = curvify.surface(mixed_ball(), "blend")
    dense, trimmed = surface.refine(3), surface.trim(Mask(np.ones((2, 2))), 3)
    np.testing.assert_array_equal(trimmed.face_vertices.reshape(-1, 4), dense.faces)
    np.testing.assert_array_equal(trimmed.positions, dense.positions)


def test_words_that_do_not_exist_are_refused() -> None:
    surface = curvify.surface(flat_grid(2, 2), "blend")
    with pytest.raises(OptionError, match="maps face, uv"):
        surface.trim(disc(), 2, mapping="xy")
