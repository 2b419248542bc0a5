"""Writing polygon meshes as OBJ files, groups, materials, smoothing groups and tags included."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from curvify.errors import FormatError
from curvify.formats.files import clean_name
from curvify.formats.obj_tags import tag_lines
from curvify.formats.text import blocks, corner_tokens, join_columns, vector_lines
from curvify.formats.wedges import unique_rows
from curvify.mesh import Floats, Ints, PolygonMesh

if TYPE_CHECKING:
    from numpy.typing import NDArray

FloatType = type[np.float32] | type[np.float64] | np.dtype[np.floating]
_FACE_BLOCK = 16384


def round_to(values: Floats, dtype: np.dtype[np.floating], what: str = "coordinate") -> Floats:
    """``values`` in the type they are written in. Raises FormatError where that type cannot hold them."""
    with np.errstate(over="ignore", invalid="ignore"):
        out = values.astype(dtype)
    if np.isinf(out).any():
        raise FormatError(f"a {what} is too large for {dtype.name}; write float64 or scale the mesh down")
    return out


def write_obj(mesh: PolygonMesh, out: BinaryIO, dtype: FloatType | None = None) -> None:
    """Write ``mesh`` as OBJ text to the binary file ``out``.

    Positions, normals and uvs print the shortest digits that round-trip ``dtype`` (float32 or
    float64; by default the mesh's ``position_dtype``). Equal normals and uvs are written once.
    Raises FormatError where a number does not fit the type.
    """
    kind = np.dtype(dtype if dtype is not None else mesh.position_dtype)
    for file in mesh.material_files:
        out.write(f"mtllib {clean_name(file)}\n".encode())
    _write_vertices(mesh, out, kind)
    uvs = _write_shared(out, b"vt", mesh.corner_uvs, kind, "texture coordinate")
    normals = _write_shared(out, b"vn", mesh.corner_normals, kind, "normal")
    _write_faces(mesh, out, uvs, normals)
    out.write(tag_lines(mesh.marks))


def _write_vertices(mesh: PolygonMesh, out: BinaryIO, kind: np.dtype[np.floating]) -> None:
    positions = round_to(mesh.positions, kind)
    colors = None if mesh.vertex_colors is None else float_colors(mesh.vertex_colors)
    for part in blocks(mesh.vertex_count):
        if colors is None:
            out.write(vector_lines(b"v", positions[part]))
        else:
            rows = join_columns([positions[part], colors[part]])
            out.write(b"v " + rows[:-1].replace(b"\n", b"\nv ") + b"\n")


def float_colors(colors: NDArray[np.generic]) -> Floats:
    """Colors as floats, bytes scaled to 0..1."""
    if colors.dtype == np.uint8:
        return (colors.astype(np.float64) / 255).astype(np.float32)
    return colors.astype(np.float32 if colors.dtype.kind != "f" else colors.dtype)


def _write_shared(
    out: BinaryIO, prefix: bytes, rows: Floats | None, kind: np.dtype[np.floating], what: str
) -> Ints | None:
    """Write the distinct rows of a corner attribute; the row of each corner ``(C,)``, -1 for none."""
    if rows is None:
        return None
    index = np.full(len(rows), -1, dtype=np.int64)
    there = ~np.isnan(rows).any(axis=1)
    values = round_to(rows[there], kind, what)
    first, which = unique_rows(values)
    index[there] = which
    for part in blocks(len(first)):
        out.write(vector_lines(prefix, values[first[part]]))
    return index


def _write_faces(mesh: PolygonMesh, out: BinaryIO, uvs: Ints | None, normals: Ints | None) -> None:
    changes = _state_changes(mesh)
    for part in blocks(mesh.face_count, _FACE_BLOCK):
        ends = mesh.face_offsets[part.start : part.stop + 1].tolist()
        corners = slice(ends[0], ends[-1])
        tokens = corner_tokens(
            mesh.face_vertices[corners],
            None if uvs is None else uvs[corners],
            None if normals is None else normals[corners],
        )
        text = []
        for face, (a, b) in enumerate(pairwise(ends), part.start):
            if face in changes:
                text.append(changes[face])
            text.append(b"f " + b" ".join(tokens[a - ends[0] : b - ends[0]]) + b"\n")
        out.write(b"".join(text))


def _state_changes(mesh: PolygonMesh) -> dict[int, bytes]:
    """The g, usemtl and s lines that stand before a face, by face."""
    changes: dict[int, bytes] = {}
    states = (
        (b"g", mesh.face_groups, mesh.group_names, -1),
        (b"usemtl", mesh.face_materials, mesh.material_names, -1),
        (b"s", mesh.face_smoothing, None, 0),
    )
    for keyword, values, names, initial in states:
        if values is None:
            continue
        for face in np.flatnonzero(np.diff(values, prepend=initial)).tolist():
            value = int(values[face])
            if names is None:
                word = str(value) if value else "off"
            else:
                word = clean_name(names[value]) if value >= 0 else ""
            changes[face] = changes.get(face, b"") + (keyword + b" " + word.encode()).rstrip() + b"\n"
    return changes
