"""A device for the tests: they skip where there is none, unless CURVIFY_GPU_TESTS=required says that there must be."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from curvify.errors import DeviceError
from curvify.gpu.device import open_device
from curvify.gpu.evaluate import GpuBackend


def opened_or_skipped(open_it):
    """What a function opens; skips the test where there is no device, which may be forbidden."""
    try:
        return open_it()
    except DeviceError as error:
        if os.environ.get("CURVIFY_GPU_TESTS") == "required":
            raise
        pytest.skip(str(error))


@pytest.fixture
def device():
    """An open device."""
    with opened_or_skipped(open_device) as device:
        yield device


@pytest.fixture(scope="session")
def gpu() -> Iterator[GpuBackend]:
    """The GPU backend."""
    with opened_or_skipped(GpuBackend) as backend:
        yield backend
