"""Meshes of known surfaces, and what the tests measure on dense meshes. No test lives here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

import curvify
from curvify.mesh import DenseMesh, PolygonMesh
from curvify.schemes.base import Patches

Array = npt.NDArray[np.float64]
Faces = list[list[int]]

GOLDEN = (1 + 5**0.5) / 2
CROSS_TANGENTS = ("precise", "smooth", "linear", "quadratic")


def unit(vectors: npt.ArrayLike) -> Array:
    """Rows scaled to length 1."""
    rows = np.asarray(vectors, dtype=np.float64)
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


# --- meshes on the unit sphere --------------------------------------------------------------------------------


def outward(points: Array, faces: Faces) -> Faces:
    """The faces of a star-shaped body around the origin, each turned to run counter-clockwise from outside."""
    result = []
    for face in faces:
        a, b, c = points[face[0]], points[face[1]], points[face[2]]
        result.append(face if np.dot(np.cross(b - a, c - b), points[face].sum(axis=0)) > 0 else face[::-1])
    return result


def tetrahedron() -> PolygonMesh:
    points = unit([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]])
    return PolygonMesh.from_faces(points, outward(points, [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]))


def octahedron() -> PolygonMesh:
    points = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]], dtype=float)
    faces = [[a, b, c] for a in (0, 3) for b in (1, 4) for c in (2, 5)]
    return PolygonMesh.from_faces(points, outward(points, faces))


def cube() -> PolygonMesh:
    points = unit([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return PolygonMesh.from_faces(points, outward(points, faces))


def icosahedron() -> PolygonMesh:
    points = unit(
        [p for a in (-1, 1) for b in (-GOLDEN, GOLDEN) for p in ([0, a, b], [a, b, 0], [b, 0, a])]
    )
    near = np.linalg.norm(points[:, None] - points, axis=2) < 1.1
    faces = [
        [a, b, c]
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if near[a, b] and near[b, c] and near[a, c]
    ]
    return PolygonMesh.from_faces(points, outward(points, faces))


def around_vertices(mesh: PolygonMesh) -> Faces:
    """Ids of the faces around each vertex of a closed mesh, counter-clockwise."""
    after: dict[tuple[int, int], tuple[int, int]] = {}
    for f, face in enumerate(mesh.faces()):
        for i, vertex in enumerate(face):
            after[(vertex, face[(i + 1) % len(face)])] = (f, face[i - 1])
    result = []
    for vertex in range(mesh.vertex_count):
        start = edge = next(e for e in after if e[0] == vertex)
        loop = []
        while True:
            f, other = after[edge]
            loop.append(f)
            edge = (vertex, other)
            if edge == start:
                break
        result.append(loop)
    return result


def dodecahedron() -> PolygonMesh:
    base = icosahedron()
    points = unit([base.positions[face].sum(axis=0) for face in base.faces()])
    return PolygonMesh.from_faces(points, outward(points, around_vertices(base)))


def truncated_icosahedron() -> PolygonMesh:
    base = icosahedron()
    number: dict[tuple[int, int], int] = {}
    for face in base.faces():
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            number[(a, b)] = len(number)
    points = unit([2 * base.positions[a] + base.positions[b] for a, b in number])
    hexagons = [
        [number[e] for a, b in zip(f, f[1:] + f[:1], strict=True) for e in ((a, b), (b, a))] for f in base.faces()
    ]
    pentagons = []
    for vertex, ring in enumerate(around_vertices(base)):
        nexts = []
        for f in ring:
            face = base.faces()[f]
            nexts.append(face[(face.index(vertex) + 1) % 3])
        pentagons.append([number[(vertex, other)] for other in nexts])
    return PolygonMesh.from_faces(points, outward(points, hexagons + pentagons))


def uv_sphere(around: int = 12, rows: int = 8) -> PolygonMesh:
    """Quads and two fans of triangles at the poles."""
    points = [[0.0, 0.0, 1.0]]
    for i in range(1, rows):
        theta = np.pi * i / rows
        points += [
            [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
            for phi in 2 * np.pi * np.arange(around) / around
        ]
    points.append([0.0, 0.0, -1.0])
    last = len(points) - 1
    faces: Faces = []
    for j in range(around):
        k = (j + 1) % around
        faces.append([0, 1 + j, 1 + k])
        for i in range(rows - 2):
            a, b = 1 + i * around, 1 + (i + 1) * around
            faces.append([a + j, b + j, b + k, a + k])
        faces.append([1 + (rows - 2) * around + j, last, 1 + (rows - 2) * around + k])
    return PolygonMesh.from_faces(points, faces)


# --- grids ----------------------------------------------------------------------------------------------------


def grid_faces(columns: int, rows: int, wrap: tuple[bool, bool], triangles: bool = False) -> Faces:
    """Quads, or triangles, of a grid with ``columns`` x ``rows`` cells, vertices row by row."""
    width = columns if wrap[0] else columns + 1
    height = rows if wrap[1] else rows + 1
    faces: Faces = []
    for j in range(rows):
        for i in range(columns):
            a, b = j * width + i, j * width + (i + 1) % width
            c, d = (j + 1) % height * width + (i + 1) % width, (j + 1) % height * width + i
            faces += [[a, b, c], [a, c, d]] if triangles else [[a, b, c, d]]
    return faces


def torus(
    around: int = 12, tube: int = 8, major: float = 1.0, minor: float = 0.4, triangles: bool = False
) -> PolygonMesh:
    """A torus around the z axis with its exact normals: ``around`` x ``tube`` quads, or twice as many triangles."""
    v, u = (a.ravel() for a in np.meshgrid(np.arange(tube) / tube, np.arange(around) / around, indexing="ij"))
    u, v = 2 * np.pi * u, 2 * np.pi * v
    normals = np.stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), np.sin(v)], axis=1)
    points = major * np.stack([np.cos(u), np.sin(u), 0 * u], axis=1) + minor * normals
    mesh = PolygonMesh.from_faces(points, grid_faces(around, tube, (True, True), triangles))
    return with_vertex_normals(mesh, normals)


def cylinder(sides: int, rows: int = 1, height: float = 1.0, triangles: bool = False) -> PolygonMesh:
    """An open cylinder of radius 1 with its exact normals."""
    z, u = (a.ravel() for a in np.meshgrid(np.arange(rows + 1) / rows, np.arange(sides) / sides, indexing="ij"))
    normals = np.stack([np.cos(2 * np.pi * u), np.sin(2 * np.pi * u), 0 * u], axis=1)
    points = normals + np.stack([0 * z, 0 * z, height * z], axis=1)
    mesh = PolygonMesh.from_faces(points, grid_faces(sides, rows, (True, False), triangles))
    return with_vertex_normals(mesh, normals)


def flat_grid(columns: int, rows: int, triangles: bool = False) -> PolygonMesh:
    """A grid over the unit square, z = 0."""
    y, x = (a.ravel() for a in np.meshgrid(np.arange(rows + 1) / rows, np.arange(columns + 1) / columns, indexing="ij"))
    points = np.stack([x, y, 0 * x], axis=1)
    return PolygonMesh.from_faces(points, grid_faces(columns, rows, (False, False), triangles))


def vase(sides: int = 10, radii: tuple[float, ...] = (0.6, 0.9, 1.0, 0.7, 0.8), step: float = 0.4) -> PolygonMesh:
    """An open tube of changing radius, without normals."""
    rows = len(radii) - 1
    angle = 2 * np.pi * np.arange(sides) / sides
    points = [[r * np.cos(a), r * np.sin(a), i * step] for i, r in enumerate(radii) for a in angle]
    return PolygonMesh.from_faces(points, grid_faces(sides, rows, (True, False)))


def mixed_ball() -> PolygonMesh:
    """A closed ball of triangles, quads, pentagons and hexagons on the unit sphere."""
    base = truncated_icosahedron()
    faces: Faces = []
    for f, face in enumerate(base.faces()):
        if len(face) == 6 and f % 3 == 0:
            faces += [face[:4], [face[0], face[3], face[4], face[5]]]
        elif (len(face) == 6 and f % 3 == 1) or (len(face) == 5 and f % 2 == 0):
            faces += [face[:3], [face[0], *face[2:]]]
        else:
            faces.append(face)
    return PolygonMesh.from_faces(base.positions, faces)


def prism(sides: int, height: float = 1.0, radius: float = 1.0) -> PolygonMesh:
    """A closed prism: ``sides`` quads, then the bottom and the top cap."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    faces = grid_faces(sides, 1, (True, False))
    faces += [list(range(sides))[::-1], list(range(sides, 2 * sides))]
    return PolygonMesh.from_faces(np.concatenate([ring, ring + np.array([0, 0, height])]), faces)


