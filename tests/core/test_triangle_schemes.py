"""The schemes pn, phong and png1: reference values, continuity, accuracy, creases, odd input."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import curvify
from curvify.errors import OptionError
from curvify.mesh import Marks, PolygonMesh
from curvify.quality import edge_angles
from curvify.schemes.base import Patches, bernstein_basis
from curvify.schemes.png1_basis import png1_columns
from curvify.schemes.triangles import barycentric
from surfaces import (
    Array,
    check_sound,
    cube,
    cylinder,
    degrees,
    dihedral_angles,
    dodecahedron,
    domain_polygon,
    geodesic,
    icosahedron,
    inside_points,
    l_prism,
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

REFERENCE = json.loads((Path(__file__).resolve().parents[1] / "data" / "triangles.json").read_text())["meshes"]
SCHEMES = ("png1", "pn", "phong")
each_scheme = pytest.mark.parametrize("scheme", SCHEMES)
each_reference = pytest.mark.parametrize("name", REFERENCE)
CLOSED: dict[str, Callable[[], PolygonMesh]] = {
    "icosahedron": lambda: on_sphere(icosahedron()),
    "rough icosahedron": lambda: noisy(icosahedron(), 0.06),
    "torus": lambda: torus(9, 6, triangles=True),
    "rough dodecahedron": lambda: noisy(dodecahedron(), 0.04),
    "rough mixed": lambda: noisy(mixed_ball(), 0.02),
    "prism": lambda: prism(7),
    "concave": l_prism,
}


def reference_mesh(name: str) -> PolygonMesh:
    data = REFERENCE[name]
    mesh = with_vertex_normals(PolygonMesh.from_faces(data["vertices"], data["faces"]), np.array(data["normals"]))
    creases = np.array(data["creases"]).reshape(-1, 3)
    return mesh.with_(marks=Marks(curled_edges=creases[:, :2].astype(np.int64), kappas=creases[:, 2]))


def reference_samples(name: str) -> tuple[Array, Array]:
    samples = REFERENCE[name]["samples"]
    return np.array([s["face"] for s in samples]), np.array([s["params"] for s in samples]) @ domain_polygon(3)


def reference_values(name: str, what: str) -> Array:
    return np.array([sample[what] for sample in REFERENCE[name]["samples"]])


def own_normals(patches: Patches, ids: Array, points: Array) -> Array:
    """Normals of patches from the scheme's own form."""
    (patch_class,) = patches.classes
    assert patch_class.normals is not None
    vectors, basis = patch_class.normals.controls(ids).linear, patch_class.normals.basis(points).linear[0]
    return unit(np.einsum("cql,ql->qc", vectors, basis))


def side_normals(surface: curvify.Surface, t: Array) -> tuple[Array, Array]:
    """On every half-edge at ``t``: normals of its own patch, and of the field of its side."""
    patches = surface.patches
    topology = patches.topology
    start = domain_polygon(3)[np.arange(len(topology.vertices)) % 3]
    end = domain_polygon(3)[(np.arange(len(topology.vertices)) + 1) % 3]
    points = (1 - t)[:, None] * start[:, None] + t[:, None] * end[:, None]
    _, own = surface.evaluate(np.repeat(topology.faces, len(t)), points.reshape(-1, 2))
    canonical = np.where(topology.forward[:, None], t, 1 - t)
    fields = np.moveaxis(patches.edges.fields[:, patches.side_field], 0, -1)
    degree = fields.shape[1] - 1
    basis = bernstein_basis(degree, canonical)
    return own.reshape(*canonical.shape, 3), unit(np.einsum("qht,hqc->htc", basis, fields))


# --- reference ------------------------------------------------------------------------------------------------------


@each_scheme
@each_reference
def test_points_agree_with_the_reference(name: str, scheme: str) -> None:
    position, _ = curvify.surface(reference_mesh(name), scheme).evaluate(*reference_samples(name))
    assert np.abs(position - reference_values(name, f"{scheme}_point")).max() < 1e-12


