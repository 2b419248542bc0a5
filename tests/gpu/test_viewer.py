"""Pages for the browser: whole in themselves, and with the meshes that were given."""

from __future__ import annotations

import base64
import json
import re
import zlib

import numpy as np
import pytest

from curvify import MeshError, OptionError, PolygonMesh
from curvify.gpu import viewer
from curvify.gpu.scene import Layer, Settings, Stroke
from curvify.gpu.viewer import pack, viewer_page
from surfaces import cube


def unpack(packed: dict) -> np.ndarray:
    """What arrays.js does."""
    kind = np.dtype(f"<{packed['kind']}")
    planes = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), np.uint8)
    bits = planes.reshape(kind.itemsize, -1).T.copy().view(f"<u{kind.itemsize}").reshape(-1, packed["width"])
    assert len(bits) == packed["count"]
    return np.add.accumulate(bits, axis=0, dtype=bits.dtype).view(kind)


def scene_of(page: str) -> dict:
    """The JSON that a page holds."""
    found = re.search(r'<script type="application/json" id="scene">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return json.loads(found[1])


@pytest.mark.parametrize("kind", ["<f4", "<u4", "<i2"])
def test_arrays_come_back_to_the_bit(kind):
    numbers = (1000 * np.random.default_rng(0).normal(size=(50, 3))).astype(kind)
    assert np.array_equal(unpack(pack(numbers)), numbers)
    assert unpack(pack(numbers[:0])).shape == (0, 3)


def test_a_page_holds_the_mesh_and_nothing_from_elsewhere():
    mesh = cube()
    page = viewer_page([Layer(mesh, wire=Stroke())], ["cube"], Layer(mesh, dots=Stroke()))
    assert not re.search(r"https?:|src=|@import|fetch\(|<link", page)
    scene = scene_of(page)
    arrays = {name: unpack(array) for name, array in scene["models"][0]["arrays"].items()}
    points, triangles = arrays["points"], arrays["triangles"]
    corners = points[triangles].astype(float)
    volume = np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume == pytest.approx(1.0)  # the place of meshes is about 1 large
    facets = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    own = arrays["normals"][triangles[:, 0]] / 32767
    assert np.einsum("ti,ti->t", facets, own) == pytest.approx(1.0, abs=1e-3)
    assert len(arrays["edges"]) == 12 and len(arrays["dots"]) == 0
    assert sorted(unpack(scene["control"]["arrays"]["dots"])[:, 0]) == list(range(8))
    assert scene["look"]["wire"] and scene["look"]["control"] and scene["scale"] is None
    assert scene["models"][0]["facts"] == "cube: 6 faces, 8 vertices"


def test_names_cannot_leave_their_place():
    name = "</script><b>{script}"
    page = viewer_page([Layer(cube())], [name])
    assert page.count("</script>") == 2
    assert scene_of(page)["models"][0]["name"] == name
    assert "<title>&lt;/script&gt;&lt;b&gt;{script}</title>" in page


def test_values_become_shares_of_their_scale():
    values = np.arange(8.0)
    values[3] = np.nan
    scene = scene_of(viewer_page([Layer(cube(), "values", values=values)], ["cube"]))
    shares = unpack(scene["models"][0]["arrays"]["values"])[:8, 0]
    assert shares == pytest.approx(values / 7, nan_ok=True)
    assert (scene["scale"]["low"], scene["scale"]["high"]) == ("0.0", "7.0")


def test_meshes_of_one_size_share_their_place():
    mesh = cube()
    near, far = mesh.with_(positions=1.1 * mesh.positions), mesh.with_(positions=mesh.positions + 50)

    def reach(other: PolygonMesh, control: Layer | None = None) -> list[float]:
        scene = scene_of(viewer_page([Layer(mesh), Layer(other)], ["a", "b"], control))
        return [float(np.abs(unpack(model["arrays"]["points"])).max()) for model in scene["models"]]

    assert reach(near) == pytest.approx([0.5 / 1.1, 0.5])
    assert reach(far) == pytest.approx([0.5, 0.5])
    assert reach(far, Layer(mesh)) == pytest.approx([0.5, 0.5])


def test_what_cannot_be_shown(monkeypatch):
    layer = Layer(cube())
    with pytest.raises(OptionError, match="a name for each"):
        viewer_page([layer], [])
    with pytest.raises(OptionError, match="either all"):
        viewer_page([layer, Layer(cube(), "values", values=np.zeros(8))], ["a", "b"])
    with pytest.raises(OptionError, match="starts with one of"):
        viewer_page([Layer(cube(), "hidden")], ["a"])
    with pytest.raises(OptionError, match="field of view"):
        viewer_page([layer], ["a"], settings=Settings(field_of_view=0))
    with pytest.raises(MeshError, match="no faces"):
        viewer_page([Layer(PolygonMesh.from_faces([[0, 0, 0]], []))], ["a"])
    monkeypatch.setattr(viewer, "MOST_TRIANGLES", 11)
    with pytest.raises(MeshError, match="12 triangles are more"):
        viewer_page([layer], ["a"])
