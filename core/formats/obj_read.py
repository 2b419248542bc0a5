"""Reading OBJ files into polygon meshes, polygons of any size and all attributes kept."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from curvify.formats.obj_faces import FaceCorners, read_faces
from curvify.formats.obj_tags import TagError, Tags, check_ranges, to_marks
from curvify.formats.scan import BLANK, Lines, check_rows, parse_rows, quote, split_lines, take_columns
from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.records import field, record

if TYPE_CHECKING:
    from numpy.typing import NDArray

_EMPTY, _VERTEX, _UV, _NORMAL, _FACE, _SKIPPED, _OTHER = range(7)
_COMMENT_IN_NAME = rb"(?s)[ \t]#.*"
_SMOOTHING_LIMIT = 2**62


@record
class _States:
    """The values that one kind of state line took, and the lines from which each holds."""

    lines: list[int] = field(default_factory=list)
    values: list[int] = field(default_factory=list)

    def of_faces(self, face_lines: Ints, initial: int) -> Ints:
        """The value in force at each face line ``(n,)``."""
        values = np.array([initial, *self.values], dtype=np.int64)
        return values[np.searchsorted(np.array(self.lines, dtype=np.int64), face_lines, side="right")]


@record
class _Context:
    """Everything that the lines other than v, vt, vn and f say."""

    materials: _States = field(default_factory=_States)
    groups: _States = field(default_factory=_States)
    objects: _States = field(default_factory=_States)
    smoothing: _States = field(default_factory=_States)
    material_names: dict[str, int] = field(default_factory=dict)
    group_names: dict[str, int] = field(default_factory=dict)
    object_names: dict[str, int] = field(default_factory=dict)
    files: dict[str, None] = field(default_factory=dict)
    tags: Tags = field(default_factory=Tags)
    unknown: dict[str, int] = field(default_factory=dict)


def read_obj(data: bytes, name: str) -> PolygonMesh:
    """Parse an OBJ file; ``name`` is what errors call it.

    Positions float64 (V,3), with ``position_dtype`` float32; a fourth coordinate is ignored, three or
    four more numbers after the position are colors (float32, kept as they stand). Corner normals and
    uvs are gathered per corner, NaN rows where a corner has none; a normal of length zero or one that
    is not finite counts as none. ``g`` gives face groups, ``o`` where the file has no ``g``.
    Faces with fewer than three corners are left out with a warning.
    Raises FormatError, with the line, for what cannot be read or refers to what is not there.
    """
    lines = split_lines(data, name, continued=True)
    kinds = _classify(lines)
    _blank_comments(lines, kinds)
    vertices, uvs, normals, faces = (np.flatnonzero(kinds == k) for k in (_VERTEX, _UV, _NORMAL, _FACE))
    warnings: list[str] = []
    positions, colors = _read_positions(lines, vertices, warnings)
    corners = read_faces(lines, faces, (vertices, uvs, normals))
    corner_uvs = _gather(_read_uvs(lines, uvs, warnings), corners.refs[1])
    corner_normals = _gather(_read_normals(lines, normals, warnings), corners.refs[2])
    context = _read_context(lines, np.flatnonzero(kinds == _OTHER))
    check_ranges(context.tags, len(vertices), len(faces), lines.error)
    return _assemble(lines, faces, corners, positions, colors, corner_normals, corner_uvs, context, warnings)


def _classify(lines: Lines) -> NDArray[np.int8]:
    """The kind of each line by its first bytes; keywords of number lines are blanked out of the text."""
    text, starts = lines.text, lines.starts
    first, second, third = text[starts], text[starts + 1], text[starts + 2]
    kinds = np.full(len(starts), _OTHER, dtype=np.int8)
    kinds[(starts >= lines.ends) | (first == ord("#"))] = _EMPTY
    blank_second, blank_third = BLANK[second], BLANK[third]
    for letter, kind in ((b"v", _VERTEX), (b"f", _FACE), (b"l", _SKIPPED), (b"p", _SKIPPED)):
        kinds[(first == letter[0]) & blank_second] = kind
    for letter, kind in ((b"t", _UV), (b"n", _NORMAL)):
        chosen = (first == ord("v")) & (second == letter[0]) & blank_third
        kinds[chosen] = kind
        text[starts[chosen] + 1] = 32
    text[starts[(kinds >= _VERTEX) & (kinds <= _FACE)]] = 32
    return kinds


def _blank_comments(lines: Lines, kinds: NDArray[np.int8]) -> None:
    """Blank out what follows a # on number lines."""
    marks = np.flatnonzero(lines.text == ord("#"))
    if not len(marks):
        return
    owner, first = np.unique(np.searchsorted(lines.starts, marks, side="right") - 1, return_index=True)
    wanted = (kinds[owner] >= _VERTEX) & (kinds[owner] <= _FACE)
    ends = lines.ends[owner[wanted]].tolist()
    for begin, end in zip(marks[first[wanted]].tolist(), ends, strict=True):
        lines.text[begin:end] = 32