@each_reference
def test_exact_normals_of_png1_agree_with_the_reference(name: str) -> None:
    _, normal = curvify.surface(reference_mesh(name), "png1").evaluate(*reference_samples(name))
    assert np.abs(normal - reference_values(name, "png1_exact_normal")).max() < 1e-12


@pytest.mark.parametrize(
    ("scheme", "options", "what"),
    [("png1", {"normals": "smooth"}, "png1_smooth"), ("pn", {}, "pn"), ("phong", {}, "phong")],
    ids=SCHEMES,
)
@each_reference
def test_interpolated_normals_agree_with_the_reference(
    name: str, scheme: str, options: dict[str, str], what: str
) -> None:
    surface = curvify.surface(reference_mesh(name), scheme, **options)
    normal = own_normals(surface.patches, *reference_samples(name))
    assert np.abs(normal - reference_values(name, f"{what}_normal")).max() < 1e-12


@each_reference
def test_control_points_of_png1_agree_with_the_reference(name: str) -> None:
    (patch_class,) = curvify.surface(reference_mesh(name), "png1").patches.classes
    found = patch_class.surface.controls(np.array([0])).linear[:, 0].T
    blocks = found[3:].reshape(6, 3, 3)[[0, 1, 3, 2, 4, 5]]  # q1, q2, Xab, Xba, Ma, Mb of each side
    expected = np.array(list(REFERENCE[name]["png1_control_points_face0"].values())).reshape(3, 6, 3)
    assert np.abs(blocks.transpose(1, 0, 2) - expected).max() < 1e-12


def test_phong_is_the_mean_of_the_projections_onto_the_tangent_planes() -> None:
    mesh = noisy(icosahedron(), 0.05)
    normals = unit(mesh.positions)
    surface = curvify.surface(with_vertex_normals(mesh, normals), "phong", alpha=0.6)
    points = inside_points(3, 20)
    weights = barycentric(points)[0].T
    corners = mesh.face_vertices[:3]
    flat = weights @ mesh.positions[corners]
    gaps = np.einsum("sci,ci->sc", mesh.positions[corners] - flat[:, None], normals[corners])
    onto = flat[:, None] + gaps[..., None] * normals[corners]
    expected = 0.4 * flat + 0.6 * np.einsum("sc,sci->si", weights, onto)
    assert np.abs(surface.evaluate(np.zeros(20, dtype=int), points)[0] - expected).max() < 1e-14


# --- the basis of png1 ------------------------------------------------------------------------------------------------


def test_the_columns_of_png1_sum_to_one_and_are_not_negative() -> None:
    points = np.concatenate([inside_points(3, 200), domain_polygon(3), 0.5 * domain_polygon(3)[[0, 1]]])
    columns = png1_columns(barycentric(points))
    assert np.isfinite(columns).all()
    assert np.abs(columns[0].sum(axis=0) - 1).max() < 1e-14
    assert np.abs(columns[1:].sum(axis=1)).max() < 1e-13
    assert columns[0].min() > -1e-14


def test_the_derivatives_of_the_columns_are_their_differences() -> None:
    points, step = inside_points(3, 50, shrink=0.95), 1e-6
    columns = png1_columns(barycentric(points))
    for axis in (0, 1):
        shift = step * np.eye(2)[axis]
        ahead, behind = (png1_columns(barycentric(points + s * shift))[0] for s in (1, -1))
        assert np.abs(columns[1 + axis] - (ahead - behind) / (2 * step)).max() < 1e-8


# --- continuity -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kappa", [0.0, -0.05])
@pytest.mark.parametrize("angle", [None, 20.0])
@pytest.mark.parametrize("name", CLOSED)
def test_png1_is_smooth_wherever_it_should_be_and_never_cracks(name: str, angle: float | None, kappa: float) -> None:
    surface = curvify.surface(CLOSED[name](), "png1", sharp_angle=angle, kappa=kappa)
    found = edge_angles(surface.patches)
    assert found.gaps.max() < 1e-13
    if found.smooth.any():
        assert found.angles[found.smooth].max() < 1e-9
    assert (angle is not None) or found.smooth.all()
    check_sound(surface.refine(2), closed=True)


