"""The scheme overveld: edges and polygons of the reference, recursion, convergence, stops, rims, planar faces."""

from __future__ import annotations

import json
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import curvify
from curvify.errors import LimitError, MeshError, OptionError
from curvify.mesh import DenseMesh, PolygonMesh
from curvify.refinement import Refinable, refinable
from curvify.schemes.overveld_cuts import template
from curvify.schemes.overveld_edges import EdgeCurves, middle_normals, solve_creases, solve_edges
from curvify.sinks import ArraySink, DenseLayout
from surfaces import (
    Array,
    check_sound,
    cube,
    dihedral_angles,
    dodecahedron,
    geodesic,
    icosahedron,
    l_prism,
    match,
    mixed_ball,
    noisy,
    octahedron,
    on_sphere,
    open_edges,
    prism,
    rotation,
    soup,
    torus,
    unit,
    vase,
    with_vertex_normals,
)

REFERENCE = json.loads((Path(__file__).resolve().parents[1] / "data" / "triangles.json").read_text())["overveld"]
RULES = ("curvature", "stretched")
each_rule = pytest.mark.parametrize("rule", RULES)


def refined(mesh: PolygonMesh, **options: Any) -> DenseMesh:
    return curvify.refine(mesh, "overveld", **options)


def edge(data: dict[str, Any], *names: str) -> list[Array]:
    return [np.array(data[name])[None] for name in names]


# --- edges ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("data", REFERENCE["edges"], ids=lambda d: f"{d['method']}-{d['normals']}")
def test_edges_agree_with_the_reference(data: dict[str, Any]) -> None:
    start, end, n0, n3 = edge(data, "p0", "p3", "n0", "n3")
    curves = solve_edges(start, end, n0, n3, data["method"])
    found = [*curves.controls(), curves.middle(), middle_normals(curves, n0, n3, data["normals"])]
    for values, expected in zip(found, edge(data, "p1", "p2", "mid", "mid_normal"), strict=True):
        assert np.abs(values - expected).max() < 1e-12


def random_edges(count: int) -> tuple[Array, Array, Array, Array]:
    generator = np.random.default_rng(4)
    points = generator.standard_normal((2, count, 3))
    normals = unit(generator.standard_normal((4, count, 3)))
    return points[0], points[1], np.stack([normals[0], normals[1]], axis=1), np.stack([normals[2], normals[3]], axis=1)


@each_rule
def test_a_crease_whose_sides_agree_is_a_plain_edge(rule: str) -> None:
    start, end, pairs, _ = random_edges(200)
    plain = solve_edges(start, end, pairs[:, 0], pairs[:, 1], rule)
    crease = solve_creases(start, end, pairs, pairs, rule)
    assert np.abs(plain.middle() - crease.middle()).max() < 1e-12


@each_rule
def test_creases_are_perpendicular_to_the_normals_of_both_sides(rule: str) -> None:
    start, end, pairs, others = random_edges(200)
    chord = unit(end - start)
    across = np.cross(pairs, others)
    advance = np.abs(np.einsum("eki,ei->ek", unit(across), chord)).min(axis=1)
    usable = advance > 0.1
    first, second = solve_creases(start, end, pairs, others, rule).controls()
    legs = np.stack([first - start, end - second], axis=1)[usable]
    for normals in (pairs[usable], others[usable]):
        assert np.abs(np.einsum("eki,eki->ek", legs, normals)).max() < 1e-12


def test_the_curve_of_least_curvature_has_the_least() -> None:
    """No small change that keeps the end tangent planes lowers the integral of equation (7)."""
    start, end, pairs, _ = random_edges(20)
    curves = solve_edges(start, end, pairs[:, 0], pairs[:, 1], "curvature")

    def bending(p1: Array, p2: Array) -> Array:
        a, b = end - 3 * p2 + 3 * p1 - start, p2 - 2 * p1 + start
        return (a * a).sum(axis=1) / 3 + (b * b).sum(axis=1) + (a * b).sum(axis=1)

    p1, p2 = curves.controls()
    least = bending(p1, p2)
    for shift in unit(np.random.default_rng(1).standard_normal((10, 20, 3))):
        in_planes = [shift - (shift * n).sum(axis=1, keepdims=True) * n for n in (pairs[:, 0], pairs[:, 1])]
        assert (bending(p1 + 1e-3 * in_planes[0], p2) >= least).all()
        assert (bending(p1, p2 + 1e-3 * in_planes[1]) >= least).all()


