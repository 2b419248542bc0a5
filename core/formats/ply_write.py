"""Writing polygon meshes as PLY files, binary little-endian or ascii (see ply_read for the marks)."""

from __future__ import annotations

from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from curvify.formats.files import clean_name
from curvify.formats.obj_write import FloatType, round_to
from curvify.formats.text import join_columns, polygon_lines
from curvify.formats.wedges import Wedges, split_vertices, wedge_rows
from curvify.mesh import Bools, Floats, Ints, PolygonMesh
from curvify.records import record

if TYPE_CHECKING:
    from numpy.typing import NDArray

_TYPE_NAMES = {
    "i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort",
    "i4": "int", "u4": "uint", "f4": "float", "f8": "double",
}  # fmt: skip
_COLOR_NAMES = ("red", "green", "blue", "alpha")
_BLOCK = 65536


@record
class _Group:
    """Scalar properties of one type side by side: ``values (n,k)`` with k names."""

    names: tuple[str, ...]
    values: NDArray[np.generic]


def write_ply(mesh: PolygonMesh, out: BinaryIO, ascii: bool = False, dtype: FloatType | None = None) -> None:
    """Write ``mesh`` as PLY to the binary file ``out``.

    Positions, normals and uvs are stored in ``dtype`` (float32 or float64; by default the mesh's
    ``position_dtype``). A vertex whose corners differ in normal or uv is repeated after all others,
    in (vertex, first corner) order; a marked edge is listed for each such copy.
    Raises FormatError where a number does not fit the type.
    """
    kind = np.dtype(dtype if dtype is not None else mesh.position_dtype)
    wedges = split_vertices(mesh, kind)
    vertex = _vertex_groups(mesh, wedges, kind)
    face = _face_groups(mesh)
    edge = _edge_groups(mesh, wedges)
    list_types = _list_types(mesh, len(wedges.vertices))
    out.write(_header(mesh, len(wedges.vertices), vertex, face, edge, list_types, ascii))
    _write_rows(out, vertex, ascii)
    _write_faces(out, mesh.face_offsets, wedges.face_wedges, face, list_types, ascii)
    _write_rows(out, edge, ascii)


def _vertex_groups(mesh: PolygonMesh, wedges: Wedges, kind: np.dtype[np.floating]) -> list[_Group]:
    groups = [_Group(("x", "y", "z"), round_to(mesh.positions, kind)[wedges.vertices])]
    if mesh.corner_normals is not None:
        normals = round_to(wedge_rows(wedges, mesh.corner_normals, 0.0), kind, "normal")
        groups.append(_Group(("nx", "ny", "nz"), normals))
    if mesh.corner_uvs is not None:
        uvs = round_to(wedge_rows(wedges, mesh.corner_uvs, np.nan), kind, "texture coordinate")
        groups.append(_Group(("s", "t"), uvs))
    if mesh.vertex_colors is not None:
        colors = mesh.vertex_colors[wedges.vertices]
        if colors.dtype.kind != "f":
            colors = colors.astype(np.uint8)
        groups.append(_Group(_COLOR_NAMES[: colors.shape[1]], colors))
    if len(mesh.marks.corner_vertices):
        sharpness = np.zeros(mesh.vertex_count)
        sharpness[mesh.marks.corner_vertices] = mesh.marks.corner_sharpness
        groups.append(_Group(("corner",), _narrow(sharpness[wedges.vertices])[:, None]))
    return groups


def _narrow(sharpness: Floats) -> Floats:
    """Sharpness as float32 where that keeps every value, else as it is."""
    narrow = sharpness.astype(np.float32)
    return narrow if bool((narrow == sharpness).all()) else sharpness


def _face_groups(mesh: PolygonMesh) -> list[_Group]:
    groups = []
    for name, chosen in (("flat", mesh.marks.flat_faces), ("hole", mesh.marks.hole_faces)):
        if len(chosen):
            flags = np.zeros((mesh.face_count, 1), dtype=np.uint8)
            flags[chosen] = 1
            groups.append(_Group((name,), flags))
    columns = (
        ("material_index", mesh.face_materials),
        ("group_index", mesh.face_groups),
        ("smoothing_group", mesh.face_smoothing),
    )
    for name, values in columns:
        if values is not None:
            groups.append(_Group((name,), values.astype(_integer_type(values))[:, None]))
    return groups


