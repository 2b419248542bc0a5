"""Which backend `auto` takes when work is large."""

from __future__ import annotations

import pytest

from curvify import backends
from curvify.backends import open_backend
from curvify.gpu.device import Device


@pytest.mark.parametrize("hardware", [True, False])
def test_auto_takes_hardware_but_no_software(device, monkeypatch, hardware):
    monkeypatch.setattr(Device, "hardware", hardware)
    monkeypatch.setattr(backends, "hardware_possible", lambda: True)
    with open_backend("auto", backends.LARGE) as backend:
        assert backend.name == ("gpu" if hardware else "cpu")


def test_software_is_taken_when_asked_for(device, monkeypatch):
    monkeypatch.setattr(Device, "hardware", False)
    with open_backend("gpu", 1) as backend:
        assert backend.name == "gpu"
        assert backend.describe()["renderer"] == device.renderer
