"""From a mesh as files hold it to a coarse mesh that any scheme can build on.

Welds, cleans, finds edges and sectors, resolves normals and end tangents, and says in plain words what it
met on the way.
"""

from __future__ import annotations

from functools import cached_property, partial

import numpy as np

from curvify.arrays import all_finite, by_component, take_rows
from curvify.edges import Directions, edge_curves, smooth_tangents
from curvify.errors import MeshError
from curvify.marks import ResolvedMarks, explicit_marks, found_marks, gather_marks, hole_faces
from curvify.mesh import Bools, Floats, Ints, Marks, PolygonMesh
from curvify.normals import SAME_NORMAL, degrees_between, is_flat_shaded, length, unit
from curvify.options import MeshOptions
from curvify.polygons import newell_normals
from curvify.records import field, record
from curvify.sectors import Features, end_normals, label_sectors, resolve_features
from curvify.topology import (
    Loops,
    Topology,
    build_topology,
    clean_loops,
    corner_links,
    fans,
    is_closed,
    signed_volume,
    weld_vertices,
)
from curvify.words import count_of

#: Coordinates beyond this would overflow when they are multiplied, or in float32 files.
LARGEST_COORDINATE = 1e30
#: Given normals whose squared length is off 1 by no more than this, 4 units in the last place, are left as they are.
UNIT = 8 * float(np.finfo(np.float64).eps)


@record
class Coarse:
    """A mesh ready for a scheme.

    ``positions (V,3)`` as read, ``stand_in (V,)`` the vertex that each is welded to; welded ``loops``, their
    ``topology``, area vectors ``area (F,3)``, ``fans (C,)`` and ``sectors (C,)``; ``given (C,3)`` unit normals of the
    corners, zero where the file has none, or None where all are to be computed; ``marks`` resolved for these loops;
    ``holes`` are faces of the mesh that were left out.
    """

    mesh: PolygonMesh
    positions: Floats
    stand_in: Ints
    loops: Loops
    topology: Topology
    area: Floats
    fans: Ints
    sectors: Ints
    given: Floats | None
    marks: ResolvedMarks
    holes: Bools
    warnings: list[str] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)

    def features(self, corners: Bools | None = None, directions: Directions = smooth_tangents) -> Features:
        """Normals and end tangents, with the vertices ``corners (V,)`` as corners besides those that are marked;
        ``directions`` as in ``resolve_features``.
        """
        if corners is None or not corners.any():
            if directions is smooth_tangents:
                return self._plain_features
            corners = np.zeros(len(self.positions), dtype=bool)
        return self._features(corners, directions)

    @cached_property
    def _plain_features(self) -> Features:
        return self._features(np.zeros(len(self.positions), dtype=bool), smooth_tangents)

    @cached_property
    def without_area(self) -> Bools:
        """Faces ``(F,)`` whose area is nothing against the square of their longest side."""
        topology = self.topology
        points = take_rows(self.positions, topology.vertices)
        sides = take_rows(points, topology.next) - points
        longest = np.maximum.reduceat(np.einsum("ci,ci->c", sides, sides), topology.offsets[:-1])
        return length(self.area) <= 1e-12 * longest

    def _features(self, corners: Bools, directions: Directions) -> Features:
        return resolve_features(
            self.topology,
            self.positions,
            self.area,
            self.fans,
            self.sectors,
            self.given,
            self.marks,
            corners,
            directions,
        )

    def note_features(self, features: Features) -> tuple[dict[str, int], list[str]]:
        """Counts of sharp features for the report, and what there is to warn of."""
        unmarked = self._broken_edges(features)
        counts = {
            "crease_edges": int(features.sharp.any(axis=1).sum()),
            "corner_vertices": int(features.corners.sum()),
            "broken_edges": len(unmarked),
            "adjusted_corners": features.adjusted,
        }
        notes = []
        if len(unmarked):
            a, b = self.topology.edges[unmarked[0]]
            notes.append(
                f"{count_of(len(unmarked), 'edge')} without a mark not smooth at an end, first: {a}-{b}; "
                "creases or rims turn there too sharply for one tangent plane"
            )
        if features.adjusted:
            notes.append(
                f"{count_of(features.adjusted, 'corner')} could not keep the normal of the vertex: "
                "no curve along an edge fits all its faces"
            )
        return counts, notes

    def _broken_edges(self, features: Features) -> Ints:
        """Interior edges that nothing asks to be sharp and whose faces still have two normals at an end."""
        if not features.corners.any() and not features.adjusted:
            return np.zeros(0, dtype=np.int64)
        topology, marks = self.topology, self.marks
        one, other = (end_normals(topology, features.normals, sides) for sides in (topology.first, topology.last))
        apart = topology.interior & (one != other).any(axis=(1, 2))
        asked = marks.crease.any(axis=1) | marks.corner[topology.edges].any(axis=1)
        return np.flatnonzero(apart & ~asked)

    def unused_marks(self, used: tuple[str, ...], scheme: str) -> list[str]:
        """Warnings of marks ``bulge``, ``alpha`` and ``kappa`` that are not among those that a scheme has a use for."""
        known = {"bulge": self.marks.bulge, "alpha": self.marks.alpha, "kappa": self.marks.kappa}
        counts = {name: int((~np.isnan(values)).sum()) for name, values in known.items() if name not in used}
        return [
            f"{count_of(number, f'{name} mark')} ignored: {scheme} has no use for {name}"
            for name, number in counts.items()
            if number
        ]

    def found_marks(self) -> Marks:
        """The marks that all sources together make, by vertices and faces of the mesh."""
        return found_marks(self.marks, self.topology, self.loops, self.holes)

    def edge_curves(self, features: Features, lengths: str = "circle") -> Floats:
        """Bezier points ``(E,4,3)`` of the mesh's edges in canonical direction; ``lengths`` as in ``edges``."""
        start, end = self.positions[self.topology.edges.T]
        return edge_curves(start, end, features.tangents[:, 0], features.tangents[:, 1], lengths)


