"""Dense meshes of known shape and topology to simplify. No test lives here."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.mesh import PolygonMesh

Field = Callable[[np.ndarray, np.ndarray], np.ndarray]


def grid(rows: int, columns: int, wrap_rows: bool = False, wrap_columns: bool = False) -> np.ndarray:
    """Triangles ``(n,3)`` on a grid of vertices, in row order, closed in one or both directions."""
    i, j = np.mgrid[: rows - (not wrap_rows), : columns - (not wrap_columns)]
    a, b = (i * columns + j).ravel(), ((i + 1) % rows * columns + j).ravel()
    c, d = ((i + 1) % rows * columns + (j + 1) % columns).ravel(), (i * columns + (j + 1) % columns).ravel()
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def mesh_of(points: np.ndarray, triangles: np.ndarray) -> PolygonMesh:
    """Triangles as a mesh."""
    return PolygonMesh(np.asarray(points, dtype=float), 3 * np.arange(len(triangles) + 1), triangles.reshape(-1))


def torus(rows: int = 48, columns: int = 24, small: float = 0.4) -> PolygonMesh:
    """A closed mesh of genus 1."""
    u, v = np.meshgrid(2 * np.pi * np.arange(rows) / rows, 2 * np.pi * np.arange(columns) / columns, indexing="ij")
    ring = 1 + small * np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), small * np.sin(v)], axis=-1).reshape(-1, 3)
    return mesh_of(points, grid(rows, columns, True, True))


def sphere(steps: int = 24) -> PolygonMesh:
    """A closed mesh of genus 0: a cube of grids, blown up."""
    cube = boxes(np.ones((1, 1, 1), dtype=bool), steps)
    points = cube.positions - cube.positions.mean(axis=0)
    return cube.with_(positions=points / np.linalg.norm(points, axis=1, keepdims=True))


def sheet(steps: int = 30, height: Field = lambda x, y: 0.3 * np.sin(3 * x) * np.cos(2 * y)) -> PolygonMesh:
    """An open height field over the unit square."""
    x, y = np.meshgrid(np.linspace(0, 1, steps), np.linspace(0, 1, steps), indexing="ij")
    points = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    return mesh_of(points, grid(steps, steps))


def boxes(solid: np.ndarray, steps: int = 1) -> PolygonMesh:
    """The surface of the cells that are ``solid (x,y,z)``, each of its squares cut into 2 ``steps``^2 triangles."""
    fine = np.kron(solid, np.ones((steps, steps, steps), dtype=bool))
    padded = np.pad(fine, 1)
    corners, triangles = [], []
    for axis in range(3):
        for side in (0, 1):
            beside = np.roll(padded, 1 - 2 * side, axis=axis)[1:-1, 1:-1, 1:-1]
            cells = np.argwhere(fine & ~beside)
            u, v = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
            low = cells + side * np.eye(3, dtype=int)[axis]
            square = np.stack([low, low + u, low + u + v, low + v], axis=1)
            square = square if side else square[:, ::-1]
            start = 4 * sum(map(len, corners))
            quads = start + 4 * np.arange(len(square))[:, None]
            triangles += [quads + np.array([0, 1, 2]), quads + np.array([0, 2, 3])]
            corners.append(square)
    points = np.concatenate(corners).reshape(-1, 3)
    keys = points @ np.array([1, 4099, 4099**2])
    _, first, which = np.unique(keys, return_index=True, return_inverse=True)
    return mesh_of(points[first] / steps, which[np.concatenate(triangles)])


def plate(holes: int, steps: int = 3) -> PolygonMesh:
    """A slab of boxes of genus ``holes``."""
    solid = np.ones((3, 2 * holes + 1, 1), dtype=bool)
    solid[1, 1::2] = False
    return boxes(solid, steps)


def holed_sheet(holes: int = 2, steps: int = 31) -> PolygonMesh:
    """An open height field with ``holes`` squared square holes."""
    mesh = sheet(steps)
    triangles = mesh.face_vertices.reshape(-1, 3)
    x, y = (mesh.positions[triangles].mean(axis=1)[:, i] * holes % 1 for i in (0, 1))
    return mesh_of(mesh.positions, triangles[(np.abs(x - 0.5) > 0.2) | (np.abs(y - 0.5) > 0.2)])


def prism(sides: int = 16, rings: int = 7, height: float = 3.0) -> PolygonMesh:
    """A closed prism over a regular polygon: the cylinder of a part, as a coarse tessellation has it."""
    angle = 2 * np.pi * np.arange(sides) / sides
    loops = [np.stack([np.cos(angle), np.sin(angle), 0 * angle + z], axis=1) for z in np.linspace(0, height, rings)]
    i, j, last = np.arange(sides), (np.arange(sides) + 1) % sides, sides * (rings - 1)
    caps = [np.stack([j, i, 0 * i + sides * rings], axis=1), np.stack([i, j, 0 * i + 1], axis=1)]
    caps[1] = caps[1] + np.array([last, last, sides * rings])
    walls = grid(rings, sides, wrap_columns=True)[:, ::-1]
    return mesh_of(np.concatenate([*loops, [[0, 0, 0], [0, 0, height]]]), np.concatenate([walls, *caps]))


def needles() -> PolygonMesh:
    """A cylinder of very thin triangles, closed by fans with slivers."""
    count = 60
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    top = np.array([0, 0, 20.0])
    points = np.concatenate([ring, ring + top, [[0.97, 0, 0], [0.97, 0, 20.0]]])
    i, j = np.arange(count), (np.arange(count) + 1) % count
    walls = [np.stack([i, j, j + count], axis=1), np.stack([i, j + count, i + count], axis=1)]
    low, high = np.full(count, 2 * count), np.full(count, 2 * count + 1)
    caps = [np.stack([j, i, low], axis=1), np.stack([i + count, j + count, high], axis=1)]
    return mesh_of(points, np.concatenate(walls + caps))


def pinched() -> PolygonMesh:
    """Two cubes of grids that touch in one edge and one corner only, and a fin with three faces on an edge."""
    solid = np.zeros((3, 2, 2), dtype=bool)
    solid[0, 0, 0] = solid[1, 1, 0] = solid[2, 0, 1] = True
    mesh = boxes(solid, 3)
    fin = np.array([[*mesh.face_vertices[:2], mesh.vertex_count]])
    points = np.concatenate([mesh.positions, mesh.positions[mesh.face_vertices[:1]] + [-0.5, -0.5, -0.5]])
    return mesh_of(points, np.concatenate([mesh.face_vertices.reshape(-1, 3), fin]))