def l_prism() -> PolygonMesh:
    """A solid with two concave hexagons."""
    ring = np.array([[0.0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]])
    points = np.concatenate([np.column_stack([ring, np.full(6, z)]) for z in (0.0, 1.0)])
    faces = [[i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6] for i in range(6)]
    return PolygonMesh.from_faces(points, [*faces, [5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11]])


# --- changes --------------------------------------------------------------------------------------------------


def with_vertex_normals(mesh: PolygonMesh, normals: Array) -> PolygonMesh:
    """The mesh with one given normal per vertex."""
    return mesh.with_(corner_normals=np.ascontiguousarray(np.asarray(normals, dtype=float)[mesh.face_vertices]))


def on_sphere(mesh: PolygonMesh) -> PolygonMesh:
    """The mesh with the exact normals of the unit sphere around the origin."""
    return with_vertex_normals(mesh, unit(mesh.positions))


def noisy(mesh: PolygonMesh, amount: float, seed: int = 1) -> PolygonMesh:
    """The mesh with every vertex moved by a normal deviate of ``amount``, without normals."""
    generator = np.random.default_rng(seed)
    moved = mesh.positions + amount * generator.standard_normal(mesh.positions.shape)
    return mesh.with_(positions=moved, corner_normals=None)


def soup(mesh: PolygonMesh) -> PolygonMesh:
    """Every polygon with vertices of its own; corner data stay."""
    return mesh.with_(
        positions=mesh.positions[mesh.face_vertices],
        face_vertices=np.arange(mesh.corner_count),
        vertex_colors=None if mesh.vertex_colors is None else mesh.vertex_colors[mesh.face_vertices],
    )


