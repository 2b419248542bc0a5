"""Drawing panels on an OpenGL 3.3 device into arrays of linear light.

Surfaces are triangles, lines are quads that know how much of a pixel they cover. Everything is drawn at four times the
size in each direction and averaged in linear light, which on software OpenGL takes a third of the time of multisampling
and smooths what shaders do as well. Large panels are drawn in tiles.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from curvify.gpu.camera import Camera
from curvify.gpu.colors import Image, to_bytes
from curvify.gpu.device import Device
from curvify.gpu.scene import Layer, Panel, Place, Settings, Stroke, place_panels
from curvify.gpu.shapes import Shapes
from curvify.gpu.triangles import Triangles
from curvify.mesh import Floats
from curvify.palette import NO_VALUE_COLOR, light_of, to_linear, value_stops

if TYPE_CHECKING:
    import moderngl

#: Everything is drawn this many times as large in each direction, and averaged.
FINER = 4
#: Pixels of a tile in each direction, before averaging.
TILE = 4096
#: Wire lines are at most this part of the median edge wide, as seen: a fine wire shades rather than blackens.
WIDEST_WIRE = 0.12
#: Numbers of the styles in the shader.
_STYLES = {"shaded": 0, "zebra": 1, "normals": 2, "values": 3}


def draw_panels(panels: Sequence[Panel], settings: Settings, device: Device) -> list[Image]:
    """Pictures of the panels ``(height,width,3)`` or, without a background, ``(height,width,4)``, uint8.

    Raises OptionError and MeshError for what cannot be drawn, DeviceError where the device fails.
    """
    settings.check(len(panels))
    shapes = Shapes()
    for panel in panels:
        for layer in panel.layers:
            layer.check(shapes.polygons(layer.mesh))
    points = [_shown_points(panel.layers, shapes) for panel in panels]
    meshes = [tuple(id(layer.mesh) for layer in panel.layers) for panel in panels]
    placed = place_panels(points, [panel.view or settings.view for panel in panels], settings, meshes)
    with Painter(device, settings, shapes) as painter:
        return [
            painter.draw(panel.layers, place, camera) for panel, (place, camera) in zip(panels, placed, strict=True)
        ]


def _shown_points(layers: Sequence[Layer], shapes: Shapes) -> Floats:
    """The ends of everything in a panel ``(n,3)``: what the camera has to see."""
    corners = [shapes.polygons(layer.mesh).positions[shapes.vertices(layer.mesh)] for layer in layers]
    return np.concatenate([*corners, *(part.points.reshape(-1, 3) for layer in layers for part in layer.lines)])


class Painter:
    """Shaders and framebuffers of a device, for panels of one size; to be used as a context manager."""

    def __init__(self, device: Device, settings: Settings, shapes: Shapes) -> None:
        self.device, self.settings, self.shapes = device, settings, shapes
        self.size = settings.size[0] * FINER, settings.size[1] * FINER
        self._held = ExitStack()

    def __enter__(self) -> Painter:
        ctx = self.device.ctx
        # Framebuffers that are released while bound would leave the context without any.
        self._before = ctx.fbo
        self.surface = self._hold(_program(ctx, "surface"))
        self.line = self._hold(_program(ctx, "line"))
        tile = min(TILE, self.size[0]), min(TILE, self.size[1])
        self.pixels = self._hold(ctx.texture(tile, 4, dtype="f2"))
        depth = self._hold(ctx.depth_renderbuffer(tile))
        self.drawn = self._hold(ctx.framebuffer([self.pixels], depth))
        small = tile[0] // FINER, tile[1] // FINER
        self.averaged = self._hold(ctx.framebuffer([self._hold(ctx.renderbuffer(small, 4, dtype="f4"))]))
        average = self._hold(_program(ctx, "average"))
        _set(average, finer=FINER, drawn=0)
        self.average = self._hold(ctx.vertex_array(average, []))
        self._set_colors()
        return self

    def __exit__(self, *_: object) -> None:
        self._before.use()
        self._held.close()

    def _hold(self, resource: Any) -> Any:
        """A resource of the device, released at the end."""
        self._held.callback(resource.release)
        return resource

    def _set_colors(self) -> None:
        settings = self.settings
        _set(
            self.surface,
            front_color=to_linear(settings.color),
            back_color=to_linear(settings.back),
            stripes=settings.stripes,
            stops=value_stops(),
            no_value_color=light_of(NO_VALUE_COLOR),
        )

    def draw(self, layers: Sequence[Layer], place: Place, camera: Camera) -> Image:
        """A panel of layers as ``(height,width,3|4)``."""
        width, height = self.settings.size
        image = np.empty((height, width, 4 if self.settings.background is None else 3), dtype=np.uint8)
        with ExitStack() as held:
            drawings = [_Drawing(self, layer, place, camera, held) for layer in layers]
            for x, y, wide, high in _tiles(self.size):
                self._begin(x, y, wide, high, camera)
                for drawing in drawings:
                    drawing.draw()
                part = to_bytes(self._read(wide, high), self.settings.background)
                top = height - (y + high) // FINER
                image[top : top + high // FINER, x // FINER : (x + wide) // FINER] = part
        self.device.check("choose a smaller --size or a coarser mesh")
        return image

    def _begin(self, x: int, y: int, wide: int, high: int, camera: Camera) -> None:
        """Turn to a tile whose lower left corner is at ``x, y``."""
        ctx, size = self.device.ctx, np.array(self.size)
        extent = np.array([wide, high])
        onto = np.eye(4)  # what the tile shows fills the range from -1 to 1
        onto[[0, 1], [0, 1]] = size / extent
        onto[:2, 3] = (size - 2 * np.array([x, y]) - extent) / extent
        self.drawn.use()
        ctx.viewport = (0, 0, wide, high)
        self.drawn.clear(0.0, 0.0, 0.0, 0.0)
        for program in (self.surface, self.line):
            _set(program, view=camera.view.T, projection=(onto @ camera.projection).T)
        _set(self.surface, perspective=camera.perspective)
        _set(self.line, pixels=extent)

    def _read(self, wide: int, high: int) -> Floats:
        """Premultiplied linear light of the tile that was drawn ``(high/FINER,wide/FINER,4)``, top row first."""
        import moderngl

        wide, high = wide // FINER, high // FINER
        self.averaged.use()
        self.device.ctx.viewport = (0, 0, wide, high)
        self.device.ctx.enable_only(moderngl.NOTHING)
        self.pixels.use(0)
        self.average.render(moderngl.TRIANGLES, vertices=3)
        data = self.averaged.read(viewport=(0, 0, wide, high), components=4, dtype="f4", alignment=1)
        return np.frombuffer(data, np.float32).reshape(high, wide, 4)[::-1]


class _Drawing:
    """A layer on the device, ready to be drawn into any tile."""

    def __init__(self, painter: Painter, layer: Layer, place: Place, camera: Camera, held: ExitStack) -> None:
        self.painter, self.style, self.held = painter, layer.style, held
        self.ctx = painter.device.ctx
        shapes, mesh = painter.shapes, layer.mesh
        points = place(shapes.polygons(mesh).positions)
        shading = "flat" if layer.style == "hidden" else layer.shading
        self.triangles = self._surface(shapes.triangles(mesh, shading), points, layer)
        self.strokes = [self._lines(place(part.points), part.stroke) for part in layer.lines]
        if layer.wire is not None:
            ends = points[shapes.edges(mesh)]
            self.strokes.append(self._lines(ends, _thinned(layer.wire, ends, camera, painter.settings.size)))
        if layer.dots is not None:
            places = points[shapes.vertices(mesh)]
            self.strokes.append(self._lines(np.stack([places, places], axis=1), layer.dots))
        #: Lines of this width lie in front of the surface that they are on, however steep it is.
        self.lift = max((FINER * stroke.width / 2 + 1 for _, _, stroke in self.strokes), default=0.0)

    def _surface(self, mesh: Triangles, points: Floats, layer: Layer) -> moderngl.VertexArray:
        ctx, program = self.ctx, self.painter.surface
        scale = self.painter.settings.scale
        limits = layer.limits if scale is None or layer.limits is not None else (scale.low, scale.high)
        values = np.zeros(len(points)) if layer.values is None else shares(layer.values, limits)
        vertices = np.empty(len(mesh.vertices), dtype=[("position", "f4", 3), ("normal", "f4", 3), ("value", "f4")])
        vertices["position"], vertices["normal"] = points[mesh.vertices], mesh.normals
        vertices["value"] = values[mesh.vertices]
        data = self._hold(ctx.buffer(vertices))
        index = self._hold(ctx.buffer(mesh.triangles.astype("u4")))
        names = ("in_position", "in_normal", "in_value")
        array: moderngl.VertexArray = self._hold(ctx.vertex_array(program, [(data, "3f 3f 1f", *names)], index))
        return array

    def _lines(self, ends: Floats, stroke: Stroke) -> tuple[moderngl.VertexArray, int, Stroke]:
        """Lines ``(n,2,3)`` on the device, their number, and how they look."""
        data = self._hold(self.ctx.buffer(np.ascontiguousarray(ends, dtype="f4")))
        array = self.ctx.vertex_array(self.painter.line, [(data, "3f 3f/i", "in_start", "in_end")])
        return self._hold(array), len(ends), stroke

    def _hold(self, resource: Any) -> Any:
        self.held.callback(resource.release)
        return resource

    def draw(self) -> None:
        """Draw the layer over what is there."""
        if self.style != "hidden":
            _set(self.painter.surface, style=_STYLES[self.style])
            self._draw_surface(colored=True)
        if self.strokes:
            self._draw_surface(colored=False)
            self._draw_strokes()

    def _draw_surface(self, colored: bool) -> None:
        """Draw the triangles: their colors, or depths for the lines, pushed back as far as lines need it.

        Colors are not drawn pushed back, or what lies behind a steep face would show at its silhouette.
        """
        import moderngl

        ctx, target = self.ctx, self.painter.drawn
        _write_color(target, False)
        target.clear()  # the depth alone: what earlier layers hid, this one covers
        _write_color(target, colored)
        ctx.enable_only(moderngl.DEPTH_TEST)
        ctx.depth_func = "<="
        ctx.polygon_offset = (0.0, 0.0) if colored else (self.lift, 1.0)
        self.triangles.render(moderngl.TRIANGLES)
        ctx.polygon_offset = (0.0, 0.0)
        _write_color(target, True)

    def _draw_strokes(self) -> None:
        """Draw the lines over the surface, first what it hides of them."""
        import moderngl

        ctx, target = self.ctx, self.painter.drawn
        ctx.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
        ctx.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        target.depth_mask = False
        for array, count, stroke in self.strokes:
            for test, opacity in ((">", stroke.hidden), ("<=", stroke.opacity)):
                if opacity > 0 and count:
                    ctx.depth_func = test
                    _set(
                        self.painter.line,
                        line_color=to_linear(stroke.color),
                        width=FINER * stroke.width,
                        opacity=opacity,
                    )
                    array.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=count)
        target.depth_mask = True
        ctx.depth_func = "<"


def _write_color(target: moderngl.Framebuffer, on: bool) -> None:
    """Let what is drawn change colors, or depths alone. The mask is sure to hold only when the target is bound anew."""
    target.color_mask = (on,) * 4
    target.use()


def _tiles(size: tuple[int, int]) -> Iterator[tuple[int, int, int, int]]:
    """Lower left corner, width and height of the tiles of a picture."""
    for y in range(0, size[1], TILE):
        for x in range(0, size[0], TILE):
            yield x, y, min(TILE, size[0] - x), min(TILE, size[1] - y)


def _thinned(stroke: Stroke, ends: Floats, camera: Camera, size: tuple[int, int]) -> Stroke:
    """The stroke of a wire, no wider than the edges ``(n,2,3)`` allow as they are seen."""
    seen = camera.project(ends.reshape(-1, 3)).reshape(-1, 2, 2) * np.array(size) / 2
    length = np.linalg.norm(seen[:, 1] - seen[:, 0], axis=1)
    return replace(stroke, width=min(stroke.width, WIDEST_WIRE * float(np.median(length))))


def shares(values: Floats, limits: tuple[float, float] | None) -> Floats:
    """Values as shares of the way from the lower to the upper limit, NaN where they are not finite."""
    finite = np.isfinite(values)
    if limits is None:
        limits = (float(values[finite].min()), float(values[finite].max())) if finite.any() else (0.0, 1.0)
    low, high = limits
    shares = (np.where(finite, values, np.nan) - low) / (high - low if high > low else 1.0)
    return shares


@cache
def shader_source(name: str) -> str:
    """The text of a shader of the package: ``surface.frag`` and so on."""
    return (Path(__file__).parent / "shaders" / f"{name}.glsl").read_text(encoding="utf-8")


def _program(ctx: moderngl.Context, name: str) -> moderngl.Program:
    """The program of a vertex and a fragment shader."""
    return ctx.program(vertex_shader=shader_source(f"{name}.vert"), fragment_shader=shader_source(f"{name}.frag"))


def _set(program: moderngl.Program, **uniforms: Any) -> None:
    """Give uniforms their values; arrays as they lie in memory, which OpenGL reads column by column."""
    for name, value in uniforms.items():
        uniform: Any = program[name]
        if isinstance(value, np.ndarray):
            uniform.write(np.ascontiguousarray(value, dtype="f4"))
        else:
            uniform.value = value
