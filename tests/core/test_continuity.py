"""Continuity: patches meet without gaps and with one tangent plane, measured from their own derivatives."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import curvify
from curvify.mesh import PolygonMesh
from curvify.quality import edge_angles
from surfaces import (
    CROSS_TANGENTS,
    cube,
    cylinder,
    diagonal,
    dodecahedron,
    icosahedron,
    l_prism,
    mixed_ball,
    noisy,
    octahedron,
    on_sphere,
    tetrahedron,
    torus,
    truncated_icosahedron,
    uv_sphere,
    vase,
)

EXACT: dict[str, Callable[[], PolygonMesh]] = {
    "tetrahedron": lambda: on_sphere(tetrahedron()),
    "octahedron": lambda: on_sphere(octahedron()),
    "icosahedron": lambda: on_sphere(icosahedron()),
    "cube": lambda: on_sphere(cube()),
    "dodecahedron": lambda: on_sphere(dodecahedron()),
    "truncated icosahedron": lambda: on_sphere(truncated_icosahedron()),
    "uv sphere": lambda: on_sphere(uv_sphere()),
    "mixed": lambda: on_sphere(mixed_ball()),
    "torus": lambda: torus(9, 6),
    "torus of triangles": lambda: torus(9, 6, triangles=True),
    "cylinder of triangles": lambda: cylinder(7, 2, triangles=True),
}
NOISY: dict[str, Callable[[], PolygonMesh]] = {
    "icosahedron": lambda: noisy(icosahedron(), 0.06),
    "cube": lambda: noisy(cube(), 0.08),
    "dodecahedron": lambda: noisy(dodecahedron(), 0.04),
    "truncated icosahedron": lambda: noisy(truncated_icosahedron(), 0.02),
    "mixed": lambda: noisy(mixed_ball(), 0.02),
    "torus": lambda: noisy(torus(9, 6), 0.03),
    "torus of triangles": lambda: noisy(torus(9, 6, triangles=True), 0.03),
    "vase": lambda: noisy(vase(), 0.03),
}
each_tangent = pytest.mark.parametrize("kind", CROSS_TANGENTS)


def check_smooth(surface: curvify.Surface) -> None:
    found = edge_angles(surface.patches)
    assert found.smooth.all(), "no edge here is a crease"
    assert len(found.edges) == surface.patches.topology.interior.sum()
    assert found.gaps.max() < 1e-13 * diagonal(surface.patches.positions)
    assert found.angles.max() < 1e-9


@each_tangent
@pytest.mark.parametrize("name", EXACT)
def test_patches_over_exact_normals_share_a_tangent_plane(name: str, kind: str) -> None:
    check_smooth(curvify.surface(EXACT[name](), cross_tangent=kind, sharp_from="normals"))


@each_tangent
@pytest.mark.parametrize("name", NOISY)
def test_patches_over_noisy_meshes_share_a_tangent_plane(name: str, kind: str) -> None:
    check_smooth(curvify.surface(NOISY[name](), cross_tangent=kind))


def test_patches_of_split_concave_faces_share_a_tangent_plane() -> None:
    check_smooth(curvify.surface(l_prism()))


@pytest.mark.parametrize("name", ["linear", "quadratic"])
def test_alpha_keeps_the_tangent_planes(name: str) -> None:
    alpha = 0.6 if name == "quadratic" else 1.0
    check_smooth(curvify.surface(noisy(dodecahedron(), 0.04), cross_tangent=name, alpha=alpha))


def test_a_fold_shows_as_an_angle_near_180_degrees() -> None:
    """Two triangles on one side of their common edge, with the same normal at both ends: a folded pair."""
    points = [[0.0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, 0.6, 0]]
    mesh = PolygonMesh.from_faces(points, [[0, 1, 2], [1, 0, 3]])
    mesh.corner_normals = np.tile([0.0, 0, 1], (6, 1))
    found = edge_angles(curvify.surface(mesh, sharp_from="normals").patches)
    assert len(found.edges) == 1
    assert found.angles.min() > 179


def test_a_sharp_edge_is_told_from_a_smooth_one() -> None:
    mesh = cube()
    normals = [np.cross(*np.diff(mesh.positions[f][:3], axis=0)) for f in mesh.faces()]
    mesh.corner_normals = np.repeat(normals, 4, axis=0)
    found = edge_angles(curvify.surface(mesh, sharp_from="normals").patches)
    assert not found.smooth.any()
    assert np.abs(found.angles - 90).max() < 1e-9
    assert found.gaps.max() < 1e-14


def test_a_measurement_can_be_thinned_out() -> None:
    patches = curvify.surface(torus(9, 6)).patches
    assert edge_angles(patches, most=10).angles.shape == (10, 5)
    assert edge_angles(patches, places=(0.5,)).angles.shape == (108, 1)