def rotation(seed: int = 5) -> Array:
    """A rotation matrix."""
    q, r = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def polygon_patch(sides: int, seed: int, wobble: float = 0.15, tilt: float = 0.3) -> tuple[PolygonMesh, Array, Array]:
    """A single convex, warped polygon with a given normal at each corner: mesh, points and normals ``(n,3)``."""
    generator = np.random.default_rng(1000 * sides + seed)
    angle = 2 * np.pi * (np.arange(sides) + 0.3 * generator.uniform(-0.5, 0.5, sides)) / sides
    points = np.stack([1.3 * np.cos(angle), np.sin(angle), wobble * generator.standard_normal(sides)], axis=1)
    normals = unit(np.array([0, 0, 1.0]) + tilt * points * [1, 1, 0] + 0.1 * generator.standard_normal((sides, 3)))
    turn = rotation(seed + 17)
    points, normals = points @ turn.T, normals @ turn.T
    mesh = PolygonMesh.from_faces(points, [list(range(sides))], corner_normals=normals)
    return mesh, points, normals


# --- domains --------------------------------------------------------------------------------------------------


def domain_polygon(sides: int) -> Array:
    """Corners of the regular polygon with sides of length 1 around (0, 0), first on the positive axis."""
    angle = 2 * np.pi * np.arange(sides) / sides
    return np.stack([np.cos(angle), np.sin(angle)], axis=1) / (2 * np.sin(np.pi / sides))


def inside_points(sides: int, count: int, seed: int = 3, shrink: float = 1.0) -> Array:
    """Random points inside the domain of a patch."""
    weights = np.random.default_rng(seed).dirichlet(np.ones(sides) * 0.6, count)
    return shrink * weights @ domain_polygon(sides)


def side_points(sides: int, side: int, t: npt.ArrayLike) -> Array:
    """Points of one side of the domain."""
    corners = domain_polygon(sides)
    fraction = np.asarray(t, dtype=float)[:, None]
    return (1 - fraction) * corners[side] + fraction * corners[(side + 1) % sides]


# --- patches ---------------------------------------------------------------------------------------------------


def half_edge_polynomials(patches: Patches, corners: npt.ArrayLike) -> tuple[Array, Array]:
    """Bezier points ``(m,4,3)`` of the curve and of the normal field of half-edges, in their own direction."""
    ids = np.asarray(corners, dtype=np.int64)
    curves = np.moveaxis(patches.edges.curves, 0, -1)[patches.topology.edge[ids]]
    fields = np.moveaxis(patches.edges.fields, 0, -1)[patches.side_field[ids]]
    backward = ~patches.topology.forward[ids]
    for points in (curves, fields):
        points[backward] = points[backward][:, ::-1]
    return curves, fields


