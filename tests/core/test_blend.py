"""The blending scheme against values made elsewhere, and against what it must be: smooth, interpolating, exact."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import curvify
from curvify import evaluate
from curvify.errors import OptionError
from curvify.mesh import Marks, PolygonMesh
from curvify.quality import edge_angles
from curvify.sampling import domain_corners, kite_coordinates
from curvify.schemes.base import Patches
from curvify.schemes.blend_basis import face_jets, turning, weight
from curvify.schemes.blend_charts import CONFORMAL, POLAR
from curvify.schemes.blend_fit import smooth_fit
from surfaces import cube, flat_grid, icosahedron, mixed_ball, torus, truncated_icosahedron, vase

Array = npt.NDArray[np.float64]
REFERENCE = json.loads((Path(__file__).parents[1] / "data" / "blending.json").read_text())


def creased(mesh: PolygonMesh, edges: Any) -> PolygonMesh:
    """The mesh with some edges sharp."""
    edges = np.array(edges, dtype=np.int64).reshape(-1, 2)
    return mesh.with_(marks=Marks(crease_edges=edges, crease_sharpness=np.ones((len(edges), 2))))


def square_points(uv: Array) -> Array:
    """Domain points of a quad from its parameters ``(n,2)``."""
    u, v = uv.T
    return np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1) @ domain_corners(4)


# --- the reference --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", REFERENCE["surface_cases"], ids=lambda case: case["name"])
def test_points_and_normals_of_the_reference(case: dict[str, Any]) -> None:
    mesh = creased(PolygonMesh.from_faces(case["vertices"], case["faces"]), case["sharp_edges"])
    options, samples = case["options"], case["samples"]
    surface = curvify.surface(
        mesh,
        "blend",
        chart=options["chart"],
        sharp_model=options["sharp"].replace("_", "-"),
        boundary_corners="keep" if case["boundary_m1_is_corner"] else "smooth",
    )
    faces = np.array([sample["face"] for sample in samples])
    uv = np.array([[sample["u"], sample["v"]] for sample in samples])
    position, by_u, by_v = evaluate.evaluate_at(surface.patches, faces, square_points(uv))
    np.testing.assert_allclose(position, [sample["point"] for sample in samples], rtol=0, atol=1e-12)
    normal = np.cross(by_u, by_v)
    length = np.linalg.norm(normal, axis=1)
    # at points and curves of the paper's models the reference has a normal from nearby, ours has none of its own
    told = np.array(["normal" in sample for sample in samples]) & ((length > 1e-9) | (options["sharp"] == "sided"))
    assert told.sum() > len(samples) / 2
    expected = [sample.get("normal", [0, 0, 0]) for sample in samples]
    np.testing.assert_allclose((normal[told].T / length[told]).T, np.array(expected)[told], rtol=0, atol=1e-10)


@pytest.mark.parametrize("faces", [3, 4, 5])
def test_the_fits_of_the_reference(faces: int) -> None:
    expected = REFERENCE["pinv_conformal_hybrid"][str(faces)]
    np.testing.assert_allclose(smooth_fit(CONFORMAL, faces), expected, atol=1e-12)


# --- basis ----------------------------------------------------------------------------------------------------

CHARTS = ((4 / 3, 4 / 3), (1.0, 1.0), (0.8, 0.8), (1.0, 0.5))


@pytest.mark.parametrize("order", [3, 5])
def test_the_weights_of_the_four_points_sum_to_one_and_their_slopes_to_nothing(order: int) -> None:
    uv = np.random.default_rng(1).random((100, 2))
    points = face_jets(order, CHARTS, uv)[:, :4].sum(axis=1)
    np.testing.assert_allclose(points[0], 1, atol=1e-15)
    np.testing.assert_allclose(points[1:], 0, atol=1e-14)


@pytest.mark.parametrize("order", [3, 5])
def test_derivatives_of_the_basis_are_those_of_its_values(order: int) -> None:
    uv, step = 0.05 + 0.9 * np.random.default_rng(2).random((50, 2)), 1e-6
    slopes = face_jets(order, CHARTS, uv)[1:]
    for axis in range(2):
        move = step * np.eye(2)[axis]
        difference = face_jets(order, CHARTS, uv + move)[0] - face_jets(order, CHARTS, uv - move)[0]
        np.testing.assert_allclose(difference / (2 * step), slopes[axis], atol=1e-8)


@pytest.mark.parametrize("order", [3, 5])
def test_the_blending_function_falls_from_one_to_nothing_and_is_flat_at_both_ends(order: int) -> None:
    values, slopes = weight(order, np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(values, [1, 0.5, 0], atol=1e-15)
    np.testing.assert_allclose(slopes[[0, 2]], 0, atol=1e-15)


def test_turned_coefficients_are_the_same_polynomial() -> None:
    generator = np.random.default_rng(3)
    point = generator.standard_normal(2)
    for angle, slots in ((0.7, [0, 1, 2, 3, 4, 6]), (np.pi / 2, list(range(9)))):
        coefficients = np.zeros(9)
        coefficients[slots] = generator.standard_normal(len(slots))
        c, s = np.cos(angle), np.sin(angle)
        there = np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])

        def value(coefficients: Array, xy: Array) -> float:
            return float(sum(coefficients[3 * a + b] * xy[0] ** a * xy[1] ** b for a in range(3) for b in range(3)))

        turned = turning(np.array([angle]))[0] @ coefficients
        assert value(turned, point) == pytest.approx(value(coefficients, there), abs=1e-13)


def test_a_fit_of_two_faces_stays_finite() -> None:
    assert np.abs(smooth_fit(POLAR, 2)).max() < 2


@pytest.mark.parametrize("sides", [3, 4, 5, 9])
def test_kite_coordinates_lead_back_to_the_point(sides: int) -> None:
    generator = np.random.default_rng(4)
    weights = generator.dirichlet(np.ones(sides), 50)
    corners = domain_corners(sides)
    points = np.concatenate([weights @ corners, corners, [[0, 0]]])
    kite, (a, b), slopes = (lambda k, ab, s: (k, ab.T, s))(*kite_coordinates(sides, points))
    here, ahead, behind = corners[kite], corners[(kite + 1) % sides], corners[kite - 1]
    one, other = (here + ahead) / 2, (here + behind) / 2

    def place(a: Array, b: Array) -> Array:
        a, b = a[:, None], b[:, None]
        return (1 - a) * (1 - b) * here + a * (1 - b) * one + (1 - a) * b * other

    np.testing.assert_allclose(place(a, b), points, atol=1e-14)
    assert ((a >= 0) & (a <= 1) & (b >= 0) & (b <= 1)).all()
    step = 1e-6
    by_a, by_b = ((place(a + p, b + q) - place(a - p, b - q)) / (2 * step) for p, q in ((step, 0), (0, step)))
    jacobian = np.stack([by_a, by_b], axis=2)
    np.testing.assert_allclose(np.matmul(slopes, jacobian), np.broadcast_to(np.eye(2), jacobian.shape), atol=1e-8)


# --- surfaces -------------------------------------------------------------------------------------------------


def double_pyramid(sides: int, quads: bool) -> PolygonMesh:
    """Two cones of triangles over a polygon, or quads around two vertices of many faces."""
    angle = 2 * np.pi * np.arange(2 * sides if quads else sides) / (2 * sides if quads else sides)
    rim = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.cos(3 * angle)], axis=1)
    top, bottom = len(rim), len(rim) + 1
    points = np.concatenate([rim, [[0.05, 0, 0.8], [0, -0.1, -0.7]]])
    n = len(rim)
    if not quads:
        faces = [[i, (i + 1) % n, top] for i in range(n)] + [[(i + 1) % n, i, bottom] for i in range(n)]
    else:
        faces = [[2 * i, 2 * i + 1, (2 * i + 2) % n, top] for i in range(sides)]
        faces += [[(2 * i + 2) % n, 2 * i + 1, 2 * i, bottom] for i in range(sides)]
    return PolygonMesh.from_faces(points, faces)


@pytest.mark.parametrize("quads", [False, True])
@pytest.mark.parametrize("valence", [3, 4, 5, 6, 7, 8, 12])
@pytest.mark.parametrize(("chart", "order"), [("auto", 3), ("conformal", 3), ("polar", 5)])
def test_smooth_edges_are_smooth_at_every_valence(valence: int, quads: bool, chart: str, order: int) -> None:
    patches = curvify.surface(double_pyramid(valence, quads), "blend", chart=chart, blend_order=order).patches
    found = edge_angles(patches, places=(0.02, 0.1, 0.25, 0.5, 0.6, 0.95))
    assert found.smooth.all()
    assert found.angles.max() < 1e-9
    assert found.gaps.max() < 1e-14


SMOOTH = {
    "cube": cube(),
    "icosahedron": icosahedron(),
    "soccer ball": truncated_icosahedron(),
    "mixed": mixed_ball(),
    "torus": torus(9, 6),
    "vase": vase(),
}


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("level", [1, 2, 5])
def test_dense_meshes_are_watertight_and_keep_the_vertices(name: str, level: int) -> None:
    mesh = SMOOTH[name]
    dense = curvify.refine(mesh, "blend", level)
    assert dense.face_count == mesh.corner_count * level**2
    np.testing.assert_array_equal(dense.positions[: mesh.vertex_count], mesh.positions)
    uses = edge_uses(dense.faces)
    assert uses.max() == 2
    assert ((uses == 1).sum() == 0) == (name != "vase")
    np.testing.assert_allclose(np.linalg.norm(dense.normals, axis=1), 1, atol=1e-12)


def edge_uses(faces: npt.NDArray[np.integer[Any]]) -> npt.NDArray[np.int64]:
    """How many faces each edge has."""
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    return np.unique(ends, axis=0, return_counts=True)[1]


@pytest.mark.parametrize("name", SMOOTH)
def test_every_point_of_the_dense_mesh_is_the_surface_there(name: str) -> None:
    """Tables, edges and vertices against pointwise evaluation, in every face beside them."""
    surface = curvify.surface(SMOOTH[name], "blend")
    dense = surface.refine(4)
    positions, normals = at_cell_corners(surface.patches, 4)
    np.testing.assert_allclose(dense.positions[dense.faces], positions, atol=1e-13)
    np.testing.assert_allclose(dense.normals[dense.face_wedges], normals, atol=1e-8)  # corners are off by rounding


def at_cell_corners(patches: Patches, level: int) -> tuple[Array, Array]:
    """Positions and normals ``(Q,4,3)`` at the corners of all cells, each from its own patch."""
    from curvify.kites import CellGrid, domain_points

    kites, places = CellGrid(level).corners(np.arange(len(patches.topology.vertices) * level**2))
    kites = np.repeat(kites, 4)
    points = domain_points(patches.topology, kites, places.reshape(-1, 2) / level)
    position, by_xi, by_eta = evaluate.evaluate_at(patches, patches.topology.faces[kites], points)
    normal = np.cross(by_xi, by_eta)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return position.reshape(-1, 4, 3), normal.reshape(-1, 4, 3)


def test_a_plane_stays_a_plane_and_a_grid_itself() -> None:
    dense = curvify.refine(flat_grid(4, 3), "blend", 3)
    assert np.abs(dense.positions[:, 2]).max() == 0
    spread = np.sort(np.unique(np.round(dense.positions[:, 0], 12)))
    np.testing.assert_allclose(np.diff(spread), 1 / 24, atol=1e-12)


def test_where_the_surface_stands_and_how_large_it_is_do_not_matter() -> None:
    mesh = mixed_ball()
    turn = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = mesh.with_(positions=1000 * mesh.positions @ turn + [5, 6, 7])
    here, there = curvify.refine(mesh, "blend", 3), curvify.refine(moved, "blend", 3)
    np.testing.assert_allclose(there.positions, 1000 * here.positions @ turn + [5, 6, 7], atol=1e-9)
    np.testing.assert_allclose(there.normals, here.normals @ turn, atol=1e-9)


def test_which_corner_of_a_face_comes_first_does_not_matter() -> None:
    mesh = torus(7, 5)
    faces = mesh.faces()
    turned = PolygonMesh.from_faces(mesh.positions, [face[i % 4 :] + face[: i % 4] for i, face in enumerate(faces)])
    here, there = (curvify.refine(m, "blend", 3) for m in (mesh.with_(corner_normals=None), turned))
    edges = slice(0, mesh.vertex_count + 5 * 70)
    np.testing.assert_allclose(there.positions[edges], here.positions[edges], atol=1e-13)


def test_finer_tori_are_closer_by_the_third_power() -> None:
    """Points over the middles of faces: their distance to the torus falls faster than the square of the edges."""
    errors = []
    for size in (8, 16, 32):
        dense = curvify.refine(torus(size, size), "blend", 4)
        ring = dense.positions * [1, 1, 0]
        ring /= np.linalg.norm(ring, axis=1, keepdims=True)
        errors.append(np.abs(np.linalg.norm(dense.positions - ring, axis=1) - 0.4).max())
    assert errors[0] / errors[1] > 6
    assert errors[1] / errors[2] > 6


def test_the_same_bytes_for_any_number_of_threads() -> None:
    surface = curvify.surface(torus(40, 40), "blend")
    one, three = (surface.refine(8, threads=threads) for threads in (1, 3))
    np.testing.assert_array_equal(one.positions, three.positions)
    np.testing.assert_array_equal(one.normals, three.normals)


def test_given_normals_are_not_interpolated_but_what_they_crease_is() -> None:
    mesh = torus(9, 6)
    assert mesh.corner_normals is not None
    tilted = mesh.with_(corner_normals=mesh.corner_normals + np.array([0.3, 0, 0.1]))
    plain = mesh.with_(corner_normals=None)
    here, there = (curvify.surface(m, "blend") for m in (plain, tilted))
    np.testing.assert_array_equal(there.refine(2).normals, here.refine(2).normals)
    normals = mesh.corner_normals.copy()
    normals[np.isin(mesh.corner_faces, np.arange(9))] *= [1, 1, 0.2]  # faces beside the equator, where z is 0
    assert (~edge_angles(curvify.surface(mesh.with_(corner_normals=normals), "blend").patches).smooth).sum() == 9


@pytest.mark.parametrize(
    "options", [{"chart": "round"}, {"blend_order": 4}, {"sharp_model": "hard"}, {"boundary_corners": "no"}]
)
def test_options_that_do_not_exist_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(OptionError, match=next(iter(options))):
        curvify.surface(cube(), "blend", **options)
