"""Counting and listing in plain English."""

from __future__ import annotations

from collections.abc import Sequence


def count_of(number: int, noun: str, plural: str | None = None) -> str:
    """``1 face``, ``2,000 faces``."""
    return f"{number:,} {noun if number == 1 else plural or noun + 's'}"


def listed(words: Sequence[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)
