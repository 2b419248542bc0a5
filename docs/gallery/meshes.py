"""Meshes that the gallery makes itself, and what it does to the samples."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

import curvify
from curvify.convex import split_polygons
from curvify.formats.dense import to_polygon_mesh
from curvify.formats.marks_json import read_marks
from curvify.normals import sum_by, unit
from curvify.polygons import newell_normals
from curvify.simplify import Options, Simplified
from curvify.simplify.attempts import SHARP_TOLERANCE, SMOOTH_TOLERANCE
from curvify.simplify.borders import Tolerance, chords_of, find_anchors, region_borders
from curvify.simplify.decompose import Partition, polygonize
from curvify.simplify.features import sharp_half_edges
from curvify.simplify.vsa import Metric

SAMPLES = Path(__file__).resolve().parents[2] / "sample_meshes"
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def sample(name: str) -> curvify.PolygonMesh:
    """A sample mesh."""
    return curvify.read(SAMPLES / f"{name}.obj")


def marks_of(name: str) -> curvify.Marks:
    """The marks of a marks file beside the samples."""
    return read_marks(SAMPLES / f"{name}.json")


def creases(pairs: object) -> curvify.Marks:
    """Sharp edges between pairs of vertices."""
    edges = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return curvify.Marks(crease_edges=edges, crease_sharpness=np.ones((len(edges), 2)))


def curled(pairs: object, kappa: float) -> curvify.Marks:
    """Edges along which png1 lifts its faces by a length."""
    edges = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return curvify.Marks(curled_edges=edges, kappas=np.full(len(edges), kappa))


def curves_of(dense: curvify.DenseMesh) -> Floats:
    """The lines ``(n,2,3)`` of a dense mesh where its patches meet: the curves over the edges of the coarse mesh."""
    tails, heads = dense.faces.reshape(-1), np.roll(dense.faces, -1, axis=1).reshape(-1)
    faces = np.repeat(dense.source_faces, dense.faces.shape[1])
    low, high = np.minimum(tails, heads), np.maximum(tails, heads)
    order = np.lexsort((faces, high, low))
    low, high, faces = low[order], high[order], faces[order]
    same = (low[1:] == low[:-1]) & (high[1:] == high[:-1]) & (faces[1:] == faces[:-1])
    inner = np.zeros(len(low), dtype=bool)
    inner[1:] |= same
    inner[:-1] |= same
    return dense.positions[np.stack([low[~inner], high[~inner]], axis=1)]


def by_patches(dense: curvify.DenseMesh) -> curvify.PolygonMesh:
    """A dense mesh with the normals of its faces, averaged inside of each patch only: kinks between patches show."""
    mesh = to_polygon_mesh(dense)
    area = newell_normals(mesh.positions, mesh.face_offsets, mesh.face_vertices)
    corner_patches = np.repeat(dense.source_patches, dense.faces.shape[1])
    _, label = np.unique(np.stack([mesh.face_vertices, corner_patches]), axis=1, return_inverse=True)
    total = sum_by(label.reshape(-1), area[mesh.corner_faces], int(label.max()) + 1)
    return mesh.with_(corner_normals=unit(total)[label.reshape(-1)])


def with_normals(mesh: curvify.PolygonMesh, normals: Floats) -> curvify.PolygonMesh:
    """The mesh with normals ``(V,3)`` at its vertices."""
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return mesh.with_(corner_normals=unit[mesh.face_vertices])


def cube() -> curvify.PolygonMesh:
    """A cube: vertex ``4 i + 2 j + k`` has the coordinates ``k, j, i``, -1 for 0; face 1 is the top."""
    points = [[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return curvify.PolygonMesh.from_faces(points, faces)


def cone(sides: int = 6) -> curvify.PolygonMesh:
    """A cone of triangles that is open below, with the normals of symmetry."""
    angles = 2 * np.pi * np.arange(sides) / sides
    around = np.stack([np.cos(angles), np.sin(angles), np.zeros(sides)], axis=1)
    faces = [[0, 1 + k, 1 + (k + 1) % sides] for k in range(sides)]
    mesh = curvify.PolygonMesh.from_faces([[0, 0, 0.9], *around.tolist()], faces)
    return with_normals(mesh, np.concatenate([[[0, 0, 1]], 0.9 * around + [0, 0, 0.6]]))


def tetrahedron() -> curvify.PolygonMesh:
    """A regular tetrahedron that stands on a face, its normals away from its middle."""
    angles = 2 * np.pi * np.arange(3) / 3 - np.pi / 6
    radius = np.sqrt(8) / 3
    base = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.full(3, -1 / 3)], axis=1)
    points = np.concatenate([base, [[0, 0, 1]]])
    return with_normals(curvify.PolygonMesh.from_faces(points, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]), points)


def triangulated(mesh: curvify.PolygonMesh) -> curvify.PolygonMesh:
    """Every polygon as a fan of triangles from its first corner, without normals."""
    faces = [[face[0], a, b] for face in mesh.faces() for a, b in pairwise(face[1:])]
    return curvify.PolygonMesh.from_faces(mesh.positions, faces)


def regions(found: Simplified) -> tuple[curvify.PolygonMesh, Floats, Floats]:
    """The triangles that were simplified, apart from each other, a value for each vertex that tells the region, and
    the lines ``(n,2,3)`` between regions.
    """
    dense, labels = found.dense, found.labels
    count = len(dense.vertices)
    apart = curvify.PolygonMesh.from_faces(
        dense.positions[dense.vertices.reshape(-1)], np.arange(3 * count).reshape(-1, 3).tolist()
    )
    shade = np.random.default_rng(8).permutation(int(labels.max()) + 1)[labels]
    twin, own = dense.twin, np.repeat(labels, 3)
    border = np.flatnonzero((twin >= 0) & (own < own[twin]))
    ends = np.stack([border, border - border % 3 + (border + 1) % 3], axis=1)
    return apart, np.repeat(shade.astype(float), 3), dense.positions[dense.vertices.reshape(-1)[ends]]


def outlines(found: Simplified, options: Options) -> tuple[curvify.PolygonMesh, Ints, curvify.PolygonMesh, Ints]:
    """One polygon for each region, before concave ones are split, with the edges of those ``(n,2)``; the convex pieces,
    with the diagonals ``(n,2)`` that made them.
    """
    dense = found.dense
    sharp = sharp_half_edges(dense, options.sharp_angle)
    size = np.sqrt(dense.areas.sum() / found.mesh.face_count)
    tolerance = Tolerance(SHARP_TOLERANCE * size, SMOOTH_TOLERANCE * size)
    partition = Partition(dense, Metric.of(dense), sharp, tolerance, options.split_rule, found.labels)
    polygonize(partition)
    borders = region_borders(dense, partition.labels, partition.normals, sharp)
    chords = chords_of(borders, find_anchors(dense, borders, partition.forced, tolerance))
    offsets = np.searchsorted(chords.regions, np.arange(partition.count + 1))
    split = split_polygons(dense.positions, offsets, chords.ends[:, 0], rule=options.split_rule)
    cut = np.bincount(split.source_faces, minlength=partition.count) > 1
    heads = np.concatenate([np.roll(part, -1) for part in np.split(split.face_vertices, split.face_offsets[1:-1])])
    diagonals = np.stack([split.face_vertices, heads], axis=1)[split.diagonals >= 0]
    whole = curvify.PolygonMesh(dense.positions, offsets, chords.ends[:, 0])
    pieces = curvify.PolygonMesh(dense.positions, split.face_offsets, split.face_vertices)
    return whole, chords.ends[cut[chords.regions]], pieces, diagonals


# --- Loop's subdivision surface of a closed mesh of triangles --------------------------------------------------------


def rings(mesh: curvify.PolygonMesh) -> list[list[int]]:
    """The neighbors of each vertex, in order around it."""
    following: dict[int, dict[int, int]] = {}
    for a, b, c in mesh.faces():
        for first, second, third in ((a, b, c), (b, c, a), (c, a, b)):
            following.setdefault(first, {})[second] = third
    result = []
    for vertex in range(mesh.vertex_count):
        ring = [next(iter(following[vertex]))]
        while (other := following[vertex][ring[-1]]) != ring[0]:
            ring.append(other)
        result.append(ring)
    return result


def beta(valence: int) -> float:
    """Loop's weight of each neighbor of a vertex."""
    return (5 / 8 - (3 / 8 + np.cos(2 * np.pi / valence) / 4) ** 2) / valence


