"""Corners at which patches would fold, and polygons changed so that fewer do.

At a smooth vertex the angles between the edge curves, seen along the normal, add up to a full turn. A corner that
takes 180 degrees of it or more, as where a third edge runs into a straight line, leaves its patch no room to open.

``folded_corners(mesh)`` gives `Folds`: the sine between the two curves at every corner of a mesh with corner normals
and marks, just as `refine` draws them; which corners are ``flagged`` and which really ``reversed``.
``split_folded_corners(mesh)`` cuts polygons from their worst flagged corner; ``collapse_folded(mesh)`` takes smooth
vertices of two edges away, and the shortest edge of triangles that fold. ``unfold(mesh)`` does all that and returns
`Unfolded`: the mesh, and for each of its corners the corner of the given mesh that it was. All of them keep positions,
normals and marks as they find them and never ask where those came from, so they serve meshes before and after a fit.

Source: Leung, Wang, Zhang, section 2.3 (the folding rule); the choice of corners and the collapses are ours.
"""

from __future__ import annotations

import numpy as np

from curvify.arrays import cross, distinct
from curvify.convex import split_at_corners, whole_faces
from curvify.mesh import Bools, Floats, Ints, Marks, PolygonMesh
from curvify.normals import degrees_between, dot, unit
from curvify.options import MeshOptions
from curvify.pieces import pieces_of
from curvify.polygons import edge_keys, is_in
from curvify.prepare import prepare_mesh
from curvify.records import record, replaced
from curvify.simplify.moves import apart, corners_at, keeps_shapes
from curvify.simplify.polygons import shapes_of
from curvify.topology import Topology, clean_loops

#: Corners with a sine below this are flagged (3 degrees), and those below minus this are reversed.
LEAST_SINE = float(np.sin(np.radians(3.0)))
#: The corners that a cut makes must open by at least this (5 degrees) seen along the normals: 8 degrees and less tilt.
LEAST_CUT = float(np.sin(np.radians(5.0)))
#: How far a vertex that is taken away may lie from the polygons around, as a share of the mean size of polygons.
LEFT = 0.01
#: A patch whose normals lean by less than this (degrees) is planar: a straight corner does no harm there.
PLANAR = 1.0
#: Rounds of cutting and collapsing; each takes away at most one fold of a polygon.
ROUNDS = 6


@record
class Folds:
    """How the corners ``(C,)`` of a mesh open.

    ``sines`` between the two edge curves, negative where the patch folds; ``straight`` corners that may pass straight
    through: between two creases or boundaries, or in a planar patch; ``normals (C,3)`` that `refine` will use;
    ``faces (C,)``.
    """

    sines: Floats
    straight: Bools
    normals: Floats
    faces: Ints

    @property
    def reversed(self) -> Bools:
        """Corners that turn the wrong way."""
        return self.sines < -LEAST_SINE

    @property
    def flagged(self) -> Bools:
        """Corners that open too little; straight ones only where they are reversed."""
        return self.reversed | ((self.sines < LEAST_SINE) & ~self.straight)

    def polygons(self, corners: Bools) -> Bools:
        """Polygons ``(P,)`` with any of the ``corners (C,)``."""
        return np.bincount(self.faces[corners], minlength=int(self.faces[-1]) + 1) > 0


def folded_corners(mesh: PolygonMesh) -> Folds:
    """The sine ``s = (C'_k(0) x -C'_{k-1}(1)) . N / (|C'_k(0)| |C'_{k-1}(1)|)`` at the corners of a mesh.

    C_k are the curves along the sides, N the corners' normals. The mesh must be one that was simplified: no vertex
    twice in a face, no two in one place. Raises MeshError for a mesh without faces.
    """
    coarse = prepare_mesh(mesh, MeshOptions(weld="never"))
    features, topology = coarse.features(), coarse.topology
    line = features.sharp | ~topology.interior[:, None]
    ahead, behind = topology.forward, topology.forward[topology.prev]
    side, before = topology.edge, topology.edge[topology.prev]
    start, end = np.where(ahead, 0, 1), np.where(behind, 1, 0)
    out = features.tangents[side, start] * np.where(ahead, 1.0, -1.0)[:, None]
    back = features.tangents[before, end] * np.where(behind, -1.0, 1.0)[:, None]
    sines = dot(cross(out, back), features.normals)[:, 0]
    plane = unit(coarse.area)[topology.faces]
    leans = degrees_between(features.normals, plane) > PLANAR
    flat = np.bincount(topology.faces[leans], minlength=mesh.face_count) == 0
    straight = (line[side, start] & line[before, end]) | flat[topology.faces]
    return Folds(sines, straight, features.normals, topology.faces)


