"""Backends by name: what `auto` takes, what is said of names that are none; and what schemes tell backends."""

from __future__ import annotations

import numpy as np
import pytest

import curvify
from curvify import backends
from curvify.backends import CpuBackend, open_backend
from curvify.errors import DeviceError, OptionError
from curvify.schemes import NAMES
from curvify.schemes.base import KiteForms
from surfaces import mixed_ball


def test_unknown_backends_are_refused():
    with pytest.raises(OptionError, match="must be one of auto, cpu, gpu, not 'opencl'"):
        curvify.refine(mixed_ball(), backend="opencl")


@pytest.mark.parametrize("name", ["cpu", "auto"])
def test_small_work_looks_for_no_device(name, monkeypatch):
    monkeypatch.setattr(backends, "_open_gpu", lambda asked: pytest.fail("a device was looked for"))
    with open_backend(name, backends.LARGE - 1) as backend:
        assert backend.describe() == {"name": "cpu"}
        assert backend.bytes_sent == 0
        assert backend.traffic() == {}


def test_auto_opens_nothing_where_no_device_file_is(monkeypatch):
    monkeypatch.setattr(backends.sys, "platform", "linux")
    monkeypatch.setattr(backends, "DEVICE_FILES", ("/dev/no-such-device",))
    monkeypatch.setattr(backends, "_open_gpu", lambda asked: pytest.fail("a device was looked for"))
    with open_backend("auto", backends.LARGE) as backend:
        assert isinstance(backend, CpuBackend)


def test_auto_does_without_a_device_but_gpu_does_not(monkeypatch):
    monkeypatch.setenv("CURVIFY_GL", "none")
    monkeypatch.setattr(backends, "hardware_possible", lambda: True)
    with open_backend("auto", backends.LARGE) as backend:
        assert isinstance(backend, CpuBackend)
    with pytest.raises(DeviceError, match="CURVIFY_GL"), open_backend("gpu", 1):
        pass


@pytest.mark.parametrize("scheme", [name for name in NAMES if name != "overveld"])
def test_the_weights_of_points_sum_to_one(scheme):
    """A backend may move the points of a form to another origin; overveld has no forms."""
    patches = curvify.surface(mixed_ball(), scheme).patches
    for patch_class in patches.classes:
        sampling, surface = patches.sampling(patch_class.sides, 4), patch_class.surface
        kites = isinstance(surface, KiteForms)
        for form in surface.forms if kites else [surface]:
            assert form.points > 0
            linear = form.basis(sampling.kite if kites else sampling.points).linear[..., : form.points]
            assert np.abs(linear[0].sum(axis=1) - 1).max() < 1e-12
            assert np.abs(linear[1:].sum(axis=2)).max() < 1e-11
