"""The programs that multiply control vectors and tables on a device, made from the sources in shaders/.

``evaluate.glsl`` holds the functions; ``compute.glsl`` is their entry where there are compute shaders (OpenGL 4.3),
``feedback.glsl`` where there are none, by transform feedback (OpenGL 3.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from curvify.gpu.device import Device

if TYPE_CHECKING:
    import moderngl

SHADERS = Path(__file__).parent / "shaders"
#: Patches and samples that one invocation of the compute shader works on, and invocations in a group.
TILE, GROUP = (4, 2), 8


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


class Program:
    """One kind of evaluation on one device."""

    def __init__(self, device: Device, kind: Kind) -> None:
        self.device, self.kind = device, kind
        self._feedback: moderngl.VertexArray | None = None
        self._shader: Any
        if device.compute:
            self._shader = device.ctx.compute_shader(_source(kind, 430, TILE, "compute"))
        else:
            varyings = ("value", "normal") if kind.orders == 3 else ("value",)
            source = _source(kind, 330, (1, 1), "feedback")
            self._shader = device.ctx.program(vertex_shader=source, varyings=varyings)
            self._feedback = device.ctx.vertex_array(self._shader, [])
        self._shader["basis"], self._shader["controls"] = 0, 1

    def run(
        self,
        basis: moderngl.Texture,
        controls: moderngl.Texture,
        results: moderngl.Buffer,
        shape: tuple[int, int, int],
    ) -> None:
        """Evaluate ``shape`` = (patches, samples, blocks of four columns) into ``results``. Raises DeviceError."""
        patches, samples, blocks = shape
        basis.use(0)
        controls.use(1)
        for name, value in (("patches", patches), ("samples", samples), ("blocks", blocks)):
            if name in self._shader:  # a compiler may find that one is not needed
                self._shader[name] = value
        if self._feedback is None:
            results.bind_to_storage_buffer(0)
            across = -(-samples // (TILE[1] * GROUP))
            self._shader.run(across, -(-patches // TILE[0]))
            self.device.ctx.memory_barrier()
        else:
            self._feedback.transform(results, mode=self.device.ctx.POINTS, vertices=patches * samples)
        self.device.check()


def _source(kind: Kind, version: int, tile: tuple[int, int], entry: str) -> str:
    """GLSL of a program."""
    constants = {kind.name: 1, "ORDERS": kind.orders, "LENGTH": kind.length, "PATCHES": tile[0], "SAMPLES": tile[1]}
    return read_shaders(version, constants, "evaluate", entry)


def read_shaders(version: int, constants: dict[str, int], *names: str) -> str:
    """GLSL of some sources, with constants defined."""
    lines = [f"#version {version} core", *(f"#define {name} {value}" for name, value in constants.items())]
    return "\n".join([*lines, *((SHADERS / f"{name}.glsl").read_text(encoding="utf-8") for name in names)])
