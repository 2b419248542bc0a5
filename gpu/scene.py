"""What a picture shows: panels side by side, each with layers of meshes and lines, seen from a fitted camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from curvify.errors import MeshError, OptionError
from curvify.gpu.camera import FIELD_OF_VIEW, UPS, VIEWS, WIDEST, Camera, fit_cameras, view_rotation
from curvify.gpu.colors import Color
from curvify.gpu.scale import Scale
from curvify.mesh import DenseMesh, Floats, PolygonMesh
from curvify.prepare import LARGEST_COORDINATE

#: How a layer's surface looks; ``hidden`` shows nothing but hides the lines behind it.
STYLES = ("shaded", "zebra", "normals", "values", "hidden")
FITS = ("auto", "same", "each")
#: Pixels of a panel in each direction, and of the whole picture.
LARGEST_SIDE, MOST_PIXELS = 16_384, 1 << 27
#: Boxes at most this part of their size apart, and this much smaller than one another, are versions of one mesh.
NEARLY_SAME = 0.2, 0.6


@dataclass(frozen=True)
class Stroke:
    """How lines look: color as a screen shows it, width in pixels, opacity where seen and behind the surface."""

    color: Color = (0.06, 0.07, 0.09)
    width: float = 1.1
    opacity: float = 1.0
    hidden: float = 0.0


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight lines ``points (n,2,3)``; those whose ends are equal are dots."""

    points: Floats
    stroke: Stroke = field(default_factory=Stroke)


@dataclass(frozen=True, eq=False)
class Layer:
    """A mesh and what is drawn with it. Each layer covers the ones before it, however near they are.

    ``style`` as in ``STYLES``, ``shading`` as in `curvify.gpu.shading`; ``wire`` draws the polygons' edges, ``dots``
    their vertices. ``values (V,)`` are what the style ``values`` colors, from ``limits[0]`` to ``limits[1]`` (by
    default those of the settings' scale, or else their own); NaN is gray.
    """

    mesh: PolygonMesh | DenseMesh
    style: str = "shaded"
    shading: str = "auto"
    wire: Stroke | None = None
    dots: Stroke | None = None
    lines: Sequence[Lines] = ()
    values: Floats | None = None
    limits: tuple[float, float] | None = None

    def check(self, polygons: PolygonMesh) -> None:
        """Raise OptionError for a layer that cannot be drawn; ``polygons`` are its mesh's."""
        if self.style not in STYLES:
            raise OptionError(f"style must be one of {', '.join(STYLES)}, not {self.style!r}")
        count = polygons.vertex_count
        if self.style == "values" and (self.values is None or self.values.shape != (count,)):
            raise OptionError(f"the style values needs a value for each of the mesh's {count} vertices")


@dataclass(frozen=True, eq=False)
class Panel:
    """One picture among those side by side. ``view``: azimuth and elevation, the settings' own where None."""

    layers: Sequence[Layer]
    caption: str = ""
    view: tuple[float, float] | None = None


