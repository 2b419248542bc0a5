"""Mesh files: one module per format, all read to and written from PolygonMesh."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any, BinaryIO

from curvify.errors import FormatError
from curvify.formats.files import atomic_file, read_bytes
from curvify.mesh import PolygonMesh

if TYPE_CHECKING:
    from curvify.formats.obj_write import FloatType

__all__ = [
    "READ_FORMATS",
    "WRITE_FORMATS",
    "atomic_file",
    "find_format",
    "read_mesh",
    "write_mesh",
]

_OWN = ("obj", "ply", "off")
#: What trimesh reads and writes for us.
_READABLE = ("stl", "glb", "gltf", "3mf")
_WRITABLE = ("stl", "glb", "3mf")
READ_FORMATS = (*_OWN, *_READABLE)
WRITE_FORMATS = (*_OWN, *_WRITABLE)


def _module(format: str, direction: str) -> Any:
    """The module that reads or writes a format, imported when it is first needed: a run uses one or two of them."""
    name = f"{format}_{direction}" if format in ("obj", "ply") else format if format in _OWN else "others"
    return import_module(f"curvify.formats.{name}")


def find_format(path: str | os.PathLike[str], format: str | None, known: tuple[str, ...]) -> str:
    """The format that ``format`` names, or the suffix of ``path``; raises FormatError unless it is known."""
    name = os.fspath(path)
    chosen = (format if format is not None else os.path.splitext(name.rstrip("/"))[1]).lower().removeprefix(".")
    if chosen in known:
        return chosen
    listed = ", ".join(known)
    if format is not None:
        raise FormatError(f"unknown format '{format}'; known are {listed}")
    if name == "-":
        raise FormatError(f"the format of standard input or output must be given, one of {listed}")
    if chosen in READ_FORMATS:
        what = f"'.{chosen}' {'is read but not written' if known == WRITE_FORMATS else 'cannot be used here'}"
    else:
        what = f"unknown suffix '.{chosen}'" if chosen else "the name has no suffix"
    raise FormatError(f"{name}: {what}; name the format, one of {listed}")


def read_mesh(
    path: str | os.PathLike[str], format: str | None = None, stdin: BinaryIO | None = None
) -> PolygonMesh:
    """Read a mesh file; ``-`` reads ``stdin`` (by default the process's).

    The format is ``format``, or told by the suffix; PLY and OFF on standard input are recognised.
    Raises FormatError, one clear line, for whatever cannot be read.
    """
    name = os.fspath(path)
    if name != "-":
        chosen = find_format(name, format, READ_FORMATS)
        data = read_bytes(name)
    else:
        name = "stdin"
        try:
            data = (stdin or sys.stdin.buffer).read()
        except OSError as error:
            raise FormatError(f"stdin: cannot read: {error.strerror}") from None
        chosen = find_format("-", format or _sniff(data), READ_FORMATS)
    _check_start(data, name, chosen)
    module = _module(chosen, "read")
    mesh: PolygonMesh = (
        getattr(module, f"read_{chosen}")(data, name) if chosen in _OWN else module.read_other(data, name, chosen)
    )
    return mesh


#: How files of other formats begin that are mistaken for OBJ, which begins anyhow.
_STARTS = {
    b"ply": "a PLY",
    b"OFF": "an OFF",
    b"solid": "an STL",
    b"glTF": "a GLB",
    b"PK\3\4": "a 3MF",
    b"\x89PNG": "a PNG",
}


def _check_start(data: bytes, name: str, format: str) -> None:
    """Raise FormatError for an empty file, and for one that is plainly no OBJ: as OBJ it would have nothing in it."""
    if not data:
        raise FormatError(f"{name}: the file is empty")
    if format != "obj":
        return
    for start, what in _STARTS.items():
        if data.startswith(start):
            raise FormatError(f"{name}: this is {what} file, not OBJ; give it the suffix of its format")
    if b"\0" in data[:1024]:
        raise FormatError(f"{name}: this is no OBJ file: it is not text")


def _sniff(data: bytes) -> str | None:
    """The format that the first bytes give away, if any."""
    if data[:4] in (b"ply\n", b"ply\r"):
        return "ply"
    head = data[:16].split(maxsplit=1)
    return "off" if head and head[0] in (b"OFF", b"COFF", b"NOFF", b"CNOFF") else None


def write_mesh(
    mesh: PolygonMesh,
    path: str | os.PathLike[str],
    format: str | None = None,
    *,
    ascii: bool = False,
    dtype: FloatType | None = None,
    stdout: BinaryIO | None = None,
) -> None:
    """Write a mesh file, completely or not at all; ``-`` writes ``stdout`` (by default the process's).

    ``ascii`` makes PLY text; ``dtype`` (float32, float64; by default ``mesh.position_dtype``) is the
    type of coordinates in PLY, and the one that digits in OBJ and OFF round-trip.
    Raises FormatError for an unknown format or a target that cannot be written.
    """
    chosen = find_format(path, format, WRITE_FORMATS)
    if os.fspath(path) == "-":
        out = stdout or sys.stdout.buffer
        write_stream(mesh, out, chosen, ascii, dtype)
        out.flush()
        return
    with atomic_file(path) as out:
        write_stream(mesh, out, chosen, ascii, dtype)


def write_stream(
    mesh: PolygonMesh, out: BinaryIO, format: str, ascii: bool = False, dtype: FloatType | None = None
) -> None:
    """Write a mesh to an open file; see ``write_mesh``."""
    module = _module(format, "write")
    if format == "ply":
        module.write_ply(mesh, out, ascii, dtype)
    elif format in _OWN:
        getattr(module, f"write_{format}")(mesh, out, dtype)
    else:
        module.write_other(mesh, out, format)
