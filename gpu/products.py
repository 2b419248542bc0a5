"""Control vectors times tables on a device, from arrays to arrays.

An OpenGL context belongs to one thread, so all of it happens in a thread of its own; others hand their work over and
wait for the results, and meanwhile more of them can prepare theirs.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from curvify.errors import DeviceError
from curvify.gpu.device import Device, open_device
from curvify.gpu.programs import Kind, Program
from curvify.mesh import Floats

if TYPE_CHECKING:
    import moderngl

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
    exponent = math.frexp(largest)[1] - 1 if 0 < largest < math.inf else 0
    scale = 2.0 ** min(max(exponent, -126), 127)
    begin = 0
    for part in parts:
        end = begin + part.shape[2]
        np.multiply(part.transpose(1, 0, 2), 1 / scale, out=packed[..., begin:end], casting="same_kind")
        begin = end
    return packed, scale


def pack_table(matrix: Floats, samples: int) -> Singles:
    """A table ``(K, o*S)`` as the rows ``(blocks*o, S, 4)`` of its texture."""
    orders = matrix.shape[1] // samples
    packed = np.zeros((-(-len(matrix) // 4), 4, orders, samples), dtype=np.float32)
    packed.reshape(-1, orders * samples)[: len(matrix)] = matrix
    return np.ascontiguousarray(packed.transpose(0, 2, 3, 1)).reshape(-1, samples, 4)


class Products:
    """Products on one device. Close it at the end; ``sent`` counts the bytes that went to the device."""

    device: Device

    def __init__(self) -> None:
        """Open the device. Raises DeviceError."""
        self.sent = 0
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

    def multiply(self, kind: Kind, table: Table, columns: Singles) -> Singles:
        """Results ``(f,S,length)`` of a table and the columns ``(f,3,K)`` of some patches. Raises DeviceError."""
        return self._thread.submit(self._multiply, kind, table, columns).result()

    def _multiply(self, kind: Kind, table: Table, columns: Singles) -> Singles:
        if kind not in self._programs:
            self._programs[kind] = Program(self.device, kind)
        basis = self._table(table)
        results = np.empty((len(columns), table.samples, kind.length), dtype=np.float32)
        step = self._most_patches(results[:1].nbytes)
        for begin in range(0, len(columns), step):
            part = results[begin : begin + step]
            controls = self._texture(columns[begin : begin + step].reshape(len(part), -1, 4))
            buffer = self._buffer(part.nbytes)
            self._programs[kind].run(basis, controls, buffer, (*part.shape[:2], columns.shape[2] // 4))
            buffer.read_into(part, part.nbytes)
            controls.release()
        return results

    def _most_patches(self, bytes_: int) -> int:
        """Patches evaluated at once, of results of some ``bytes_`` each: as many as textures and buffers hold."""
        limits = self.device.limits
        room = min(MOST_RESULTS, _limit(limits, "GL_MAX_SHADER_STORAGE_BLOCK_SIZE", MOST_RESULTS))
        return max(min(room // bytes_, _limit(limits, "GL_MAX_TEXTURE_SIZE", 1024)), 1)

    def _table(self, table: Table) -> moderngl.Texture:
        """The texture of a table, sent unless it is there; the oldest make room."""
        found = self._tables.pop(table.key, None)
        if found is None:
            packed = pack_table(table.matrix, table.samples)
            while self._tables and self._table_bytes + packed.nbytes > MOST_TABLES:
                old = self._tables.pop(next(iter(self._tables)))
                self._table_bytes -= _texture_bytes(old)
                old.release()
            found = self._texture(packed)
            self._table_bytes += packed.nbytes
        self._tables[table.key] = found
        return found

    def _texture(self, texels: Singles) -> moderngl.Texture:
        """A texture of ``texels (height, width, 4)``. Raises DeviceError where it is too large."""
        height, width = texels.shape[:2]
        most = _limit(self.device.limits, "GL_MAX_TEXTURE_SIZE", 1024)
        if max(height, width) > most:
            raise DeviceError(
                f"{self.device.renderer} takes tables up to {most}, this patch needs {max(height, width)}; "
                "try --backend cpu"
            )
        self.sent += texels.nbytes
        return self.device.ctx.texture((width, height), 4, np.ascontiguousarray(texels), dtype="f4")

    def _buffer(self, size: int) -> moderngl.Buffer:
        """The buffer for results, made larger where it is too small."""
        if self._results is None or self._results.size < size:
            if self._results is not None:
                self._results.release()
            self._results = self.device.ctx.buffer(reserve=size)
        return self._results


def _texture_bytes(texture: moderngl.Texture) -> int:
    return texture.width * texture.height * 16


def _limit(limits: dict[str, Any], name: str, unknown: int) -> int:
    return int(limits.get(name) or unknown)
