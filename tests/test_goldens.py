"""Dense meshes of the samples against stored ones: topology exactly, values within one unit in the last place.

Write them anew with ``pytest tests/test_goldens.py --update-goldens`` after a change that is meant to move points.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import curvify
from curvify.refinement import refinable

TESTS = Path(__file__).resolve().parent
SAMPLES = TESTS.parent / "sample_meshes"
LEVEL = 2
# sample, options, the name of the golden
CASES = [
    ("torus", {}, "torus"),
    ("dodecahedron", {}, "dodecahedron"),
    ("dodecahedron", {"cross_tangent": "smooth"}, "dodecahedron-smooth"),
    ("mixed", {}, "mixed"),
    ("mixed", {"cross_tangent": "quadratic"}, "mixed-quadratic"),
    ("l_part", {}, "l_part"),
    ("vase", {}, "vase"),
    ("cylinder", {}, "cylinder"),
    ("dodecahedron", {"scheme": "png1", "normals": "smooth"}, "dodecahedron-png1-smooth"),
    ("l_part", {"scheme": "png1", "kappa": -0.1, "sharp_angle": 60.0}, "l_part-png1"),
    ("dodecahedron", {"scheme": "pn"}, "dodecahedron-pn"),
    ("vase", {"scheme": "phong"}, "vase-phong"),
    ("l_part", {"scheme": "overveld"}, "l_part-overveld"),
    ("vase", {"scheme": "overveld", "rim": True, "midpoint_normal": "geometry"}, "vase-overveld"),
]


def ulps(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Units in the last place between float32 arrays; values near 0 count in units of the array's largest / 2^24."""
    floor = np.abs(b).max() * np.float32(2.0**-24)
    unit = np.maximum(np.spacing(np.maximum(np.abs(a), np.abs(b))), floor)
    return np.abs(a.astype(np.float64) - b) / unit


@pytest.mark.parametrize(("sample", "options", "name"), CASES, ids=[case[2] for case in CASES])
def test_a_sample_gives_the_stored_dense_mesh(
    sample: str, options: dict[str, Any], name: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    surface = refinable(curvify.read(SAMPLES / f"{sample}.obj"), **options)
    path = TESTS / "golden" / f"{name}.ply"
    if request.config.getoption("--update-goldens"):
        surface.write(path, LEVEL)
        return
    assert path.exists(), f"{path.name} is missing: run pytest tests/test_goldens.py --update-goldens"
    surface.write(tmp_path / "now.ply", LEVEL)
    golden, now = curvify.read(path), curvify.read(tmp_path / "now.ply")
    assert golden.faces() == now.faces(), f"{name}: the faces are not those of the golden"
    check_close(name, "position", golden.positions, now.positions)
    assert golden.corner_normals is not None
    assert now.corner_normals is not None
    order = np.unique(now.face_vertices, return_index=True)[1]
    check_close(name, "normal", golden.corner_normals[order], now.corner_normals[order])


def check_close(name: str, what: str, stored: np.ndarray, found: np.ndarray) -> None:
    """Fail with the worst vertex if any value is off by more than one unit in the last place."""
    assert stored.shape == found.shape, f"{name}: {len(found)} vertices, the golden has {len(stored)}"
    off = ulps(found.astype(np.float32), stored.astype(np.float32)).max(axis=1)
    worst = int(off.argmax())
    assert off[worst] <= 1, (
        f"{name}: the {what} of {int((off > 1).sum())} vertices changed, most at vertex {worst}: "
        f"{stored[worst]} became {found[worst]} ({off[worst]:.3g} units in the last place)"
    )


def test_the_goldens_are_small_and_all_in_use() -> None:
    stored = sorted((TESTS / "golden").glob("*.ply"))
    assert {path.stem for path in stored} == {name for _, _, name in CASES}
    assert sum(path.stat().st_size for path in stored) < 400_000
