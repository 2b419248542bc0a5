"""PLY: odd files in small literals, binary ones packed by hand, every error with its place."""

from __future__ import annotations

import io
import re
import struct

import numpy as np
import pytest

from curvify.errors import FormatError
from curvify.formats.ply_read import read_ply
from curvify.formats.ply_write import write_ply
from curvify.mesh import Marks, PolygonMesh

XYZ = "property float x\nproperty float y\nproperty float z\n"
FACE = "property list uchar int vertex_indices\n"
POINTS = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


def ascii_file(header: str, body: str) -> bytes:
    return f"ply\nformat ascii 1.0\n{header}end_header\n{body}".encode()


def read(data: bytes) -> PolygonMesh:
    mesh = read_ply(data, "a.ply")
    mesh.validate()
    return mesh


def written(mesh: PolygonMesh, ascii: bool = False, dtype: type = np.float32) -> bytes:
    out = io.BytesIO()
    write_ply(mesh, out, ascii, dtype)
    return out.getvalue()


def small(faces: str, count: int, face_header: str = FACE, rest: str = "") -> bytes:
    return ascii_file(f"element vertex 4\n{XYZ}element face {count}\n{face_header}{rest}", POINTS + faces)


def test_mixed_polygons_from_text() -> None:
    mesh = read(small("3 0 1 2\n4 0 1 2 3\n3 2 3 0\n", 3))
    assert mesh.faces() == [[0, 1, 2], [0, 1, 2, 3], [2, 3, 0]]
    assert mesh.position_dtype == np.float32


@pytest.mark.parametrize("newline", [b"\n", b"\r\n", b"\r"])
def test_line_ends_do_not_matter(newline: bytes) -> None:
    data = small("3 0 1 2\n", 1, rest="comment end_header\nobj_info x\n").replace(b"\n", newline)
    assert read(data).faces() == [[0, 1, 2]]


def test_binary_data_that_begins_with_a_line_feed() -> None:
    header = f"ply\rformat binary_little_endian 1.0\relement vertex 1\r{XYZ}end_header\r".replace("\n", "\r")
    x = struct.unpack("<f", b"\n\0\0\x40")[0]
    assert read(header.encode() + struct.pack("<3f", x, 0, 0)).positions[0, 0] == x


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("count", ["uchar B", "char b", "ushort H", "int i", "uint32 I", "uint8 B"])
@pytest.mark.parametrize("faces", [[[0, 1, 2], [2, 1, 0]], [[0, 1, 2], [0, 1, 2, 3], [3, 2, 1]]])
def test_binary_orders_and_count_types(order: str, count: str, faces: list[list[int]]) -> None:
    name, code = count.split()
    kind = "binary_little_endian" if order == "<" else "binary_big_endian"
    header = (
        f"ply\nformat {kind} 1.0\nelement extra 2\nproperty list ushort double junk\nproperty short tail\n"
        f"element vertex 4\nproperty double x\nproperty uchar pad\nproperty double y\nproperty int16 z\n"
        f"element face {len(faces)}\nproperty int before\nproperty list {name} uint vertex_index\n"
        f"property list {name} float more\nproperty uchar flat\nend_header\n"
    )
    body = struct.pack(order + "H2dh", 2, 1, 2, 3) + struct.pack(order + "Hh", 0, 7)
    for i in range(4):
        body += struct.pack(order + "dBdh", i + 0.1, 9, -i, i * 100)
    for number, face in enumerate(faces):
        body += struct.pack(order + f"i{code}{len(face)}I", 5, len(face), *face)
        body += struct.pack(order + f"{code}{number}fB", number, *[1.5] * number, number == 1)
    mesh = read(header.encode() + body)
    assert mesh.faces() == faces
    np.testing.assert_array_equal(mesh.positions, [[i + 0.1, -i, i * 100] for i in range(4)])
    assert mesh.position_dtype == np.float64
    assert mesh.marks.flat_faces.tolist() == [1]


