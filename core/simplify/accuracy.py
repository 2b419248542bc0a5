"""How far a coarse mesh and its refinement are from the dense mesh: root mean square and maximum, both ways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.nearest import nearest_points, places_on, spread
from curvify.polygons import next_corners, sum_over_faces
from curvify.simplify.triangles import Triangles

#: Samples on each of the two surfaces, and the level at which patches are measured.
SAMPLES, LEVEL = 20_000, 4


#: A triangle mesh: positions ``(V,3)`` and triangles ``(F,3)``.
Surface = tuple[Floats, Ints]


@dataclass(frozen=True)
class Distances:
    """Distances between two surfaces as shares of the bounding box's diagonal: ``rms`` the root of the mean of both
    directions' mean squares, ``max`` the larger maximum.
    """

    rms: float
    max: float


def two_way_distances(one: Surface, other: Surface, diagonal: float, samples: int = SAMPLES) -> Distances:
    """Distances between two triangle meshes, from samples on both."""
    squares, largest = [], 0.0
    for here, there in ((one, other), (other, one)):
        triangles, weights = spread(*here, samples)
        distance = nearest_points(places_on(here[0], here[1][triangles], weights), *there)[0]
        squares.append(float((distance**2).mean()))
        largest = max(largest, float(distance.max()))
    return Distances(float(np.sqrt(np.mean(squares))) / diagonal, largest / diagonal)


def flat_triangles(mesh: PolygonMesh) -> Surface:
    """The polygons as triangles about the mean of their corners."""
    sizes = mesh.face_sizes
    middle = sum_over_faces(mesh.positions[mesh.face_vertices], mesh.face_offsets) / sizes[:, None]
    center = mesh.vertex_count + mesh.corner_faces
    triangles = np.stack([mesh.face_vertices, mesh.face_vertices[next_corners(mesh.face_offsets)], center], axis=1)
    return np.concatenate([mesh.positions, middle]), triangles


def refined_triangles(mesh: PolygonMesh, level: int = LEVEL) -> Surface:
    """The mesh as `refine` makes it of the polygons, in triangles."""
    from curvify.refinement import refine

    dense = refine(mesh, level=level)
    quads = dense.faces
    return dense.positions, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])


def accuracy(mesh: PolygonMesh, dense: Triangles, samples: int = SAMPLES) -> dict[str, Distances]:
    """Distances of the flat polygons and of their refinement from the dense mesh."""
    original = dense.positions, dense.vertices
    return {
        "flat": two_way_distances(flat_triangles(mesh), original, dense.diagonal, samples),
        "refined": two_way_distances(refined_triangles(mesh), original, dense.diagonal, samples),
    }
