"""Sharp features and shape controls: what each kind of mark does to the surface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import curvify
from curvify.mesh import Marks, PolygonMesh
from curvify.prepare import prepare_mesh
from curvify.quality import edge_angles
from surfaces import (
    CROSS_TANGENTS,
    check_sound,
    cube,
    degrees,
    diagonal,
    dodecahedron,
    flat_grid,
    icosahedron,
    mixed_ball,
    noisy,
    octahedron,
    prism,
    refined,
    torus,
    unit,
    vase,
)

SAMPLES = Path(__file__).resolve().parents[2] / "sample_meshes"
CLOSED = ("ball", "cylinder", "dodecahedron", "knob", "l_part", "mixed", "mushroom", "pawn", "ring", "torus")
each_tangent = pytest.mark.parametrize("kind", CROSS_TANGENTS)
each_projected = pytest.mark.parametrize("kind", ["precise", "smooth"])


def edges_of(mesh: PolygonMesh) -> np.ndarray:
    return prepare_mesh(mesh).topology.edges


def creased(mesh: PolygonMesh, edges: object, sharpness: object = 1.0) -> PolygonMesh:
    """The mesh with creases on some edges ``(m,2)``."""
    pairs = np.asarray(edges).reshape(-1, 2)
    ends = np.broadcast_to(np.asarray(sharpness, dtype=float), (len(pairs), 2))
    return mesh.with_(marks=Marks(crease_edges=pairs, crease_sharpness=ends))


def rims(sides: int) -> list[tuple[int, int]]:
    """Edges round the two caps of a prism."""
    return [(r * sides + k, r * sides + (k + 1) % sides) for r in (0, 1) for k in range(sides)]


# --- creases ----------------------------------------------------------------------------------------------------


@each_projected
@pytest.mark.parametrize("name", CLOSED)
def test_random_creases_leave_no_crack_and_the_other_edges_smooth(name: str, kind: str) -> None:
    mesh = curvify.read(SAMPLES / f"{name}.obj")
    edges = edges_of(mesh)
    generator = np.random.default_rng(0)
    chosen = generator.choice(len(edges), min(30, len(edges)), replace=False)
    surface = curvify.surface(creased(mesh, edges[chosen]), cross_tangent=kind)
    found = edge_angles(surface.patches)
    assert found.gaps.max() < 1e-14
    assert found.angles[found.smooth].max(initial=0) < 1e-9
    check_sound(surface.refine(2), closed=True)


@each_tangent
def test_a_cube_with_creases_on_all_edges_stays_a_cube(kind: str) -> None:
    mesh = cube()
    dense = refined(creased(mesh, edges_of(mesh)), 4, cross_tangent=kind)
    assert np.abs(np.abs(dense.positions).max(axis=1) - 3**-0.5).max() < 1e-15


@each_tangent
@pytest.mark.parametrize("sides", [10, 12])
def test_a_cylinder_with_creased_rims_has_planar_caps_and_round_rims(sides: int, kind: str) -> None:
    level = 4
    mesh = prism(sides)
    dense = refined(creased(mesh, rims(sides)), level, cross_tangent=kind)
    caps = dense.faces[-2 * sides * level**2 :]
    for cap, height in zip(np.split(caps, 2), (0.0, 1.0), strict=True):
        assert np.abs(dense.positions[cap, 2] - height).max() < 1e-14
    rim = np.unique(caps[np.abs(np.hypot(*dense.positions[caps, :2].transpose(2, 0, 1)) - 1) < 0.01])
    radius = np.hypot(dense.positions[rim, 0], dense.positions[rim, 1])
    assert len(rim) >= 2 * sides * 2 * level
    assert np.abs(radius - 1)[np.abs(radius - 1) < 3e-3].max() < (1e-5 if kind in ("precise", "smooth") else 3e-3)


@each_tangent
def test_an_open_rim_stays_planar_beside_a_crease(kind: str) -> None:
    mesh = vase()
    ring = [(30 + k, 30 + (k + 1) % 10) for k in range(10)]
    surface = curvify.surface(creased(mesh, ring), cross_tangent=kind)
    curves = surface.patches.edges.curves
    topology = surface.patches.topology
    boundary = ~topology.interior
    assert np.abs(np.ptp(curves[2][boundary], axis=1)).max() < 1e-15
    arriving = {int(e[1]): c[:, 3] - c[:, 2] for e, c in zip(*turned(topology, curves, boundary), strict=True)}
    leaving = {int(e[0]): c[:, 1] - c[:, 0] for e, c in zip(*turned(topology, curves, boundary), strict=True)}
    for vertex, direction in leaving.items():
        assert degrees(unit(direction), unit(arriving[vertex])) < 1e-9


def turned(topology: object, curves: np.ndarray, chosen: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Ends and curves of the chosen edges in the direction of their faces."""
    half_edges = np.flatnonzero(chosen[topology.edge])  # type: ignore[attr-defined]
    ends, points = [], []
    for h in half_edges:
        step = 1 if topology.forward[h] else -1  # type: ignore[attr-defined]
        ends.append(topology.edges[topology.edge[h]][::step])  # type: ignore[attr-defined]
        points.append(curves[:, topology.edge[h], ::step])  # type: ignore[attr-defined]
    return ends, points


