"""What is read is also written: meshes made by hypothesis come back from every format of our own."""

from __future__ import annotations

import io
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from curvify.errors import FormatError
from curvify.formats.obj_read import read_obj
from curvify.formats.obj_write import write_obj
from curvify.formats.off import read_off, write_off
from curvify.formats.ply_read import read_ply
from curvify.formats.ply_write import write_ply
from curvify.mesh import Marks, PolygonMesh

TYPES = [np.float32, np.float64]


@st.composite
def meshes(draw: st.DrawFn) -> PolygonMesh:
    """A mesh with any mixture of polygons and attributes; numbers fit float32."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    vertices = draw(st.integers(3, 12))
    sizes = draw(st.lists(st.integers(3, 6), max_size=6))
    faces = [rng.permutation(vertices)[: min(n, vertices)].tolist() for n in sizes]
    count, corners = len(faces), sum(map(len, faces))
    scale = 10.0 ** draw(st.integers(-30, 30))
    fields: dict[str, Any] = {}
    if corners and draw(st.booleans()):
        normals = rng.standard_normal((3, 3))[rng.integers(0, 3, corners)]
        fields["corner_normals"] = _with_gaps(normals, rng, draw(st.booleans()))
    if corners and draw(st.booleans()):
        fields["corner_uvs"] = _with_gaps(rng.integers(-2, 3, (corners, 2)) / 3, rng, draw(st.booleans()))
    if draw(st.booleans()):
        fields["vertex_colors"] = rng.random((vertices, draw(st.sampled_from([3, 4])))).astype(np.float32)
    if count and draw(st.booleans()):
        fields |= {"face_materials": rng.integers(-1, 2, count), "material_names": ("red", "two words")}
        fields |= {"face_groups": rng.integers(-1, 2, count), "group_names": ("a", "ü")}
        fields["face_smoothing"] = rng.choice([0, 1, 2**31, 2**32 - 1], count)
        fields["face_smoothing"][0] = 5
    if count and draw(st.booleans()):
        fields["marks"] = _some_marks(faces, rng)
    positions = rng.standard_normal((vertices, 3)) * scale
    return PolygonMesh.from_faces(positions, faces, **fields)


def _with_gaps(rows: np.ndarray, rng: np.random.Generator, gaps: bool) -> np.ndarray:
    if gaps:
        rows[rng.random(len(rows)) < 0.3] = np.nan
        rows[0] = 0.5
    return rows


def _some_marks(faces: list[list[int]], rng: np.random.Generator) -> Marks:
    edges = sorted({tuple(sorted((f[i - 1], f[i]))) for f in faces for i in range(len(f))})
    some = np.array(edges)[: rng.integers(1, 4)]
    return Marks(
        crease_edges=some,
        crease_sharpness=rng.integers(1, 11, (len(some), 2)) / 10,
        straight_edges=some[::2],
        corner_vertices=np.array([0, 2]),
        corner_sharpness=np.array([0.5, rng.random() + 1e-3]).clip(0, 1),
        flat_faces=np.array([0]),
        hole_faces=np.array([len(faces) - 1]),
    )


def rounded(values: np.ndarray | None, dtype: type) -> bytes | None:
    """Bits to compare by: all NaN alike."""
    return None if values is None else np.where(np.isnan(values), np.nan, values.astype(dtype)).tobytes()


def same_shape(mesh: PolygonMesh, again: PolygonMesh, dtype: type) -> None:
    """Positions, normals and uvs corner by corner, bit by bit once rounded; faces by size."""
    again.validate()
    assert again.face_offsets.tolist() == mesh.face_offsets.tolist()
    assert rounded(again.positions[: mesh.vertex_count], dtype) == rounded(mesh.positions, dtype)
    at = again.positions[again.face_vertices]
    assert rounded(at, dtype) == rounded(mesh.positions[mesh.face_vertices], dtype)
    assert rounded(again.corner_normals, dtype) == rounded(mesh.corner_normals, dtype)
    assert rounded(again.corner_uvs, dtype) == rounded(mesh.corner_uvs, dtype)


def same_attributes(mesh: PolygonMesh, again: PolygonMesh) -> None:
    for name in ("face_smoothing",):
        a, b = getattr(mesh, name), getattr(again, name)
        assert (a is None) == (b is None)
        assert a is None or a.tolist() == b.tolist()
    for index, names in (("face_materials", "material_names"), ("face_groups", "group_names")):
        a, b = getattr(mesh, index), getattr(again, index)
        shown = [getattr(mesh, names)[i] if i >= 0 else "" for i in ([] if a is None else a.tolist())]
        back = [getattr(again, names)[i] if i >= 0 else "" for i in ([] if b is None else b.tolist())]
        assert shown == back or not any(shown + back)
    if mesh.vertex_colors is not None:
        np.testing.assert_array_equal(again.vertex_colors[: mesh.vertex_count], mesh.vertex_colors)
    for name in ("flat_faces", "hole_faces"):
        assert getattr(again.marks, name).tolist() == getattr(mesh.marks, name).tolist()


@pytest.mark.parametrize("dtype", TYPES)
@settings(max_examples=60, deadline=None)
@given(mesh=meshes())
def test_obj(dtype: type, mesh: PolygonMesh) -> None:
    out = io.BytesIO()
    write_obj(mesh, out, dtype)
    again = read_obj(out.getvalue(), "a.obj")
    same_shape(mesh, again, dtype)
    same_attributes(mesh, again)
    assert again.face_vertices.tolist() == mesh.face_vertices.tolist()
    for name in ("crease_edges", "crease_sharpness", "straight_edges", "corner_vertices", "corner_sharpness"):
        np.testing.assert_allclose(getattr(again.marks, name), getattr(mesh.marks, name), rtol=1e-15)


@pytest.mark.parametrize("ascii", [False, True])
@pytest.mark.parametrize("dtype", TYPES)
@settings(max_examples=60, deadline=None)
@given(mesh=meshes())
def test_ply(dtype: type, ascii: bool, mesh: PolygonMesh) -> None:
    out = io.BytesIO()
    write_ply(mesh, out, ascii, dtype)
    again = read_ply(out.getvalue(), "a.ply")
    same_shape(mesh, again, dtype)
    same_attributes(mesh, again)
    assert again.position_dtype == dtype
    assert edge_marks(mesh, again) == edge_marks(mesh, mesh)


def edge_marks(mesh: PolygonMesh, marked: PolygonMesh) -> tuple[set[Any], set[Any], dict[int, float]]:
    """Marks of edges and corners by place, since vertices may have been repeated."""
    place = {tuple(p): v for v, p in reversed(list(enumerate(mesh.positions.astype(np.float32).tolist())))}
    name = [place[tuple(p)] for p in marked.positions.astype(np.float32).tolist()]
    marks = marked.marks
    creases = {
        (name[a], name[b], *ends)
        for (a, b), ends in zip(marks.crease_edges.tolist(), marks.crease_sharpness.tolist(), strict=True)
    }
    straight = {(name[a], name[b]) for a, b in marks.straight_edges.tolist()}
    corners = zip(marks.corner_vertices.tolist(), marks.corner_sharpness.tolist(), strict=True)
    return creases, straight, {name[v]: s for v, s in corners}


@pytest.mark.parametrize("dtype", TYPES)
@settings(max_examples=30, deadline=None)
@given(mesh=meshes())
def test_off(dtype: type, mesh: PolygonMesh) -> None:
    out = io.BytesIO()
    write_off(mesh, out, dtype)
    again = read_off(out.getvalue(), "a.off")
    assert again.face_vertices.tolist() == mesh.face_vertices.tolist()
    assert rounded(again.positions, dtype) == rounded(mesh.positions, dtype)
    if mesh.vertex_colors is not None:
        np.testing.assert_array_equal(again.vertex_colors, mesh.vertex_colors)


@pytest.mark.parametrize("ascii", [False, True])
@settings(max_examples=50, deadline=None)
@given(mesh=meshes())
def test_writing_again_gives_the_same_bytes(ascii: bool, mesh: PolygonMesh) -> None:
    first, second, third = io.BytesIO(), io.BytesIO(), io.BytesIO()
    write_ply(mesh, first, ascii)
    once = read_ply(first.getvalue(), "a.ply")
    write_ply(once, second, ascii)
    write_ply(read_ply(second.getvalue(), "a.ply"), third, ascii)
    assert second.getvalue() == third.getvalue()


def mutate(draw: st.DrawFn, data: bytes) -> bytes:
    changed = bytearray(data)
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, max(len(changed) - 1, 0)))
        piece = draw(
            st.sampled_from(
                [b"", b"\0", b"\xff", b"-", b"/", b"\\\n", b"99999999999", b"nan", b"1e999", b"#"]
            )
        )
        changed[at : at + draw(st.integers(0, 3))] = piece or draw(st.binary(max_size=4))
    return bytes(changed[: draw(st.integers(0, len(changed)))] if draw(st.booleans()) else changed)


@settings(max_examples=300, deadline=None)
@given(data=st.data(), mesh=meshes(), format=st.sampled_from(["obj", "ply", "ascii", "off"]))
def test_damaged_files_give_a_mesh_or_a_format_error(
    data: st.DataObject, mesh: PolygonMesh, format: str
) -> None:
    out = io.BytesIO()
    if format == "obj":
        write_obj(mesh, out)
    elif format == "off":
        write_off(mesh, out)
    else:
        write_ply(mesh, out, format == "ascii")
    damaged = data.draw(st.composite(lambda draw: mutate(draw, out.getvalue()))())
    reader = {"obj": read_obj, "off": read_off}.get(format, read_ply)
    try:
        reader(damaged, "a.mesh").validate()
    except FormatError as error:
        assert str(error).startswith("a.mesh")
        assert "\n" not in str(error)
        assert "cannot be read; check the numbers" not in str(error)
        assert "the body has something" not in str(error)


@settings(max_examples=150, deadline=None)
@given(
    data=st.binary(max_size=200),
    lead=st.sampled_from([b"", b"v ", b"f 1 ", b"ply\n", b"OFF\n", b"t crease "]),
)
def test_arbitrary_bytes_give_a_mesh_or_a_format_error(data: bytes, lead: bytes) -> None:
    for reader in (read_obj, read_ply, read_off):
        with suppress(FormatError):
            reader(lead + data, "x").validate()