def prepare_mesh(mesh: PolygonMesh | Coarse, options: MeshOptions | None = None) -> Coarse:
    """Weld, clean and analyze a mesh, and weigh its marks. A mesh that was prepared, with the same options, stays so.

    Raises MeshError where there is nothing to refine.
    """
    if isinstance(mesh, Coarse):
        return mesh
    options = options or MeshOptions()
    mesh.validate()
    positions = by_component(mesh.positions.astype(np.float64, copy=False))
    _check_extent(positions, mesh)
    for marks in explicit_marks(mesh, options).values():
        marks.validate(mesh.vertex_count, mesh.face_count)
    stand_in = weld_vertices(positions, mesh.face_offsets, mesh.face_vertices, options.weld)
    loops = clean_loops(mesh.face_offsets, stand_in[mesh.face_vertices])
    holes = hole_faces(mesh, options)
    dropped = np.flatnonzero(np.bincount(loops.source_faces, minlength=mesh.face_count) == 0)
    if holes.any():
        loops = _without_faces(loops, holes)
    if not len(loops.source_faces):
        raise MeshError(
            "every face is a hole; there is nothing to refine"
            if holes.all()
            else "every face has fewer than 3 distinct corners; there is nothing to refine"
        )
    topology = build_topology(positions, loops.offsets, loops.vertices)
    area = newell_normals(positions, loops.offsets, loops.vertices)
    given = _given_normals(mesh, loops, topology, area, options.sharp_from)
    resolved, notes = gather_marks(mesh, options, topology, loops, stand_in, area, given.normals)
    around = fans(topology)
    sectors = label_sectors(topology, around, resolved.crease)
    coarse = Coarse(mesh, positions, stand_in, loops, topology, area, around, sectors, given.normals, resolved, holes)
    coarse.counts["hole_faces"] = int(holes.sum())
    coarse.warnings += mesh.warnings
    _note_topology(coarse, int((stand_in != np.arange(len(stand_in))).sum()), dropped)
    coarse.warnings += given.notes + notes
    return coarse


def _without_faces(loops: Loops, holes: Bools) -> Loops:
    """The loops without those of the mesh's faces ``holes (F,)``."""
    kept = ~holes[loops.source_faces]
    sizes = np.diff(loops.offsets)
    corners = np.repeat(kept, sizes)
    offsets = np.concatenate([[0], np.cumsum(sizes[kept])])
    return Loops(offsets, loops.vertices[corners], loops.source_corners[corners], loops.source_faces[kept])


