"""Darts, creases, corners, boundaries and junctions of the blending scheme."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import curvify
from curvify.mesh import Marks, PolygonMesh
from curvify.quality import EdgeAngles, edge_angles
from surfaces import cube, cylinder, flat_grid, icosahedron

Array = npt.NDArray[np.float64]
MODELS = ("sided", "paper", "paper-fixed")


def marked(mesh: PolygonMesh, edges: Any = (), corners: Any = (), straight: Any = ()) -> PolygonMesh:
    """The mesh with sharp edges and corners, and straight edges."""
    edges, straight = (np.array(pairs, dtype=np.int64).reshape(-1, 2) for pairs in (edges, straight))
    corners = np.array(corners, dtype=np.int64)
    marks = Marks(
        crease_edges=edges,
        crease_sharpness=np.ones((len(edges), 2)),
        corner_vertices=corners,
        corner_sharpness=np.ones(len(corners)),
        straight_edges=straight,
    )
    return mesh.with_(marks=marks)


def all_edges(mesh: PolygonMesh) -> list[list[int]]:
    """Every edge of a mesh once."""
    pairs = {tuple(sorted(pair)) for face in mesh.faces() for pair in zip(face, face[1:] + face[:1], strict=True)}
    return [list(pair) for pair in sorted(pairs)]


def bumpy_grid(size: int = 4, triangles: bool = False) -> PolygonMesh:
    """A sheet that bends, of ``size`` x ``size`` squares: vertex (i, j) is j (size + 1) + i."""
    mesh = flat_grid(size, size, triangles)
    x, y = mesh.positions[:, 0], mesh.positions[:, 1]
    return mesh.with_(positions=np.stack([x, y, 0.3 * np.sin(3 * x) * np.cos(2 * y) - 0.3 * np.abs(y - 0.5)], axis=1))


def edges_of(surface: curvify.Surface) -> tuple[EdgeAngles, npt.NDArray[np.integer[Any]]]:
    """Continuity across the interior edges, and the vertices of each."""
    found = edge_angles(surface.patches)
    return found, np.sort(surface.patches.topology.edges[found.edges], axis=1)


def between(ends: npt.NDArray[np.integer[Any]], pairs: list[list[int]]) -> npt.NDArray[np.bool_]:
    """Which edges are among some vertex pairs."""
    wanted = {tuple(sorted(pair)) for pair in pairs}
    return np.array([tuple(pair) in wanted for pair in ends.tolist()])


@pytest.mark.parametrize("model", MODELS)
def test_a_cube_with_all_edges_sharp_is_that_cube(model: str) -> None:
    mesh = cube()
    dense = curvify.refine(marked(mesh, all_edges(mesh)), "blend", 4, sharp_model=model)
    half = np.abs(mesh.positions).max()
    np.testing.assert_allclose(np.abs(dense.positions).max(axis=1), half, rtol=0, atol=4e-16)


def test_a_cube_with_all_edges_sharp_has_flat_normals() -> None:
    mesh = cube()
    dense = curvify.refine(marked(mesh, all_edges(mesh)), "blend", 3)
    np.testing.assert_allclose(np.abs(dense.normals).max(axis=1), 1, atol=1e-15)
    np.testing.assert_array_equal(np.bincount(dense.repeats)[:8], 2)  # three normals at every corner


@pytest.mark.parametrize("triangles", [False, True])
def test_a_crease_is_sharp_and_every_other_edge_smooth(triangles: bool) -> None:
    crease = [[10 + i, 11 + i] for i in range(4)]  # right across the sheet
    surface = curvify.surface(marked(bumpy_grid(4, triangles), crease), "blend")
    found, ends = edges_of(surface)
    sharp = between(ends, crease)
    assert sharp.sum() == 4
    assert (found.smooth == ~sharp).all()
    assert found.angles[sharp].max(axis=1).min() > 5
    assert found.angles[~sharp].max() < 1e-9
    assert found.gaps.max() < 1e-14


def test_a_crease_that_ends_fades_into_a_smooth_vertex() -> None:
    crease = [[10, 11], [11, 12]]
    surface = curvify.surface(marked(bumpy_grid(), crease), "blend")
    found = edge_angles(surface.patches, places=(0.001, 0.5, 0.999))
    ends = np.sort(surface.patches.topology.edges[found.edges], axis=1)
    fading = np.sort(found.angles[between(ends, [[11, 12]])][0])
    assert fading[0] < 0.1 < 3 < fading[1] < fading[2]
    normals = surface.patches.normals[surface.patches.topology.vertices == 12]
    assert (normals == normals[0]).all()
    assert not surface.warnings


def test_a_crease_of_one_edge_has_no_effect_and_is_warned_of() -> None:
    plain, lone = bumpy_grid(), marked(bumpy_grid(), [[11, 12]])
    surface = curvify.surface(lone, "blend")
    assert surface.warnings == ["1 crease of a single edge, first: 11-12: darts at both ends leave nothing sharp"]
    np.testing.assert_array_equal(surface.refine(3).positions, curvify.refine(plain, "blend", 3).positions)
    assert not curvify.surface(lone, "blend", sharp_model="paper").warnings


def test_among_polygons_one_sharp_edge_is_seen_in_its_middle() -> None:
    surface = curvify.surface(marked(bumpy_grid(4, True), [[11, 12]]), "blend")
    found, ends = edges_of(surface)
    assert not surface.warnings
    assert found.angles[between(ends, [[11, 12]])].max() > 2


@pytest.mark.parametrize(("stem", "straight_on"), [([[12, 17], [17, 22]], True), ([], True)])
def test_at_a_junction_the_straight_line_goes_on(stem: list[list[int]], straight_on: bool) -> None:
    """A crease that runs into another leaves that one smooth along itself."""
    across = [[10 + i, 11 + i] for i in range(4)]
    surface = curvify.surface(marked(bumpy_grid(), across + stem), "blend")
    edges = surface.patches.edges
    topology = surface.patches.topology
    step = 1e-4
    tangents = []
    for pair in ([11, 12], [12, 13]):
        edge = np.flatnonzero(between(np.sort(topology.edges, axis=1), [pair]))
        towards = topology.edges[edge[0], 1] == 12
        near = edges.points(edge, np.array([1 - step, 1.0] if towards else [0.0, step]))[:, 0]
        away = near[:, 1] - near[:, 0]
        tangents.append(away if (towards == (pair[1] == 12)) else -away)
    one, other = (t / np.linalg.norm(t) for t in tangents)
    assert (np.linalg.norm(one - other) < 1e-3) == straight_on


def test_two_creases_that_cross_both_go_on() -> None:
    across = [[10 + i, 11 + i] for i in range(4)] + [[2 + 5 * i, 7 + 5 * i] for i in range(4)]
    surface = curvify.surface(marked(bumpy_grid(), across), "blend")
    found, ends = edges_of(surface)
    assert (found.smooth == ~between(ends, across)).all()
    assert found.angles[found.smooth].max() < 1e-9


def test_a_marked_corner_keeps_its_faces_apart() -> None:
    surface = curvify.surface(marked(bumpy_grid(), corners=[12]), "blend")
    normals = surface.patches.normals[surface.patches.topology.vertices == 12]
    assert len({tuple(normal) for normal in normals.tolist()}) == 4


def test_straight_edges_are_straight() -> None:
    crease = [[10 + i, 11 + i] for i in range(4)]
    for triangles in (False, True):
        surface = curvify.surface(marked(bumpy_grid(4, triangles), crease, straight=crease), "blend")
        topology = surface.patches.topology
        edges = np.flatnonzero(between(np.sort(topology.edges, axis=1), crease))
        t = np.linspace(0, 1, 9)
        points = np.moveaxis(surface.patches.edges.points(edges, t), 0, -1)
        start, end = surface.patches.positions[topology.edges[edges]].swapaxes(0, 1)
        along = end - start
        away = points - start[:, None]
        assert np.abs(np.cross(away, along[:, None])).max() < 1e-15


def test_a_round_rim_stays_round() -> None:
    dense = curvify.refine(cylinder(12).with_(corner_normals=None), "blend", 4)
    assert np.abs(np.linalg.norm(dense.positions[:, :2], axis=1) - 1).max() < 3e-3
    assert np.ptp(dense.positions[:, 2]) == 1


def test_boundary_corners_are_kept_or_smoothed() -> None:
    keep, smooth = (curvify.refine(flat_grid(2, 2), "blend", 3, boundary_corners=rule) for rule in ("keep", "smooth"))
    np.testing.assert_allclose(keep.positions.max(axis=0), [1, 1, 0], atol=1e-15)

    def area(positions: Array, faces: npt.NDArray[np.integer[Any]]) -> float:
        a, b, c, d = (positions[faces[:, i]] for i in range(4))
        return float(np.cross(c - a, d - b)[:, 2].sum() / 2)

    assert area(keep.positions, keep.faces) == pytest.approx(1, abs=1e-14)
    assert area(smooth.positions, smooth.faces) > 1.05


def test_three_faces_at_an_edge_share_its_curve() -> None:
    points = [[0, 0, 0], [0, 0, 1], [0, 0, 2.2], [1, 0, 0], [1, 0, 1], [1, 0.2, 2]]
    points += [[-1, 0.5, 0], [-1, 0.5, 1], [-1, 0.4, 2], [-1, -0.8, 0], [-1, -0.8, 1], [-1, -0.6, 2]]
    faces = [[i, i + 1, 3 * w + i + 1, 3 * w + i] for w in (1, 2, 3) for i in (0, 1)]
    mesh = PolygonMesh.from_faces(np.array(points) + np.outer(np.arange(12) % 3 == 1, [0.1, 0.1, 0]), faces)
    surface = curvify.surface(mesh, "blend")
    patches = surface.patches
    assert "treats them as a boundary" in surface.warnings[0]
    topology = patches.topology
    shared = np.flatnonzero(topology.nonmanifold)
    assert len(shared) == 2
    for half_edge in np.flatnonzero(topology.nonmanifold[topology.edge]):
        t = np.array([0.2, 0.5, 0.7])
        face, side = topology.faces[half_edge], half_edge % 4
        uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
        own = t if topology.forward[half_edge] else 1 - t
        place = uv[side] * (1 - own)[:, None] + uv[(side + 1) % 4] * own[:, None]
        u, v = place.T
        from curvify.sampling import domain_corners

        points = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1) @ domain_corners(4)
        position, _ = surface.evaluate(np.repeat(face, 3), points)
        np.testing.assert_allclose(patches.edges.points(topology.edge[[half_edge]], t)[:, 0].T, position, atol=1e-14)


def test_unjoined_copies_of_an_edge_have_the_same_points() -> None:
    """Two sheets side by side in one file, their seam left open: no gap opens between them."""
    sheet = bumpy_grid()
    left, right = (sheet.positions * [s, 1, 1] for s in (1, -1))
    faces = sheet.faces()
    count = len(left)
    mesh = PolygonMesh.from_faces(
        np.concatenate([left, right]), faces + [[count + v for v in face[::-1]] for face in faces]
    )
    surface = curvify.surface(mesh, "blend", weld="never")
    topology, positions = surface.patches.topology, surface.patches.positions
    seam = np.flatnonzero((positions[topology.edges][:, :, 0] == 0).all(axis=1))
    points = np.moveaxis(surface.patches.edges.points(seam, np.arange(1, 10) / 10), 0, -1)
    assert len(seam) == 8
    np.testing.assert_array_equal(points[:4], points[4:])


def test_the_paper_misses_crease_vertices_and_the_mended_model_does_not() -> None:
    rim = [[4, 5], [5, 7], [7, 6], [6, 4]]
    mesh = marked(cube(), rim)
    half = np.abs(mesh.positions).max()
    for model, off in (("paper", half / 2), ("paper-fixed", 0.0), ("sided", 0.0)):
        patches = curvify.surface(mesh, "blend", sharp_model=model).patches
        at_vertex = patches.edges.points(np.arange(len(patches.topology.edges)), np.array([0.0, 1.0]))
        ends = np.moveaxis(patches.positions[patches.topology.edges], -1, 0)
        assert np.abs(at_vertex - ends).max() == pytest.approx(off, abs=1e-15)


@pytest.mark.parametrize("model", MODELS)
def test_normals_exist_everywhere(model: str) -> None:
    mesh = icosahedron()
    dense = curvify.refine(marked(mesh, all_edges(mesh)[:9]), "blend", 3, sharp_model=model)
    np.testing.assert_allclose(np.linalg.norm(dense.normals, axis=1), 1, atol=1e-12)


def test_soft_creases_leave_the_edges_beside_them_smooth_whatever_meets_there() -> None:
    """Vertices of the crease have two faces on one side and one or three on the other."""
    mesh = bumpy_grid(4)
    faces = mesh.faces()
    faces[8:12] = [half for a, b, c, d in faces[8:12] for half in ([a, b, c], [a, c, d])]
    crease = np.array([[10 + i, 11 + i] for i in range(4)])
    marks = Marks(crease_edges=crease, crease_sharpness=np.full((4, 2), 0.4))
    found, ends = edges_of(curvify.surface(PolygonMesh.from_faces(mesh.positions, faces, marks=marks), "blend"))
    assert found.angles[found.smooth].max() < 1e-9
    assert found.angles[between(ends, crease.tolist())].max() > 1


@pytest.mark.parametrize("triangles", [False, True])
def test_sharpness_is_about_the_share_of_the_angle_and_leaves_the_crease_where_it_is(triangles: bool) -> None:
    crease = [[10 + i, 11 + i] for i in range(4)]
    mesh = marked(bumpy_grid(4, triangles), crease)
    angles, points = {}, {}
    for sharpness in (1.0, 0.5, 0.01):
        soft = Marks(crease_edges=np.array(crease), crease_sharpness=np.full((4, 2), sharpness))
        surface = curvify.surface(mesh.with_(marks=soft), "blend")
        found, ends = edges_of(surface)
        inner = between(ends, crease[1:3])
        angles[sharpness] = found.angles[inner]
        points[sharpness] = surface.patches.edges.points(found.edges[inner], np.array([0.25, 0.5]))
        assert found.gaps.max() < 1e-14
        assert found.angles[found.smooth].max() < 1e-9
    assert angles[1.0].min() > 5
    np.testing.assert_allclose(angles[0.5] / angles[1.0], 0.5, atol=0.1)
    assert angles[0.01].max() < 0.03 * angles[1.0].max()
    np.testing.assert_array_equal(points[0.5], points[1.0])


def test_marks_of_other_schemes_are_named() -> None:
    marks = Marks(bulged_faces=np.array([0, 1]), bulges=np.array([0.1, 0.2]))
    surface = curvify.surface(cube().with_(marks=marks), "blend")
    assert surface.warnings == ["the scheme blend has no use for 2 marks bulge"]