@each_tangent
def test_sharpness_zero_is_no_mark(kind: str) -> None:
    mesh = mixed_ball()
    marked = refined(creased(mesh, edges_of(mesh), 0.0), 2, cross_tangent=kind)
    plain = refined(mesh, 2, cross_tangent=kind)
    assert np.array_equal(marked.positions, plain.positions)
    assert np.array_equal(marked.normals, plain.normals)


def test_sharpness_is_the_share_of_the_angle_and_leaves_the_crease_where_it_is() -> None:
    mesh = prism(12)
    whole = curvify.surface(creased(mesh, rims(12))).patches
    edge = np.flatnonzero((edges_of(mesh) < 12).all(axis=1))[0]
    angles = []
    for sharpness in (0.25, 0.5, 1.0):
        patches = curvify.surface(creased(mesh, rims(12), sharpness)).patches
        assert np.abs(patches.edges.curves[:, edge] - whole.edges.curves[:, edge]).max() < 1e-14
        found = edge_angles(patches)
        angles.append(found.angles[found.edges == edge].mean())
    assert angles[0] < angles[1] < angles[2]
    assert abs(angles[2] - 90) < 1e-9


def test_a_crease_fades_to_nothing_where_it_ends_alone() -> None:
    mesh = icosahedron()
    pair = edges_of(mesh)[0]
    patches = curvify.surface(creased(mesh, pair)).patches
    assert np.array_equal(patches.normals, curvify.surface(mesh).patches.normals)
    a, b = pair.tolist()
    ahead = {sum(e) - b: e for e in edges_of(mesh).tolist() if b in e and a not in e}
    c = max(ahead, key=lambda v: -float(mesh.positions[v] @ mesh.positions[a]))
    surface = curvify.surface(creased(mesh, [[a, b], [b, c]]))
    found = edge_angles(surface.patches, places=(1e-4, 0.5, 1 - 1e-4))
    sharp = found.angles[~found.smooth]
    assert len(sharp) == 2
    assert sharp.max() > 3
    assert np.minimum(sharp[:, 0], sharp[:, 2]).max() < 1e-2


def test_a_sharp_turn_of_a_crease_is_a_corner_and_is_reported() -> None:
    mesh = flat_grid(2, 2)
    lifted = mesh.positions.copy()
    lifted[4, 2] = 0.1
    surface = curvify.surface(creased(mesh.with_(positions=lifted), [[1, 4], [4, 3]]))
    assert surface.patches.counts["corner_vertices"] == 0  # a right angle still is a smooth turn
    lifted[1, :2] = [0.3, 0.3]
    surface = curvify.surface(creased(mesh.with_(positions=lifted), [[1, 4], [4, 3]]))
    assert surface.patches.counts["corner_vertices"] == 1
    assert surface.patches.counts["broken_edges"] > 0
    assert any("without a mark not smooth" in text for text in surface.warnings)


