"""The GPU backend against the CPU's: the same surface within 1e-5 of the diagonal and 0.05 degrees, in practice far
closer, for all samples, polygon sizes, levels, places and sizes of a mesh.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import curvify
from agreement import ANGLE, POSITION, SAMPLES, check_close, creased, gaps
from curvify import evaluate
from curvify.jobs import dense_layout
from curvify.mesh import PolygonMesh
from curvify.sinks import ArraySink
from curvify.weld import number_dense_mesh
from surfaces import cube, mixed_ball, noisy, polygon_patch, prism, rotation, torus

ROOT = Path(__file__).parents[2]


@pytest.fixture
def left(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of patches that the GPU backend leaves to the CPU."""
    counts: list[int] = []
    on_cpu = evaluate.fill_patches

    def watched(patches, patch_class, rows, *rest):
        counts.append(len(rows))
        on_cpu(patches, patch_class, rows, *rest)

    monkeypatch.setattr(evaluate, "fill_patches", watched)
    return counts


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_samples(path, gpu):
    surface = curvify.surface(curvify.read(path))
    for level in (1, 2, 5):
        check_close(gaps(surface, level, gpu))


@pytest.mark.parametrize("sides", [*range(3, 13), 16, 17, 33, 64])
def test_polygons_are_evaluated_on_the_device(sides, gpu, left):
    surface = curvify.surface(prism(sides))
    assert sides in surface.sides
    for level in (1, 4) if sides < 20 else (2,):
        check_close(gaps(surface, level, gpu))
    assert left == []


@pytest.mark.parametrize("sides", range(3, 13))
def test_wild_polygons(sides, gpu):
    mesh, _, _ = polygon_patch(sides, seed=7)
    check_close(gaps(curvify.surface(mesh, sharp_from="normals"), 3, gpu))


@pytest.mark.parametrize("cross_tangent", ["smooth", "linear", "quadratic"])
@pytest.mark.parametrize("normals", ["exact", "paper"])
def test_other_cross_tangents_and_normals(cross_tangent, normals, gpu):
    check_close(gaps(curvify.surface(mixed_ball(), cross_tangent=cross_tangent, normals=normals), 3, gpu))


def test_rough_meshes_need_more_points(gpu):
    check_close(gaps(curvify.surface(noisy(torus(12, 8), 0.08)), 4, gpu), (POSITION, ANGLE))


@pytest.mark.parametrize("level", [3, 24])
def test_single_precision_output(level, gpu):
    check_close(gaps(curvify.surface(torus(12, 6)), level, gpu, np.float32))


@pytest.mark.parametrize(("size", "place"), [(1.0, 1e5), (1e-6, 0.0), (1e9, 0.0), (1e-3, 1e3), (1e18, 0.0), (1e-18, 0)])
def test_neither_size_nor_place_costs_digits(size, place, gpu, left):
    mesh = mixed_ball()
    corners = [face.tolist() for face in np.split(mesh.face_vertices, mesh.face_offsets[1:-1])]
    moved = PolygonMesh.from_faces(mesh.positions @ rotation() * size + place, corners)
    check_close(gaps(curvify.surface(moved), 3, gpu))
    assert left == []


def test_far_away_single_precision_output_rounds_once(gpu):
    mesh = cube()
    corners = [face.tolist() for face in np.split(mesh.face_vertices, mesh.face_offsets[1:-1])]
    surface = curvify.surface(PolygonMesh.from_faces(mesh.positions + 1e4, corners))
    wanted = surface.refine(4, np.float64).positions
    found = surface.refine(4, np.float32, backend=gpu).positions
    assert np.abs(found - wanted).max() <= 0.5 * np.spacing(np.float32(1e4)) * 1.001


@pytest.mark.parametrize("make", [mixed_ball, creased], ids=["polygons", "quads"])
def test_blending_surfaces_are_evaluated_on_the_device(make, gpu, left):
    surface = curvify.surface(make(), "blend", sharp_angle=80)
    for level in (1, 2, 5):
        check_close(gaps(surface, level, gpu))
    assert left == []


def test_creases_have_normals_for_each_side_and_one_curve(gpu):
    surface = curvify.surface(creased(), sharp_from="normals")
    check_close(gaps(surface, 3, gpu))
    layout = dense_layout(surface.patches, number_dense_mesh(surface.patches, 3), np.dtype("f4"))
    sink = ArraySink()
    surface.stream(sink, 3, np.float32, backend=gpu)
    positions = sink.records["position"]
    assert layout.repeats.size == 8 * 2 + 12 * 5
    assert np.array_equal(positions[layout.vertex_count :], positions[layout.repeats])


def test_flat_faces_are_left_to_the_cpu(gpu, left):
    line = PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], [[0, 1, 2, 3]])
    check_close(gaps(curvify.surface(line), 3, gpu))
    assert sum(left) == 1


def test_fields_that_no_series_describes_are_left_to_the_cpu(gpu, left):
    surface = curvify.surface(noisy(mixed_ball(), 0.3, seed=1))
    check_close(gaps(surface, 5, gpu), (POSITION, ANGLE))
    assert 1 <= sum(left) < len(surface.sides)


def test_the_same_bytes_each_time_and_for_any_number_of_threads(gpu):
    surface = curvify.surface(torus(24, 12))
    runs = [surface.refine(9, np.float32, threads=threads, backend=gpu) for threads in (1, 2, 3)]
    for run in runs[1:]:
        assert run.positions.tobytes() == runs[0].positions.tobytes()
        assert run.normals.tobytes() == runs[0].normals.tobytes()


def test_bytes_sent_are_counted_and_tables_are_sent_once(gpu):
    surface = curvify.surface(torus(8, 5))
    sent = []
    for _ in range(3):
        before = gpu.bytes_sent
        surface.refine(7, backend=gpu)
        sent.append(gpu.bytes_sent - before)
    assert sent[0] > sent[1] == sent[2] > 0


def test_a_surface_finds_the_backend_by_name(gpu):
    surface = curvify.surface(torus(8, 5))
    assert np.array_equal(surface.refine(3, backend="gpu").normals, surface.refine(3, backend=gpu).normals)


@pytest.mark.parametrize(("version", "every"), [("3.3", 1), ("4.1", 3)])
def test_devices_without_compute_shaders_use_transform_feedback(version, every, gpu):
    """In a process of its own: the version of a driver cannot be changed in this one."""
    if "Mesa" not in gpu.device.version:
        pytest.skip("only Mesa can be told to be an older version")
    code = f"""
import sys
sys.path.insert(0, {str(ROOT / "tests")!r})
import numpy as np
import curvify
from agreement import SCHEMES, check_close, creased, gaps
from curvify.backends import open_backend
from surfaces import mixed_ball, prism
with open_backend("gpu", 0) as gpu:
    assert not gpu.device.compute, gpu.describe()
    for mesh in (mixed_ball(), creased()):
        for scheme, options in SCHEMES[::{every}]:
            check_close(gaps(curvify.surface(mesh, scheme, sharp_angle=80, **options), 2, gpu))
    assert gpu.traffic()["patches"]["built_on_cpu"] == 0
    check_close(gaps(curvify.surface(mixed_ball(), "blend"), 2, gpu))
"""
    environment = os.environ | {"MESA_GL_VERSION_OVERRIDE": version}
    ended = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
