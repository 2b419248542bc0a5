"""What a mesh is like: its defects, pieces, holes and genus, and how flat and smooth it is.

Everything is measured on the welded and cleaned mesh that a surface would be built on (``prepare_mesh``), and every
function takes that ``Coarse`` mesh. Ids in results are those of the file, counted from 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from curvify.arrays import distinct, ranking, take_rows, values_of
from curvify.convex import REASONS, split_polygons
from curvify.errors import MeshError
from curvify.mesh import Bools, Floats, Ints, PolygonMesh
from curvify.normals import degrees_between, unit
from curvify.options import MeshOptions
from curvify.prepare import Coarse, prepare_mesh
from curvify.sectors import sharp_ends
from curvify.topology import Loops, Topology, clean_loops, components, is_closed, signed_volume

# --- edges ------------------------------------------------------------------------------------------------------


def open_edges(coarse: Coarse) -> Ints:
    """Edges ``(E,)`` (their numbers) of one face only."""
    return np.flatnonzero(coarse.topology.uses == 1)


def crowded_edges(coarse: Coarse) -> Ints:
    """Edges of more than two faces."""
    return np.flatnonzero(coarse.topology.uses > 2)


def reversed_edges(coarse: Coarse) -> Ints:
    """Edges whose two faces run the same way along them, so that one shows its back where the other shows its front."""
    return np.flatnonzero((coarse.topology.uses == 2) & ~coarse.topology.interior)


def edge_ends(coarse: Coarse, edges: Ints) -> Ints:
    """Vertices ``(e,2)`` of edges, the smaller first."""
    return np.sort(coarse.topology.edges[edges], axis=1)


# --- vertices ---------------------------------------------------------------------------------------------------


def pinched_vertices(coarse: Coarse) -> Ints:
    """Vertices where surfaces meet that share no edge there.

    Faces on either side of an edge of two faces count as joined whichever way they run, so that a reversed face is
    not reported here as well; faces at a crowded edge count as joined.
    """
    topology = coarse.topology
    label = coarse.fans
    if topology.nonmanifold.any():
        label = components(len(label), *_joined_corners(topology))
    firsts = np.flatnonzero(label == np.arange(len(label)))
    return np.flatnonzero(np.bincount(topology.vertices[firsts], minlength=topology.vertex_count) > 1)


def _joined_corners(topology: Topology) -> tuple[Ints, Ints]:
    """Corners that lie side by side at the ends of edges of two faces or more, whichever way those run."""
    edge_order = ranking(topology.edge)
    same = topology.edge[edge_order[1:]] == topology.edge[edge_order[:-1]]
    one, other = edge_order[:-1][same], edge_order[1:][same]
    turned = topology.forward[one] != topology.forward[other]
    tail, head = np.where(turned, topology.next[other], other), np.where(turned, other, topology.next[other])
    return np.concatenate([one, topology.next[one]]), np.concatenate([tail, head])


def unused_vertices(mesh: PolygonMesh) -> Ints:
    """Vertices of the file that are in no face."""
    used = np.zeros(mesh.vertex_count, dtype=bool)
    used[mesh.face_vertices] = True
    return np.flatnonzero(~used)


# --- faces ------------------------------------------------------------------------------------------------------


def degenerate_faces(coarse: Coarse) -> Ints:
    """Faces of the file with fewer than three distinct corners or without area."""
    mesh = coarse.mesh
    bad = np.ones(mesh.face_count, dtype=bool)
    bad[clean_loops(mesh.face_offsets, coarse.stand_in[mesh.face_vertices]).source_faces] = False
    bad[coarse.loops.source_faces[coarse.without_area]] = True
    return np.flatnonzero(bad)


def same_loops(loops: Loops) -> Ints:
    """The first loop ``(F,)`` that has the same vertices as each one, in any order: itself for most."""
    sizes = np.diff(loops.offsets)
    first = np.arange(len(sizes))
    for size in values_of(sizes):
        rows = np.flatnonzero(sizes == size)
        corners = loops.vertices[loops.offsets[rows][:, None] + np.arange(size)]
        alike = _not_alone(corners.sum(axis=1))  # few are: only those are looked at closely
        rows, corners = rows[alike], np.sort(corners[alike], axis=1)
        order = np.lexsort(corners.T)
        fresh = np.ones(len(rows), dtype=bool)
        fresh[1:] = (corners[order][1:] != corners[order][:-1]).any(axis=1)
        first[rows[order]] = rows[order[fresh]][np.cumsum(fresh) - 1]
    return first


def _not_alone(keys: Ints) -> Bools:
    """Which of some integers ``(n,)`` occur more than once."""
    which = distinct(keys)[1]
    alone: Bools = np.bincount(which) == 1
    return ~alone[which]


def repeated_loops(loops: Loops) -> Bools:
    """Loops ``(F,)`` that have the same vertices as an earlier one, in any order."""
    first = same_loops(loops)
    return first != np.arange(len(first))


def concave_faces(coarse: Coarse) -> Ints:
    """Faces of the file that are concave or visit a vertex twice: those that `curvify split` cuts."""
    loops = coarse.loops
    widest = max(int(np.diff(loops.offsets).max()), 3)
    split = split_polygons(coarse.positions, loops.offsets, loops.vertices, max_sides=widest)
    cut = (split.reasons & (REASONS["concave"] | REASONS["keyhole"])) != 0
    return np.sort(loops.source_faces[cut])


def tilts(coarse: Coarse) -> Floats:
    """How far each face ``(F,)`` is from planar: the largest angle in degrees between one of its sides and its plane.

    The plane is across the area vector. 0 for triangles and for faces without area.
    """
    topology = coarse.topology
    points = take_rows(coarse.positions, topology.vertices)
    sides = unit(take_rows(points, topology.next) - points)
    normals = np.repeat(unit(coarse.area), topology.sizes, axis=0)
    sine = np.abs(np.einsum("ci,ci->c", sides, normals))
    tilt = np.degrees(np.arcsin(np.minimum(np.maximum.reduceat(sine, topology.offsets[:-1]), 1.0)))
    tilt[(topology.sizes == 3) | coarse.without_area] = 0.0
    return tilt


# --- pieces -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Pieces:
    """``labels (F,)`` number the connected pieces, faces joined across edges; ``boundary_loops``, ``genus`` of the
    whole mesh, None where edges of several faces or with reversed faces leave it undefined.
    """

    labels: Ints
    count: int
    boundary_loops: int
    genus: int | None


def pieces(coarse: Coarse) -> Pieces:
    """Connected pieces, boundary loops and genus. An edge that is not between two faces is a boundary for each."""
    topology = coarse.topology
    joined = np.flatnonzero(topology.twin >= 0)
    faces = topology.faces
    labels = distinct(components(len(topology.sizes), faces[joined], faces[topology.twin[joined]]))[1]
    count = int(labels.max()) + 1
    loops = _boundary_loops(coarse)
    genus = None
    if not topology.nonmanifold.any():
        # Each fan is a vertex: V - E + F = 2 (pieces) - 2 genus - loops.
        fans = int(np.count_nonzero(np.bincount(coarse.fans)))
        euler = fans - len(topology.edges) + len(topology.sizes)
        genus = (2 * count - loops - euler) // 2
    return Pieces(labels, count, loops, genus)


def _boundary_loops(coarse: Coarse) -> int:
    """How many loops the open half-edges form: each leads from its own fan to that of the next corner."""
    topology = coarse.topology
    open_ = np.flatnonzero(topology.twin < 0)
    here, there = coarse.fans[open_], coarse.fans[topology.next[open_]]
    label = components(len(coarse.fans), here, there)
    return int(np.count_nonzero(np.bincount(label[here], minlength=1)))


def volume(coarse: Coarse) -> float | None:
    """Enclosed volume in cubic units of the file, negative for a mesh inside out; None unless it is closed."""
    if not is_closed(coarse.topology):
        return None
    return signed_volume(coarse.positions, coarse.loops.offsets, coarse.loops.vertices, coarse.area)


# --- smoothness -------------------------------------------------------------------------------------------------


def sharp_edges(coarse: Coarse) -> Bools:
    """Edges ``(E,)`` that are a crease at one end at least."""
    start, end = sharp_ends(coarse.topology, coarse.sectors).T
    return start | end


def bends(coarse: Coarse, sharp: Bools) -> tuple[Ints, Floats]:
    """Edges ``(e,)`` that are meant to be smooth and the angle ``(e,)`` in degrees between their two faces.

    Left out: boundaries, the ``sharp (E,)`` edges, and edges at a face without area.
    """
    topology = coarse.topology
    one = np.flatnonzero(topology.twin > np.arange(len(topology.twin)))
    other = topology.twin[one]
    flat = coarse.without_area
    faces = topology.faces
    kept = ~(flat[faces[one]] | flat[faces[other]] | sharp[topology.edge[one]])
    one, other = one[kept], other[kept]
    return topology.edge[one], degrees_between(coarse.area[faces[one]], coarse.area[faces[other]])


# --- all of it --------------------------------------------------------------------------------------------------


def describe(mesh: PolygonMesh, options: MeshOptions | None = None) -> dict[str, Any]:
    """What there is to say about a mesh, as plain data: counts, sizes, shape, attributes, marks by source.

    Lengths are in units of the file, angles in degrees. ``shape`` is None for a mesh that no surface can be built on.
    """
    try:
        return describe_prepared(mesh, prepare_mesh(mesh, options))
    except MeshError:
        return describe_prepared(mesh, None)


def describe_prepared(mesh: PolygonMesh, coarse: Coarse | None) -> dict[str, Any]:
    """As ``describe``, of a mesh that was prepared; None where it could not be."""
    return {
        "vertices": mesh.vertex_count,
        "faces": mesh.face_count,
        "corners": mesh.corner_count,
        "unused_vertices": len(unused_vertices(mesh)),
        "polygons": {str(size): int(np.count_nonzero(mesh.face_sizes == size)) for size in values_of(mesh.face_sizes)},
        "bounds": _bounds(mesh.positions),
        "shape": None if coarse is None else _shape(coarse),
        "attributes": _attributes(mesh),
        "marks": {} if coarse is None else coarse.marks.counts,
    }


def _bounds(positions: Floats) -> dict[str, Any] | None:
    if not len(positions):
        return None
    low, high = positions.min(axis=0), positions.max(axis=0)
    return {"low": low.tolist(), "high": high.tolist(), "diagonal": float(np.linalg.norm(high - low))}


def _shape(coarse: Coarse) -> dict[str, Any]:
    """What the faces form once seams are closed."""
    topology = coarse.topology
    whole, tilt = pieces(coarse), tilts(coarse)
    sharp = sharp_edges(coarse)
    edges, angles = bends(coarse, sharp)
    ends = coarse.positions[topology.edges]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    sized = bool(len(angles))
    return {
        "edges": len(topology.edges),
        "edge_length": {"least": float(lengths.min()), "mean": float(lengths.mean()), "most": float(lengths.max())},
        "pieces": whole.count,
        "closed": is_closed(topology),
        "boundary_loops": whole.boundary_loops,
        "genus": whole.genus,
        "area": float(np.linalg.norm(coarse.area, axis=1).sum() / 2),
        "volume": volume(coarse),
        "open_edges": len(open_edges(coarse)),
        "crowded_edges": len(crowded_edges(coarse)),
        "reversed_edges": len(reversed_edges(coarse)),
        "pinched_vertices": len(pinched_vertices(coarse)),
        "welded_vertices": coarse.counts["welded_vertices"],
        "degenerate_faces": len(degenerate_faces(coarse)),
        "duplicate_faces": int(repeated_loops(coarse.loops).sum()),
        "concave_faces": len(concave_faces(coarse)),
        "planarity": {"most_degrees": float(tilt.max()), "face": int(coarse.loops.source_faces[tilt.argmax()])},
        "creases": int(sharp.sum()),
        "bends": {
            "most_degrees": float(angles.max()) if sized else None,
            "mean_degrees": float(angles.mean()) if sized else None,
            "edge": edge_ends(coarse, edges[[angles.argmax()]])[0].tolist() if sized else None,
        },
    }


def _attributes(mesh: PolygonMesh) -> dict[str, Any]:
    """What the file says about corners, vertices and faces beside where they are."""
    colors, smoothing = mesh.vertex_colors, mesh.face_smoothing
    return {
        "normals": _filled(mesh.corner_normals),
        "texture_coordinates": _filled(mesh.corner_uvs),
        "vertex_colors": None if colors is None else f"{colors.shape[1]} x {colors.dtype.name}",
        "materials": list(mesh.material_names) if mesh.face_materials is not None else [],
        "groups": list(mesh.group_names) if mesh.face_groups is not None else [],
        "smoothing_groups": 0 if smoothing is None else int(np.count_nonzero(np.bincount(smoothing)[1:])),
    }


def _filled(values: Floats | None) -> int:
    """How many corners have a value."""
    return 0 if values is None else int((~np.isnan(values).any(axis=1)).sum())
