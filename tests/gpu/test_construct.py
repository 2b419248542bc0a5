"""Control vectors built on the device: the CPU's, vector by vector; and what goes up for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import curvify
from agreement import IDS, SAMPLES, SCHEMES, check_close, creased, gaps
from built import built_columns, built_edges
from curvify.formats.marks_json import read_marks
from curvify.gpu.evaluate import GpuBackend
from curvify.gpu.memory import Memory
from curvify.mesh import PolygonMesh
from curvify.schemes.base import BezierEdges, Form
from surfaces import cube, mixed_ball, noisy, prism, torus

FOLDER = Path(__file__).parents[2] / "sample_meshes"
MARKS = sorted(FOLDER.glob("*.json"))
#: How far control vectors may be off, over the longest of their patch.
VECTOR = 3e-6


def marked(path: Path) -> tuple[PolygonMesh, dict[str, object]]:
    """A sample mesh and its marks."""
    return curvify.read(FOLDER / f"{path.stem.split('-')[0]}.obj"), {"marks": read_marks(path)}


def forms_of(surface: curvify.Surface) -> list[tuple[Form, int]]:
    """The forms of a surface, each with its polygon size."""
    return [(form, each.sides) for each in surface.patches.classes for form in (each.surface, each.normals) if form]


def of_cpu(form: Form) -> np.ndarray:
    """Control vectors ``(f,L,3)`` of all patches of a form, points relative to the first corner."""
    assert form.device is not None
    vectors = form.controls(np.arange(len(form.device.corners))).linear.transpose(1, 2, 0).copy()
    vectors[:, : form.points] -= vectors[:, :1].copy() if form.points else 0
    return vectors


def check_columns(surface: curvify.Surface, gpu: GpuBackend) -> None:
    """All control vectors are the CPU's; nearly all patches have some."""
    missing = 0
    for form, size in forms_of(surface):
        found, wanted = built_columns(gpu, form, size).vectors, of_cpu(form)
        made = found.any(axis=(1, 2))
        longest = np.linalg.norm(wanted, axis=2).max(axis=1)
        off = np.linalg.norm(found - wanted, axis=2).max(axis=1)
        assert (off[made] <= VECTOR * longest[made]).all()
        missing += int((~made).sum())
    assert missing <= 0.1 * len(surface.sides)


def noisy_torus() -> PolygonMesh:
    """Quads of no particular shape."""
    return noisy(torus(8, 5), 0.05)


@pytest.mark.parametrize(("scheme", "options"), SCHEMES, ids=IDS)
@pytest.mark.parametrize("make", [mixed_ball, creased, noisy_torus], ids=["ball", "cube", "noisy"])
def test_control_vectors(scheme, options, make, gpu):
    surface = curvify.surface(make(), scheme, sharp_angle=80, **options)
    check_columns(surface, gpu)


@pytest.mark.parametrize("scheme", ["gregory", "png1"])
@pytest.mark.parametrize("path", MARKS, ids=lambda path: path.stem)
def test_control_vectors_at_marks(path, scheme, gpu):
    mesh, options = marked(path)
    surface = curvify.surface(mesh, scheme, **options)
    check_columns(surface, gpu)
    check_close(gaps(surface, 2, gpu))


@pytest.mark.parametrize("cross_tangent", ["smooth", "linear", "quadratic"])
@pytest.mark.parametrize("sides", [3, 7, 17, 64])
def test_control_vectors_of_polygons(sides, cross_tangent, gpu):
    surface = curvify.surface(prism(sides), cross_tangent=cross_tangent)
    check_columns(surface, gpu)
    check_close(gaps(surface, 2, gpu))


@pytest.mark.parametrize(("scheme", "options"), SCHEMES, ids=IDS)
def test_all_samples(scheme, options, gpu):
    for path in SAMPLES:
        before = gpu.traffic()["patches"]
        surface = curvify.surface(curvify.read(path), scheme, sharp_angle=50, **options)
        check_close(gaps(surface, 2, gpu))
        after = gpu.traffic()["patches"]
        assert after["built_on_cpu"] == before["built_on_cpu"]
        assert after["evaluated_on_cpu"] - before["evaluated_on_cpu"] <= 0.05 * len(surface.sides)


@pytest.mark.parametrize("cross_tangent", ["precise", "smooth"])
def test_blended_cross_tangents(cross_tangent, gpu):
    surface = curvify.surface(mixed_ball(), cross_tangent=cross_tangent)
    for form, size in forms_of(surface):
        found = built_columns(gpu, form, size)
        tangent = form.controls(np.arange(len(found.vectors))).tangent
        length = np.linalg.norm(tangent.sides.start, axis=0).max()
        for texel, wanted in ((3, tangent.sides.start), (4, tangent.sides.end)):
            assert np.abs(found.scale * found.sides[..., texel, :3] - np.moveaxis(wanted, 0, -1)).max() < 1e-6 * length
        assert np.abs(found.sides[..., 3, 3] - tangent.gains).max() < 1e-5


@pytest.mark.parametrize("cross_tangent", ["linear", "quadratic"])
def test_paper_cross_tangents(cross_tangent, gpu):
    surface = curvify.surface(mixed_ball(), cross_tangent=cross_tangent)
    for form, size in forms_of(surface):
        found = built_columns(gpu, form, size)
        tangent = form.controls(np.arange(len(found.vectors))).tangent
        length = np.linalg.norm(tangent.sides.start, axis=0).max()
        for texel, wanted in zip((9, 10), tangent.corrections, strict=True):
            assert np.abs(found.scale * found.sides[..., texel, :3] - np.moveaxis(wanted, 0, -1)).max() < 2e-6 * length


