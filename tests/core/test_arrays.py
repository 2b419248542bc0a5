"""Array tools: what numpy would do, in an order of memory and a time of their own."""

from __future__ import annotations

import numpy as np
import pytest

from curvify.arrays import all_finite, by_component, distinct, offsets_of, pick, ranking, stacked, take_rows
from curvify.formats.obj_faces import _in_numbers
from curvify.formats.scan import BLANK, blanks


@pytest.mark.parametrize("most", [1, 50, 2**40, 2**62])
@pytest.mark.parametrize("least", [0, -3])
def test_ranking_is_a_stable_sort(least: int, most: int) -> None:
    keys = np.random.default_rng(1).integers(least, most, 2000)
    np.testing.assert_array_equal(ranking(keys), np.argsort(keys, kind="stable"))
    np.testing.assert_array_equal(ranking(keys[:0]), np.zeros(0))


def test_distinct_is_unique() -> None:
    keys = np.random.default_rng(2).integers(0, 300, 1000)
    values, inverse = distinct(keys)
    np.testing.assert_array_equal(values, np.unique(keys))
    np.testing.assert_array_equal(values[inverse], keys)


@pytest.mark.parametrize("index", [np.array([3, 0, 3]), np.array([[1, 2], [4, 4]])])
def test_rows_keep_their_order_in_memory(index: np.ndarray) -> None:
    rows = np.arange(15.0).reshape(5, 3)
    np.testing.assert_array_equal(take_rows(rows, index), rows[index])
    found = take_rows(by_component(rows), index)
    np.testing.assert_array_equal(found, rows[index])
    assert np.moveaxis(found, -1, 0).flags.c_contiguous
    assert (by_component(rows) + found.reshape(-1, 3)[:1]).flags.f_contiguous


def test_small_tools() -> None:
    first = np.array([True, False, True])
    np.testing.assert_array_equal(pick(first, np.arange(3), np.arange(10, 13)), [0, 11, 2])
    np.testing.assert_array_equal(offsets_of(np.array([3, 0, 2])), [0, 3, 3, 5])
    np.testing.assert_array_equal(stacked([np.eye(3), 2 * np.eye(3)]), np.stack([np.eye(3), 2 * np.eye(3)], axis=1))


def test_finite_numbers_are_told_from_others_also_where_their_sum_overflows() -> None:
    assert all_finite(np.array([1e308, 1e308]))
    assert not all_finite(np.array([np.inf, -np.inf])) and not all_finite(np.array([1.0, np.nan]))


def test_blanks_and_bytes_of_faces_by_arithmetic() -> None:
    every = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(blanks(every), BLANK)
    assert bytes(every[_in_numbers(every)]) == b"+-/0123456789"
