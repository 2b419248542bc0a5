"""Normals that a file gives: split ones make creases, flat-shaded ones are ignored, smooth ones are kept."""

from __future__ import annotations

import numpy as np
import pytest

import curvify
from curvify.mesh import PolygonMesh
from curvify.polygons import newell_normals
from surfaces import (
    CROSS_TANGENTS,
    check_sound,
    cube,
    degrees,
    dodecahedron,
    icosahedron,
    mixed_ball,
    on_sphere,
    prism,
    refined,
    soup,
    unit,
)

each_tangent = pytest.mark.parametrize("kind", CROSS_TANGENTS)


def face_normals(mesh: PolygonMesh) -> np.ndarray:
    """Unit normal of each face, for each of its corners."""
    area = unit(newell_normals(mesh.positions, mesh.face_offsets, mesh.face_vertices))
    return np.repeat(area, mesh.face_sizes, axis=0)


def capped_cylinder(sides: int = 12) -> PolygonMesh:
    """A closed cylinder with radial normals on its side and axial ones on its caps."""
    mesh = prism(sides)
    normals = mesh.positions[mesh.face_vertices] * [1, 1, 0]
    normals[-2 * sides : -sides] = [0, 0, -1]
    normals[-sides:] = [0, 0, 1]
    return mesh.with_(corner_normals=normals)


@each_tangent
@pytest.mark.parametrize("apart", [False, True])
def test_a_cube_with_flat_faces_stays_a_cube(apart: bool, kind: str) -> None:
    mesh = cube()
    mesh = mesh.with_(corner_normals=face_normals(mesh))
    mesh = soup(mesh) if apart else mesh
    side = 1 / 3**0.5
    dense = refined(mesh, 4, sharp_from="normals", cross_tangent=kind)
    assert np.abs(np.abs(dense.positions).max(axis=1) - side).max() < 1e-15
    check_sound(dense, closed=True)
    assert dense.source_faces is not None
    assert mesh.corner_normals is not None
    own = mesh.corner_normals[::4][dense.source_faces]
    assert np.abs(dense.normals[dense.face_wedges] - own[:, None]).max() < 1e-14


@each_tangent
@pytest.mark.parametrize("make", [icosahedron, dodecahedron, mixed_ball])
def test_flat_faces_stay_planar(make: object, kind: str) -> None:
    mesh = make()  # type: ignore[operator]
    normals = face_normals(mesh)
    flat = mesh.with_(corner_normals=normals)
    dense = refined(flat, 3, sharp_from="normals", cross_tangent=kind)
    assert dense.source_faces is not None
    first = mesh.face_offsets[:-1][dense.source_faces]
    offsets = dense.positions[dense.faces] - mesh.positions[mesh.face_vertices[first]][:, None]
    if make is not mixed_ball:  # pieces of a hexagon share a plane, so their common edge is smooth
        assert np.abs((offsets * normals[first][:, None]).sum(axis=2)).max() < 1e-14
    check_sound(dense, closed=True)


@each_tangent
def test_a_cylinder_with_caps_has_planar_caps_and_a_round_rim(kind: str) -> None:
    """The circle length makes the rim round to 4e-7, the paper's chord length to 1.3e-3."""
    mesh = capped_cylinder()
    level = 4
    dense = refined(mesh, level, cross_tangent=kind)
    caps = dense.faces[-2 * 12 * level**2 :]
    for cap, height in zip(np.split(caps, 2), (0.0, 1.0), strict=True):
        assert np.abs(dense.positions[cap, 2] - height).max() < 1e-14
    rim = mesh.vertex_count + np.arange(36 * (2 * level - 1))
    rim = rim[np.abs(dense.positions[rim, 2] - 0.5) > 0.4999]
    radius = np.hypot(dense.positions[rim, 0], dense.positions[rim, 1])
    assert np.abs(radius - 1).max() < (1e-5 if kind in ("precise", "smooth") else 2e-3)
    check_sound(dense, closed=True)


def test_a_cylinder_with_caps_repeats_its_rims_with_a_normal_for_each_side() -> None:
    mesh = capped_cylinder()
    level = 3
    dense = refined(mesh, level)
    assert len(dense.repeats) == 2 * 12 * 2 * level
    assert dense.source_faces is not None
    cap = dense.source_faces >= 12
    on_cap = dense.normals[dense.face_wedges[cap]]
    up = np.where(dense.source_faces[cap] == 12, -1.0, 1.0)
    assert np.abs(on_cap - np.stack([0 * up, 0 * up, up], axis=1)[:, None]).max() < 1e-12
    on_side = dense.normals[dense.face_wedges[~cap]]
    places = dense.positions[dense.faces[~cap]] * [1, 1, 0]
    assert np.abs(on_side[..., 2]).max() < 1e-12
    assert degrees(on_side, unit(places)).max() < 0.1


def test_flat_shaded_normals_are_ignored_with_a_warning() -> None:
    mesh = dodecahedron()
    flat = curvify.surface(mesh.with_(corner_normals=face_normals(mesh)))
    assert any("--sharp-from normals" in text for text in flat.warnings)
    assert np.array_equal(flat.refine(2).positions, refined(mesh, 2).positions)


def test_smooth_normals_are_kept_without_a_warning() -> None:
    mesh = dodecahedron()
    tilted = unit(mesh.positions + np.array([0.2, 0.1, -0.1]))
    surface = curvify.surface(mesh.with_(corner_normals=tilted[mesh.face_vertices]))
    assert surface.warnings == []
    assert np.abs(surface.refine(1).normals[:20] - tilted).max() < 1e-14


def test_without_sharp_sources_split_normals_are_averaged() -> None:
    dense = refined(capped_cylinder(), 2, sharp_from="none")
    assert not len(dense.repeats)
    assert np.abs(dense.normals[0] - unit([2.0, 0, -1])).max() < 1e-12


@pytest.mark.parametrize(("angle", "sharp"), [(0.05, False), (0.2, True)])
def test_normals_within_a_tenth_of_a_degree_are_one(angle: float, sharp: bool) -> None:
    mesh = on_sphere(cube())
    assert mesh.corner_normals is not None
    turn = np.radians(angle)
    spin = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    normals = mesh.corner_normals.copy()
    normals[:4] = normals[:4] @ spin.T
    assert bool(len(refined(mesh.with_(corner_normals=normals), 2).repeats)) == sharp


def test_corners_without_a_normal_get_a_computed_one_with_a_warning() -> None:
    mesh = on_sphere(icosahedron())
    assert mesh.corner_normals is not None
    for missing in (np.nan, 0.0, np.inf):
        normals = mesh.corner_normals.copy()
        normals[mesh.face_vertices == 3] = missing
        surface = curvify.surface(mesh.with_(corner_normals=normals))
        assert any("5 corners without a normal" in text for text in surface.warnings)
        assert degrees(surface.refine(1).normals[3], unit(mesh.positions[3])) < 1e-6


def test_normals_that_are_all_missing_are_as_none() -> None:
    mesh = icosahedron()
    empty = mesh.with_(corner_normals=np.full((60, 3), np.nan))
    assert np.array_equal(refined(empty, 2).positions, refined(mesh, 2).positions)
