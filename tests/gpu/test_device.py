"""The headless device: what it knows of itself, how it is chosen, what is said where there is none."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from curvify.errors import DeviceError
from curvify.gpu.device import COMPUTE_VERSION, LEAST_VERSION, Device, open_device

NO_LIBRARIES = {"GLCONTEXT_LINUX_LIBEGL": "libnone.so", "GLCONTEXT_LINUX_LIBGL": "libnone.so"}


def test_a_device_knows_what_it_is(device):
    facts = device.facts()
    assert facts["version_code"] >= LEAST_VERSION
    assert facts["compute"] == (facts["version_code"] >= COMPUTE_VERSION)
    assert facts["renderer"]
    assert facts["version"].startswith(f"{facts['version_code'] // 100}.")
    assert facts["limits"]["GL_MAX_TEXTURE_SIZE"] >= 1024


class Context:
    """As much of a context as a device needs."""

    def __init__(self, renderer: str = "none", error: str = "GL_NO_ERROR") -> None:
        self.info, self.error = {"GL_VENDOR": "Mesa", "GL_RENDERER": renderer}, error

    def simple_framebuffer(self, size):
        return self

    def use(self):
        pass


@pytest.mark.parametrize(
    ("renderer", "hardware"),
    [
        ("llvmpipe (LLVM 15.0.6, 256 bits)", False),
        ("softpipe", False),
        ("Apple Software Renderer", False),
        ("GDI Generic", False),
        ("NVIDIA H100 PCIe/PCIe/SSE2", True),
        ("AMD Radeon RX 6700 XT (navi22, LLVM 15.0.6)", True),
        ("Mesa Intel(R) UHD Graphics 620 (KBL GT2)", True),
    ],
)
def test_software_is_told_from_hardware(renderer, hardware):
    assert Device(Context(renderer), "EGL").hardware == hardware  # type: ignore[arg-type]


def test_errors_of_the_device_are_raised():
    Device(Context(), "EGL").check()  # type: ignore[arg-type]
    with pytest.raises(DeviceError, match="failed with GL_OUT_OF_MEMORY; try --backend cpu"):
        Device(Context(error="GL_OUT_OF_MEMORY"), "EGL").check()  # type: ignore[arg-type]


def test_transform_feedback_writes_from_the_start(device):
    source = "#version 330 core\nout float value;\nvoid main() { value = float(gl_VertexID) + 0.5; }"
    program = device.ctx.program(vertex_shader=source, varyings=["value"])
    out = device.ctx.buffer(reserve=16)
    device.ctx.vertex_array(program, []).transform(out, mode=device.ctx.POINTS, vertices=4)
    device.check()
    assert np.frombuffer(out.read(), "f4").tolist() == [0.5, 1.5, 2.5, 3.5]


def test_a_device_may_be_closed_twice(device):
    device.close()
    device.close()


@pytest.mark.parametrize("choice", ["vulkan", "egl:", "egl:x", "default:1", "EGL"])
def test_a_choice_that_is_none_is_refused(monkeypatch, choice):
    monkeypatch.setenv("CURVIFY_GL", choice)
    with pytest.raises(DeviceError, match="CURVIFY_GL must be egl, egl:NUMBER, default or none"):
        open_device()


def test_opengl_can_be_switched_off(monkeypatch):
    monkeypatch.setenv("CURVIFY_GL", "none")
    with pytest.raises(DeviceError, match="switched off by CURVIFY_GL=none"):
        open_device()


def test_a_device_that_is_not_there_is_named(device, monkeypatch):
    monkeypatch.setenv("CURVIFY_GL", "egl:99")
    with pytest.raises(DeviceError, match="EGL: requested device index 99"):
        open_device()


def test_missing_libraries_are_named_with_what_to_install(monkeypatch):
    monkeypatch.delenv("CURVIFY_GL", raising=False)
    for name, value in NO_LIBRARIES.items():
        monkeypatch.setenv(name, value)
    with pytest.raises(DeviceError) as caught:
        open_device()
    text = str(caught.value)
    assert "libnone.so not loaded" in text
    assert "apt install libgl1 libegl1" in text
    assert "\n" not in text


def test_a_missing_moderngl_is_named(monkeypatch):
    monkeypatch.delenv("CURVIFY_GL", raising=False)
    monkeypatch.setitem(sys.modules, "moderngl", None)
    with pytest.raises(DeviceError, match="pip install moderngl"):
        open_device()
