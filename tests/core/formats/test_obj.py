"""OBJ: every odd form in a small literal, every error with its line."""

from __future__ import annotations

import io
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from curvify.errors import FormatError
from curvify.formats.obj_read import read_obj
from curvify.formats.obj_write import write_obj
from curvify.formats.text import face_lines, vector_lines
from curvify.mesh import Marks, PolygonMesh

TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
SQUARE = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def read(text: bytes) -> PolygonMesh:
    mesh = read_obj(text, "a.obj")
    mesh.validate()
    return mesh


def written(mesh: PolygonMesh, dtype: type = np.float64) -> bytes:
    out = io.BytesIO()
    write_obj(mesh, out, dtype)
    return out.getvalue()


def test_polygons_of_any_size_keep_their_order() -> None:
    mesh = read(SQUARE + b"v .5 2 0\nf 1 2 3\nf 1 2 3 4\nf 1 2 3 5 4\n")
    assert mesh.faces() == [[0, 1, 2], [0, 1, 2, 3], [0, 1, 2, 4, 3]]
    assert mesh.position_dtype == np.float32


@pytest.mark.parametrize("form", [b"f 1 2 3", b"f 1/ 2/ 3/", b"f 1// 2// 3//", b"f 1 2/ 3//"])
def test_empty_places_mean_no_normal_and_no_uv(form: bytes) -> None:
    mesh = read(TRIANGLE + form)
    assert mesh.faces() == [[0, 1, 2]]
    assert mesh.corner_normals is None
    assert mesh.corner_uvs is None


def test_four_index_forms_may_be_mixed_in_one_face() -> None:
    mesh = read(SQUARE + b"vt .25 .5\nvt .75 1 9\nvn 0 0 1\nf 1 2/2 3//1 4/1/1\n")
    assert mesh.faces() == [[0, 1, 2, 3]]
    np.testing.assert_array_equal(mesh.corner_uvs, [[np.nan] * 2, [0.75, 1], [np.nan] * 2, [0.25, 0.5]])
    np.testing.assert_array_equal(mesh.corner_normals, [[np.nan] * 3, [np.nan] * 3, [0, 0, 1], [0, 0, 1]])


def test_negative_indices_count_from_the_elements_read_so_far() -> None:
    text = TRIANGLE + b"vn 1 0 0\nf -3//-1 -2//-1 -1//-1\n" + TRIANGLE + b"vn 0 1 0\nf -3//-1 -2//-2 3//-1\n"
    mesh = read(text)
    assert mesh.faces() == [[0, 1, 2], [3, 4, 2]]
    np.testing.assert_array_equal(mesh.corner_normals[3:], [[0, 1, 0], [1, 0, 0], [0, 1, 0]])


def test_faces_may_come_before_their_vertices() -> None:
    assert read(b"f 1 2 3\n" + TRIANGLE).faces() == [[0, 1, 2]]


