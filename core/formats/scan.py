"""Text scanning with numpy: lines, tokens and numbers of a whole file without a Python loop per line.

The fast path takes all lines of a kind at once and either succeeds as a whole or gives nothing;
only then is the text walked line by line, to say which line is wrong.
"""

from __future__ import annotations

import re
import warnings
from typing import TYPE_CHECKING

import numpy as np

from curvify.errors import FormatError
from curvify.mesh import Bools, Floats, Ints
from curvify.records import record

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Bytes = NDArray[np.uint8]
else:
    Bytes = np.ndarray

BLANK: Bools = np.zeros(256, dtype=np.bool_)
BLANK[list(b" \t\n\v\f\r")] = True
_NUMBER = rb"(?i)[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\Z|[+-]?(nan|inf|infinity)\Z"
_MAX_INDENT_STEPS = 64


def quote(token: bytes) -> str:
    """A token of a file, made fit to stand in a one-line message."""
    text = token[:30].decode("latin-1") + ("..." if len(token) > 30 else "")
    return "'" + "".join(c if c.isprintable() else "?" for c in text) + "'"


def unify_newlines(data: bytes) -> bytes:
    """The text with a byte order mark removed and CR or CRLF turned into LF."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data


def blanks(text: Bytes) -> Bools:
    """Which bytes of a text are blank, by arithmetic: looking each up in ``BLANK`` takes ten times as long."""
    return (text == 32) | (text - np.uint8(9) < 5)  # tab to carriage return; smaller ones wrap around


def token_starts(text: Bytes) -> Ints:
    """Offsets in ``text`` at which a run of non-blank bytes begins."""
    blank = blanks(text)
    first = ~blank
    first[1:] &= blank[:-1]
    return np.flatnonzero(first)


def parse_all(
    text: bytes, count: int, dtype: type[np.floating] | type[np.integer]
) -> NDArray[np.generic] | None:
    """The ``count`` blank-separated numbers that ``text`` consists of, or None if it holds anything else."""
    if count == 0:
        return np.zeros(0, dtype=dtype)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = np.fromstring(text, dtype=dtype, sep=" ")
        except (ValueError, DeprecationWarning):
            return None
    return values if len(values) == count else None


def spread(starts: Ints, counts: Ints) -> Ints:
    """The indices ``starts[i], starts[i] + 1, ...`` (``counts[i]`` of them) for all i in one array."""
    ends = np.cumsum(counts)
    total = int(ends[-1]) if len(ends) else 0
    indices: Ints = np.arange(total) + np.repeat(starts - (ends - counts), counts)
    return indices


@record
class Lines:
    """A text file cut into lines.

    ``raw`` has LF newlines; ``text`` is a copy as bytes (N+4,) that readers may blank out, in which
    continued lines are joined; line ``i`` is ``text[starts[i]:ends[i]]``, indentation left out.
    """

    name: str
    raw: bytes
    text: Bytes
    starts: Ints
    ends: Ints

    def number(self, line: int) -> int:
        """The 1-based number, in the file, of line ``line``."""
        return self.raw.count(b"\n", 0, int(self.starts[line])) + 1

    def error(self, line: int, message: str) -> FormatError:
        """An error that points at line ``line``."""
        return FormatError(f"{self.name}:{self.number(line)}: {message}")

    def get(self, line: int) -> bytes:
        """The bytes of one line as they now stand in ``text``."""
        return self.text[self.starts[line] : self.ends[line]].tobytes()

    def gather(self, chosen: Ints) -> tuple[Bytes, Ints]:
        """The chosen lines as one text, and the offset of each in it ``(n+1,)``."""
        lengths = self.ends[chosen] - self.starts[chosen] + 1
        offsets = np.concatenate([[0], np.cumsum(lengths)])
        breaks = np.flatnonzero(self.starts[chosen[1:]] != self.ends[chosen[:-1]] + 1) + 1
        first = np.concatenate([[0], breaks]) if len(chosen) else breaks
        last = np.concatenate([breaks, [len(chosen)]])[: len(first)] - 1
        begins, stops = self.starts[chosen[first]].tolist(), (self.ends[chosen[last]] + 1).tolist()
        view = self.text.data
        joined = b"".join([view[a:b] for a, b in zip(begins, stops, strict=True)])
        return np.frombuffer(joined, dtype=np.uint8), offsets


def split_lines(data: bytes, name: str, continued: bool = False) -> Lines:
    """Cut a text file into lines; ``continued`` joins a line that ends in a backslash to the next."""
    raw = unify_newlines(data)
    text = np.frombuffer(raw + b"\n\n\n\n", dtype=np.uint8).copy()
    if continued and b"\\" in raw and b"\\\n" in raw:  # one byte is found several times faster
        _join_continued(raw, text)
    newlines = np.flatnonzero(text[: len(raw) + 1] == 10)
    starts = np.concatenate([[0], newlines[:-1] + 1])
    _skip_indentation(text, starts, newlines)
    return Lines(name, raw, text, starts, newlines)


def _join_continued(raw: bytes, text: Bytes) -> None:
    """Blank out every backslash-newline; the length stays, so offsets still give line numbers."""
    at = raw.find(b"\\\n")
    while at >= 0:
        line = raw.rfind(b"\n", 0, at) + 1
        if raw.find(b"#", line, at) < 0:
            text[at : at + 2] = 32
        at = raw.find(b"\\\n", at + 1)


def _skip_indentation(text: Bytes, starts: Ints, ends: Ints) -> None:
    """Move each start to the first non-blank byte of its line, in place."""
    left = np.flatnonzero(BLANK[text[starts]] & (starts < ends))
    for _ in range(_MAX_INDENT_STEPS):
        if not len(left):
            return
        starts[left] += 1
        left = left[BLANK[text[starts[left]]] & (starts[left] < ends[left])]
    for line in left.tolist():
        rest = text[starts[line] : ends[line]].tobytes()
        starts[line] += len(rest) - len(rest.lstrip())


def count_tokens(text: Bytes, offsets: Ints) -> Ints:
    """Number of tokens of each line ``(n,)`` of a gathered text."""
    return np.diff(np.searchsorted(token_starts(text), offsets))


def parse_rows(lines: Lines, chosen: Ints) -> tuple[Floats, Ints]:
    """All numbers of the chosen lines, flat float64, and how many stand on each ``(n,)``.

    Raises FormatError at the first line with something that is not a number.
    """
    text, offsets = lines.gather(chosen)
    counts = count_tokens(text, offsets)
    values = parse_all(text.tobytes(), int(counts.sum()), np.float64)
    if values is None:
        values = np.array([v for line in chosen.tolist() for v in _parse_line(lines, line)])
    return values.astype(np.float64, copy=False), counts


def _parse_line(lines: Lines, line: int) -> list[float]:
    """The numbers of one line; raises FormatError at a token that is none."""
    tokens = lines.get(line).split()
    for token in tokens:
        if not re.match(_NUMBER, token):
            raise lines.error(line, f"{quote(token)} is not a number; correct the line")
    return [float(token) for token in tokens]


def take_columns(values: Floats, counts: Ints, first: int, last: int, missing: float = np.nan) -> Floats:
    """Columns ``first..last-1`` of rows with ``counts`` values each; ``missing`` where a row is shorter."""
    starts = np.cumsum(counts) - counts
    columns = np.arange(first, last)
    if len(counts) and counts.min() == counts.max() >= last:
        return values.reshape(len(counts), -1)[:, first:last]
    wanted = starts[:, None] + columns
    there = columns < counts[:, None]
    out = np.full(wanted.shape, missing)
    out[there] = values[wanted[there]]
    return out


def check_rows(lines: Lines, chosen: Ints, values: Floats, counts: Ints, least: int, what: str) -> None:
    """Raise FormatError for the first row with under ``least`` numbers, or one of those not finite."""
    short = np.flatnonzero(counts < least)
    if len(short):
        row = int(short[0])
        message = f"{what} has {counts[row]} numbers, it needs {least}"
        raise lines.error(int(chosen[row]), message)
    wild = np.flatnonzero(~np.isfinite(take_columns(values, counts, 0, least)).all(axis=1))
    if len(wild):
        row = int(wild[0])
        raise lines.error(
            int(chosen[row]), f"{what} has a coordinate that is not a finite number; remove or mend it"
        )
