"""Marks as a JSON file: features and shape controls of a mesh, to write by hand or to edit (docs/sharp-features.md).

    {"marks": 1,
     "edges": [{"vertices": [4, 5], "crease": 1}, {"vertices": [0, 4], "crease": [0, 0.5], "straight": true},
               {"vertices": [2, 3], "normal": [0, 0, 1]}, {"vertices": [2, 7], "kappa": -0.1}],
     "vertices": [{"vertex": 9, "corner": 1}],
     "faces": [{"face": 3, "flat": true}, {"face": 5, "bulge": 0.2, "alpha": 1.5}, {"face": 6, "hole": true}]}

Vertices and faces count from 0, in the order of the mesh's file.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from typing import Any

import numpy as np

from curvify.errors import FormatError
from curvify.formats.files import read_bytes
from curvify.mesh import Floats, Ints, Marks

VERSION = 1
_LISTS = {"edges": "vertices", "vertices": "vertex", "faces": "face"}


def read_marks(path: str | os.PathLike[str]) -> Marks:
    """Read a marks file. Raises FormatError, one line that names the entry, for what cannot be understood."""
    name = os.fspath(path)
    try:
        content = json.loads(read_bytes(name).decode("utf-8-sig"))
    except json.JSONDecodeError as error:
        what = f"{error.msg[:1].lower()}{error.msg[1:]}"
        raise FormatError(f"{name}:{error.lineno}: not a JSON file: {what} (column {error.colno})") from None
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{name}: not a JSON file: {error}") from None
    return parse_marks(content, name)


def parse_marks(content: Any, name: str) -> Marks:
    """Marks from the decoded content of a file called ``name``."""
    if not isinstance(content, dict) or content.get("marks") != VERSION:
        raise FormatError(f'{name}: not a marks file; it must be an object with "marks": {VERSION}')
    for key in content:
        if key != "marks" and key not in _LISTS:
            raise FormatError(f"{name}: unknown key {key!r}; known are marks, {', '.join(_LISTS)}")
    rows: dict[str, list[tuple[Any, Any]]] = {key: [] for key in _KINDS}
    for list_name, place in _LISTS.items():
        entries = content.get(list_name, [])
        if not isinstance(entries, list):
            raise FormatError(f"{name}: {list_name} must be a list")
        for i, entry in enumerate(entries):
            where = f"{name}: {list_name}[{i}]"
            if not isinstance(entry, dict) or place not in entry:
                raise FormatError(f"{where}: must be an object with {place!r}")
            _take_entry(rows, entry, list_name, where)
    return _to_marks(rows)


def _take_entry(rows: dict[str, list[tuple[Any, Any]]], entry: dict[str, Any], list_name: str, where: str) -> None:
    place = _LISTS[list_name]
    if list_name == "edges":
        ends = entry[place]
        if not isinstance(ends, list) or len(ends) != 2 or ends[0] == ends[1]:
            raise FormatError(f"{where}: 'vertices' must be two different vertices")
        at: Any = [_id(end, where) for end in ends]
    else:
        at = _id(entry[place], where)
    for key, value in entry.items():
        if key == place:
            continue
        if key not in _KINDS or _KINDS[key][0] != list_name:
            known = ", ".join(kind for kind, (owner, _) in _KINDS.items() if owner == list_name)
            raise FormatError(f"{where}: unknown mark {key!r}; known are {known}")
        parsed = _KINDS[key][1](value, f"{where}: {key!r}")
        if parsed is not None:
            rows[key].append((at, parsed))


def _id(value: Any, where: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**62:
        raise FormatError(f"{where}: {value!r} is not the number of a vertex or face, counted from 0")
    return value


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise FormatError(f"{where} must be a number, not {value!r}")
    return float(value)


def _sharpness(value: Any, where: str) -> float:
    number = float(value) if isinstance(value, bool) else _number(value, where)
    if not 0 <= number <= 1:
        raise FormatError(f"{where} must be from 0 (smooth) to 1 (sharp), not {value!r}")
    return number


def _ends(value: Any, where: str) -> tuple[float, float]:
    both = value if isinstance(value, list) else [value, value]
    if len(both) != 2:
        raise FormatError(f"{where} must be one sharpness, or one for each end")
    return _sharpness(both[0], where), _sharpness(both[1], where)


def _switch(value: Any, where: str) -> bool | None:
    if not isinstance(value, bool):
        raise FormatError(f"{where} must be true or false, not {value!r}")
    return value or None


def _vector(value: Any, where: str) -> list[float]:
    if not isinstance(value, list) or len(value) != 3:
        raise FormatError(f"{where} must be three numbers")
    vector = [_number(part, where) for part in value]
    if not any(vector):
        raise FormatError(f"{where} must not be zero")
    return vector


def _positive(value: Any, where: str) -> float:
    number = _number(value, where)
    if number <= 0:
        raise FormatError(f"{where} must be above 0, not {value!r}")
    return number


_KINDS: dict[str, tuple[str, Callable[[Any, str], Any]]] = {
    "crease": ("edges", _ends),
    "straight": ("edges", _switch),
    "normal": ("edges", _vector),
    "kappa": ("edges", _number),
    "corner": ("vertices", _sharpness),
    "flat": ("faces", _switch),
    "hole": ("faces", _switch),
    "bulge": ("faces", _number),
    "alpha": ("faces", _positive),
}


def _to_marks(rows: dict[str, list[tuple[Any, Any]]]) -> Marks:
    def places(kind: str) -> Ints:
        shape = (-1, 2) if _KINDS[kind][0] == "edges" else (-1,)
        return np.array([at for at, _ in rows[kind]], dtype=np.int64).reshape(shape)

    def values(kind: str, *shape: int) -> Floats:
        return np.array([value for _, value in rows[kind]], dtype=np.float64).reshape(-1, *shape)

    return Marks(
        crease_edges=places("crease"),
        crease_sharpness=values("crease", 2),
        straight_edges=places("straight"),
        corner_vertices=places("corner"),
        corner_sharpness=values("corner"),
        flat_faces=places("flat"),
        hole_faces=places("hole"),
        bent_edges=places("normal"),
        edge_normals=values("normal", 3),
        curled_edges=places("kappa"),
        kappas=values("kappa"),
        bulged_faces=places("bulge"),
        bulges=values("bulge"),
        full_faces=places("alpha"),
        alphas=values("alpha"),
    )


def marks_text(marks: Marks) -> str:
    """The marks as the text of a file, one entry a line: what is marked twice stands once."""
    edges: dict[Any, dict[str, Any]] = {}
    vertices: dict[Any, dict[str, Any]] = {}
    faces: dict[Any, dict[str, Any]] = {}
    for (a, b), (s, e) in zip(marks.crease_edges.tolist(), marks.crease_sharpness.tolist(), strict=True):
        low, high, ends = (a, b, [s, e]) if a < b else (b, a, [e, s])
        edges.setdefault((low, high), {})["crease"] = s if s == e else ends
    flags = [(marks.straight_edges, "straight", [True] * len(marks.straight_edges))]
    flags += [(marks.bent_edges, "normal", marks.edge_normals.tolist())]
    flags += [(marks.curled_edges, "kappa", marks.kappas.tolist())]
    for pairs, key, values in flags:
        for pair, value in zip(pairs.tolist(), values, strict=True):
            edges.setdefault(tuple(sorted(pair)), {})[key] = value
    for vertex, value in zip(marks.corner_vertices.tolist(), marks.corner_sharpness.tolist(), strict=True):
        vertices.setdefault(vertex, {})["corner"] = value
    switches: list[tuple[Ints, str, list[Any]]] = [
        (marks.flat_faces, "flat", [True] * len(marks.flat_faces)),
        (marks.hole_faces, "hole", [True] * len(marks.hole_faces)),
        (marks.bulged_faces, "bulge", marks.bulges.tolist()),
        (marks.full_faces, "alpha", marks.alphas.tolist()),
    ]
    for ids, key, values in switches:
        for face, value in zip(ids.tolist(), values, strict=True):
            faces.setdefault(face, {})[key] = value
    parts = [f'"marks": {VERSION}']
    for list_name, place, entries in (
        ("edges", "vertices", edges),
        ("vertices", "vertex", vertices),
        ("faces", "face", faces),
    ):
        if entries:
            lines = [json.dumps({place: at, **entries[at]}, allow_nan=False) for at in sorted(entries)]
            parts.append(f'"{list_name}": [\n  ' + ",\n  ".join(lines) + "\n ]")
    return "{" + ",\n ".join(parts) + "}\n"
