"""Materials of glTF: what they look like goes from file to file."""

from __future__ import annotations

import base64
import io
import json

import numpy as np
import pytest
from PIL import Image

from curvify import refine, write
from curvify.formats import read_mesh, write_mesh
from curvify.formats.looks import _joined, _split
from curvify.formats.references import referenced_files
from curvify.mask import Mask
from curvify.refinement import surface
from surfaces import cube

PAINT = {
    "name": "paint",
    "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.25},
    "occlusionTexture": {"index": 0, "texCoord": 1},
    "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0.5}},
    "doubleSided": True,
}
PLAIN = {"pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 1.0]}}


def jpeg() -> bytes:
    """A picture that would change if it were packed anew."""
    out = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (8, 8, 3), dtype=np.uint8)).save(out, "jpeg")
    return out.getvalue()


@pytest.fixture
def painted(tmp_path):
    """A box of two materials, the first with a texture, the second without a name."""
    mesh = cube()
    uvs = np.tile([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], (6, 1))
    materials = np.array([0, 0, 0, 0, 1, 1])
    write_mesh(mesh.with_(corner_uvs=uvs, face_materials=materials, material_names=("a", "b")), tmp_path / "plain.glb")
    header, binary = _split((tmp_path / "plain.glb").read_bytes())
    header["materials"] = [PAINT, PLAIN]
    header["textures"] = [{"source": 0, "sampler": 0}]
    header["samplers"] = [{"wrapS": 33071}]
    header["images"] = [{"bufferView": len(header["bufferViews"]), "mimeType": "image/jpeg"}]
    header["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(jpeg())})
    binary += jpeg()
    header["buffers"] = [{"byteLength": len(binary)}]
    (tmp_path / "painted.glb").write_bytes(_joined(header, binary))
    return tmp_path / "painted.glb"


def check_looks(path) -> dict:
    """The materials of a GLB file by name, with the picture of the first."""
    header, binary = _split(path.read_bytes())
    materials = {material["name"]: material for material in header["materials"]}
    paint = materials["paint"]
    assert paint == {key: value for key, value in PAINT.items() if key != "occlusionTexture"}  # on a second map
    (texture,) = header["textures"]
    view = header["bufferViews"][header["images"][texture["source"]]["bufferView"]]
    assert binary[view["byteOffset"] :][: view["byteLength"]] == jpeg()
    assert view["byteOffset"] % 4 == 0 and header["buffers"][0]["byteLength"] <= len(binary)
    assert header["samplers"][texture["sampler"]] == {"wrapS": 33071}
    assert "KHR_materials_clearcoat" in header["extensionsUsed"]
    return materials


def test_a_dense_mesh_looks_like_its_coarse_one(painted, tmp_path):
    mesh = read_mesh(painted)
    assert mesh.material_names == ("paint", "material_1")
    surface(mesh).write(tmp_path / "dense.glb", level=2)
    materials = check_looks(tmp_path / "dense.glb")
    assert materials["material_1"] == {**PLAIN, "name": "material_1"}
    again = read_mesh(tmp_path / "dense.glb")
    assert again.corner_uvs is not None and not np.isnan(again.corner_uvs).any()
    write_mesh(again, tmp_path / "again.glb")
    check_looks(tmp_path / "again.glb")
    write(refine(mesh, level=1), tmp_path / "arrays.glb")
    check_looks(tmp_path / "arrays.glb")


def test_a_trimmed_mesh_looks_the_same(painted, tmp_path):
    half = Mask(np.array([[1.0, 0.0]]))
    write_mesh(surface(read_mesh(painted)).trim(half, level=2), tmp_path / "half.glb")
    check_looks(tmp_path / "half.glb")


def test_pictures_beside_a_gltf_file_are_taken_along(painted, tmp_path):
    header, binary = _split(painted.read_bytes())
    (tmp_path / "my paint.jpg").write_bytes(jpeg())
    header["images"] = [{"uri": "my%20paint.jpg"}]
    header["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    (tmp_path / "painted.gltf").write_text(json.dumps(header))
    assert referenced_files(str(tmp_path / "painted.gltf")) == [str(tmp_path / "my paint.jpg")]
    write_mesh(read_mesh(tmp_path / "painted.gltf"), tmp_path / "made.glb")
    check_looks(tmp_path / "made.glb")


def test_equal_names_are_told_apart(painted, tmp_path):
    header, binary = _split(painted.read_bytes())
    header["materials"][1] = {**PLAIN, "name": "paint"}
    (tmp_path / "twice.glb").write_bytes(_joined(header, binary))
    mesh = read_mesh(tmp_path / "twice.glb")
    assert mesh.material_names == ("paint", "paint_2")
    assert np.bincount(mesh.face_materials).tolist() == [8, 4]


def test_parts_without_texture_coordinates_leave_the_others_theirs(painted, tmp_path):
    header, binary = _split(painted.read_bytes())
    del header["meshes"][1]["primitives"][0]["attributes"]["TEXCOORD_0"]
    (tmp_path / "half.glb").write_bytes(_joined(header, binary))
    mesh = read_mesh(tmp_path / "half.glb")
    has = ~np.isnan(mesh.corner_uvs).any(axis=1)
    assert np.array_equal(has, np.repeat(mesh.face_materials == 0, 3))
    assert np.isfinite(refine(mesh, level=1).positions).all()


def test_other_formats_have_no_use_for_looks(painted, tmp_path):
    write_mesh(read_mesh(painted), tmp_path / "made.obj")
    assert read_mesh(tmp_path / "made.obj").material_names == ("paint", "material_1")


def test_nothing_but_images_is_taken_along(painted, tmp_path):
    header, binary = _split(painted.read_bytes())
    (tmp_path / "secret").write_text("of nobody's business")
    header["images"] = [{"uri": "secret"}]
    (tmp_path / "odd.glb").write_bytes(_joined(header, binary))
    write_mesh(read_mesh(tmp_path / "odd.glb"), tmp_path / "made.glb")
    made = (tmp_path / "made.glb").read_bytes()
    assert b"business" not in made and _split(made)[0]["images"] == [{"uri": "secret"}]
