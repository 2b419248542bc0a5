"""The device and the backend that tests share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from curvify.gpu.device import Device
from curvify.gpu.evaluate import GpuBackend
from opengl import device_or_skip, opened_or_skip


@pytest.fixture
def device() -> Iterator[Device]:
    """An open device."""
    with device_or_skip() as device:
        yield device


@pytest.fixture(scope="session")
def gpu() -> Iterator[GpuBackend]:
    """The GPU backend."""
    with opened_or_skip(GpuBackend) as backend:
        yield backend
