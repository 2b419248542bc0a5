"""Blending surfaces on a device, by the paper's procedure: the CPU's surface for every chart, blend and sharp model,
coefficients sent once for each chart.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple
from unittest import mock

import numpy as np
import pytest

import curvify
from curvify import evaluate
from curvify.gpu.blend import ChartTexels, fold
from curvify.gpu.evaluate import GpuBackend
from curvify.gpu.programs import SHADERS
from curvify.mesh import Marks, PolygonMesh
from curvify.schemes import blend_basis
from curvify.schemes.blend_network import BlendEdges
from surfaces import cube, degrees, diagonal, flat_grid, mixed_ball, noisy, prism, rotation, torus

ROOT = Path(__file__).parents[2]
#: What single precision gives for well-shaped surfaces, and what is asked of all.
CLOSE, ASKED = (1e-6, 2e-3), (1e-5, 0.05)


class Gaps(NamedTuple):
    """Largest distance over the diagonal and largest angle between the dense meshes of the two backends; patches and
    calls for edges that the GPU's left to the CPU.
    """

    distance: float
    angle: float
    left: int


def gaps(surface: curvify.Surface, level: int, gpu: GpuBackend) -> Gaps:
    """Compare the backends."""
    wanted = surface.refine(level)
    left = []

    def watched(name: str, real):
        def call(*given):
            left.append(name)
            return real(*given)

        return call

    with (
        mock.patch.object(evaluate, "fill_patches", watched("patches", evaluate.fill_patches)),
        mock.patch.object(BlendEdges, "points", watched("edges", BlendEdges.points)),
        mock.patch.object(BlendEdges, "normals", watched("edges", BlendEdges.normals)),
    ):
        found = surface.refine(level, backend=gpu)
    assert np.array_equal(found.face_wedges, wanted.face_wedges)
    apart = np.linalg.norm(found.positions - wanted.positions, axis=1).max()
    angle = degrees(found.normals, wanted.normals).max()
    return Gaps(float(apart) / diagonal(surface.positions), float(angle), len(left))


def check_close(found: Gaps, most: tuple[float, float] = CLOSE) -> None:
    """Both gaps are small enough."""
    assert found.distance <= most[0]
    assert found.angle <= most[1]


@pytest.mark.parametrize("chart", ["auto", "conformal", "polar"])
@pytest.mark.parametrize("order", [3, 5])
@pytest.mark.parametrize("make", [mixed_ball, lambda: torus(8, 5), lambda: prism(9)], ids=["mixed", "quads", "prism"])
def test_smooth_surfaces(make, order, chart, gpu):
    surface = curvify.surface(make(), "blend", chart=chart, blend_order=order)
    for level in (1, 2, 5):
        found = gaps(surface, level, gpu)
        check_close(found)
        assert found.left == 0


@pytest.mark.parametrize("name", ["pawn", "torus"])
@pytest.mark.parametrize("corners", ["keep", "smooth"])
@pytest.mark.parametrize("angle", [25, 60])
def test_darts_creases_and_corners(name, corners, angle, gpu):
    mesh = curvify.read(ROOT / "sample_meshes" / f"{name}.obj")
    surface = curvify.surface(mesh, "blend", sharp_angle=angle, boundary_corners=corners)
    check_close(gaps(surface, 3, gpu), ASKED)


def test_soft_creases_and_boundaries(gpu):
    mesh = flat_grid(4, 3)
    crease = np.array([[1, 6], [6, 11], [11, 16]])
    mesh = mesh.with_(
        positions=mesh.positions + np.sin(3 * mesh.positions[:, :1]) * [0, 0, 1],
        marks=Marks(crease_edges=crease, crease_sharpness=np.full((3, 2), 0.5)),
    )
    surface = curvify.surface(mesh, "blend")
    assert sum(kinds.get("crease", 0) for kinds in surface.marks.values()) == 3
    found = gaps(surface, 4, gpu)
    check_close(found)
    assert found.left == 0


@pytest.mark.parametrize("model", ["paper", "paper-fixed"])
def test_what_has_no_derivative_is_left_to_the_cpu(model, gpu):
    """Between two feature vertices the paper's surface has no derivative across the edge."""
    surface = curvify.surface(cube(), "blend", sharp_angle=30, sharp_model=model)
    found = gaps(surface, 4, gpu)
    check_close(found, ASKED)
    assert found.left > 0


def test_sharp_edges_have_one_curve(gpu):
    surface = curvify.surface(cube(), "blend", sharp_angle=30)
    dense = surface.refine(4, backend=gpu)
    assert len(dense.repeats) > 0
    check_close(gaps(surface, 4, gpu))