def test_middle_normals_of_opposite_ends_are_still_unit() -> None:
    start, end = np.zeros((1, 3)), np.array([[1.0, 0, 0]])
    up = np.array([[0.0, 0, 1]])
    for kind in ("quad", "perp", "avg"):
        for rule in RULES:
            curves = solve_edges(start, end, up, -up, rule)
            assert np.linalg.norm(middle_normals(curves, up, -up, kind)) == pytest.approx(1)
    still = EdgeCurves(start, start, 0 * start, 0 * start, "curvature")
    assert np.linalg.norm(middle_normals(still, up, up, "perp")) == pytest.approx(1)


# --- polygons ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("data", REFERENCE["polygons"], ids=lambda d: f"{d['name']}-{d['method']}".replace(" ", "-"))
def test_polygons_agree_with_the_reference(data: dict[str, Any]) -> None:
    mesh = with_vertex_normals(PolygonMesh.from_faces(data["vertices"], data["faces"]), np.array(data["normals"]))
    rules = {"edge_rule": data["method"], "midpoint_normal": data["first"]}
    dense = refined(mesh, depth=data["depth"], sharp_from="normals", **rules)
    expected = np.array(data["out_vertices"])
    order = match(expected, dense.positions, 1e-12)
    assert np.abs(dense.positions[order] - expected).max() < 1e-12
    assert np.abs(dense.normals[order] - np.array(data["out_normals"])).max() < 1e-12
    place = np.argsort(order)
    found = {tuple(sorted(face)) for face in place[dense.faces].tolist()}
    assert found == {tuple(sorted(face)) for face in data["out_triangles"]}


