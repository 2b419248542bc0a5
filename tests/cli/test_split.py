"""`curvify split`: pieces are convex, ids stay, everything that faces and corners carry goes along."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import curvify

#: Two darts and a square, with everything that OBJ can say about them.
RICH = """\
mtllib colors.mtl
v 0 0 0
v 2 -1 0
v 0 2 0
v -2 -1 0
v 0 0 1
v 2 -1 1
v 0 2 1
v -2 -1 1
vt 0.5 0.5
vt 1 0
vt 0.5 1
vt 0 0
vn 0 0 1
vn 0 0.6 0.8
g low
usemtl red
s 1
f 1/1/1 2/2/1 3/3/2 4/4/1
g high
usemtl blue
s off
f 5/1/1 6/2/1 7/3/2 8/4/1
f 1/1/1 2/2/1 6/2/1 5/1/1
t crease 2/1/0 0 1 10.0
t hole 1/0/0 1
"""


def test_a_concave_face_becomes_convex_ones(call, folder):
    result = call("split", "dart.obj", "convex.obj")
    assert (result.code, result.out) == (0, b"")
    assert result.err == "curvify: warning: dart.obj: 1 concave face split into convex pieces, first: 0\n"
    mesh = curvify.read("convex.obj")
    assert mesh.faces() == [[0, 1, 2], [0, 2, 3]]
    np.testing.assert_array_equal(mesh.positions, curvify.read("dart.obj").positions)


def test_convex_faces_stay(call, folder):
    result = call("split", "cube.obj", "same.obj")
    assert (result.code, result.err) == (0, "")
    assert curvify.read("same.obj").faces() == curvify.read("cube.obj").faces()


@pytest.mark.parametrize("name", ["convex.obj", "convex.ply"])
def test_what_faces_and_corners_carry_goes_to_their_pieces(call, folder, name):
    Path("rich.obj").write_text(RICH)
    assert call("split", "rich.obj", name, "-q").code == 0
    coarse, pieces = curvify.read("rich.obj"), curvify.read(name)
    source = [0, 0, 1, 1, 2]
    assert pieces.face_count == 5
    np.testing.assert_array_equal(pieces.face_materials, coarse.face_materials[source])
    np.testing.assert_array_equal(pieces.face_groups, coarse.face_groups[source])
    np.testing.assert_array_equal(pieces.face_smoothing, coarse.face_smoothing[source])
    assert (pieces.material_names, pieces.group_names) == (coarse.material_names, coarse.group_names)
    np.testing.assert_array_equal(pieces.marks.hole_faces, [2, 3])
    assert len(pieces.marks.crease_edges) >= 1
    for face in range(5):
        carried = {}
        for mesh, which in ((coarse, source[face]), (pieces, face)):
            corners = range(mesh.face_offsets[which], mesh.face_offsets[which + 1])
            carried[mesh is pieces] = {
                (*mesh.positions[mesh.face_vertices[c]], *mesh.corner_uvs[c], *mesh.corner_normals[c].astype("f4"))
                for c in corners
            }
        assert carried[True] <= carried[False]


def test_max_sides(call, folder):
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    polygon = "".join(f"v {np.cos(a)} {np.sin(a)} 0\n" for a in angles) + "f " + " ".join(map(str, range(1, 13)))
    Path("round.obj").write_text(polygon + "\n")
    assert call("split", "round.obj", "same.obj").err == ""
    assert curvify.read("same.obj").face_count == 1
    result = call("split", "round.obj", "small.obj", "--max-sides", "4")
    assert "1 face with more than 4 sides split" in result.err
    assert curvify.read("small.obj").face_sizes.max() <= 4


def test_pipes_precision_and_messages(process, folder):
    data = Path("dart.obj").read_bytes()
    result = process(
        "split", "-", "-", "--input-format", "obj", "--output-format", "ply", "--precision", "float64", "-v", stdin=data
    )
    assert result.code == 0
    assert "warning: stdin: 1 concave face" in result.err
    assert "stdout: 1 face became 2" in result.err
    Path("out.ply").write_bytes(result.out)
    assert curvify.read("out.ply").position_dtype == "float64"


def test_no_clobber(call, folder):
    Path("out.obj").write_text("mine")
    assert call("split", "dart.obj", "out.obj", "--no-clobber").code == 2
    assert Path("out.obj").read_text() == "mine"


def test_rules(call, folder):
    star = "v 0 3 0\nv -1 1 0\nv -3 0 0\nv -1 -1 0\nv 0 -3 0\nv 1 -1 0\nv 3 0 0\nv 1 1 0\nf 1 2 3 4 5 6 7 8\n"
    Path("star.obj").write_text(star)
    for rule in ("best", "closest"):
        assert call("split", "star.obj", f"{rule}.obj", "--split-rule", rule, "-q").code == 0
    assert curvify.read("best.obj").faces() != curvify.read("closest.obj").faces()
