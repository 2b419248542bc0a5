"""Cameras: named views, and the closest camera of a view that sees a whole mesh.

Eye coordinates are x to the right, y up and z towards the viewer. A perspective camera is fitted exactly, without
iteration: each side of the frustum is a plane that has to lie outside of all points, so that its place follows from
one maximum over the points, and two opposite planes meet where the eye may stand at the closest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curvify.errors import OptionError
from curvify.mesh import Floats

#: Azimuth and elevation, in degrees: 0, 0 looks at the front, a growing azimuth goes around to the right side.
VIEWS = {
    "oblique": (30.0, 25.0),
    "front": (0.0, 0.0),
    "right": (90.0, 0.0),
    "back": (180.0, 0.0),
    "left": (-90.0, 0.0),
    "top": (0.0, 90.0),
    "bottom": (0.0, -90.0),
    "isometric": (45.0, float(np.degrees(np.arctan(np.sqrt(0.5))))),
}
UPS = ("z", "y")
#: Angle of view across the shorter side of the picture, in degrees: a longish lens, which distorts little.
FIELD_OF_VIEW = 24.0
WIDEST = 120.0
#: Part of the picture's width and height that stays free on each side.
MARGIN = 0.05


@dataclass(frozen=True)
class Camera:
    """Where the eye is and what it sees.

    ``rotation (3,3)`` turns the world into eye coordinates; ``eye (3,)`` is the viewer's place in these. A point at
    ``(x, y, z)`` from the eye is inside where ``|x| <= spread[0] w`` and ``|y| <= spread[1] w``, with ``w = -z`` in
    perspective and ``w = 1`` in a parallel projection, and ``near <= -z <= far``.
    """

    rotation: Floats
    eye: Floats
    spread: Floats
    near: float
    far: float
    perspective: bool

    @property
    def view(self) -> Floats:
        """World to eye coordinates from the eye ``(4,4)``, for column vectors."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation
        matrix[:3, 3] = -self.eye
        return matrix

    @property
    def projection(self) -> Floats:
        """Eye coordinates to clip coordinates ``(4,4)``, for column vectors."""
        near, far = self.near, self.far
        matrix = np.diag([1 / self.spread[0], 1 / self.spread[1], 0.0, 0.0])
        if self.perspective:
            matrix[2, 2:] = -(far + near) / (far - near), -2 * far * near / (far - near)
            matrix[3, 2] = -1
        else:
            matrix[2, 2:] = -2 / (far - near), -(far + near) / (far - near)
            matrix[3, 3] = 1
        return matrix

    def project(self, points: Floats) -> Floats:
        """Places ``(n,2)`` of points ``(n,3)`` in the picture, -1 to 1 from left to right and from bottom to top."""
        seen = points @ self.rotation.T - self.eye
        return seen[:, :2] / self.spread / (-seen[:, 2:] if self.perspective else 1.0)


def parse_view(text: str) -> tuple[float, float]:
    """Azimuth and elevation in degrees from a name of ``VIEWS`` or ``AZIMUTH,ELEVATION``. Raises OptionError."""
    if text in VIEWS:
        return VIEWS[text]
    try:
        azimuth, elevation = (float(part) for part in text.split(","))
    except ValueError:
        known = ", ".join(VIEWS)
        raise OptionError(
            f"unknown view '{text}'; choose from {known}, or give azimuth and elevation in degrees, as in 30,25"
        ) from None
    if not (np.isfinite(azimuth) and abs(elevation) <= 90):
        raise OptionError(f"view '{text}': the elevation must be between -90 and 90 degrees")
    return azimuth, elevation


def view_rotation(azimuth: float, elevation: float, up: str = "z") -> Floats:
    """The rotation ``(3,3)`` of a view: its rows are right, up and towards the viewer, in world coordinates.

    The front is seen from -y where z is up, and from +z where y is up; the right side is at +x.
    """
    around, above = np.radians([azimuth, elevation])
    right = np.array([np.cos(around), np.sin(around), 0.0])
    level = np.array([np.sin(around), -np.cos(around), 0.0])
    towards = np.cos(above) * level + np.sin(above) * np.array([0.0, 0.0, 1.0])
    rotation = np.stack([right, np.cross(towards, right), towards])
    return rotation if up == "z" else rotation[:, [0, 2, 1]] * np.array([1.0, 1.0, -1.0])


def fit_cameras(
    points: Sequence[Floats], rotations: Sequence[Floats], aspect: float, field_of_view: float = FIELD_OF_VIEW
) -> list[Camera]:
    """The closest eye that sees each set of points ``(n,3)`` turned by its rotation, as a camera for each.

    With one set that is the fitted camera of a view; with the rotations of a turntable the eye stays where it is, and
    the mesh turns around the origin. ``aspect`` is width over height of the picture, ``field_of_view`` the angle across
    its shorter side in degrees, 0 for a parallel projection. Points in one place are seen from some way off.
    """
    shape = np.array([aspect, 1.0]) / min(aspect, 1.0)
    perspective = field_of_view > 0
    spread = shape * np.tan(np.radians(field_of_view) / 2) if perspective else shape
    slope = spread * (1 - 2 * MARGIN)
    lean = slope[:, None] if perspective else np.zeros((2, 1))
    right, left, depths = np.full(2, -np.inf), np.full(2, -np.inf), []
    for part, rotation in zip(points, rotations, strict=True):
        across, depth = np.split(rotation @ part.T, [2])
        right = np.maximum(right, (across + lean * depth).max(axis=1))
        left = np.maximum(left, (lean * depth - across).max(axis=1))
        depths.append((float(depth.min()), float(depth.max())))
    highest = max(high for _, high in depths)
    size = max(1e-30, *(max(np.ptp(part, axis=0).max(), 1e-6 * np.abs(part).max()) for part in points))
    reach = float(((right + left) / (2 * slope)).max())
    if not perspective:
        spread = shape * max(reach, size / 1000)
    away = max(reach, highest + size / 20) if perspective else highest + size
    eye = np.array([*(right - left) / 2, away])
    return [
        Camera(rotation, eye, spread, *_depth_range(eye[2] - high, eye[2] - low), perspective)
        for rotation, (low, high) in zip(rotations, depths, strict=True)
    ]


def _depth_range(nearest: float, farthest: float) -> tuple[float, float]:
    """Near and far plane around these distances.

    There is much room behind: surfaces are drawn farther away than they are, so that the lines on them stay in front,
    and where they are steep that is far.
    """
    extent = farthest - nearest + 0.01 * nearest
    return max(nearest - 0.02 * extent, 0.2 * nearest), farthest + 8 * extent
