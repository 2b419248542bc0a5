"""Formats that trimesh reads and writes: what they hold comes back, what they cannot hold does no harm."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

import curvify
from bodies import boxes
from curvify.checks import check_mesh
from curvify.errors import FormatError
from curvify.formats import READ_FORMATS, WRITE_FORMATS


@pytest.fixture
def rich():
    """A box with texture coordinates, colors and three materials."""
    mesh = boxes((0, 0, 0))
    corners = np.arange(mesh.corner_count)
    return mesh.with_(
        corner_uvs=np.stack([corners / 32, corners % 5 / 8], axis=1),
        vertex_colors=np.arange(24, dtype=np.uint8).reshape(8, 3),
        face_materials=np.array([2, 0, 1, 0, 1, 2]),
        material_names=("stone", "wood", "glass"),
    )


def there_and_back(mesh, path):
    """The mesh as a file gives it back."""
    curvify.write(mesh, path)
    return curvify.read(path)


def rows(mesh):
    """Position, texture coordinate, color and material of every corner, without the order of the faces."""
    materials = np.array([*mesh.material_names, ""], dtype=object)[mesh.face_materials][mesh.corner_faces]
    colors = mesh.vertex_colors[mesh.face_vertices][:, :3]
    positions = mesh.positions[mesh.face_vertices]
    return {
        (*p, *np.round(uv, 6), *c, m)
        for p, uv, c, m in zip(positions, mesh.corner_uvs, colors, materials, strict=True)
    }


def test_glb_keeps_texture_coordinates_colors_and_materials(rich, tmp_path):
    found = there_and_back(rich, tmp_path / "mesh.glb")
    assert found.face_count == 12
    assert found.material_names == ("stone", "wood", "glass")
    assert rows(found) == rows(rich)
    np.testing.assert_array_equal(np.bincount(found.face_materials), [4, 4, 4])


@pytest.mark.parametrize("left", ["corner_uvs", "vertex_colors", "face_materials"])
def test_glb_with_some_of_them(rich, tmp_path, left):
    found = there_and_back(rich.with_(**{left: None}), tmp_path / "mesh.glb")
    for name in ("corner_uvs", "vertex_colors", "face_materials"):
        assert (getattr(found, name) is None) == (name == left)


def test_one_material_keeps_the_vertices_in_order(rich, tmp_path):
    plain = rich.with_(corner_uvs=None, face_materials=np.zeros(6, dtype=np.int64), material_names=("stone",))
    found = there_and_back(plain, tmp_path / "mesh.glb")
    np.testing.assert_array_equal(found.positions, plain.positions)
    assert found.material_names == ("stone",)


def test_faces_without_a_material(rich, tmp_path):
    found = there_and_back(rich.with_(face_materials=np.array([-1, 0, 0, 0, 0, -1])), tmp_path / "mesh.glb")
    assert found.material_names == ("stone",)
    assert sorted(found.face_materials.tolist()) == [-1] * 4 + [0] * 8


@pytest.mark.parametrize("format", ["glb", "stl", "3mf"])
def test_what_is_closed_stays_closed(rich, tmp_path, format):
    found = there_and_back(rich, tmp_path / f"mesh.{format}")
    assert all(f.passed for f in check_mesh(found, {"watertight": True, "manifold": True, "positive_volume": True}))


def test_3mf_repeats_no_vertex(rich, tmp_path):
    found = there_and_back(rich, tmp_path / "mesh.3mf")
    assert (found.vertex_count, found.face_count) == (8, 12)


def test_dense_meshes_keep_their_materials(rich, tmp_path):
    dense = curvify.refine(rich, level=2)
    found = there_and_back(dense, tmp_path / "dense.glb")
    assert found.face_count == 2 * dense.face_count
    assert found.material_names == ("stone", "wood", "glass")
    assert found.corner_normals is not None


def gltf(folder: Path) -> Path:
    """A glTF file with buffers beside it."""
    import trimesh

    for name, content in trimesh.creation.box().export(file_type="gltf").items():
        (folder / name).write_bytes(content)
    return folder / "model.gltf"


def test_gltf_finds_its_buffers(tmp_path):
    path = gltf(tmp_path)
    assert curvify.read(path).face_count == 12
    buffer = json.loads(path.read_text())["buffers"][0]["uri"]
    (tmp_path / buffer).unlink()
    with pytest.raises(curvify.FormatError, match=f"refers to .*{buffer}, and there is no such file"):
        curvify.read(path)


def test_text_that_is_not_utf8(tmp_path):
    text = (
        "solid Stück\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
        "endloop\nendfacet\nendsolid Stück\n"
    )
    (tmp_path / "part.stl").write_bytes(text.encode("latin-1"))
    mesh = curvify.read(tmp_path / "part.stl")
    np.testing.assert_array_equal(mesh.positions[mesh.face_vertices], [[0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_a_binary_stl_that_is_cut_off(rich, tmp_path):
    curvify.write(rich, tmp_path / "box.stl")
    (tmp_path / "cut.stl").write_bytes((tmp_path / "box.stl").read_bytes()[:-60])
    with pytest.raises(FormatError, match=r"cut.stl: a binary STL of 12 triangles has 684 bytes, this one 624;"):
        curvify.read(tmp_path / "cut.stl")


def test_unknown_suffixes_are_answered_with_the_known_ones(rich, tmp_path):
    for act, known in ((lambda p: curvify.write(rich, p), WRITE_FORMATS), (curvify.read, READ_FORMATS)):
        with pytest.raises(curvify.FormatError) as caught:
            act(tmp_path / "mesh.blend")
        assert ", ".join(known) in str(caught.value)


def test_3mf_is_an_archive(rich, tmp_path):
    curvify.write(rich, tmp_path / "mesh.3mf")
    assert any(name.endswith(".model") for name in zipfile.ZipFile(tmp_path / "mesh.3mf").namelist())