def test_attributes_of_vertices_go_to_corners() -> None:
    header = (
        f"element vertex 3\n{XYZ}property float nx\nproperty float ny\nproperty float nz\n"
        f"property float texture_u\nproperty float texture_v\n"
        f"property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n"
        f"element face 1\n{FACE}"
    )
    rows = "0 0 0 0 0 1 .5 .25 1 2 3 4\n1 0 0 0 0 0 0 0 5 6 7 8\n0 1 0 0 1 0 1 1 9 10 11 255\n"
    mesh = read(ascii_file(header, rows + "3 2 1 0\n"))
    np.testing.assert_array_equal(mesh.corner_normals, [[0, 1, 0], [np.nan] * 3, [0, 0, 1]])
    np.testing.assert_array_equal(mesh.corner_uvs, [[1, 1], [0, 0], [0.5, 0.25]])
    assert mesh.vertex_colors.dtype == np.uint8
    assert mesh.vertex_colors.tolist() == [[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 255]]


def test_texture_coordinates_of_faces() -> None:
    face = FACE + "property list uchar float texcoord\n"
    mesh = read(small("3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 0\n3 0 1 3 4 9 9 9 9\n", 3, face))
    np.testing.assert_array_equal(mesh.corner_uvs[:3], [[0, 0], [1, 0], [1, 1]])
    assert np.isnan(mesh.corner_uvs[3:]).all()
    assert mesh.warnings == ("1 faces have a texcoord list that does not fit their corners: ignored",)


def test_triangle_strips() -> None:
    strips = "element tristrips 2\nproperty list int int vertex_indices\n"
    data = ascii_file(f"element vertex 4\n{XYZ}{strips}", POINTS + "8 0 1 2 3 -1 1 2 3\n4 0 0 1 2\n")
    assert read(data).faces() == [[0, 1, 2], [2, 1, 3], [1, 2, 3], [1, 0, 2]]


def test_edges_and_flat_faces_are_marks() -> None:
    edges = "element edge 3\nproperty int vertex1\nproperty int vertex2\n"
    edges += "property float crease\nproperty uchar straight\n"
    data = small(
        "3 0 1 2 1\n3 0 2 3 0\n0 1 0.5 0\n1 2 0 1\n2 3 7 1\n", 2, FACE + "property uchar flat\n", edges
    )
    marks = read(data).marks
    assert marks.crease_edges.tolist() == [[0, 1], [2, 3]]
    assert marks.crease_sharpness.tolist() == [[0.5, 0.5], [1, 1]]
    assert marks.straight_edges.tolist() == [[1, 2], [2, 3]]
    assert marks.flat_faces.tolist() == [0]


def test_faces_with_few_corners_are_skipped_and_marks_stay_aligned() -> None:
    mesh = read(small("2 0 1 1\n3 0 1 2 0\n0 0\n3 0 2 3 1\n", 4, FACE + "property uchar flat\n"))
    assert mesh.faces() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.marks.flat_faces.tolist() == [1]
    assert mesh.warnings == (
        "2 faces with fewer than 3 corners were skipped, the first is face 0 (counted from 0)",
    )


def test_foreign_material_numbers_get_names() -> None:
    mesh = read(small("3 0 1 2 70000\n3 0 2 3 -5\n3 0 1 3 2\n", 3, FACE + "property int material_index\n"))
    assert mesh.material_names == ("material_2", "material_70000")
    assert mesh.face_materials.tolist() == [1, -1, 0]


def test_no_faces_is_no_error() -> None:
    assert read(ascii_file(f"element vertex 4\n{XYZ}", POINTS)).face_count == 0
    assert read(small("", 0)).face_count == 0


