"""How large a dense mesh will be, before it is made."""

from __future__ import annotations

import io

from curvify.formats.dense import PlySink
from curvify.refinement import Refinable
from curvify.sinks import DenseLayout

#: Characters of a number in text, sign and dot included, with the blank before it.
DIGITS = {"float32": 11, "float64": 19}


def predicted_faces(surface: Refinable, level: int, triangulate: bool, enough: int | None = None) -> int:
    """Faces of the dense mesh as written; some number above ``enough`` if there are more than that."""
    return surface.face_count(level, enough) * (surface.cell_size - 2 if triangulate else 1)


def predicted_bytes(layout: DenseLayout, format: str, ascii: bool, triangulate: bool) -> int:
    """Size of the file: exact for binary PLY, a good guess for the others."""
    if format == "obj":
        return _obj_bytes(layout, triangulate)
    if format == "ply" and ascii:
        return _text_ply_bytes(layout, triangulate)
    if format == "stl":
        return 84 + 50 * layout.face_count * (layout.cell_size - 2)
    return _ply_bytes(layout, triangulate)


def _ply_bytes(layout: DenseLayout, triangulate: bool) -> int:
    header = io.BytesIO()
    sink = PlySink(header, triangulate)
    sink.anywhere = False  # there is no file whose room could be checked
    sink.begin(layout)
    faces = layout.face_count * sink.per_cell
    return len(header.getvalue()) + layout.wedge_count * sink.vertex_type.itemsize + faces * sink.face_type.itemsize


def _obj_bytes(layout: DenseLayout, triangulate: bool) -> int:
    digits = DIGITS[layout.vertex_type["position"].base.name]
    names = layout.vertex_type.names or ()
    per_vertex = 2 + digits * (6 if "color" in names else 3)
    per_wedge = 3 + 3 * digits + (3 + 2 * digits if "uv" in names else 0)
    indices = 3 if "uv" in names else 2
    per_corner = indices * (len(str(layout.wedge_count)) + 1)
    points = layout.vertex_count * per_vertex + layout.wedge_count * per_wedge
    return points + _face_bytes(layout, triangulate, per_corner)


def _text_ply_bytes(layout: DenseLayout, triangulate: bool) -> int:
    digits = DIGITS[layout.vertex_type["position"].base.name]
    numbers = sum(layout.vertex_type[name].shape[0] for name in layout.vertex_type.names or ())
    return layout.wedge_count * numbers * digits + _face_bytes(layout, triangulate, len(str(layout.wedge_count)) + 1)


def _face_bytes(layout: DenseLayout, triangulate: bool, per_corner: int) -> int:
    sides = 3 if triangulate else layout.cell_size
    return layout.face_count * (layout.cell_size - 2 if triangulate else 1) * (2 + sides * per_corner)
