"""Control vectors built on the device, from what ``schemes/construction.py`` says a surface is made of.

Positions go up as whole numbers, 2^31 over the mesh: their differences are exact, so that neither the place of a mesh
nor its size takes digits from its smallest edge. One pass makes the edges, once for a mesh; for the patches of a job
another makes what their sides need, and a third their control vectors. All of it stays on the device.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from curvify.gpu.memory import Memory
from curvify.gpu.programs import WIDTH, Constants, Numbers, Records
from curvify.mesh import Floats, Ints
from curvify.schemes.construction import CURVE_TEXELS, EDGE_TEXELS, Construction, DeviceForm

if TYPE_CHECKING:
    import moderngl

#: Whole numbers that positions are turned into: as many as leave room for their differences.
GRID = 1 << 30
#: What is named by its number goes up as these.
Numbered = npt.NDArray[np.int32]


class Builder:
    """Programs that build, by what they are made of."""

    def __init__(self, memory: Memory) -> None:
        self.memory = memory
        self._programs: dict[tuple[object, ...], Records] = {}

    def make(
        self,
        construction: Construction,
        function: str,
        texels: int,
        items: int,
        textures: Mapping[str, moderngl.Texture],
        numbers: Numbers | None = None,
        constants: Constants | None = None,
    ) -> moderngl.Texture:
        """A list of the records of so many items, ``texels`` each. Raises DeviceError."""
        every: dict[str, int | str] = {"EDGE_TEXELS": EDGE_TEXELS, "CURVE_TEXELS": CURVE_TEXELS}
        every |= {"FIELD_TEXELS": construction.field_texels, **construction.constants, **(constants or {})}
        names = (construction.program, *(["columns"] if function == "column_record" else []))
        key = (names, function, texels, *sorted(every.items()))
        program = self._programs.get(key)
        if program is None:
            program = self._programs[key] = Records(self.memory.device, names, function, texels, every)
        return self._fill(program, items, textures, construction.numbers | dict(numbers or {}))

    def _fill(
        self, program: Records, items: int, textures: Mapping[str, moderngl.Texture], numbers: Numbers
    ) -> moderngl.Texture:
        """Run a program for all items, as many at once as the device takes; whole rows of the list each time."""
        total = items * program.texels
        made = self.memory.texture(total)
        step = max(self.memory.most_results // (16 * program.texels * WIDTH), 1) * WIDTH
        for first in range(0, items, step):
            count = min(step, items - first)
            height = -(-count * program.texels // made.width)
            buffer = self.memory.buffer(16 * made.width * height)
            program.make(textures, numbers, buffer, first, count)
            made.write(buffer, viewport=(0, first * program.texels // made.width, made.width, height))
            self.memory.give_back(buffer)
        return made


class Built:
    """A construction on the device: its inputs and its edges."""

    def __init__(self, builder: Builder, construction: Construction) -> None:
        self.builder, self.construction = builder, construction
        inputs, send = construction.inputs, builder.memory.send_list
        grid, self.scale = on_grid(inputs.positions)
        vectors = inputs.vectors.reshape(-1, 3)
        self.textures = {
            "positions": send("vectors", grid),
            "normals": send("vectors", inputs.normals.astype(np.float32)),
            "vectors": send("vectors", vectors.astype(np.float32)),
            "sides": send("indices", numbered(inputs.sides)),
            "features": send("indices", numbered(inputs.features[:, None])),
            "corners": send("indices", numbered(inputs.corners[:, None])),
        }
        if inputs.links is not None:
            self.textures["links"] = send("indices", numbered(inputs.links))
        self._make_edges(len(inputs.sides))

    def _make_edges(self, sides: int) -> None:
        make, texels = self.builder.make, self.construction.field_texels
        self.textures["edges"] = make(self.construction, "edge_record", EDGE_TEXELS, sides, self.textures)
        if texels:
            self.textures["fields"] = make(self.construction, "field_record", texels, sides, self.textures)

    def columns(self, form: DeviceForm, rows: Ints, size: int) -> tuple[moderngl.Texture, int, int]:
        """Control vectors of the patches ``rows (f,)`` of a form, polygons of so many sides: a list, how many texels a
        patch has in it, and how many blocks of four columns.
        """
        memory, make = self.builder.memory, self.builder.make
        names = np.zeros((len(rows), 2), dtype=np.int32)
        names[:, 0] = form.corners[rows]
        if form.shapes is not None:
            names[:, 1] = form.shapes[rows].astype(np.float32).view(np.int32)
        chosen = memory.send_list("indices", names if form.shapes is not None else names[:, :1])
        textures = self.textures | {"rows": chosen}
        numbers: dict[str, float | tuple[float, ...]] = {"size": size, **form.numbers}
        for step in form.passes:
            items = len(rows) * (size if step.sides else 1)
            textures[step.name] = make(self.construction, step.function, step.texels, items, textures, numbers)
        texels = form.texels(size)
        blocks = -(-form.columns // 4)
        numbers |= {"columns": form.columns, "blocks": blocks, "first_slot": form.slots[0]}
        constants: dict[str, int | str] = {"COLUMN": form.column, "SLOTS": form.slots[1]}
        items = len(rows) * texels // 3
        made = make(self.construction, "column_record", 3, items, textures, numbers, constants)
        for step in form.passes:
            memory.give_back(textures[step.name])
        chosen.release()
        return made, texels, blocks

    def release(self) -> None:
        """Free what lies on the device."""
        for texture in self.textures.values():
            if texture is not self.builder.memory.nothing:
                texture.release()


def on_grid(positions: Floats) -> tuple[Numbered, float]:
    """Positions ``(V,3)`` as whole numbers below ``GRID`` in size, and what ``GRID`` of them are in length."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    middle = low + (high - low) / 2
    reach = float(np.abs(positions - middle).max())
    scale = 2.0 ** (math.frexp(reach)[1]) if reach > 0 else 1.0
    whole = np.rint((positions - middle) * (GRID / scale))
    return np.clip(whole, 1 - GRID, GRID - 1).astype(np.int32), scale


def numbered(rows: Ints) -> Numbered:
    """Indices as they go up."""
    return rows.astype(np.int32)