@pytest.mark.parametrize("make", [cube, lambda: prism(8), lambda: torus(9, 6).with_(corner_normals=None), mixed_ball])
def test_moving_the_dense_mesh_along_its_normals_opens_creases_only(make: object) -> None:
    mesh = make()  # type: ignore[operator]
    edges = edges_of(mesh)[::3]
    surface = curvify.surface(creased(mesh, edges))
    dense = surface.refine(3)
    moved = dense.positions[dense.wedge_vertices] + 0.01 * dense.normals
    gaps = np.linalg.norm(moved[len(dense.positions) :] - moved[dense.repeats], axis=1)
    opened = np.unique(dense.repeats[gaps > 1e-9])
    patches = surface.patches
    first = mesh.vertex_count + 5 * np.arange(len(patches.topology.edges))
    found = edge_angles(patches)
    allowed = set(range(mesh.vertex_count))
    for edge in found.edges[~found.smooth]:
        allowed |= set(range(first[edge], first[edge] + 5))
    assert len(opened)
    assert set(opened.tolist()) <= allowed


def test_one_normal_for_each_vertex_on_demand() -> None:
    mesh = creased(prism(12), rims(12))
    split, welded = refined(mesh, 3), curvify.refine(mesh, level=3, weld_normals=True)
    assert len(split.repeats)
    assert not len(welded.repeats)
    assert np.array_equal(split.positions, welded.positions)
    check_sound(welded, closed=True)
    rim = np.abs(np.hypot(*welded.positions[:, :2].T) - 1) < 1e-9
    rim &= np.abs(np.abs(welded.positions[:, 2] - 0.5) - 0.5) < 1e-12
    assert np.abs(np.abs(welded.normals[rim, 2]) - 0.5**0.5).max() < 2e-2
    inner = np.setdiff1d(np.arange(len(welded.positions)), split.repeats)
    assert np.array_equal(split.normals[inner], welded.normals[inner])


def test_normals_of_two_sides_that_cancel_are_not_averaged() -> None:
    """A flat pillow: both faces share all corners, and look opposite ways."""
    mesh = PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3], [3, 2, 1, 0]])
    dense = curvify.refine(creased(mesh, edges_of(mesh)), level=2, weld_normals=True)
    check_sound(dense)


# --- the other marks ----------------------------------------------------------------------------------------------


@each_tangent
def test_a_straight_edge_is_straight_and_stays_smooth(kind: str) -> None:
    mesh = torus(9, 6).with_(corner_normals=None)
    edge = 7
    pair = edges_of(mesh)[[edge]]
    surface = curvify.surface(mesh, marks=Marks(straight_edges=pair), cross_tangent=kind)
    start, first, last, end = surface.patches.edges.curves[:, edge].T
    for point in (first, last):
        assert np.linalg.norm(np.cross(point - start, unit(end - start))) < 1e-15
    found = edge_angles(surface.patches)
    assert found.smooth.all()
    assert found.angles.max() < 1e-9
    plain = curvify.surface(mesh, cross_tangent=kind).patches.edges.curves[:, edge]
    assert np.abs(plain - surface.patches.edges.curves[:, edge]).max() > 1e-3


def test_two_straight_edges_at_a_vertex_span_its_tangent_plane() -> None:
    mesh = icosahedron()
    straight = [e for e in edges_of(mesh).tolist() if 0 in e][:2]
    patches = curvify.surface(mesh, marks=Marks(straight_edges=np.array(straight))).patches
    ends = [sum(e) for e in straight]
    normal = unit(np.cross(*(mesh.positions[e] - mesh.positions[0] for e in ends)))
    own = patches.normals[patches.topology.vertices == 0]
    assert np.abs(np.abs(own @ normal) - 1).max() < 1e-12