def bezier(points: Array, t: npt.ArrayLike) -> Array:
    """Cubic Bezier polynomials ``(...,4,3)`` at ``t (m,)``: ``(...,m,3)``."""
    s = np.asarray(t, dtype=float)
    return np.stack([(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3], axis=-1) @ points


# --- dense meshes ------------------------------------------------------------------------------------


def refined(mesh: PolygonMesh, level: int = 2, dtype: object = np.float64, **options: object) -> DenseMesh:
    """The dense mesh of the default scheme."""
    return curvify.surface(mesh, **options).refine(level, dtype)


def directed_edges(faces: npt.NDArray[np.integer]) -> Counter[tuple[int, int]]:
    """How often each directed edge occurs in faces ``(Q,s)``."""
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    pairs, counts = np.unique(ends, axis=0, return_counts=True)
    return Counter({(int(a), int(b)): int(c) for (a, b), c in zip(pairs, counts, strict=True)})


def open_edges(faces: npt.NDArray[np.integer]) -> set[tuple[int, int]]:
    """Directed edges whose opposite is missing; fails where a directed edge occurs twice."""
    edges = directed_edges(faces)
    assert max(edges.values()) == 1, "a directed edge is used twice"
    return {e for e in edges if e[::-1] not in edges}


def check_sound(dense: DenseMesh, closed: bool | None = None) -> None:
    """Finite, unit normals, indices in range, and closed by index where that is asked for."""
    assert np.isfinite(dense.positions).all()
    assert np.isfinite(dense.normals).all()
    used = np.zeros(len(dense.normals), dtype=bool)
    used[dense.face_wedges] = True
    lengths = np.linalg.norm(dense.normals.astype(np.float64), axis=1)
    assert np.abs(lengths[used] - 1).max() < (1e-6 if dense.normals.dtype == np.float32 else 1e-14)
    assert np.array_equal(dense.wedge_vertices[dense.face_wedges], dense.faces)
    if closed is not None:
        assert (not open_edges(dense.faces)) == closed


def diagonal(points: Array) -> float:
    """Diagonal of the bounding box."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def match(points: Array, others: Array, far: float) -> npt.NDArray[np.int64]:
    """For each point the index of the other point at its place; fails unless all lie within ``far``, one to one."""
    assert len(points) == len(others)
    found = np.empty(len(points), dtype=np.int64)
    for begin in range(0, len(points), 512):
        gaps = ((points[begin : begin + 512, None] - others) ** 2).sum(axis=2)
        found[begin : begin + 512] = gaps.argmin(axis=1)
    assert np.linalg.norm(points - others[found], axis=1).max() <= far
    assert len(np.unique(found)) == len(found)
    return found


def degrees(a: Array, b: Array) -> Array:
    """Angle between unit vectors in degrees, accurate when small."""
    return np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=-1) / 2, 0, 1)))


def grid_errors(dense: DenseMesh, level: int, error: Callable[[Array], Array]) -> Array:
    """Error at every grid point of every kite: points that kites share count once for each."""
    blocks = dense.faces.reshape(-1, level * level * 4)
    kites = np.repeat(np.arange(len(blocks)), blocks.shape[1])
    pairs = np.unique(np.stack([kites, blocks.ravel()], axis=1), axis=0)
    return error(dense.positions[pairs[:, 1]])


def geodesic(times: int) -> PolygonMesh:
    """An icosahedron whose triangles were cut in 4 some times, every time back on the unit sphere."""
    mesh = icosahedron()
    for _ in range(times):
        flat = curvify.refine(mesh, "phong", 1, alpha=0.0)
        mesh = PolygonMesh.from_faces(unit(flat.positions), flat.faces.tolist())
    return mesh


def dihedral_angles(dense: DenseMesh) -> Array:
    """Angles in degrees between the triangles at every edge of a closed dense mesh."""
    corners = dense.positions[dense.faces]
    facing = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    ends = np.sort(np.stack([dense.faces, np.roll(dense.faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    pairs = np.lexsort(ends.T).reshape(-1, 2) // 3
    return degrees(facing[pairs[:, 0]], facing[pairs[:, 1]])
