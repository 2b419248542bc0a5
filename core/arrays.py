"""Small array tools without a home of their own, in numpy alone."""

from __future__ import annotations

import numpy as np

from curvify.mesh import Floats, Ints


def distinct(keys: Ints) -> tuple[Ints, Ints]:
    """Sorted distinct values ``(u,)`` of integers ``(n,)``, and the index of each key among them ``(n,)``.

    What ``numpy.unique`` does with ``return_inverse``, without its import of masked arrays, which costs a short run
    a tenth of its time.
    """
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    fresh = np.ones(len(keys), dtype=bool)
    fresh[1:] = ordered[1:] != ordered[:-1]
    inverse = np.empty(len(keys), dtype=np.int64)
    inverse[order] = np.cumsum(fresh) - 1
    return ordered[fresh], inverse


def values_of(small: Ints) -> list[int]:
    """Distinct values of small non-negative integers, ascending."""
    return [int(value) for value in np.flatnonzero(np.bincount(small))]


def cross(a: Floats, b: Floats, axis: int = -1) -> Floats:
    """Cross products along an axis: ``numpy.cross`` for plain 3-vectors, in a third of its time."""
    a, b = np.moveaxis(a, axis, 0), np.moveaxis(b, axis, 0)
    result = np.empty((3, *np.broadcast_shapes(a.shape[1:], b.shape[1:])))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        np.multiply(a[j], b[k], out=result[i])
        result[i] -= a[k] * b[j]
    return np.moveaxis(result, 0, axis)


def unit_rows(vectors: Floats) -> Floats:
    """Vectors ``(3,...)`` along the leading axis scaled to length 1, zero where they have none."""
    length = np.sqrt(np.einsum("c...,c...->...", vectors, vectors))
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