def test_more_straight_edges_than_a_plane_holds_make_a_corner() -> None:
    mesh = octahedron()
    own = np.array([e for e in edges_of(mesh).tolist() if 0 in e])
    surface = curvify.surface(mesh, marks=Marks(straight_edges=own))
    assert surface.patches.counts["corner_vertices"] == 1
    assert any("without a mark not smooth" in text for text in surface.warnings)
    check_sound(surface.refine(2), closed=True)


@each_tangent
def test_an_edge_normal_lays_the_edge_into_its_plane(kind: str) -> None:
    mesh = torus(9, 6).with_(corner_normals=None)
    edges = edges_of(mesh)
    ends = mesh.positions[edges]
    places = np.stack([ends[..., 2], np.hypot(ends[..., 0], ends[..., 1])], axis=-1)
    level = np.flatnonzero((np.abs(places[:, 1] - places[:, 0]) < 1e-12).all(axis=1))
    middle = mesh.positions[edges[level]].mean(axis=1)
    bent = Marks(bent_edges=edges[level], edge_normals=unit(middle * [1, 1, 0]))
    surface = curvify.surface(mesh, marks=bent, cross_tangent=kind)
    heights = surface.patches.edges.curves[2, level]
    outer = np.hypot(*middle[:, :2].T) > 1
    assert np.ptp(heights[outer], axis=1).max() < 1e-15
    plain = curvify.surface(mesh, cross_tangent=kind).patches.edges.curves[2, level]
    assert np.ptp(plain[outer], axis=1).max() > 1e-3
    assert edge_angles(surface.patches).angles.max() < 1e-9


@each_tangent
def test_flat_faces_are_planar(kind: str) -> None:
    mesh = mixed_ball()
    planar = [f for f, face in enumerate(mesh.faces()) if len(face) >= 5][:3]
    surface = curvify.surface(mesh, marks=Marks(flat_faces=np.array(planar)), cross_tangent=kind)
    dense = surface.refine(3)
    assert dense.source_faces is not None
    for face in planar:
        points = dense.positions[dense.faces[dense.source_faces == face]].reshape(-1, 3)
        assert np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[2] < 1e-13
    found = edge_angles(surface.patches)
    assert found.angles[found.smooth].max() < 1e-9


@pytest.mark.parametrize("tagged", [0, 5, 9])
def test_flat_faces_in_one_plane_are_smooth_between_them(tagged: int) -> None:
    mesh = torus(9, 4).with_(corner_normals=None)
    turn = np.pi / 4
    angle = np.repeat(2 * np.pi * np.arange(4) / 4 + turn, 9)
    around = np.tile(2 * np.pi * np.arange(9) / 9, 4)
    radius = 1 + 0.4 * np.cos(angle)
    points = np.stack([radius * np.cos(around), radius * np.sin(around), 0.4 * np.sin(angle)], axis=1)
    mesh = mesh.with_(positions=points, marks=Marks(flat_faces=np.arange(tagged)))
    surface = curvify.surface(mesh, marks=Marks(flat_faces=np.arange(tagged, 9)))
    found = edge_angles(surface.patches)
    assert (~found.smooth).sum() == 18
    inside = (surface.patches.topology.edges[found.edges] % 9)[found.smooth]
    assert len(inside) == 72 - 18


@pytest.mark.parametrize("sharpness", [0.3, 1.0])
def test_a_marked_corner_becomes_the_tip_of_a_cone(sharpness: float) -> None:
    mesh = octahedron()
    marks = Marks(corner_vertices=np.array([0]), corner_sharpness=np.array([sharpness]))
    surface = curvify.surface(mesh, marks=marks)
    own = surface.patches.normals[surface.patches.topology.vertices == 0]
    tilt = degrees(own, unit(mesh.positions[0]))
    flat = degrees(unit([1.0, 1.0, 1.0]), unit(mesh.positions[0]))
    assert (tilt > 5).all()
    if sharpness == 1:
        assert np.abs(tilt - flat).max() < 1e-9
    assert not any("without a mark" in text for text in surface.warnings)
    check_sound(surface.refine(2), closed=True)


