"""Writing dense meshes as they are made: block by block, each at its final place where the file allows it.

Binary PLY knows the place of every block beforehand, so that threads write side by side; pipes and text take the
blocks in order. No dense array is ever held whole, except for the formats that trimesh writes.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

import numpy as np

from curvify.errors import FormatError
from curvify.formats import WRITE_FORMATS, atomic_file, find_format, write_stream
from curvify.formats.files import clean_name
from curvify.mesh import DenseMesh, Ints, PolygonMesh
from curvify.sinks import ArraySink, DenseLayout, Sink

_PLY_NAMES = {
    "position": ("x", "y", "z"),
    "normal": ("nx", "ny", "nz"),
    "uv": ("s", "t"),
    "color": ("red", "green", "blue", "alpha"),
}
_PLY_TYPES = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int", "u4": "uint"}


class PlySink:
    """Binary little-endian PLY, written at the final offsets when the file has positions, else in order."""

    def __init__(self, out: BinaryIO, triangulate: bool = False) -> None:
        self.out, self.triangulate = out, triangulate
        self.anywhere = out.seekable() and hasattr(os, "pwrite")
        self._own = threading.local()

    def begin(self, layout: DenseLayout) -> None:
        """Write the header."""
        self.vertex_type = layout.vertex_type
        self.sides = 3 if self.triangulate else layout.cell_size
        self.per_cell = layout.cell_size - 2 if self.triangulate else 1
        index = "<i4" if layout.wedge_count < 2**31 else "<u4"
        fields: list[tuple[Any, ...]] = [("count", "u1"), ("corners", index, self.sides)]
        fields += [(name, "<i4") for name, _ in face_columns(layout.mesh)]
        self.face_type = np.dtype(fields)
        self.columns = [values for _, values in face_columns(layout.mesh)]
        header = ply_header(layout, self.face_type, layout.face_count * self.per_cell, "binary_little_endian")
        self._check_room(len(header) + layout.wedge_count * self.vertex_type.itemsize, layout)
        self.out.write(header)
        self.out.flush()
        if self.anywhere:
            self.origin = self.out.tell()
            self.face_origin = self.origin + layout.wedge_count * self.vertex_type.itemsize

    def _check_room(self, size: int, layout: DenseLayout) -> None:
        """Refuse before the work where the disk cannot hold the file."""
        size += layout.face_count * self.per_cell * self.face_type.itemsize
        if self.anywhere and hasattr(os, "fstatvfs"):
            disk = os.fstatvfs(self.out.fileno())
            if 0 < disk.f_bavail * disk.f_frsize < size:
                raise FormatError(
                    f"the output needs {size / 1e6:,.0f} MB, the disk has "
                    f"{disk.f_bavail * disk.f_frsize / 1e6:,.0f} MB free"
                )

    def vertices(self, start: int, records: np.ndarray[Any, Any]) -> None:
        """Write a block of wedges."""
        self._put(records, self.origin + start * self.vertex_type.itemsize if self.anywhere else 0)

    def faces(self, start: int, wedges: Ints, source_faces: Ints) -> None:
        """Write a block of faces."""
        if self.triangulate:
            wedges, source_faces = triangles(wedges, source_faces)
            start *= self.per_cell
        records = self._face_records(len(wedges))
        self._set_corners(records, wedges)
        for name, values in zip(self.face_type.names[2:], self.columns, strict=True):  # type: ignore[index]
            records[name] = values[source_faces]
        self._put(records, self.face_origin + start * self.face_type.itemsize if self.anywhere else 0)

    def _face_records(self, count: int) -> np.ndarray[Any, Any]:
        """Records of this thread's own, kept from block to block, in which the counts stand already."""
        found: np.ndarray[Any, Any] | None = getattr(self._own, "records", None)
        if found is None or len(found) < count:
            found = self._own.records = np.empty(count, dtype=self.face_type)
            found["count"] = self.sides
        return found[:count]

    def _set_corners(self, records: np.ndarray[Any, Any], wedges: Ints) -> None:
        """Copy all corners of a face as one element: several times faster than a field of numbers."""
        index = self.face_type["corners"].base
        width = self.sides * index.itemsize
        whole = np.ascontiguousarray(wedges, dtype=index).view(f"V{width}")[:, 0]
        np.ndarray((len(records),), f"V{width}", records.data, 1, (self.face_type.itemsize,))[...] = whole

    def _put(self, records: np.ndarray[Any, Any], offset: int) -> None:
        data = records.view(np.uint8).reshape(-1).data if len(records) else memoryview(b"")
        if not self.anywhere:
            self.out.write(data)
            return
        while len(data):
            written = os.pwrite(self.out.fileno(), data, offset)
            data, offset = data[written:], offset + written

    def end(self) -> None:
        """Everything is in its place already."""


