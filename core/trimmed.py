"""The polygons of a trimmed mesh, and the new points on their rim (see trim)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from curvify import evaluate
from curvify.arrays import cross, distinct, values_of
from curvify.kites import CellGrid, bilinear, domain_points, kite_corners
from curvify.mesh import DenseMesh, Floats, Ints, PolygonMesh
from curvify.records import field, record
from curvify.schemes.base import Patches
from curvify.weld import corner_colors

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Crossings lie on their segment in steps of one over this.
GRID = 1 << 24


@record
class NewPoints:
    """Crossings: ``positions (x,3)``, ``colors (x,c)``; and their wedges: ``normals (w,3)``, ``uvs (w,2)``."""

    positions: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    normals: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    colors: Floats | None = None
    uvs: Floats | None = None


@record
class CutCells:
    """Polygons: ``sizes (p,)``, the cell of the dense mesh that each is part of ``(p,)``; at their corners a vertex and
    a wedge ``(c,)``. Numbers beyond those of the dense mesh are those of the new ``points``.
    """

    sizes: Ints
    cells: Ints
    vertices: Ints
    wedges: Ints
    points: NewPoints = field(default_factory=NewPoints)


@record
class Items:
    """Crossings on sides of cells, each ``(x,)``: the ``rows`` of the cells, the ``cells``, which of their ``sides``,
    the ``places`` along it in steps of 1 / GRID, and the number of the crossing.
    """

    rows: Ints
    cells: Ints
    sides: Ints
    places: Ints
    crossings: Ints


def whole_cells(dense: DenseMesh, cells: Ints) -> CutCells:
    """Cells as they are."""
    faces, wedges = dense.faces[cells].reshape(-1), dense.face_wedges[cells].reshape(-1)
    return CutCells(np.full(len(cells), 4), cells, faces, wedges)


def join(whole: CutCells, cut: CutCells) -> CutCells:
    """Whole cells and cut ones in the order of the cells."""
    cells, sizes = np.concatenate([whole.cells, cut.cells]), np.concatenate([whole.sizes, cut.sizes])
    order = np.argsort(cells, kind="stable")
    begins = (np.cumsum(sizes) - sizes)[order]
    sizes = sizes[order]
    corners = np.repeat(begins - (np.cumsum(sizes) - sizes), sizes) + np.arange(int(sizes.sum()))
    vertices = np.concatenate([whole.vertices, cut.vertices])[corners]
    return CutCells(sizes, cells[order], vertices, np.concatenate([whole.wedges, cut.wedges])[corners], cut.points)


def new_points(patches: Patches, grid: CellGrid, items: Items, count: int) -> tuple[NewPoints, Ints]:
    """The ``count`` crossings, and the wedge of each item.

    A crossing on an edge has a wedge for each half-edge, any other one for its patch.
    """
    topology = patches.topology
    kites, places, half_edges, t = _locate(patches, grid, items)
    owner = np.where(half_edges >= 0, half_edges, len(topology.vertices) + topology.faces[kites])
    keys, wedges = distinct(items.crossings * (len(topology.vertices) + len(topology.sizes)) + owner)
    lead = np.empty(len(keys), dtype=np.int64)
    lead[wedges[::-1]] = np.arange(len(wedges))[::-1]
    kites, places, half_edges, t = kites[lead], places[lead], half_edges[lead], t[lead]
    edge, inner = np.flatnonzero(half_edges >= 0), np.flatnonzero(half_edges < 0)
    positions, normals = np.empty((len(lead), 3)), np.empty((len(lead), 3))
    h, at = half_edges[edge], t[edge, None]
    positions[edge] = patches.edges.points(topology.edge[h], at)[..., 0].T
    normals[edge] = patches.edges.normals(patches.side_field[h], at)[..., 0].T
    inside = domain_points(topology, kites[inner], places[inner])
    positions[inner], normals[inner] = evaluate.surface_at(patches, topology.faces[kites[inner]], inside)

    def carried(values: Floats) -> Floats:
        """Corner values ``(C,c)`` at the wedges; on edges in canonical direction, the same for both faces."""
        maps = kite_corners(values, topology.offsets, topology.next, topology.prev)
        result = bilinear(maps[kites], places[:, 0], places[:, 1])
        forward = topology.forward[h][:, None]
        here, there = values[h], values[topology.next[h]]
        result[edge] = (1 - at) * np.where(forward, here, there) + at * np.where(forward, there, here)
        return result

    first = np.zeros(count, dtype=np.int64)
    first[items.crossings[lead[::-1]]] = np.arange(len(lead))[::-1]
    uvs, colors = patches.mesh.corner_uvs, corner_colors(patches)
    return NewPoints(
        positions[first],
        normals,
        None if colors is None else carried(colors)[first],
        None if uvs is None else carried(np.nan_to_num(uvs[patches.source_corners])),
    ), wedges


def _locate(patches: Patches, grid: CellGrid, items: Items) -> tuple[Ints, Floats, Ints, Floats]:
    """Where the items lie: kites ``(x,)`` and coordinates there ``(x,2)``; the half-edge, -1 inside a patch, and the
    place on its edge in canonical direction ``(x,)``.
    """
    topology = patches.topology
    kites, corners = grid.corners(items.cells)
    rows = np.arange(len(items.cells))
    start, end = corners[rows, items.sides], corners[rows, (items.sides + 1) % 4]
    places = (start + (items.places / GRID)[:, None] * (end - start)) / grid.level
    leaving, arriving = (items.sides == 0) & (places[:, 1] == 0), (items.sides == 3) & (places[:, 0] == 0)
    half_edges = np.where(arriving, topology.prev[kites], kites)
    t = np.where(arriving, 1 - places[:, 1] / 2, places[:, 0] / 2)
    t = np.where(topology.forward[half_edges], t, 1 - t)
    return kites, places, np.where(leaving | arriving, half_edges, -1), t


def trimmed_mesh(pieces: CutCells, patches: Patches, dense: DenseMesh) -> PolygonMesh:
    """The polygons with what the dense mesh carries. Vertices that are in none of them are left out, but for those of
    the input.
    """
    kind, points, mesh = dense.positions.dtype, pieces.points, patches.mesh
    used = np.zeros(dense.vertex_count + len(points.positions), dtype=bool)
    used[: len(patches.positions)] = True
    used[pieces.vertices] = True
    faces = None if dense.source_faces is None else dense.source_faces[pieces.cells]

    def of_faces(values: Ints | None) -> Ints | None:
        return None if values is None or faces is None else values[faces]

    def with_new(old: NDArray[np.generic], new: Floats | None) -> NDArray[np.generic]:
        """Rows of the dense mesh and new ones, in the type of the former."""
        added = np.zeros((0, old.shape[1])) if new is None else new
        return np.concatenate([old, (np.rint(added) if old.dtype.kind in "iu" else added).astype(old.dtype)])

    return PolygonMesh(
        positions=with_new(dense.positions, points.positions)[used].astype(np.float64),
        face_offsets=np.concatenate([[0], np.cumsum(pieces.sizes)]),
        face_vertices=(np.cumsum(used) - 1)[pieces.vertices],
        corner_normals=with_new(dense.normals, points.normals)[pieces.wedges].astype(np.float64),
        corner_uvs=None if dense.uvs is None else with_new(dense.uvs, points.uvs)[pieces.wedges].astype(np.float64),
        vertex_colors=None if dense.colors is None else with_new(dense.colors, points.colors)[used],
        face_materials=of_faces(mesh.face_materials),
        material_names=mesh.material_names,
        material_files=mesh.material_files,
        face_groups=of_faces(mesh.face_groups),
        group_names=mesh.group_names,
        looks=mesh.looks,
        position_dtype=kind,
    )


def fan_triangles(mesh: PolygonMesh) -> PolygonMesh:
    """The mesh with its convex polygons cut into triangles, from the corner for which the smallest is largest."""
    sizes = mesh.face_sizes
    corners, faces = [], []
    for size in values_of(sizes):
        rows = np.flatnonzero(sizes == size)
        ids = mesh.face_offsets[rows][:, None] + np.arange(size)
        points = mesh.positions[mesh.face_vertices[ids]]
        least = np.stack([_smallest_of_fan(np.roll(points, -apex, axis=1)) for apex in range(size)], axis=1)
        turned = np.take_along_axis(ids, (least.argmax(axis=1)[:, None] + np.arange(size)) % size, axis=1)
        fan = np.stack([turned[:, [0, i, i + 1]] for i in range(1, size - 1)], axis=1)
        corners.append(fan.reshape(-1, 3))
        faces.append(np.repeat(rows, size - 2))
    face = np.concatenate(faces)
    order = np.argsort(face, kind="stable")
    corner = np.concatenate(corners)[order].reshape(-1)

    def carried(values: NDArray[np.generic] | None, rows: Ints) -> Any:
        return None if values is None else values[rows]

    return mesh.with_(
        face_offsets=3 * np.arange(len(face) + 1),
        face_vertices=mesh.face_vertices[corner],
        corner_normals=carried(mesh.corner_normals, corner),
        corner_uvs=carried(mesh.corner_uvs, corner),
        face_materials=carried(mesh.face_materials, face[order]),
        face_groups=carried(mesh.face_groups, face[order]),
    )


def _smallest_of_fan(points: Floats) -> Floats:
    """Square of the area ``(p,)``, but for a factor, of the smallest triangle in the fans from the first points of
    polygons ``(p,n,3)``.
    """
    spokes = points[:, 1:] - points[:, :1]
    areas = cross(spokes[:, :-1], spokes[:, 1:])
    least: Floats = np.einsum("pti,pti->pt", areas, areas).min(axis=1)
    return least
