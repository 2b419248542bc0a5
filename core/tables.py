"""Basis tables at the samples of a patch, with the side fields at Chebyshev points in place of their values.

A side field depends on one variable, so its interpolant through a few Chebyshev points stands for it: the tables hold
what each of those points contributes to position and derivatives at each sample. Tables are kept from patch to patch,
up to a number of bytes.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from functools import lru_cache, partial

import numpy as np

from curvify.mesh import Floats
from curvify.records import record
from curvify.schemes.base import Basis, Form
from curvify.series import chebyshev_points

#: Samples of a patch evaluated with one table, so that the table stays in cache.
SAMPLES = 2048


def lagrange(count: int, t: Floats) -> tuple[Floats, Floats]:
    """Lagrange polynomials at the Chebyshev points and their derivatives at ``t (...)``: ``(...,m)`` each."""
    nodes = chebyshev_points(count)
    sign = (-1.0) ** np.arange(count)
    sign[[0, -1]] /= 2
    gap = t[..., None] - nodes
    at_node = np.abs(gap) < 1e-14
    terms = sign / np.where(at_node, 1.0, gap)
    values = terms / terms.sum(axis=-1, keepdims=True)
    hit = at_node.any(axis=-1)
    values[hit] = at_node[hit]
    return values, values @ _differentiation(count)


@lru_cache(maxsize=16)
def _differentiation(count: int) -> Floats:
    """Matrix ``(m,m)``: row i holds the derivatives at node i of the Lagrange polynomials."""
    nodes = chebyshev_points(count)
    sign = (-1.0) ** np.arange(count)
    sign[[0, -1]] /= 2
    gap = nodes[:, None] - nodes
    np.fill_diagonal(gap, 1.0)
    matrix = (sign / sign[:, None]) / gap
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return matrix


@record
class Tables:
    """Tables of one form at the samples ``first`` to ``last`` of a patch.

    Either ``matrix (K, o*S)`` for control vectors followed by field values, o = 3 orders (value, by xi, by eta) or 1;
    or, where the fields are to be evaluated at every sample, the ``basis`` itself.
    """

    first: int
    last: int
    matrix: Floats | None
    basis: Basis | None

    @property
    def bytes(self) -> int:
        """Memory it takes."""
        if self.matrix is not None:
            return self.matrix.nbytes
        return self.basis.linear.nbytes + 4 * self.basis.weights.nbytes if self.basis is not None else 0


class _TableCache:
    """Tables up to a number of bytes in all.

    When it is full, the tables of other surfaces make room, oldest first, never those of the same: every patch asks
    for all blocks of its tables in turn, and dropping the oldest would drop each just before it is asked for.
    """

    def __init__(self, most: int) -> None:
        self.most, self.size = most, 0
        self.tables: dict[tuple[object, ...], Tables] = {}
        self.lock = threading.Lock()

    def get(self, key: tuple[object, ...], make: Callable[[], Tables]) -> Tables:
        """The tables of a key, made if need be; two threads may make the same ones, which are equal."""
        with self.lock:
            found = self.tables.pop(key, None)
            if found is not None:
                self.tables[key] = found
                return found
        made = make()
        size = made.bytes
        with self.lock:
            others = [old for old in self.tables if old[:-1] != key[:-1]]
            while self.size + size > self.most and others:
                self.size -= self.tables.pop(others.pop(0)).bytes
            if key not in self.tables and self.size + size <= self.most:
                self.tables[key] = made
                self.size += size
        return made


_CACHE = _TableCache(160 << 20)


def blocks(form: Form, points: Floats, grid: tuple[int, int], count: int, orders: int) -> Iterator[Tables]:
    """Tables of a form at all interior ``points (S,2)`` of a sampling, block by block.

    ``grid`` (sides, level) names the sampling in the cache, ``count`` is the number of Chebyshev points.
    """
    for first in range(0, len(points), SAMPLES):
        last = min(first + SAMPLES, len(points))
        key = (form.key, grid, count, orders, first)
        basis = partial(_recent_basis, form, points, grid, first, last)
        yield _CACHE.get(key, partial(_make_tables, basis, first, last, count, orders))


#: The basis that was made last, with its key: tables for more Chebyshev points are made from it next.
_RECENT: list[tuple[object, Basis]] = []


def _recent_basis(form: Form, points: Floats, grid: tuple[int, int], first: int, last: int) -> Basis:
    key = (form.key, grid, first, last)
    for known, basis in list(_RECENT):
        if known == key:
            return basis
    basis = form.basis(points[first:last])
    _RECENT[:] = [(key, basis)]
    return basis


def _make_tables(basis_of: Callable[[], Basis], first: int, last: int, count: int, orders: int) -> Tables:
    basis = basis_of()
    if not count:
        return Tables(first, last, None, basis)
    samples, sides = basis.weights.shape[1:]
    linear = basis.linear[:orders]
    columns = linear.shape[2]
    table = np.empty((columns + sides * count, orders, samples))
    table[:columns] = linear.transpose(2, 0, 1)
    if sides:
        values, slopes = lagrange(count, basis.abscissae[0])
        weights, u = basis.weights[:orders, :, :, None], basis.abscissae[:orders, :, :, None]
        fields = np.empty((orders, samples, sides, count))
        fields[0] = weights[0] * values
        fields[1:] = weights[1:] * values + weights[0] * u[1:] * slopes
        fields[..., 0] += basis.ends[:orders, ..., 0]
        fields[..., -1] += basis.ends[:orders, ..., 1]
        table[columns:] = fields.reshape(orders, samples, -1).transpose(2, 0, 1)
    return Tables(first, last, np.ascontiguousarray(table.reshape(len(table), -1)), None)
