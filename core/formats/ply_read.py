"""Reading PLY files into polygon meshes.

Beyond the usual properties, curvify reads (and writes) its marks and attributes as
- ``element edge`` with ``vertex1 vertex2``, ``crease`` (sharpness 0..1; an integer type means 0 or 1;
  0 says nothing), optionally ``crease2`` (sharpness at vertex2 where it differs), and ``straight``;
- vertex property ``corner`` (sharpness 0..1, 0 says nothing);
- face properties ``flat``, ``hole``, ``smoothing_group``, ``material_index``, ``group_index``, with
  names in header comments ``comment material NAME`` and ``comment group NAME``, in order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from curvify.arrays import all_finite, offsets_of, take_rows
from curvify.errors import FormatError
from curvify.formats.ply_header import Header, read_header
from curvify.formats.ply_tables import Table, read_tables
from curvify.formats.scan import spread
from curvify.mesh import Bools, Floats, Ints, Marks, PolygonMesh
from curvify.records import record

if TYPE_CHECKING:
    from numpy.typing import NDArray

_INDEX_NAMES = ("vertex_indices", "vertex_index")
_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_FAR = 2.0**62


def read_ply(data: bytes, name: str) -> PolygonMesh:
    """Parse a PLY file, ascii or binary; ``name`` is what errors call it.

    Positions float64 (V,3), ``position_dtype`` as stored (float32 for integers). Normals and uvs of
    vertices become those of their corners; a normal of length zero or not finite counts as none.
    Colors are uint8 or float as stored. Faces with fewer than three corners are left out with a
    warning. Raises FormatError with the line (ascii) or byte (binary) for what cannot be read.
    """
    header = read_header(data, name)
    tables = read_tables(data, header, name)
    vertex = tables.get("vertex")
    if vertex is None:
        raise FormatError(f"{name}: the header has no element 'vertex'; this PLY file holds no mesh")
    positions, dtype = _positions(vertex)
    warnings: list[str] = []
    faces = _faces(tables, len(positions), warnings)
    materials, material_names = _named(faces, header, "material")
    groups, group_names = _named(faces, header, "group")
    smoothing = faces.values("smoothing_group")
    return PolygonMesh(
        positions,
        offsets_of(faces.sizes),
        faces.vertices,
        corner_normals=_normals(vertex, faces),
        corner_uvs=_uvs(vertex, faces, warnings),
        vertex_colors=_colors(vertex, warnings),
        face_materials=materials,
        material_names=material_names,
        face_groups=groups,
        group_names=group_names,
        face_smoothing=smoothing if smoothing is not None and smoothing.any() else None,
        marks=_marks(tables, faces),
        position_dtype=dtype,
        warnings=tuple(warnings),
    )


@record
class _Faces:
    """``sizes (F,)``, ``vertices (C,)``; the face table, if any, and which of its rows were ``kept (n,)``."""

    sizes: Ints
    vertices: Ints
    table: Table | None = None
    kept: Bools | None = None

    def values(self, name: str) -> Ints | None:
        """An integer property of the faces ``(F,)``, None if the file has none of that name."""
        if self.table is None or not _has(self.table, name):
            return None
        assert self.kept is not None
        return _to_ints(self.table, name, self.table.column(name))[self.kept]


def _has(table: Table, *names: str) -> bool:
    """Whether the table has scalar properties of all these names."""
    return all(n in table.slots and table.slots[n].count_type is None for n in names)


def _floats(table: Table, *names: str) -> Floats:
    """Scalar properties side by side ``(count,k)`` float64, rounded to the declared type."""
    side_by_side = table.side_by_side(*names)
    if side_by_side is not None:
        return side_by_side.astype(np.float64)
    out = np.empty((table.element.count, len(names)))
    with np.errstate(over="ignore", invalid="ignore"):
        for k, name in enumerate(names):
            declared = table.element.type_of(name)
            column = table.column(name)
            out[:, k] = column.astype(declared) if declared.kind == "f" else column
    return out


def _to_ints(table: Table, name: str, values: NDArray[np.generic], counts: Ints | None = None) -> Ints:
    """Stored values as int64, one for each row or ``counts``; raises FormatError where a float is no whole number."""
    if values.dtype.kind == "f":
        with np.errstate(invalid="ignore"):
            wrong = np.flatnonzero(~((np.abs(values) < _FAR) & (values == np.floor(values))))
        if len(wrong):
            row = int(wrong[0]) if counts is None else int(_rows_of(counts)[wrong[0]])
            raise table.error(row, f"property '{name}' has a value that is not a whole number")
    elif values.dtype == np.uint64 or values.dtype == np.dtype(">u8"):
        values = np.minimum(values, np.uint64(2**62))
    return values.astype(np.int64)


def _positions(vertex: Table) -> tuple[Floats, np.dtype[np.floating]]:
    if not _has(vertex, "x", "y", "z"):
        raise FormatError(
            f"{vertex.body.name}:{vertex.element.line}: element 'vertex' has no properties x, y and z"
        )
    positions = _floats(vertex, "x", "y", "z")
    if not all_finite(positions):
        wild = np.flatnonzero(~np.isfinite(positions).all(axis=1))
        raise vertex.error(
            wild[0], f"vertex {wild[0]} has a coordinate that is not a finite number; remove or mend it"
        )
    double = any(vertex.element.type_of(axis) == np.float64 for axis in "xyz")
    return positions, np.dtype(np.float64 if double else np.float32)


def _rows_of(counts: Ints) -> Ints:
    """The row of each item of a list property."""
    return np.repeat(np.arange(len(counts)), counts)


def _index_lists(table: Table) -> tuple[Ints, Ints]:
    """Lengths and items of the vertex index list."""
    name = next((n for n in _INDEX_NAMES if n in table.slots and table.slots[n].count_type is not None), None)
    if name is None:
        if not table.element.count:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        place = f"{table.body.name}:{table.element.line}"
        raise FormatError(f"{place}: element '{table.element.name}' has no list property vertex_indices")
    counts, items = table.lists(name)
    return counts, _to_ints(table, name, items, counts).reshape(-1)


def _check_range(table: Table, indices: Ints, vertices: int, rows: Callable[[], Ints]) -> None:
    if len(indices) and not (indices.min() >= 0 and indices.max() < vertices):
        wrong = np.flatnonzero((indices < 0) | (indices >= vertices))
        row = int(rows()[wrong[0]])
        what = f"{table.element.name} {row} refers to vertex {indices[wrong[0]]}"
        raise table.error(row, f"{what}, the file has {vertices} (counted from 0)")


def _faces(tables: dict[str, Table], vertices: int, warnings: list[str]) -> _Faces:
    """The faces of the face element, and after them those of triangle strips."""
    faces = _Faces(np.zeros(0, np.int64), np.zeros(0, np.int64))
    if "face" in tables:
        table = tables["face"]
        counts, indices = _index_lists(table)
        _check_range(table, indices, vertices, lambda: _rows_of(counts))
        kept = counts >= 3
        if not kept.all():
            warnings.append(_skipped(int((~kept).sum()), int(np.argmin(kept))))
            counts, indices = counts[kept], indices[np.repeat(kept, counts)]
        faces = _Faces(counts, indices, table, kept)
    if "tristrips" in tables:
        triangles = _strip_triangles(tables["tristrips"], vertices)
        if faces.sizes.size and len(triangles):
            warnings.append("the file has both faces and triangle strips: attributes of faces were ignored")
            faces = _Faces(faces.sizes, faces.vertices)
        if len(triangles):
            sizes = np.concatenate([faces.sizes, np.full(len(triangles), 3)])
            faces = _Faces(sizes, np.concatenate([faces.vertices, triangles.reshape(-1)]))
    return faces


def _skipped(count: int, first: int) -> str:
    faces = (
        "1 face with fewer than 3 corners was"
        if count == 1
        else f"{count} faces with fewer than 3 corners were"
    )
    return f"{faces} skipped, the first is face {first} (counted from 0)"


def _strip_triangles(table: Table, vertices: int) -> Ints:
    """Triangles ``(n,3)`` of strips in which -1 starts anew; every second one is turned round."""
    counts, items = _index_lists(table)
    rows, real = _rows_of(counts), items != -1
    _check_range(table, items[real], vertices, lambda: rows[real])
    if len(items) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    begins = np.ones(len(items), dtype=np.bool_)
    begins[1:] = ~real[:-1] | (rows[1:] != rows[:-1])
    place = np.arange(len(items))
    place -= np.maximum.accumulate(np.where(begins, place, 0))
    ends = np.flatnonzero(real & (place >= 2))
    turned = place[ends] % 2 == 1
    a, b = ends - 2 + turned, ends - 1 - turned
    triangles = np.stack([items[a], items[b], items[ends]], axis=1)
    proper = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    kept: Ints = triangles[proper]
    return kept


def _normals(vertex: Table, faces: _Faces) -> Floats | None:
    if not _has(vertex, "nx", "ny", "nz"):
        return None
    normals = _floats(vertex, "nx", "ny", "nz")
    squares = np.einsum("vi,vi->v", normals, normals)
    if not (all_finite(squares) and squares.all()):
        normals[~(np.isfinite(normals).all(axis=1) & normals.any(axis=1))] = np.nan
    return _or_none(take_rows(normals, faces.vertices))


def _or_none(rows: Floats) -> Floats | None:
    return None if np.isnan(rows[:1]).all() and np.isnan(rows).all() else rows


def _uvs(vertex: Table, faces: _Faces, warnings: list[str]) -> Floats | None:
    table = faces.table
    if table is not None and "texcoord" in table.slots and table.slots["texcoord"].count_type is not None:
        uvs = _face_uvs(table, faces, warnings)
        if uvs is not None:
            return uvs
    for pair in _UV_NAMES:
        if _has(vertex, *pair):
            uvs = _floats(vertex, *pair)
            uvs[~np.isfinite(uvs).all(axis=1)] = np.nan
            return _or_none(take_rows(uvs, faces.vertices))
    return None


def _face_uvs(table: Table, faces: _Faces, warnings: list[str]) -> Floats | None:
    """The texcoord lists of the faces, two numbers for each corner."""
    assert faces.kept is not None
    counts, items = table.lists("texcoord")
    items = items.reshape(-1)
    declared = table.element.type_of("texcoord")
    with np.errstate(over="ignore", invalid="ignore"):
        values = (
            items.astype(declared).astype(np.float64) if declared.kind == "f" else items.astype(np.float64)
        )
    starts = (np.cumsum(counts) - counts)[faces.kept]
    fits = counts[faces.kept] == 2 * faces.sizes
    out = np.full((len(faces.vertices), 2), np.nan)
    out[np.repeat(fits, faces.sizes)] = values[spread(starts[fits], 2 * faces.sizes[fits])].reshape(-1, 2)
    odd = int((~fits & (counts[faces.kept] > 0)).sum())
    if odd:
        warnings.append(f"{odd} faces have a texcoord list that does not fit their corners: ignored")
    out[~np.isfinite(out).all(axis=1)] = np.nan
    return _or_none(out)


def _colors(vertex: Table, warnings: list[str]) -> NDArray[np.generic] | None:
    """Colors ``(V,3|4)``: uint8, or float as stored; other integer types are clipped to 0..255."""
    names: tuple[str, ...] = ("red", "green", "blue")
    if not _has(vertex, *names):
        return None
    names = (*names, "alpha") if _has(vertex, "alpha") else names
    values = _floats(vertex, *names)
    if not np.isfinite(values).all():
        warnings.append("some vertex colors are not finite numbers: taken as 0")
        values[~np.isfinite(values)] = 0.0
    kinds = [vertex.element.type_of(n) for n in names]
    if all(kind.kind == "f" for kind in kinds):
        return values.astype(np.result_type(*kinds))
    return np.clip(values, 0, 255).astype(np.uint8)


def _named(faces: _Faces, header: Header, what: str) -> tuple[Ints | None, tuple[str, ...]]:
    """Material or group of each face, and the names."""
    names = [c.partition(" ")[2].strip() for c in header.comments if c.partition(" ")[0] == what]
    index = faces.values(f"{what}_index")
    if index is None:
        return None, ()
    index = np.maximum(index, -1)
    if index.max(initial=-1) >= len(names):
        # Foreign indices may be any numbers: name the ones that occur.
        used, index = np.unique(index, return_inverse=True)
        lead = int(len(used) > 0 and used[0] == -1)
        return index - lead, tuple(f"{what}_{value}" for value in used[lead:].tolist())
    return index, tuple(names)


def _marks(tables: dict[str, Table], faces: _Faces) -> Marks:
    marks = _edge_marks(tables)
    vertex = tables["vertex"]
    if _has(vertex, "corner"):
        sharpness = np.clip(np.nan_to_num(_floats(vertex, "corner")[:, 0]), 0.0, 1.0)
        marks.corner_vertices = np.flatnonzero(sharpness > 0)
        marks.corner_sharpness = sharpness[marks.corner_vertices]
    flat, hole = faces.values("flat"), faces.values("hole")
    if flat is not None:
        marks.flat_faces = np.flatnonzero(flat)
    if hole is not None:
        marks.hole_faces = np.flatnonzero(hole)
    return marks


def _edge_marks(tables: dict[str, Table]) -> Marks:
    marks = Marks()
    table = tables.get("edge")
    if table is None or not _has(table, "vertex1", "vertex2"):
        return marks
    columns = [_to_ints(table, n, table.column(n)) for n in ("vertex1", "vertex2")]
    rows = np.arange(table.element.count)
    for column in columns:
        _check_range(table, column, tables["vertex"].element.count, lambda: rows)
    edges = np.stack(columns, axis=1)
    if _has(table, "crease"):
        ends = ("crease", "crease2" if _has(table, "crease2") else "crease")
        sharpness = np.clip(np.nan_to_num(_floats(table, *ends)), 0.0, 1.0)
        marked = (sharpness > 0).any(axis=1)
        marks.crease_edges, marks.crease_sharpness = edges[marked], sharpness[marked]
    if _has(table, "straight"):
        marks.straight_edges = edges[_to_ints(table, "straight", table.column("straight")) != 0]
    return marks