def test_holes_are_left_out() -> None:
    mesh = cube()
    surface = curvify.surface(mesh, marks=Marks(hole_faces=np.array([2])))
    dense = surface.refine(2)
    assert dense.source_faces is not None
    assert set(dense.source_faces.tolist()) == {0, 1, 3, 4, 5}
    assert surface.patches.counts["hole_faces"] == 1
    check_sound(dense, closed=False)
    with pytest.raises(curvify.MeshError, match="every face is a hole"):
        curvify.surface(mesh, marks=Marks(hole_faces=np.arange(6)))


@each_projected
@pytest.mark.parametrize("amount", [-0.2, 0.2])
def test_bulging_moves_the_middle_and_keeps_the_sides(amount: float, kind: str) -> None:
    mesh = dodecahedron()
    plain = curvify.surface(mesh, cross_tangent=kind)
    swollen = curvify.surface(mesh, cross_tangent=kind, bulge=amount)
    one = curvify.surface(mesh, cross_tangent=kind, marks=Marks(bulged_faces=np.array([4]), bulges=np.array([amount])))
    faces, middle = np.arange(12), np.zeros((12, 2))
    outward = unit(plain.evaluate(faces, middle)[0])
    moved = ((swollen.evaluate(faces, middle)[0] - plain.evaluate(faces, middle)[0]) * outward).sum(axis=1)
    assert (np.sign(moved) == np.sign(amount)).all()
    assert np.abs(moved).min() > 0.01
    changed = np.linalg.norm(one.evaluate(faces, middle)[0] - plain.evaluate(faces, middle)[0], axis=1)
    assert np.flatnonzero(changed > 1e-12).tolist() == [4]
    assert abs(changed[4] - abs(moved[4])) < 1e-12
    for surface in (swollen, one):
        found = edge_angles(surface.patches)
        assert found.smooth.all()
        assert found.angles.max() < 1e-9
        assert np.array_equal(surface.patches.edges.curves, plain.patches.edges.curves)


def test_alpha_of_a_face() -> None:
    mesh = cube()
    marks = Marks(full_faces=np.array([1]), alphas=np.array([2.0]))
    plain = curvify.surface(mesh, cross_tangent="quadratic")
    full = curvify.surface(mesh, cross_tangent="quadratic", alpha=2.0)
    one = curvify.surface(mesh, cross_tangent="quadratic", marks=marks)
    faces, middle = np.arange(6), np.zeros((6, 2))
    got = one.evaluate(faces, middle)[0]
    assert np.array_equal(got[1], full.evaluate(faces, middle)[0][1])
    others = [0, 2, 3, 4, 5]
    assert np.array_equal(got[others], plain.evaluate(faces, middle)[0][others])
    assert np.abs(got[1] - plain.evaluate(faces, middle)[0][1]).max() > 0.01
    assert edge_angles(one.patches).angles.max() < 1e-9


def test_the_fold_test_knows_the_alpha_of_each_face() -> None:
    mesh = noisy(mixed_ball(), 0.1)
    full = curvify.surface(mesh, cross_tangent="quadratic", alpha=50.0)
    assert full.patches.counts["folded_patches"] > 0
    faces = np.arange(mesh.face_count)
    marks = Marks(full_faces=faces, alphas=np.ones(len(faces)))
    tamed = curvify.surface(mesh, cross_tangent="quadratic", alpha=50.0, marks=marks)
    assert tamed.patches.counts["folded_patches"] == 0


def test_bulges_that_the_cross_tangent_cannot_show_are_named() -> None:
    with pytest.raises(curvify.OptionError, match="bulge"):
        curvify.surface(cube(), cross_tangent="linear", bulge=0.1)
    with pytest.raises(curvify.OptionError, match="above -1"):
        curvify.surface(cube(), cross_tangent="smooth", bulge=-1.0)
    bulged = Marks(bulged_faces=np.array([1]), bulges=np.array([0.1]))
    assert any("bulge" in text for text in curvify.surface(cube(), cross_tangent="linear", marks=bulged).warnings)
    full = Marks(full_faces=np.array([1]), alphas=np.array([2.0]))
    assert any("alpha" in text for text in curvify.surface(cube(), marks=full).warnings)


