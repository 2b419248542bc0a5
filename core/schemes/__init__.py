"""The surface schemes: one module each, loaded when asked for."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from curvify.errors import OptionError

#: Scheme names in the order they are listed.
NAMES = ("gregory", "blend", "png1", "pn", "phong", "overveld")


def load_scheme(name: str) -> Any:
    """The module of a scheme (see ``schemes.base.Scheme``). Raises OptionError for an unknown name."""
    if name not in NAMES:
        raise OptionError(f"there is no scheme {name!r}; choose from {', '.join(NAMES)}")
    return import_module(f"curvify.schemes.{name}")
