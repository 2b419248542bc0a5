"""Opening the OpenGL device that tests draw and evaluate on. No test lives here."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TypeVar

import pytest

from curvify.errors import DeviceError
from curvify.gpu.device import Device, open_device

#: Set to anything, it makes tests fail rather than skip where there is no device.
NEEDED = "CURVIFY_TEST_GPU"
Opened = TypeVar("Opened")


def device_or_skip() -> Device:
    """A device; the test is skipped where there is none, unless the environment forbids that."""
    return opened_or_skip(open_device)


def opened_or_skip(open_it: Callable[[], Opened]) -> Opened:
    """What needs a device to be opened; the test is skipped likewise."""
    try:
        return open_it()
    except DeviceError as error:
        if os.environ.get(NEEDED):
            raise
        pytest.skip(str(error))
