"""Control vectors times tables on a device, from arrays to arrays.

An OpenGL context belongs to one thread, so all of it happens in a thread of its own; others hand their work over and
wait for the results, and meanwhile more of them can prepare theirs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
import numpy.typing as npt

from curvify.errors import DeviceError
from curvify.gpu.device import Device, open_device
from curvify.gpu.programs import MOST_LENGTH, Kind, Program
from curvify.mesh import Floats

if TYPE_CHECKING:
    import moderngl

P = ParamSpec("P")
T = TypeVar("T")
Singles = npt.NDArray[np.float32]
#: Bytes of tables that stay on the device.
MOST_TABLES = 256 << 20
#: Bytes of results that are made at once, at most; the device may allow less.
MOST_RESULTS = 64 << 20


@dataclass(frozen=True, eq=False)
class Table:
    """A table ``matrix (K, o*S)`` at S ``samples``: values, or values and both derivatives. ``key`` names it."""

    key: Hashable
    samples: int
    matrix: Floats


def pack_columns(*parts: Floats) -> tuple[Singles, float]:
    """Vectors ``(3,f,L)``, in one or more parts, as ``(f,3,K)``, K a multiple of four; and the power of two that they
    were divided by, so that products of four of them stay within single precision.
    """
    total = sum(part.shape[2] for part in parts)
    packed = np.zeros((parts[0].shape[1], 3, -(-total // 4) * 4), dtype=np.float32)
    largest = max(float(np.abs(part).max(initial=0.0)) for part in parts)
    scale = power_of_two(largest)
    begin = 0
    for part in parts:
        end = begin + part.shape[2]
        np.multiply(part.transpose(1, 0, 2), 1 / scale, out=packed[..., begin:end], casting="same_kind")
        begin = end
    return packed, scale


def power_of_two(largest: float) -> float:
    """The power of two to divide by so that numbers up to ``largest`` are below 2."""
    exponent = math.frexp(largest)[1] - 1 if 0 < largest < math.inf else 0
    return 2.0 ** min(max(exponent, -126), 127)


def restored(values: Singles, origins: Floats, scale: float, dtype: np.dtype[Any]) -> Floats:
    """Points ``(f,S,3)`` in a type, from those over ``scale`` and relative to ``origins (f,3)``."""
    points = values.astype(dtype) * dtype.type(scale)
    points += origins[:, None].astype(dtype)
    return points


def pack_table(matrix: Floats, samples: int) -> Singles:
    """A table ``(K, o*S)`` as the rows ``(blocks*o, S, 4)`` of its texture."""
    orders = matrix.shape[1] // samples
    packed = np.zeros((-(-len(matrix) // 4), 4, orders, samples), dtype=np.float32)
    packed.reshape(-1, orders * samples)[: len(matrix)] = matrix
    return np.ascontiguousarray(packed.transpose(0, 2, 3, 1)).reshape(-1, samples, 4)


class Products:
    """Products on one device. Close it at the end; ``bytes_sent`` counts the bytes that went to the device."""

    device: Device

    def __init__(self) -> None:
        """Open the device. Raises DeviceError."""
        self.bytes_sent = 0
        self._tables: dict[Hashable, moderngl.Texture] = {}
        self._table_bytes = 0
        self._programs: dict[Kind, Program] = {}
        self._results: moderngl.Buffer | None = None
        self._thread = ThreadPoolExecutor(1, "curvify-gpu")
        try:
            self.device = self._thread.submit(open_device).result()
        except BaseException:
            self._thread.shutdown()
            raise

    def close(self) -> None:
        """Close the device once what it does is done."""
        self._thread.submit(self.device.close).result()
        self._thread.shutdown(cancel_futures=True)

    @contextmanager
    def sent(self, columns: Singles, samples: int) -> Iterator[list[moderngl.Texture]]:
        """The columns ``(f,3,K)`` of some patches on the device, for tables of up to so many ``samples``."""
        textures = self.run(self._send, columns, samples)
        try:
            yield textures
        finally:
            self.run(self._release, textures)

    def multiply(self, kind: Kind, table: Table, controls: list[moderngl.Texture]) -> Singles:
        """Results ``(f,S,length)`` of a table and what was sent of some patches. Raises DeviceError."""
        return self.run(self._multiply, kind, table, controls)

    def run(self, do: Callable[P, T], *args: P.args, **named: P.kwargs) -> T:
        """Do something in the thread of the device, and wait for it."""
        import moderngl

        try:
            return self._thread.submit(do, *args, **named).result()
        except moderngl.Error as error:  # no room on the device, or a driver that refuses a shader
            text = " ".join(str(error).split())
            raise DeviceError(f"{self.device.renderer} failed: {text}; try --backend cpu") from error

    def _send(self, columns: Singles, samples: int) -> list[moderngl.Texture]:
        """Textures of as many patches each as the device takes, with their results."""
        step = min(self.room(samples * MOST_LENGTH * 4), self.widest)
        parts = [columns[begin : begin + step] for begin in range(0, len(columns), step)]
        return [self.texture(part.reshape(len(part), -1, 4)) for part in parts]

    def _release(self, textures: list[moderngl.Texture]) -> None:
        for texture in textures:
            texture.release()

    def _multiply(self, kind: Kind, table: Table, controls: list[moderngl.Texture]) -> Singles:
        if kind not in self._programs:
            self._programs[kind] = Program(self.device, kind)
        basis = self._table(table)
        patches = sum(texture.height for texture in controls)
        results = np.empty((patches, table.samples, kind.length), dtype=np.float32)
        begin = 0
        for texture in controls:
            part = results[begin : begin + texture.height]
            begin += texture.height
            buffer = self.buffer(part.nbytes)
            self._programs[kind].run(basis, texture, buffer, (*part.shape[:2], texture.width // 3))
            buffer.read_into(part, part.nbytes)
        return results

    def _table(self, table: Table) -> moderngl.Texture:
        """The texture of a table, sent unless it is there; the oldest make room."""
        found = self._tables.pop(table.key, None)
        if found is None:
            packed = pack_table(table.matrix, table.samples)
            while self._tables and self._table_bytes + packed.nbytes > MOST_TABLES:
                old = self._tables.pop(next(iter(self._tables)))
                self._table_bytes -= _texture_bytes(old)
                old.release()
            found = self.texture(packed)
            self._table_bytes += packed.nbytes
        self._tables[table.key] = found
        return found

    @property
    def widest(self) -> int:
        """The longest side of a texture."""
        return self._limit("GL_MAX_TEXTURE_SIZE", 1024)

    def room(self, size: int) -> int:
        """How many patches to evaluate at once whose results take ``size`` bytes each."""
        return max(min(MOST_RESULTS, self._limit("GL_MAX_SHADER_STORAGE_BLOCK_SIZE", MOST_RESULTS)) // size, 1)

    def texture(self, texels: npt.NDArray[Any]) -> moderngl.Texture:
        """A texture of ``texels (height, width, c)``, numbers of 4 bytes. Raises DeviceError where it is too large."""
        height, width, components = texels.shape
        if max(height, width) > self.widest:
            raise DeviceError(
                f"{self.device.renderer} takes tables up to {self.widest}, this patch needs {max(height, width)}; "
                "try --backend cpu"
            )
        self.bytes_sent += texels.nbytes
        kind = "f4" if texels.dtype == np.float32 else "i4"
        return self.device.ctx.texture((width, height), components, np.ascontiguousarray(texels), dtype=kind)

    def buffer(self, size: int) -> moderngl.Buffer:
        """The buffer for results, made larger where it is too small."""
        if self._results is None or self._results.size < size:
            if self._results is not None:
                self._results.release()
            self._results = self.device.ctx.buffer(reserve=size)
        return self._results

    def _limit(self, name: str, unknown: int) -> int:
        """A limit of the device."""
        value = self.device.limits.get(name)
        return value if isinstance(value, int) and value > 0 else unknown


def _texture_bytes(texture: moderngl.Texture) -> int:
    return texture.width * texture.height * 16
