"""The answer to one question about a mesh: yes or no, why, and where."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from curvify.mesh import Bools, Floats, Ints

#: How many places a finding lists.
MOST_PLACES = 10


@dataclass(frozen=True)
class Finding:
    """The answer for one condition.

    ``reason`` says in words what is wrong, or what was measured; ``limit`` is what was asked for and ``measured`` the
    value that was compared with it, None where there is no number; ``count`` how many places fail. ``where`` lists the
    first of them, the worst first where there is a worst: vertices and faces as numbers, edges as pairs of vertices,
    all as in the file, counted from 0. ``kind`` is what these are: vertex, edge or face; empty for the whole mesh.
    """

    name: str
    passed: bool
    reason: str = ""
    limit: float | None = None
    measured: float | None = None
    count: int = 0
    kind: str = ""
    where: tuple[Any, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self)


def first_ids(ids: Ints) -> tuple[int, ...]:
    """The first few of some vertices or faces."""
    return tuple(int(i) for i in ids[:MOST_PLACES])


def worst_first(values: Floats, failing: Bools) -> Ints:
    """Indices of the failing values, the largest first, the first of equal ones before the others."""
    over = np.flatnonzero(failing)
    return over[np.argsort(-values[over], kind="stable")]
