"""From a mesh as files hold it to a coarse mesh that any scheme can build on.

Welds, cleans, finds edges and sectors, resolves normals and end tangents, and says in plain words what it
met on the way.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from curvify.errors import MeshError, OptionError
from curvify.mesh import Bools, Floats, Ints, PolygonMesh
from curvify.normals import SAME_NORMAL, degrees_between, is_flat_shaded, sector_normals, unit
from curvify.polygons import newell_normals
from curvify.sectors import Features, resolve_features
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

WELD_MODES = ("auto", "always", "never")
SHARP_SOURCES = ("auto", "normals", "none")
#: Coordinates beyond this would overflow when they are multiplied, or in float32 files.
LARGEST_COORDINATE = 1e30


@dataclass(eq=False)
class Coarse:
    """A mesh ready for a scheme.

    ``positions (V,3)`` as read, ``stand_in (V,)`` the vertex that each is welded to; welded ``loops``, their
    ``topology``, area vectors ``area (F,3)`` and ``fans (C,)``; ``given (C,3)`` unit normals of the corners, or None
    where they are to be computed.
    """

    mesh: PolygonMesh
    positions: Floats
    stand_in: Ints
    loops: Loops
    topology: Topology
    area: Floats
    fans: Ints
    given: Floats | None
    split_by_normals: bool
    warnings: list[str] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)

    def features(self, corners: Bools | None = None) -> Features:
        """Normals and end tangents, with the vertices ``corners (V,)`` as corners."""
        if corners is None:
            corners = np.zeros(len(self.positions), dtype=bool)
        return resolve_features(
            self.topology, self.positions, self.area, self.fans, self.given, corners, self.split_by_normals
        )


def prepare_mesh(mesh: PolygonMesh, weld: str = "auto", sharp_from: str = "auto") -> Coarse:
    """Weld, clean and analyze a mesh.

    ``weld``: ``auto`` closes seams between bit-equal open edges, ``always`` merges all bit-equal positions,
    ``never`` neither. ``sharp_from``: ``auto`` takes creases from corner normals that differ, unless the file is
    only flat-shaded; ``normals`` takes them in any case; ``none`` averages them away.
    Raises MeshError where there is nothing to refine, OptionError for unknown words.
    """
    if weld not in WELD_MODES:
        raise OptionError(f"weld must be one of {', '.join(WELD_MODES)}, not {weld!r}")
    if sharp_from not in SHARP_SOURCES:
        raise OptionError(f"sharp_from must be one of {', '.join(SHARP_SOURCES)}, not {sharp_from!r}")
    mesh.validate()
    positions = np.ascontiguousarray(mesh.positions, dtype=np.float64)
    _check_extent(positions, mesh)
    stand_in = weld_vertices(positions, mesh.face_offsets, mesh.face_vertices, weld)
    loops = clean_loops(mesh.face_offsets, stand_in[mesh.face_vertices])
    if not len(loops.source_faces):
        raise MeshError("every face has fewer than 3 distinct corners; there is nothing to refine")
    topology = build_topology(positions, loops.offsets, loops.vertices)
    area = newell_normals(positions, loops.offsets, loops.vertices)
    coarse = Coarse(
        mesh, positions, stand_in, loops, topology, area, fans(topology), None, sharp_from != "none"
    )
    coarse.warnings += mesh.warnings
    _note_topology(coarse, int((stand_in != np.arange(len(stand_in))).sum()))
    coarse.given = _given_normals(coarse, sharp_from)
    return coarse


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


def _note_topology(coarse: Coarse, welded: int) -> None:
    """Warnings and counts about the connectivity."""
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
        dropped_faces=mesh.face_count - len(loops.source_faces),
        vertices_with_several_fans=int((np.bincount(fan_vertices, minlength=mesh.vertex_count) > 1).sum()),
    )
    if counts["dropped_faces"]:
        gone = np.flatnonzero(np.bincount(loops.source_faces, minlength=mesh.face_count) == 0)[0]
        warnings.append(
            f"{count_of(counts['dropped_faces'], 'face')} with fewer than 3 distinct corners dropped, first: {gone}"
        )
    if counts["nonmanifold_edges"]:
        a, b = topology.edges[np.flatnonzero(topology.nonmanifold)[0]]
        warnings.append(
            f"{count_of(counts['nonmanifold_edges'], 'edge')} with more than two faces or with faces that run the same "
            f"way, first: {a}-{b}; each face treats them as a boundary"
        )
    flat = np.flatnonzero(_without_area(coarse))
    counts["zero_area_faces"] = len(flat)
    if len(flat):
        warnings.append(
            f"{count_of(len(flat), 'face')} without area, first: {loops.source_faces[flat[0]]}; "
            "the surface there only follows its edges"
        )
    volume = partial(signed_volume, coarse.positions, loops.offsets, loops.vertices, coarse.area)
    if is_closed(topology) and volume() < 0:
        warnings.append("the mesh is closed and inside out: its faces run clockwise seen from outside")
    if mesh.marks.counts():
        found = ", ".join(f"{n} {kind}" for kind, n in mesh.marks.counts().items())
        warnings.append(f"the file has marks ({found}) that this version does not use yet")


def _without_area(coarse: Coarse) -> Bools:
    """Faces ``(F,)`` whose area is nothing against the square of their longest side."""
    topology = coarse.topology
    points = coarse.positions[topology.vertices]
    sides = points[topology.next] - points
    longest = np.maximum.reduceat(np.einsum("ci,ci->c", sides, sides), topology.offsets[:-1])
    return np.linalg.norm(coarse.area, axis=1) <= 1e-12 * longest


def _given_normals(coarse: Coarse, sharp_from: str) -> Floats | None:
    """Unit corner normals of the file on the cleaned loops, gaps filled; None where they say nothing."""
    normals = coarse.mesh.corner_normals
    if normals is None:
        return None
    loops, topology = coarse.loops, coarse.topology
    given = np.nan_to_num(normals[loops.source_corners], posinf=0.0, neginf=0.0)
    given = unit(given / np.maximum(np.abs(given).max(axis=1, keepdims=True), 1e-300))
    present = given.any(axis=1)
    if not present.any():
        return None
    flat = present.all() and is_flat_shaded(given, loops.offsets, coarse.area, corner_links(topology))
    if flat and sharp_from == "auto":
        if _normals_differ(topology, given):
            coarse.warnings.append(
                "the file's normals only repeat its flat faces and are ignored; keep them with --sharp-from normals"
            )
        return None
    if not present.all():
        computed = sector_normals(coarse.positions, loops.offsets, loops.vertices, coarse.area, coarse.fans)
        given[~present] = computed[~present]
        missing = count_of(int((~present).sum()), "corner")
        coarse.warnings.append(f"{missing} without a normal in the file, computed from the faces")
    return given


def _normals_differ(topology: Topology, normals: Floats) -> bool:
    """Whether any vertex has corner normals that are not one."""
    first = np.zeros((topology.vertex_count, 3))
    first[topology.vertices[::-1]] = normals[::-1]
    return bool((degrees_between(normals, first[topology.vertices]) > SAME_NORMAL).any())
