"""A mesh of exact numbers gives the polygons it gave before: vertices, faces, normals and marks.

Write it anew with ``pytest tests/core/simplify/test_golden.py --update-goldens``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import curvify
import dense_meshes
from curvify.simplify import Options, simplify

GOLDEN = Path(__file__).parents[2] / "golden" / "plate-simplified.obj"


def test_a_plate_with_holes_gives_the_stored_polygons(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    mesh = simplify(dense_meshes.plate(2, 4), Options(faces=40)).mesh
    path = GOLDEN if request.config.getoption("--update-goldens") else tmp_path / "now.obj"
    curvify.write(mesh, path)
    golden, now = curvify.read(GOLDEN), curvify.read(path)
    assert golden.faces() == now.faces()
    assert np.array_equal(golden.positions, now.positions)
    assert golden.corner_normals == pytest.approx(now.corner_normals, abs=1e-6)
    assert np.array_equal(golden.marks.crease_edges, now.marks.crease_edges)
    assert np.array_equal(golden.marks.flat_faces, now.marks.flat_faces)
