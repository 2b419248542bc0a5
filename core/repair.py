"""Mending meshes: what ``prepare_mesh`` only warns of, with polygons, attributes and marks kept.

Libraries that repair (pymeshlab, trimesh) take triangles without texture coordinates per corner; everything here is
a choice of loops instead. In turn: seams are closed, faces without three distinct corners or without area go, of faces
on the same vertices one stays or, in a wall between two bodies, none; neighbors are turned to one side; faces at an
edge of more than two are paired by angle, so that bodies that touch come apart; vertices where surfaces only touch
are repeated; closed pieces are turned outside out; small holes are closed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from curvify.arrays import distinct
from curvify.errors import MeshError
from curvify.inspection import same_loops
from curvify.mesh import Bools, Floats, Ints, Marks, PolygonMesh
from curvify.normals import unit
from curvify.options import MeshOptions
from curvify.polygons import newell_normals
from curvify.prepare import prepare_mesh
from curvify.records import replaced
from curvify.topology import Loops, Topology, build_topology, components, fans
from curvify.words import count_of


@dataclass(eq=False)
class _Work:
    """The mesh on its way: ``loops``, and ``positions (V,3)`` with repeats of the vertices ``origin (V,)`` at the end;
    ``flipped (F,)`` the loops that were turned. ``notes`` say what was done.
    """

    positions: Floats
    origin: Ints
    loops: Loops
    flipped: Bools
    notes: list[str] = field(default_factory=list)

    def topology(self) -> Topology:
        """Edges and neighbors as they are now."""
        return build_topology(self.positions, self.loops.offsets, self.loops.vertices)

    def keep(self, faces: Bools) -> None:
        """Drop the other faces."""
        loops = self.loops
        corners = np.repeat(faces, np.diff(loops.offsets))
        offsets = np.concatenate([[0], np.cumsum(np.diff(loops.offsets)[faces])])
        self.loops = Loops(offsets, loops.vertices[corners], loops.source_corners[corners], loops.source_faces[faces])
        self.flipped = self.flipped[faces]

    def flip(self, faces: Bools) -> None:
        """Turn faces around; each keeps its first corner."""
        loops = self.loops
        sizes = np.diff(loops.offsets)
        start, size = np.repeat(loops.offsets[:-1], sizes), np.repeat(sizes, sizes)
        corner = np.arange(len(loops.vertices))
        order = np.where(np.repeat(faces, sizes), start + (size - (corner - start)) % size, corner)
        self.loops = replaced(loops, vertices=loops.vertices[order], source_corners=loops.source_corners[order])
        self.flipped = self.flipped ^ faces


def repair_mesh(mesh: PolygonMesh, weld: str = "auto", holes: int = 0) -> tuple[PolygonMesh, list[str]]:
    """The mesh mended, and a sentence for each kind of thing that was done.

    ``weld`` as in ``MeshOptions``. Boundary loops of up to ``holes`` edges are closed, each by one polygon.
    Positions stay; vertices that are in no face go, so that ids change. Raises MeshError for a mesh without faces.
    """
    coarse = prepare_mesh(mesh, MeshOptions(weld=weld, sharp_from="none"))  # no marks: holes stay
    work = _Work(coarse.positions, np.arange(len(coarse.positions)), coarse.loops, np.zeros(len(coarse.area), bool))
    _note(work, mesh.face_count - len(coarse.area), "face with fewer than 3 distinct corners", "removed")
    bad = coarse.without_area
    _note(work, int(bad.sum()), "face without area", "removed")
    work.keep(~bad)
    if not len(work.loops.source_faces):
        raise MeshError("no face has an area; there is nothing to mend")
    _drop_duplicates(work)
    _orient(work)
    _split_vertices(work)
    _turn_outside_out(work)
    mended = _as_mesh(mesh, work)
    if holes >= 3:
        mended = _close_holes(mended, holes, work)
    if coarse.counts["welded_vertices"]:
        work.notes.insert(0, f"{count_of(coarse.counts['welded_vertices'], 'vertex', 'vertices')} closed into seams")
    return mended, work.notes


def _note(work: _Work, number: int, what: str, done: str, plural: str | None = None) -> None:
    if number:
        first, _, rest = what.partition(" ")
        many = plural or " ".join(part for part in (first + "s", rest) if part)
        work.notes.append(f"{count_of(number, what, many)} {done}")


# --- duplicates -------------------------------------------------------------------------------------------------


def _drop_duplicates(work: _Work) -> None:
    """Of faces on the same vertices the first stays. Two that run opposite ways within other faces are a wall between
    two bodies that are one without it: both go.
    """
    first = same_loops(work.loops)
    if (first == np.arange(len(first))).all():
        return
    topology = work.topology()
    way = _directions(topology)
    again = distinct(2 * first + way)[1]
    fresh = np.full(again.max() + 1, len(first))
    np.minimum.at(fresh, again, np.arange(len(first)))
    kept = fresh[again] == np.arange(len(first))  # the first of each direction
    paired = kept & (np.bincount(first[kept], minlength=len(first))[first] == 2)
    walls = _walls(topology, paired)
    second = kept & ~walls & (first != np.arange(len(first)))
    _note(work, int((~kept | second).sum()), "face on the vertices of another", "removed", "faces on others' vertices")
    _note(work, int(walls.sum()), "face of walls inside", "removed")
    work.keep(kept & ~walls & ~second)


def _directions(topology: Topology) -> Ints:
    """Whether each face ``(F,)`` runs along its edge of the smallest number in that edge's direction: 0 or 1."""
    smallest = np.minimum.reduceat(topology.edge, topology.offsets[:-1])
    corners = np.flatnonzero(topology.edge == np.repeat(smallest, topology.sizes))
    way = np.zeros(len(topology.sizes), dtype=np.int64)
    way[topology.faces[corners]] = topology.forward[corners]
    return way