def _integer_type(values: Ints) -> str:
    """The PLY type that holds ids: int, or what it takes."""
    high = int(values.max(initial=0))
    return "i4" if high < 2**31 else "u4" if high < 2**32 else "f8"


def _edge_groups(mesh: PolygonMesh, wedges: Wedges) -> list[_Group]:
    """Marked edges, those with several marks once, and once for each pair of wedges at their ends."""
    marks = mesh.marks
    if not len(marks.crease_edges) and not len(marks.straight_edges):
        return []
    sharpness: dict[tuple[int, int], tuple[float, float]] = {}
    for (a, b), (s, e) in zip(marks.crease_edges.tolist(), marks.crease_sharpness.tolist(), strict=True):
        sharpness.pop((b, a), None)
        sharpness[a, b] = (s, e)
    straight: dict[tuple[int, int], None] = {}
    for a, b in marks.straight_edges.tolist():
        straight[(b, a) if (b, a) in sharpness else (a, b)] = None
    pairs = list(sharpness) + [edge for edge in straight if edge not in sharpness]
    edges = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    ends = np.array([sharpness.get(edge, (0.0, 0.0)) for edge in pairs]).reshape(-1, 2)
    flags = np.array([edge in straight for edge in pairs], dtype=np.uint8)
    shown, which = _wedge_edges(mesh, wedges, edges)
    groups = [_Group(("vertex1", "vertex2"), shown.astype(np.int32))]
    if len(marks.crease_edges):
        ends = _narrow(ends)
        equal = bool((ends[:, 0] == ends[:, 1]).all())
        groups.append(
            _Group(("crease",) if equal else ("crease", "crease2"), ends[which, : 1 if equal else 2])
        )
    if len(marks.straight_edges):
        groups.append(_Group(("straight",), flags[which, None]))
    return groups


def _wedge_edges(mesh: PolygonMesh, wedges: Wedges, edges: Ints) -> tuple[Ints, Ints]:
    """The wedge pairs ``(m,2)`` in which faces show ``edges (n,2)``, and the edge of each ``(m,)``."""
    following = np.arange(1, mesh.corner_count + 1)
    full = mesh.face_sizes > 0
    following[mesh.face_offsets[1:][full] - 1] = mesh.face_offsets[:-1][full]
    start, end = mesh.face_vertices, mesh.face_vertices[following]
    shift = max(mesh.vertex_count, 1)
    wanted = edges[:, 0] * shift + edges[:, 1]
    order = np.argsort(wanted, kind="stable")
    found: list[tuple[int, int, int]] = []
    for key, here, there in (
        (start * shift + end, wedges.face_wedges, wedges.face_wedges[following]),
        (end * shift + start, wedges.face_wedges[following], wedges.face_wedges),
    ):
        place = np.minimum(np.searchsorted(wanted[order], key), len(edges) - 1)
        hit = np.flatnonzero(wanted[order][place] == key)
        found += zip(order[place[hit]].tolist(), here[hit].tolist(), there[hit].tolist(), strict=True)
    missing = set(range(len(edges))) - {edge for edge, _, _ in found}
    found += [(edge, int(edges[edge, 0]), int(edges[edge, 1])) for edge in missing]
    rows = np.array(sorted(set(found)), dtype=np.int64).reshape(-1, 3)
    return rows[:, 1:], rows[:, 0]


def _list_types(mesh: PolygonMesh, vertices: int) -> tuple[str, str]:
    """Types of the count and the items of the face lists."""
    largest = int(mesh.face_sizes.max(initial=0))
    count = "u1" if largest < 2**8 else "u2" if largest < 2**16 else "i4"
    return count, "i4" if vertices < 2**31 else "u4"


