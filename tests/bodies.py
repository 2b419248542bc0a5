"""Meshes of boxes, alone and touching each other, with the defects that repairs are for. No test lives here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product

from curvify.mesh import PolygonMesh

BOX = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]


def boxes(*places: Sequence[float], turned: Iterable[tuple[int, int]] = (), missing: Iterable[tuple[int, int]] = ()):
    """Unit boxes at places on one set of vertices; the faces ``(box, face)`` that are turned, and those left out."""
    turned, missing = set(turned), set(missing)
    points: list[tuple[float, ...]] = []
    faces = []
    for number, place in enumerate(places):
        corners = [tuple(x + o for x, o in zip(c[::-1], place, strict=True)) for c in product((0, 1), repeat=3)]
        points += [corner for corner in corners if corner not in points]
        for k, face in enumerate(BOX):
            loop = [points.index(corners[i]) for i in face]
            if (number, k) not in missing:
                faces.append(loop[::-1] if (number, k) in turned else loop)
    return PolygonMesh.from_faces(points, faces)
