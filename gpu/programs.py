"""The programs that run on a device, made from the sources in shaders/.

Each comes in two forms with the same functions: as a compute shader (OpenGL 4.3), and as a vertex shader whose results
are captured by transform feedback (OpenGL 3.3). Some make *records*, a number of texels for each item, which stay on
the device in a texture; the others evaluate patches at samples (``evaluate.glsl``), for the processor to read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from curvify.gpu.device import Device

if TYPE_CHECKING:
    import moderngl

SHADERS = Path(__file__).parent / "shaders"
#: Patches and samples that one invocation of the compute shader works on, and invocations in a group.
TILE, GROUP = (4, 2), 8
#: Invocations in a group of the programs that make records.
RECORD_GROUP = 64
#: Groups along one axis that every device allows.
MOST_GROUPS = 65535
#: Texels in a row of a texture of records.
WIDTH_BITS = 12
WIDTH = 1 << WIDTH_BITS

#: Constants of a program, and its arguments.
Constants = Mapping[str, int | str]
Numbers = Mapping[str, float | tuple[float, ...]]


@dataclass(frozen=True)
class Kind:
    """What a program computes: ``orders`` 3 for value and derivatives, 1 for values; ``length`` numbers a sample."""

    name: str
    orders: int
    length: int


#: Positions and the unit cross products of the derivatives.
NORMALS = Kind("NORMALS", 3, 6)
#: Values as they are.
VALUES = Kind("VALUES", 1, 3)
#: Values made unit vectors, zero where they have no direction.
UNIT = Kind("UNIT", 1, 3)
#: The most numbers a sample that any of them makes.
MOST_LENGTH = 6


class Shader:
    """One program on one device, with its textures and arguments by name; those it does not need are passed over."""

    def __init__(self, device: Device, constants: Constants, names: tuple[str, ...], varyings: tuple[str, ...]) -> None:
        """From the sources ``names``, the last of which has an entry for each form. Raises DeviceError."""
        self.device = device
        self._feedback: moderngl.VertexArray | None = None
        self._shader: Any
        *functions, entry = names
        form = "compute" if device.compute else "feedback"
        text = read_shaders(430 if device.compute else 330, constants, *functions, f"{entry}.{form}")
        if device.compute:
            self._shader = device.ctx.compute_shader(text)
        else:
            self._shader = device.ctx.program(vertex_shader=text, varyings=varyings)
            self._feedback = device.ctx.vertex_array(self._shader, [])

    def run(
        self,
        textures: Mapping[str, moderngl.Texture],
        numbers: Numbers,
        results: moderngl.Buffer,
        groups: tuple[int, int],
        vertices: int,
    ) -> None:
        """Into ``results``, by so many groups of invocations or by so many vertices. Raises DeviceError."""
        for unit, (name, texture) in enumerate(textures.items()):
            if name in self._shader:
                texture.use(unit)
                self._shader[name] = unit
        for name, value in numbers.items():
            if name in self._shader:
                self._shader[name] = value
        if self._feedback is None:
            results.bind_to_storage_buffer(0)
            self._shader.run(*groups)
            self.device.ctx.memory_barrier()
        else:
            self._feedback.transform(results, mode=self.device.ctx.POINTS, vertices=vertices)
        self.device.check()


class Evaluation(Shader):
    """The program for one kind of evaluation, with the side fields of the source ``fields``, if any."""

    def __init__(self, device: Device, kind: Kind, fields: str, constants: Constants) -> None:
        tile = TILE if device.compute else (1, 1)
        every: dict[str, int | str] = {kind.name: 1, "ORDERS": kind.orders, "LENGTH": kind.length}
        every |= {"PATCHES": tile[0], "SAMPLES": tile[1], "GROUP": GROUP, **constants}
        if fields:
            every["FIELDS"] = 1
        names = (*([fields] if fields else []), "evaluate", "evaluate")
        super().__init__(device, every, names, ("value", "normal") if kind.orders == 3 else ("value",))

    def evaluate(
        self,
        textures: Mapping[str, moderngl.Texture],
        numbers: Numbers,
        results: moderngl.Buffer,
        shape: tuple[int, int],
    ) -> None:
        """Evaluate ``shape`` = (patches, samples). Raises DeviceError."""
        patches, samples = shape
        groups = -(-samples // (TILE[1] * GROUP)), -(-patches // TILE[0])
        self.run(textures, {"patches": patches, "samples": samples, **numbers}, results, groups, patches * samples)


class Records(Shader):
    """The program ``function`` of a source, that makes ``texels`` for each item."""

    def __init__(
        self, device: Device, names: tuple[str, ...], function: str, texels: int, constants: Constants
    ) -> None:
        self.texels = texels
        every = {**constants, "RECORD": function, "TEXELS": texels}
        super().__init__(device, every, (*names, "records"), ("texels",))

    def make(
        self,
        textures: Mapping[str, moderngl.Texture],
        numbers: Numbers,
        results: moderngl.Buffer,
        first: int,
        items: int,
    ) -> None:
        """Make the records of ``items`` from the first one on. Raises DeviceError."""
        groups = -(-items // RECORD_GROUP)
        across = min(groups, MOST_GROUPS)
        every = {"first_item": first, "items": items, **numbers}
        self.run(textures, every, results, (across, -(-groups // across)), items)


def read_shaders(version: int, constants: Constants, *names: str) -> str:
    """GLSL of some sources with all that they include, each once, and with constants defined."""
    every: dict[str, int | str] = {"WIDTH": WIDTH, "WIDTH_BITS": WIDTH_BITS, **constants}
    lines = [f"#version {version} core", *(f"#define {name} {value}" for name, value in every.items())]
    seen: set[str] = set()
    return "\n".join([*lines, *(text for name in names for text in _with_includes(name, seen))])


def _with_includes(name: str, seen: set[str]) -> Iterator[str]:
    """The text of a source after what it includes, unless it was ``seen``."""
    if name in seen:
        return
    seen.add(name)
    text = (SHADERS / f"{name}.glsl").read_text(encoding="utf-8")
    for other in re.findall(r'^#include "(\w+)"$', text, re.MULTILINE):
        yield from _with_includes(other, seen)
    yield re.sub(r'^#include "\w+"$', "", text, flags=re.MULTILINE)
