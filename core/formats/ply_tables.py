"""The body of a PLY file as tables of columns, decoded on demand.

An ascii body is first turned into a binary one in which every number is a float64; from there both
go the same way. Rows of equal size are strided views. Other rows are found by one walk over the list
counts, after which values are gathered in bulk.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from curvify.errors import FormatError
from curvify.formats.ply_header import Element, Header
from curvify.formats.scan import count_tokens, parse_all, quote, spread, unify_newlines
from curvify.mesh import Floats, Ints
from curvify.records import record

if TYPE_CHECKING:
    from numpy.typing import NDArray

_DOUBLE = np.dtype(np.float64)
_TOKEN = rb"\S+"


@record
class Body:
    """``blob`` holds the rows from ``start`` on; ``source`` is the ascii text it was made from, if any."""

    name: str
    header: Header
    blob: bytes
    start: int
    source: bytes | None = None

    def error(self, offset: int, message: str) -> FormatError:
        """An error that points at the line (ascii) or byte (binary) of ``offset`` in the blob."""
        if self.source is None:
            return FormatError(f"{self.name}: byte {offset}: {message}")
        token = next(islice(re.finditer(_TOKEN, self.source), offset // _DOUBLE.itemsize, None), None)
        at = len(self.source.rstrip()) if token is None else token.start()
        number = self.source.count(b"\n", 0, at) + self.header.line_count + 1
        return FormatError(f"{self.name}:{number}: {message}")

    def stored(self, declared: np.dtype[np.generic]) -> np.dtype[np.generic]:
        """The type in which the blob holds a value declared as ``declared``."""
        return declared.newbyteorder(self.header.order or "=") if self.source is None else _DOUBLE


@record
class _Slot:
    """Where a property lies: ``offset`` bytes behind anchor ``anchor`` (0: row start, j: end of list j-1)."""

    anchor: int
    offset: int
    type: np.dtype[np.generic]
    count_type: np.dtype[np.generic] | None


@record
class Table:
    """The rows of one element, from ``begin`` to ``end``.

    Rows of equal size are ``stride`` bytes apart; where ``stride`` is 0, ``anchors`` hold the offset of
    each row and those behind each of its lists.
    """

    body: Body
    element: Element
    slots: dict[str, _Slot]
    begin: int
    stride: int
    anchors: list[Ints]
    end: int

    def offset(self, row: int) -> int:
        """Where row ``row`` lies in the blob."""
        return self.begin + row * self.stride if self.stride else int(self.anchors[0][row])

    def error(self, row: int, message: str) -> FormatError:
        """An error that points at a row."""
        return self.body.error(self.offset(int(row)), message)

    def column(self, name: str) -> NDArray[np.generic]:
        """A scalar property ``(count,)``, as stored (float64 from ascii)."""
        slot = self.slots[name]
        if self.stride:
            return self._strided(slot.offset, slot.type, 1)[:, 0]
        return _gather(self.body.blob, self.anchors[slot.anchor] + slot.offset, slot.type)

    def side_by_side(self, *names: str) -> NDArray[np.generic] | None:
        """Scalar properties ``(count,k)`` of one type that lie one after the other in rows of equal size, without a
        copy; None where they do not, or where they are not stored in the type that was declared.
        """
        slots = [self.slots[name] for name in names]
        kind, size = slots[0].type, slots[0].type.itemsize
        apart = any(slot.type != kind or slot.offset != slots[0].offset + i * size for i, slot in enumerate(slots))
        if not self.stride or apart or any(self.element.type_of(name) != kind.newbyteorder("=") for name in names):
            return None
        return self._strided(slots[0].offset, kind, len(names))

    def lists(self, name: str) -> tuple[Ints, NDArray[np.generic]]:
        """A list property: the lengths ``(count,)`` and all items one after the other, as rows where lengths agree."""
        slot = self.slots[name]
        assert slot.count_type is not None
        if self.stride:
            counts = self._strided(slot.offset, slot.count_type, 1)[:, 0].astype(np.int64)
            length = int(counts[0]) if len(counts) else 0
            items = self._strided(slot.offset + slot.count_type.itemsize, slot.type, length)
            return counts, items
        starts = self.anchors[slot.anchor] + slot.offset
        counts = _gather(self.body.blob, starts, slot.count_type).astype(np.int64)
        size = slot.type.itemsize
        first = starts + slot.count_type.itemsize
        within = spread(np.zeros_like(counts), counts)
        return counts, _gather(self.body.blob, np.repeat(first, counts) + within * size, slot.type)

    def _strided(self, offset: int, kind: np.dtype[np.generic], width: int) -> NDArray[np.generic]:
        count = self.element.count
        if not count or not width:
            return np.zeros((count, width), dtype=kind)
        strides = (self.stride, kind.itemsize)
        return np.ndarray((count, width), kind, self.body.blob, self.begin + offset, strides)


def _gather(blob: bytes, offsets: Ints, kind: np.dtype[np.generic]) -> NDArray[np.generic]:
    """Values of one type at arbitrary byte offsets."""
    data = np.frombuffer(blob, dtype=np.uint8)
    picked = data[offsets[:, None] + np.arange(kind.itemsize)]
    values: NDArray[np.generic] = picked.reshape(-1).view(kind)
    return values


def read_tables(data: bytes, header: Header, name: str) -> dict[str, Table]:
    """All elements of the file. Raises FormatError where the body does not fit the header."""
    body = _open_body(data, header, name)
    tables: dict[str, Table] = {}
    at = body.start
    for element in header.elements:
        table = _open_table(body, element, at)
        tables[element.name] = table
        at = table.end
    if body.blob[at : at + 64].strip() and at < len(body.blob):
        last = header.elements[-1].name if header.elements else "header"
        raise body.error(
            at, f"the file goes on after its last {last}; the counts in the header are too small"
        )
    return tables


def _open_body(data: bytes, header: Header, name: str) -> Body:
    if not header.ascii:
        body = Body(name, header, data, header.body)
        _check_counts(body, len(data) - header.body, lambda kind: kind.itemsize)
        return body
    source = unify_newlines(data[header.body :])
    # Every number takes a digit and a blank, but for the last.
    _check_counts(Body(name, header, b"", 0, source), len(source) + 1, lambda kind: 2)
    return Body(name, header, _numbers(source, header, name).tobytes(), 0, source)


def _check_counts(body: Body, room: int, size: Callable[[np.dtype[np.generic]], int]) -> None:
    """Refuse counts that the file cannot hold, before memory is taken for them."""
    for element in body.header.elements:
        kinds = [p.count_type or p.type for p in element.properties]
        room -= element.count * sum(size(kind) for kind in kinds)
        if room < 0:
            raise FormatError(
                f"{body.name}:{element.line}: the header announces {element.count} rows of "
                f"{quote(element.name.encode())}, more than the file has room for; "
                "it is cut short or the count is wrong"
            )


def _numbers(source: bytes, header: Header, name: str) -> Floats:
    """All numbers of an ascii body."""
    text = np.frombuffer(source, dtype=np.uint8)
    count = int(count_tokens(text, np.array([0, len(text)]))[0]) if len(text) else 0
    values = parse_all(source, count, np.float64)
    if values is not None:
        return values.astype(np.float64, copy=False)
    for number, line in enumerate(source.split(b"\n"), header.line_count + 1):
        tokens = line.split()
        if parse_all(line, len(tokens), np.float64) is None:
            bad = next((t for t in tokens if parse_all(t, 1, np.float64) is None), line)
            raise FormatError(f"{name}:{number}: {quote(bad)} is not a number; correct the line")
    raise FormatError(f"{name}: the body has something that is not a number")


def _slots(body: Body, element: Element) -> tuple[dict[str, _Slot], list[int]]:
    """The place of every property, and the fixed bytes that follow each anchor up to the next list."""
    slots: dict[str, _Slot] = {}
    gaps = [0]
    for prop in element.properties:
        kind = body.stored(prop.type)
        if prop.count_type is None:
            slots[prop.name] = _Slot(len(gaps) - 1, gaps[-1], kind, None)
            gaps[-1] += kind.itemsize
        else:
            slots[prop.name] = _Slot(len(gaps) - 1, gaps[-1], kind, body.stored(prop.count_type))
            gaps.append(0)
    return slots, gaps


def _open_table(body: Body, element: Element, begin: int) -> Table:
    slots, gaps = _slots(body, element)
    lists = [slot for slot in slots.values() if slot.count_type is not None]
    if not lists or not element.count:
        end = begin + element.count * gaps[0]
        if end > len(body.blob):
            raise _cut_short(body, element, len(body.blob))
        return Table(body, element, slots, begin, max(gaps[0], 1), [], end)
    table = _uniform_table(body, element, slots, gaps, begin)
    return table or _walked_table(body, element, slots, gaps, begin)


def _uniform_table(
    body: Body, element: Element, slots: dict[str, _Slot], gaps: list[int], begin: int
) -> Table | None:
    """The table if all rows have lists as long as the first row's, else None."""
    anchors, end = _walk(body, element, slots, gaps, begin, 1)
    stride = end - begin
    if begin + stride * element.count > len(body.blob):
        return None
    fixed = {
        name: _Slot(0, int(anchors[s.anchor][0]) - begin + s.offset, s.type, s.count_type)
        for name, s in slots.items()
    }
    table = Table(body, element, fixed, begin, stride, [], begin + stride * element.count)
    for slot in fixed.values():
        if slot.count_type is not None:
            counts = table._strided(slot.offset, slot.count_type, 1)
            if (counts != counts[0]).any():
                return None
    return table


