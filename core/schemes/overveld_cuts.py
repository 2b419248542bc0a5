"""How triangles are cut whose sides are split: templates for 0 to 3 split sides, with the edges of the new triangles.

Corners of a triangle are nodes 0 to 2, the middle of side i is node 3 + i. Edges: 2 i and 2 i + 1 are the halves of
side i, 6 + i the whole of it, from 9 on come those inside. Source: van Overveld, Wyvill, sections 2.5 and 3.2.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from curvify.arrays import values_of
from curvify.mesh import Bools, Floats, Ints

#: Diagonals whose squared lengths agree to this share are equally long.
EQUAL = 1e-9


class Template(NamedTuple):
    """Triangles ``nodes (t,3)`` with ``edges (t,3)``, and the ``inner (j,2)`` nodes of the edges inside."""

    nodes: Ints
    edges: Ints
    inner: Ints


@lru_cache(maxsize=16)
def template(mask: int, turned: bool = False) -> Template:
    """How a triangle is cut whose side i is split where bit i of ``mask`` is set.

    Two split sides leave a quad, which is cut from its first corner, or, ``turned``, from its second.
    """
    count = mask.bit_count()
    if count in (0, 3):
        nodes = [[0, 1, 2]] if not count else [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]
        edges = [[6, 7, 8]] if not count else [[0, 9, 5], [1, 2, 10], [11, 3, 4], [10, 11, 9]]
        inner = [] if not count else [[3, 5], [3, 4], [4, 5]]
        return _turned_template(nodes, edges, inner, 0)
    if count == 1:
        return _turned_template([[0, 3, 2], [3, 1, 2]], [[0, 9, 8], [1, 7, 9]], [[3, 2]], mask.bit_length() - 1)
    first = {3: 0, 6: 1, 5: 2}[mask]
    if turned:
        nodes, edges = [[3, 1, 4], [0, 3, 2], [3, 4, 2]], [[1, 2, 9], [0, 10, 8], [9, 3, 10]]
        return _turned_template(nodes, edges, [[3, 4], [3, 2]], first)
    nodes, edges = [[3, 1, 4], [0, 3, 4], [0, 4, 2]], [[1, 2, 9], [0, 9, 10], [10, 3, 8]]
    return _turned_template(nodes, edges, [[3, 4], [0, 4]], first)


def _turned_template(nodes: list[list[int]], edges: list[list[int]], inner: list[list[int]], by: int) -> Template:
    """A template for side 0 turned to side ``by``."""
    node = np.array([(i + by) % 3 for i in range(3)] + [3 + (i + by) % 3 for i in range(3)])
    halves = [2 * ((i // 2 + by) % 3) + i % 2 for i in range(6)]
    edge = np.array(halves + [6 + (i + by) % 3 for i in range(3)] + [9, 10, 11])
    return Template(node[nodes], edge[edges], node[np.array(inner, dtype=np.int64).reshape(-1, 2)])


def cuts(split: Bools, positions: Floats, corners: Ints) -> list[tuple[Template, Ints]]:
    """Templates and the triangles that they cut: sides ``split (F,3)``, nodes ``corners (F,6)``.

    What two split sides leave is cut along its shorter diagonal, or that at its lowest vertex.
    """
    masks = split @ np.array([1, 2, 4])
    groups: list[tuple[Template, Ints]] = []
    for mask in values_of(masks):
        hit = np.flatnonzero(masks == mask)
        if mask.bit_count() != 2:
            groups.append((template(mask), hit))
            continue
        whole = (~mask & 7).bit_length() - 1
        a, b = corners[hit, (whole + 1) % 3], corners[hit, whole]
        past_a, past_b = corners[hit, 3 + (whole + 1) % 3], corners[hit, 3 + (whole + 2) % 3]
        first, second = (((positions[p] - positions[q]) ** 2).sum(axis=1) for p, q in ((a, past_b), (past_a, b)))
        turned = np.where(np.abs(first - second) <= EQUAL * first, b < a, second < first)
        groups += [(template(mask, True), hit[turned]), (template(mask), hit[~turned])]
    return groups
