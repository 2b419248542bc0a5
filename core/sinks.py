"""Where the blocks of a dense mesh go while it is evaluated: the interface, and the sink that fills arrays."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from curvify.mesh import DenseMesh, Ints, PolygonMesh
from curvify.records import record


@record
class DenseLayout:
    """The shape of a dense mesh before it is evaluated.

    ``vertex_type`` is the packed record of one wedge: ``position``, ``normal`` and, where the mesh has them, ``uv``
    and ``color``. ``repeats (R,)`` the vertex of each wedge beyond the vertices.
    """

    vertex_count: int
    repeats: Ints
    face_count: int
    cell_size: int
    vertex_type: np.dtype[np.void]
    mesh: PolygonMesh

    @property
    def wedge_count(self) -> int:
        return self.vertex_count + len(self.repeats)


class Sink(Protocol):
    """Takes the blocks of a dense mesh. ``anywhere``: whether blocks may come in any order, from any thread."""

    anywhere: bool

    def begin(self, layout: DenseLayout) -> None:
        """Told once, before any block."""

    def vertices(self, start: int, records: np.ndarray[Any, Any]) -> None:
        """Wedges from ``start`` on, records of the layout's vertex type."""

    def faces(self, start: int, wedges: Ints, source_faces: Ints) -> None:
        """Faces from ``start`` on: ``wedges (q,s)``, and the input face ``(q,)`` of each."""

    def end(self) -> None:
        """Told once, after the last block."""


class ArraySink:
    """Collects a dense mesh in arrays, filled in place."""

    anywhere = True

    def begin(self, layout: DenseLayout) -> None:
        """Take the memory."""
        self.layout = layout
        self.records = np.empty(layout.wedge_count, dtype=layout.vertex_type)
        wide = layout.wedge_count >= 2**31
        self.wedges = np.empty((layout.face_count, layout.cell_size), dtype=np.int64 if wide else np.int32)
        self.source_faces = np.empty(layout.face_count, dtype=np.int64)

    def vertices(self, start: int, records: np.ndarray[Any, Any]) -> None:
        """Copy a block of wedges to its place."""
        self.records[start : start + len(records)] = records

    def faces(self, start: int, wedges: Ints, source_faces: Ints) -> None:
        """Copy a block of faces to its place."""
        self.wedges[start : start + len(wedges)] = wedges
        self.source_faces[start : start + len(wedges)] = source_faces

    def end(self) -> None:
        """Nothing is left to do."""

    def dense_mesh(self) -> DenseMesh:
        """The dense mesh."""
        layout, mesh, records = self.layout, self.layout.mesh, self.records
        names = records.dtype.names or ()
        vertex_of = np.concatenate([np.arange(layout.vertex_count), layout.repeats])
        faces = vertex_of[self.wedges].astype(self.wedges.dtype) if len(layout.repeats) else self.wedges
        return DenseMesh(
            positions=records["position"][: layout.vertex_count].copy(),
            faces=faces,
            normals=records["normal"].copy(),
            repeats=layout.repeats,
            face_wedges=self.wedges,
            uvs=records["uv"].copy() if "uv" in names else None,
            colors=records["color"][: layout.vertex_count].copy() if "color" in names else None,
            source_faces=self.source_faces,
            face_materials=None if mesh.face_materials is None else mesh.face_materials[self.source_faces],
            material_names=mesh.material_names,
            material_files=mesh.material_files,
            looks=mesh.looks,
            face_groups=None if mesh.face_groups is None else mesh.face_groups[self.source_faces],
            group_names=mesh.group_names,
        )
