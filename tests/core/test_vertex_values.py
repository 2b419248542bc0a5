"""Values at vertices: coordinates, bends, and curvatures of surfaces whose curvature is known."""

from __future__ import annotations

import numpy as np
import pytest

from curvify import OptionError, PolygonMesh
from curvify.vertex_values import KINDS, bends, mean_curvatures, vertex_values
from surfaces import cube, flat_grid


def tube(radius: float, sides: int = 12) -> PolygonMesh:
    """An open cylinder in quads with its normals."""
    angles = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(sides)], axis=1)
    rings = [radius * ring + [0, 0, height] for height in (0.0, 0.4, 1.0)]
    faces = [
        [row * sides + k, row * sides + (k + 1) % sides, (row + 1) * sides + (k + 1) % sides, (row + 1) * sides + k]
        for row in range(2)
        for k in range(sides)
    ]
    mesh = PolygonMesh.from_faces(np.concatenate(rings), faces)
    return mesh.with_(corner_normals=ring[mesh.face_vertices % sides])


def test_a_coordinate_is_itself() -> None:
    mesh = cube()
    normals = np.zeros((mesh.corner_count, 3))
    for axis, kind in enumerate("xyz"):
        assert np.array_equal(vertex_values(mesh, kind, normals), mesh.positions[:, axis])


@pytest.mark.parametrize("radius", [0.5, 3.0])
def test_mean_curvature_of_a_cylinder(radius: float) -> None:
    mesh = tube(radius)
    assert mesh.corner_normals is not None
    assert mean_curvatures(mesh, mesh.corner_normals) == pytest.approx(1 / (2 * radius), rel=1e-6)
    assert mean_curvatures(mesh, -mesh.corner_normals) == pytest.approx(-1 / (2 * radius), rel=1e-6)


def test_mean_curvature_of_a_sphere() -> None:
    mesh = cube()
    positions = 2 * mesh.positions / np.linalg.norm(mesh.positions, axis=1, keepdims=True)
    mesh = mesh.with_(positions=positions)
    assert mean_curvatures(mesh, positions[mesh.face_vertices] / 2) == pytest.approx(0.5, rel=1e-6)


def test_creases_add_no_curvature() -> None:
    mesh = cube()
    own = np.repeat([[0, 0, -1], [0, 0, 1], [0, -1, 0], [0, 1, 0], [-1, 0, 0], [1, 0, 0]], 4, axis=0)
    assert np.abs(mean_curvatures(mesh, own.astype(float))).max() < 1e-12


def test_bends_of_a_cube_and_of_a_plane() -> None:
    assert bends(cube()) == pytest.approx(90.0)
    assert np.nanmax(bends(flat_grid(3, 3))) < 1e-6


def test_bends_across_seams_of_the_file() -> None:
    mesh = cube()
    soup = PolygonMesh.from_faces(mesh.positions[mesh.face_vertices], np.arange(24).reshape(6, 4).tolist())
    assert bends(soup) == pytest.approx(90.0)


def test_what_has_no_value() -> None:
    mesh = PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], [[0, 1, 2]])
    normals = np.tile([0.0, 0.0, 1.0], (3, 1))
    assert np.isnan(mean_curvatures(mesh, normals)).tolist() == [False, False, False, True]
    assert np.isnan(bends(mesh)).all()


def test_unknown_kinds_are_refused() -> None:
    mesh = cube()
    with pytest.raises(OptionError, match="values must be one of x, y"):
        vertex_values(mesh, "charm", np.zeros((24, 3)))
    assert all(vertex_values(mesh, kind, np.zeros((24, 3))).shape == (8,) for kind in KINDS)
