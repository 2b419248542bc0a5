"""How close blending surfaces come to surfaces that are known: spheres and tori, as quads and as polygons.

    python benchmarks/blend_quality.py [--level K]

Prints a table with the largest and the rms distance, in units of the sphere's radius or the torus's, whose tube has
0.8 of them and whose middle line 2, and the largest error of the normals in degrees. Section 6 of docs/blending.md has
the table. Needs nothing but curvify.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import curvify
from curvify.mesh import PolygonMesh
from curvify.normals import degrees_between

Array = npt.NDArray[np.float64]
Faces = list[list[int]]
MAJOR, MINOR = 2.0, 0.8


def unit(vectors: npt.ArrayLike) -> Array:
    """Rows scaled to length 1."""
    rows = np.asarray(vectors, dtype=np.float64)
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


def onto_torus(points: Array) -> Array:
    """The nearest points of the torus."""
    ring = MAJOR * unit(points * [1, 1, 0])
    return ring + MINOR * unit(points - ring)


def cube() -> tuple[Array, Faces]:
    points = unit([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
    return points, [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]


def icosahedron() -> tuple[Array, Faces]:
    golden = (1 + 5**0.5) / 2
    points = unit([p for a in (-1, 1) for b in (-golden, golden) for p in ([0, a, b], [a, b, 0], [b, 0, a])])
    near = np.linalg.norm(points[:, None] - points, axis=2) < 1.1
    faces: Faces = []
    for a in range(12):
        for b in np.flatnonzero(near[a]):
            for c in np.flatnonzero(near[a] & near[b]):
                if a < b < c:
                    turn = np.linalg.det(points[[a, b, c]]) < 0
                    faces.append([a, int(c), int(b)] if turn else [a, int(b), int(c)])
    return points, faces


def torus(around: int, tube: int, triangles: bool = False) -> tuple[Array, Faces]:
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(around), np.arange(tube), indexing="ij"))
    u, v = 2 * np.pi * i / around, 2 * np.pi * j / tube
    ring = np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    points = (MAJOR + MINOR * np.cos(v))[:, None] * ring + (MINOR * np.sin(v))[:, None] * [0, 0, 1]
    faces: Faces = []
    for a in range(around):
        for b in range(tube):
            quad = [x % around * tube + y % tube for x, y in ((a, b), (a + 1, b), (a + 1, b + 1), (a, b + 1))]
            faces += [quad[:3], [quad[0], quad[2], quad[3]]] if triangles else [quad]
    return points, faces


def into_quads(points: Array, faces: Faces, onto: Callable[[Array], Array]) -> tuple[Array, Faces]:
    """Each polygon of n sides as n quads, the new points projected to the surface."""
    middles: dict[tuple[int, int], int] = {}
    every = list(points)

    def middle(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in middles:
            middles[key] = len(every)
            every.append((points[a] + points[b]) / 2)
        return middles[key]

    result: Faces = []
    for face in faces:
        rim = [middle(a, b) for a, b in zip(face, face[1:] + face[:1], strict=True)]
        center = len(every)
        every.append(points[face].mean(axis=0))
        result += [[v, rim[i], center, rim[i - 1]] for i, v in enumerate(face)]
    return onto(np.array(every)), result


@dataclass(frozen=True)
class Case:
    """A mesh of points on a sphere or on the torus."""

    name: str
    points: Array
    faces: Faces
    round: bool = True

    def measure(self, level: int, **options: object) -> tuple[float, float, float]:
        """Largest and rms distance to the surface, over the grids of all patches, and largest angle between its
        normals and those of the dense mesh.
        """
        mesh = PolygonMesh.from_faces(self.points, self.faces)
        dense = curvify.refine(mesh, "blend", level=level, **options)  # type: ignore[arg-type]
        points = dense.positions
        ring = 0.0 if self.round else MAJOR * unit(points * [1, 1, 0])
        offset = points - ring
        distance = np.linalg.norm(offset, axis=1) - (1.0 if self.round else MINOR)
        angles = degrees_between(dense.normals[: len(points)], offset)
        assert dense.source_patches is not None
        shown = np.unique(dense.source_patches[:, None] * len(points) + dense.faces) % len(points)
        rms = np.sqrt((distance[shown] ** 2).mean())
        return float(np.abs(distance).max()), float(rms), float(angles.max())


def cases() -> Iterator[Case]:
    """The meshes of the table."""
    points, faces = cube()
    for step in range(1, 4):
        points, faces = into_quads(points, faces, unit)
        yield Case(f"sphere, cube divided {step} times ({len(faces)} quads)", points, faces)
    base = points, faces = icosahedron()
    for _ in range(2):
        points, faces = into_quads(points, faces, unit)
        yield Case(f"sphere, icosahedron in {len(faces)} quads", points, faces)
    for around, tube in ((8, 6), (16, 12)):
        yield Case(f"torus {around}x{tube}", *torus(around, tube), round=False)
    points, faces = into_quads(*torus(16, 12, triangles=True), onto_torus)
    yield Case("torus 16x12 of triangles, as quads on it", points, faces, round=False)
    yield Case("sphere, icosahedron of triangles", *base)
    yield Case("torus 24x16 of triangles", *torus(24, 16, triangles=True), round=False)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--level", type=int, default=8)
    level = parser.parse_args().level
    print("| control mesh | largest | rms | normals |\n|---|--:|--:|--:|")
    for case in cases():
        largest, rms, angle = case.measure(level)
        print(f"| {case.name} | {largest:.2e} | {rms:.2e} | {angle:.2f}° |")


if __name__ == "__main__":
    main()
