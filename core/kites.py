"""The cells of a dense mesh of quads on the kites of its patches: where they lie, and what is carried over them.

A patch with n sides has n kites, one at each corner: the quad between the corner, the middles of its two sides and the
middle of the patch. At level k each has k x k cells. Kites are numbered like the corners of the patches.
"""

from __future__ import annotations

import numpy as np

from curvify.arrays import values_of
from curvify.mesh import Floats, Ints
from curvify.records import record
from curvify.sampling import domain_corners
from curvify.topology import Topology

#: Corners of a cell in the grid of its kite, counter-clockwise.
CELL = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])


def kite_corners(values: Floats, offsets: Ints, following: Ints, before: Ints) -> Floats:
    """Values ``(C,4,c)`` at the corners of all kites, from those at the corners of polygons ``(C,c)``: at its own, in
    the middle of the side that leaves it, in the middle of the polygon, in the middle of the side before.
    """
    sizes = np.diff(offsets)
    mean = np.repeat(np.add.reduceat(values, offsets[:-1]) / sizes[:, None], sizes, axis=0)
    return np.stack([values, (values + values[following]) / 2, mean, (values + values[before]) / 2], axis=1)


def bilinear(corners: Floats, a: Floats, b: Floats) -> Floats:
    """Values ``(...,c)`` at coordinates ``a``, ``b (...)`` between those at a kite's ``corners (...,4,c)``.

    On a side only its two ends count, bit by bit, whatever kite it belongs to.
    """
    a, b = a[..., None], b[..., None]
    near = (1 - a) * corners[..., 0, :] + a * corners[..., 1, :]
    far = (1 - a) * corners[..., 3, :] + a * corners[..., 2, :]
    return (1 - b) * near + b * far


def domain_points(topology: Topology, kites: Ints, places: Floats) -> Floats:
    """Domain points ``(n,2)`` of patches at coordinates ``(n,2)`` of some of their kites ``(n,)``."""
    faces = topology.faces[kites]
    sizes = topology.sizes[faces]
    result = np.empty((len(kites), 2))
    for size in values_of(sizes):
        rows = np.flatnonzero(sizes == size)
        turn = np.arange(size)
        maps = kite_corners(domain_corners(size), np.array([0, size]), (turn + 1) % size, (turn - 1) % size)
        maps[:, 2] = 0.0
        own = maps[kites[rows] - topology.offsets[faces[rows]]]
        result[rows] = bilinear(own, places[rows, 0], places[rows, 1])
    return result


@record
class CellGrid:
    """The cells of refinement level k: cell q lies on kite q // k^2."""

    level: int

    def corners(self, cells: Ints) -> tuple[Ints, Floats]:
        """Kite ``(q,)`` of some cells, and the grid coordinates ``(q,4,2)`` of their corners: whole numbers to k."""
        kite, cell = np.divmod(cells, self.level**2)
        low = np.stack(np.divmod(cell, self.level), axis=1)
        return kite, (low[:, None] + CELL).astype(np.float64)
