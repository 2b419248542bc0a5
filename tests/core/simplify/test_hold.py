"""Steps held back: polygons that a fit has broken come back, the others keep what they have gained."""

from __future__ import annotations

import numpy as np

from curvify.convex import split_polygons
from curvify.mesh import PolygonMesh
from curvify.pieces import split_mesh
from curvify.simplify.checks import differences
from curvify.simplify.crossings import crossing_polygons
from curvify.simplify.hold import held_back
from curvify.simplify.polygons import shapes_of


def quads(heights: tuple[float, ...] = (0.0,), steps: int = 5) -> PolygonMesh:
    """Square sheets of square faces, one above the other."""
    x, y = np.meshgrid(np.arange(steps + 1.0), np.arange(steps + 1.0), indexing="ij")
    points = [np.stack([x, y, np.full_like(x, z)], axis=-1).reshape(-1, 3) for z in heights]
    i, j = np.mgrid[:steps, :steps]
    first = (i * (steps + 1) + j).ravel()
    square = np.stack([first, first + steps + 1, first + steps + 2, first + 1], axis=1)
    faces = np.concatenate([square + k * (steps + 1) ** 2 for k in range(len(heights))])
    return PolygonMesh(np.concatenate(points), 4 * np.arange(len(faces) + 1), faces.reshape(-1))


def moved(mesh: PolygonMesh, *moves: tuple[int, tuple[float, float, float]]) -> PolygonMesh:
    positions = mesh.positions.copy()
    for vertex, step in moves:
        positions[vertex] += step
    return mesh.with_(positions=positions)


def concave(mesh: PolygonMesh) -> int:
    return int((~shapes_of(mesh.positions, mesh.face_vertices, mesh.face_sizes).acceptable).sum())


def test_what_breaks_nothing_stays():
    before = quads()
    after = moved(before, (14, (0.2, -0.1, 0.3)), (21, (0.1, 0.1, 0.0)))
    assert np.array_equal(held_back(before, after, "best").positions, after.positions)
    assert np.array_equal(held_back(before, before, "best").positions, before.positions)


def test_a_concave_polygon_that_a_diagonal_mends_stays_where_cuts_are_allowed():
    before = quads()
    after = moved(before, (14, (0.7, 0.7, 0.0)), (27, (-0.3, 0.2, 0.1)))
    assert concave(after) == 1
    assert np.array_equal(held_back(before, after, "best").positions, after.positions)
    held = held_back(before, after, "best", cut=False)
    assert concave(held) == 0
    assert (held.positions[27] == after.positions[27]).all()
    way = held.positions[14] - before.positions[14]
    assert 0 < np.linalg.norm(way) < np.linalg.norm(after.positions[14] - before.positions[14])


def test_no_polygon_is_left_that_only_a_second_edge_could_cut():
    # A quad becomes concave at its corner 1; the diagonal from there, 1-3, is an edge beneath already.
    points = np.array([[0, 0, 0], [2, -1, 0], [4, 0, 0], [2, 1, 0], [2, 0, -2.0]])
    faces = [(0, 1, 2, 3), (1, 0, 4), (0, 3, 4), (3, 1, 4), (1, 3, 2)]
    before = PolygonMesh(points, np.cumsum([0, *map(len, faces)]), np.concatenate(faces))
    after = moved(before, (1, (0.0, 1.5, 0.0)))
    split = split_polygons(after.positions, after.face_offsets, after.face_vertices)
    assert split.counts["doubled"] == 1
    held = held_back(before, after, "best")
    assert concave(split_mesh(held)[0]) == 0
    assert not differences(before, split_mesh(held)[0])


def test_surfaces_that_come_through_each_other_go_back_until_they_do_not():
    before = quads((0.0, 0.4))
    after = moved(before, (14, (0.0, 0.0, 0.3)), (36 + 14, (0.0, 0.0, -0.3)), (0, (0.0, 0.0, 0.2)))
    assert len(crossing_polygons(after))
    held = held_back(before, after, "best")
    assert not len(crossing_polygons(held))
    assert 0 < held.positions[14, 2] < 0.3
    assert held.positions[0, 2] == after.positions[0, 2]


def test_what_was_broken_before_is_left_to_the_fit():
    before = quads((0.0, 0.4))
    before = moved(before, (14, (0.0, 0.0, 0.5)))
    assert len(crossing_polygons(before))
    after = moved(before, (14, (0.0, 0.0, 0.1)))
    assert np.array_equal(held_back(before, after, "best").positions, after.positions)
