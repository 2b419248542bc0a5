"""Trimming: the part of a dense mesh that an image keeps, cut along the line where the image turns dark.

Every cell is a step of marching squares, its crossings found by bisection on the image itself. A crossing belongs to a
segment between two vertices of the dense mesh, and every cell at that segment has all its crossings: there are no
T-junctions, even where the image differs on the two sides of an edge. Source: Ko, Lee, Lim, Yoon, "Construction and
Rendering of Trimmed Blending Surfaces with Sharp Features on a GPU", section V.5, who trim while they draw; the mesh
is ours (docs/blending.md).
"""

from __future__ import annotations

import numpy as np

from curvify.arrays import distinct
from curvify.errors import MeshError, OptionError
from curvify.kites import CELL, CellGrid, bilinear, kite_corners
from curvify.mask import THRESHOLD, Mask
from curvify.mesh import Bools, DenseMesh, Floats, Ints, PolygonMesh
from curvify.records import record
from curvify.schemes.base import Patches
from curvify.trimmed import GRID, CutCells, Items, join, new_points, trimmed_mesh, whole_cells

MAPS = ("face", "uv")
MODES = ("clip", "drop")
#: Steps of bisection: a crossing is found to a millionth of a segment.
STEPS = 20
#: Crossings keep this distance from the ends of their segment.
MARGIN = 1e-6
#: Samples of the image, and cells, that are looked at together.
WINDOW = 1 << 20


def trim(
    patches: Patches, dense: DenseMesh, level: int, mask: Mask, mapping: str = "face", mode: str = "clip"
) -> PolygonMesh:
    """What the mask keeps of the dense mesh of refinement level k, with normals and texture coordinates at corners.

    ``mapping``: ``face`` lays the image on each patch of four sides, and on each of the n kites of others; ``uv`` on
    the mesh by its texture coordinates. ``mode``: ``clip`` cuts cells, ``drop`` leaves out those not kept whole. The
    vertices of the input come first, also where they are trimmed away. The dense mesh is in memory, and up to 300
    bytes for each of its cells besides. Raises MeshError if nothing is kept or texture coordinates are missing,
    OptionError for a surface without quads.
    """
    if mapping not in MAPS or mode not in MODES:
        raise OptionError(f"trimming knows the maps {', '.join(MAPS)} and the modes {', '.join(MODES)}")
    if dense.faces.shape != (len(patches.topology.vertices) * level**2, 4):
        raise OptionError("only surfaces made of quads can be trimmed; choose the scheme blend or gregory")
    image = _Image(CellGrid(level), mask, image_maps(patches, mapping))
    inside = image.inside()
    if mode == "drop":
        pieces = whole_cells(dense, np.flatnonzero(inside.all(axis=1)))
    else:
        pieces = _clip(image, inside, patches, dense)
    if not len(pieces.sizes):
        raise MeshError("the image trims everything away; what is white is kept, or what is black if it is inverted")
    return trimmed_mesh(pieces, patches, dense)


def image_maps(patches: Patches, mapping: str) -> Floats:
    """Image coordinates ``(C,4,2)`` of the corners of each kite. Raises MeshError where there are none."""
    topology = patches.topology
    if mapping == "face":
        square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        place = np.arange(len(topology.vertices)) - np.repeat(topology.offsets[:-1], topology.sizes)
        of_quads = kite_corners(square[np.minimum(place, 3)], topology.offsets, topology.next, topology.prev)
        return np.where(np.repeat(topology.sizes == 4, topology.sizes)[:, None, None], of_quads, square)
    uvs = patches.mesh.corner_uvs
    if uvs is None:
        raise MeshError("the mesh has no texture coordinates to lay the image on; choose the trim map 'face'")
    uvs = uvs[patches.source_corners]
    missing = np.flatnonzero(np.isnan(uvs).any(axis=1))
    if len(missing):
        face = patches.source_faces[topology.faces[missing[0]]]
        raise MeshError(f"face {face} has no texture coordinates to lay the image on; choose the trim map 'face'")
    return kite_corners(uvs, topology.offsets, topology.next, topology.prev)