@pytest.mark.parametrize("mask", range(8))
@pytest.mark.parametrize("turned", [False, True])
def test_every_way_to_cut_a_triangle_covers_it_and_names_its_edges(mask: int, turned: bool) -> None:
    corners = np.array([[0, 0], [2, 0], [0, 2.0]])
    nodes = np.concatenate([corners, (corners + np.roll(corners, -1, axis=0)) / 2])
    cut = template(mask, turned)
    points = nodes[cut.nodes]
    a, b = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    assert area.min() > 0
    assert area.sum() == pytest.approx(4)
    halves = [(i // 2, 3 + i // 2) if i % 2 == 0 else (3 + i // 2, (i // 2 + 1) % 3) for i in range(6)]
    wholes = [(i, (i + 1) % 3) for i in range(3)]
    ends = dict(enumerate([*halves, *wholes, *map(tuple, cut.inner.tolist())]))
    for triangle, names in zip(cut.nodes.tolist(), cut.edges.tolist(), strict=True):
        for i, name in enumerate(names):
            assert sorted(ends[name]) == sorted((triangle[i], triangle[(i + 1) % 3]))


def test_counts_of_the_first_pass_are_those_of_the_paper() -> None:
    for mesh, faces in ((octahedron(), 4 * 8), (cube(), 8 * 6), (dodecahedron(), 4 * 5 * 12)):
        dense = refined(mesh, depth=1)
        assert dense.face_count == faces
        check_sound(dense, closed=True)


def test_the_apex_moves_with_lambda() -> None:
    mesh = on_sphere(dodecahedron())
    heights = []
    for apex in (0.0, 0.5, 1.0):
        dense = refined(mesh, depth=1, apex=apex)
        heights.append(np.linalg.norm(dense.positions, axis=1).min())
    assert heights[0] > heights[1] > heights[2]


# --- recursion --------------------------------------------------------------------------------------------------------

MESHES: dict[str, Callable[[], PolygonMesh]] = {
    "triangles": lambda: noisy(icosahedron(), 0.05),
    "mixed": lambda: noisy(mixed_ball(), 0.02),
    "open": lambda: noisy(vase(7), 0.02),
    "concave": l_prism,
    "cube": lambda: noisy(cube(), 0.05),
}


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
@pytest.mark.parametrize("kind", ["quad", "perp", "avg", "geometry"])
@pytest.mark.parametrize("name", MESHES)
def test_twice_one_pass_is_once_two_byte_for_byte(name: str, kind: str, suffix: str, tmp_path: Path) -> None:
    mesh, options = MESHES[name](), {"midpoint_normal": kind, "rim": True}
    one, two, both = (tmp_path / f"{part}{suffix}" for part in ("one", "two", "both"))
    refinable(mesh, "overveld", depth=1, **options).write(one, dtype=np.float64)
    again = refinable(curvify.read(one), "overveld", depth=1, midpoint_normal=kind)
    again.write(two, dtype=np.float64)
    refinable(mesh, "overveld", depth=2, **options).write(both, dtype=np.float64)
    assert two.read_bytes() == both.read_bytes()


def test_twice_one_pass_is_once_two_with_creases_where_the_format_keeps_vertices(tmp_path: Path) -> None:
    """PLY repeats the vertices of creases, OBJ does not."""
    mesh = noisy(cube(), 0.1)
    one, two, both = (tmp_path / f"{part}.obj" for part in ("one", "two", "both"))
    first = refinable(mesh, "overveld", depth=1, sharp_angle=60.0)
    first.write(one, dtype=np.float64)
    refinable(curvify.read(one), "overveld", depth=1).write(two, dtype=np.float64)
    second = refinable(mesh, "overveld", depth=2, sharp_angle=60.0)
    second.write(both, dtype=np.float64)
    assert len(second.refine().repeats) > 0
    assert two.read_bytes() == both.read_bytes()


@pytest.mark.parametrize("name", MESHES)
def test_creases_never_crack(name: str) -> None:
    mesh = MESHES[name]()
    dense = refined(mesh, depth=3, sharp_angle=25.0)
    check_sound(dense, closed=not open_edges_of(mesh))
    check_sound(refined(mesh, max_edge=0.2, sharp_angle=25.0), closed=not open_edges_of(mesh))


def open_edges_of(mesh: PolygonMesh) -> bool:
    return bool(open_edges(curvify.refine(mesh, "gregory", 1).faces))


@pytest.mark.parametrize("name", MESHES)
def test_isolated_polygons_with_normals_get_equal_bits_on_both_sides_of_an_edge(name: str) -> None:
    mesh = MESHES[name]()
    mesh = with_vertex_normals(mesh, unit(mesh.positions - mesh.positions.mean(axis=0)))
    whole, apart = (refined(m, depth=3, weld="never", sharp_from="normals") for m in (mesh, soup(mesh)))
    assert apart.face_count == whole.face_count
    rows = [{tuple(row) for row in np.c_[d.positions, d.normals]} for d in (whole, apart)]
    assert rows[0] == rows[1]


def test_the_level_gives_at_least_its_segments() -> None:
    mesh = icosahedron()
    for level, passes in ((1, 1), (2, 2), (3, 3), (4, 3), (5, 4), (8, 4), (9, 5)):
        assert refinable(mesh, "overveld").face_count(level) == 20 * 4**passes


def test_a_refined_mesh_has_the_inputs_vertices_then_edges_then_insides() -> None:
    mesh = on_sphere(mixed_ball())
    dense = refined(mesh, depth=1)
    count = mesh.vertex_count
    assert np.array_equal(dense.positions[:count], mesh.positions)
    edges = sorted({tuple(sorted(e)) for f in mesh.faces() for e in zip(f, f[1:] + f[:1], strict=True)})
    middles = np.array([mesh.positions[list(e)].mean(axis=0) for e in edges])
    near = np.linalg.norm(dense.positions[count : count + len(edges)] - middles, axis=1)
    assert near.max() < 0.1


# --- convergence ------------------------------------------------------------------------------------------------------

DIHEDRALS = {
    ("curvature", "avg"): (23.2, 12.2, 6.5, 3.7, 2.24),
    ("curvature", "quad"): (23.2, 12.2, 6.5, 3.3, 1.72),
    ("stretched", "quad"): (27.6, 19.6, 14.6, 10.9, 8.35),
}


@pytest.mark.parametrize(("rule", "kind"), DIHEDRALS)
def test_kinks_of_the_icosahedron_fall_as_published(rule: str, kind: str) -> None:
    mesh = on_sphere(icosahedron())
    found = [
        dihedral_angles(refined(mesh, depth=depth, edge_rule=rule, midpoint_normal=kind)).max() for depth in range(1, 6)
    ]
    assert found == pytest.approx(DIHEDRALS[rule, kind], rel=0.02)


def test_normals_from_geometry_tame_rough_input() -> None:
    mesh = noisy(torus(12, 8, triangles=True), 0.03)
    quad, geometry = (
        [dihedral_angles(refined(mesh, depth=d, midpoint_normal=kind)).max() for d in (3, 4, 5)]
        for kind in ("quad", "geometry")
    )
    assert quad[2] > quad[1] > quad[0]
    assert geometry[2] < 0.75 * geometry[1] < 0.75 * 0.8 * geometry[0]


def from_torus(points: Array) -> Array:
    ring = np.hypot(points[:, 0], points[:, 1]) - 1
    return (np.hypot(ring, points[:, 2]) - 0.4) / 0.4


def from_sphere(points: Array) -> Array:
    return np.linalg.norm(points, axis=1) - 1


# largest and rms error over the radius with 16 segments, each vertex once: curvature, stretched
FIGURES: dict[str, tuple[Callable[[], PolygonMesh], Callable[[Array], Array], tuple[tuple[float, float], ...]]] = {
    "octahedron": (lambda: on_sphere(octahedron()), from_sphere, ((0.032, 0.024), (0.124, 0.089))),
    "icosahedron": (lambda: on_sphere(icosahedron()), from_sphere, ((0.0057, 0.0045), (0.054, 0.041))),
    "geodesic": (lambda: on_sphere(geodesic(2)), from_sphere, ((3.2e-5, 1.9e-5), (0.0044, 0.0030))),
    "torus": (lambda: torus(12, 8, triangles=True), from_torus, ((0.0081, 0.0029), (0.051, 0.021))),
}


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("name", FIGURES)
def test_errors_against_known_surfaces_are_the_published_figures(name: str, rule: str) -> None:
    make, error, figures = FIGURES[name]
    errors = error(refined(make(), level=8, edge_rule=rule).positions)
    most, rms = figures[RULES.index(rule)]
    assert np.abs(errors).max() == pytest.approx(most, rel=0.1)
    assert np.sqrt((errors**2).mean()) == pytest.approx(rms, rel=0.1)


# --- the stop by length -----------------------------------------------------------------------------------------------


def edge_lengths(dense: DenseMesh) -> Array:
    corners = dense.positions[dense.faces]
    return np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)


@pytest.mark.parametrize("name", ["triangles", "mixed", "concave", "cube"])
@pytest.mark.parametrize("longest", [0.7, 0.25])
def test_edges_stop_at_a_length_without_cracks(name: str, longest: float) -> None:
    dense = refined(MESHES[name](), max_edge=longest)
    check_sound(dense, closed=True)
    lengths = edge_lengths(dense)
    assert lengths.max() <= longest
    assert dense.vertex_count - lengths.size // 2 + dense.face_count == 2


def test_a_stretched_mesh_is_split_where_it_is_long() -> None:
    mesh = noisy(icosahedron(), 0.02)
    mesh = mesh.with_(positions=mesh.positions * [3, 1, 1])
    dense = refined(mesh, max_edge=0.3)
    check_sound(dense, closed=True)
    evenly = refined(mesh, depth=5)
    assert edge_lengths(evenly).max() < 0.3
    assert dense.face_count < 0.7 * evenly.face_count


def test_a_length_and_a_depth_stop_at_whichever_comes_first() -> None:
    mesh = on_sphere(icosahedron())
    assert refined(mesh, max_edge=1e-3, depth=3).face_count == 20 * 4**3
    assert refined(mesh, max_edge=10.0).face_count == 20
    assert refined(on_sphere(cube()), max_edge=10.0).face_count == 6 * 4


def test_the_limit_on_faces_holds_before_the_passes_that_would_break_it() -> None:
    with pytest.raises(LimitError, match="a longest edge of 1e-06"):
        refined(icosahedron(), max_edge=1e-6, max_faces=100_000)
    with pytest.raises(LimitError, match="depth 12 gives 335,544,320 faces"):
        refined(icosahedron(), depth=12)


# --- rims and planar faces --------------------------------------------------------------------------------------------


def rim_heights(dense: DenseMesh) -> Array:
    ends = np.array(sorted({v for e in open_edges(dense.faces) for v in e}))
    return dense.positions[ends, 2]


def test_a_rim_in_a_plane_stays_in_it_with_the_rule_for_rims() -> None:
    mesh = vase(9)
    mesh = with_vertex_normals(mesh, unit(mesh.positions * [1, 1, 0] + [0, 0, 0.3]))
    plain, ruled = (rim_heights(refined(mesh, depth=4, rim=rim, sharp_from="normals")) for rim in (False, True))
    assert np.minimum(np.abs(plain), np.abs(plain - 1.6)).max() > 0.01
    assert np.minimum(np.abs(ruled), np.abs(ruled - 1.6)).max() < 1e-14


def test_the_rule_for_rims_leaves_flat_sheets_alone() -> None:
    mesh = PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    assert np.abs(refined(mesh, depth=2, rim=True).positions[:, 2]).max() == 0


def test_a_planar_top_stays_planar_and_its_edges_in_the_plane_straight() -> None:
    mesh = prism(8)
    dense = refined(mesh, depth=3, planar=(9,))
    top = dense.source_faces == 9
    assert np.abs(dense.positions[dense.faces[top], 2] - 1).max() < 1e-14
    assert np.abs(refined(mesh, depth=3).positions[dense.faces[top], 2] - 1).max() > 0.05
    check_sound(dense, closed=True)


def test_planar_faces_must_be_there_and_parallel_where_they_meet() -> None:
    with pytest.raises(MeshError, match="numbered 0 to 9"):
        refined(prism(8), planar=(10,))
    with pytest.raises(MeshError, match="two planar faces that are not parallel"):
        refined(prism(8), planar=(0, 9))
    flat = PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    with pytest.raises(MeshError, match="face 0 has no area"):
        refined(flat, planar=(0,))


# --- the dense mesh ---------------------------------------------------------------------------------------------------


def carrying(mesh: PolygonMesh) -> PolygonMesh:
    generator = np.random.default_rng(2)
    return mesh.with_(
        corner_uvs=np.round(generator.random((mesh.corner_count, 2)), 1),
        vertex_colors=generator.integers(0, 255, (mesh.vertex_count, 3)).astype(np.uint8),
    )


class Ordered(ArraySink):
    """Takes blocks in order only."""

    anywhere = False

    def begin(self, layout: DenseLayout) -> None:
        super().begin(layout)
        self.next = [0, 0]

    def vertices(self, start: int, records: Any) -> None:
        assert start == self.next[0]
        self.next[0] += len(records)
        super().vertices(start, records)

    def faces(self, start: int, wedges: Any, source_faces: Any) -> None:
        assert start == self.next[1]
        assert self.next[0] == self.layout.wedge_count
        self.next[1] += len(wedges)
        super().faces(start, wedges, source_faces)


@pytest.mark.parametrize("options", [{"depth": 1}, {"depth": 3}, {"max_edge": 0.3}], ids=["one", "three", "length"])
@pytest.mark.parametrize("name", ["triangles", "mixed"])
def test_blocks_come_in_order_and_fill_everything(
    name: str, options: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("curvify.subdivision.WINDOW", 37)
    surface = refinable(carrying(MESHES[name]()), "overveld", **options)
    sink = Ordered()
    layout = surface.stream(sink, threads=3)
    assert sink.next == [layout.wedge_count, layout.face_count]
    dense, other = sink.dense_mesh(), surface.refine(threads=1)
    check_sound(dense, closed=True)
    assert dense.uvs is not None and dense.colors is not None
    for a, b in ((dense.positions, other.positions), (dense.normals, other.normals), (dense.faces, other.faces)):
        assert np.array_equal(a, b)


def test_what_corners_carry_is_averaged_and_seams_stay() -> None:
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    uvs = np.array([[0, 0], [1, 0], [1, 1], [0, 0], [0.5, 1], [0, 1.0]])
    dense = refined(PolygonMesh.from_faces(points, [[0, 1, 2], [0, 2, 3]], corner_uvs=uvs), depth=1)
    assert dense.uvs is not None
    assert len(dense.repeats) == 2  # vertex 2, and the middle of the seam
    assert {tuple(uv) for uv in dense.uvs} >= {(0.5, 0.0), (1.0, 0.5), (0.5, 0.5), (0.25, 0.5), (0.25, 1.0), (0.0, 0.5)}


def test_turning_a_mesh_turns_the_result_and_the_order_of_corners_does_not_matter() -> None:
    mesh, turn = noisy(mixed_ball(), 0.02), rotation()
    plain, turned = refined(mesh, depth=2), refined(mesh.with_(positions=mesh.positions @ turn.T), depth=2)
    assert np.abs(turned.positions - plain.positions @ turn.T).max() < 1e-12
    rolled = PolygonMesh.from_faces(mesh.positions, [face[1:] + face[:1] for face in mesh.faces()])
    match(plain.positions, refined(rolled, depth=2).positions, 1e-12)


def test_more_than_one_refinement_of_one_object_gives_the_same() -> None:
    surface = refinable(noisy(cube(), 0.05), "overveld")
    assert isinstance(surface, Refinable)
    fine, coarse = surface.refine(4), surface.refine(1)
    again = surface.refine(4)
    assert coarse.face_count < fine.face_count
    assert np.array_equal(fine.positions, again.positions)


def test_there_is_no_surface_to_evaluate() -> None:
    with pytest.raises(OptionError, match="makes meshes, not a surface"):
        curvify.surface(cube(), "overveld")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"depth": 0}, "from 1 to 24"),
        ({"max_edge": 0.0}, "positive length"),
        ({"edge_rule": "round"}, "curvature, stretched"),
        ({"midpoint_normal": "flat"}, "quad, perp, avg, geometry"),
        ({"apex": np.nan}, "finite"),
        ({"normals": "exact"}, "has no option normals"),
    ],
)
def test_options_that_cannot_be_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(OptionError, match=message):
        refined(cube(), **options)