def _walked_table(
    body: Body, element: Element, slots: dict[str, _Slot], gaps: list[int], begin: int
) -> Table:
    anchors, end = _walk(body, element, slots, gaps, begin, element.count)
    return Table(body, element, slots, begin, 0, anchors, end)


def _cut_short(body: Body, element: Element, at: int) -> FormatError:
    kind = quote(element.name.encode())
    return body.error(at, f"the file ends inside element {kind}, which should have {element.count} rows")


def _walk(
    body: Body, element: Element, slots: dict[str, _Slot], gaps: list[int], begin: int, count: int
) -> tuple[list[Ints], int]:
    """Follow the list counts of ``count`` rows: the anchors of each row, and where the last one ends."""
    lists = [slot for slot in slots.values() if slot.count_type is not None]
    if len(lists) == 1 and lists[0].count_type == np.uint8:
        rows, end = _walk_bytes(body, element, lists[0], gaps, begin, count)
        ends = np.append(rows[1:], end) - gaps[1]
        return [rows, ends], end
    steps = [(s.offset, s.type.itemsize, struct.Struct(_code(s.count_type)), s) for s in lists]
    blob, at, limit = body.blob, begin, len(body.blob)
    found: list[list[int]] = [[] for _ in range(len(lists) + 1)]
    for _ in range(count):
        found[0].append(at)
        for j, (offset, size, reader, _) in enumerate(steps, 1):
            at += offset
            if at + reader.size > limit:
                raise _cut_short(body, element, limit)
            length = reader.unpack_from(blob, at)[0]
            if not 0 <= length <= limit or length != int(length):
                raise body.error(
                    at, f"a list in element {quote(element.name.encode())} has a length of {length}"
                )
            at += reader.size + int(length) * size
            found[j].append(at)
        at += gaps[-1]
        if at > limit:
            raise _cut_short(body, element, limit)
    return [np.array(part, dtype=np.int64) for part in found], at


def _walk_bytes(
    body: Body, element: Element, slot: _Slot, gaps: list[int], begin: int, count: int
) -> tuple[Ints, int]:
    """The usual case, one list counted in bytes, with as little as possible done per row."""
    blob, at, size, offset = body.blob, begin, slot.type.itemsize, slot.offset
    fixed = gaps[0] + 1 + gaps[1]
    rows = []
    try:
        for _ in range(count):
            rows.append(at)
            at += fixed + size * blob[at + offset]
    except IndexError:
        raise _cut_short(body, element, len(blob)) from None
    if at > len(blob):
        raise _cut_short(body, element, len(blob))
    return np.array(rows, dtype=np.int64), at


def _code(kind: np.dtype[np.generic] | None) -> str:
    assert kind is not None
    order = {"|": "=", "=": "="}.get(kind.byteorder, kind.byteorder)
    return (
        order
        + {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q", "f8": "d"}[
            kind.str[1:]
        ]
    )
