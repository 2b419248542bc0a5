"""How a command uses memory."""

from __future__ import annotations

from contextlib import suppress


def keep_memory() -> None:
    """Ask glibc to keep the memory of work arrays rather than return it: fresh pages cost more than what is done on
    them. Nothing happens with other C libraries.
    """
    import ctypes

    with suppress(AttributeError, OSError, TypeError):
        c_library = ctypes.CDLL(None)
        c_library.gnu_get_libc_version  # noqa: B018
        c_library.mallopt(-3, 32 << 20)  # M_MMAP_THRESHOLD
        c_library.mallopt(-1, 256 << 20)  # M_TRIM_THRESHOLD
