"""Writing dense meshes as text, block by block in order: OBJ and ascii PLY."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, BinaryIO

import numpy as np

from curvify.formats.dense import face_columns, ply_header, triangles
from curvify.formats.files import clean_name
from curvify.formats.obj_write import float_colors
from curvify.formats.text import face_lines, join_columns, vector_lines
from curvify.mesh import Ints
from curvify.sinks import DenseLayout


class TextPlySink:
    """Ascii PLY."""

    anywhere = False

    def __init__(self, out: BinaryIO, triangulate: bool = False) -> None:
        self.out, self.triangulate = out, triangulate

    def begin(self, layout: DenseLayout) -> None:
        """Write the header."""
        sides = 3 if self.triangulate else layout.cell_size
        self.columns = list(face_columns(layout.mesh))
        fields: list[tuple[Any, ...]] = [("count", "u1"), ("corners", "<i4", sides)]
        face_type = np.dtype(fields + [(name, "<i4") for name, _ in self.columns])
        faces = layout.face_count * (layout.cell_size - 2 if self.triangulate else 1)
        self.out.write(ply_header(layout, face_type, faces, "ascii"))

    def vertices(self, start: int, records: np.ndarray[Any, Any]) -> None:
        """Write a block of wedges, one a line."""
        self.out.write(join_columns([records[name] for name in records.dtype.names or ()]))

    def faces(self, start: int, wedges: Ints, source_faces: Ints) -> None:
        """Write a block of faces, one a line."""
        if self.triangulate:
            wedges, source_faces = triangles(wedges, source_faces)
        parts = [np.full((len(wedges), 1), wedges.shape[1]), wedges]
        parts += [values[source_faces][:, None] for _, values in self.columns]
        self.out.write(vector_lines(b"", np.concatenate(parts, axis=1)))

    def end(self) -> None:
        """Nothing is left to do."""


class ObjSink:
    """OBJ text: one ``v`` for each vertex, one ``vn`` (and ``vt``) for each wedge, materials and groups kept."""

    anywhere = False

    def __init__(self, out: BinaryIO, triangulate: bool = False) -> None:
        self.out, self.triangulate = out, triangulate

    def begin(self, layout: DenseLayout) -> None:
        """Write the names of the material files."""
        self.layout = layout
        self.has_uv = "uv" in (layout.vertex_type.names or ())
        mesh = layout.mesh
        states = ((b"g", mesh.face_groups, mesh.group_names), (b"usemtl", mesh.face_materials, mesh.material_names))
        self.states = [(word, values, names) for word, values, names in states if values is not None]
        self.current: tuple[int, ...] = (-1,) * len(self.states)
        for name in mesh.material_files:
            self.out.write(f"mtllib {clean_name(name)}\n".encode())

    def vertices(self, start: int, records: np.ndarray[Any, Any]) -> None:
        """Write positions (but not again for repeats), texture coordinates and normals."""
        if start < self.layout.vertex_count:
            if "color" in (records.dtype.names or ()):
                rows = join_columns([records["position"], float_colors(records["color"])])
                self.out.write(b"v " + rows[:-1].replace(b"\n", b"\nv ") + b"\n")
            else:
                self.out.write(vector_lines(b"v", records["position"]))
        if self.has_uv:
            self.out.write(vector_lines(b"vt", records["uv"]))
        self.out.write(vector_lines(b"vn", records["normal"]))

    def faces(self, start: int, wedges: Ints, source_faces: Ints) -> None:
        """Write a block of faces, with the groups and materials where they change."""
        if self.triangulate:
            wedges, source_faces = triangles(wedges, source_faces)
        vertices = wedges
        if len(self.layout.repeats):
            extra = wedges - self.layout.vertex_count
            vertices = np.where(extra < 0, wedges, self.layout.repeats[np.maximum(extra, 0)])
        for part in self._runs(source_faces):
            uv = wedges[part] if self.has_uv else None
            self.out.write(face_lines(vertices[part], uv, wedges[part]))

    def _runs(self, source_faces: Ints) -> Iterator[slice]:
        """Runs of faces with one material and group; writes the lines that announce a new one."""
        if not self.states:
            yield slice(None)
            return
        columns = np.stack([values[source_faces] for _, values, _ in self.states], axis=1)
        heads = np.flatnonzero(np.concatenate([[True], (columns[1:] != columns[:-1]).any(axis=1)]))
        for first, last in zip(heads.tolist(), [*heads[1:].tolist(), len(columns)], strict=True):
            state = tuple(columns[first].tolist())
            for (word, _, names), value, before in zip(self.states, state, self.current, strict=True):
                if value != before:
                    name = clean_name(names[value]).encode() if value >= 0 else b""
                    self.out.write((word + b" " + name).rstrip() + b"\n")
            self.current = state
            yield slice(first, last)

    def end(self) -> None:
        """Nothing is left to do."""
