"""Errors that a user can mend. The command line prints their text as one line and exits with 2."""

from __future__ import annotations


class CurvifyError(Exception):
    """Base of every error that curvify raises on purpose. Its text says where, what, and what to do."""


class FormatError(CurvifyError):
    """A file cannot be read or written as the format that its name or option says it has."""


class MeshError(CurvifyError):
    """The mesh itself is unusable: no faces, indices out of range, coordinates that are not finite."""


class OptionError(CurvifyError):
    """Options that do not fit each other, the scheme or the mesh."""


class LimitError(CurvifyError):
    """The result would be larger than the limit that guards memory and disk."""


class DeviceError(CurvifyError):
    """There is no OpenGL device, or it cannot do what is asked for."""