@record
class Unfolded:
    """A mesh without most of its folds.

    ``corners (C',)`` is the corner of the given mesh that each was, ``diagonals (C',)`` tells where a new edge leaves
    it; ``vertices (V',)`` the vertex of the given mesh that each is. ``cuts`` and ``collapses`` were made.
    """

    mesh: PolygonMesh
    corners: Ints
    diagonals: Bools
    vertices: Ints
    cuts: int = 0
    collapses: int = 0

    @classmethod
    def of(cls, mesh: PolygonMesh) -> Unfolded:
        """The mesh as it is."""
        corners = np.arange(mesh.corner_count)
        return cls(mesh, corners, np.zeros(len(corners), dtype=bool), np.arange(mesh.vertex_count))

    def then(self, later: Unfolded) -> Unfolded:
        """What was done here, and then to the result of it."""
        return Unfolded(
            later.mesh,
            self.corners[later.corners],
            later.diagonals | self.diagonals[later.corners],
            self.vertices[later.vertices],
            self.cuts + later.cuts,
            self.collapses + later.collapses,
        )


def unfold(mesh: PolygonMesh) -> Unfolded:
    """Cut and collapse until nothing helps; what still folds stays."""
    done = Unfolded.of(mesh)
    for _ in range(ROUNDS):
        step = collapse_folded(done.mesh)
        step = step.then(split_folded_corners(step.mesh))
        if not step.cuts + step.collapses:
            break
        done = done.then(step)
    return done


def split_folded_corners(mesh: PolygonMesh) -> Unfolded:
    """Cut each polygon with flagged corners by a diagonal from the worst of them.

    The diagonal is the one that keeps the four corners at its ends farthest from 0 and 180 degrees, and none that
    would bring one within 5 degrees of these, run along an edge or make a piece that is not convex.
    """
    folds = folded_corners(mesh)
    bad = folds.flagged & (mesh.face_sizes[folds.faces] > 3)
    while bad.any():
        whole = whole_faces(mesh.face_offsets, mesh.face_vertices)
        split = split_at_corners(mesh.positions, whole, bad, folds.normals, LEAST_CUT)
        shapes = shapes_of(mesh.positions, split.face_vertices, np.diff(split.face_offsets))
        wrong = np.bincount(split.source_faces, ~shapes.acceptable) > 0
        wrong &= np.bincount(split.source_faces) > 1
        if not wrong.any():
            every = np.arange(mesh.vertex_count)
            cuts = len(split.diagonal_faces)
            return Unfolded(pieces_of(mesh, split), split.source_corners, split.diagonals >= 0, every, cuts)
        bad &= ~wrong[folds.faces]
    return Unfolded.of(mesh)


# --- collapses ------------------------------------------------------------------------------------------------


def collapse_folded(mesh: PolygonMesh) -> Unfolded:
    """Move smooth vertices of two edges, and one end of the shortest edge of triangles that fold, onto a neighbor.

    Only where the topology stays, all polygons around stay convex and turned as they were, and fewer corners are
    flagged after than before. Of collapses that touch the same polygons the shortest goes first.
    """
    coarse = prepare_mesh(mesh, MeshOptions(weld="never"))
    topology, folds = coarse.topology, folded_corners(mesh)
    lines = coarse.features().sharp.any(axis=1) | ~topology.interior
    half_edges = _candidates(mesh, topology, folds, lines)
    half_edges = half_edges[_linked_simply(topology, half_edges)]
    tails, heads = topology.vertices[half_edges], topology.vertices[topology.next[half_edges]]
    left = LEFT * float(np.sqrt(np.linalg.norm(coarse.area, axis=1).mean() / 2))
    half_edges = half_edges[keeps_shapes(mesh.positions, topology, tails, heads, left)]
    for _ in range(ROUNDS):  # what does not help makes room for others
        chosen = half_edges[apart(topology, topology.vertices[half_edges])]
        result = _collapsed(mesh, topology, chosen)
        helps = _fewer_folds(topology, chosen, folds, result)
        if helps.all():
            return result
        half_edges = half_edges[~np.isin(half_edges, chosen[~helps])]
    return _collapsed(mesh, topology, chosen[helps])


