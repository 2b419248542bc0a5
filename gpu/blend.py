"""Blending surfaces on a device by the paper's unified procedure: no tables, the coefficients of each chart sent once.

A texture holds the nine coefficients of every chart, as they were fitted on the processor; another says which chart
each corner of the quads has, and at which place. From then on a stretch of faces or edges takes one number for each
and comes back as positions and normals. Source: Ko, Lee, Lim, Yoon, "Construction and Rendering of Trimmed Blending
Surfaces with Sharp Features on a GPU", section V. Points are sent in two parts, a number of single precision and what
that leaves out, and taken relative to the vertex at a face's first corner, so that neither the size of a mesh nor its
place costs digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from curvify.arrays import values_of
from curvify.gpu.device import Device
from curvify.gpu.memory import Singles
from curvify.gpu.products import Products, power_of_two, restored
from curvify.gpu.programs import read_shaders
from curvify.mesh import Floats, Ints
from curvify.sampling import Sampling
from curvify.schemes.base import KiteForms
from curvify.schemes.blend_network import BlendEdges, Network

if TYPE_CHECKING:
    import moderngl

#: Samples of one invocation, which share the coefficients it fetches, and invocations in a group.
SAMPLES, GROUP = 4, 64
#: Numbers a sample: position and normal.
LENGTH = 6
#: Samples of one patch that are evaluated together.
MOST_SAMPLES = 1 << 14
#: The middle of a kite's quad.
MIDDLE = np.ones((1, 2))


@dataclass(frozen=True, eq=False)
class ChartTexels:
    """The charts of a network in single precision.

    ``coefficients (N,9,4)`` over ``scale``, a power of two; what single precision leaves out of the first, a point,
    is the fourth number of texels 0 to 2, A and B those of texels 3 and 4. ``origins (N,3)`` are the points as they
    were sent, in their own scale. ``corners (4Q,2)``: chart and place of each corner of the quads.
    """

    coefficients: Singles
    scale: float
    origins: Floats
    corners: npt.NDArray[np.int32]

    @classmethod
    def pack(cls, network: Network) -> ChartTexels:
        """Those of a network."""
        charts = network.charts
        points, others = charts.coefficients[:, 0], charts.coefficients[:, 1:]
        largest = max(np.abs(others).max(initial=0.0), np.ptp(points, axis=0).max(initial=0.0))
        scale = power_of_two(float(largest))
        texels = np.zeros((len(points), 9, 4), dtype=np.float32)
        texels[:, 0, :3] = points / scale
        texels[:, 1:, :3] = others / scale
        sent = texels[:, 0, :3].astype(np.float64)
        texels[:, :3, 3] = points / scale - sent
        texels[:, 3:5, 3] = charts.exponents[charts.families]
        corners = np.stack([charts.rings.chart, charts.rings.place], axis=1).astype(np.int32)
        return cls(texels, scale, sent * scale, corners)


def fold(rows: npt.NDArray[Any], most: int, texels: int = 1) -> npt.NDArray[Any]:
    """Rows ``(n, texels * c)`` as the image of a texture at most so wide: ``(height, width, c)``, the last row filled
    up with zeros.
    """
    across = max(min(most // texels, len(rows)), 1)
    height = max(-(-len(rows) // across), 1)
    image = np.zeros((height * across, *rows.shape[1:]), dtype=rows.dtype)
    image[: len(rows)] = rows
    return image.reshape(height, across * texels, -1)


class BlendProgram:
    """The procedure for one order of the blending function on one device."""

    def __init__(self, device: Device, order: int) -> None:
        self.device = device
        self._feedback: moderngl.VertexArray | None = None
        self._shader: Any
        if device.compute:
            constants = {"ORDER": order, "SAMPLES": SAMPLES, "GROUP": GROUP}
            self._shader = device.ctx.compute_shader(read_shaders(430, constants, "blend", "blend_compute"))
        else:
            source = read_shaders(330, {"ORDER": order, "SAMPLES": 1}, "blend", "blend_feedback")
            self._shader = device.ctx.program(vertex_shader=source, varyings=("value", "normal"))
            self._feedback = device.ctx.vertex_array(self._shader, [])
        for unit, name in enumerate(("coefficients", "corners", "starts", "parameters")):
            self._shader[name] = unit

    def run(self, textures: list[moderngl.Texture], results: moderngl.Buffer, patches: int, samples: int) -> None:
        """Evaluate into ``results``; textures in the order of the shader. Raises DeviceError."""
        for unit, texture in enumerate(textures):
            texture.use(unit)
        for name, value in (("patches", patches), ("samples", samples)):
            if name in self._shader:  # a compiler may find that one is not needed
                self._shader[name] = value
        if self._feedback is None:
            results.bind_to_storage_buffer(0)
            self._shader.run(-(-patches * -(-samples // SAMPLES) // GROUP))
            self.device.ctx.memory_barrier()
        else:
            self._feedback.transform(results, mode=self.device.ctx.POINTS, vertices=patches * samples)
        self.device.check()


class BlendDevice:
    """Blending surfaces on the device of some products. The charts of one network stay there until another comes."""

    def __init__(self, products: Products) -> None:
        self.products = products
        self._network: Network | None = None
        self._texels: ChartTexels
        self._charts: list[moderngl.Texture] = []
        self._programs: dict[int, BlendProgram] = {}

    def fill(self, surface: KiteForms, rows: Ints, sampling: Sampling, positions: Floats, normals: Floats) -> None:
        """Write the patches ``rows (f,)`` of a surface of kites into ``positions`` and ``normals (f,S,3)``.

        Normals are zero where single precision has none.
        """
        network = surface.network
        sides, size = sampling.sides, len(sampling.kite)
        starts = network.quads.kites[surface.corners[rows][:, None] + np.arange(sides), 0]
        if network.quads.extent < 1:  # the patch is one quad
            self._write(network, starts[:, 0], quad_parameters(sampling), positions, normals)
            return
        for kite in range(sides):
            part = np.s_[:, kite * size : (kite + 1) * size]
            self._write(network, starts[:, kite], sampling.kite, positions[part], normals[part])
        self._write(network, starts[:, 0], MIDDLE, positions[:, -1:], normals[:, -1:])

    def _write(self, network: Network, starts: Ints, uv: Floats, positions: Floats, normals: Floats) -> None:
        if len(uv):
            values, origin, scale = self.evaluate(network, starts, uv)
            positions[...] = restored(values[..., :3], origin, scale, positions.dtype)
            normals[...] = values[..., 3:]

    def edges(self, edges: BlendEdges, ids: Ints, fields: Ints, t: Floats) -> tuple[Floats, Singles]:
        """Positions and unit normals ``(e,m,3)`` at ``t (m,)`` on edges ``ids (e,)`` with normal fields ``(e,)``.

        Positions are those of each edge's first half-edge; normals are zero where single precision has none.
        """
        positions, normals = self._along(edges, edges.half_edges[ids], t)
        others = np.flatnonzero(fields != ids)
        if len(others):
            normals[others] = self._along(edges, edges.half_edges[fields[others]], t)[1]
        return positions, normals

    def _along(self, edges: BlendEdges, half_edges: Ints, t: Floats) -> tuple[Floats, Singles]:
        """Positions and unit normals ``(e,m,3)`` of the faces of some half-edges along their edges."""
        network = edges.network
        positions = np.empty((len(half_edges), len(t), 3))
        normals = np.empty(positions.shape, dtype=np.float32)
        forward = edges.topology.forward[half_edges]
        sides = network.quads.sides[half_edges]
        pieces, places = edges.pieces(t)
        for piece in values_of(pieces):
            columns = np.flatnonzero(pieces == piece)
            corner = np.where(forward, sides[:, piece], sides[:, -1 - piece])
            uv = np.stack([places[columns], np.zeros(len(columns))], axis=1)
            values, origin, scale = self.evaluate(network, np.where(forward, corner, ~corner), uv)
            positions[:, columns] = restored(values[..., :3], origin, scale, positions.dtype)
            normals[:, columns] = values[..., 3:]
        return positions, normals

    def evaluate(self, network: Network, starts: Ints, uv: Floats) -> tuple[Singles, Floats, float]:
        """Positions and unit normals ``(f,S,6)`` of quads at parameters ``uv (S,2)``; positions are over the scale
        that comes third, relative to the origins ``(f,3)`` that come second.

        ``starts (f,)`` are the quads' corners at (0, 0); ~corner counts u from the corner that follows. Raises
        DeviceError.
        """
        return self.products.run(self._evaluate, network, starts, uv)

    def _evaluate(self, network: Network, starts: Ints, uv: Floats) -> tuple[Singles, Floats, float]:
        if network is not self._network:
            self._send(network)
        if network.order not in self._programs:
            self._programs[network.order] = BlendProgram(self.products.device, network.order)
        result = np.empty((len(starts), len(uv), LENGTH), dtype=np.float32)
        for first in range(0, len(uv), MOST_SAMPLES):
            part = slice(first, min(first + MOST_SAMPLES, len(uv)))
            step = self.products.room((part.stop - first) * LENGTH * 4)
            for begin in range(0, len(starts), step):
                result[begin : begin + step, part] = self._run(network.order, starts[begin : begin + step], uv[part])
        corners = np.where(starts < 0, ~starts, starts)
        origins = self._texels.origins[self._texels.corners[corners, 0]]
        return result, origins, self._texels.scale

    def _run(self, order: int, starts: Ints, uv: Floats) -> Singles:
        results = np.empty((len(starts), len(uv), LENGTH), dtype=np.float32)
        memory = self.products.memory
        textures = [
            self._texture("indices", starts.astype(np.int32)[:, None]),
            self._texture("tables", uv.astype(np.float32)),
        ]
        buffer = memory.buffer(results.nbytes)
        self._programs[order].run([*self._charts, *textures], buffer, len(starts), len(uv))
        memory.read_into(buffer, results)
        memory.give_back(buffer)
        for texture in textures:
            texture.release()
        return results

    def _send(self, network: Network) -> None:
        """Put the charts of a network in place of those that are on the device."""
        for texture in self._charts:
            texture.release()
        self._texels, self._network = ChartTexels.pack(network), network
        rows = self._texels.coefficients.reshape(-1, 36)
        self._charts = [self._texture("controls", rows, 9), self._texture("indices", self._texels.corners)]

    def _texture(self, kind: str, rows: npt.NDArray[Any], texels: int = 1) -> moderngl.Texture:
        """A texture of rows of ``texels`` texels each."""
        memory = self.products.memory
        return memory.send_image(kind, fold(rows, memory.widest, texels))


def quad_parameters(sampling: Sampling) -> Floats:
    """The samples of a patch with four sides ``(S,2)`` in the unit square of its quad: each kite is a quarter of it."""
    x, y = (sampling.kite / 2).T
    kites = [(x, y), (1 - y, x), (1 - x, 1 - y), (y, 1 - x)]
    return np.concatenate([*(np.stack(kite, axis=1) for kite in kites), MIDDLE / 2])
