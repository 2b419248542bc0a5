"""Work is done on arrays: the number of Python calls follows the number of jobs, not that of faces."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import pytest

import curvify
from curvify.schemes import folds
from surfaces import flat_grid, noisy, torus

CORE = str(Path(curvify.__file__).resolve().parent)


def calls_of(work: Callable[[], object]) -> int:
    """Calls of functions of the package in this thread."""
    count = 0

    def watch(frame: FrameType, event: str, _: object) -> None:
        nonlocal count
        count += event == "call" and frame.f_code.co_filename.startswith(CORE)

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        work()
    finally:
        sys.setprofile(before)
    return count


def test_building_a_surface_takes_calls_by_the_window_not_by_the_face() -> None:
    few, many = noisy(torus(16, 16), 0.003), noisy(torus(40, 40), 0.001)
    curvify.surface(few)
    small, large = calls_of(lambda: curvify.surface(few)), calls_of(lambda: curvify.surface(many))
    assert large - small < (1600 - 256) / 8


def test_sides_that_surely_point_inward_are_not_sampled(monkeypatch: pytest.MonkeyPatch) -> None:
    sampled: list[int] = []
    look = folds._across_edges
    monkeypatch.setattr(folds, "_across_edges", lambda *edges: sampled.append(0) or look(*edges))
    curvify.surface(torus(24, 16))
    assert not sampled
    curvify.surface(noisy(torus(24, 16), 0.2))
    assert sampled


@pytest.mark.parametrize("triangles", [False, True])
def test_refining_takes_calls_by_the_chunk_not_by_the_face(triangles: bool) -> None:
    few, many = (curvify.surface(flat_grid(n, n, triangles)) for n in (20, 60))
    few.refine(3, threads=1)
    small, large = (calls_of(lambda s=s: s.refine(3, threads=1)) for s in (few, many))  # type: ignore[misc]
    more_faces = 3200 * (2 if triangles else 1)
    assert large - small < more_faces / 8