@each_reference
def test_fields_of_sides_are_the_normals_of_their_own_patches_also_on_lifted_creases(name: str) -> None:
    own, field = side_normals(curvify.surface(reference_mesh(name), "png1"), np.array([0.1, 0.4, 0.5, 0.8]))
    assert np.abs(own - field).max() < 1e-13


def test_fields_of_sides_are_the_normals_of_their_own_patches_on_creases_between_sectors() -> None:
    surface = curvify.surface(noisy(cube(), 0.1), "png1", sharp_angle=60, kappa=-0.1)
    assert len(surface.patches.edges.fields[0]) > len(surface.patches.edges.curves[0])
    own, field = side_normals(surface, np.array([0.1, 0.4, 0.5, 0.8]))
    assert np.abs(own - field).max() < 1e-12


def test_a_lift_bends_the_insides_and_leaves_curves_and_end_normals() -> None:
    mesh = on_sphere(icosahedron())
    pair = mesh.face_vertices[:2]
    marked = mesh.with_(marks=Marks(curled_edges=pair[None], kappas=np.array([-0.2])))
    plain, lifted = curvify.surface(mesh, "png1"), curvify.surface(marked, "png1")
    assert np.array_equal(plain.patches.edges.curves, lifted.patches.edges.curves)
    found = edge_angles(lifted.patches, (0.001, 0.5))
    (crease,) = np.flatnonzero(~found.smooth)
    assert found.angles[crease, 1] > 20
    assert found.angles[crease, 0] < 1
    assert found.angles[found.smooth].max() < 1e-9


def test_a_lift_in_units_of_the_edge_grows_with_it() -> None:
    mesh = on_sphere(icosahedron())
    pair = mesh.face_vertices[:2]
    length = np.linalg.norm(np.diff(mesh.positions[pair], axis=0))

    def refined(kappa: float, units: str) -> Array:
        marks = Marks(curled_edges=pair[None], kappas=np.array([kappa]))
        return curvify.refine(mesh, "png1", 2, marks=marks, crease_units=units).positions

    assert np.abs(refined(0.2, "edge") - refined(0.2 * length, "absolute")).max() < 1e-14


def test_the_kinks_of_pn_and_phong_are_those_documented() -> None:
    """Largest angle between the faces' own normals across edges, in degrees, that docs/triangles.md names."""
    for scheme, figures in (("pn", (15.84, 19.18)), ("phong", (10.16, 21.50))):
        for mesh, figure in zip((on_sphere(icosahedron()), torus(9, 6, triangles=True)), figures, strict=True):
            angles = edge_angles(curvify.surface(mesh, scheme).patches).angles
            assert angles.max() == pytest.approx(figure, abs=0.01)


@each_scheme
def test_normals_are_one_from_both_sides_where_nothing_is_sharp(scheme: str) -> None:
    surface = curvify.surface(CLOSED["rough mixed"](), scheme)
    assert len(surface.refine(3).repeats) == 0


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_rim_in_a_plane_stays_in_it(scheme: str) -> None:
    dense = curvify.refine(vase(9), scheme, 3)
    ends = np.array(sorted({v for edge in open_edges(dense.faces) for v in edge}))
    heights = np.round(dense.positions[ends, 2] / 1.6)
    assert np.abs(dense.positions[ends, 2] - 1.6 * heights).max() < 1e-14


# --- accuracy ---------------------------------------------------------------------------------------------------------


def from_sphere(points: Array) -> Array:
    return np.linalg.norm(points, axis=1) - 1


def from_torus(points: Array) -> Array:
    ring = np.hypot(points[:, 0], points[:, 1]) - 1
    return (np.hypot(ring, points[:, 2]) - 0.4) / 0.4


