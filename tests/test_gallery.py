"""The gallery's page is that of its contents, and every picture is there."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "gallery"


@pytest.fixture
def contents(monkeypatch: pytest.MonkeyPatch):
    """The gallery's list of figures."""
    monkeypatch.syspath_prepend(str(FOLDER))
    import contents

    yield contents
    for name in ("contents", "figures", "meshes"):
        sys.modules.pop(name)


def test_the_page_and_the_pictures_are_those_of_the_figures(contents):
    assert (FOLDER.parent / "gallery.md").read_text() == contents.page()
    names = [figure.name for paper in contents.PAPERS for figure in paper.figures]
    assert sorted(names) == sorted(path.stem for path in FOLDER.glob("*.png"))


def test_the_pictures_are_small(contents):
    assert sum(path.stat().st_size for path in FOLDER.glob("*.png")) < 2_000_000


def test_loop_subdivision_keeps_to_its_limit(contents):
    import numpy as np

    import meshes

    coarse = meshes.triangulated(meshes.sample("mushroom"))
    once, twice = meshes.at_limit(coarse), meshes.at_limit(meshes.subdivided(coarse))
    assert np.abs(twice.positions[: coarse.vertex_count] - once.positions).max() < 1e-12


def test_outlines_of_regions_are_split_along_the_diagonals(contents):
    import meshes
    from curvify import refine
    from curvify.convex import split_polygons
    from curvify.formats.dense import to_polygon_mesh
    from curvify.simplify import Options, simplify

    dense = meshes.triangulated(to_polygon_mesh(refine(meshes.sample("mushroom"), level=3)))
    options = Options(faces=30)
    whole, concave, pieces, diagonals = meshes.outlines(simplify(dense, options), options)
    assert len(concave) > 0
    assert 2 * (pieces.face_count - whole.face_count) == len(diagonals)  # each is a side of two pieces
    assert not split_polygons(pieces.positions, pieces.face_offsets, pieces.face_vertices).reasons.any()
