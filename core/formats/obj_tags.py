"""Tags of OBJ files: ``t NAME ints/floats/strings values...``, as OpenSubdiv's test shapes use them.

Indices count from 0, sharpness runs from 0 to 10 (and becomes 0..1 by value/10, clipped):

    t crease 2/1/0 A B SHARPNESS      more vertices make a chain; one sharpness for all or one per edge;
                                      2/2/0 A B SA SB gives one edge a sharpness at either end
    t corner 1/1/0 V SHARPNESS
    t hole 1/0/0 FACE
    t flat 1/0/0 FACE                 curvify's own
    t straight 2/0/0 A B              curvify's own; more vertices make a chain
    t interpolateboundary 1/0/0 N     holds in any case
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from curvify.formats.scan import quote
from curvify.mesh import Bools, Ints, Marks
from curvify.records import field, record

TAG_SCALE = 10.0


class TagError(ValueError):
    """A tag that cannot be understood; the text says why."""


@record
class Tags:
    """Tags as they stand in a file: items with the line each came from."""

    crease: list[tuple[int, int, float, float, int]] = field(default_factory=list)
    straight: list[tuple[int, int, int]] = field(default_factory=list)
    corner: list[tuple[int, float, int]] = field(default_factory=list)
    flat: list[tuple[int, int]] = field(default_factory=list)
    hole: list[tuple[int, int]] = field(default_factory=list)
    unknown: dict[str, int] = field(default_factory=dict)

    def add(self, fields: list[bytes], line: int) -> None:
        """Take in the words of one ``t`` line. Raises TagError."""
        name = fields[0] if fields else b""
        if name not in (b"crease", b"straight", b"corner", b"flat", b"hole", b"interpolateboundary"):
            self.unknown[quote(name)] = self.unknown.get(quote(name), 0) + 1
            return
        ints, floats = _arguments(fields)
        if name == b"interpolateboundary":  # a surface through its vertices does so anyway
            return
        if name == b"crease":
            self._add_crease(ints, floats, line)
        elif name == b"straight":
            _need(len(ints) >= 2, "a straight tag needs two vertices or more")
            self.straight += [(a, b, line) for a, b in pairwise(ints)]
        elif name == b"corner":
            _need(len(floats) in (1, len(ints)), "a corner tag needs one sharpness, or one for each vertex")
            self.corner += [(v, s, line) for v, s in zip(ints, _repeat(floats, len(ints)), strict=True)]
        else:
            (self.flat if name == b"flat" else self.hole).extend((f, line) for f in ints)

    def _add_crease(self, ints: list[int], floats: list[float], line: int) -> None:
        edges = len(ints) - 1
        _need(edges >= 1, "a crease tag needs two vertices or more")
        if edges == 1 and len(floats) == 2:
            self.crease.append((ints[0], ints[1], floats[0], floats[1], line))
            return
        _need(len(floats) in (1, edges), "a crease tag needs one sharpness, or one for each edge")
        for a, b, s in zip(ints, ints[1:], _repeat(floats, edges), strict=False):
            self.crease.append((a, b, s, s, line))


def _need(condition: bool, message: str) -> None:
    if not condition:
        raise TagError(message)


def _repeat(values: list[float], count: int) -> list[float]:
    return values * count if len(values) == 1 else values


def _arguments(fields: list[bytes]) -> tuple[list[int], list[float]]:
    """The integers and numbers of a tag, as many as its counts announce."""
    try:
        n_ints, n_floats, n_strings = (int(n) for n in fields[1].split(b"/"))
        ints = [int(word) for word in fields[2 : 2 + n_ints]]
        floats = [float(word) for word in fields[2 + n_ints : 2 + n_ints + n_floats]]
    except (ValueError, IndexError):
        raise TagError(
            f"tag {quote(fields[0])} cannot be read; write t NAME ints/floats/strings values"
        ) from None
    _need(min(n_ints, n_floats, n_strings) >= 0, "a tag cannot have a negative number of values")
    found = len(fields) - 2
    _need(
        found == n_ints + n_floats + n_strings,
        f"tag {quote(fields[0])} announces {n_ints + n_floats + n_strings} values and has {found}",
    )
    _need(bool(np.isfinite(floats).all()), "the sharpness of a tag is not a finite number")
    return ints, [min(max(value / TAG_SCALE, 0.0), 1.0) for value in floats]


def check_ranges(tags: Tags, vertices: int, faces: int, fail: Callable[[int, str], Exception]) -> None:
    """Raise ``fail(line, message)`` for the first tag of a vertex or face that the file does not have."""
    ends = [(v, item[-1]) for item in tags.crease for v in item[:2]]
    ends += [(v, item[-1]) for item in tags.straight for v in item[:2]]
    ends += [(item[0], item[-1]) for item in tags.corner]
    for what, items, count in (("vertex", ends, vertices), ("face", tags.flat + tags.hole, faces)):
        for index, line in items:
            if not 0 <= index < count:
                raise fail(line, f"tag refers to {what} {index}, the file has {count} (tags count from 0)")


def to_marks(tags: Tags, kept: Bools) -> Marks:
    """Marks of the mesh; ``kept (n,)`` says which face lines of the file became faces."""
    number = np.cumsum(kept) - 1

    def faces(items: list[tuple[int, int]]) -> Ints:
        ids = np.array([face for face, _ in items], dtype=np.int64)
        return number[ids[kept[ids]]]

    return Marks(
        crease_edges=np.array([c[:2] for c in tags.crease], dtype=np.int64).reshape(-1, 2),
        crease_sharpness=np.array([c[2:4] for c in tags.crease], dtype=np.float64).reshape(-1, 2),
        straight_edges=np.array([s[:2] for s in tags.straight], dtype=np.int64).reshape(-1, 2),
        corner_vertices=np.array([c[0] for c in tags.corner], dtype=np.int64),
        corner_sharpness=np.array([c[1] for c in tags.corner], dtype=np.float64),
        flat_faces=faces(tags.flat),
        hole_faces=faces(tags.hole),
    )


def tag_lines(marks: Marks) -> bytes:
    """The marks as lines of an OBJ file."""
    out = []
    for (a, b), (s, e) in zip(marks.crease_edges.tolist(), marks.crease_sharpness.tolist(), strict=True):
        ends = _sharpness(s) if s == e else f"{_sharpness(s)} {_sharpness(e)}"
        out.append(f"t crease 2/{1 if s == e else 2}/0 {a} {b} {ends}\n")
    for v, s in zip(marks.corner_vertices.tolist(), marks.corner_sharpness.tolist(), strict=True):
        out.append(f"t corner 1/1/0 {v} {_sharpness(s)}\n")
    out += [f"t straight 2/0/0 {a} {b}\n" for a, b in marks.straight_edges.tolist()]
    out += [f"t flat 1/0/0 {f}\n" for f in marks.flat_faces.tolist()]
    out += [f"t hole 1/0/0 {f}\n" for f in marks.hole_faces.tolist()]
    return "".join(out).encode()


def _sharpness(value: float) -> str:
    """Tenfold, in digits that divide back to the same value where floats allow."""
    scaled = value * TAG_SCALE
    for candidate in (
        round(scaled, 12),
        scaled,
        float(np.nextafter(scaled, 0)),
        float(np.nextafter(scaled, 20)),
    ):
        if candidate / TAG_SCALE == value:
            return repr(candidate)
    return repr(scaled)