@dataclass(frozen=True)
class Settings:
    """How a picture is taken.

    ``size``: width and height of a panel in pixels. ``background`` None is transparent. ``field_of_view`` in degrees, 0
    for a parallel projection. ``fit``: the ``same`` camera for all panels, one for ``each`` mesh, or ``auto``: the same
    where all show about the same box. ``columns`` panels stand in a row, all by default. ``stripes``: dark bands of
    the room that a zebra mirrors, from floor to ceiling. ``color`` and ``back``: the two sides of a shaded surface.
    ``scale``: what the colors of values mean, shown under the picture.
    """

    size: tuple[int, int] = (800, 600)
    background: Color | None = (1.0, 1.0, 1.0)
    view: tuple[float, float] = VIEWS["oblique"]
    up: str = "z"
    field_of_view: float = FIELD_OF_VIEW
    fit: str = "auto"
    columns: int | None = None
    stripes: int = 10
    color: Color = (153 / 255, 179 / 255, 209 / 255)
    back: Color = (0.84, 0.62, 0.48)
    scale: Scale | None = None

    def check(self, panels: int) -> None:
        """Raise OptionError for what cannot be."""
        width, height = self.size
        if min(self.size) < 1 or max(self.size) > LARGEST_SIDE or panels * width * height > MOST_PIXELS:
            raise OptionError(
                f"{panels} x {width}x{height} pixels: a picture may have {LARGEST_SIDE} in each direction and "
                f"{MOST_PIXELS >> 20} million in all; choose a smaller --size"
            )
        if self.stripes < 1 or (self.columns is not None and self.columns < 1):
            raise OptionError(f"stripes and columns must be 1 or more, not {self.stripes} and {self.columns}")
        if self.up not in UPS:
            raise OptionError(f"up must be one of {', '.join(UPS)}, not {self.up!r}")
        if self.fit not in FITS:
            raise OptionError(f"fit must be one of {', '.join(FITS)}, not {self.fit!r}")
        if not 0 <= self.field_of_view <= WIDEST:
            raise OptionError(f"the field of view must be between 0 and {WIDEST:g} degrees, not {self.field_of_view:g}")


@dataclass(frozen=True, eq=False)
class Place:
    """Where the drawn world's origin and unit lie in that of the meshes: what is drawn is about 1 large, around 0."""

    center: Floats
    scale: float

    def __call__(self, points: Floats) -> Floats:
        """Points ``(n,3)`` of a mesh in the drawn world, float32; infinite where nothing that is shown can be."""
        with np.errstate(over="ignore"):
            return ((points - self.center) * self.scale).astype(np.float32)


def place_panels(
    points: Sequence[Floats],
    views: Sequence[tuple[float, float]],
    settings: Settings,
    meshes: Sequence[object] | None = None,
) -> list[tuple[Place, Camera]]:
    """For the points ``(n,3)`` and the view of each panel: where its world lies, and the camera that sees it.

    Panels with equal entries of ``meshes`` show the same, and always share an eye.

    Raises MeshError for points that are too far away to be computed with.
    """
    boxes = np.array([[part.min(axis=0), part.max(axis=0)] for part in points])
    if np.abs(boxes).max() > LARGEST_COORDINATE:
        extent = float(np.abs(boxes).max())
        raise MeshError(f"a coordinate is as large as {extent:.3g}; scale the mesh below {LARGEST_COORDINATE:.0e}")
    together = settings.fit == "same" or (settings.fit == "auto" and nearly_same(boxes))
    groups = [list(range(len(points)))] if together else _equal(meshes or range(len(points)))
    result: list[tuple[Place, Camera]] = [None] * len(points)  # type: ignore[list-item]
    for group in groups:
        low, high = boxes[group, 0].min(axis=0), boxes[group, 1].max(axis=0)
        size = float((high - low).max())
        place = Place((low + high) / 2, 1 / max(size, 1 / LARGEST_COORDINATE))
        seen = [place(points[k]) for k in group]
        rotations = [view_rotation(*views[k], settings.up) for k in group]
        cameras = fit_cameras(seen, rotations, settings.size[0] / settings.size[1], settings.field_of_view)
        for k, camera in zip(group, cameras, strict=True):
            result[k] = place, camera
    return result


def _equal(labels: Sequence[object]) -> list[list[int]]:
    """Places of equal labels."""
    groups: dict[object, list[int]] = {}
    for k, label in enumerate(labels):
        groups.setdefault(label, []).append(k)
    return list(groups.values())


def nearly_same(boxes: Floats) -> bool:
    """Whether boxes ``(n,2,3)`` may be those of versions of one mesh: about as large, about in one place."""
    apart, smaller = NEARLY_SAME
    size = np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1)
    middle = boxes.mean(axis=1)
    away = np.linalg.norm(middle - middle[0], axis=1).max()
    return bool(size.min() >= smaller * size.max() and away <= apart * size.max())
