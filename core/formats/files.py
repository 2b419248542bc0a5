"""Opening files: whole reads with plain errors, and output that appears complete or not at all."""

from __future__ import annotations

import errno
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import BinaryIO

from curvify.errors import FormatError

_OWN_STREAM = r"/dev/(?:stdin|stdout|stderr|fd/\d+)\Z|/proc/self/fd/\d+\Z"
_NAMED_STREAMS = {"stdin": 0, "stdout": 1, "stderr": 2}
_NO_ROOM = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS}


def _explain(path: str, verb: str, error: OSError) -> FormatError:
    """One clear line for an operating system error."""
    if isinstance(error, FileNotFoundError):
        what = "there is no such file" if verb == "read" else "its folder does not exist; make it first"
    elif isinstance(error, IsADirectoryError):
        what = "it is a folder; give the name of a file"
    elif isinstance(error, PermissionError):
        what = "permission denied"
    else:
        what = (error.strerror or str(error)).lower()
    return FormatError(f"{path}: cannot {verb}: {what}")


def read_bytes(path: str) -> bytes:
    """The whole content of a file. Raises FormatError where it cannot be read."""
    try:
        with open(path, "rb", buffering=0) as file:
            return file.readall()
    except ValueError:  # an embedded null character
        raise FormatError(f"{path!r}: cannot read: that is not a file name") from None
    except OSError as error:
        raise _explain(path, "read", error) from None


@contextmanager
def atomic_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """An open binary file whose content takes the place of ``path`` when the block ends well.

    Until then everything goes to a temporary file beside the target, which is removed if the block
    raises anything (KeyboardInterrupt too). The file may be filled through its descriptor
    (``os.pwrite``) or through ``write``, not both without a flush between. A new file gets the
    umask's permissions, a replaced one keeps its own; a symbolic link stays and its target changes.

    A device, a pipe or one of the process's own streams (``/dev/stdout``) is written straight: ask
    ``seekable()`` before using positions, and add ``tell()`` as it is on entry.
    Raises FormatError where the target cannot be written or there is no room.
    """
    name = os.fspath(path)
    temporary = target = held = None
    try:
        try:
            opened = _open_stream(name)
            if opened is None:
                target = _target(name)
                temporary = _beside(target)  # known before there is a file: a signal may come at any time
                opened = _create(temporary, target)
        except ValueError:
            raise FormatError(f"{name!r}: cannot write: that is not a file name") from None
        except OSError as error:
            raise _explain(name, "write", error) from None
        with opened:
            if temporary and os.name == "posix":
                held = os.dup(opened.fileno())  # keeps the lock until the file has its name
            yield opened
        if temporary and target:
            os.replace(temporary, target)
    except BaseException as error:
        if temporary:
            with suppress(OSError):
                os.unlink(temporary)
        if isinstance(error, OSError) and error.errno in _NO_ROOM:
            raise _explain(name, "write", error) from None
        raise
    finally:
        if held is not None:
            os.close(held)


def _open_stream(name: str) -> BinaryIO | None:
    """The target itself where it is not a regular file, None where it is or will be one."""
    full = os.path.join(os.getcwd(), name) if name else name
    if re.match(_OWN_STREAM, full):
        last = full.rsplit("/", 1)[1]
        # A duplicate keeps the stream's place: opening the name again would start over at 0.
        return os.fdopen(os.dup(_NAMED_STREAMS[last] if last in _NAMED_STREAMS else int(last)), "wb")
    try:
        mode = os.stat(name).st_mode
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "is a directory", name)
    if stat.S_ISREG(mode):
        if not os.access(name, os.W_OK):
            raise PermissionError(errno.EACCES, "permission denied", name)
        return None
    return open(name, "wb")


def _target(name: str) -> str:
    """The file that a name leads to."""
    if not name or name.endswith("/"):
        raise IsADirectoryError(errno.EISDIR, "is a directory", name)
    return os.path.realpath(name)


def _beside(target: str) -> str:
    """A name for a temporary file in the folder of the target that nobody else uses."""
    return os.path.join(os.path.dirname(target), f".curvify-{os.urandom(6).hex()}.part")


def _create(temporary: str, target: str) -> BinaryIO:
    """A new temporary file, locked, with the permissions of the target where there is one."""
    while True:
        descriptor = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        if _lock(descriptor) and os.path.exists(temporary):
            break
        os.close(descriptor)  # someone who cleans up was faster and removed it
        with suppress(OSError):
            os.unlink(temporary)
    with suppress(OSError):
        os.chmod(temporary, stat.S_IMODE(os.stat(target).st_mode))
    return os.fdopen(descriptor, "w+b")


def _lock(descriptor: int) -> bool:
    """Lock an open file against ``remove_leftovers`` until it is closed or its process ends, however that ends.

    False where another process holds the lock. Where the system has no such locks, everything counts as locked by us:
    Windows does not let go of files that are open anyway.
    """
    try:
        import fcntl
    except ImportError:
        return True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True


def remove_leftovers(folder: str | os.PathLike[str]) -> int:
    """Remove the temporary files that killed processes have left in a folder; how many there were.

    Those that a living process still writes are locked and stay.
    """
    removed = 0
    names = [name for name in os.listdir(folder) if re.match(r"\.curvify-.*\.part\Z", name)]
    for path in [os.path.join(folder, name) for name in names]:
        with suppress(OSError):
            descriptor = os.open(path, os.O_RDWR)
            try:
                ours = _lock(descriptor)
                if ours and os.name == "posix":
                    os.unlink(path)
            finally:
                os.close(descriptor)
            if ours and os.name != "posix":  # where no one removes a file that is open, themselves included
                os.unlink(path)
            removed += ours
    return removed


def clean_name(name: str) -> str:
    """A name that fits on one line of a text file."""
    return " ".join(name.split())