BINARY = (
    f"ply\nformat binary_little_endian 1.0\nelement vertex 1\n{XYZ}element face 1\n{FACE}end_header\n"
).encode()


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "a.ply:1: not a PLY file"),
        (b"ply\nformat ascii 1.0\n", "no end_header"),
        (b"ply\nend_header\n", "no format line"),
        (b"ply\nformat text 1.0\nend_header\n", "a.ply:2: the format must be"),
        (b"ply\nformat ascii 1.0\nend_header\n", "no element 'vertex'"),
        (ascii_file("element vertex 2\nproperty floaty x\n", ""), "a.ply:4: 'floaty' is not a type"),
        (ascii_file("element vertex -2\n", ""), "a.ply:3: an element line"),
        (ascii_file("property float x\n", ""), "a.ply:3: a property stands before"),
        (ascii_file("element vertex 1\nproperty float x\n", "1\n"), "no properties x, y and z"),
        (
            ascii_file(f"element vertex 99999999999\n{XYZ}", POINTS),
            "a.ply:3: the header announces 99999999999 rows",
        ),
        (ascii_file(f"element vertex 5\n{XYZ}", POINTS), "a.ply:3: the header announces 5 rows"),
        (ascii_file(f"element vertex 3\n{XYZ}", POINTS), "a.ply:11: the file goes on after its last vertex"),
        (
            ascii_file(f"element vertex 4\n{XYZ}", POINTS.replace("1 1 0", "1 nan 0")),
            "a.ply:10: vertex 2 has",
        ),
        (
            ascii_file(f"element vertex 4\n{XYZ}", POINTS.replace("1 1 0", "1 x 0")),
            "a.ply:10: 'x' is not a number",
        ),
        (small("3 0 1 2\n3 0 1 4\n", 2), "a.ply:15: face 1 refers to vertex 4, the file has 4"),
        (
            small("3 0 1 2\n3 0 1.5 2\n", 2),
            "a.ply:15: property 'vertex_indices' has a value that is not a whole",
        ),
        (small("3 0 1 2\n4 0 1 2\n", 2), "the file ends inside element 'face'"),
        (small("3 0 1 2\n-1 0 1 2\n", 2), "a.ply:15: a list in element 'face' has a length of -1"),
        (small("3 0 1 2\n", 1, "property list uchar int corners\n"), "no list property vertex_indices"),
        (
            small("3 0 1 2\n", 1, "property list float int vertex_indices\n"),
            "a.ply:8: a list cannot be counted",
        ),
        (BINARY + struct.pack("<3fB2i", 0, 0, 0, 3, 0, 0), "ends inside element 'face'"),
        (
            BINARY + struct.pack("<3fB3i", 0, 0, 0, 3, 0, 0, 1),
            f"byte {len(BINARY) + 12}: face 0 refers to vertex 1",
        ),
        (BINARY + struct.pack("<3fB3i", 0, np.inf, 0, 3, 0, 0, 0), f"byte {len(BINARY)}: vertex 0 has"),
        (BINARY + struct.pack("<3fB3i4x", 0, 0, 0, 3, 0, 0, 0), f"byte {len(BINARY) + 25}: the file goes on"),
        (
            BINARY.replace(b"face 1", b"face 888888888") + bytes(25),
            "a.ply:7: the header announces",
        ),
    ],
)
def test_errors_name_the_place(data: bytes, words: str) -> None:
    with pytest.raises(FormatError, match=re.escape(words)) as caught:
        read_ply(data, "a.ply")
    assert str(caught.value).startswith("a.ply")
    assert "\n" not in str(caught.value)


def test_vertices_repeat_after_the_originals() -> None:
    normals = np.array([[0, 0, 1.0]] * 3 + [[0, 1, 0]] * 3 + [[1, 0, 0]] * 3)
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [5, 5, 5.0]])
    marks = Marks(crease_edges=np.array([[1, 0]]), crease_sharpness=np.ones((1, 2)))
    mesh = PolygonMesh.from_faces(
        points, [[0, 1, 2], [0, 3, 1], [0, 2, 3]], corner_normals=normals, marks=marks
    )
    again = read(written(mesh))
    np.testing.assert_array_equal(again.positions, points[[0, 1, 2, 3, 4, 0, 0, 1, 2, 3]])
    assert again.faces() == [[0, 1, 2], [5, 3, 7], [6, 8, 9]]
    np.testing.assert_array_equal(again.corner_normals, normals)
    assert again.marks.crease_edges.tolist() == [[1, 0], [7, 5]]


def test_polygons_over_255_sides_get_a_wider_count() -> None:
    angle = np.linspace(0, 6, 300)
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    data = written(PolygonMesh.from_faces(points, [list(range(300)), [0, 1, 2]]))
    assert b"property list ushort int vertex_indices" in data
    assert read(data).face_sizes.tolist() == [300, 3]
