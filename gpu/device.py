"""A headless OpenGL context, and what is known of the device behind it.

On Linux EGL is tried first, since it needs no display, then, as elsewhere, the platform's own way: X11, WGL, CGL. The
environment variable ``CURVIFY_GL`` chooses: ``egl``, ``egl:1`` for the second EGL device, ``default`` for the
platform's own way, ``none`` to act as if there were no OpenGL at all.
"""

from __future__ import annotations

import os
import re
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from curvify.errors import DeviceError

if TYPE_CHECKING:
    import moderngl

#: Names the way to a context, see above.
VARIABLE = "CURVIFY_GL"
#: The oldest OpenGL that is of use: transform feedback and gl_VertexID.
LEAST_VERSION = 330
#: From this version on there are compute shaders and storage buffers.
COMPUTE_VERSION = 430
#: EGL devices that are tried in turn.
MOST_DEVICES = 4
#: Parts of the names of renderers that run on the processor.
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software", "swiftshader", "microsoft basic render", "gdi generic")
#: What is told of a device's limits, by the names of OpenGL.
LIMITS = (
    "GL_MAX_TEXTURE_SIZE",
    "GL_MAX_SAMPLES",
    "GL_MAX_UNIFORM_BLOCK_SIZE",
    "GL_MAX_SHADER_STORAGE_BLOCK_SIZE",
    "GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS",
    "GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS",
    "GL_MAX_COMPUTE_WORK_GROUP_COUNT",
)
#: What to do where there is no OpenGL.
ADVICE = "install OpenGL and a driver (Debian and Ubuntu: apt install libgl1 libegl1)"


@dataclass(eq=False)
class Device:
    """An open OpenGL device: ``ctx``, current in the thread that opened it, and facts about it.

    A context belongs to one thread and does not survive a fork. A framebuffer of one pixel is bound from the start:
    without any, EGL contexts drop the results of transform feedback, and say nothing. Close it, or use it as a context
    manager. ``way`` is what opened it: EGL, X11, WGL or CGL.
    """

    ctx: moderngl.Context
    way: str

    @property
    def vendor(self) -> str:
        """Who made the driver."""
        return str(self.ctx.info["GL_VENDOR"])

    @property
    def renderer(self) -> str:
        """The device, as its driver names it."""
        return str(self.ctx.info["GL_RENDERER"])

    @property
    def version(self) -> str:
        """The version of OpenGL with what the driver adds to it."""
        return str(self.ctx.info["GL_VERSION"])

    @property
    def version_code(self) -> int:
        """The version of OpenGL as a number, 450 for 4.5."""
        return int(self.ctx.version_code)

    @property
    def compute(self) -> bool:
        """Whether it has compute shaders."""
        return self.version_code >= COMPUTE_VERSION

    @property
    def hardware(self) -> bool:
        """Whether it is a GPU, not a program that acts as one."""
        names = f"{self.vendor} {self.renderer}".lower()
        return not any(name in names for name in SOFTWARE)

    @property
    def limits(self) -> dict[str, int | tuple[int, ...]]:
        """Those of ``LIMITS`` that the device knows."""
        info = self.ctx.info
        return {name: info[name] for name in LIMITS if name in info}

    def facts(self) -> dict[str, Any]:
        """All of the above, for a report."""
        return {
            "vendor": self.vendor,
            "renderer": self.renderer,
            "version": self.version,
            "version_code": self.version_code,
            "opened_by": self.way,
            "hardware": self.hardware,
            "compute": self.compute,
            "limits": self.limits,
        }

    def check(self, advice: str = "try --backend cpu") -> None:
        """Raise DeviceError, with what to do about it, if OpenGL has met an error since the last check."""
        error = self.ctx.error
        if error != "GL_NO_ERROR":
            raise DeviceError(f"OpenGL on {self.renderer} failed with {error}; {advice}")

    def __post_init__(self) -> None:
        self._open = True
        _ = self.ctx.info  # kept by the context; asked for later, from another thread, it would be empty
        self._pixel = self.ctx.simple_framebuffer((1, 1))
        self._pixel.use()

    def close(self) -> None:
        """Release the context with all that was made in it."""
        if self._open:
            self._open = False
            self.ctx.release()

    def __enter__(self) -> Device:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_device() -> Device:
    """Open a headless context in this thread. Raises DeviceError, which says what to install, where there is none."""
    choice = os.environ.get(VARIABLE, "") or "auto"
    if choice == "none":
        raise DeviceError(f"OpenGL is switched off by {VARIABLE}=none; unset it")
    try:
        import moderngl
    except ImportError as error:
        raise DeviceError(f"the Python package moderngl cannot be imported ({error}); pip install moderngl") from None
    reasons = []
    for way, settings in _ways(choice):
        try:
            ctx = moderngl.create_context(require=LEAST_VERSION, standalone=True, **settings)
        except Exception as error:  # moderngl raises nothing more particular
            reasons.append(f"{way}: {str(error).strip()}")
            continue
        return Device(ctx, way)
    raise DeviceError(f"no OpenGL device ({'; '.join(reasons)}); {ADVICE}")


def _ways(choice: str) -> list[tuple[str, dict[str, Any]]]:
    """Names and settings of the contexts to try, in order. Raises DeviceError for a choice that is none."""
    if not re.fullmatch(r"auto|egl(:[0-9]+)?|default", choice):
        raise DeviceError(f"{VARIABLE} must be egl, egl:NUMBER, default or none, not {choice!r}")
    kind, _, number = choice.partition(":")
    linux = sys.platform.startswith("linux")
    # The libraries' names are known there: moderngl would run other programs to find them.
    egl = {"libgl": "libGL.so.1", "libegl": "libEGL.so.1"} if linux else {}
    own = {"libgl": "libGL.so.1", "libx11": "libX11.so.6"} if linux else {}
    ways: list[tuple[str, dict[str, Any]]] = []
    if kind == "egl" or (kind == "auto" and linux):
        ways.append(("EGL", {"backend": "egl", "device_index": int(number or 0), **egl}))
    if kind in ("auto", "default"):
        ways.append((_own_name(), own))
    return ways


def _own_name() -> str:
    """What contexts are opened by where nothing else is asked for."""
    return {"win32": "WGL", "darwin": "CGL"}.get(sys.platform, "X11")