def _walls(topology: Topology, paired: Bools) -> Bools:
    """Which of the ``paired (F,)`` faces are walls: they hang together with some that share an edge with others."""
    faces, count = topology.faces, len(topology.sizes)
    corners = np.flatnonzero(paired[faces])
    corners = corners[np.argsort(topology.edge[corners], kind="stable")]
    beside = topology.edge[corners[1:]] == topology.edge[corners[:-1]]
    label = components(count, faces[corners[:-1]][beside], faces[corners[1:]][beside])
    others = np.bincount(topology.edge[~paired[faces]], minlength=len(topology.edges)) > 0
    touching = np.zeros(count, dtype=bool)
    touching[label[faces[corners[others[topology.edge[corners]]]]]] = True
    return paired & touching[label]


# --- orientation ------------------------------------------------------------------------------------------------


def _orient(work: _Work) -> None:
    """Turn neighbors to one side: in each piece the side that most of the area shows.

    Every face is two nodes, as it is and turned. An edge of two faces joins the nodes that run opposite ways along it:
    the two components of a piece are its two orientations. Where they are one, the piece has a single side.
    """
    topology = work.topology()
    count, faces = len(topology.sizes), topology.faces
    one, other = _pairs(topology)
    turn = topology.forward[one] == topology.forward[other]
    a, b = faces[one], faces[other]
    label = components(
        2 * count, np.concatenate([a, a + count]), np.concatenate([b + turn * count, b + ~turn * count])
    )
    as_is, turned = label[:count], label[count:]
    single = as_is == turned
    area = np.linalg.norm(newell_normals(work.positions, work.loops.offsets, work.loops.vertices), axis=1)
    # Of the two orientations of a piece, the one with more area as it is; the smaller label where they are equal.
    weight = np.bincount(as_is, area, minlength=2 * count)
    flip = ~single & ((weight[as_is] < weight[turned]) | ((weight[as_is] == weight[turned]) & (as_is > turned)))
    _note(work, int(flip.sum()), "face", "turned to the side of the others")
    odd = len(np.flatnonzero(np.bincount(as_is[single], minlength=1)))
    _note(work, odd, "piece with one side only", "cut where its ends meet", "pieces with one side only")
    work.flip(flip)


def _pairs(topology: Topology) -> tuple[Ints, Ints]:
    """The two half-edges of each edge that has two, whichever way they run."""
    corners = np.flatnonzero(topology.uses[topology.edge] == 2)
    order = corners[np.argsort(topology.edge[corners], kind="stable")].reshape(-1, 2)
    return order[:, 0], order[:, 1]


# --- where surfaces only touch ----------------------------------------------------------------------------------


