"""The header of a PLY file: which elements it has, of which properties, in which types."""

from __future__ import annotations

import re
from typing import Literal

import numpy as np

from curvify.errors import FormatError
from curvify.formats.scan import quote
from curvify.records import field, record

Order = Literal["<", ">", "="]
_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "long": "i8", "int64": "i8", "ulong": "u8", "uint64": "u8",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_FORMATS: dict[str, Order] = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_NEWLINE = re.compile(rb"\r\n|\n|\r")
_MAX_HEADER = 1 << 24


@record
class Property:
    """A value of each row, or a list of values where ``count_type`` is given."""

    name: str
    type: np.dtype[np.generic]
    count_type: np.dtype[np.generic] | None = None


@record
class Element:
    """``count`` rows of properties, announced on header line ``line``."""

    name: str
    count: int
    line: int
    properties: list[Property] = field(default_factory=list)

    @property
    def names(self) -> set[str]:
        return {p.name for p in self.properties}

    def type_of(self, name: str) -> np.dtype[np.generic]:
        """The declared type of a property, in the machine's byte order."""
        return next(p.type for p in self.properties if p.name == name).newbyteorder("=")


@record
class Header:
    """``order`` is ``<`` or ``>`` for binary files and ``=`` for ascii; the body starts at byte ``body``."""

    order: Order | None
    elements: list[Element]
    comments: list[str]
    body: int
    line_count: int

    @property
    def ascii(self) -> bool:
        return self.order == "="


def read_header(data: bytes, name: str) -> Header:
    """Parse the header. Raises FormatError with the line for what is malformed."""
    lines, body = _header_lines(data, name)
    header = Header(None, [], [], body, len(lines))
    for number, line in enumerate(lines[1:-1], 2):
        words = line.decode("utf-8", "replace").split()
        try:
            _take_line(header, words, line, number)
        except _HeaderError as error:
            raise FormatError(f"{name}:{number}: {error}") from None
    if not header.order:
        raise FormatError(f"{name}: the header has no format line; this is not a complete PLY file")
    return header


class _HeaderError(ValueError):
    pass


def _header_lines(data: bytes, name: str) -> tuple[list[bytes], int]:
    """The lines up to end_header, and the offset behind it."""
    first = _NEWLINE.search(data, 0, 64)
    if first is None or data[: first.start()].strip() != b"ply":
        raise FormatError(f"{name}:1: not a PLY file: it does not begin with a line 'ply'")
    # Files keep to one kind of line end; with a lone CR, a LF after end_header would be data.
    newline = first.group()
    lines, at = [data[: first.start()]], first.end()
    while at < min(len(data), _MAX_HEADER):
        end = data.find(newline, at)
        stop = end if end >= 0 else len(data)
        line = data[at:stop].strip()
        lines.append(line)
        at = min(stop + len(newline), len(data))
        if line == b"end_header":
            return lines, at
    raise FormatError(f"{name}: the header has no end_header line; the file is cut short or not a PLY file")


def _take_line(header: Header, words: list[str], line: bytes, number: int) -> None:
    keyword = words[0] if words else "comment"
    if keyword == "comment":
        header.comments.append(line.decode("utf-8", "replace")[len("comment") :].strip())
    elif keyword == "format":
        if len(words) < 2 or words[1] not in _FORMATS:
            raise _HeaderError(f"the format must be one of {', '.join(_FORMATS)}")
        header.order = _FORMATS[words[1]]
    elif keyword == "element":
        header.elements.append(_element(words, number, {e.name for e in header.elements}))
    elif keyword == "property":
        if not header.elements:
            raise _HeaderError("a property stands before the first element")
        _add_property(header.elements[-1], words)
    elif keyword != "obj_info":
        raise _HeaderError(f"{quote(keyword.encode())} is not a keyword of PLY headers")


def _element(words: list[str], number: int, known: set[str]) -> Element:
    if len(words) != 3 or not (words[2].isascii() and words[2].isdigit()) or len(words[2]) > 18:
        raise _HeaderError("an element line needs a name and a count: element vertex 8")
    if words[1] in known:
        raise _HeaderError(f"element {quote(words[1].encode())} is announced twice")
    return Element(words[1], int(words[2]), number)


def _add_property(element: Element, words: list[str]) -> None:
    if len(words) == 5 and words[1] == "list":
        count_type, item_type = _type(words[2]), _type(words[3])
        if count_type.kind == "f":
            raise _HeaderError("a list cannot be counted in floats")
        added = Property(words[4], item_type, count_type)
    elif len(words) == 3:
        added = Property(words[2], _type(words[1]))
    else:
        raise _HeaderError("a property line reads: property TYPE NAME, or property list TYPE TYPE NAME")
    if added.name in element.names:
        raise _HeaderError(f"property {quote(added.name.encode())} is announced twice")
    element.properties.append(added)


def _type(word: str) -> np.dtype[np.generic]:
    if word not in _TYPES:
        raise _HeaderError(f"{quote(word.encode())} is not a type of PLY files")
    return np.dtype(_TYPES[word])
