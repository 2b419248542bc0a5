"""Meshes as one self-contained web page, drawn with WebGL 2 by the shaders that draw pictures.

The page needs no network and no server: styles, scripts and shaders stand in it, and the meshes as arrays that are
packed as differences between rows, split into planes of bytes, deflated, and written as base64.
"""

from __future__ import annotations

import base64
import html
import json
import re
import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curvify.errors import MeshError, OptionError
from curvify.gpu.render import shader_source, shares
from curvify.gpu.scale import Scale, scale_of, texts
from curvify.gpu.scene import Layer, Place, Settings, Stroke, place_panels
from curvify.gpu.shapes import Shapes
from curvify.palette import NO_VALUE_COLOR, VALUE_COLORS, light_of, to_linear, value_stops
from curvify.words import count_of

FOLDER = Path(__file__).parent / "viewer"
#: In the order in which they run.
SCRIPTS = ("arrays.js", "camera.js", "drawing.js", "controls.js", "main.js")
SHADERS = ("surface.vert", "surface.frag", "line.vert", "line.frag")
#: More triangles than this are more than browsers take.
MOST_TRIANGLES = 10_000_000
STYLES = ("shaded", "zebra", "normals", "values")
#: Edges and vertices of a control mesh that does not say how they look.
PLAIN, DOT = Stroke(), Stroke(width=5.0)


def viewer_page(
    layers: Sequence[Layer], names: Sequence[str], control: Layer | None = None, settings: Settings | None = None
) -> str:
    """The HTML text of a page that shows the mesh of one of the layers at a time.

    The first layer tells the style to start with, and whether with the edges of the polygons; all can be shown in every
    style, with values if all have them. ``names`` are chosen from. ``control`` can be laid over all of them. Of the
    settings ``view``, ``up``, ``fit``, ``field_of_view``, ``background``, ``stripes``, ``scale`` and the colors count.
    Raises OptionError and MeshError for what cannot be shown.
    """
    settings = settings or Settings()
    if not layers or len(layers) != len(names):
        raise OptionError(f"a page needs a mesh or more, and a name for each: {len(layers)} and {len(names)} are given")
    if settings.field_of_view == 0:
        raise OptionError("a page needs a field of view above 0")
    every = [*layers, *([control] if control is not None else [])]
    shapes = Shapes()
    _check(layers, every, shapes)
    if all(layer.values is not None for layer in layers):
        scale = settings.scale or scale_of([layer.values for layer in layers if layer.values is not None])
        settings = replace(settings, scale=scale)
    if control is not None:
        settings = replace(settings, fit="same")
    places, radii = _places(layers, control, shapes, settings)
    scene = {
        "models": [
            {
                "name": name,
                "facts": _facts(layer, shapes, name),
                "radius": radius,
                "arrays": _arrays(layer, shapes, place, settings.scale),
            }
            for layer, name, place, radius in zip(layers, names, places, radii, strict=True)
        ],
        "control": None if control is None else {"arrays": _arrays(control, shapes, places[0], None)},
        "scale": _scale(settings.scale),
        "shaders": {name.replace(".", "_"): _shader(name) for name in SHADERS},
        "look": {**_look(layers[0], control, settings), "edges": _edges(layers, shapes, places)},
    }
    return _filled(", ".join(dict.fromkeys(names)), scene)


def _check(layers: Sequence[Layer], every: Sequence[Layer], shapes: Shapes) -> None:
    """Raise OptionError or MeshError for layers that cannot be shown; ``every`` includes the control mesh."""
    for layer in every:
        layer.check(shapes.polygons(layer.mesh))
    if layers[0].style not in STYLES:
        raise OptionError(f"a page starts with one of {', '.join(STYLES)}, not {layers[0].style!r}")
    if len({layer.values is None for layer in layers}) > 1:
        raise OptionError("either all meshes of a page have values or none")
    count = sum(len(shapes.triangles(layer.mesh, layer.shading).triangles) for layer in every)
    if count > MOST_TRIANGLES:
        raise MeshError(f"{count:,} triangles are more than a page may hold, {MOST_TRIANGLES:,}; use coarser meshes")


def _places(
    layers: Sequence[Layer], control: Layer | None, shapes: Shapes, settings: Settings
) -> tuple[list[Place], list[float]]:
    """Where each layer's world lies, and the radius of a ball around what is seen there."""
    over = [] if control is None else [control]
    points = [
        np.concatenate([shapes.polygons(part.mesh).positions[shapes.vertices(part.mesh)] for part in (layer, *over)])
        for layer in layers
    ]
    places = [place for place, _ in place_panels(points, [settings.view] * len(layers), settings)]
    radii: dict[int, float] = {}
    for place, part in zip(places, points, strict=True):
        reach = float(np.linalg.norm(place(part), axis=1).max())
        radii[id(place)] = max(reach, radii.get(id(place), 1e-6))
    return places, [radii[id(place)] for place in places]