def _split_vertices(work: _Work) -> None:
    """Give every fan a vertex of its own, once the faces at crowded edges are paired."""
    topology = work.topology()
    crowded = topology.uses > 2
    twin = _paired_twins(work, topology, crowded)
    around = fans(replaced(topology, twin=twin))
    leaders = np.flatnonzero(np.bincount(around, minlength=len(around)))
    order = leaders[np.argsort(topology.vertices[leaders], kind="stable")]
    owner = topology.vertices[order]
    more = np.concatenate([[False], owner[1:] == owner[:-1]])
    if not more.any():
        return
    number = np.empty(len(around), dtype=np.int64)
    number[order] = np.where(more, len(work.positions) + np.cumsum(more) - 1, owner)
    work.origin = np.concatenate([work.origin, work.origin[owner[more]]])
    work.positions = work.positions[np.concatenate([np.arange(len(work.positions)), owner[more]])]
    work.loops = replaced(work.loops, vertices=number[around])
    _note(work, int(crowded.sum()), "edge of more than two faces", "taken apart", "edges of more than two faces")
    _note(work, int(more.sum()), "vertex", "repeated where surfaces only touch", "vertices")


def _paired_twins(work: _Work, topology: Topology, crowded: Bools) -> Ints:
    """Twins ``(C,)`` that also pair the faces at crowded edges around each solid between them.

    Seen along the edge, a face that runs with it has the solid on the side of smaller angles, one that runs against it
    on the side of larger ones: sorted by angle, one against and the next one with the edge enclose a solid.
    """
    twin = topology.twin.copy()
    corners = np.flatnonzero(crowded[topology.edge])
    if not len(corners):
        return twin
    edge, forward = topology.edge[corners], topology.forward[corners]
    ends = work.positions[topology.edges[edge]]
    along = unit(ends[:, 1] - ends[:, 0])
    normals = newell_normals(work.positions, topology.offsets, topology.vertices)[topology.faces[corners]]
    inward = unit(np.cross(normals, np.where(forward, 1.0, -1.0)[:, None] * along))
    axis = np.eye(3)[np.abs(along).argmin(axis=1)]
    right = unit(np.cross(axis, along))
    up = np.cross(along, right)
    angle = np.arctan2(np.einsum("ni,ni->n", inward, up), np.einsum("ni,ni->n", inward, right))
    order = np.lexsort((~forward, np.round(angle, 9), edge))
    ring = edge[order]
    starts = np.flatnonzero(np.concatenate([[True], ring[1:] != ring[:-1]]))
    following = np.arange(1, len(ring) + 1)
    following[np.append(starts[1:], len(ring)) - 1] = starts
    opens, closes = ~forward[order], forward[order][following]
    first = order[opens & closes]
    second = order[following[opens & closes]]
    twin[corners[first]], twin[corners[second]] = corners[second], corners[first]
    return twin


# --- outside out ------------------------------------------------------------------------------------------------


def _turn_outside_out(work: _Work) -> None:
    """Turn closed pieces with a negative volume, except those inside the bounds of another: they are its cavities."""
    topology = work.topology()
    joined = np.flatnonzero(topology.twin >= 0)
    faces, count = topology.faces, len(topology.sizes)
    label = components(count, faces[joined], faces[topology.twin[joined]])
    open_ = np.zeros(count, dtype=bool)
    open_[label[faces[topology.twin < 0]]] = True
    pieces = np.flatnonzero((label == np.arange(count)) & ~open_)
    if not len(pieces):
        return
    area = newell_normals(work.positions, topology.offsets, topology.vertices) / topology.sizes[:, None]
    points = work.positions[topology.vertices] - work.positions.mean(axis=0)
    volume = np.bincount(label[faces], np.einsum("ci,ci->c", points, area[faces]), minlength=count)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, label[faces], points)
    np.maximum.at(high, label[faces], points)
    inside_out = pieces[volume[pieces] < 0]
    within = [
        bool(((low[pieces] < low[piece]) & (high[pieces] > high[piece])).all(axis=1).any()) for piece in inside_out
    ]
    turned = inside_out[~np.array(within, dtype=bool)]
    _note(work, len(turned), "closed piece", "turned outside out")
    work.flip(np.isin(label, turned))


# --- the result -------------------------------------------------------------------------------------------------


