"""Bulk text output: arrays to lines with the fewest digits that give the same numbers back."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import orjson

from curvify.mesh import Ints

if TYPE_CHECKING:
    from numpy.typing import NDArray

BLOCK_ROWS = 65536
#: Rows turned into text at once: few, so that the text stays in cache while its commas are replaced.
TEXT_ROWS = 2048


def _json(array: NDArray[np.generic]) -> bytes:
    return orjson.dumps(np.ascontiguousarray(array), option=orjson.OPT_SERIALIZE_NUMPY)


def vector_lines(prefix: bytes, array: NDArray[np.generic]) -> bytes:
    """One line ``prefix a b c`` for each row of ``array (n,c)``, c >= 1, each ended by a newline.

    ``array`` is float32, float64 or any integer type; float32 prints the shortest digits that
    round-trip float32. What is not finite prints as ``nan``.
    """
    return b"".join(_vector_block(prefix, array[part]) for part in blocks(len(array), TEXT_ROWS))


def _vector_block(prefix: bytes, array: NDArray[np.generic]) -> bytes:
    lead = prefix + b" " if prefix else b""
    body = _json(array)[2:-2].replace(b"],[", b"\n" + lead).replace(b",", b" ")
    if array.dtype.kind == "f":
        body = body.replace(b"null", b"nan")
    return lead + body + b"\n"


def face_lines(vertices: Ints, uvs: Ints | None = None, normals: Ints | None = None) -> bytes:
    """OBJ face lines of faces of one size: ``f a b c``, ``f a/t ...``, ``f a//n ...`` or ``f a/t/n ...``.

    All arrays are integer (Q,s), counted from 0; the text counts from 1.
    """
    if len(vertices) == 0:
        return b""
    given = [part for part in (vertices, uvs, normals) if part is not None]
    if len(given) == 1:
        return vector_lines(b"f", vertices + 1)
    inner = b"/" if uvs is not None else b"//"
    lines = []
    for part in blocks(len(vertices), TEXT_ROWS):
        body = _json(np.stack([columns[part] for columns in given], axis=-1) + 1)[3:-3]
        lines.append(b"f " + body.replace(b"]],[[", b"\nf ").replace(b"],[", b" ").replace(b",", inner) + b"\n")
    return b"".join(lines)


def corner_tokens(vertices: Ints, uvs: Ints | None, normals: Ints | None) -> list[bytes]:
    """OBJ corners ``a/t/n`` one by one: integer arrays (C,), counted from 0, -1 where a corner has none."""
    whole = all(part is None or bool((part >= 0).all()) for part in (uvs, normals))
    if whole:
        columns = [None if part is None else part[:, None] for part in (uvs, normals)]
        return face_lines(vertices[:, None], *columns)[2:-1].split(b"\nf ") if len(vertices) else []
    absent = np.full(len(vertices), -1)
    rows = zip(
        vertices.tolist(),
        (absent if uvs is None else uvs).tolist(),
        (absent if normals is None else normals).tolist(),
        strict=True,
    )
    return [_corner_token(v, t, n) for v, t, n in rows]


def _corner_token(vertex: int, uv: int, normal: int) -> bytes:
    if normal >= 0:
        return b"%d/%s/%d" % (vertex + 1, b"%d" % (uv + 1) if uv >= 0 else b"", normal + 1)
    return b"%d/%d" % (vertex + 1, uv + 1) if uv >= 0 else b"%d" % (vertex + 1)


def blocks(count: int, size: int = BLOCK_ROWS) -> Iterator[slice]:
    """Slices of at most ``size`` rows that cover 0..count."""
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))


def join_columns(parts: list[NDArray[np.generic]]) -> bytes:
    """Lines of several arrays (n,c) of different types side by side."""
    if len(parts) == 1:
        return vector_lines(b"", parts[0])
    columns = [vector_lines(b"", part).splitlines() for part in parts]
    return b"".join(b" ".join(row) + b"\n" for row in zip(*columns, strict=True))


def polygon_lines(sizes: Ints, corners: Ints, tails: list[bytes] | None = None) -> bytes:
    """Lines ``n a b c ...`` of polygons: ``sizes (F,)``, ``corners (C,)`` from 0, and a tail for each."""
    words = [b"%d" % v for v in corners.tolist()]
    ends = np.cumsum(sizes).tolist()
    rows = zip(sizes.tolist(), ends, tails or [b""] * len(ends), strict=True)
    return b"".join([b" ".join([b"%d" % n, *words[end - n : end]]) + tail + b"\n" for n, end, tail in rows])
