"""T-junctions slide into a Y, on the dense mesh and without any other change."""

from __future__ import annotations

import numpy as np

import dense_meshes
from curvify.mesh import Ints
from curvify.simplify.polygons import Polygons
from curvify.simplify.slide import slide_vertices
from curvify.simplify.triangles import Triangles, prepare_triangles


def chain(start: int, end: int) -> list[int]:
    """Vertices of a grid of 11 columns along a row or a column, the last left out."""
    step = 11 if abs(end - start) % 11 == 0 else 1
    return list(range(start, end, step if end > start else -step))


def with_a_t(middle: int) -> tuple[Triangles, Polygons]:
    """A sheet of 11 x 11 vertices in three polygons: rows 0 to 5 below, the rest cut along a column from ``middle``."""
    sheet = prepare_triangles(dense_meshes.sheet(11, height=lambda x, y: 0.01 * x * y))[0]
    loops = [[0, 55, middle, 65, 10], [55, 110, middle + 55, middle], [middle, middle + 55, 120, 65]]
    paths = [chain(a, b) for loop in loops for a, b in zip(loop, [*loop[1:], loop[0]], strict=True)]
    sizes = np.array([len(path) for path in paths])
    steps: Ints = np.concatenate([np.array(path) for path in paths])
    vertices = np.array([v for loop in loops for v in loop])
    regions = np.repeat(np.arange(3), [5, 4, 4])
    offsets = np.array([0, 5, 9, 13])
    sharp = np.zeros(len(steps), dtype=bool)
    return sheet, Polygons(offsets, vertices, regions, np.cumsum(sizes) - sizes, sizes, steps, sharp)


def test_the_middle_of_a_t_moves_along_its_stem():
    sheet, polygons = with_a_t(60)
    rim = polygons.topology(sheet.positions).twin < 0
    slid = slide_vertices(sheet.positions, polygons, rim)
    changed = polygons.vertices != slid.vertices
    assert set(polygons.vertices[changed]) == {60}
    (place,) = set(slid.vertices[changed].tolist())
    assert place in (71, 82)  # on the column above
    assert np.array_equal(slid.offsets, polygons.offsets)
    for half_edge in range(len(slid.vertices)):
        assert slid.steps[slid.starts[half_edge]] == slid.vertices[half_edge]


def test_vertices_on_lines_stay():
    sheet, polygons = with_a_t(60)
    every = np.ones(len(polygons.vertices), dtype=bool)
    assert slide_vertices(sheet.positions, polygons, every) is polygons