# largest and rms error over the radius with 16 segments: phong, pn, png1
FIGURES: dict[str, tuple[Callable[[], PolygonMesh], Callable[[Array], Array], tuple[tuple[float, float], ...]]] = {
    "octahedron": (lambda: on_sphere(octahedron()), from_sphere, ((0.133, 0.075), (0.228, 0.132), (0.048, 0.031))),
    "icosahedron": (lambda: on_sphere(icosahedron()), from_sphere, ((0.027, 0.016), (0.058, 0.035), (0.0112, 0.0075))),
    "geodesic": (
        lambda: on_sphere(geodesic(2)), from_sphere, ((0.0081, 0.0052), (4.7e-4, 2.1e-4), (2.7e-4, 7.9e-5))
    ),
    "torus": (
        lambda: torus(12, 8, triangles=True), from_torus, ((0.051, 0.024), (0.030, 0.0092), (0.019, 0.0049))
    ),
}


@pytest.mark.parametrize(("column", "scheme"), list(enumerate(("phong", "pn", "png1"))))
@pytest.mark.parametrize("name", FIGURES)
def test_errors_against_known_surfaces_are_the_published_figures(name: str, column: int, scheme: str) -> None:
    make, error, figures = FIGURES[name]
    dense = curvify.refine(make(), scheme, 8)
    of_face = dense.faces.reshape(-1, 256 * 3)
    errors = np.concatenate([error(dense.positions[np.unique(cells)]) for cells in of_face])
    assert np.abs(errors).max() == pytest.approx(figures[column][0], rel=0.1)
    assert np.sqrt((errors**2).mean()) == pytest.approx(figures[column][1], rel=0.1)


@pytest.mark.parametrize(
    ("scheme", "figures"), [("png1", (13.0, 6.8, 3.5, 1.76)), ("pn", (22.7, 19.6, 17.9, 16.9))], ids=["png1", "pn"]
)
def test_kinks_of_the_dense_icosahedron_halve_for_png1_and_stay_for_pn(
    scheme: str, figures: tuple[float, ...]
) -> None:
    surface = curvify.surface(on_sphere(icosahedron()), scheme)
    found = [dihedral_angles(surface.refine(level)).max() for level in (2, 4, 8, 16)]
    assert found == pytest.approx(figures, rel=0.01)


def test_smooth_normals_are_a_few_degrees_from_the_exact_ones_and_never_vanish() -> None:
    mesh = noisy(icosahedron(), 0.1)
    exact, smooth = (curvify.refine(mesh, "png1", 4, normals=kind) for kind in ("exact", "smooth"))
    assert np.array_equal(exact.positions, smooth.positions)
    assert 0.5 < degrees(exact.normals, smooth.normals).max() < 15
    check_sound(smooth)


def test_smooth_normals_fall_back_to_exact_ones_where_they_would_vanish() -> None:
    mesh = octahedron()
    normals = unit(mesh.positions)
    normals[0] *= -1
    surface = curvify.surface(with_vertex_normals(mesh, normals), "png1", normals="smooth")
    assert any(patch_class.normals is None for patch_class in surface.patches.classes)
    check_sound(surface.refine(3))


# --- invariances ------------------------------------------------------------------------------------------------------


@each_scheme
def test_turning_a_mesh_turns_its_surface(scheme: str) -> None:
    mesh, turn = noisy(mixed_ball(), 0.02), rotation()
    plain = curvify.refine(mesh, scheme, 2)
    turned = curvify.refine(mesh.with_(positions=mesh.positions @ turn.T + 1), scheme, 2)
    assert np.array_equal(plain.faces, turned.faces)
    assert np.abs(turned.positions - plain.positions @ turn.T - 1).max() < 1e-12
    assert np.abs(turned.normals - plain.normals @ turn.T).max() < 1e-11


