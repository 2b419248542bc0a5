"""The fast evaluation (tables and Chebyshev series) against the pointwise one, sample by sample."""

from __future__ import annotations

import numpy as np
import pytest

import curvify
from curvify import evaluate, series, tables
from curvify.jobs import SERIES_TOLERANCE
from curvify.mesh import PolygonMesh
from curvify.sampling import kite_sampling
from curvify.schemes.gregory_basis import gregory_basis
from curvify.weld import number_dense_mesh
from surfaces import (
    CROSS_TANGENTS,
    cube,
    degrees,
    diagonal,
    dodecahedron,
    icosahedron,
    mixed_ball,
    noisy,
    on_sphere,
    polygon_patch,
    torus,
    with_vertex_normals,
)


def worst(surface: curvify.Surface, level: int, kind: str) -> tuple[float, float]:
    """Largest distance over the diagonal and largest angle in degrees between the dense mesh and the pointwise
    evaluation, over all samples inside patches; ``kind`` is the output type whose tolerance serves.
    """
    with pytest.MonkeyPatch.context() as patched:
        patched.setitem(SERIES_TOLERANCE, "float64", SERIES_TOLERANCE[kind])
        dense = surface.refine(level)
    starts = number_dense_mesh(surface.patches, level).patch_starts
    size = diagonal(surface.patches.positions)
    gap = angle = 0.0
    for sides in np.unique(surface.sides).tolist():
        points = surface.patches.sampling(sides, level).points
        mine = np.flatnonzero(surface.sides == sides)
        stored = (starts[mine][:, None] + np.arange(len(points))).reshape(-1)
        position, normal = surface.evaluate(np.repeat(mine, len(points)), np.tile(points, (len(mine), 1)))
        gap = max(gap, float(np.linalg.norm(dense.positions[stored] - position, axis=1).max()) / size)
        angle = max(angle, float(degrees(dense.normals[stored], normal).max()))
    return gap, angle