def _facts(layer: Layer, shapes: Shapes, name: str) -> str:
    """A line about a mesh."""
    faces = shapes.polygons(layer.mesh).face_count
    return f"{name}: {count_of(faces, 'face')}, {count_of(len(shapes.vertices(layer.mesh)), 'vertex', 'vertices')}"


def _arrays(layer: Layer, shapes: Shapes, place: Place, scale: Scale | None) -> dict[str, Any]:
    """The packed arrays of a layer: wedges, triangles between them, and edges and dots, which are vertices."""
    shape = shapes.triangles(layer.mesh, layer.shading)
    points = place(shapes.polygons(layer.mesh).positions)[shape.vertices]
    dots = shapes.vertices(layer.mesh) if layer.dots is not None else np.zeros(0, dtype=np.int64)
    arrays: dict[str, NDArray[Any]] = {
        "points": points.astype("<f4"),
        "normals": np.rint(32767 * shape.normals).astype("<i2"),
        "triangles": shape.triangles.astype("<u4"),
        "edges": shapes.edges(layer.mesh).astype("<u4"),
        "dots": dots[:, None].astype("<u4"),
    }
    if scale is not None and layer.values is not None:
        values = shares(layer.values, (scale.low, scale.high))[shape.vertices]
        arrays["values"] = values[:, None].astype("<f4")
    return {name: pack(array) for name, array in arrays.items()}


def pack(array: NDArray[Any]) -> dict[str, Any]:
    """An array ``(n,w)`` of 2 or 4 bytes a number as the page's arrays.js unpacks it."""
    count, width = array.shape
    bits = np.ascontiguousarray(array).view(f"<u{array.itemsize}")
    steps = bits.copy()
    steps[1:] -= bits[:-1]  # modulo the range of the type
    planes = steps.reshape(-1).view(np.uint8).reshape(-1, array.itemsize).T
    data = base64.b64encode(zlib.compress(planes.tobytes(), 6)).decode()
    return {"kind": array.dtype.str[1:], "width": width, "count": count, "data": data}


def _edges(layers: Sequence[Layer], shapes: Shapes, places: Sequence[Place]) -> list[float]:
    """Median length of the edges of each layer, as drawn."""
    result = []
    for layer, place in zip(layers, places, strict=True):
        ends = place(shapes.polygons(layer.mesh).positions)[shapes.edges(layer.mesh)]
        result.append(float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))))
    return result


def _scale(scale: Scale | None) -> dict[str, Any] | None:
    """The scale as the page shows it."""
    if scale is None:
        return None
    low, *_, high = texts(scale.ticks)
    return {"low": low, "high": high, "what": scale.title, "colors": VALUE_COLORS}


def _shader(name: str) -> str:
    """A shader without its first line: what version of which language it is in, drawing.js says itself."""
    return shader_source(name).partition("\n")[2]


def _look(first: Layer, control: Layer | None, settings: Settings) -> dict[str, Any]:
    """What the page starts with, colors and lines. Colors of surfaces are linear light, others as shown."""

    def stroke(given: Stroke | None, plain: Stroke) -> dict[str, Any]:
        chosen = given or plain
        return {"color": chosen.color, "width": chosen.width, "hidden": chosen.hidden}

    return {
        "style": first.style,
        "wire": first.wire is not None,
        "control": control is not None,
        "view": settings.view,
        "up": settings.up,
        "angle": float(np.radians(settings.field_of_view)),
        "background": settings.background or (1.0, 1.0, 1.0),
        "front": to_linear(settings.color).tolist(),
        "back": to_linear(settings.back).tolist(),
        "stops": value_stops().tolist(),
        "none": light_of(NO_VALUE_COLOR).tolist(),
        "stripes": settings.stripes,
        "lines": stroke(first.wire, PLAIN),
        "control_lines": stroke(control.wire if control else None, PLAIN),
        "control_dots": stroke(control.dots if control else None, DOT),
    }


def _filled(title: str, scene: dict[str, Any]) -> str:
    """The page with its parts in place."""
    parts = {
        "title": html.escape(title),
        "style": (FOLDER / "viewer.css").read_text(encoding="utf-8"),
        "script": "\n".join((FOLDER / name).read_text(encoding="utf-8") for name in SCRIPTS),
        # No name of a file ends the script that it stands in.
        "scene": json.dumps(scene).replace("<", "\\u003c"),
    }
    page = (FOLDER / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\{(title|style|script|scene)\}", lambda found: parts[found[1]], page)
