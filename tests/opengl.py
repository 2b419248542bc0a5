"""Opening the OpenGL device that tests draw on. No test lives here."""

from __future__ import annotations

import os

import pytest

from curvify.errors import DeviceError
from curvify.gpu.device import Device, open_device

#: Set to anything, it makes tests fail rather than skip where there is no device.
NEEDED = "CURVIFY_TEST_GPU"


def device_or_skip() -> Device:
    """A device; the test is skipped where there is none, unless the environment forbids that."""
    try:
        return open_device()
    except DeviceError as error:
        if os.environ.get(NEEDED):
            raise
        pytest.skip(str(error))
