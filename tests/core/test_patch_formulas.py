"""Patches against the equations written down plainly (tests/oracle.py), and derivatives against differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import curvify
from curvify import evaluate
from curvify.records import replaced
from curvify.schemes.gregory import center_point
from curvify.schemes.gregory_basis import gregory_basis
from oracle import Patch
from surfaces import (
    CROSS_TANGENTS,
    bezier,
    dodecahedron,
    domain_polygon,
    half_edge_polynomials,
    icosahedron,
    inside_points,
    mixed_ball,
    noisy,
    on_sphere,
    polygon_patch,
    side_points,
    torus,
    unit,
)

each_tangent = pytest.mark.parametrize("kind", CROSS_TANGENTS)
each_size = pytest.mark.parametrize("sides", range(3, 9))


def some_points(sides: int, seed: int) -> np.ndarray:
    """Points inside, the center, and points on a side away from its corners."""
    on_side = side_points(sides, sides - 1, [0.2, 0.65])
    return np.concatenate([inside_points(sides, 3, seed, 0.99), np.zeros((1, 2)), on_side])


@each_size
@each_tangent
def test_one_polygon_follows_the_equations(sides: int, kind: str) -> None:
    mesh, points, normals = polygon_patch(sides, seed=1)
    surface = curvify.surface(mesh, cross_tangent=kind, sharp_from="normals")
    assert surface.sides.tolist() == [sides], "the polygon was meant to stay whole"
    oracle = Patch(points, normals, kind)
    places = some_points(sides, seed=1)
    got = evaluate.evaluate_at(surface.patches, np.zeros(len(places), dtype=int), places)
    position, normal = surface.evaluate(np.zeros(len(places), dtype=int), places)
    assert np.array_equal(position, got[0])
    for i, place in enumerate(places):
        value, by_xi, by_eta = oracle.jet(place)
        assert np.abs(got[0][i] - value).max() < 2e-13
        assert np.abs(got[1][i] - by_xi).max() < 2e-12
        assert np.abs(got[2][i] - by_eta).max() < 2e-12
        assert np.abs(normal[i] - unit(np.cross(by_xi, by_eta))).max() < 2e-12


@each_size
def test_precise_without_its_corrections_follows_the_equations(sides: int) -> None:
    mesh, points, normals = polygon_patch(sides, 2)
    surface = curvify.surface(mesh, cross_tangent="precise", sharp_from="normals")
    controls: Any = surface.patches.classes[0].surface.controls(np.array([0]))
    oracle = Patch(points, normals, "precise")
    places = some_points(sides, seed=1)
    basis = gregory_basis(sides, places, corrected=False)
    basis.weights = gregory_basis(sides, places, corrected=True).weights  # with s_n, which the fields are without
    plain = replaced(controls, linear=controls.linear[:, :, : basis.linear.shape[2]])
    got = evaluate.exact_values(plain, basis)[:, :, 0].transpose(0, 2, 1)
    for i, place in enumerate(places):
        assert np.abs(got[:, i] - oracle.jet(place, corrected=False)).max() < 2e-12


@each_size
def test_the_middle_of_a_precise_patch_is_its_center_point(sides: int) -> None:
    mesh, points, normals = polygon_patch(sides, 3)
    position, _ = curvify.surface(mesh, sharp_from="normals").evaluate(np.zeros(1, dtype=int), np.zeros((1, 2)))
    assert np.abs(position[0] - Patch(points, normals, "precise").center()).max() < 1e-14


@each_size
def test_center_points_follow_the_equations_for_wild_normals_too(sides: int) -> None:
    _, points, _ = polygon_patch(sides, 3)
    generator = np.random.default_rng(sides)
    for _ in range(20):
        normals = unit(generator.standard_normal((sides, 3)))
        found = center_point(points.T[:, None], normals.T[:, None], np.zeros(1))[:, 0]
        assert np.abs(found - Patch(points, normals, "precise").center()).max() < 1e-13


@each_tangent
@pytest.mark.parametrize("make", [icosahedron, dodecahedron, mixed_ball, torus])
def test_derivatives_agree_with_central_differences(make: Any, kind: str) -> None:
    surface = curvify.surface(noisy(make(), 0.03), cross_tangent=kind)
    generator = np.random.default_rng(8)
    ids = generator.integers(0, len(surface.sides), 40)
    places = np.array([inside_points(surface.sides[i], 1, 50 + j, 0.9)[0] for j, i in enumerate(ids)])
    _, *slopes = evaluate.evaluate_at(surface.patches, ids, places)
    step = 1e-5
    for axis, slope in enumerate(slopes):
        move = step * np.eye(2)[axis]
        ahead = evaluate.evaluate_at(surface.patches, ids, places + move)[0]
        behind = evaluate.evaluate_at(surface.patches, ids, places - move)[0]
        assert np.abs((ahead - behind) / (2 * step) - slope).max() < 1e-7


@each_tangent
@pytest.mark.parametrize("make", [icosahedron, dodecahedron, mixed_ball, torus])
def test_on_its_sides_a_patch_is_the_edge_curve_with_the_edge_normal(make: Any, kind: str) -> None:
    mesh = noisy(make(), 0.03)
    surface = curvify.surface(mesh, cross_tangent=kind)
    patches = surface.patches
    topology = patches.topology
    t = np.array([0.1, 0.35, 0.5, 0.8])
    corners = np.arange(len(topology.vertices))
    sides = corners - topology.offsets[topology.faces]
    places = [side_points(surface.sides[f], side, t) for f, side in zip(topology.faces, sides, strict=True)]
    position, normal = surface.evaluate(np.repeat(topology.faces, 4), np.concatenate(places))
    curves, fields = half_edge_polynomials(patches, corners)
    assert np.abs(position - bezier(curves, t).reshape(-1, 3)).max() < 1e-14
    assert np.abs(normal - unit(bezier(fields, t)).reshape(-1, 3)).max() < 1e-12


@each_tangent
def test_a_patch_passes_through_its_corners_with_their_normals(kind: str) -> None:
    mesh = on_sphere(mixed_ball())
    surface = curvify.surface(mesh, cross_tangent=kind)
    places = np.concatenate([domain_polygon(len(face)) for face in mesh.faces()])
    position, normal = surface.evaluate(mesh.corner_faces, places)
    assert np.abs(position - mesh.positions[mesh.face_vertices]).max() < 1e-14
    assert np.abs(normal - unit(mesh.positions)[mesh.face_vertices]).max() < 1e-12


def test_a_quadratic_surface_is_met_at_third_order_only_by_precise() -> None:
    """On z = x^2 - y^2 / 2 halving a triangle divides the error of ``precise`` by about 8, of ``smooth`` by 4."""
    rates = {}
    for kind in ("precise", "smooth"):
        errors = []
        for size in (0.2, 0.1):
            plane = size * np.array([[0.0, 0.0], [1.1, 0.2], [0.3, 0.9]]) + 0.4
            points = np.column_stack([plane, plane[:, 0] ** 2 - plane[:, 1] ** 2 / 2])
            normals = unit(np.column_stack([-2 * plane[:, 0], plane[:, 1], np.ones(3)]))
            mesh = curvify.PolygonMesh.from_faces(points, [[0, 1, 2]], corner_normals=normals)
            surface = curvify.surface(mesh, cross_tangent=kind, sharp_from="normals")
            p, _ = surface.evaluate(np.zeros(60, dtype=int), inside_points(3, 60))
            errors.append(np.abs(p[:, 2] - p[:, 0] ** 2 + p[:, 1] ** 2 / 2).max())
        rates[kind] = np.log2(errors[0] / errors[1])
    assert rates["precise"] > 2.8
    assert rates["smooth"] < 2.5