@pytest.mark.parametrize("normals", ["exact", "paper"])
def test_the_papers_normals_know_creases(normals: str) -> None:
    mesh = creased(prism(12), rims(12))
    dense = refined(mesh, 4, normals=normals)
    assert dense.source_faces is not None
    caps = dense.source_faces >= 12
    up = np.where(dense.source_faces[caps] == 12, -1.0, 1.0)
    assert np.abs(dense.normals[dense.face_wedges[caps]][..., 2] - up[:, None]).max() < 1e-12
    assert np.abs(dense.normals[dense.face_wedges[~caps]][..., 2]).max() < 1e-12


def test_marks_survive_welding_and_turn_with_the_mesh() -> None:
    """Soup: each polygon has vertices of its own, the marks lie on one copy of each edge."""
    mesh = prism(8)
    corner_of = np.full((mesh.vertex_count, mesh.vertex_count), -1)
    for start, end in zip(mesh.face_offsets[:-1], mesh.face_offsets[1:], strict=True):
        for c in range(start, end):
            following = c + 1 if c + 1 < end else start
            corner_of[mesh.face_vertices[c], mesh.face_vertices[following]] = c
    loose = mesh.with_(positions=mesh.positions[mesh.face_vertices], face_vertices=np.arange(mesh.corner_count))
    ends = []
    for a, b in rims(8):
        c = corner_of[a, b]
        face = np.searchsorted(mesh.face_offsets, c, side="right") - 1
        following = c + 1 if c + 1 < mesh.face_offsets[face + 1] else mesh.face_offsets[face]
        ends.append((following, c))  # against the direction of the face
    got = curvify.surface(creased(loose, ends, (0.25, 1.0)))
    expected = curvify.surface(creased(mesh, [(b, a) for a, b in rims(8)], (0.25, 1.0)))
    assert got.patches.counts["crease_edges"] == 16
    assert np.array_equal(got.patches.normals, expected.patches.normals)
    assert diagonal(got.patches.positions) == diagonal(expected.patches.positions)


def random_marks(mesh: PolygonMesh, generator: np.random.Generator) -> Marks:
    """Marks of all kinds scattered over the mesh."""
    edges = edges_of(mesh)

    def some(count: int, share: float) -> np.ndarray:
        return generator.choice(count, generator.integers(1, max(2, int(count * share))), replace=False)

    sharp, bent, corners = some(len(edges), 0.3), some(len(edges), 0.1), some(mesh.vertex_count, 0.08)
    sharpness = generator.random((len(sharp), 2))
    sharpness[generator.random(sharpness.shape) < 0.5] = 1
    bulged = some(mesh.face_count, 0.3)
    return Marks(
        crease_edges=edges[sharp],
        crease_sharpness=sharpness,
        straight_edges=edges[some(len(edges), 0.1)],
        bent_edges=edges[bent],
        edge_normals=generator.standard_normal((len(bent), 3)),
        corner_vertices=corners,
        corner_sharpness=generator.random(len(corners)),
        flat_faces=some(mesh.face_count, 0.1),
        hole_faces=some(mesh.face_count, 0.02),
        bulged_faces=bulged,
        bulges=generator.uniform(-0.3, 0.3, len(bulged)),
    )


@each_projected
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("make", [mixed_ball, icosahedron, vase, lambda: torus(9, 6), lambda: prism(9)])
def test_marks_of_all_kinds_together_leave_a_sound_surface(make: object, seed: int, kind: str) -> None:
    mesh = make()  # type: ignore[operator]
    surface = curvify.surface(mesh, marks=random_marks(mesh, np.random.default_rng(seed)), cross_tangent=kind)
    dense = surface.refine(2)
    check_sound(dense)
    check_sound(surface.weld_normals().refine(2))
    found = edge_angles(surface.patches)
    assert found.gaps.max() < 1e-13
    if not surface.patches.counts["folded_patches"]:
        assert found.angles[found.smooth].max() < 1e-9