def face_columns(mesh: PolygonMesh) -> Iterator[tuple[str, Ints]]:
    """Face properties that a PLY file carries."""
    if mesh.face_materials is not None:
        yield "material_index", mesh.face_materials
    if mesh.face_groups is not None:
        yield "group_index", mesh.face_groups


def ply_header(layout: DenseLayout, face_type: np.dtype[np.void], faces: int, encoding: str) -> bytes:
    """Header of the PLY file of a dense mesh."""
    mesh = layout.mesh
    lines = ["ply", f"format {encoding} 1.0"]
    if mesh.face_materials is not None:
        lines += [f"comment material {clean_name(name)}" for name in mesh.material_names]
    if mesh.face_groups is not None:
        lines += [f"comment group {clean_name(name)}" for name in mesh.group_names]
    lines.append(f"element vertex {layout.wedge_count}")
    for field in layout.vertex_type.names or ():
        kind = layout.vertex_type[field]
        names = _PLY_NAMES[field][: kind.shape[0]]
        lines += [f"property {_PLY_TYPES[kind.base.str[1:]]} {name}" for name in names]
    index = _PLY_TYPES[face_type["corners"].base.str[1:]]
    lines += [f"element face {faces}", f"property list uchar {index} vertex_indices"]
    lines += [f"property int {name}" for name in (face_type.names or ())[2:]]
    return ("\n".join([*lines, "end_header"]) + "\n").encode()


def triangles(cells: Ints, source_faces: Ints) -> tuple[Ints, Ints]:
    """Two triangles for each quad ``(q,4)``, cut from its first corner; triangles stay."""
    if cells.shape[1] == 3:
        return cells, source_faces
    halves = cells[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return halves, np.repeat(source_faces, 2)


@contextmanager
def dense_output(
    path: str | os.PathLike[str],
    format: str | None = None,
    *,
    ascii: bool = False,
    triangulate: bool = False,
    stdout: BinaryIO | None = None,
) -> Iterator[Sink]:
    """A sink that writes a dense mesh to ``path``, or to ``stdout`` for ``-``; complete or not at all.

    The format is ``format``, or told by the suffix. Raises FormatError where the target cannot be written.
    """
    chosen = find_format(path, format, WRITE_FORMATS)
    if os.fspath(path) == "-":
        out = stdout or sys.stdout.buffer
        with _sink(out, chosen, ascii, triangulate, streamed=True) as sink:
            yield sink
        out.flush()
        return
    with atomic_file(path) as out, _sink(out, chosen, ascii, triangulate, streamed=not out.seekable()) as sink:
        yield sink


@contextmanager
def _sink(out: BinaryIO, format: str, ascii: bool, triangulate: bool, streamed: bool) -> Iterator[Sink]:
    if format == "ply" and not ascii:
        binary = PlySink(out, triangulate)
        binary.anywhere = binary.anywhere and not streamed
        yield binary
    elif format in ("obj", "ply"):
        from curvify.formats import dense_text

        yield dense_text.ObjSink(out, triangulate) if format == "obj" else dense_text.TextPlySink(out, triangulate)
    else:
        collected = ArraySink()
        yield collected
        mesh = to_polygon_mesh(collected.dense_mesh(), triangulate)
        write_stream(mesh, out, format)


def to_polygon_mesh(dense: DenseMesh, triangulate: bool = False) -> PolygonMesh:
    """A dense mesh as a polygon mesh with its normals and texture coordinates at the corners."""
    source = dense.source_faces if dense.source_faces is not None else np.zeros(len(dense.faces), dtype=np.int64)
    wedges, faces = dense.face_wedges, dense.faces
    if triangulate:
        wedges, faces = triangles(wedges, source)[0], triangles(faces, source)[0]
    split = triangulate and dense.faces.shape[1] == 4

    def per_face(values: Ints | None) -> Ints | None:
        return None if values is None else np.repeat(values, 2) if split else values

    corners = wedges.reshape(-1)
    return PolygonMesh(
        positions=dense.positions.astype(np.float64),
        face_offsets=np.arange(len(faces) + 1) * faces.shape[1],
        face_vertices=faces.reshape(-1).astype(np.int64),
        corner_normals=dense.normals[corners].astype(np.float64),
        corner_uvs=None if dense.uvs is None else dense.uvs[corners].astype(np.float64),
        vertex_colors=dense.colors,
        face_materials=per_face(dense.face_materials),
        material_names=dense.material_names,
        material_files=dense.material_files,
        looks=dense.looks,
        face_groups=per_face(dense.face_groups),
        group_names=dense.group_names,
        position_dtype=dense.positions.dtype,
    )
