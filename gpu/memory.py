"""What lies on a device: textures of numbers that were sent, each kind counted, and textures and buffers to use again.

A *list* is a texture that holds rows of one to four numbers one after the other, ``WIDTH`` texels to a row.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from curvify.errors import DeviceError
from curvify.gpu.device import Device
from curvify.gpu.programs import WIDTH

if TYPE_CHECKING:
    import moderngl

Singles = npt.NDArray[np.float32]
#: Bytes of results that are made at once, at most; the device may allow less.
MOST_RESULTS = 64 << 20
#: Buffers and textures that are kept to be used again.
MOST_KEPT = 8
#: What is sent: vectors and indices that surfaces are built from, control vectors that were built here, tables.
SENT = ("vectors", "indices", "controls", "tables")


class Memory:
    """The memory of one device, for the thread of the device alone. ``sent`` and ``received`` count bytes."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.sent = dict.fromkeys(SENT, 0)
        self.received = 0
        self._buffers: list[moderngl.Buffer] = []
        self._textures: list[moderngl.Texture] = []
        self.nothing = device.ctx.texture((1, 1), 4, dtype="f4")

    @property
    def most_texels(self) -> int:
        """Texels in the longest list that the device takes."""
        return WIDTH * self.widest if self.widest >= WIDTH else 0

    @property
    def widest(self) -> int:
        """The longest side of a texture."""
        return self.limit("GL_MAX_TEXTURE_SIZE", 1024)

    @property
    def most_results(self) -> int:
        """Bytes of results that are made at once."""
        return min(MOST_RESULTS, self.limit("GL_MAX_SHADER_STORAGE_BLOCK_SIZE", MOST_RESULTS))

    def limit(self, name: str, unknown: int) -> int:
        """A limit of the device."""
        value = self.device.limits.get(name)
        return value if isinstance(value, int) and value > 0 else unknown

    def send_list(self, kind: str, rows: npt.NDArray[Any]) -> moderngl.Texture:
        """A list of ``rows (n,c)`` in single precision or integers. Raises DeviceError where it is too long."""
        count, channels = rows.shape
        if not count:
            return self.nothing
        width = min(count, WIDTH)
        full, rest = divmod(count, width)
        texture = self._list(count, channels, rows.dtype)
        data = np.ascontiguousarray(rows)
        texture.write(data[: full * width], viewport=(0, 0, width, full))
        if rest:
            texture.write(data[full * width :], viewport=(0, full, rest, 1))
        self.sent[kind] += data.nbytes
        return texture

    def send_image(self, kind: str, texels: npt.NDArray[Any]) -> moderngl.Texture:
        """A texture of ``texels (height, width, c)``, numbers of 4 bytes. Raises DeviceError where it is too large."""
        height, width, channels = texels.shape
        if max(height, width) > self.widest:
            raise self._too_large(f"tables up to {self.widest}", max(height, width))
        self.sent[kind] += texels.nbytes
        data = np.ascontiguousarray(texels)
        return self.device.ctx.texture((width, height), channels, data, dtype=texels.dtype.str[1:])

    def texture(self, texels: int) -> moderngl.Texture:
        """A list of so many texels of four numbers, with anything in it; one that was given back, if one fits."""
        size = _shape(texels)
        for i, kept in enumerate(self._textures):
            if kept.size == size:
                return self._textures.pop(i)
        return self._list(texels, 4, np.dtype("f4"))

    def buffer(self, size: int) -> moderngl.Buffer:
        """A buffer of at least so many bytes; one that was given back, if one fits."""
        for i, kept in enumerate(self._buffers):
            if size <= kept.size <= max(4 * size, 1 << 20):
                return self._buffers.pop(i)
        return self.device.ctx.buffer(reserve=size)

    def give_back(self, used: moderngl.Buffer | moderngl.Texture) -> None:
        """Take back a buffer or a list; OpenGL finishes what it does with it before anything else is done with it."""
        kept: list[Any] = self._buffers if hasattr(used, "bind_to_storage_buffer") else self._textures
        kept.append(used)
        if len(kept) > MOST_KEPT:
            kept.pop(0).release()

    def read_into(self, buffer: moderngl.Buffer, out: npt.NDArray[Any]) -> None:
        """Read the beginning of a buffer into an array, which lies in one piece."""
        buffer.read_into(out, out.nbytes)
        self.received += out.nbytes

    def _list(self, count: int, channels: int, dtype: np.dtype[Any]) -> moderngl.Texture:
        if count > self.most_texels:
            raise self._too_large(f"lists up to {self.most_texels}", count)
        return self.device.ctx.texture(_shape(count), channels, dtype=dtype.str[1:], alignment=4)

    def _too_large(self, limit: str, needed: int) -> DeviceError:
        return DeviceError(f"{self.device.renderer} takes {limit}, this mesh needs {needed}; try --backend cpu")


def _shape(count: int) -> tuple[int, int]:
    """Width and height of a list."""
    width = min(count, WIDTH)
    return width, -(-count // width)
