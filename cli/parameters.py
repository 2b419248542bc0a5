"""The types of values that options and arguments take, with messages of their own."""

from __future__ import annotations

from typing import Any

import click


class Whole(click.IntRange):
    """Whole numbers in a range; click's own message calls what is none "not a valid integer range"."""

    name = "whole number"


class Number(click.FloatRange):
    """Numbers in a range."""

    name = "number"


POSITIVE = Whole(min=1)
#: IN and OUT; what cannot be read is told by the reader.
FILE = click.Path(allow_dash=True, readable=False)
DEGREES = Number(min=0, max=180)


class Length(click.ParamType):  # type: ignore[type-arg,unused-ignore]
    """A length in units of the file, or with ``%`` a share of the diagonal: ``(number, is_share)``."""

    name = "length"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, bool]:
        """The number and whether it is a share."""
        if isinstance(value, tuple):
            return value
        share = value.endswith("%")
        try:
            number = float(value[:-1]) / 100 if share else float(value)
        except ValueError:
            number = -1.0
        if not 0 <= number < float("inf"):
            self.fail(f"'{value}' is not a length; give a number from 0 on, or a share of the diagonal such as 0.01%")
        return number, share


class Limits(click.ParamType):  # type: ignore[type-arg,unused-ignore]
    """Two numbers in order, ``LOW,HIGH``."""

    name = "limits"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, float]:
        """The two numbers."""
        if isinstance(value, tuple):
            return value
        try:
            low, high = (float(part) for part in value.split(","))
        except ValueError:
            low, high = 1.0, 0.0
        if not (float("-inf") < low <= high < float("inf")):
            self.fail(f"'{value}' is not a range; give two numbers in order, as in 0,2.5")
        return low, high