# --- memory -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "times"),
    [({"depth": 5}, 1.5), ({"depth": 5, "midpoint_normal": "geometry"}, 2.5), ({"max_edge": 0.01}, 4.5)],
    ids=["plain", "geometry", "max-edge"],
)
def test_memory_is_a_small_multiple_of_the_file(options: dict[str, Any], times: float, tmp_path: Path) -> None:
    """Beside the work arrays of a stretch, the mesh before the last pass and what that needs of itself."""
    made = refinable(torus(30, 15), "overveld", **options)
    path = tmp_path / "dense.ply"
    tracemalloc.start()
    try:
        made.write(path, threads=1)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert path.stat().st_size > 8 << 20
    assert peak < times * path.stat().st_size + (16 << 20)


@pytest.mark.parametrize("geometry", [False, True])
def test_one_more_pass_gives_what_was_held(geometry: bool) -> None:
    """The last pass goes into the sink block by block; a pass later the same mesh is one that is held."""
    options = {"midpoint_normal": "geometry"} if geometry else {}
    streamed = refinable(mixed_ball(), "overveld", depth=3, sharp_angle=30, **options).refine()
    made = refinable(mixed_ball(), "overveld", depth=4, sharp_angle=30, **options)
    held = made._reached(3)[1]  # type: ignore[attr-defined]
    assert np.array_equal(held.positions, streamed.positions)
    assert np.array_equal(held.values[:, :3], streamed.normals)
    assert np.array_equal(held.wedges, streamed.face_wedges)


def test_edges_that_stop_are_counted_before_they_are_split() -> None:
    made = refinable(mixed_ball(), "overveld", max_edge=0.1)
    assert made.face_count(1, 100) > 100
    assert made.face_count(1) == len(made.refine().faces) == len(made.refine(threads=1).faces)