def _candidates(mesh: PolygonMesh, topology: Topology, folds: Folds, lines: Bools) -> Ints:
    """Half-edges whose tails, on none of the ``lines (E,)``, may move to their heads; the shortest first."""
    twin, vertices = topology.twin, topology.vertices
    lined = np.zeros(topology.vertex_count, dtype=bool)
    lined[topology.edges[lines]] = True
    degree = np.bincount(topology.edges.reshape(-1), minlength=topology.vertex_count)
    length = np.linalg.norm(mesh.positions[vertices[topology.next]] - mesh.positions[vertices], axis=1)
    folded = folds.polygons(folds.flagged) & (topology.sizes == 3)
    least = np.minimum(length[topology.next], length[topology.prev])
    short = np.flatnonzero(folded[topology.faces] & (length <= least))
    short = np.concatenate([short, twin[short]])
    idle = np.flatnonzero(degree[vertices] == 2)
    found = distinct(np.concatenate([short[short >= 0], idle]))[0]
    found = found[(twin[found] >= 0) & ~lined[vertices[found]]]
    return found[np.lexsort((found, length[found]))]


def _linked_simply(topology: Topology, half_edges: Ints) -> Bools:
    """Half-edges that can collapse without a change of topology: the link condition (Dey et al. 1999).

    The two ends share no neighbors but the tips of triangles on the edge, and no polygons but those two.
    """
    vertices, heads = topology.vertices, topology.vertices[topology.next]
    corners, which = corners_at(topology, topology.vertices[half_edges])
    target = heads[half_edges][which]
    edges = np.sort(edge_keys(topology.edges[:, 0], topology.edges[:, 1]))
    # On an interior vertex each edge leaves one corner.
    other = heads[corners]
    common = np.bincount(which, (other != target) & is_in(edge_keys(other, target), edges), len(half_edges))
    count = np.int64(topology.vertex_count)
    owned = np.sort(topology.faces * count + vertices)
    shared = np.bincount(which, is_in(topology.faces[corners] * count + target, owned), len(half_edges))
    tips = (topology.sizes[topology.faces[half_edges]] == 3).astype(np.int64)
    tips += topology.sizes[topology.faces[topology.twin[half_edges]]] == 3
    return (common == tips) & (shared == 2)


def _collapsed(mesh: PolygonMesh, topology: Topology, half_edges: Ints) -> Unfolded:
    """The mesh with the tails of the half-edges moved to their heads."""
    tails, ends = topology.vertices[half_edges], topology.next[half_edges]
    moved = np.arange(mesh.vertex_count)
    moved[tails] = topology.vertices[ends]
    kept = moved == np.arange(len(moved))
    number = np.cumsum(kept) - 1
    normals = mesh.corner_normals
    loops = clean_loops(mesh.face_offsets, moved[mesh.face_vertices])
    if normals is not None:
        corners, which = corners_at(topology, topology.vertices[half_edges])
        normals = normals.copy()
        normals[corners] = normals[ends][which]
        normals = normals[loops.source_corners]
    changed = mesh.with_(
        positions=mesh.positions[kept],
        face_offsets=loops.offsets,
        face_vertices=number[loops.vertices],
        corner_normals=normals,
        marks=_renumbered(mesh.marks, number[moved], loops.source_faces),
    )
    return Unfolded(
        changed,
        loops.source_corners,
        np.zeros(len(loops.vertices), dtype=bool),
        np.flatnonzero(kept),
        collapses=len(half_edges),
    )


def _renumbered(marks: Marks, vertices: Ints, faces: Ints) -> Marks:
    """Marks with new numbers ``vertices (V,)`` of vertices, and for the ``faces (P',)`` that are left."""
    kinds = {"crease_edges": "crease_sharpness", "straight_edges": None, "bent_edges": "edge_normals"}
    edges = {}
    for kind, values in {**kinds, "curled_edges": "kappas"}.items():
        pairs = vertices[getattr(marks, kind)]
        left = pairs[:, 0] != pairs[:, 1]  # of an edge that collapsed nothing is left
        edges[kind] = pairs[left]
        if values is not None:
            edges[values] = getattr(marks, values)[left]
    return replaced(
        marks,
        corner_vertices=vertices[marks.corner_vertices],
        flat_faces=np.flatnonzero(np.isin(faces, marks.flat_faces)),
        **edges,
    )


def _fewer_folds(topology: Topology, half_edges: Ints, folds: Folds, result: Unfolded) -> Bools:
    """Which collapses leave fewer flagged corners in the polygons around them."""
    corners, which = corners_at(topology, topology.vertices[half_edges])
    owner = np.full(len(topology.offsets) - 1, len(half_edges))
    owner[topology.faces[corners]] = which
    after = folded_corners(result.mesh)
    count = len(half_edges) + 1
    before = np.bincount(owner[topology.faces], folds.flagged, count)
    later = np.bincount(owner[topology.faces[result.corners]], after.flagged, count)
    return (later < before)[:-1]
