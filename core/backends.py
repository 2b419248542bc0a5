"""What evaluates a surface: the interface of a backend, the CPU's, and how one is found by name.

The GPU's is imported only when it is asked for, or worth it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol

from curvify import evaluate
from curvify.errors import DeviceError, OptionError
from curvify.mesh import Floats, Ints
from curvify.sampling import Sampling
from curvify.schemes.base import Edges, PatchClass, Patches

if TYPE_CHECKING:
    from curvify.gpu.evaluate import GpuBackend

NAMES = ("auto", "cpu", "gpu")
#: What Linux has where there is a GPU: graphics drivers, NVIDIA's own, and that of Windows below it.
DEVICE_FILES = ("/dev/dri", "/dev/nvidiactl", "/dev/dxg")
#: Samples from which `auto` looks for a GPU. The CPU makes about 7 million a second on one core; to open a device and
#: compile its programs takes a few tenths of a second, so below this the CPU is done by then.
LARGE = 5_000_000


class Backend(Protocol):
    """Evaluates edges and the insides of patches; its methods may be called from several threads at once."""

    name: str

    def edges(self, edges: Edges, ids: Ints, fields: Ints, t: Floats) -> tuple[Floats, Floats]:
        """Positions and unit normals ``(3,e,m)`` at ``t (m,)`` on edges ``ids (e,)`` with normal fields ``(e,)``."""

    def fill_patches(
        self,
        patches: Patches,
        patch_class: PatchClass,
        rows: Ints,
        sampling: Sampling,
        level: int,
        tolerance: float,
        positions: Floats,
        normals: Floats,
    ) -> None:
        """Write into ``positions`` and ``normals (f,S,3)``, as ``evaluate.fill_patches`` does."""

    def describe(self) -> dict[str, Any]:
        """What it is, for the report."""

    @property
    def bytes_sent(self) -> int:
        """Bytes sent to a device so far."""

    def traffic(self) -> dict[str, Any]:
        """What went to a device and back so far, and what was done where, for the report; nothing without a device."""


class CpuBackend:
    """Float64 on the processor."""

    name = "cpu"
    bytes_sent = 0
    fill_patches = staticmethod(evaluate.fill_patches)

    def edges(self, edges: Edges, ids: Ints, fields: Ints, t: Floats) -> tuple[Floats, Floats]:
        """Positions and unit normals of edges."""
        return edges.points(ids, t), edges.normals(fields, t)

    def describe(self) -> dict[str, Any]:
        """Nothing but its name."""
        return {"name": self.name}

    def traffic(self) -> dict[str, Any]:
        """None."""
        return {}


@contextmanager
def open_backend(name: str, samples: int) -> Iterator[Backend]:
    """The backend of a name, for about so many samples; a device is closed at the end.

    ``auto`` is the GPU where there is one that is no software and the work is large, the CPU otherwise.
    Raises OptionError for a name that is none, DeviceError for ``gpu`` without a device.
    """
    if name not in NAMES:
        raise OptionError(f"the backend must be one of {', '.join(NAMES)}, not {name!r}")
    wanted = name == "gpu" or (name == "auto" and samples >= LARGE and hardware_possible())
    gpu = _open_gpu(name == "gpu") if wanted else None
    if gpu is None:
        yield CpuBackend()
        return
    with gpu:
        yield gpu


def hardware_possible() -> bool:
    """Whether there can be a GPU: on Linux, whether there is a device file of one.

    A look costs nothing, while to open OpenGL where it is software takes 60 MB and a tenth of a second.
    """
    return sys.platform != "linux" or any(os.access(file, os.F_OK) for file in DEVICE_FILES)


def _open_gpu(asked: bool) -> GpuBackend | None:
    """The GPU backend; unless ``asked`` for, None where there is no device or only software that acts as one."""
    from curvify.gpu.evaluate import GpuBackend

    try:
        return GpuBackend(software=asked)
    except DeviceError:
        if asked:
            raise
        return None
