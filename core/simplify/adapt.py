"""More polygons where a fitted mesh is farthest from the dense one.

The longest edge of a polygon that errs too much is cut in its middle, at the point and with the normals that the
refined surface has there, so that the surface hardly changes; then both polygons on it are cut from the new vertex.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from curvify.mesh import Bools, Floats, Ints, Marks, PolygonMesh
from curvify.nearest import Nearest, places_on, spread
from curvify.records import replaced
from curvify.refinement import refine
from curvify.schemes.gregory import Options, prepare
from curvify.simplify.folds import split_folded_corners
from curvify.simplify.triangles import Triangles
from curvify.topology import Topology, build_topology

#: The level at which errors are measured, and the samples of the dense mesh.
LEVEL, SAMPLES = 4, 40_000


def face_errors(mesh: PolygonMesh, dense: Triangles, options: Options) -> Floats:
    """The largest distance ``(F,)`` between the refinement of each face and the dense mesh, both ways."""
    refined = refine(mesh, level=LEVEL, **vars(options))
    assert refined.source_faces is not None
    quads, owners = refined.faces, refined.source_faces
    largest = np.zeros(mesh.face_count)
    away = Nearest.of(dense.positions, dense.vertices)(refined.positions)[0]
    np.maximum.at(largest, owners, away[quads].max(axis=1))
    faces, weights = spread(dense.positions, dense.vertices, SAMPLES)
    places = places_on(dense.positions, dense.vertices[faces], weights)
    triangles = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    away, hit, _ = Nearest.of(refined.positions, triangles)(places)
    np.maximum.at(largest, np.concatenate([owners, owners])[hit], away)
    return largest


def add_where_worst(mesh: PolygonMesh, errors: Floats, limit: float, room: int, options: Options) -> PolygonMesh:
    """The mesh with faces that err by more than ``limit`` cut, the worst first, by at most ``room`` more faces."""
    topology = build_topology(mesh.positions, mesh.face_offsets, mesh.face_vertices)
    half_edges = _longest(mesh, topology)
    worst = np.argsort(-errors, kind="stable")
    worst = worst[(errors[worst] > limit) & ~_flat(mesh)[worst]]
    chosen = half_edges[worst][_alone(topology, half_edges[worst])]
    added = np.cumsum(np.where(topology.twin[chosen] < 0, 1, 2))
    chosen = chosen[added <= room]
    if not len(chosen):
        return mesh
    return split_folded_corners(halved(mesh, topology, chosen, options)).mesh


def _flat(mesh: PolygonMesh) -> Bools:
    """Faces ``(F,)`` that are marked as flat: cutting those changes nothing."""
    return np.isin(np.arange(mesh.face_count), mesh.marks.flat_faces)


def _longest(mesh: PolygonMesh, topology: Topology) -> Ints:
    """The half-edge ``(F,)`` of the longest side of each face."""
    points = mesh.positions[topology.vertices]
    length = np.linalg.norm(points[topology.next] - points, axis=1)
    order = np.lexsort((-length, topology.faces))
    return order[topology.offsets[:-1]]


def _alone(topology: Topology, half_edges: Ints) -> Bools:
    """Which of the half-edges, best first, share no face with a better one."""
    faces, twin = topology.faces, topology.twin[half_edges]
    sides = np.stack([faces[half_edges], np.where(twin < 0, faces[half_edges], faces[twin])], axis=1)
    best = np.full(len(topology.offsets) - 1, len(half_edges))
    rank = np.arange(len(half_edges))
    for side in sides.T:
        np.minimum.at(best, side, rank)
    return (best[sides] == rank[:, None]).all(axis=1)


def halved(mesh: PolygonMesh, topology: Topology, half_edges: Ints, options: Options) -> PolygonMesh:
    """The mesh with a vertex in the middle of the edges of some half-edges ``(n,)``, one of each edge."""
    assert mesh.corner_normals is not None
    patches = prepare(mesh, replace(options, weld="never"))
    edge, middle = topology.edge[half_edges], np.array([0.5])
    number = np.full(len(topology.edges), -1)
    number[edge] = mesh.vertex_count + np.arange(len(edge))
    corners = np.flatnonzero(number[topology.edge] >= 0)
    fields = np.empty(len(topology.edge), dtype=np.int64)
    outer = patches.topology.edge < len(topology.edges)  # the others are diagonals
    fields[patches.source_corners[outer]] = patches.side_field[outer]
    normals = patches.edges.normals(fields[corners], middle)[..., 0].T
    sizes = topology.sizes + np.bincount(topology.faces[corners], minlength=mesh.face_count)
    ends = np.column_stack([topology.edges[edge], number[edge]])
    return mesh.with_(
        positions=np.concatenate([mesh.positions, patches.edges.points(edge, middle)[..., 0].T]),
        face_offsets=np.concatenate([[0], np.cumsum(sizes)]),
        face_vertices=np.insert(mesh.face_vertices, corners + 1, number[topology.edge[corners]]),
        corner_normals=np.insert(mesh.corner_normals, corners + 1, normals, axis=0),
        marks=_halved_marks(mesh.marks, ends),
    )


def _halved_marks(marks: Marks, ends: Ints) -> Marks:
    """The marks where the edges ``ends[:,:2]`` have got the vertices ``ends[:,2]`` in their middles."""
    straight, _ = _halved_pairs(marks.straight_edges, np.zeros((len(marks.straight_edges), 2)), ends)
    creases, sharpness = _halved_pairs(marks.crease_edges, marks.crease_sharpness, ends)
    return replaced(marks, straight_edges=straight, crease_edges=creases, crease_sharpness=sharpness)


def _halved_pairs(pairs: Ints, values: Floats, ends: Ints) -> tuple[Ints, Floats]:
    """Vertex pairs ``(m,2)`` with values ``(m,2)`` at their ends, those in ``ends`` each as two."""
    order = np.lexsort(np.sort(ends[:, :2], axis=1).T)
    low, high = np.sort(ends[order, :2], axis=1).T
    count = max(int(ends.max(initial=0)), int(pairs.max(initial=0))) + 1
    keys = high * count + low
    wanted = pairs.max(axis=1, initial=0) * count + pairs.min(axis=1, initial=count)
    place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    hit = keys[place] == wanted
    middle, mean = ends[order[place[hit]], 2], values[hit].mean(axis=1)
    first = np.column_stack([pairs[hit, 0], middle]), np.column_stack([values[hit, 0], mean])
    second = np.column_stack([middle, pairs[hit, 1]]), np.column_stack([mean, values[hit, 1]])
    return np.concatenate([pairs[~hit], first[0], second[0]]), np.concatenate([values[~hit], first[1], second[1]])