def subdivided(mesh: curvify.PolygonMesh) -> curvify.PolygonMesh:
    """One step of Loop's subdivision."""
    around = rings(mesh)
    places = mesh.positions
    moved = np.array([
        (1 - len(ring) * beta(len(ring))) * places[vertex] + beta(len(ring)) * places[ring].sum(axis=0)
        for vertex, ring in enumerate(around)
    ])
    middles: dict[tuple[int, int], int] = {}
    points = []
    for a, ring in enumerate(around):
        for k, b in enumerate(ring):
            if a < b:
                middles[a, b] = len(places) + len(points)
                beside = places[ring[k - 1]] + places[ring[(k + 1) % len(ring)]]
                points.append(3 / 8 * (places[a] + places[b]) + beside / 8)
    faces = []
    for a, b, c in mesh.faces():
        ab, bc, ca = (middles[min(pair), max(pair)] for pair in ((a, b), (b, c), (c, a)))
        faces += [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return curvify.PolygonMesh.from_faces(np.concatenate([moved, points]), faces)


def at_limit(mesh: curvify.PolygonMesh) -> curvify.PolygonMesh:
    """The mesh with its vertices, and normals there, on the limit of Loop's subdivision."""
    points, normals = [], []
    for vertex, ring in enumerate(rings(mesh)):
        count, around = len(ring), mesh.positions[ring]
        own = 3 / (8 * beta(count))
        points.append((own * mesh.positions[vertex] + around.sum(axis=0)) / (own + count))
        turns = 2 * np.pi * np.arange(count) / count
        normals.append(np.cross(np.cos(turns) @ around, np.sin(turns) @ around))
    return with_normals(mesh.with_(positions=np.array(points)), np.array(normals))


def loop_surface(mesh: curvify.PolygonMesh, steps: int = 4) -> curvify.PolygonMesh:
    """The limit surface, at the vertices of so many steps of subdivision."""
    for _ in range(steps):
        mesh = subdivided(mesh)
    return at_limit(mesh)