@pytest.mark.parametrize("newline", [b"\n", b"\r\n", b"\r"])
def test_layout_of_lines_does_not_matter(newline: bytes) -> None:
    text = (
        b"\xef\xbb\xbf# made \\\nv 0 0 0 # first\n  \tv\t1  0 0   \n\n   # note\nv 0 1 \\\n 0#tail\n"
        b"vt 0 0\n\tf 1 2 \\\n\\\n 3 # f 9 9 9\nf 3/1 2/1 1/1"
    )
    mesh = read(text.replace(b"\n", newline))
    np.testing.assert_array_equal(mesh.positions, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    assert mesh.faces() == [[0, 1, 2], [2, 1, 0]]


def test_deep_indentation_is_skipped() -> None:
    assert read(b" " * 500 + TRIANGLE + b"\t" * 500 + b"f 1 2 3").face_count == 1


def test_weights_are_ignored_and_colors_kept() -> None:
    assert read(b"v 1 2 3 0.5\n").vertex_colors is None
    mesh = read(b"v 1 2 3 0.25 0.5 1\nv 4 5 6 0 0 0.1\n")
    np.testing.assert_array_equal(mesh.vertex_colors, np.array([[0.25, 0.5, 1], [0, 0, 0.1]], np.float32))
    np.testing.assert_array_equal(mesh.positions, [[1, 2, 3], [4, 5, 6]])
    mixed = read(b"v 1 2 3\nv 4 5 6 0 0 1 0.5\n")
    np.testing.assert_array_equal(mixed.vertex_colors, [[1, 1, 1, 1], [0, 0, 1, 0.5]])
    assert mixed.warnings == ("1 vertices have no color while others do: taken as white",)


def test_groups_materials_and_smoothing() -> None:
    mesh = read(
        b"mtllib a b.mtl\no thing\n" + TRIANGLE + b"f 1 2 3\ng left  arm # note\nusemtl red#1\ns 4\nf 1 2 3\n"
        b"s off\ng\nusemtl blue\nf 1 2 3\ns 1\nusemtl red#1\nf 1 2 3\n"
    )
    assert mesh.material_files == ("a b.mtl",)
    assert mesh.material_names == ("red#1", "blue")
    assert mesh.face_materials.tolist() == [-1, 0, 1, 0]
    assert mesh.group_names == ("left arm",)
    assert mesh.face_groups.tolist() == [-1, 0, -1, -1]
    assert mesh.face_smoothing.tolist() == [0, 4, 0, 1]


def test_objects_are_groups_where_there_are_none() -> None:
    mesh = read(TRIANGLE + b"o a\nf 1 2 3\no b\nf 1 2 3\n")
    assert mesh.group_names == ("a", "b")
    assert mesh.face_groups.tolist() == [0, 1]


@pytest.mark.parametrize("word", [b"off", b"0"])
def test_smoothing_off_throughout_means_nothing(word: bytes) -> None:
    assert read(TRIANGLE + b"s " + word + b"\nf 1 2 3\n").face_smoothing is None


def test_tags() -> None:
    marks = read(
        SQUARE + b"t crease 2/1/0 0 1 5.0\nt crease 3/1/0 1 2 3 20\n"
        b"t crease 3/2/0 0 1 2 1 2\nt crease 2/2/0 2 3 0 10\n"
        b"t corner 1/1/0 2 -1\nt corner 2/1/0 0 1 2.5\nt straight 2/0/0 3 0\nt flat 1/0/0 1\nt hole 1/0/0 2\n"
        b"f 1 2\nf 1 2 3 4\nf 1 2 3\n"
    ).marks
    assert marks.crease_edges.tolist() == [[0, 1], [1, 2], [2, 3], [0, 1], [1, 2], [2, 3]]
    expected = [[0.5, 0.5], [1, 1], [1, 1], [0.1, 0.1], [0.2, 0.2], [0, 1]]
    np.testing.assert_allclose(marks.crease_sharpness, expected)
    assert marks.corner_vertices.tolist() == [2, 0, 1]
    assert marks.corner_sharpness.tolist() == [0, 0.25, 0.25]
    assert marks.straight_edges.tolist() == [[3, 0]]
    assert marks.flat_faces.tolist() == [0]  # the face before it was skipped
    assert marks.hole_faces.tolist() == [1]


def test_warnings_count_what_was_ignored() -> None:
    mesh = read(
        TRIANGLE
        + b"f 1 2\nf 1\nf\nf 1 2 3\nt creasemethod 0/0/1 chaikin\nt interpolateboundary 1/0/0 2\n"
        b"foo 1\nbar\nfoo\nl 1 2\np 1\ns what\n"
        b"vn nan 0 0\nvn 0 0 0\nf 1//1 2//2 3//2\n"
    )
    assert mesh.face_count == 2
    assert mesh.corner_normals is None
    assert mesh.warnings == (
        "1 normals are not finite numbers and were ignored",
        "3 faces with fewer than 3 corners were skipped, the first at line 4",
        "unknown tags were ignored: 1 ('creasemethod')",
        "lines with unknown keywords were ignored: 4 ('foo', 'bar', 's')",
    )


def test_files_without_faces_are_read() -> None:
    assert read(b"").vertex_count == 0
    assert read(TRIANGLE).face_count == 0


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (TRIANGLE + b"\n# x\nf 1 2 9000\n", 6, "face refers to vertex 9000, the file has 3"),
        (TRIANGLE + b"f 1 2 3\nf -1 -2 -4\n", 5, "vertex -4, only 3 vertices come before it"),
        (TRIANGLE + b"f 1 2 0\n", 4, "vertex 0, but they are counted from 1"),
        (TRIANGLE + b"vt 0 0\nf 1/1 2/1 3/2\n", 5, "texture coordinate 2, the file has 1"),
        (TRIANGLE + b"f 1//1 2//1 3//1\n", 4, "normal 1, the file has 0"),
        (TRIANGLE + b"f -3/-4/--\n", 4, "'-3/-4/--' is not a corner"),
        (TRIANGLE + b"f 1 2 3\nf a b c\n", 5, "'a' is not a corner"),
        (TRIANGLE + b"f 1 2 3.0\n", 4, "'3.0' is not a corner"),
        (TRIANGLE + b"f 1/1/1/1 2 3\n", 4, "'1/1/1/1' is not a corner"),
        (TRIANGLE + b"f 1 2 /3\n", 4, "'/3' is not a corner"),
        (TRIANGLE + b"f 1 2 1-2\n", 4, "'1-2' is not a corner"),
        (TRIANGLE + b"f 1 2 99999999999999999999\n", 4, "the file has 3"),
        (b"v 0 0 0\nv 1 nan 0\n", 2, "not a finite number"),
        (b"v 0 0 1e999\n", 1, "not a finite number"),
        (b"v 0 \\\n 0 0\nv 0 0\n", 3, "vertex has 2 numbers, it needs 3"),
        (b"v 0 0\nv 0 0 0 0\n", 1, "vertex has 2 numbers"),
        (b"v 0 0 0\nv 0 0x1 0\n", 2, "'0x1' is not a number"),
        (b"v 0 0 1_0\n", 1, "'1_0' is not a number"),
        (b"v 0 0 1-2\n", 1, "'1-2' is not a number"),
        (b"v 0,5 0 1\n", 1, "'0,5' is not a number"),
        (b"vn 0 1\n", 1, "normal has 2 numbers"),
        (b"vt\n", 1, "texture coordinate has no numbers"),
        (TRIANGLE + b"t crease 2/1/0 0 3 1\n", 4, "tag refers to vertex 3, the file has 3"),
        (TRIANGLE + b"t flat 1/0/0 0\n", 4, "tag refers to face 0, the file has 0"),
        (TRIANGLE + b"t crease 2/1/0 0 1\n", 4, "announces 3 values and has 2"),
        (TRIANGLE + b"t crease 2 0 1\n", 4, "cannot be read"),
        (TRIANGLE + b"t corner 1/1/0 0 nan\n", 4, "not a finite number"),
    ],
)
def test_errors_name_the_line(text: bytes, line: int, words: str) -> None:
    with pytest.raises(FormatError, match=rf"^a\.obj:{line}: .*{re.escape(words)}"):
        read_obj(text, "a.obj")


