"""The surface depends on the shape alone: not on place, size, order of faces, first corners, ids, runs or threads."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import curvify
from curvify.mesh import DenseMesh, Ints, PolygonMesh
from curvify.sinks import ArraySink, DenseLayout
from surfaces import (
    CROSS_TANGENTS,
    Array,
    diagonal,
    inside_points,
    mixed_ball,
    noisy,
    refined,
    rotation,
    torus,
    vase,
    with_vertex_normals,
)

each_tangent = pytest.mark.parametrize("kind", CROSS_TANGENTS)
MESHES = {
    "mixed": lambda: noisy(mixed_ball(), 0.02),
    "torus": lambda: noisy(torus(7, 5), 0.03),
    "vase": lambda: noisy(vase(7), 0.02),
}


def moved(mesh: PolygonMesh, turn: Array, shift: Array, scale: float) -> PolygonMesh:
    return mesh.with_(positions=scale * (mesh.positions @ turn.T) + shift)


@each_tangent
@pytest.mark.parametrize("name", MESHES)
def test_turning_and_shifting_a_mesh_turns_and_shifts_its_surface(name: str, kind: str) -> None:
    mesh, turn, shift = MESHES[name](), rotation(), np.array([0.3, -0.8, 0.5])
    plain = refined(mesh, 3, cross_tangent=kind)
    turned = refined(moved(mesh, turn, shift, 1.0), 3, cross_tangent=kind)
    assert np.array_equal(plain.faces, turned.faces)
    assert np.abs(turned.positions - plain.positions @ turn.T - shift).max() < 1e-12
    assert np.abs(turned.normals - plain.normals @ turn.T).max() < 1e-11


@pytest.mark.parametrize("scale", [1e-6, 1e6])
@pytest.mark.parametrize("given", [False, True])
@each_tangent
def test_scaling_a_mesh_scales_its_surface(kind: str, given: bool, scale: float) -> None:
    mesh = MESHES["mixed"]()
    if given:
        mesh = with_vertex_normals(mesh, mesh.positions)
    plain = refined(mesh, 2, cross_tangent=kind)
    scaled = refined(moved(mesh, np.eye(3), np.zeros(3), scale), 2, cross_tangent=kind)
    assert np.array_equal(plain.faces, scaled.faces)
    assert np.abs(scaled.positions / scale - plain.positions).max() < 1e-12
    assert np.abs(scaled.normals - plain.normals).max() < 1e-11


def at_places(surface: curvify.Surface, faces: Ints, turns: Ints) -> tuple[Array, Array]:
    """Values at the same points of each face ``faces (f,)``, whose loops were turned by ``turns (f,)`` corners."""
    places = []
    for face, turn in zip(faces.tolist(), turns.tolist(), strict=True):
        sides = int(surface.sides[face])
        angle = -2 * np.pi * turn / sides
        spin = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        places.append(inside_points(sides, 5, 21) @ spin.T)
    return surface.evaluate(np.repeat(faces, 5), np.concatenate(places))


@each_tangent
@pytest.mark.parametrize("name", MESHES)
def test_the_order_of_faces_corners_and_vertices_does_not_matter(name: str, kind: str) -> None:
    mesh = MESHES[name]()
    generator = np.random.default_rng(3)
    order = generator.permutation(mesh.face_count)
    turns = generator.integers(0, 3, mesh.face_count)
    names = generator.permutation(mesh.vertex_count)
    positions = np.empty_like(mesh.positions)
    positions[names] = mesh.positions
    loops = mesh.faces()
    faces = [[int(names[v]) for v in loops[f][t:] + loops[f][:t]] for f, t in zip(order, turns, strict=True)]
    other = curvify.surface(PolygonMesh.from_faces(positions, faces), cross_tangent=kind)
    surface = curvify.surface(mesh, cross_tangent=kind)
    plain = at_places(surface, order, np.zeros_like(turns))
    changed = at_places(other, np.arange(len(order)), turns)
    assert np.abs(plain[0] - changed[0]).max() < 1e-12
    assert np.abs(plain[1] - changed[1]).max() < 1e-11


def test_a_mirrored_mesh_has_a_mirrored_surface() -> None:
    mesh = MESHES["mixed"]()
    mirror = np.diag([1.0, 1.0, -1.0])
    faces = [[f[0], *f[:0:-1]] for f in mesh.faces()]
    other = curvify.surface(PolygonMesh.from_faces(mesh.positions @ mirror, faces))
    surface = curvify.surface(mesh)
    for face, sides in enumerate(surface.sides.tolist()):
        points = inside_points(sides, 5, 2)
        position, normal = surface.evaluate(np.full(5, face), points)
        there, seen = other.evaluate(np.full(5, face), points * [1, -1])
        assert np.abs(position @ mirror - there).max() < 1e-13
        assert np.abs(normal @ mirror - seen).max() < 1e-12


# --- the same bytes -----------------------------------------------------------------------------------------------


def arrays(dense: DenseMesh) -> dict[str, Any]:
    return {name: value for name, value in vars(dense).items() if isinstance(value, np.ndarray)}


def check_same_bytes(one: DenseMesh, other: DenseMesh) -> None:
    first, second = arrays(one), arrays(other)
    assert first.keys() == second.keys()
    for name, value in first.items():
        assert value.dtype == second[name].dtype
        assert value.tobytes() == second[name].tobytes(), f"{name} differs"


def colorful() -> PolygonMesh:
    mesh = noisy(mixed_ball(), 0.02)
    uvs = mesh.positions[mesh.face_vertices, :2] + 0.1 * (np.arange(mesh.corner_count) % 3)[:, None]
    return mesh.with_(corner_uvs=uvs, vertex_colors=np.abs(mesh.positions))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("threads", [2, 3])
def test_any_number_of_threads_gives_the_same_bytes(
    monkeypatch: pytest.MonkeyPatch, threads: int, dtype: type
) -> None:
    monkeypatch.setattr("curvify.jobs.WINDOW", 2500)
    surface = curvify.surface(colorful())
    check_same_bytes(surface.refine(4, dtype, threads=1), surface.refine(4, dtype, threads=threads))


def test_a_second_run_gives_the_same_bytes() -> None:
    check_same_bytes(refined(colorful(), 4, np.float32), refined(colorful(), 4, np.float32))


class InOrder(ArraySink):
    """A sink that insists on blocks in the order of the file."""

    anywhere = False

    def begin(self, layout: DenseLayout) -> None:
        super().begin(layout)
        self.next_vertex = self.next_face = 0

    def vertices(self, start: int, records: np.ndarray[Any, Any]) -> None:
        assert start == self.next_vertex
        self.next_vertex += len(records)
        super().vertices(start, records)

    def faces(self, start: int, wedges: Ints, source_faces: Ints) -> None:
        assert self.next_vertex == self.layout.wedge_count
        assert start == self.next_face
        self.next_face += len(wedges)
        super().faces(start, wedges, source_faces)

    def end(self) -> None:
        assert self.next_face == self.layout.face_count


@pytest.mark.parametrize("threads", [1, 3])
def test_an_ordered_sink_gets_every_block_in_order(monkeypatch: pytest.MonkeyPatch, threads: int) -> None:
    monkeypatch.setattr("curvify.jobs.WINDOW", 2500)
    surface = curvify.surface(colorful())
    sink = InOrder()
    surface.stream(sink, 3, threads=threads)
    dense = surface.refine(3)
    dense.source_patches = dense.source_parameters = None  # not the sink's to know
    check_same_bytes(sink.dense_mesh(), dense)


def test_the_windows_of_the_jobs_change_no_more_than_rounding(monkeypatch: pytest.MonkeyPatch) -> None:
    surface = curvify.surface(colorful())
    whole = surface.refine(3)
    monkeypatch.setattr("curvify.jobs.WINDOW", 1500)
    parts = surface.refine(3)
    assert np.array_equal(whole.face_wedges, parts.face_wedges)
    assert np.abs(whole.positions - parts.positions).max() < 1e-14 * diagonal(whole.positions)


def test_progress_runs_to_the_end_and_an_error_in_a_sink_comes_out() -> None:
    surface = curvify.surface(torus())
    told: list[tuple[int, int]] = []
    surface.refine(3, threads=2, progress=lambda done, of: told.append((done, of)))
    assert told[-1][0] == told[-1][1]
    assert [done for done, _ in told] == sorted(done for done, _ in told)

    class Full(ArraySink):
        def faces(self, start: int, wedges: Ints, source_faces: Ints) -> None:
            raise OSError("no room left")

    for threads in (1, 3):
        with pytest.raises(OSError, match="no room left"):
            surface.stream(Full(), 3, threads=threads)
