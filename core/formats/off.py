"""Object File Format (OFF) in its text form, both ways; polygons stay polygons."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from curvify.errors import FormatError
from curvify.formats.obj_write import FloatType, round_to
from curvify.formats.scan import Lines, check_rows, parse_rows, split_lines, spread, take_columns
from curvify.formats.text import join_columns, polygon_lines
from curvify.formats.wedges import split_vertices, wedge_rows
from curvify.mesh import Floats, Ints, PolygonMesh

if TYPE_CHECKING:
    from numpy.typing import NDArray

_HEADER = re.compile(rb"(ST)?(C)?(N)?(4)?OFF(?!\w)", re.IGNORECASE)
_COUNTS = re.compile(rb"\s*(\d{1,18})\s+(\d{1,18})(\s+\d{1,18})?\s*\Z")


def read_off(data: bytes, name: str) -> PolygonMesh:
    """Parse a text OFF file (also COFF, NOFF, STOFF, 4OFF); ``name`` is what errors call it.

    Positions float64 (V,3), ``position_dtype`` float32. Normals of vertices become those of their
    corners; colors are uint8 if all are whole numbers, else float32; texture coordinates and colors
    of faces are left out. One vertex or face stands on each line. Raises FormatError with the line.
    """
    lines = split_lines(data, name)
    used = _used_lines(lines)
    letters, used = _take_header(lines, used)
    vertex_count, face_count = _counts(lines, used)
    vertices = used[1 : 1 + vertex_count]
    values, widths = parse_rows(lines, vertices)
    check_rows(lines, vertices, values, widths, 3, "vertex")
    warnings: list[str] = []
    offsets, indices = _faces(
        lines, used[1 + vertex_count : 1 + vertex_count + face_count], vertex_count, warnings
    )
    at = 4 if "4" in letters else 3
    normals = None
    if "N" in letters and widths.min(initial=at + 3) >= at + 3:
        normals = take_columns(values, widths, at, at + 3).copy()
        normals[~(np.isfinite(normals).all(axis=1) & normals.any(axis=1))] = np.nan
        normals = None if np.isnan(normals[indices]).all() else normals[indices]
        at += 3
    return PolygonMesh(
        take_columns(values, widths, 0, 3).copy(),
        offsets,
        indices,
        corner_normals=normals,
        vertex_colors=_colors(values, widths, at) if "C" in letters else None,
        position_dtype=np.dtype(np.float32),
        warnings=tuple(warnings),
    )


def _used_lines(lines: Lines) -> Ints:
    """Blank out comments; the lines on which something is left."""
    marks = np.flatnonzero(lines.text == ord("#"))
    owner, first = np.unique(np.searchsorted(lines.starts, marks, side="right") - 1, return_index=True)
    bare = np.ones(len(lines.starts), dtype=np.bool_)
    for line, begin in zip(owner.tolist(), marks[first].tolist(), strict=True):
        lines.text[begin : lines.ends[line]] = 32
        bare[line] = begin > lines.starts[line]
    return np.flatnonzero(bare & (lines.starts < lines.ends))


def _take_header(lines: Lines, used: Ints) -> tuple[str, Ints]:
    """The letters before OFF, and the lines from the counts on."""
    if not len(used):
        raise FormatError(f"{lines.name}:1: the file is empty; it should begin with OFF")
    line = int(used[0])
    match = _HEADER.match(lines.get(line))
    if match is None:
        if _COUNTS.match(lines.get(line)):
            return "", used
        raise lines.error(line, "not an OFF file: it begins with neither OFF nor the counts")
    rest = lines.get(line)[match.end() :].strip()
    if rest.upper().startswith(b"BINARY"):
        raise lines.error(line, "binary OFF files are not supported; save it as text, or as PLY")
    letters = "".join(part.decode().upper() for part in match.groups() if part)
    if not rest:
        return letters, used[1:]
    lines.text[lines.starts[line] : lines.starts[line] + match.end()] = 32
    return letters, used


def _counts(lines: Lines, used: Ints) -> tuple[int, int]:
    """Numbers of vertices and faces, which must not exceed the lines that follow."""
    match = _COUNTS.match(lines.get(int(used[0]))) if len(used) else None
    if match is None:
        message = "the numbers of vertices, faces and edges should stand here"
        raise lines.error(int(used[0]) if len(used) else len(lines.starts) - 1, message)
    vertices, faces = int(match[1]), int(match[2])
    if vertices + faces > len(used) - 1:
        what = f"{vertices} vertices and {faces} faces are announced, only {len(used) - 1} lines follow"
        raise lines.error(int(used[0]), f"{what}; the file is cut short or the counts are wrong")
    if vertices + faces < len(used) - 1:
        raise lines.error(
            int(used[1 + vertices + faces]), "the file goes on after its last face; the counts are too small"
        )
    return vertices, faces


def _faces(lines: Lines, chosen: Ints, vertices: int, warnings: list[str]) -> tuple[Ints, Ints]:
    """Offsets and vertex indices of the faces; those with under three corners are left out."""
    values, widths = parse_rows(lines, chosen)
    starts = np.cumsum(widths) - widths
    sizes = take_columns(values, widths, 0, 1)[:, 0]
    wrong = np.flatnonzero(~((sizes >= 0) & (sizes < widths) & (sizes == np.floor(sizes))))
    if len(wrong):
        raise lines.error(
            int(chosen[wrong[0]]), "face has fewer vertices than its first number says, or no such number"
        )
    counts = sizes.astype(np.int64)
    picked = values[spread(starts + 1, counts)]
    bad = np.flatnonzero(~((picked >= 0) & (picked < vertices) & (picked == np.floor(picked))))
    if len(bad):
        face = int(np.searchsorted(np.cumsum(counts), bad[0], side="right"))
        index = f"{picked[bad[0]]:.17g}"
        raise lines.error(
            int(chosen[face]), f"face refers to vertex {index}, the file has {vertices} (counted from 0)"
        )
    kept = counts >= 3
    if not kept.all():
        first = lines.number(int(chosen[np.argmin(kept)]))
        warnings.append(
            f"faces with fewer than 3 corners were skipped: {int((~kept).sum())}, the first at line {first}"
        )
    indices = picked[np.repeat(kept, counts)].astype(np.int64)
    return np.concatenate([[0], np.cumsum(counts[kept])]).astype(np.int64), indices


def _colors(values: Floats, widths: Ints, at: int) -> NDArray[np.generic] | None:
    """The three or four numbers from column ``at`` on, if every vertex has them."""
    width = min(int(widths.min()) - at, 4) if len(widths) else 0
    if width < 3:
        return None
    colors = take_columns(values, widths, at, at + width)
    if not np.isfinite(colors).all():
        return None
    if bool((colors == np.floor(colors)).all()) and colors.max(initial=0) > 1:
        return np.clip(colors, 0, 255).astype(np.uint8)
    return np.clip(colors, -3e38, 3e38).astype(np.float32)


def write_off(mesh: PolygonMesh, out: BinaryIO, dtype: FloatType | None = None) -> None:
    """Write ``mesh`` as text OFF: positions, polygons, vertex colors, and normals where each vertex has one.

    Numbers print the shortest digits that round-trip ``dtype`` (by default the mesh's ``position_dtype``).
    """
    kind = np.dtype(dtype if dtype is not None else mesh.position_dtype)
    parts: list[NDArray[np.generic]] = [round_to(mesh.positions, kind)]
    letters = ""
    wedges = split_vertices(mesh, kind, uvs=False)
    if mesh.corner_normals is not None and len(wedges.vertices) == mesh.vertex_count:
        parts.append(round_to(wedge_rows(wedges, mesh.corner_normals, 0.0), kind, "normal"))
        letters = "N"
    if mesh.vertex_colors is not None:
        parts.append(mesh.vertex_colors)
        letters = "C" + letters
    out.write(f"{letters}OFF\n{mesh.vertex_count} {mesh.face_count} 0\n".encode())
    out.write(join_columns(parts))
    out.write(polygon_lines(mesh.face_sizes, mesh.face_vertices))