def _read_positions(lines: Lines, chosen: Ints, warnings: list[str]) -> tuple[Floats, Floats | None]:
    values, counts = parse_rows(lines, chosen)
    check_rows(lines, chosen, values, counts, 3, "vertex")
    positions = np.ascontiguousarray(take_columns(values, counts, 0, 3))
    colored = counts >= 6
    if not colored.any():
        return positions, None
    width = 4 if bool((counts[colored] >= 7).all()) else 3
    colors = take_columns(values, counts, 3, 3 + width)
    colors[~colored] = 1.0
    if not colored.all():
        warnings.append(f"{int((~colored).sum())} vertices have no color while others do: taken as white")
    if not np.isfinite(colors).all():
        warnings.append("some vertex colors are not finite numbers: taken as 0")
        colors[~np.isfinite(colors)] = 0.0
    with np.errstate(over="ignore"):
        return positions, np.clip(colors, -3e38, 3e38).astype(np.float32)


def _read_uvs(lines: Lines, chosen: Ints, warnings: list[str]) -> Floats:
    values, counts = parse_rows(lines, chosen)
    if len(counts) and counts.min() < 1:
        raise lines.error(
            int(chosen[np.argmin(counts)]), "texture coordinate has no numbers, it needs 1 to 3"
        )
    uvs = take_columns(values, counts, 0, 2, missing=0.0).copy()
    return _drop_wild(uvs, "texture coordinates", warnings)


def _read_normals(lines: Lines, chosen: Ints, warnings: list[str]) -> Floats:
    values, counts = parse_rows(lines, chosen)
    short = np.flatnonzero(counts < 3)
    if len(short):
        raise lines.error(int(chosen[short[0]]), f"normal has {counts[short[0]]} numbers, it needs 3")
    normals = _drop_wild(take_columns(values, counts, 0, 3).copy(), "normals", warnings)
    normals[~normals.any(axis=1)] = np.nan
    return normals


def _drop_wild(rows: Floats, what: str, warnings: list[str]) -> Floats:
    """Make rows that are not finite NaN as a whole, in place, with a warning that counts them."""
    wild = ~np.isfinite(rows).all(axis=1)
    if wild.any():
        rows[wild] = np.nan
        warnings.append(f"{int(wild.sum())} {what} are not finite numbers and were ignored")
    return rows


def _gather(rows: Floats, refs: Ints) -> Floats | None:
    """Per-corner rows ``(C,c)``, NaN where ``refs`` is -1; None if no corner has any."""
    if not len(rows) or not (refs >= 0).any():
        return None
    out: Floats = rows[refs]
    out[refs < 0] = np.nan
    return None if np.isnan(out).all() else out