def _check_extent(positions: Floats, mesh: PolygonMesh) -> None:
    if not mesh.face_count:
        what = f"only {mesh.vertex_count} points" if mesh.vertex_count else "nothing in it"
        raise MeshError(f"the mesh has no faces, {what}; give a mesh with polygons")
    extent = float(np.abs(positions).max(initial=0.0))
    if extent > LARGEST_COORDINATE:
        raise MeshError(f"a coordinate is as large as {extent:.3g}; scale the mesh below {LARGEST_COORDINATE:.0e}")
    if mesh.corner_uvs is not None and np.abs(np.nan_to_num(mesh.corner_uvs)).max(initial=0.0) > LARGEST_COORDINATE:
        raise MeshError(f"a texture coordinate is larger than {LARGEST_COORDINATE:.0e}; scale or remove it")
    span = float(np.ptp(positions, axis=0).max(initial=0.0))
    if 0 < span < 1 / LARGEST_COORDINATE:
        raise MeshError(f"the mesh is only {span:.3g} across; scale it above {1 / LARGEST_COORDINATE:.0e}")


def _note_topology(coarse: Coarse, welded: int, dropped: Ints) -> None:
    """Warnings and counts about the connectivity; ``dropped`` are faces without three distinct corners."""
    mesh, loops, topology = coarse.mesh, coarse.loops, coarse.topology
    counts, warnings = coarse.counts, coarse.warnings
    used = np.zeros(mesh.vertex_count, dtype=bool)
    used[mesh.face_vertices] = True
    fan_vertices = topology.vertices[np.flatnonzero(np.bincount(coarse.fans))]
    counts.update(
        vertices=mesh.vertex_count,
        faces=mesh.face_count,
        edges=len(topology.edges),
        boundary_edges=int((~topology.interior).sum()),
        nonmanifold_edges=int(topology.nonmanifold.sum()),
        unreferenced_vertices=int((~used).sum()),
        welded_vertices=welded,
        dropped_faces=len(dropped),
        vertices_with_several_fans=int((np.bincount(fan_vertices, minlength=mesh.vertex_count) > 1).sum()),
    )
    if len(dropped):
        warnings.append(
            f"{count_of(len(dropped), 'face')} with fewer than 3 distinct corners dropped, first: {dropped[0]}"
        )
    if counts["nonmanifold_edges"]:
        a, b = topology.edges[np.flatnonzero(topology.nonmanifold)[0]]
        warnings.append(
            f"{count_of(counts['nonmanifold_edges'], 'edge')} with more than two faces or with faces that run the same "
            f"way, first: {a}-{b}; each face treats them as a boundary"
        )
    flat = np.flatnonzero(coarse.without_area)
    counts["zero_area_faces"] = len(flat)
    if len(flat):
        warnings.append(
            f"{count_of(len(flat), 'face')} without area, first: {loops.source_faces[flat[0]]}; "
            "the surface there only follows its edges"
        )
    volume = partial(signed_volume, coarse.positions, loops.offsets, loops.vertices, coarse.area)
    if is_closed(topology) and volume() < 0:
        warnings.append("the mesh is closed and inside out: its faces run clockwise seen from outside")


@record
class GivenNormals:
    """Unit ``normals (C,3)`` of the loops' corners, zero where the file has none; None where they say nothing."""

    normals: Floats | None
    notes: list[str]


def _given_normals(
    mesh: PolygonMesh, loops: Loops, topology: Topology, area: Floats, sharp_from: str
) -> GivenNormals:
    """The normals of the file, unless they only repeat its flat faces, and what there is to say about them."""
    if mesh.corner_normals is None:
        return GivenNormals(None, [])
    given = by_component(take_rows(mesh.corner_normals, loops.source_corners))
    if not all_finite(given):
        given = np.nan_to_num(given, posinf=0.0, neginf=0.0)
    off = np.flatnonzero(np.abs(np.einsum("ci,ci->c", given, given) - 1) > UNIT)
    rows = take_rows(given, off)
    given[off] = unit(rows / np.maximum(np.abs(rows).max(axis=1, keepdims=True), 1e-300))
    present = given.any(axis=1)
    if not present.any():
        return GivenNormals(None, [])
    asked = sharp_from == "normals"
    if not asked and present.all() and is_flat_shaded(given, loops.offsets, area, partial(corner_links, topology)):
        note = "the file's normals only repeat its flat faces and are ignored; keep them with --sharp-from normals"
        return GivenNormals(None, [note] if _normals_differ(topology, given) else [])
    missing = int((~present).sum())
    note = f"{count_of(missing, 'corner')} without a normal in the file, computed from the faces"
    return GivenNormals(given, [note] if missing else [])


def _normals_differ(topology: Topology, normals: Floats) -> bool:
    """Whether any vertex has corner normals that are not one."""
    first = np.zeros((topology.vertex_count, 3))
    first[topology.vertices[::-1]] = normals[::-1]
    return bool((degrees_between(normals, first[topology.vertices]) > SAME_NORMAL).any())
