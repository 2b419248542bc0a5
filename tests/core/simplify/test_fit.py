"""Fitting: patches taken apart are those of refine, known surfaces come back, residuals fall, features stay."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

import curvify
import dense_meshes
from curvify.errors import MeshError, OptionError
from curvify.formats.marks_json import read_marks
from curvify.mesh import PolygonMesh
from curvify.nearest import Nearest
from curvify.prepare import prepare_mesh
from curvify.records import replaced
from curvify.sampling import kite_sampling
from curvify.schemes.cross_tangents import start_share
from curvify.schemes.folds import blended_inward
from curvify.schemes.gregory import Options as Refining
from curvify.schemes.gregory import patchwork_of
from curvify.simplify import Fit, Options, fit_mesh, simplify, simplify_and_fit
from curvify.simplify.accuracy import accuracy, flat_triangles
from curvify.simplify.adapt import add_where_worst, face_errors, halved
from curvify.simplify.apart import turn_sines
from curvify.simplify.checks import differences
from curvify.simplify.folds import folded_corners
from curvify.simplify.linear import linearized
from curvify.simplify.model import Model, State, build_model
from curvify.simplify.residuals import Target, Weights, residuals
from curvify.simplify.slots import Unknowns, derivatives
from curvify.simplify.solver import limited, solve
from curvify.simplify.triangles import Triangles, prepare_triangles
from curvify.topology import build_topology

SAMPLES = Path(__file__).parents[3] / "sample_meshes"
#: Smooth and closed; open; all kinds of polygons; creases and corners.
MESHES = ["pawn", "vase", "mixed", "knob-hard", "pawn-sharp"]


def sample(name: str) -> PolygonMesh:
    """A sample mesh, with the marks of the file of that name, if there is one."""
    mesh = curvify.read(SAMPLES / f"{name.split('-')[0]}.obj")
    marks = SAMPLES / f"{name}.json"
    return mesh.with_(marks=read_marks(str(marks))) if marks.exists() else mesh


def model_of(name: str, kind: str = "precise") -> Model:
    return build_model(sample(name), Refining(cross_tangent=kind))


def triangles_of(mesh: PolygonMesh, level: int) -> Triangles:
    """The refinement of a mesh as a dense mesh to fit to."""
    dense = curvify.refine(mesh, level=level)
    quads = PolygonMesh(dense.positions, 4 * np.arange(len(dense.faces) + 1), dense.faces.reshape(-1))
    return prepare_triangles(quads)[0]


def shaken(model: Model, tilt: float, move: float) -> State:
    """The start of a model with all that may change changed at random."""
    random = np.random.default_rng(1)
    tilts = tilt * random.standard_normal((len(model.start.normals), 2)) * model.free_sectors[:, None]
    moves = move * model.edge_length * random.standard_normal(model.start.positions.shape)
    return model.start.moved(moves * model.free_vertices[:, None], tilts)


def everything(model: Model) -> Unknowns:
    return Unknowns.of(model.free_vertices, model.free_sectors)


@pytest.mark.parametrize("kind", ["precise", "smooth"])
@pytest.mark.parametrize("name", MESHES)
def test_samples_are_those_of_refine(name, kind):
    model = model_of(name, kind)
    state = shaken(model, 0.02, 0.01)
    samples = model.at(state).samples(state)
    surface = curvify.surface(model.mesh(state), cross_tangent=kind)
    whole = np.bincount(surface.source_faces, minlength=model.face_count) == 1
    patch = np.searchsorted(surface.source_faces, np.arange(model.face_count))
    assert whole.mean() > 0.9
    for group in model.groups:
        points = kite_sampling(group.apart.sides, 2).points
        rows = np.flatnonzero(whole[group.apart.faces])
        ids = np.repeat(patch[group.apart.faces[rows]], len(points))
        positions, normals = surface.evaluate(ids, np.tile(points, (len(rows), 1)))
        for found, expected in ((samples.points, positions), (samples.normals, normals)):
            inner = found[group.rows].reshape(-1, group.sample_count, 3)[rows, -len(points) :]
            assert inner.reshape(-1, 3) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("name", MESHES)
def test_samples_on_sides_are_shared_by_neighbors(name):
    model = model_of(name)
    points = model.samples(model.start).points
    dense = curvify.refine(model.mesh(model.start), level=2)
    corner_and_side = np.concatenate(
        [points[g.rows].reshape(-1, g.sample_count, 3)[:, : 4 * g.apart.sides].reshape(-1, 3) for g in model.groups]
    )
    distance = np.linalg.norm(corner_and_side[:, None] - dense.positions[None], axis=2).min(axis=1)
    assert distance.max() < 1e-12


@pytest.mark.parametrize("name", ["pawn", "l_part", "knob-hard"])
def test_derivatives_agree_with_central_differences(name):
    model = model_of(name)
    state, unknowns = shaken(model, 0.02, 0.01), everything(model)
    step = np.random.default_rng(2).standard_normal(unknowns.count)

    def along(size: float) -> State:
        moves, tilts = np.zeros_like(state.positions), np.zeros((len(state.normals), 2))
        moves[model.free_vertices] = size * step[: unknowns.moves].reshape(-1, 3)
        tilts[model.free_sectors] = size * step[unknowns.moves :].reshape(-1, 2)
        return state.moved(moves, tilts)

    ahead, behind = (model.samples(along(size)) for size in (1e-5, -1e-5))
    for group in model.groups:
        by = derivatives(model, group, state, unknowns)
        if by is None:
            continue
        steps = np.where(by.unknowns >= 0, step[by.unknowns], 0.0)
        expected = ((ahead.points - behind.points) / 2e-5)[group.rows].reshape(by.points.shape[:3])
        assert np.einsum("fmik,fk->fmi", by.points, steps) == pytest.approx(expected, abs=1e-4)
        opening = ((ahead.openings.sines - behind.openings.sines) / 2e-5)[group.apart.corners]
        assert np.einsum("fnck,fk->fnc", by.sines, steps) == pytest.approx(opening, abs=1e-3)


def test_openings_tell_what_refine_would_cut():
    """Triangles are never cut, so that the test of `refine` can be asked about all sides of a mesh of them."""
    points, triangles = flat_triangles(sample("pawn"))
    mesh = PolygonMesh(points, np.arange(0, 3 * len(triangles) + 1, 3), triangles.reshape(-1))
    model = build_model(mesh, Refining())
    random = np.random.default_rng(3)
    tilts = 0.5 * random.standard_normal((len(model.start.normals), 2))
    state = model.start.moved(0.1 * model.edge_length * random.standard_normal(points.shape), tilts)
    work = patchwork_of(prepare_mesh(model.mesh(state)), Refining())
    inward = blended_inward(partial(start_share, "precise"), work)
    corner, side, turn = model.openings(state).sines.T
    assert corner == pytest.approx(work.sines, abs=1e-9)
    assert np.array_equal(side <= 0, inward <= 0)
    assert 10 < (side <= 0).sum() < len(side) / 2
    assert (turn > 0).all()


def test_corners_turn_by_their_angles():
    square = [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    dart = [[0.0, 0, 0], [2, 0, 0], [0.5, 0.5, 0], [0, 2, 0]]
    sines = turn_sines(np.array([square, dart]))
    assert sines[0] == pytest.approx(1)
    assert sines[1] == pytest.approx([1, np.sin(np.arctan(1 / 3)), -0.8, np.sin(np.arctan(1 / 3))])


def test_the_linear_model_predicts_small_steps():
    model = model_of("torus")
    target = Target.of(triangles_of(sample("torus"), 4), 2000)
    state, unknowns, weights = shaken(model, 0.05, 0.01), everything(model), Weights.of(model, target)
    found = residuals(model, target, weights, model.samples(state))
    linear = linearized(model, state, found, unknowns)
    step = linear.step(np.full(unknowns.count, 1e6))
    moved = state.moved(step[: unknowns.moves].reshape(-1, 3), step[unknowns.moves :].reshape(-1, 2))
    later = residuals(model, target, weights, model.samples(moved))
    assert found.total - later.total == pytest.approx(linear.gain(step), rel=0.1)
    assert found.by_face(model).sum() == pytest.approx(found.total)


@pytest.mark.parametrize("name", ["torus", "l_part"])
def test_a_known_surface_comes_back(name):
    """The nearest points of the samples are vertices of the dense mesh, so nothing is left at the solution."""
    model = model_of(name)
    target = Target.of(triangles_of(model.mesh(model.start), 4), 0)
    start = replaced(model, start=shaken(model, 0.05, 0.01))
    solution = solve(start, target, everything(model), 12)
    assert solution.history[0] > 1e-3
    assert solution.history[-1] < 1e-9
    points = model.at(solution.state).samples(solution.state).points
    assert points == pytest.approx(model.samples(model.start).points, abs=1e-6 * target.dense.diagonal)


def test_tilting_normals_brings_them_back():
    model = model_of("pawn")
    target = Target.of(triangles_of(model.mesh(model.start), 4), 0)
    start = replaced(model, start=shaken(model, 0.05, 0.0))
    held = Unknowns.of(np.zeros_like(model.free_vertices), model.free_sectors)
    solution = solve(start, target, held, 12)
    assert solution.state.normals == pytest.approx(model.start.normals, abs=1e-6)
    assert np.array_equal(solution.state.positions, model.start.positions)


@pytest.fixture(scope="module")
def torus():
    return simplify(dense_meshes.torus(40, 20), Options(faces=40))


def test_fitting_brings_the_refinement_closer_and_never_away(torus):
    before = accuracy(torus.mesh, torus.original, 4000)["refined"]
    errors = [before.rms]
    for mode in ("normals", "full"):
        fitted = fit_mesh(torus.mesh, torus.original, Fit(mode))
        for part in fitted.history:
            assert part == sorted(part, reverse=True)
        assert fitted.mesh.faces() == torus.mesh.faces()
        errors.append(accuracy(fitted.mesh, torus.original, 4000)["refined"].rms)
    assert errors[1] < 0.7 * errors[0]
    assert errors[2] < 0.7 * errors[1]


def test_normals_alone_leave_vertices_where_they_are(torus):
    fitted = fit_mesh(torus.mesh, torus.original, Fit("normals")).mesh
    assert np.array_equal(fitted.positions, torus.mesh.positions)
    assert not np.array_equal(fitted.corner_normals, torus.mesh.corner_normals)
    assert np.linalg.norm(fitted.corner_normals, axis=1) == pytest.approx(1)
    assert fit_mesh(torus.mesh, torus.original, Fit("none")).mesh is torus.mesh


def test_vertices_added_lie_on_the_dense_mesh_where_only_normals_are_fitted(torus):
    fitted = fit_mesh(torus.mesh, torus.original, Fit("normals", budget=torus.mesh.face_count + 12)).mesh
    assert fitted.vertex_count > torus.mesh.vertex_count
    distance = Nearest.of(torus.original.positions, torus.original.vertices)(fitted.positions)[0]
    assert distance.max() < 1e-12


def test_the_same_meshes_give_the_same_fit(torus):
    one, other = (fit_mesh(torus.mesh, torus.original, Fit()).mesh for _ in range(2))
    assert np.array_equal(one.positions, other.positions)
    assert np.array_equal(one.corner_normals, other.corner_normals)


def test_few_corners_fold_after_a_fit():
    result = simplify_and_fit(dense_meshes.torus(40, 20), Options(faces=40), Fit())
    folds = folded_corners(result.mesh)
    assert folds.polygons(folds.flagged).sum() <= 1
    assert not folds.reversed.any()
    assert result.mesh.face_count == pytest.approx(40, abs=3)
    assert result.counts["faces"] == result.mesh.face_count
    assert differences(result.simplified.mesh, result.mesh) == []
    found = [accuracy(mesh, result.simplified.original, 4000) for mesh in (result.simplified.mesh, result.mesh)]
    assert found[1]["refined"].rms < 0.5 * found[0]["refined"].rms


def test_refine_need_not_cut_what_was_fitted():
    dense = curvify.refine(sample("vase"), level=3)
    quads = PolygonMesh(dense.positions, 4 * np.arange(len(dense.faces) + 1), dense.faces.reshape(-1))
    before = simplify(quads, Options(faces=40))
    pieces = [
        len(patchwork_of(prepare_mesh(mesh), Refining()).split.source_faces)
        for mesh in (before.mesh, fit_mesh(before.mesh, before.original, Fit()).mesh)
    ]
    assert pieces[0] > before.mesh.face_count
    assert pieces[1] == before.mesh.face_count


def capped_cylinder() -> PolygonMesh:
    """A cylinder with flat caps: its two rims are creases."""
    angle = 2 * np.pi * np.arange(48) / 48
    rings = [np.stack([np.cos(angle), np.sin(angle), 0 * angle + z], axis=1) for z in np.linspace(0, 2, 13)]
    points = np.concatenate([*rings, [[0, 0, 0], [0, 0, 2]]])
    i, j, last = np.arange(48), (np.arange(48) + 1) % 48, 12 * 48
    caps = [np.stack([j, i, 0 * i + last + 48], axis=1), np.stack([i + last, j + last, 0 * i + last + 49], axis=1)]
    walls = dense_meshes.grid(13, 48, wrap_columns=True)[:, ::-1]
    return dense_meshes.mesh_of(points, np.concatenate([walls, *caps]))


def test_creases_and_flat_faces_stay():
    dense = capped_cylinder()
    before = simplify(dense, Options(faces=20))
    after = fit_mesh(before.mesh, before.original, Fit()).mesh
    assert np.array_equal(after.marks.crease_edges, before.mesh.marks.crease_edges)
    z = after.positions[after.marks.crease_edges][:, :, 2]
    assert (z == z[:, :1]).all()
    assert set(np.unique(z)) == {0.0, 2.0}
    flat = before.mesh.marks.flat_faces
    assert len(flat) >= 2
    held = np.isin(before.mesh.corner_faces, flat)
    assert np.array_equal(after.corner_normals[held], before.mesh.corner_normals[held])
    errors = [accuracy(mesh, before.original, 4000)["refined"].rms for mesh in (before.mesh, after)]
    assert errors[1] < errors[0]


def test_a_box_has_nothing_to_fit():
    before = simplify(dense_meshes.boxes(np.ones((1, 2, 3), dtype=bool), 4), Options(faces=6))
    after = fit_mesh(before.mesh, before.original, Fit())
    assert np.array_equal(after.mesh.positions, before.mesh.positions)
    assert len(after.history[0]) == 1


def test_a_rim_is_pulled_to_the_rim_of_the_dense_mesh():
    before = simplify(dense_meshes.sheet(40), Options(faces=30))
    after = fit_mesh(before.mesh, before.original, Fit()).mesh
    topology = build_topology(after.positions, after.face_offsets, after.face_vertices)
    rim = after.positions[np.unique(topology.edges[topology.uses == 1])]
    assert np.abs(rim[:, :2] - np.clip(rim[:, :2], 0, 1)).max() < 0.02
    errors = [accuracy(mesh, before.original, 4000)["refined"] for mesh in (before.mesh, after)]
    assert errors[1].rms < 0.7 * errors[0].rms


def test_more_faces_are_spent_until_a_largest_error_holds():
    dense = dense_meshes.torus(32, 16)
    held = simplify_and_fit(dense, Options(faces=60), Fit(max_error=0.01))
    assert held.fitted.largest < 0.01
    largest = face_errors(held.mesh, held.simplified.original, Refining()).max()
    assert largest < 0.0101 * held.simplified.original.diagonal
    assert held.mesh.face_count <= 63
    short = simplify_and_fit(dense, Options(faces=20), Fit(max_error=1e-5))
    assert "not 0.001 %; more faces may" in short.warnings[-1]
    assert short.fitted.largest > 1e-5


def test_an_edge_cut_in_its_middle_leaves_the_surface_almost_as_it_was():
    model = model_of("knob-hard")
    mesh = model.mesh(model.start)
    topology = build_topology(mesh.positions, mesh.face_offsets, mesh.face_vertices)
    creases = {tuple(sorted(edge)) for edge in mesh.marks.crease_edges.tolist()}
    edges = [tuple(sorted(edge)) for edge in topology.edges[topology.edge].tolist()]
    chosen = next(i for i, edge in enumerate(edges) if edge in creases)
    finer = halved(mesh, topology, np.array([chosen]), Refining())
    assert finer.vertex_count == mesh.vertex_count + 1
    assert finer.corner_count == mesh.corner_count + 2
    assert len(finer.marks.crease_edges) == len(mesh.marks.crease_edges) + 1
    finer.validate()
    distance = accuracy(finer, triangles_of(mesh, 4), 3000)["refined"]
    assert distance.max < 0.01


def test_faces_are_added_where_the_errors_are(torus):
    errors = np.zeros(torus.mesh.face_count)
    errors[[3, 20]] = 1.0
    more = add_where_worst(torus.mesh, errors, 0.5, 4, Refining())
    assert torus.mesh.face_count < more.face_count <= torus.mesh.face_count + 4
    assert differences(torus.mesh, more) == []
    assert add_where_worst(torus.mesh, errors, 0.5, 1, Refining()) is torus.mesh
    assert add_where_worst(torus.mesh, errors, 2.0, 9, Refining()) is torus.mesh


def test_steps_are_cut_to_what_is_allowed():
    vectors = np.array([[3.0, 4.0], [0.0, 0.0], [0.3, 0.4]])
    assert limited(vectors, np.ones(3)) == pytest.approx(np.array([[0.6, 0.8], [0.0, 0.0], [0.3, 0.4]]))


def test_meshes_and_options_that_cannot_be_fitted_are_refused():
    fin = PolygonMesh.from_faces(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], [[0, 1, 2], [1, 0, 3], [0, 1, 4]]
    )
    with pytest.raises(MeshError, match="more than two faces"):
        fit_mesh(fin, triangles_of(sample("torus"), 2), Fit())
    for wrong in ({"mode": "some"}, {"max_error": 0.0}, {"mode": "none", "max_error": 0.1}):
        with pytest.raises(OptionError):
            Fit(**wrong)
    with pytest.raises(OptionError, match="linear"):
        Fit(options=Refining(cross_tangent="linear"))