corner = st.tuples(st.integers(1, 4), st.sampled_from([0, 1, 2]), st.sampled_from([0, 1]), st.booleans())


@given(st.lists(st.lists(corner, min_size=3, max_size=7), max_size=6))
def test_all_corners_at_once_equals_one_by_one(faces: list[list[tuple[int, int, int, bool]]]) -> None:
    """The text is built corner by corner; what comes back must be the numbers it was built from."""
    lines, expected = [], []
    for face in faces:
        words = []
        for v, t, n, negative in face:
            shown = v - 5 if negative else v
            words.append(
                f"{shown}/{t or ''}/{n}" if n else f"{shown}/{t}" if t else f"{shown}{'/' * (v % 3)}"
            )
            expected.append((v - 1, t, n))
        lines.append("f " + " ".join(words))
    mesh = read(SQUARE + b"vt 1 1\nvt 2 2\nvn 1 0 0\n" + "\n".join(lines).encode())
    assert mesh.face_vertices.tolist() == [v for v, _, _ in expected]
    uvs = np.zeros(len(expected)) if mesh.corner_uvs is None else np.nan_to_num(mesh.corner_uvs[:, 0])
    normals = (
        np.zeros(len(expected)) if mesh.corner_normals is None else np.nan_to_num(mesh.corner_normals[:, 0])
    )
    assert uvs.tolist() == [t for _, t, _ in expected]
    assert normals.tolist() == [n for _, _, n in expected]


def test_shared_normals_are_written_once() -> None:
    mesh = PolygonMesh.from_faces(
        np.eye(3), [[0, 1, 2], [2, 1, 0]], corner_normals=np.tile([0.0, 0, 1], (6, 1))
    )
    text = written(mesh)
    assert text.count(b"vn ") == 1
    assert b"f 1//1 2//1 3//1\nf 3//1 2//1 1//1\n" in text


def test_written_digits_are_the_shortest_of_the_type() -> None:
    mesh = PolygonMesh.from_faces([[0.1, 1 / 3, -0.0]], [])
    assert written(mesh, np.float32) == b"v 0.1 0.33333334 -0.0\n"
    assert written(mesh) == b"v 0.1 0.3333333333333333 -0.0\n"


def test_numbers_too_large_for_the_type_are_refused() -> None:
    with pytest.raises(FormatError, match="too large for float32"):
        written(PolygonMesh.from_faces([[1e300, 0, 0]], []), np.float32)


def test_states_are_written_where_they_change() -> None:
    mesh = PolygonMesh.from_faces(
        np.eye(3), [[0, 1, 2]] * 3, face_groups=np.array([0, 0, -1]), group_names=("a",),
        face_smoothing=np.array([0, 2, 2]), face_materials=np.array([-1, 0, 0]), material_names=("m\nx",),
        material_files=("m.mtl",), marks=Marks(flat_faces=np.array([2])),
    )  # fmt: skip
    lines = written(mesh).decode().splitlines()
    assert lines[0] == "mtllib m.mtl"
    assert lines[4:] == ["g a", "f 1 2 3", "usemtl m x", "s 2", "f 1 2 3", "g", "f 1 2 3", "t flat 1/0/0 2"]


def test_bulk_lines() -> None:
    ids = np.array([[0, 1, 2, 3], [3, 2, 1, 0]])
    assert face_lines(ids) == b"f 1 2 3 4\nf 4 3 2 1\n"
    assert face_lines(ids[:1], normals=ids[1:]) == b"f 1//4 2//3 3//2 4//1\n"
    assert face_lines(ids[:1], uvs=ids[1:]) == b"f 1/4 2/3 3/2 4/1\n"
    assert face_lines(ids[:1], ids[1:], ids[:1]) == b"f 1/4/1 2/3/2 3/2/3 4/1/4\n"
    assert face_lines(ids[:0]) == b""
    assert vector_lines(b"vn", np.array([[0.5, np.nan]], np.float32)) == b"vn 0.5 nan\n"