def counts_of(surface: curvify.Surface, level: int, dtype: type, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of Chebyshev points that refining takes, table by table; 0 is the pointwise fallback."""
    counts = []
    blocks = tables.blocks

    def watched(form: object, points: object, grid: object, count: int, orders: int) -> object:
        counts.append(count)
        return blocks(form, points, grid, count, orders)  # type: ignore[arg-type]

    with monkeypatch.context() as patched:
        patched.setattr(tables, "blocks", watched)
        surface.refine(level, dtype, threads=1)
    return counts


MESHES = {
    "icosahedron": lambda: noisy(icosahedron(), 0.08),
    "cube": lambda: noisy(cube(), 0.08),
    "dodecahedron": lambda: noisy(dodecahedron(), 0.05),
    "mixed": lambda: noisy(mixed_ball(), 0.03),
    "torus": lambda: noisy(torus(), 0.03),
}


@pytest.mark.parametrize("kind", CROSS_TANGENTS)
@pytest.mark.parametrize("name", sorted(MESHES))
def test_the_fast_path_agrees_with_the_pointwise_one_on_noisy_meshes(name: str, kind: str) -> None:
    surface = curvify.surface(MESHES[name](), cross_tangent=kind)
    gap, angle = worst(surface, 4, "float64")
    assert gap < 1e-12
    assert angle < 1e-6
    gap, angle = worst(surface, 3, "float32")
    assert gap < 1e-9
    assert angle < 1e-4


@pytest.mark.parametrize("kind", ["precise", "smooth"])
@pytest.mark.parametrize("sides", [*range(3, 13), 16, 17, 20, 64])
def test_the_fast_path_agrees_with_the_pointwise_one_for_every_number_of_sides(sides: int, kind: str) -> None:
    mesh, _, _ = polygon_patch(sides, seed=4, wobble=0.02)
    surface = curvify.surface(mesh, cross_tangent=kind, sharp_from="normals")
    for level, kind_of_output in ((1, "float64"), (3, "float64"), (4 if sides < 20 else 2, "float32")):
        gap, angle = worst(surface, level, kind_of_output)
        assert gap < (1e-12 if kind_of_output == "float64" else 1e-9)
        assert angle < (1e-6 if kind_of_output == "float64" else 1e-4)


def wild_mesh() -> PolygonMesh:
    """An icosahedron whose given normals turn so fast that no series of the cross tangents converges."""
    mesh = icosahedron()
    normals = mesh.positions + 0.9 * np.random.default_rng(2).standard_normal((12, 3))
    return with_vertex_normals(mesh, normals / np.linalg.norm(normals, axis=1)[:, None])


def test_patches_whose_series_does_not_converge_are_evaluated_at_every_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    surface = curvify.surface(wild_mesh(), sharp_from="normals")
    calls = []
    exact = evaluate.exact_values

    def counted(*arguments: object) -> object:
        calls.append(1)
        return exact(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(evaluate, "exact_values", counted)
    assert 0 in counts_of(surface, 5, np.float64, monkeypatch)
    assert calls
    gap, angle = worst(surface, 5, "float64")
    assert gap < 1e-12
    assert angle < 1e-6


@pytest.mark.parametrize(
    ("kind", "dtype"),
    [(kind, np.float32) for kind in CROSS_TANGENTS] + [("precise", np.float64), ("smooth", np.float64)],
)
def test_tame_patches_never_take_the_slow_path(kind: str, dtype: type, monkeypatch: pytest.MonkeyPatch) -> None:
    surface = curvify.surface(on_sphere(mixed_ball()), cross_tangent=kind)
    assert 0 not in counts_of(surface, 4, dtype, monkeypatch)


def test_every_number_of_chebyshev_points_serves_some_patch(monkeypatch: pytest.MonkeyPatch) -> None:
    found: set[int] = set()
    for amount in (0.0, 0.03, 0.1, 0.2):
        for kind in ("precise", "linear"):
            surface = curvify.surface(noisy(icosahedron(), amount, seed=6), cross_tangent=kind)
            for dtype in (np.float32, np.float64):
                found |= set(counts_of(surface, 4, dtype, monkeypatch))
    assert {16, 24, 32} <= found


def fields_with_poles(distances: list[float], count: int) -> np.ndarray:
    """Fields ``(3,f,1,m)`` with a pole at a distance from the middle of the side, patch by patch."""
    t = series.chebyshev_points(count)
    rows = np.array([1 / ((t - 0.5) ** 2 + distance**2) for distance in distances])
    return np.stack([rows, 0.3 * rows, np.zeros_like(rows)])[:, :, None]


@pytest.mark.parametrize("tolerance", [1e-9, 1e-12])
def test_the_rate_of_a_series_tells_how_many_points_it_needs(tolerance: float) -> None:
    distances = [5.0, 1.5, 0.8, 0.4]
    told = series.points_needed(fields_with_poles(distances, 12), tolerance)
    for distance, count in zip(distances, told.tolist(), strict=True):
        least = next(m for m in range(12, 99) if series.points_needed(fields_with_poles([distance], m), tolerance) <= m)
        assert abs(count - least) <= max(0.2 * least, 1)
        t = np.linspace(0, 1, 200)
        field = fields_with_poles([distance], least)[0, 0, 0]
        gap = tables.lagrange(least, t)[0] @ field - 1 / ((t - 0.5) ** 2 + distance**2)
        assert np.abs(gap).max() < tolerance * np.abs(field).max()
    assert told[0] == 12
    assert told[-1] > 24


def test_fields_that_are_no_numbers_get_no_points() -> None:
    fields = fields_with_poles([2.0, 2.0], 12)
    fields[:, 1] = np.nan
    assert series.points_needed(fields, 1e-9)[1] > 12


@pytest.mark.parametrize("sides", [3, 5, 8, 12])
def test_tables_of_points_that_are_turns_of_the_first_are_turned(sides: int) -> None:
    points = kite_sampling(sides, 4).points
    turned = gregory_basis(sides, points, corrected=True)
    single = [gregory_basis(sides, place[None], corrected=True) for place in points]
    for name in ("linear", "weights", "abscissae", "ends"):
        expected = np.concatenate([getattr(basis, name) for basis in single], axis=1)
        np.testing.assert_allclose(getattr(turned, name), expected, rtol=0, atol=2e-13)


@pytest.mark.parametrize("count", series.NODE_COUNTS)
def test_lagrange_polynomials_carry_polynomials_and_their_slopes(count: int) -> None:
    nodes = series.chebyshev_points(count)
    t = np.concatenate([np.linspace(0, 1, 23), nodes])
    values, slopes = tables.lagrange(count, t)
    for power in (0, 1, 2, 5, 7):
        assert np.abs(values @ nodes**power - t**power).max() < 1e-13
        assert np.abs(slopes @ nodes**power - power * t ** max(power - 1, 0)).max() < 1e-10


def test_more_than_one_block_of_samples_gives_the_same_as_one(monkeypatch: pytest.MonkeyPatch) -> None:
    surface = curvify.surface(on_sphere(dodecahedron()))
    whole = surface.refine(12)
    monkeypatch.setattr(tables, "SAMPLES", 100)
    monkeypatch.setattr(tables, "_CACHE", tables._TableCache(1 << 24))
    parts = surface.refine(12)
    assert np.abs(whole.positions - parts.positions).max() < 1e-14
    assert np.array_equal(whole.faces, parts.faces)


def test_points_outside_the_domain_or_patches_that_are_not_there_are_refused() -> None:
    surface = curvify.surface(cube())
    with pytest.raises(curvify.OptionError, match="outside the domain"):
        surface.evaluate(np.array([0]), np.array([[0.0, 0.8]]))
    with pytest.raises(curvify.OptionError, match="outside the domain"):
        surface.evaluate(np.array([0]), np.array([[0.0, np.nan]]))
    with pytest.raises(curvify.OptionError, match="numbered 0 to 5"):
        surface.evaluate(np.array([6]), np.zeros((1, 2)))