@each_scheme
def test_the_corner_that_is_listed_first_does_not_matter(scheme: str) -> None:
    mesh = noisy(mixed_ball(), 0.02)
    rolled = PolygonMesh.from_faces(mesh.positions, [face[1:] + face[:1] for face in mesh.faces()])
    plain, other = (curvify.refine(m, scheme, 1) for m in (mesh, rolled))
    order, others = (np.lexsort(np.round(d.positions, 9).T) for d in (plain, other))
    assert np.abs(plain.positions[order] - other.positions[others]).max() < 1e-12


@pytest.mark.parametrize("scale", [1e-12, 1e12])
@each_scheme
def test_scaling_a_mesh_scales_its_surface(scheme: str, scale: float) -> None:
    mesh = noisy(icosahedron(), 0.05)
    plain, scaled = (curvify.refine(mesh.with_(positions=s * mesh.positions), scheme, 2) for s in (1.0, scale))
    assert np.abs(scaled.positions / scale - plain.positions).max() < 1e-11
    assert np.abs(scaled.normals - plain.normals).max() < 1e-10


@each_scheme
def test_isolated_polygons_with_normals_get_equal_bits_on_both_sides_of_an_edge(scheme: str) -> None:
    mesh = on_sphere(noisy(icosahedron(), 0.05))
    whole, apart = (curvify.refine(m, scheme, 3, weld="never") for m in (mesh, soup(mesh)))
    on_edges = slice(12, 12 + 30 * 5)
    rows = {tuple(row) for row in np.c_[apart.positions, apart.normals]}
    shared = np.c_[whole.positions, whole.normals][on_edges]
    if scheme == "png1":  # its edge normals know both triangles, its curves know the edge alone
        rows, shared = {row[:3] for row in rows}, shared[:, :3]
    assert all(tuple(row) in rows for row in shared)


# --- odd input --------------------------------------------------------------------------------------------------------


@each_scheme
@pytest.mark.parametrize(
    ("points", "faces", "normals"),
    [
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], None),  # no area
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [[1, 0, 0], [0, 0, 1], [0, 0, 1]]),  # along an edge
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [[0, 0, 1], [0, 0, -1], [0, 0, 1]]),  # opposite
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [2, 1, 0]], None),  # two sides of one triangle
    ],
)
def test_degenerate_triangles_stay_finite(
    scheme: str, points: list[list[float]], faces: list[list[int]], normals: list[list[float]] | None
) -> None:
    mesh = PolygonMesh.from_faces(points, faces)
    if normals is not None:
        mesh = with_vertex_normals(mesh, np.array(normals))
    check_sound(curvify.refine(mesh, scheme, 3))


def test_normals_that_turn_away_from_their_triangle_are_counted() -> None:
    mesh = octahedron()
    normals = unit(mesh.positions)
    normals[0] *= -1
    surface = curvify.surface(with_vertex_normals(mesh, normals), "png1")
    assert surface.counts["folded_corners"] == 4
    assert any("the surface folds at 4 corners" in text for text in surface.warnings)


@each_scheme
def test_edges_with_three_faces_are_boundaries_of_each(scheme: str) -> None:
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.3, -1, 0.2]]
    mesh = PolygonMesh.from_faces(points, [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    dense = curvify.refine(mesh, scheme, 2)
    check_sound(dense)
    assert dense.vertex_count == 5 + 7 * 3 + 3 * 3


@pytest.mark.parametrize(
    ("scheme", "options", "message"),
    [
        ("phong", {"alpha": 1.5}, "from 0 to 1"),
        ("png1", {"kappa": np.inf}, "finite"),
        ("png1", {"normals": "paper"}, "exact, smooth"),
        ("png1", {"crease_units": "feet"}, "absolute, edge"),
        ("pn", {"alpha": 1.0}, "has no option alpha"),
    ],
)
def test_options_that_cannot_be_are_refused(scheme: str, options: dict[str, Any], message: str) -> None:
    with pytest.raises(OptionError, match=message):
        curvify.surface(cylinder(6), scheme, **options)
