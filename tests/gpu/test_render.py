"""Pictures show what they should: measured by areas, bands and lines in them, not by bytes."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

import curvify
from curvify.errors import MeshError, OptionError
from curvify.gpu import render
from curvify.gpu.device import Device
from curvify.gpu.picture import picture
from curvify.gpu.scene import Layer, Lines, Panel, Settings, Stroke
from curvify.mesh import DenseMesh, PolygonMesh
from opengl import device_or_skip
from surfaces import cube, truncated_icosahedron

SIZE = 160
#: Half of what a fitted mesh fills of the picture, in pixels.
REACH = 0.45 * SIZE
FRONT: dict[str, Any] = {"size": (SIZE, SIZE), "view": (0.0, 0.0), "field_of_view": 0.0}
TOP = FRONT | {"view": (0.0, 90.0)}
BLACK = Stroke((0.0, 0.0, 0.0), 3.0)


@pytest.fixture(scope="module")
def device() -> Iterator[Device]:
    with device_or_skip() as device:
        yield device


@cache
def sphere() -> DenseMesh:
    """The unit sphere, up to 0.004 %."""
    return curvify.refine(truncated_icosahedron(), level=6)


def square(z: float = 0.0, size: float = 1.0) -> PolygonMesh:
    """A square that faces up."""
    corners = size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return PolygonMesh.from_faces(np.c_[corners, np.full(4, z)], [[0, 1, 2, 3]])


def alpha(layer: Layer, device: Device, **settings: Any) -> np.ndarray:
    """How much of each pixel a layer covers, 0 to 1."""
    image = picture([Panel([layer])], Settings(**(FRONT | settings), background=None), device)
    return image[..., 3] / 255.0


def darkness(layer: Layer, device: Device, **settings: Any) -> np.ndarray:
    """How much black lines cover of each pixel of a picture: its light against that without them."""
    panel = Panel([layer])
    bare = Panel([Layer(layer.mesh, layer.style, layer.shading)])
    drawn, without = (linear(picture([one], Settings(**settings), device)) for one in (panel, bare))
    return 1 - drawn / without


def linear(image: np.ndarray) -> np.ndarray:
    """Linear light of the green of a picture."""
    shown = image[..., 1] / 255.0
    return np.where(shown > 0.04045, ((shown + 0.055) / 1.055) ** 2.4, shown / 12.92)


# --- silhouettes ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("field", [0.0, 24.0, 90.0])
def test_the_silhouette_of_a_sphere_is_a_disc(device, field):
    covered = alpha(Layer(sphere()), device, field_of_view=field, view=(20.0, 50.0))
    assert covered.sum() == pytest.approx(np.pi * REACH**2, rel=8e-3)
    # Its edge is smooth: pixels that are covered in part, in many steps.
    assert len(np.unique(covered)) > 10
    # It is round: as wide as high, in the middle.
    for axis in (0, 1):
        profile = covered.sum(axis=axis)
        assert profile.max() == pytest.approx(2 * REACH, abs=0.6)
        assert np.average(np.arange(SIZE) + 0.5, weights=profile) == pytest.approx(SIZE / 2, abs=0.2)


@pytest.mark.parametrize("size", [(200, 100), (100, 200)])
def test_pictures_are_not_stretched(device, size):
    covered = alpha(Layer(sphere()), device, size=size)
    assert covered.shape == size[::-1]
    assert covered.sum() == pytest.approx(np.pi * 45**2, rel=8e-3)


@pytest.mark.parametrize(
    "positions",
    [
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[0, 0, 0], [100, 0.1, 0], [100, 0, 0.1], [0, 0, 0.1]],
        [[1e7, 1e7, 1e7], [1e7 + 1, 1e7, 1e7], [1e7, 1e7 + 1, 1e7], [1e7, 1e7, 1e7 + 1]],
        [[0, 0, 0], [1e-20, 0, 0], [0, 1e-20, 0], [0, 0, 1e-20]],
        [[0, 0, 0], [1e25, 0, 0], [0, 1e25, 0], [0, 0, 1e25]],
    ],
    ids=["plain", "needle", "far away", "tiny", "huge"],
)
@pytest.mark.parametrize("field", [0.0, 24.0])
def test_the_camera_sees_all_of_any_mesh(device, positions, field):
    faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    # A vertex that no face uses is not looked at.
    mesh = PolygonMesh.from_faces([*positions, [5, 5, 1e26]], faces)
    covered = alpha(Layer(mesh), device, field_of_view=field, view=(30.0, 25.0))
    rows, columns = np.flatnonzero(covered.any(axis=1)), np.flatnonzero(covered.any(axis=0))
    assert rows[0] >= 7 and columns[0] >= 7 and rows[-1] <= SIZE - 8 and columns[-1] <= SIZE - 8
    assert max(rows[-1] - rows[0], columns[-1] - columns[0]) >= 2 * REACH - 2


def test_concave_polygons_are_filled_to_their_outline(device):
    corners = [[0, 0, 0], [4, 0, 0], [4, 1, 0], [1, 1, 0], [1, 4, 0], [0, 4, 0]]
    covered = alpha(Layer(PolygonMesh.from_faces(corners, [list(range(6))])), device, **TOP)
    assert covered.sum() == pytest.approx(7 / 16 * (2 * REACH) ** 2, rel=5e-3)


# --- backgrounds and light ------------------------------------------------------------------------------------


def test_backgrounds(device):
    for background, expected in ((None, [0, 0, 0, 0]), ((1.0, 1.0, 1.0), [255] * 3), ((0.2, 0.4, 1.0), [51, 102, 255])):
        image = picture([Panel([Layer(sphere())])], Settings(**FRONT, background=background), device)
        assert image[0, 0].tolist() == expected
        assert image[SIZE // 2, SIZE // 2].tolist() != expected


def test_nothing_is_black_and_the_light_comes_from_above(device):
    image = picture([Panel([Layer(sphere())])], Settings(**FRONT), device)
    assert image.min() > 40
    column = image[:, SIZE // 2, 1].astype(int)
    assert column[SIZE // 4] > column[3 * SIZE // 4] + 30


def test_the_inside_has_another_color(device):
    panels = [Panel([Layer(square())], view=view) for view in ((0.0, 90.0), (0.0, -90.0))]
    image = picture(panels, Settings(**FRONT), device)
    top, bottom = image[SIZE // 2, SIZE // 2].astype(int), image[SIZE // 2, SIZE // 2 + SIZE].astype(int)
    assert top[2] > top[0] and bottom[0] > bottom[2]


def test_normals_are_shown_as_colors(device):
    layer = Layer(cube(), "normals")
    for view, expected in (((0, 90), [128, 128, 255]), ((90, 0), [255, 128, 128]), ((0, 0), [128, 0, 128])):
        image = picture([Panel([layer])], Settings(**FRONT | {"view": view}), device)
        np.testing.assert_allclose(image[SIZE // 2, SIZE // 2], expected, atol=1)


def test_shading_follows_the_normals(device):
    smooth = picture([Panel([Layer(sphere(), "normals")])], Settings(**FRONT), device)
    y, x = (np.indices((SIZE, SIZE)) + 0.5 - SIZE / 2) / REACH
    inside = x**2 + y**2 < 0.9
    exact = np.rint(255 * (0.5 + 0.5 * np.stack([x, -np.sqrt(np.maximum(1 - x**2 - y**2, 0)), -y], axis=-1)))
    assert np.abs(smooth - exact)[inside].max() <= 4
    # Flat faces have one color each.
    coarse = picture([Panel([Layer(truncated_icosahedron(), "normals", "flat")])], Settings(**FRONT), device)
    _, counts = np.unique(coarse[inside], axis=0, return_counts=True)
    assert counts[counts > 50].sum() > 0.8 * inside.sum()
    assert (counts > 50).sum() <= 16


# --- zebra ----------------------------------------------------------------------------------------------------


def runs(dark: np.ndarray) -> int:
    """How many times a line turns dark."""
    return int((dark[1:] & ~dark[:-1]).sum() + dark[0])


@pytest.mark.parametrize("stripes", [4, 10, 15])
def test_zebra_bands_on_a_sphere_are_those_of_the_mirrored_room(device, stripes):
    settings = Settings(**FRONT | {"size": (2 * SIZE, 2 * SIZE)}, stripes=stripes)
    image = picture([Panel([Layer(sphere(), "zebra")])], settings, device)
    # In the middle column a ray leaves at twice the elevation of the normal: its height is 2 y sqrt(1 - y^2).
    y = np.linspace(-0.9, 0.9, 20001)
    expected = np.mod(0.5 * stripes * 2 * y * np.sqrt(1 - y**2) + 0.25, 1) < 0.5
    rows = np.abs(np.arange(2 * SIZE) + 0.5 - SIZE) < 0.9 * 2 * REACH
    column = image[rows, SIZE, 1]
    assert runs(column < 80) == runs(expected)
    assert (column < 80).mean() == pytest.approx(expected.mean(), abs=0.06)
    assert column.min() < 60 and column.max() > 180


def test_a_flat_face_mirrors_one_place(device):
    image = picture([Panel([Layer(square(), "zebra")])], Settings(**TOP), device)
    assert np.ptp(image[20:-20, 20:-20, 1]) <= 1


def bent(smooth: bool) -> PolygonMesh:
    """A strip over a circular arc, with its normals or with those tilted on one half: a kink in the middle."""
    angles = np.linspace(-0.6, 0.6, 61)
    arc = np.stack([np.sin(angles), np.cos(angles)], axis=1)
    points = np.concatenate([np.c_[arc[:, 0], np.full(61, y), arc[:, 1]] for y in (-0.5, 0.5)])
    faces = np.array([[k, k + 1, 62 + k, 61 + k] for k in range(60)])
    corner_angles = angles[faces % 61]
    if not smooth:
        corner_angles[30:] += 0.12
    normals = np.stack([np.sin(corner_angles), 0 * corner_angles, np.cos(corner_angles)], axis=-1).reshape(-1, 3)
    return PolygonMesh.from_faces(points, faces.tolist(), corner_normals=normals)


def test_zebra_breaks_at_a_kink_and_nowhere_else(device):
    settings = Settings(**(TOP | {"view": (90.0, 90.0)}), stripes=6)
    jumps = []
    for smooth in (True, False):
        image = picture([Panel([Layer(bent(smooth), "zebra")])], settings, device)
        column = image[:, SIZE // 2, 1].astype(int)
        row = image[SIZE // 2 - 12 : SIZE // 2 + 12, SIZE // 2 - 5 : SIZE // 2 + 5]
        assert np.ptp(row, axis=1).max() <= 12  # the bands run across
        jumps.append(column)
    smooth_middle, kinked_middle = (column[SIZE // 2 - 3 : SIZE // 2 + 3] for column in jumps)
    assert np.abs(np.diff(smooth_middle)).max() < 20
    assert np.abs(np.diff(kinked_middle)).max() > 80


def test_bands_too_fine_to_see_are_gray(device):
    image = picture([Panel([Layer(sphere(), "zebra")])], Settings(**FRONT, stripes=3000), device)
    center = image[SIZE // 2 - 20 : SIZE // 2 + 20, SIZE // 2 - 20 : SIZE // 2 + 20, 1].astype(int)
    assert np.abs(np.diff(center, axis=0)).max() < 25


# --- lines ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("width", [0.5, 1.0, 3.0, 6.0])
def test_a_wire_covers_its_length_times_its_width(device, width):
    stroke = Stroke((0.0, 0.0, 0.0), width)
    frame = darkness(Layer(square(), wire=stroke), device, **TOP)
    # A frame whose outer half lies on the white background; corners are round.
    assert frame.sum() == pytest.approx(4 * 2 * REACH * width, rel=0.04)


def test_the_wire_is_that_of_the_polygons(device):
    frame = darkness(Layer(square(), wire=BLACK), device, **TOP)
    assert np.abs(frame[SIZE // 4 : -SIZE // 4, SIZE // 4 : -SIZE // 4]).max() < 0.01


def test_a_fine_wire_does_not_blacken(device):
    image = picture([Panel([Layer(sphere(), wire=Stroke())])], Settings(**FRONT), device)
    plain = picture([Panel([Layer(sphere())])], Settings(**FRONT), device)
    center = slice(SIZE // 4, -SIZE // 4)
    light = image[center, center].mean() / plain[center, center].mean()
    assert 0.6 < light < 0.97


def test_a_surface_hides_the_lines_behind_it(device):
    middle = slice(SIZE // 2 - 5, SIZE // 2 + 5)
    for z, hidden, seen in ((-0.5, 0.0, 0.0), (0.5, 0.0, 1.0), (-0.5, 0.4, 0.4), (0.0, 0.0, 1.0)):
        line = Lines(np.array([[[-0.5, 0, z], [0.5, 0, z]]]), Stroke((0.0, 0.0, 0.0), 5.0, hidden=hidden))
        dark = darkness(Layer(square(), lines=[line]), device, **TOP)
        assert dark[SIZE // 2, middle].max() == pytest.approx(seen, abs=0.02)


def test_the_inside_of_a_closed_mesh_does_not_shine_through(device):
    panel = Panel([Layer(truncated_icosahedron(), wire=Stroke(width=4.0))])
    for view in ((0.0, 0.0), (30.0, 25.0), (75.0, -40.0)):
        image = picture([panel], Settings(**FRONT | {"view": view}), device).astype(int)
        assert not (image[..., 0] > image[..., 2] + 4).any()


def test_lines_on_a_steep_surface_are_whole(device):
    edge = Lines(np.array([[[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]]), BLACK)
    dark = darkness(Layer(square(), lines=[edge]), device, **(FRONT | {"view": (90.0, 8.0)}))
    assert dark.sum() == pytest.approx(2 * REACH * 3, rel=0.05)


def test_lines_of_no_length_are_dots(device):
    dot = Lines(np.zeros((1, 2, 3)), Stroke((0.0, 0.0, 0.0), 20.0))
    dark = darkness(Layer(square(), lines=[dot]), device, **TOP)
    assert dark.sum() == pytest.approx(np.pi * 100, rel=0.02)


def test_a_control_mesh_shows_over_its_surface(device):
    # The cube lies inside of the ball that is made from it, but for its vertices.
    red = Stroke((1.0, 0.0, 0.0), 4.0)
    ball = Layer(curvify.refine(cube(), level=5))
    over = Layer(cube(), "hidden", wire=red, dots=Stroke((0.0, 0.0, 1.0), 10.0))
    plain, both = (
        picture([Panel(layers)], Settings(**FRONT | {"view": (30.0, 25.0)}), device).astype(int)
        for layers in ([ball], [ball, over])
    )
    is_red = (both[..., 0] > 200) & (both[..., 1] < 80)
    is_blue = (both[..., 2] > 200) & (both[..., 0] < 80)
    # Nine edges face the viewer and three do not; seven vertices do.
    assert 9 * 30 * 4 < is_red.sum() < 9 * 70 * 4
    assert is_blue.sum() == pytest.approx(7 * np.pi * 25, rel=0.15)
    untouched = (plain == both).all(axis=-1)
    assert untouched.mean() > 0.8


# --- values ---------------------------------------------------------------------------------------------------


def test_values_go_from_dark_to_light(device):
    dense = sphere()
    values = dense.positions[:, 2].copy()
    image = picture([Panel([Layer(dense, "values", values=values)])], Settings(**FRONT), device)
    column = image[SIZE // 2 - 60 : SIZE // 2 + 60, SIZE // 2].astype(int)
    assert column[0].sum() > column[-1].sum() + 250
    limited = Layer(dense, "values", values=values, limits=(-10.0, 10.0))
    middle = picture([Panel([limited])], Settings(**FRONT), device)[SIZE // 2 - 40 : SIZE // 2 + 40, SIZE // 2]
    assert np.ptp(middle.astype(int), axis=0).max() < 120
    values[:] = np.nan
    gray = picture([Panel([Layer(dense, "values", values=values)])], Settings(**FRONT), device)[SIZE // 2, SIZE // 2]
    assert np.ptp(gray.astype(int)) <= 8


def test_values_are_one_for_each_vertex(device):
    for values in (None, np.zeros(7), np.zeros((8, 1))):
        with pytest.raises(OptionError, match="8 vertices"):
            picture([Panel([Layer(cube(), "values", values=values)])], Settings(**FRONT), device)


# --- the picture as a whole -----------------------------------------------------------------------------------


def test_panels_stand_side_by_side(device):
    panels = [Panel([Layer(mesh)]) for mesh in (sphere(), cube(), sphere())]
    row = picture(panels, Settings(size=(60, 40)), device)
    assert row.shape == (40, 180, 3)
    np.testing.assert_array_equal(row[:, :60], row[:, 120:])
    rows = picture(panels, Settings(size=(60, 40), columns=2), device)
    assert rows.shape == (80, 120, 3)
    np.testing.assert_array_equal(rows[:40], row[:, :120])
    np.testing.assert_array_equal(rows[40:, :60], row[:, 120:])
    assert (rows[40:, 60:] == 255).all()


@pytest.mark.parametrize("background", [None, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)])
def test_captions_stand_under_their_panels(device, background):
    def ink(*texts: str) -> np.ndarray:
        panels = [Panel([Layer(sphere())], text) for text in texts]
        image = picture(panels, Settings(size=(120, 100), background=background), device)
        strip = image[100:].astype(int)
        return np.abs(strip - strip[:1, :1]).max(axis=-1, initial=0).reshape(len(strip), len(texts), 120)

    assert not ink("", "").size
    marked = ink("one", "")
    assert 10 < marked.shape[0] < 40
    assert marked[:, 0].max() > 100 and marked[:, 1].max() == 0
    # In the middle, and a longer text takes more ink but no more room than there is.
    columns = np.flatnonzero(marked[:, 0].any(axis=0))
    assert columns[0] + columns[-1] == pytest.approx(119, abs=3)
    long = ink("a caption that is far too long for such a small picture", "")
    assert long[:, 0].sum() > 2 * marked[:, 0].sum()
    assert long[:, 0, :3].max() == 0 and long[:, 0, -3:].max() == 0 and long[:, 1].max() == 0


def test_tiles_do_not_show(device, monkeypatch):
    dense = curvify.refine(cube(), level=3)
    panel = Panel([Layer(dense, "zebra", wire=Stroke()), Layer(cube(), "hidden", wire=BLACK, dots=BLACK)])
    whole = picture([panel], Settings(size=(90, 70)), device).astype(int)
    monkeypatch.setattr(render, "TILE", 128)
    tiled = picture([panel], Settings(size=(90, 70)), device).astype(int)
    assert np.abs(whole - tiled).max() <= 3
    assert (whole != tiled).mean() < 0.01


def test_the_same_picture_every_time_and_the_device_as_it_was(device):
    before = device.ctx.fbo
    panel = Panel([Layer(sphere(), "zebra", wire=Stroke())], "sphere")
    first, second = (picture([panel], Settings(size=(80, 60)), device) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert device.ctx.fbo is before
    np.testing.assert_array_equal(picture([panel], Settings(size=(80, 60))), first)


def test_what_cannot_be_drawn(device):
    with pytest.raises(OptionError, match="style"):
        picture([Panel([Layer(cube(), "glass")])], Settings(), device)
    with pytest.raises(OptionError, match="shading"):
        picture([Panel([Layer(cube(), shading="round")])], Settings(), device)
    empty = PolygonMesh(np.zeros((3, 3)), np.zeros(1, dtype=int), np.zeros(0, dtype=int))
    with pytest.raises(MeshError, match="no faces"):
        picture([Panel([Layer(empty)])], Settings(), device)
    # The device is fit for more.
    assert picture([Panel([Layer(cube())])], Settings(size=(8, 8)), device).shape == (8, 8, 3)
