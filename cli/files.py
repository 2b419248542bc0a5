"""The two ends of a command, IN and OUT: their formats and names, checked before any work is done."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, BinaryIO, cast

from curvify.cli.memory import keep_memory
from curvify.errors import CurvifyError, FormatError, OptionError
from curvify.formats import READ_FORMATS, WRITE_FORMATS, atomic_file, find_format, read_mesh
from curvify.mesh import PolygonMesh

STREAM = "-"
#: Formats that hold polygons; the others are written as triangles.
POLYGON_FORMATS = ("obj", "ply", "off")
#: Formats that hold a polygon mesh with its normals and marks.
WHOLE_FORMATS = ("obj", "ply")


def shown_name(path: str, stream: str) -> str:
    """The name of a file in messages; ``stream`` for ``-``."""
    return stream if path == STREAM else path


def check_input(path: str, format: str | None) -> None:
    """Raise CurvifyError unless IN has a format that can be read, so far as its name tells."""
    if path != STREAM and os.path.isdir(path):
        raise FormatError(f"{path}: cannot read: it is a folder; for many files there is 'curvify batch'")
    if path != STREAM or format is not None:
        with hint("--input-format", format):
            find_format(path, format, READ_FORMATS)
    if path == STREAM and sys.stdin is None:
        raise FormatError("standard input is closed")


def check_output(path: str, format: str | None, no_clobber: bool = False) -> str:
    """The format of OUT. Raises CurvifyError where it cannot be written, so far as that is known before the work."""
    if path == STREAM and format is None:
        raise OptionError("standard output needs --output-format, for example --output-format ply")
    if path.endswith("/") or (path != STREAM and os.path.isdir(path)):
        check_folder(path)
    with hint("--output-format", format):
        chosen = find_format(path, format, WRITE_FORMATS)
    check_target(path, no_clobber)
    return chosen


def check_target(path: str, no_clobber: bool = False) -> None:
    """Raise FormatError where OUT cannot be written, so far as that is known before the work."""
    if path == STREAM:
        if sys.stdout is None:
            raise FormatError("standard output is closed")
        return
    check_folder(path)
    if no_clobber and os.path.lexists(path):
        raise FormatError(f"{path}: it exists already; leave out --no-clobber to replace it")


def check_folder(path: str) -> None:
    """Raise FormatError where a file cannot be put."""
    if path.endswith("/") or os.path.isdir(path):
        raise FormatError(f"{path}: cannot write: it is a folder; give the name of a file")
    if not os.path.isdir(os.path.dirname(path) or "."):
        raise FormatError(f"{path}: cannot write: its folder does not exist; make it first")


def check_report(path: str, files: Mapping[str, str]) -> None:
    """Raise CurvifyError where a report cannot be written beside other ``files``, OUT and inputs by their names, so far
    as that is known before the work.
    """
    if path == STREAM:
        if files["OUT"] == STREAM:
            raise OptionError("OUT and --report cannot both be standard output")
        return
    check_folder(path)
    for name, other in files.items():
        if other != STREAM and os.path.realpath(path) == os.path.realpath(other):
            raise OptionError(f"{path}: {name} and --report cannot be the same file")


def check_suffix(path: str, suffix: str, rule: str) -> None:
    """Raise FormatError unless OUT is a stream or has the one suffix that there is."""
    if path != STREAM and os.path.splitext(path)[1].lower() != suffix:
        raise FormatError(f"{path}: {rule}; give a name that ends in {suffix}")


def check_ascii(ascii: bool, format: str) -> None:
    """Raise OptionError for --ascii where it means nothing."""
    if ascii and format != "ply":
        raise OptionError(f"--ascii is for PLY; {format} has no such choice")


def format_of(path: str, format: str | None) -> str | None:
    """``--input-format`` for one of several INs: None where its suffix tells, or for the first bytes to tell."""
    return None if os.path.splitext(path)[1].lower().removeprefix(".") in READ_FORMATS else format


def open_input(path: str, format: str | None) -> tuple[PolygonMesh, str]:
    """The mesh of IN and its name in messages. Raises CurvifyError."""
    check_input(path, format)
    return read_input(path, format), shown_name(path, "stdin")


def read_input(path: str, format: str | None) -> PolygonMesh:
    """The mesh of IN; what is read is then worked on."""
    keep_memory()
    if path == STREAM and format is None:
        with hint("--input-format", format):
            return read_mesh(path)
    return read_mesh(path, format)


def write_bytes(data: bytes, path: str) -> None:
    """Write a file, completely or not at all, or to standard output."""
    if path == STREAM:
        stdout = CountedStdout()
        stdout.write(data)
        stdout.flush()
        return
    with atomic_file(path) as out:
        out.write(data)


@contextmanager
def hint(option: str, given: str | None) -> Iterator[None]:
    """Name the option that tells a format, where a format that was not given is not known."""
    try:
        yield
    except FormatError as error:
        text = str(error)
        if given is None and "one of" in text:
            raise FormatError(f"{text} (with {option})") from None
        raise


@contextmanager
def naming(name: str, *kinds: type[CurvifyError]) -> Iterator[None]:
    """Put the name of the file before errors of these kinds that do not have it."""
    try:
        yield
    except kinds as error:
        text = str(error)
        if text.startswith((f"{name}:", f"{name!r}:")):
            raise
        raise type(error)(f"{name}: {text}") from None


class CountedStdout(io.BufferedIOBase):
    """Standard output that knows how many bytes went there."""

    def __init__(self) -> None:
        self.count = 0

    def writable(self) -> bool:
        """Always."""
        return True

    def write(self, data: Any, /) -> int:
        """Write bytes."""
        with memoryview(data) as view:
            self.count += view.nbytes
        with _naming_stdout():
            return sys.stdout.buffer.write(data)

    def flush(self) -> None:
        """Hand on what is buffered."""
        with _naming_stdout():
            sys.stdout.buffer.flush()

    def as_file(self) -> BinaryIO:
        """Itself, as the type that writers ask for."""
        return cast(BinaryIO, self)


@contextmanager
def _naming_stdout() -> Iterator[None]:
    """Say where an error of the operating system happened."""
    try:
        yield
    except OSError as error:
        error.filename = "stdout"
        raise
