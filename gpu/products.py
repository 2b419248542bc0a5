"""Control vectors times tables on a device, from arrays to arrays.

An OpenGL context belongs to one thread, so all of it happens in a thread of its own; others hand their work over, and
while the device is at it they prepare or store theirs: work is *launched*, and its results are read when they are
wanted, so that several pieces of it are on the way at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np

from curvify.errors import DeviceError
from curvify.gpu.construct import Builder, Built, numbered
from curvify.gpu.device import Device, open_device
from curvify.gpu.memory import Memory, Singles
from curvify.gpu.programs import MOST_LENGTH, Constants, Evaluation, Kind, Numbers
from curvify.mesh import Floats, Ints
from curvify.schemes.base import Basis
from curvify.schemes.construction import CURVE_TEXELS, EDGE_TEXELS, Construction, DeviceForm

if TYPE_CHECKING:
    import moderngl

P = ParamSpec("P")
T = TypeVar("T")
#: Bytes of tables that stay on the device.
MOST_TABLES = 256 << 20


@dataclass(frozen=True, eq=False)
class Table:
    """A table at S ``samples``; ``key`` names it, ``pack`` gives the rows ``(height,S,4)`` of its texture if need be:
    blocks of four columns, each in all orders, then two rows for each side field.
    """

    key: Hashable
    samples: int
    pack: Callable[[], Singles]


def pack_table(columns: Floats) -> Singles:
    """Columns ``(o,S,K)``, values or values and both derivatives, as rows of a texture."""
    orders, samples, count = columns.shape
    packed = np.zeros((-(-count // 4), orders, samples, 4), dtype=np.float32)
    for i in range(4):
        part = columns[..., i::4].transpose(2, 0, 1)
        packed[: len(part), ..., i] = part
    return packed.reshape(-1, samples, 4)


def pack_basis(basis: Basis, columns: Floats) -> Singles:
    """A basis with the given ``columns (o,S,K)`` as rows of a texture, for fields that are evaluated at every sample:
    their weights and places, and the derivatives of both.
    """
    rows = pack_table(columns)
    samples = columns.shape[1]
    if not basis.weights.shape[2]:
        return rows
    weights, places = basis.weights.transpose(2, 1, 0), basis.abscissae.transpose(2, 1, 0)
    fields = np.zeros((len(weights), 2, samples, 4), dtype=np.float32)
    fields[:, 0, :, :3], fields[:, 0, :, 3] = weights, places[..., 0]
    fields[:, 1, :, :2] = weights[..., :1] * places[..., 1:]
    return np.concatenate([rows, fields.reshape(-1, samples, 4)])


@dataclass(frozen=True, eq=False)
class Controls:
    """What the device multiplies tables with: ``patches`` in a list, ``texels`` each, of which those from ``first`` on
    count, ``blocks`` of four columns and what ``sides`` fields are made of; ``scale`` times the results are lengths.
    ``rows`` chooses the patches; ``key`` are the source and the constants of the fields' functions.
    """

    texture: moderngl.Texture
    patches: int
    texels: int
    blocks: int
    scale: float
    first: int = 0
    sides: int = 0
    key: tuple[str, tuple[tuple[str, int], ...]] = ("", ())
    rows: moderngl.Texture | None = None


@dataclass(frozen=True, eq=False)
class Launched:
    """Results on their way: ``shape`` (patches, samples, length) numbers at the beginning of ``buffer``."""

    buffer: moderngl.Buffer
    shape: tuple[int, int, int]


def pack_columns(*parts: Floats) -> tuple[Singles, float]:
    """Vectors ``(3,f,L)``, in one or more parts, as texels ``(f*3*blocks,4)``, and the power of two that they were
    divided by, so that products of four of them stay within single precision.
    """
    total, patches = sum(part.shape[2] for part in parts), parts[0].shape[1]
    packed = np.zeros((patches, 3, -(-total // 4) * 4), dtype=np.float32)
    largest = max(float(np.abs(part).max(initial=0.0)) for part in parts)
    scale = power_of_two(largest)
    begin = 0
    for part in parts:
        end = begin + part.shape[2]
        np.multiply(part.transpose(1, 0, 2), 1 / scale, out=packed[..., begin:end], casting="same_kind")
        begin = end
    return packed.reshape(patches, 3, -1, 4).swapaxes(1, 2).reshape(-1, 4), scale


def power_of_two(largest: float) -> float:
    """The power of two to divide by so that numbers up to ``largest`` are below 2."""
    exponent = math.frexp(largest)[1] - 1 if 0 < largest < math.inf else 0
    return 2.0 ** min(max(exponent, -126), 127)


def restored(values: Singles, origins: Floats, scale: float, dtype: np.dtype[Any]) -> Floats:
    """Points ``(f,S,3)`` in a type, from those over ``scale`` and relative to ``origins (f,3)``."""
    points = values.astype(dtype) * dtype.type(scale)
    points += origins[:, None].astype(dtype)
    return points


class Products:
    """Products on one device. Close it at the end."""

    device: Device

    def __init__(self) -> None:
        """Open the device. Raises DeviceError."""
        self._tables: dict[Hashable, moderngl.Texture] = {}
        self._table_bytes = 0
        self._programs: dict[Hashable, Evaluation] = {}
        self._built: tuple[Construction, Built] | None = None
        self._thread = ThreadPoolExecutor(1, "curvify-gpu")
        try:
            self.device = self._thread.submit(open_device).result()
        except BaseException:
            self._thread.shutdown()
            raise
        self.memory = self.run(Memory, self.device)
        self._builder = Builder(self.memory)

    def close(self) -> None:
        """Close the device once what it does is done."""
        self._thread.submit(self.device.close).result()
        self._thread.shutdown(cancel_futures=True)

    def most_patches(self, samples: int, texels: int) -> int:
        """Patches of so many samples, and texels of controls, that are evaluated at once."""
        room = self.room(max(MOST_LENGTH * 4 * samples, 16 * texels))
        return max(min(room, self.memory.most_texels // texels), 1)

    def room(self, size: int) -> int:
        """How many patches to evaluate at once whose results take ``size`` bytes each."""
        return max(self.memory.most_results // size, 1)

    def can_build(self, construction: Construction) -> bool:
        """Whether the device has room for the edges of a surface."""
        inputs = construction.inputs
        texels = max(EDGE_TEXELS, construction.field_texels)
        longest = max(len(inputs.positions), len(inputs.corners), len(inputs.sides) * texels)
        return longest <= self.memory.most_texels

    def launch(self, make: Callable[[], Controls], kind: Kind, tables: list[Table]) -> list[Launched]:
        """Let the device make controls and multiply each of the tables with them. Raises DeviceError."""
        return self.run(self._launch, make, kind, tables)

    def collect(self, launched: Launched, out: Singles | None = None) -> Singles:
        """Read results, into an array ``out`` of as many numbers if there is one. Raises DeviceError."""
        return self.run(self._collect, launched, out)

    def edges_of(self, construction: Construction, ids: Ints, fields: bool) -> Controls:
        """Curves of the edges ``ids (e,)`` from their starts, or normal fields ``ids``; in the thread of the device."""
        built = self._built_of(construction)
        rows = self.memory.send_list("indices", numbered(ids[:, None]))
        if not fields:
            return Controls(built.textures["edges"], len(ids), EDGE_TEXELS, 1, built.scale, rows=rows)
        if construction.field_texels:
            texels = construction.field_texels
            return Controls(built.textures["fields"], len(ids), texels, texels // 3, 1.0, rows=rows)
        return Controls(built.textures["edges"], len(ids), EDGE_TEXELS, 1, 1.0, CURVE_TEXELS, rows=rows)

    def patches_of(self, form: DeviceForm, rows: Ints, size: int) -> Controls:
        """Patches ``rows (f,)`` of a form, with so many sides; in the thread of the device."""
        built = self._built_of(form.construction)
        texture, texels, blocks = built.columns(form, rows, size)
        sides = size if form.fields else 0
        key = (form.fields, tuple(sorted(form.field_constants.items())))
        return Controls(texture, len(rows), texels, blocks, built.scale, sides=sides, key=key)

    def sent(self, columns: Singles, scale: float, patches: int) -> Controls:
        """Controls whose columns ``pack_columns`` gave; in the thread of the device."""
        texture = self.memory.send_list("controls", columns)
        texels = len(columns) // patches
        return Controls(texture, patches, texels, texels // 3, scale)

    def run(self, do: Callable[P, T], *args: P.args, **named: P.kwargs) -> T:
        """Do something in the thread of the device, and wait for it."""
        import moderngl

        try:
            return self._thread.submit(do, *args, **named).result()
        except moderngl.Error as error:  # no room on the device, or a driver that refuses a shader
            text = " ".join(str(error).split())
            raise DeviceError(f"{self.device.renderer} failed: {text}; try --backend cpu") from error

    def _built_of(self, construction: Construction) -> Built:
        """A construction on the device; the last one stays."""
        if self._built is None or self._built[0] is not construction:
            if self._built is not None:
                self._built[1].release()
                self._built = None
            self._built = construction, Built(self._builder, construction)
        return self._built[1]

    def _launch(self, make: Callable[[], Controls], kind: Kind, tables: list[Table]) -> list[Launched]:
        controls = make()
        textures = {"controls": controls.texture, "rows": controls.rows or self.memory.nothing}
        numbers: Numbers = {
            "layout_of": (controls.texels, controls.first),
            "blocks": controls.blocks,
            "sides": controls.sides,
            "scale": controls.scale,
            "chosen": int(controls.rows is not None),
        }
        result = []
        for table in tables:
            shape = controls.patches, table.samples, kind.length
            buffer = self.memory.buffer(4 * math.prod(shape))
            program = self._program(kind, *controls.key)
            program.evaluate({"basis": self._table(table), **textures}, numbers, buffer, shape[:2])
            result.append(Launched(buffer, shape))
        if controls.rows is not None:
            controls.rows.release()
        elif controls.texture is not self.memory.nothing:
            self.memory.give_back(controls.texture)
        return result

    def _collect(self, launched: Launched, out: Singles | None) -> Singles:
        results = np.empty(launched.shape, dtype=np.float32) if out is None else out
        self.memory.read_into(launched.buffer, results)
        self.memory.give_back(launched.buffer)
        return results

    def _program(self, kind: Kind, fields: str, constants: tuple[tuple[str, int], ...]) -> Evaluation:
        key = (kind, fields, constants)
        if key not in self._programs:
            every: Constants = dict(constants)
            self._programs[key] = Evaluation(self.device, kind, fields, every)
        return self._programs[key]

    def _table(self, table: Table) -> moderngl.Texture:
        """The texture of a table, sent unless it is there; the oldest make room."""
        found = self._tables.pop(table.key, None)
        if found is None:
            packed = table.pack()
            while self._tables and self._table_bytes + packed.nbytes > MOST_TABLES:
                old = self._tables.pop(next(iter(self._tables)))
                self._table_bytes -= _texture_bytes(old)
                old.release()
            found = self.memory.send_image("tables", packed)
            self._table_bytes += packed.nbytes
        self._tables[table.key] = found
        return found


def _texture_bytes(texture: moderngl.Texture) -> int:
    return texture.width * texture.height * 16
