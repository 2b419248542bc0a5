"""Options and settings that all tests share."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("curvify", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("curvify")


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--update-goldens`` writes what the code makes now into tests/golden."""
    parser.addoption("--update-goldens", action="store_true", help="write tests/golden anew from the present code")