def _as_mesh(mesh: PolygonMesh, work: _Work) -> PolygonMesh:
    """The mesh of the loops with what its corners and faces carried; vertices in no face are left out."""
    loops, corners, faces = work.loops, work.loops.source_corners, work.loops.source_faces
    used = np.flatnonzero(np.bincount(loops.vertices, minlength=len(work.positions)))
    gone = mesh.vertex_count - len(np.flatnonzero(np.bincount(mesh.face_vertices, minlength=mesh.vertex_count)))
    _note(work, gone, "vertex in no face", "removed", "vertices in no face")
    number = np.full(len(work.positions), -1)
    number[used] = np.arange(len(used))
    normals = None if mesh.corner_normals is None else mesh.corner_normals[corners]
    if normals is not None:
        normals = normals * np.where(np.repeat(work.flipped, np.diff(loops.offsets)), -1.0, 1.0)[:, None]

    def carried(values: Any, rows: Ints) -> Any:
        return None if values is None else values[rows]

    return mesh.with_(
        positions=work.positions[used],
        face_offsets=loops.offsets,
        face_vertices=number[loops.vertices],
        corner_normals=normals,
        corner_uvs=carried(mesh.corner_uvs, corners),
        vertex_colors=carried(mesh.vertex_colors, work.origin[used]),
        face_materials=carried(mesh.face_materials, faces),
        face_groups=carried(mesh.face_groups, faces),
        face_smoothing=carried(mesh.face_smoothing, faces),
        marks=_marks(mesh.marks, mesh, work, number),
    )


def _marks(marks: Marks, mesh: PolygonMesh, work: _Work, number: Ints) -> Marks:
    """Marks by the new ids; those of vertices and faces that are gone go too, and a repeated vertex keeps them once."""
    vertices = np.full(mesh.vertex_count, -1)
    vertices[mesh.face_vertices[work.loops.source_corners]] = number[work.loops.vertices]
    faces = np.full(mesh.face_count, -1)
    faces[work.loops.source_faces] = np.arange(len(work.loops.source_faces))
    changes: dict[str, Any] = {}
    for ids, values, new in (
        ("crease_edges", "crease_sharpness", vertices),
        ("straight_edges", "", vertices),
        ("bent_edges", "edge_normals", vertices),
        ("curled_edges", "kappas", vertices),
        ("corner_vertices", "corner_sharpness", vertices),
        ("flat_faces", "", faces),
        ("hole_faces", "", faces),
        ("bulged_faces", "bulges", faces),
        ("full_faces", "alphas", faces),
    ):
        moved = new[getattr(marks, ids)]
        kept = (moved >= 0) if moved.ndim == 1 else (moved >= 0).all(axis=1)
        changes[ids] = moved[kept]
        if values:
            changes[values] = getattr(marks, values)[kept]
    return replaced(marks, **changes)


# --- holes ------------------------------------------------------------------------------------------------------


def _close_holes(mesh: PolygonMesh, most: int, work: _Work) -> PolygonMesh:
    """The mesh with a polygon in each boundary loop of up to ``most`` edges, of the material of a neighbor."""
    topology = build_topology(mesh.positions, mesh.face_offsets, mesh.face_vertices)
    rims = [rim for rim in boundary_loops(topology) if len(rim) <= most]
    _note(work, len(rims), "hole", "closed")
    if not rims:
        return mesh
    beside = topology.faces[np.array([rim[0] for rim in rims])]
    corners = np.concatenate([topology.vertices[rim] for rim in rims])
    sizes = np.array([len(rim) for rim in rims])

    def empty(values: Any) -> Any:
        return None if values is None else np.concatenate([values, np.full((len(corners), values.shape[1]), np.nan)])

    def taken(values: Any) -> Any:
        return None if values is None else np.concatenate([values, values[beside]])

    return mesh.with_(
        face_offsets=np.concatenate([mesh.face_offsets, mesh.face_offsets[-1] + np.cumsum(sizes)]),
        face_vertices=np.concatenate([mesh.face_vertices, corners]),
        corner_normals=empty(mesh.corner_normals),
        corner_uvs=empty(mesh.corner_uvs),
        face_materials=taken(mesh.face_materials),
        face_groups=taken(mesh.face_groups),
        face_smoothing=taken(mesh.face_smoothing),
    )


def boundary_loops(topology: Topology) -> list[Ints]:
    """Open half-edges of each boundary loop, so ordered that their tails run counter-clockwise around the hole.

    Every vertex must have one fan. The loop with the smallest half-edge comes first.
    """
    open_ = np.flatnonzero(topology.twin < 0)
    by_head = dict(zip(topology.vertices[topology.next[open_]].tolist(), open_.tolist(), strict=True))
    left, rims = dict.fromkeys(open_.tolist()), []
    while left:
        rim = [next(iter(left))]
        del left[rim[0]]
        while (before := by_head[int(topology.vertices[rim[-1]])]) in left:
            rim.append(before)
            del left[before]
        rims.append(np.array(rim))
    return rims
