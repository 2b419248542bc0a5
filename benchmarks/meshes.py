"""Coarse meshes to measure with: tilings of a torus, slightly jittered, in a few polygon sizes.

A tiling is a cell of the integer lattice: where its vertices are, and its faces as (step in i, step in j, vertex)
counter-clockwise. Repeated nu x nv times and closed both ways it covers a torus, so every vertex is inside and every
face of a kind costs the same. The jitter comes from a fixed seed: the same mesh every time.

    python benchmarks/meshes.py quads 16384 torus.obj
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Corner = tuple[int, int, int]

#: Radii of the torus.
MAJOR, MINOR = 1.0, 0.4
#: Largest displacement of a vertex over the shortest side; small enough to leave every face convex.
JITTER = 0.04


@dataclass(frozen=True)
class Tiling:
    """Vertices of one cell, in cells, and its faces."""

    points: list[tuple[float, float]]
    faces: list[list[Corner]]

    @property
    def corners(self) -> int:
        """Face corners in one cell."""
        return sum(map(len, self.faces))

    @property
    def shortest(self) -> float:
        """Length of the shortest side, in cells."""
        ends = [(face[k - 1], face[k]) for face in self.faces for k in range(len(face))]
        return min(math.dist(self._place(a), self._place(b)) for a, b in ends)

    def _place(self, corner: Corner) -> tuple[float, float]:
        i, j, k = corner
        return i + self.points[k][0], j + self.points[k][1]


def _between(a: tuple[float, float], b: tuple[float, float], t: float) -> tuple[float, float]:
    return a[0] * (1 - t) + b[0] * t, a[1] * (1 - t) + b[1] * t


# Corners of the hexagon around the lattice point (0, 0): the centers of the triangles around it.
_HEXAGON = [(2 / 3, 1 / 3), (1 / 3, 2 / 3), (-1 / 3, 1 / 3), (-2 / 3, -1 / 3), (-1 / 3, -2 / 3), (1 / 3, -1 / 3)]
# The same corners as vertices 0 and 1 of the cells around.
_CORNERS: list[Corner] = [(0, 0, 0), (0, 0, 1), (-1, 0, 0), (-1, -1, 1), (-1, -1, 0), (0, -1, 1)]

TILINGS = {
    "triangles": Tiling([(0, 0)], [[(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 0, 0), (1, 1, 0), (0, 1, 0)]]),
    "quads": Tiling([(0, 0)], [[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]]),
    # Hexagons cut in two through the middles of opposite sides.
    "pentagons": Tiling(
        [*_HEXAGON[:2], (1 / 2, 1 / 2)],
        [
            [(0, 0, 2), *_CORNERS[1:4], (-1, -1, 2)],
            [(-1, -1, 2), *_CORNERS[4:], _CORNERS[0], (0, 0, 2)],
        ],
    ),
    "hexagons": Tiling(_HEXAGON[:2], [_CORNERS]),
    # Shrunken hexagons with squares across their sides and triangles across their corners.
    "mixed": Tiling(
        [(0.6 * x, 0.6 * y) for x, y in _HEXAGON],
        [
            [(0, 0, k) for k in range(6)],
            [(0, 0, 1), (0, 0, 0), (1, 1, 4), (1, 1, 3)],
            [(0, 0, 2), (0, 0, 1), (0, 1, 5), (0, 1, 4)],
            [(0, 0, 3), (0, 0, 2), (-1, 0, 0), (-1, 0, 5)],
            [(0, 0, 0), (1, 0, 2), (1, 1, 4)],
            [(0, 0, 1), (1, 1, 3), (0, 1, 5)],
        ],
    ),
    # Squares with their corners cut off, which makes small squares of the corners.
    "octagons": Tiling(
        [(1 / 2, -0.2), (1 / 2, 0.2), (0.2, 1 / 2), (-0.2, 1 / 2)],
        [
            [(0, 0, 0), (0, 0, 1), (0, 0, 2), (0, 0, 3), (-1, 0, 1), (-1, 0, 0), (0, -1, 3), (0, -1, 2)],
            [(0, 0, 1), (1, 0, 3), (0, 1, 0), (0, 0, 2)],
        ],
    ),
    # Hexagons with their corners cut off, which makes small triangles of the corners.
    "dodecagons": Tiling(
        [_between(_HEXAGON[k], _HEXAGON[k + 1], t) for k in range(3) for t in (0.27, 0.73)],
        [
            [
                *[(0, 0, k) for k in range(6)],
                (-1, -1, 1),
                (-1, -1, 0),
                (0, -1, 3),
                (0, -1, 2),
                (1, 0, 5),
                (1, 0, 4),
            ],
            [(1, 0, 3), (0, 0, 0), (1, 0, 4)],
            [(0, 0, 1), (1, 1, 5), (0, 0, 2)],
        ],
    ),
}


def torus(kind: str, corners: int) -> tuple[NDArray[np.float64], list[NDArray[np.int64]]]:
    """Positions ``(V,3)`` and faces, an array ``(f,n)`` for each face of the tiling, with about that many corners."""
    tiling = TILINGS[kind]
    count = max(round(math.sqrt(corners / tiling.corners)), 3)
    i, j = (axis.reshape(-1) for axis in np.meshgrid(np.arange(count), np.arange(count), indexing="ij"))
    size = len(tiling.points)
    places = np.stack([i, j], axis=1)[:, None, :] + np.array(tiling.points)
    random = np.random.default_rng(20)
    jitter = JITTER * tiling.shortest
    places = places.reshape(-1, 2) + random.uniform(-jitter, jitter, (len(i) * size, 2))
    minor = MINOR + 2 * np.pi * MINOR / count * random.uniform(-jitter, jitter, len(places))
    u, v = 2 * np.pi * places.T / count
    reach = MAJOR + minor * np.cos(v)
    positions = np.stack([reach * np.cos(u), reach * np.sin(u), minor * np.sin(v)], axis=1)
    faces = [
        np.stack([((i + a) % count * count + (j + b) % count) * size + k for a, b, k in face], axis=1)
        for face in tiling.faces
    ]
    return positions, faces


def write_obj(path: Path, positions: NDArray[np.float64], faces: list[NDArray[np.int64]]) -> None:
    """Write positions and faces, nothing else, as OBJ; the faces of a cell stay together."""
    lines = ["v {:.7f} {:.7f} {:.7f}\n".format(*row) for row in positions.tolist()]
    for cell in zip(*[(face + 1).tolist() for face in faces], strict=True):
        lines += ["f " + " ".join(map(str, face)) + "\n" for face in cell]
    path.write_text("".join(lines))


def main() -> None:
    """Write the mesh that the command line asks for: kind, corners, file."""
    kind, corners, path = sys.argv[1:]
    write_obj(Path(path), *torus(kind, int(corners)))


if __name__ == "__main__":
    main()
