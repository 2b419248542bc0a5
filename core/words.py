"""Counting in plain English."""

from __future__ import annotations


def count_of(number: int, noun: str, plural: str | None = None) -> str:
    """``1 face``, ``2,000 faces``."""
    return f"{number:,} {noun if number == 1 else plural or noun + 's'}"