@pytest.mark.parametrize(("size", "place"), [(1.0, 1e5), (1e-6, 0.0), (1e9, 0.0), (1e-3, 1e3), (1e18, 0.0), (1e-18, 0)])
def test_neither_size_nor_place_costs_digits(size, place, gpu):
    mesh = noisy(torus(7, 4), 0.02)
    moved = PolygonMesh.from_faces(
        mesh.positions @ rotation() * size + place, mesh.face_vertices.reshape(-1, 4).tolist()
    )
    found = gaps(curvify.surface(moved, "blend"), 3, gpu)
    check_close(found)
    assert found.left == 0


def test_charts_are_sent_once(gpu):
    """Nine texels of 16 bytes for a chart and 8 bytes for a corner of a quad; then 4 for each quad and edge."""
    surface = curvify.surface(torus(12, 8), "blend")
    faces = vertices = 96
    once, places = 9 * 16 * vertices + 8 * 4 * faces, 8 * (9**2 + 9)
    sent = []
    for _ in range(3):
        before = gpu.bytes_sent
        surface.refine(5, backend=gpu)
        sent.append(gpu.bytes_sent - before)
    assert sent[1] == sent[2] == 4 * faces + 4 * 2 * faces + places
    assert sent[0] == once + sent[1]


@pytest.mark.parametrize("scheme", ["blend", "gregory"])
@pytest.mark.parametrize("mode", ["clip", "drop"])
def test_trimming_keeps_the_same_cells(scheme, mode, gpu):
    surface = curvify.surface(mixed_ball(), scheme)
    mask = curvify.read_mask(ROOT / "sample_meshes" / "disc.png")
    wanted, found = (surface.trim(mask, 6, mode=mode, backend=backend) for backend in ("cpu", gpu))
    assert np.array_equal(found.face_offsets, wanted.face_offsets)
    assert np.array_equal(found.face_vertices, wanted.face_vertices)
    assert np.abs(found.positions - wanted.positions).max() < CLOSE[0]


def test_surfaces_take_turns_on_one_device(gpu):
    surfaces = [curvify.surface(make(), "blend", blend_order=order) for make in (cube, mixed_ball) for order in (3, 5)]
    first = [surface.refine(3, backend=gpu).positions for surface in surfaces]
    for surface, positions in zip(surfaces, first, strict=True):
        assert np.array_equal(surface.refine(3, backend=gpu).positions, positions)


def test_the_same_bytes_for_any_number_of_threads(gpu):
    surface = curvify.surface(torus(40, 24), "blend")
    runs = [surface.refine(9, np.float32, threads=threads, backend=gpu) for threads in (1, 3)]
    assert runs[0].positions.tobytes() == runs[1].positions.tobytes()
    assert runs[0].normals.tobytes() == runs[1].normals.tobytes()


def test_rows_are_folded_into_textures():
    rows = np.arange(14, dtype=np.float32).reshape(7, 2)
    image = fold(rows, 6, 2)
    assert image.shape == (3, 6, 1)
    assert np.array_equal(image.reshape(-1)[:14], rows.reshape(-1))
    assert not image.reshape(-1)[14:].any()


def test_what_single_precision_leaves_out_is_sent_too():
    mesh = cube()
    moved = PolygonMesh.from_faces(mesh.positions + 1e6 / 3, mesh.face_vertices.reshape(-1, 4).tolist())
    network = curvify.surface(moved, "blend").patches.classes[0].surface.network
    texels = ChartTexels.pack(network)
    two = (texels.coefficients[:, 0, :3].astype(float) + texels.coefficients[:, :3, 3]) * texels.scale
    assert np.abs(two - network.charts.coefficients[:, 0]).max() < 1e-8


def test_shaders_are_named_like_their_twins():
    text = (SHADERS / "blend.glsl").read_text()
    names = set(re.findall(r"^\w+ (\w+)\(", text, re.MULTILINE))
    assert {"weight", "chart_jets", "corner_jets", "face_jets"} <= names & set(vars(blend_basis))


@pytest.mark.parametrize("version", ["3.3", "4.1"])
def test_transform_feedback(version, gpu):
    """In a process of its own: the version of a driver cannot be changed in this one."""
    if "Mesa" not in gpu.device.version:
        pytest.skip("only Mesa can be told to be an older version")
    code = f"""
import sys
sys.path[:0] = {[str(ROOT / "tests"), str(ROOT / "tests" / "gpu")]!r}
import curvify
from curvify.backends import open_backend
from surfaces import cube, mixed_ball
from test_blend import check_close, gaps
with open_backend("gpu", 0) as gpu:
    assert not gpu.device.compute, gpu.describe()
    for mesh, angle in ((mixed_ball(), None), (cube(), 30)):
        for order in (3, 5):
            found = gaps(curvify.surface(mesh, "blend", sharp_angle=angle, blend_order=order), 3, gpu)
            check_close(found)
            assert found.left == 0
"""
    environment = os.environ | {"MESA_GL_VERSION_OVERRIDE": version}
    ended = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