def _read_context(lines: Lines, chosen: Ints) -> _Context:
    """Go through the remaining lines one by one: they are few beside vertices and faces."""
    context = _Context()
    for line in chosen.tolist():
        keyword, _, rest = lines.get(line).replace(b"\t", b" ").partition(b" ")
        rest = re.sub(_COMMENT_IN_NAME, b"", b" " + rest).strip()
        if keyword == b"t":
            try:
                context.tags.add(rest.split(), line)
            except TagError as error:
                raise lines.error(line, str(error)) from None
        else:
            _take_state(context, keyword, rest, line)
    return context


def _take_state(context: _Context, keyword: bytes, rest: bytes, line: int) -> None:
    named = {
        b"usemtl": (context.materials, context.material_names),
        b"g": (context.groups, context.group_names),
        b"o": (context.objects, context.object_names),
    }
    if keyword in named:
        states, names = named[keyword]
        text = _decode(b" ".join(rest.split()))
        states.lines.append(line)
        states.values.append(names.setdefault(text, len(names)) if text else -1)
    elif keyword == b"mtllib":
        context.files.setdefault(_decode(rest))
    elif keyword == b"s" and (smoothing := _smoothing_group(rest)) is not None:
        context.smoothing.lines.append(line)
        context.smoothing.values.append(smoothing)
    else:
        label = quote(keyword)
        context.unknown[label] = context.unknown.get(label, 0) + 1


def _smoothing_group(rest: bytes) -> int | None:
    """The id that an ``s`` line sets (0 for off, 1 for on), None if it cannot be understood."""
    words = {b"off": 0, b"null": 0, b"on": 1}
    if rest in words:
        return words[rest]
    if rest.isdigit() and len(rest) < 20 and int(rest) < _SMOOTHING_LIMIT:
        return int(rest)
    return None


def _decode(text: bytes) -> str:
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1")


def _assemble(
    lines: Lines,
    face_lines: Ints,
    corners: FaceCorners,
    positions: Floats,
    colors: Floats | None,
    normals: Floats | None,
    uvs: Floats | None,
    context: _Context,
    warnings: list[str],
) -> PolygonMesh:
    """Leave out faces with under three corners, and put the mesh together."""
    kept = corners.sizes >= 3
    inside = np.repeat(kept, corners.sizes)
    if not kept.all():
        first = lines.number(int(face_lines[np.argmin(kept)]))
        count = int((~kept).sum())
        faces = (
            "1 face with fewer than 3 corners was"
            if count == 1
            else f"{count} faces with fewer than 3 corners were"
        )
        warnings.append(f"{faces} skipped, the first at line {first}")
    if context.tags.unknown:
        listed = ", ".join(list(context.tags.unknown)[:5])
        warnings.append(f"unknown tags were ignored: {sum(context.tags.unknown.values())} ({listed})")
    if context.unknown:
        listed = ", ".join(list(context.unknown)[:5]) + (", ..." if len(context.unknown) > 5 else "")
        warnings.append(
            f"lines with unknown keywords were ignored: {sum(context.unknown.values())} ({listed})"
        )
    where = face_lines[kept]
    grouped = bool(context.groups.lines)
    groups = context.groups if grouped else context.objects
    smoothing = context.smoothing.of_faces(where, 0)
    return PolygonMesh(
        positions,
        np.concatenate([[0], np.cumsum(corners.sizes[kept])]).astype(np.int64),
        corners.refs[0][inside],
        corner_normals=None if normals is None else normals[inside],
        corner_uvs=None if uvs is None else uvs[inside],
        vertex_colors=colors,
        face_materials=context.materials.of_faces(where, -1) if context.material_names else None,
        material_names=tuple(context.material_names),
        material_files=tuple(context.files),
        face_groups=groups.of_faces(where, -1) if groups.lines else None,
        group_names=tuple(context.group_names if grouped else context.object_names),
        face_smoothing=smoothing if smoothing.any() else None,
        marks=to_marks(context.tags, kept),
        position_dtype=np.dtype(np.float32),
        warnings=tuple(warnings),
    )
