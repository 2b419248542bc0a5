"""The whole chain: valid whatever comes in, as many polygons as asked for, exact where the input is flat."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import curvify
import dense_meshes
from curvify.errors import OptionError
from curvify.mesh import PolygonMesh
from curvify.simplify import Options, simplify
from curvify.simplify.accuracy import accuracy
from curvify.simplify.checks import find_problems
from curvify.simplify.search import CLOSE
from curvify.topology import build_topology, is_closed, signed_volume

MESHES = {
    "sphere": (dense_meshes.sphere(12), 60),
    "torus": (dense_meshes.torus(), 80),
    "genus 3": (dense_meshes.plate(3, 4), 90),
    "genus 8": (dense_meshes.plate(8, 2), 150),
    "sheet": (dense_meshes.sheet(), 50),
    "holes": (dense_meshes.holed_sheet(), 60),
    "part": (dense_meshes.prism(), 30),
    "two parts": (dense_meshes.boxes(np.array([[[1]], [[0]], [[1]]], dtype=bool), 4), 12),
    "needles": (dense_meshes.needles(), 60),
    "pinched": (dense_meshes.pinched(), 40),
}
SAMPLES = Path(__file__).parents[3] / "sample_meshes"


def topology_of(mesh: PolygonMesh):
    return build_topology(mesh.positions, mesh.face_offsets, mesh.face_vertices)


@pytest.mark.parametrize("name", MESHES)
def test_polygons_are_valid_and_as_many_as_asked_for(name):
    mesh, wanted = MESHES[name]
    result = simplify(mesh, Options(faces=wanted))
    assert find_problems(result.dense, result.polygons) == []
    assert wanted * (1 - CLOSE) <= result.mesh.face_count
    told = [text for text in result.warnings if "are the fewest found" in text or "come nearest" in text]
    assert (result.mesh.face_count <= wanted * (1 + CLOSE)) == (not told)
    result.mesh.validate()
    topology = topology_of(result.mesh)
    assert is_closed(topology) == result.dense.is_closed
    euler = result.mesh.vertex_count - len(topology.edges) + result.mesh.face_count
    assert euler == result.dense.euler_number
    dense = curvify.refine(result.mesh, level=2)
    assert np.isfinite(dense.positions).all()


@pytest.mark.parametrize("wanted", [57, 150, 300])
def test_the_number_asked_for_is_met(wanted):
    assert simplify(dense_meshes.torus(), Options(faces=wanted)).mesh.face_count == pytest.approx(wanted, rel=CLOSE)


def test_fewer_faces_than_can_be_are_told_as_the_fewest():
    notes = simplify(dense_meshes.torus(), Options(faces=8)).warnings
    assert any(text.startswith("8 faces cannot hold") and text.endswith("are the fewest found") for text in notes)


def test_the_same_input_gives_the_same_polygons():
    first, again = (simplify(dense_meshes.torus(), Options(faces=80)) for _ in range(2))
    assert np.array_equal(first.mesh.positions, again.mesh.positions)
    assert np.array_equal(first.mesh.face_vertices, again.mesh.face_vertices)
    assert np.array_equal(first.mesh.corner_normals, again.mesh.corner_normals)


def test_a_box_of_many_triangles_becomes_its_six_faces_and_refines_to_itself():
    box = dense_meshes.boxes(np.ones((1, 2, 3), dtype=bool), 4)
    result = simplify(box, Options(faces=6))
    assert (result.mesh.face_count, result.mesh.vertex_count) == (6, 8)
    assert result.mesh.marks.counts() == {"crease": 12, "flat": 6}
    dense = curvify.refine(result.mesh, level=3)
    volume = signed_volume(dense.positions, 4 * np.arange(len(dense.faces) + 1), dense.faces.reshape(-1))
    assert volume == pytest.approx(6, rel=1e-9)
    assert dense.positions.min() == pytest.approx(0, abs=1e-12)


def test_flat_parts_with_holes_are_reproduced_exactly():
    result = simplify(dense_meshes.plate(3, 4), Options(faces=60))
    found = accuracy(result.mesh, result.dense, 2000)
    assert found["flat"].max < 1e-12
    assert found["refined"].max < 1e-12


def test_refining_comes_back_closer_than_the_flat_polygons():
    result = simplify(dense_meshes.torus(96, 48), Options(faces=120))
    found = accuracy(result.mesh, result.dense, 4000)
    assert found["refined"].rms < 0.7 * found["flat"].rms


def test_normals_of_a_sphere_point_outward():
    result = simplify(dense_meshes.sphere(16), Options(faces=80))
    corners = result.mesh.positions[result.mesh.face_vertices]
    assert (np.einsum("ci,ci->c", corners, result.mesh.corner_normals) > np.cos(np.radians(12))).all()
    assert np.linalg.norm(result.mesh.corner_normals, axis=1) == pytest.approx(1)
    assert not result.mesh.marks.counts()


def test_creases_between_curved_and_flat_parts_are_kept():
    """A capped cylinder: one sector on the caps and another on the wall, at every vertex of the two rims."""
    angle = 2 * np.pi * np.arange(40) / 40
    rings = [np.stack([np.cos(angle), np.sin(angle), 0 * angle + z], axis=1) for z in np.linspace(0, 2, 9)]
    points = np.concatenate([*rings, [[0, 0, 0], [0, 0, 2]]])
    i, j = np.arange(40), (np.arange(40) + 1) % 40
    caps = [np.stack([j, i, 0 * i + 360], axis=1), np.stack([i + 320, j + 320, 0 * i + 361], axis=1)]
    walls = dense_meshes.grid(9, 40, wrap_columns=True)[:, ::-1]
    result = simplify(dense_meshes.mesh_of(points, np.concatenate([walls, *caps])), Options(faces=14))
    z = result.mesh.positions[result.mesh.marks.crease_edges][:, :, 2]
    assert len(z) >= 10
    assert (z[:, 0] == z[:, 1]).all()
    assert set(np.unique(z)) == {0.0, 2.0}
    upright = np.abs(result.mesh.corner_normals[:, 2])
    assert ((upright < 1e-6) | (upright > 1 - 1e-6)).all()
    found = accuracy(result.mesh, result.dense, 4000)
    assert found["refined"].rms < 0.2 * found["flat"].rms


def test_boundaries_keep_their_corners():
    result = simplify(dense_meshes.sheet(height=lambda x, y: 0 * x), Options(faces=1))
    assert result.mesh.face_count == 1
    assert {tuple(p) for p in result.mesh.positions[:, :2]} == {(0, 0), (0, 1), (1, 0), (1, 1)}


def test_the_facets_of_a_part_come_back_as_they_are():
    """16 sides and 2 caps, each several triangles in one plane: told, so that no normal may lean."""
    result = simplify(dense_meshes.prism(), Options(faces=18))
    assert result.mesh.face_count == 18
    assert len(result.mesh.marks.flat_faces) == 18
    found = accuracy(result.mesh, result.dense, 4000)
    assert found["flat"].max < 1e-12
    assert found["refined"].max < 1e-12


def test_a_flat_part_that_runs_into_a_curve_stays_flat():
    """Half of a sheet is flat and the other half rolls up without a crease between."""
    sheet = dense_meshes.sheet(40, height=lambda x, y: np.where(x > 0.5, (x - 0.5) ** 2, 0.0))
    result = simplify(sheet, Options(faces=30))
    dense = curvify.refine(result.mesh, level=4)
    inner = dense.positions[:, 0] < 0.45
    assert np.abs(dense.positions[inner, 2]).max() < 2e-3


def test_as_many_faces_as_there_are_leave_the_triangles():
    torus = dense_meshes.torus(12, 8)
    result = simplify(torus, Options(faces=500))
    assert result.mesh.face_count == torus.face_count
    assert "more faces would add nothing" in result.warnings[0]


def test_regions_can_be_asked_for_instead():
    result = simplify(dense_meshes.torus(), Options(proxies=40))
    assert result.counts["regions"] >= 40
    assert find_problems(result.dense, result.polygons) == []


def test_the_rule_of_the_paper_gives_valid_polygons_too():
    result = simplify(dense_meshes.torus(), Options(faces=80, split_rule="closest"))
    assert find_problems(result.dense, result.polygons) == []


def test_scale_and_place_do_not_matter():
    torus = dense_meshes.torus()
    moved = torus.with_(positions=1024 * torus.positions + [4096, -2048, 0])
    one, other = simplify(torus, Options(faces=80)), simplify(moved, Options(faces=80))
    assert one.mesh.face_count == pytest.approx(other.mesh.face_count, rel=CLOSE)
    rms = [accuracy(found.mesh, found.dense, 3000)["flat"].rms for found in (one, other)]
    assert rms[0] == pytest.approx(rms[1], rel=0.2)


@pytest.mark.parametrize("options", [{}, {"faces": 5, "proxies": 5}, {"faces": 0}, {"faces": 5, "compactness": -1.0}])
def test_options_that_cannot_be_are_refused(options):
    with pytest.raises(OptionError):
        Options(**options)


@pytest.mark.parametrize("sample", ["pawn", "l_part"])
def test_refined_samples_come_back(sample):
    dense = curvify.refine(curvify.read(SAMPLES / f"{sample}.obj"), level=3)
    mesh = PolygonMesh(dense.positions, 4 * np.arange(len(dense.faces) + 1), dense.faces.reshape(-1))
    result = simplify(mesh, Options(faces=120))
    assert find_problems(result.dense, result.polygons) == []
    assert result.mesh.face_count == pytest.approx(120, rel=CLOSE)
    assert accuracy(result.mesh, result.dense, 3000)["refined"].rms < 0.006