def _header(
    mesh: PolygonMesh,
    vertices: int,
    vertex: list[_Group],
    face: list[_Group],
    edge: list[_Group],
    list_types: tuple[str, str],
    ascii: bool,
) -> bytes:
    lines = ["ply", f"format {'ascii' if ascii else 'binary_little_endian'} 1.0"]
    if mesh.face_materials is not None:
        lines += [f"comment material {clean_name(n)}" for n in mesh.material_names]
    if mesh.face_groups is not None:
        lines += [f"comment group {clean_name(n)}" for n in mesh.group_names]
    lines += [f"element vertex {vertices}", *_property_lines(vertex)]
    count, item = (_TYPE_NAMES[t] for t in list_types)
    lines += [
        f"element face {mesh.face_count}",
        f"property list {count} {item} vertex_indices",
        *_property_lines(face),
    ]
    if edge:
        lines += [f"element edge {len(edge[0].values)}", *_property_lines(edge)]
    return ("\n".join([*lines, "end_header"]) + "\n").encode()


def _property_lines(groups: list[_Group]) -> list[str]:
    return [f"property {_TYPE_NAMES[g.values.dtype.str[1:]]} {name}" for g in groups for name in g.names]


def _write_rows(out: BinaryIO, groups: list[_Group], ascii: bool) -> None:
    """Rows of scalar properties."""
    count = len(groups[0].values) if groups else 0
    for start in range(0, count, _BLOCK):
        parts = [g.values[start : start + _BLOCK] for g in groups]
        if ascii:
            out.write(join_columns(parts))
        else:
            out.write(np.concatenate([_row_bytes(p) for p in parts], axis=1).tobytes())


def _row_bytes(values: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Rows ``(n,k)`` as little-endian bytes ``(n, k * itemsize)``."""
    little = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    return little.view(np.uint8).reshape(len(values), -1)


def _write_faces(
    out: BinaryIO, offsets: Ints, wedges: Ints, groups: list[_Group], list_types: tuple[str, str], ascii: bool
) -> None:
    for start in range(0, len(offsets) - 1, _BLOCK):
        part = offsets[start : start + _BLOCK + 1]
        extra = [g.values[start : start + len(part) - 1] for g in groups]
        corners = wedges[part[0] : part[-1]]
        sizes = np.diff(part)
        out.write(
            _face_text(sizes, corners, extra) if ascii else _face_bytes(sizes, corners, extra, list_types)
        )


def _face_text(sizes: Ints, corners: Ints, extra: list[NDArray[np.generic]]) -> bytes:
    tails = [b" " + line for line in join_columns(extra).splitlines()] if extra else None
    return polygon_lines(sizes, corners, tails)


def _face_bytes(
    sizes: Ints, corners: Ints, extra: list[NDArray[np.generic]], list_types: tuple[str, str]
) -> bytes:
    """Rows of differing length, filled column by column into one buffer."""
    count_type, item_type = (np.dtype(t) for t in list_types)
    heads = _row_bytes(sizes.astype(count_type)[:, None])
    tails = [_row_bytes(e) for e in extra]
    tail_size = sum(t.shape[1] for t in tails)
    lengths = heads.shape[1] + sizes * item_type.itemsize + tail_size
    ends = np.cumsum(lengths)
    buffer = np.empty(int(ends[-1]) if len(ends) else 0, dtype=np.uint8)
    taken: Bools = np.ones(len(buffer), dtype=np.bool_)
    for block, at in _places(heads, tails, ends - lengths, ends, tail_size):
        buffer[at] = block
        taken[at] = False
    # What is left, in order, are the indices.
    buffer[taken] = _row_bytes(corners.astype(item_type)[:, None]).reshape(-1)
    return buffer.tobytes()


def _places(
    heads: NDArray[np.uint8], tails: list[NDArray[np.uint8]], starts: Ints, ends: Ints, tail_size: int
) -> list[tuple[NDArray[np.uint8], Ints]]:
    """Each column block with the buffer positions ``(n,size)`` that it fills."""
    places: list[tuple[NDArray[np.uint8], Ints]] = [(heads, starts[:, None] + np.arange(heads.shape[1]))]
    at = ends - tail_size
    for tail in tails:
        places.append((tail, at[:, None] + np.arange(tail.shape[1])))
        at = at + tail.shape[1]
    return places
