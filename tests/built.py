"""Control vectors as a device built them, read back. No test lives here."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curvify.gpu.evaluate import GpuBackend
from curvify.schemes.base import Form
from curvify.schemes.construction import EDGE_TEXELS, Construction

Array = npt.NDArray[np.float64]


class Columns(NamedTuple):
    """Of the patches of a form: control vectors ``(f,L,3)``, points relative to the first corner, and what their side
    fields are made of, ``(f,n,t,4)``, where lengths are in units of ``scale``.
    """

    vectors: Array
    sides: Array
    scale: float


def built_columns(gpu: GpuBackend, form: Form, size: int) -> Columns:
    """What the device makes of all patches of a form, polygons of so many sides."""
    device = form.device
    assert device is not None
    rows = np.arange(len(device.corners))

    def read() -> tuple[bytes, int, int, float]:
        built = gpu.products._built_of(device.construction)
        texture, texels, blocks = built.columns(device, rows, size)
        return texture.read(), texels, blocks, built.scale

    data, texels, blocks, scale = gpu.products.run(read)
    found = np.frombuffer(data, dtype="f4").astype(float)[: len(rows) * texels * 4].reshape(len(rows), texels, 4)
    vectors = found[:, : 3 * blocks].reshape(len(rows), blocks, 3, 4).transpose(0, 1, 3, 2).reshape(len(rows), -1, 3)
    sides = found[:, 3 * blocks :].reshape(len(rows), size, -1, 4)
    return Columns((scale if form.points else 1.0) * vectors[:, : device.columns], sides, scale)


def built_edges(gpu: GpuBackend, construction: Construction) -> tuple[Array, Array]:
    """Bezier points of the edges' curves, from their starts, and the second half of their texels, ``(N,4,3)`` each."""

    def read() -> tuple[bytes, float]:
        built = gpu.products._built_of(construction)
        return built.textures["edges"].read(), built.scale

    data, scale = gpu.products.run(read)
    count = len(construction.inputs.sides)
    found = np.frombuffer(data, dtype="f4").astype(float)[: count * EDGE_TEXELS * 4].reshape(count, 2, 3, 4)
    return scale * found[:, 0].swapaxes(1, 2), found[:, 1].swapaxes(1, 2)
