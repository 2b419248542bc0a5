"""`curvify refine` with the scheme blend, and trimming."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import curvify

SAMPLES = Path(__file__).parents[2] / "sample_meshes"
TORUS, DISC = SAMPLES / "torus.obj", SAMPLES / "disc.png"


def edge_uses(mesh: curvify.PolygonMesh) -> Counter[int]:
    """How many faces an edge has, and how many edges have so many."""
    uses: Counter[frozenset[int]] = Counter()
    for face in mesh.faces():
        uses.update(frozenset(pair) for pair in zip(face, [*face[1:], face[0]], strict=True))
    return Counter(uses.values())


@pytest.mark.parametrize("scheme", ["blend", "gregory"])
@pytest.mark.parametrize("name", ["out.ply", "out.obj"])
def test_a_torus_with_a_round_hole_in_every_face(call, folder, scheme, name):
    result = call("refine", TORUS, name, "--scheme", scheme, "--trim", DISC, "--trim-mode", "clip")
    assert (result.code, result.out, result.err) == (0, b"", "")
    coarse, mesh = curvify.read(TORUS), curvify.read(folder / name)
    uses = edge_uses(mesh)
    assert set(uses) == {1, 2}
    edges = sum(uses.values())
    assert mesh.vertex_count - edges + mesh.face_count == -36
    np.testing.assert_array_equal(np.float32(mesh.positions[:36]), np.float32(coarse.positions))
    assert mesh.corner_normals is not None


def test_formats_of_triangles_get_triangles(call, folder):
    assert call("refine", TORUS, "out.stl", "--scheme", "blend", "-k", "2", "--trim", DISC).code == 0
    assert call("refine", TORUS, "out.ply", "--scheme", "blend", "-k", "2", "--trim", DISC, "--triangulate").code == 0
    stl, ply = curvify.read("out.stl"), curvify.read("out.ply")
    assert set(ply.face_sizes) == {3}
    assert stl.face_count == ply.face_count


def test_the_report_counts_what_was_written(call, folder):
    done = call("refine", TORUS, "out.ply", "--scheme", "blend", "--trim", DISC, "--trim-invert", "--report", "-")
    report, mesh = json.loads(done.out), curvify.read("out.ply")
    assert report["counts"]["output"]["faces"] == mesh.face_count
    assert report["counts"]["output"]["vertices"] == mesh.vertex_count
    assert report["volume_ratio"] is None
    assert report["g1"]["max_degrees"] < 1e-9
    assert (report["options"]["trim_map"], report["options"]["trim_invert"]) == ("face", True)


def test_the_same_bytes_to_a_file_and_a_pipe(call, folder):
    arguments = ("--scheme", "blend", "--trim", DISC, "-k", "3")
    assert call("refine", TORUS, "out.ply", *arguments, "--threads", "1").code == 0
    piped = call("refine", TORUS, "-", "--output-format", "ply", *arguments, "--threads", "3")
    assert piped.out == Path("out.ply").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--trim-mode", "drop"], "--trim-mode says how to trim by an image; give one with --trim FILE"),
        (["--trim-invert"], "--trim-invert says how to trim by an image; give one with --trim FILE"),
        (["--trim", "cube.obj"], "cube.obj: this is no PNG image"),
        (["--trim", "none.png"], "none.png: cannot read: there is no such file"),
        (["--trim", DISC, "--trim-map", "uv"], "cube.obj: the mesh has no texture coordinates"),
        (["--trim", "black.png"], "cube.obj: the image trims everything away"),
        (["--chart", "polar"], "--chart is for the scheme blend, not for gregory"),
        (["--scheme", "blend", "--alpha", "2"], "--alpha is for the scheme"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line_and_leaves_nothing(call, folder, arguments, text):
    from PIL import Image

    Image.new("L", (4, 4)).save("black.png")
    before = sorted(folder.iterdir())
    result = call("refine", "cube.obj", "out.ply", *arguments)
    assert result.code == 2
    assert result.err.startswith(f"curvify: error: {text}")
    assert result.err.count("\n") == 1
    assert sorted(folder.iterdir()) == before


def test_all_options_of_blend(call, folder):
    for options in (
        ["--chart", "conformal", "--blend-order", "5"],
        ["--sharp-model", "paper", "--sharp-angle", "30"],
        ["--sharp-model", "paper-fixed", "--boundary-corners", "smooth"],
    ):
        assert call("refine", "dart.obj", "out.ply", "--scheme", "blend", *options).code == 0
        assert curvify.read("out.ply").face_count == 100


def test_a_prediction_is_that_of_the_whole_mesh(call, folder):
    result = call("refine", TORUS, "out.ply", "--scheme", "blend", "--trim", DISC, "--dry-run")
    assert "3,600 faces" in result.err
    assert "before trimming" in result.err
