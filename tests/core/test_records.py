"""Records: fields in order or by name, defaults of their own, clear complaints."""

from __future__ import annotations

import pytest

from curvify.records import field, record, replaced


@record
class Pair:
    """A record to try."""

    first: int
    second: str = "two"
    notes: list[str] = field(default_factory=list)


def test_fields_are_taken_in_order_or_by_name() -> None:
    for pair in (Pair(1, "b"), Pair(1, second="b"), Pair(second="b", first=1)):
        assert (pair.first, pair.second, pair.notes) == (1, "b", [])
    assert Pair(1).second == "two"


def test_made_defaults_are_not_shared() -> None:
    Pair(1).notes.append("x")
    assert Pair(1).notes == []


@pytest.mark.parametrize(
    ("values", "named", "message"),
    [
        ((), {}, "needs its field 'first'"),
        ((1, "b", [], 4), {}, "has 3 fields, not 4"),
        ((1,), {"third": 3}, "no field 'third'"),
        ((1,), {"first": 1}, "no field 'first' left to set"),
    ],
)
def test_wrong_fields_are_refused(values: tuple[int, ...], named: dict[str, int], message: str) -> None:
    with pytest.raises(TypeError, match=message):
        Pair(*values, **named)  # type: ignore[arg-type]


def test_a_copy_differs_in_the_named_fields_only() -> None:
    pair = Pair(1, "b")
    copy = replaced(pair, second="c")
    assert (copy.first, copy.second, pair.second) == (1, "c", "b")
    assert copy.notes is pair.notes