@record
class _Image:
    """The mask on the kites of a surface: ``maps (C,4,2)`` of their corners."""

    grid: CellGrid
    mask: Mask
    maps: Floats

    def inside(self) -> Bools:
        """Which corners of each cell the image keeps ``(Q,4)``."""
        k, kites = self.grid.level, len(self.maps)
        result = np.empty((kites, k, k, 4), dtype=bool)
        a, b = np.meshgrid(np.arange(k + 1) / k, np.arange(k + 1) / k, indexing="ij")
        step = max(WINDOW // (k + 1) ** 2, 1)
        for first in range(0, kites, step):
            kept = self.mask.keeps(bilinear(self.maps[first : first + step, None, None], a, b))
            for corner, (i, j) in enumerate(CELL):
                result[first : first + step, ..., corner] = kept[:, i : i + k, j : j + k]
        return result.reshape(-1, 4)

    def brightness(self, kites: Ints, places: Floats) -> Floats:
        """The image at grid coordinates ``(n,2)`` of kites."""
        a, b = (places / self.grid.level).T
        return self.mask.sample(bilinear(self.maps[kites], a, b))


@record
class _Crossings:
    """Points where the image turns dark on segments of the dense mesh.

    ``segments (s,)`` ascending keys of the segments, vertex pairs; crossings by segment and place: those of segment i
    are ``starts[i]`` to ``starts[i + 1]``; ``places (x,)`` from the segment's smaller vertex to the larger, in steps of
    ``1 / GRID``. ``number (c,)``: the crossing of each cell side that was asked.
    """

    segments: Ints
    starts: Ints
    places: Ints
    number: Ints

    def on(self, keys: Ints) -> tuple[Ints, Ints]:
        """First crossing and number of crossings on segments, by their keys ``(...)``."""
        if not len(self.segments):
            return np.zeros_like(keys), np.zeros_like(keys)
        row = np.minimum(np.searchsorted(self.segments, keys), len(self.segments) - 1)
        known = self.segments[row] == keys
        return self.starts[row], np.where(known, self.starts[row + 1] - self.starts[row], 0)


def _segment_keys(vertices: Ints, count: int) -> Ints:
    """One number for the segment from each corner of cells ``(q,4)`` to the next, whatever its direction."""
    heads = np.roll(vertices, -1, axis=1)
    return np.minimum(vertices, heads).astype(np.int64) * count + np.maximum(vertices, heads)


def _find_crossings(image: _Image, cells: Ints, sides: Ints, faces: Ints, count: int) -> _Crossings:
    """Crossings on ``sides (c,)`` of ``cells (c,)`` with the vertices ``faces (c,4)``, of ``count`` vertices in all."""
    kites, corners = image.grid.corners(cells)
    rows = np.arange(len(cells))
    start, end = corners[rows, sides], corners[rows, (sides + 1) % 4]
    turn = (faces[rows, sides] > faces[rows, (sides + 1) % 4])[:, None]
    low, high = np.where(turn, end, start), np.where(turn, start, end)
    bright = image.brightness(kites, low) >= THRESHOLD
    first, last = np.zeros(len(cells)), np.ones(len(cells))
    for _ in range(STEPS):
        middle = (first + last) / 2
        same = (image.brightness(kites, low + middle[:, None] * (high - low)) >= THRESHOLD) == bright
        first, last = np.where(same, middle, first), np.where(same, last, middle)
    place = np.rint(np.clip((first + last) / 2, MARGIN, 1 - MARGIN) * GRID).astype(np.int64)
    segments, which = distinct(_segment_keys(faces, count)[rows, sides])
    found, number = distinct(which * (GRID + 1) + place)
    starts = np.searchsorted(found // (GRID + 1), np.arange(len(segments) + 1))
    return _Crossings(segments, starts, found % (GRID + 1), number)


def _clip(image: _Image, inside: Bools, patches: Patches, dense: DenseMesh) -> CutCells:
    """Cells cut along the line where the image turns dark."""
    whole = inside.all(axis=1)
    mixed = np.flatnonzero(inside.any(axis=1) & ~whole)
    cell, side = np.nonzero(inside[mixed] != np.roll(inside[mixed], -1, axis=1))
    crossings = _find_crossings(image, mixed[cell], side, dense.faces[mixed[cell]], dense.vertex_count)
    kept = np.flatnonzero(whole)
    touched = _touching(dense, kept, crossings)
    cut = np.sort(np.concatenate([mixed, touched]))
    own = np.full((len(cut), 4), -1)
    own[np.searchsorted(cut, mixed)[cell], side] = crossings.number
    items = _kept_crossings(dense, cut, inside[cut], own, crossings)
    loops = _loops(image, cut, inside[cut])
    points, wedges = new_points(patches, image.grid, items, len(crossings.places))
    pieces = _outlines(dense, cut, inside[cut], items, loops, wedges)
    pieces.points = points
    return join(whole_cells(dense, np.setdiff1d(kept, touched, assume_unique=True)), pieces)


def _touching(dense: DenseMesh, cells: Ints, crossings: _Crossings) -> Ints:
    """Those of some whole cells that have a crossing on a side: the image differs on its other side."""
    found: list[Ints] = [np.zeros(0, dtype=np.int64)]
    for first in range(0, len(cells), WINDOW):
        part = cells[first : first + WINDOW]
        _, count = crossings.on(_segment_keys(dense.faces[part], dense.vertex_count))
        found.append(part[count.any(axis=1)])
    return np.concatenate(found)


def _kept_crossings(dense: DenseMesh, cells: Ints, inside: Bools, own: Ints, crossings: _Crossings) -> Items:
    """The crossings on the kept parts of the sides of some cells, also those that only the cell beyond has.

    ``own (q,4)`` is a cell's own crossing on each side, -1 for none: there its kept part begins or ends.
    """
    faces = dense.faces[cells]
    start, count = crossings.on(_segment_keys(faces, dense.vertex_count))
    row, side = np.nonzero(count)
    many = count[row, side]
    crossing = np.repeat(start[row, side] - (np.cumsum(many) - many), many) + np.arange(int(many.sum()))
    row, side = np.repeat(row, many), np.repeat(side, many)
    ahead = faces[row, side] < faces[row, (side + 1) % 4]

    def along(numbers: Ints) -> Ints:
        return np.where(ahead, crossings.places[numbers], GRID - crossings.places[numbers])

    place, limit = along(crossing), along(own[row, side])
    from_start, to_end = inside[row, side], inside[row, (side + 1) % 4]
    kept = np.where(from_start, to_end | (place <= limit), to_end & (place >= limit))
    return Items(row[kept], cells[row[kept]], side[kept], place[kept], crossing[kept])


def _loops(image: _Image, cells: Ints, inside: Bools) -> Ints:
    """Which of two polygons each side of the cells belongs to ``(q,4)``: two where only opposite corners are kept and
    the bilinear saddle between them is dark.
    """
    result = np.zeros((len(cells), 4), dtype=np.int64)
    across = (inside[:, 0] == inside[:, 2]) & (inside[:, 1] == inside[:, 3])
    saddle = np.flatnonzero(across & (inside[:, 0] != inside[:, 1]))
    if not len(saddle):
        return result
    kites, corners = image.grid.corners(cells[saddle])
    a, b, c, d = (image.brightness(kites, corners[:, i]) for i in range(4))
    apart = (a * c - b * d) / (a + c - b - d) < THRESHOLD
    first = inside[saddle[apart], 0][:, None]
    result[saddle[apart]] = np.where(first, [0, 1, 1, 0], [0, 0, 1, 1])
    return result


def _outlines(
    dense: DenseMesh, cells: Ints, inside: Bools, items: Items, loops: Ints, wedges: Ints
) -> CutCells:
    """Polygons of some cells: around each, the corner at the start of each side, then the crossings on it.

    ``wedges (x,)`` of the items, counted from 0.
    """
    faces, face_wedges = dense.faces[cells], dense.face_wedges[cells]
    row, corner = np.nonzero(inside)
    owner, side = np.concatenate([row, items.rows]), np.concatenate([corner, items.sides])
    place = np.concatenate([np.zeros(len(row), dtype=np.int64), items.places])
    loop = 2 * owner + loops[owner, side]
    order = np.lexsort((place, side, loop))
    vertices = np.concatenate([faces[row, corner], dense.vertex_count + items.crossings])[order]
    wedge = np.concatenate([face_wedges[row, corner], len(dense.normals) + wedges])[order]
    begins = np.flatnonzero(np.diff(loop[order], prepend=-1))
    sizes = np.diff(np.append(begins, len(order)))
    return CutCells(sizes, cells[loop[order][begins] // 2], vertices, wedge)
