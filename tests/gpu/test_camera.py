"""Cameras see all of what they are fitted to, and no more than they must; views are what their names say."""

from __future__ import annotations

import numpy as np
import pytest

from curvify.errors import MeshError, OptionError
from curvify.gpu.camera import MARGIN, VIEWS, fit_cameras, parse_view, view_rotation
from curvify.gpu.scene import Settings, nearly_same, place_panels

RANDOM = np.random.default_rng(4)
CLOUDS = {
    "cloud": RANDOM.normal(size=(200, 3)),
    "off center": RANDOM.normal(size=(50, 3)) * [1, 3, 0.2] + [40, -7, 3],
    "rod": np.linspace([0, 0, 0], [1, 2, 30], 20),
    "plane": np.c_[RANDOM.uniform(size=(30, 2)), np.zeros(30)],
}
INSIDE = 1 - 2 * MARGIN


@pytest.mark.parametrize("field", [0.0, 10.0, 24.0, 100.0])
@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.5])
@pytest.mark.parametrize("cloud", CLOUDS)
def test_the_fitted_camera_is_the_closest_that_sees_everything(cloud, aspect, field):
    for view in [(30, 25), (0, 0), (200, -50), (0, 90)]:
        points = CLOUDS[cloud]
        camera = fit_cameras([points], [view_rotation(*view)], aspect, field)[0]
        seen = camera.project(points)
        assert np.abs(seen).max() <= INSIDE + 1e-9
        # The tighter direction is filled from margin to margin, unless the eye would come too close to the points.
        low, high = seen.min(axis=0), seen.max(axis=0)
        k = int(np.argmax(high - low))
        nearest = camera.eye[2] - (points @ camera.rotation[2]).max()
        if field == 0 or nearest > 0.05001 * np.ptp(points, axis=0).max():
            assert (low[k], high[k]) == pytest.approx((-INSIDE, INSIDE), abs=1e-6)
        clip = np.c_[points, np.ones(len(points))] @ (camera.projection @ camera.view).T
        np.testing.assert_allclose(clip[:, :2] / clip[:, 3:], seen, atol=1e-9)
        assert np.abs(clip[:, 2] / clip[:, 3]).max() < 1
        assert clip[:, 3].min() > 0


@pytest.mark.parametrize("field", [0.0, 24.0])
def test_points_in_one_place_are_seen(field):
    camera = fit_cameras([np.full((3, 3), 7.0)], [view_rotation(10, 20)], 1.5, field)[0]
    np.testing.assert_allclose(camera.project(np.full((1, 3), 7.0)), 0, atol=1e-6)
    assert 0 < camera.near < camera.far


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("name", VIEWS)
def test_rotations_are_rotations(name, up):
    rotation = view_rotation(*VIEWS[name], up)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(rotation) == pytest.approx(1)
    # What points up never leans to a side.
    assert rotation[0] @ (np.array([0, 0, 1]) if up == "z" else np.array([0, 1, 0])) == pytest.approx(0)


@pytest.mark.parametrize(
    ("up", "name", "right", "towards"),
    [
        ("z", "front", [1, 0, 0], [0, -1, 0]),
        ("z", "right", [0, 1, 0], [1, 0, 0]),
        ("z", "back", [-1, 0, 0], [0, 1, 0]),
        ("z", "left", [0, -1, 0], [-1, 0, 0]),
        ("z", "top", [1, 0, 0], [0, 0, 1]),
        ("z", "bottom", [1, 0, 0], [0, 0, -1]),
        ("y", "front", [1, 0, 0], [0, 0, 1]),
        ("y", "right", [0, 0, -1], [1, 0, 0]),
        ("y", "top", [1, 0, 0], [0, 1, 0]),
    ],
)
def test_views_by_name(up, name, right, towards):
    rotation = view_rotation(*parse_view(name), up)
    np.testing.assert_allclose(rotation[0], right, atol=1e-15)
    np.testing.assert_allclose(rotation[2], towards, atol=1e-15)


def test_isometric_shows_the_axes_equally_long():
    rotation = view_rotation(*VIEWS["isometric"])
    np.testing.assert_allclose(np.linalg.norm(rotation[:2], axis=0), np.sqrt(2 / 3))


def test_views_by_number():
    assert parse_view("30,25") == (30, 25)
    assert parse_view(" -12.5 , -90") == (-12.5, -90)


@pytest.mark.parametrize("text", ["", "above", "1", "1,2,3", "0,91", "nan,0", "0,nan", "inf,0"])
def test_what_is_no_view(text):
    with pytest.raises(OptionError, match="view"):
        parse_view(text)


def test_a_turntable_turns_before_one_eye():
    points = CLOUDS["cloud"]
    cameras = fit_cameras([points] * 8, [view_rotation(angle, 20) for angle in range(0, 360, 45)], 1.0)
    for camera in cameras:
        np.testing.assert_array_equal(camera.eye, cameras[0].eye)
        assert np.abs(camera.project(points)).max() <= INSIDE + 1e-9


def test_points_too_far_away_to_compute_with():
    with pytest.raises(MeshError, match="1e\\+31"):
        place_panels([CLOUDS["cloud"], np.array([[0, 0, 0], [1e31, 0, 0]])], [(0.0, 0.0)] * 2, Settings())


def test_versions_of_a_mesh_share_a_camera_and_others_do_not():
    one = CLOUDS["cloud"]
    front = [(0.0, 0.0)] * 2
    (place, camera), (other_place, other) = place_panels([one, 1.1 * one], front, Settings())
    assert camera is not None
    np.testing.assert_array_equal(camera.eye, other.eye)
    np.testing.assert_array_equal(place.center, other_place.center)
    small = 0.01 * one + 5
    for fit, same in (("auto", False), ("each", False), ("same", True)):
        (place, _), (other_place, _) = place_panels([one, small], front, Settings(fit=fit))
        assert (place.scale == other_place.scale) == same
    assert nearly_same(np.array([[[0, 0, 0], [1, 1, 1]], [[0, 0, 0], [1, 1, 0.9]]], dtype=float))


@pytest.mark.parametrize(
    "wrong",
    [
        {"size": (0, 5)},
        {"size": (17000, 5)},
        {"stripes": 0},
        {"columns": 0},
        {"up": "x"},
        {"fit": "all"},
        {"field_of_view": 121},
        {"field_of_view": -1},
        {"field_of_view": np.nan},
    ],
)
def test_settings_that_cannot_be(wrong):
    with pytest.raises(OptionError):
        Settings(**wrong).check(1)


def test_too_many_pixels_in_all():
    Settings(size=(4000, 4000)).check(4)
    with pytest.raises(OptionError, match="million"):
        Settings(size=(4000, 4000)).check(9)
