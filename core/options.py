"""The options that all schemes share: what is done with a mesh before any surface is built on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.errors import OptionError
from curvify.mesh import Marks

WELD_MODES = ("auto", "always", "never")
#: Where sharp edges may come from: every source by its rank (auto), none of them, or one alone.
SHARP_SOURCES = ("auto", "none", "angle", "normals", "groups", "tags")


@dataclass(frozen=True)
class MeshOptions:
    """Options of every scheme; the options of a scheme are a dataclass derived from this one.

    ``weld``: ``auto`` closes seams between bit-equal open edges, ``always`` merges all bit-equal positions, ``never``
    neither. ``sharp_from``: which of the mesh's own sources of sharp features count, see ``marks.gather_marks``;
    ``sharp_angle``: edges at which the faces turn by more than this angle, in degrees, become creases. ``marks`` are
    further ones, by vertices and faces of the mesh, and override all others.
    Raises OptionError for what cannot be.
    """

    weld: str = "auto"
    sharp_from: str = "auto"
    sharp_angle: float | None = None
    marks: Marks | None = None

    def __post_init__(self) -> None:
        if self.weld not in WELD_MODES:
            raise OptionError(f"weld must be one of {', '.join(WELD_MODES)}, not {self.weld!r}")
        if self.sharp_from not in SHARP_SOURCES:
            raise OptionError(f"sharp_from must be one of {', '.join(SHARP_SOURCES)}, not {self.sharp_from!r}")
        if self.sharp_angle is None:
            if self.sharp_from == "angle":
                raise OptionError("sharp edges from an angle need one: give --sharp-angle, for example 40")
        elif not (np.isfinite(self.sharp_angle) and 0 <= self.sharp_angle <= 180):
            raise OptionError(f"sharp_angle must be from 0 to 180 degrees, not {self.sharp_angle}")
        elif self.sharp_from not in ("auto", "angle"):
            raise OptionError(f"--sharp-angle says nothing with --sharp-from {self.sharp_from}; leave one of them out")
