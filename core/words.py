"""Counting and listing in plain English."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

#: What each kind of mark is a mark of, where its name alone does not say it.
_MARKED = {"straight": "straight edge", "normal": "edge normal", "flat": "flat face"}


def count_of(number: int, noun: str, plural: str | None = None) -> str:
    """``1 face``, ``2,000 faces``."""
    return f"{number:,} {noun if number == 1 else plural or noun + 's'}"


def listed(words: Sequence[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def marks_of(counts: Mapping[str, int]) -> str:
    """Marks of several kinds: ``12 creases, 1 flat face``."""
    return ", ".join(count_of(number, _MARKED.get(kind, kind)) for kind, number in counts.items())