@pytest.mark.parametrize("scheme", ["gregory", "pn", "phong", "png1"])
def test_edges(scheme, gpu):
    surface = curvify.surface(creased(), scheme, sharp_from="normals")
    edges = surface.patches.edges
    assert isinstance(edges, BezierEdges)
    assert edges.construction is not None
    curves, fields = built_edges(gpu, edges.construction)
    wanted = (edges.curves - edges.curves[..., :1]).transpose(1, 2, 0)
    count = wanted.shape[1]
    assert np.abs(curves[: len(wanted), :count] - wanted).max() < 3e-7
    if scheme == "gregory":  # up to the length of the field
        fields *= (np.linalg.norm(wanted[:, -1], axis=1) ** 2)[surface.topology.edge[0]]
    if scheme != "png1":
        lines = edges.fields.transpose(1, 2, 0)
        assert np.abs(fields[:, : lines.shape[1]] - lines).max() < 1e-6


def sharp_sides(surface: curvify.Surface) -> int:
    """Half-edges of the patches that a sharp feature touches: at an edge that is open or has two normals at an end."""
    topology, normals = surface.topology, surface.patches.normals
    twins = topology.twin
    here = np.stack([normals, normals[topology.next]], axis=1)
    apart = (twins < 0) | (here != here[twins][:, ::-1]).any(axis=(1, 2))
    touched = np.zeros(topology.vertex_count, dtype=bool)
    touched[topology.vertices[apart]] = touched[topology.vertices[topology.next[apart]]] = True
    return int((touched[topology.vertices] | touched[topology.vertices[topology.next]]).sum())


@pytest.mark.parametrize("scheme", ["gregory", "pn", "phong", "png1"])
@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_vectors_that_go_up(path, scheme, gpu):
    """At most 12 bytes for each vertex and each normal at it, and 4 vectors for each side at a sharp feature."""
    for angle in (None, 50):
        surface = curvify.surface(curvify.read(path), scheme, sharp_angle=angle)
        patches, before = surface.patches, gpu.traffic()
        surface.refine(3, np.float32, backend=gpu)
        sent = {kind: number - before["sent"][kind] for kind, number in gpu.traffic()["sent"].items()}
        at_vertices = np.column_stack([patches.topology.vertices, patches.normals])
        plain = 12 * (len(patches.positions) + len(np.unique(at_vertices, axis=0)))
        assert sent["controls"] == 0
        assert sent["vectors"] <= plain + 12 * 4 * sharp_sides(surface)
        sides, corners = patches.edges.fields.shape[1], len(patches.topology.vertices)
        assert sent["indices"] <= 4 * (9 * sides + corners) + 16 * len(surface.sides) + 8 * sides


def test_smooth_meshes_send_positions_and_normals_only(gpu):
    surface = curvify.surface(torus(8, 5))
    before = gpu.traffic()
    surface.refine(3, backend=gpu)
    after = gpu.traffic()
    assert after["sent"]["vectors"] - before["sent"]["vectors"] == 24 * 40
    assert after["received"] > before["received"]
    assert after["patches"]["built_on_gpu"] - before["patches"]["built_on_gpu"] == 40


def test_in_pieces_as_at_once(gpu, monkeypatch):
    surface = curvify.surface(mixed_ball())
    wanted = surface.refine(6, np.float32, backend=gpu)
    monkeypatch.setattr("curvify.gpu.memory.MOST_RESULTS", 20_000)
    found = surface.refine(6, np.float32, backend=gpu)
    assert found.positions.tobytes() == wanted.positions.tobytes()
    assert found.normals.tobytes() == wanted.normals.tobytes()


@pytest.mark.parametrize("scheme", ["gregory", "png1"])
def test_without_room_for_the_edges_control_vectors_are_sent(scheme, gpu, monkeypatch):
    surface = curvify.surface(torus(24, 12), scheme)
    before = gpu.traffic()
    monkeypatch.setattr(Memory, "most_texels", 1000)
    check_close(gaps(surface, 3, gpu))
    after = gpu.traffic()
    assert after["sent"]["controls"] > before["sent"]["controls"]
    assert after["sent"]["vectors"] == before["sent"]["vectors"]
    assert after["patches"]["built_on_cpu"] - before["patches"]["built_on_cpu"] == len(surface.sides)


def test_meshes_in_turn(gpu):
    one, other = curvify.surface(cube()), curvify.surface(torus(8, 5), "png1")
    wanted = [surface.refine(3, np.float32, backend=gpu).positions for surface in (one, other)]
    for surface, positions in zip((one, other, one), (*wanted, wanted[0]), strict=True):
        assert np.array_equal(surface.refine(3, np.float32, backend=gpu).positions, positions)


def test_the_shortest_edges_are_left_to_the_cpu(gpu):
    """Beside a quad of size 1 one of a millionth: fixed point knows its edges to a few digits only."""
    mesh = cube()
    small = 1e-6 * mesh.positions + np.array([3.0, 0.0, 0.0])
    faces = [face.tolist() for face in np.split(mesh.face_vertices, mesh.face_offsets[1:-1])]
    both = PolygonMesh.from_faces(
        np.concatenate([mesh.positions, small]), [*faces, *([v + 8 for v in face] for face in faces)]
    )
    for scheme in ("gregory", "png1"):
        surface = curvify.surface(both, scheme)
        before = gpu.traffic()["patches"]["evaluated_on_cpu"]
        check_close(gaps(surface, 3, gpu))
        assert gpu.traffic()["patches"]["evaluated_on_cpu"] - before == len(surface.sides) // 2


def test_colors_and_texture_coordinates_stand_between_positions(gpu):
    mesh = cube()
    mesh.vertex_colors = np.linspace(0, 1, 24).reshape(8, 3)
    surface = curvify.surface(mesh)
    check_close(gaps(surface, 3, gpu, np.float32), (1e-6, 2e-3))
