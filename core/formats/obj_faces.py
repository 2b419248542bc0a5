"""The face lines of an OBJ file: all corners of all faces parsed at once.

A corner is ``v``, ``v/t``, ``v//n`` or ``v/t/n``; an empty place (also in ``v/`` and ``v//``) means
none. Numbers count from 1, or back from the last element read before the line if negative.
"""

from __future__ import annotations

import re

import numpy as np

from curvify.errors import FormatError
from curvify.formats.scan import Bytes, Lines, blanks, parse_all, quote
from curvify.mesh import Bools, Ints
from curvify.records import record

ABSENT = int(np.iinfo(np.int64).min)
_KINDS = ("vertex", "texture coordinate", "normal")
_PLURALS = ("vertices", "texture coordinates", "normals")
_CORNER = rb"[+-]?\d+(/([+-]?\d+)?){0,2}\Z"
_SLASH = 47


@record
class FaceCorners:
    """``sizes (n,)`` corners on each line; ``refs (3, C)`` vertex, uv and normal, from 0, -1 for none."""

    sizes: Ints
    refs: Ints


def read_faces(lines: Lines, chosen: Ints, element_lines: tuple[Ints, Ints, Ints]) -> FaceCorners:
    """Parse the chosen face lines, their keyword already blanked out.

    ``element_lines`` are the line indices of all v, vt and vn, to count them and to resolve negative
    references. Raises FormatError for a corner that cannot be read, a 0, or an index out of range.
    """
    text, offsets = lines.gather(chosen)
    parsed = _parse_corners(text)
    if parsed is None:
        raise _first_bad_corner(lines, chosen)
    starts, refs = parsed
    sizes = np.diff(np.searchsorted(starts, offsets))
    for slot in range(3):
        refs[slot] = _resolve(lines, chosen, sizes, refs[slot], element_lines[slot], slot)
    return FaceCorners(sizes, refs)


def _parse_corners(text: Bytes) -> tuple[Ints, Ints] | None:
    """Where each corner starts and its numbers as written ``(3,C)``; None if any corner is malformed."""
    blank = blanks(text)
    if not (blank | _in_numbers(text)).all():
        return None
    slash = text == _SLASH
    corner_first = ~blank
    corner_first[1:] &= blank[:-1]
    corners = np.flatnonzero(corner_first)
    if not slash.any():
        values = parse_all(text.tobytes(), len(corners), np.int64)
        if values is None:
            return None
        refs = np.full((3, len(corners)), ABSENT, dtype=np.int64)
        refs[0] = values
        return corners, refs
    gap = blank | slash
    number_first = ~gap
    number_first[1:] &= gap[:-1]
    numbers = np.flatnonzero(number_first)
    values = parse_all(np.where(slash, np.uint8(32), text).tobytes(), len(numbers), np.int64)
    if values is None:
        return None
    return _place_numbers(corners, numbers, values.astype(np.int64), slash)


def _in_numbers(text: Bytes) -> Bools:
    """Which bytes are digits, signs or slashes: what lies from + to 9, but for the comma and the point."""
    return (text - np.uint8(43) < 15) & (text != 44) & (text != 46)


def _place_numbers(corners: Ints, numbers: Ints, values: Ints, slash: Bools) -> tuple[Ints, Ints] | None:
    """Put each number in the place that the slashes before it give; None if one has no place."""
    passed = np.cumsum(slash, dtype=np.int32)
    at_corner = passed[corners] - slash[corners]
    owner = np.searchsorted(corners, numbers, side="right") - 1
    slot = passed[numbers] - at_corner[owner]
    slashes = np.diff(np.append(at_corner, passed[-1]))
    if slashes.max(initial=0) > 2:
        return None
    refs = np.full((3, len(corners)), ABSENT, dtype=np.int64)
    refs[slot, owner] = values
    if (refs[0] == ABSENT).any():
        return None
    return corners, refs


def _first_bad_corner(lines: Lines, chosen: Ints) -> FormatError:
    """The error for the first corner that has none of the four forms."""
    for line in chosen.tolist():
        for token in lines.get(line).split():
            if not re.match(_CORNER, token):
                return lines.error(
                    line, f"{quote(token)} is not a corner of a face; write v, v/vt, v//vn or v/vt/vn"
                )
    return lines.error(int(chosen[0]), "this face or one after it cannot be read; check the numbers")


def _resolve(lines: Lines, chosen: Ints, sizes: Ints, refs: Ints, elements: Ints, slot: int) -> Ints:
    """References of one kind counted from 0, -1 for none; raises FormatError for the first wrong one."""
    present = refs != ABSENT
    total = len(elements)
    index = np.where(present, refs - 1, -1)
    negative = present & (refs < 0)
    if negative.any():
        before = np.repeat(np.searchsorted(elements, chosen), sizes)
        index[negative] = before[negative] + refs[negative]
    wrong = np.flatnonzero(present & ((refs == 0) | (index < 0) | (index >= total)))
    if len(wrong):
        line = int(chosen[np.searchsorted(np.cumsum(sizes), wrong[0], side="right")])
        raise lines.error(
            line, _explain(int(refs[wrong[0]]), int(np.searchsorted(elements, line)), total, slot)
        )
    return index


def _explain(ref: int, before: int, total: int, slot: int) -> str:
    if ref == 0:
        return f"face refers to {_KINDS[slot]} 0, but they are counted from 1"
    if ref < 0:
        return f"face refers to {_KINDS[slot]} {ref}, only {before} {_PLURALS[slot]} come before it"
    return f"face refers to {_KINDS[slot]} {ref}, the file has {total}"
