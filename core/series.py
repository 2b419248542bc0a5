"""Side fields by their values at Chebyshev points: at how many, patch by patch.

A side field depends on one variable and is analytic, so its Chebyshev coefficients fall like a geometric series. The
last few tell the rate, the rate what is left out, and where that is too much, how many points would do.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from curvify.mesh import Floats, Ints
from curvify.schemes.base import Controls

#: Numbers of Chebyshev points, fewest first.
NODE_COUNTS = (8, 12, 16, 24, 32, 48, 64, 96)
#: Patches for which tables of their own pay. Fewer take those of others that need more points; above LAST points their
#: fields are evaluated at every sample.
MANY_PATCHES, LAST = 16, 48
#: Chebyshev coefficients at the end of a series from which the rest is estimated.
TAIL = 4
#: How much to make of the estimate of what a series leaves out.
SAFETY = 10.0
#: Coefficients below this share of the longest vector are rounding noise.
NOISE = 2e-15
#: Rates of coefficients for which a number of points is worked out: above, they hardly fall.
RATES = 1e-3, 0.98


def chebyshev_points(count: int) -> Floats:
    """Chebyshev-Lobatto points ``(m,)`` of [0, 1], ascending, ends included."""
    return np.sin(0.5 * np.pi * np.arange(count) / (count - 1)) ** 2


@lru_cache(maxsize=16)
def tail_matrix(count: int) -> Floats:
    """Values at the Chebyshev points to the last coefficients of their series ``(m, TAIL)``."""
    j = np.arange(count)
    order = j[-TAIL:]
    matrix = np.cos(np.pi * np.outer(count - 1 - j, order) / (count - 1)) * 2 / (count - 1)
    matrix[[0, -1]] /= 2
    matrix[:, order == count - 1] /= 2
    return matrix


def points_needed(fields: Floats, tolerance: float) -> Ints:
    """How many Chebyshev points each patch ``(f,)`` needs for its ``fields (3,f,n,m)``; m where these are enough.

    They are enough where the sum of the coefficients left out is below ``tolerance`` times the longest of a patch's
    vectors, or the last four are rounding noise. Otherwise the coefficients have to fall on at their rate until it is.
    The vectors at both ends and in the middle stand for all.
    """
    rows = fields.transpose(3, 0, 2, 1)  # the order in memory
    count = len(rows)
    last = tail_matrix(count).T @ rows.reshape(count, -1)
    last = np.abs(last, out=last).reshape(TAIL, *rows.shape[1:]).max(axis=1)
    earlier, later = np.maximum(last[0], last[1]), np.maximum(last[2], last[3])
    rate = np.sqrt(np.divide(later, earlier, out=np.ones_like(later), where=earlier > later))
    left_out = SAFETY * later * rate / np.maximum(1 - rate, 1 / SAFETY)
    size = np.abs(rows[[0, count // 2, -1]]).max(axis=(0, 1, 2))
    noise = np.maximum(earlier, later).max(axis=0) <= NOISE * size
    needed = np.full(len(size), count)
    short = np.flatnonzero(~(noise | (left_out.max(axis=0) <= tolerance * size)))
    if len(short):
        with np.errstate(divide="ignore", invalid="ignore"):
            excess = np.log(left_out[:, short] / (tolerance * size[short]))
        more = np.ceil(excess / -np.log(np.clip(rate[:, short], *RATES))).max(axis=0)
        roof = LAST if count < LAST else NODE_COUNTS[-1]  # what the rate says is no reason not to try
        most = max(roof - count, 1)
        needed[short] += np.where(more < most, np.maximum(more, 1), most).astype(np.int64)
    return needed


def sampled(controls: Controls, count: int, tolerance: float) -> Iterator[tuple[Ints, Controls, Floats, Ints]]:
    """The fields of ``count`` patches at enough Chebyshev points, group by group.

    Yields the patches ``rows (r,)`` of a group, their controls and ``fields (3,r,n,m)``, and for which of them m is
    enough, ``part (p,)``: the others come again. Patches for which no number is enough never do.
    """
    needed = np.full(count, NODE_COUNTS[0])
    for points in NODE_COUNTS:
        rows = np.flatnonzero((needed > 0) & (needed <= points))
        if not len(rows) or (points > LAST and len(rows) < MANY_PATCHES):
            continue
        group = controls if len(rows) == count else controls.take(rows)
        fields = group.fields(chebyshev_points(points))
        needed[rows] = points_needed(fields, tolerance) if fields.shape[2] else points
        part = np.flatnonzero(needed[rows] <= points)
        others = needed[(needed > points) & (needed <= LAST)]
        if len(part) < MANY_PATCHES and len(others):
            needed[rows[part]] = others.min()
        elif len(part):
            needed[rows[part]] = 0  # done
            yield rows, group, fields, part
