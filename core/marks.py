"""Sharp features and shape controls from every source, weighed against each other, on the loops of one mesh.

Sources, strongest first: marks that the caller gives, tags of the file, corner normals that differ across an edge,
smoothing groups, and an angle between faces. For each edge the strongest source that names it decides whether it is a
crease. Source of the kinds: Leung, Wang, Zhang, section 3 (docs/sharp-features.md).
"""

from __future__ import annotations

import numpy as np

from curvify.arrays import distinct, take_rows
from curvify.mesh import Bools, Floats, Ints, Marks, PolygonMesh
from curvify.normals import SAME_NORMAL, degrees_between
from curvify.options import MeshOptions
from curvify.records import field, record
from curvify.topology import Loops, Topology, corner_links
from curvify.words import count_of

#: Flat faces side by side that turn by less than this are one plane (degrees).
COPLANAR = 0.01
#: The mesh's own sources, strongest first.
OWN_SOURCES = ("tags", "normals", "groups", "angle")


@record
class ResolvedMarks:
    """What all sources together say about a mesh of E edges, V vertices and F faces.

    ``crease (E,2)`` sharpness in 0..1 at the ends in canonical direction, 0 where smooth; ``named (E,)``, where a mark
    or tag decided that, and ``rims (E,)``, where a flat face did; ``straight (E,)``;
    ``edge_normals (E,3)`` as given, zero where none; ``kappa (E,)``, NaN where none; ``corner (V,)`` sharpness in
    0..1; ``flat (F,)``; ``bulge (F,)``, ``alpha (F,)``, NaN where the scheme's own holds. ``counts`` has the number
    of marks of each kind by source; those of ``normals``, ``groups`` and ``angle`` are creases that they decided.
    """

    crease: Floats
    named: Bools
    rims: Bools
    straight: Bools
    edge_normals: Floats
    kappa: Floats
    corner: Floats
    flat: Bools
    bulge: Floats
    alpha: Floats
    counts: dict[str, dict[str, int]] = field(default_factory=dict)

    @classmethod
    def none(cls, edges: int, vertices: int, faces: int) -> ResolvedMarks:
        """A mesh without marks."""
        return cls(
            np.zeros((edges, 2)),
            np.zeros(edges, dtype=bool),
            np.zeros(edges, dtype=bool),
            np.zeros(edges, dtype=bool),
            np.zeros((edges, 3)),
            np.full(edges, np.nan),
            np.zeros(vertices),
            np.zeros(faces, dtype=bool),
            np.full(faces, np.nan),
            np.full(faces, np.nan),
        )


def own_sources(sharp_from: str) -> tuple[str, ...]:
    """The mesh's own sources that count with an option ``sharp_from``, strongest first."""
    return OWN_SOURCES if sharp_from == "auto" else tuple(name for name in OWN_SOURCES if name == sharp_from)


def explicit_marks(mesh: PolygonMesh, options: MeshOptions) -> dict[str, Marks]:
    """The marks of the caller and of the file that count, strongest first."""
    found = {"marks": options.marks}
    if "tags" in own_sources(options.sharp_from):
        found["tags"] = mesh.marks
    return {name: marks for name, marks in found.items() if marks is not None and marks.counts()}


def hole_faces(mesh: PolygonMesh, options: MeshOptions) -> Bools:
    """Faces ``(F,)`` of the mesh that are marked as holes."""
    holes = np.zeros(mesh.face_count, dtype=bool)
    for marks in explicit_marks(mesh, options).values():
        holes[marks.hole_faces] = True
    return holes


def gather_marks(
    mesh: PolygonMesh,
    options: MeshOptions,
    topology: Topology,
    loops: Loops,
    stand_in: Ints,
    area: Floats,
    given: Floats | None,
) -> tuple[ResolvedMarks, list[str]]:
    """Weigh all sources; also what there is to warn of.

    ``stand_in (V,)`` is the vertex that each was welded to, ``area (F,3)`` are area vectors of the loops, ``given
    (C,3)`` unit normals of their corners, zero where the file has none, or None where they say nothing.
    """
    resolved = ResolvedMarks.none(len(topology.edges), len(stand_in), len(loops.source_faces))
    explicit = explicit_marks(mesh, options)
    if not explicit and given is None and mesh.face_smoothing is None and options.sharp_angle is None:
        return resolved, []
    decided = np.zeros(len(topology.edges), dtype=bool)
    lost: list[tuple[int, int]] = []
    for marks in reversed(explicit.values()):
        _take_shapes(resolved, marks, topology, loops, stand_in, lost)
    for name, marks in explicit.items():
        resolved.counts[name] = marks.counts()
        _take_creases(resolved.crease, decided, marks, topology, stand_in, lost)
        resolved.named |= decided & ~resolved.rims
        rims = _flat_rims(topology, area, resolved.flat, np.isin(loops.source_faces, marks.flat_faces)) & ~decided
        _decide(resolved.crease, decided, rims, np.ones(2))
        resolved.rims |= rims
    notes = _note_lost(lost)
    sources = own_sources(options.sharp_from)
    if given is not None and "normals" in sources:
        ends, known = _normal_creases(topology, given)
        resolved.counts["normals"] = {"crease": _decide(resolved.crease, decided, known, ends)}
    if mesh.face_smoothing is not None and "groups" in sources:
        sharp, note = _group_creases(topology, mesh.face_smoothing[loops.source_faces])
        notes += note
        found = _decide(resolved.crease, decided, topology.interior, sharp[:, None] * np.ones(2))
        resolved.counts["groups"] = {"crease": found}
    if options.sharp_angle is not None:
        sharp = _turns(topology, area) > options.sharp_angle
        free = topology.interior & ~decided
        found = _decide(resolved.crease, decided, topology.interior, sharp[:, None] * np.ones(2))
        resolved.counts["angle"] = {"crease": found}
        if not free.any():
            notes.append("--sharp-angle has no say: stronger sources decide every edge; see --sharp-from angle")
    return resolved, notes


def _decide(crease: Floats, decided: Bools, named: Bools, sharpness: Floats) -> int:
    """Set the ``sharpness (E,2)`` of the edges ``named (E,)`` that no stronger source decided; returns how many
    creases that makes.
    """
    new = named & ~decided
    crease[new] = np.broadcast_to(sharpness, crease.shape)[new]
    decided |= named
    return int(crease[new].any(axis=1).sum())


# --- marks of the caller and of the file ----------------------------------------------------------------------


def find_edges(topology: Topology, pairs: Ints) -> tuple[Ints, Bools]:
    """Edge ``(m,)`` between each of the vertex pairs ``(m,2)``, -1 where there is none, and whether the pair runs
    against its canonical direction ``(m,)``.
    """
    count = topology.vertex_count
    keys = topology.edges.min(axis=1) * count + topology.edges.max(axis=1)
    wanted = pairs.min(axis=1) * count + pairs.max(axis=1)
    place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    found = np.where(keys[place] == wanted, place, -1)
    return found, topology.edges[place, 0] != pairs[:, 0]


def _located(
    pairs: Ints, topology: Topology, stand_in: Ints, lost: list[tuple[int, int]]
) -> tuple[Ints, Bools, Bools]:
    """Edges of the pairs that have one, which those are ``(m,)``, and whether they are turned."""
    if not len(pairs):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
    edges, turned = find_edges(topology, stand_in[pairs])
    there = edges >= 0
    lost += [(int(a), int(b)) for a, b in pairs[~there]]
    return edges[there], there, turned[there]


def _take_creases(
    crease: Floats, decided: Bools, marks: Marks, topology: Topology, stand_in: Ints, lost: list[tuple[int, int]]
) -> None:
    edges, there, turned = _located(marks.crease_edges, topology, stand_in, lost)
    if not len(edges):
        return
    sharpness = marks.crease_sharpness[there]
    values, named = np.zeros_like(crease), np.zeros_like(decided)
    values[edges] = np.where(turned[:, None], sharpness[:, ::-1], sharpness)
    named[edges] = True
    _decide(crease, decided, named, values)


def _take_shapes(
    resolved: ResolvedMarks,
    marks: Marks,
    topology: Topology,
    loops: Loops,
    stand_in: Ints,
    lost: list[tuple[int, int]],
) -> None:
    """All marks but creases, over those of weaker sources."""
    resolved.straight[_located(marks.straight_edges, topology, stand_in, lost)[0]] = True
    edges, there, _ = _located(marks.bent_edges, topology, stand_in, lost)
    resolved.edge_normals[edges] = marks.edge_normals[there]
    edges, there, _ = _located(marks.curled_edges, topology, stand_in, lost)
    resolved.kappa[edges] = marks.kappas[there]
    resolved.corner[stand_in[marks.corner_vertices]] = marks.corner_sharpness
    resolved.flat |= np.isin(loops.source_faces, marks.flat_faces)
    for values, faces, given in (
        (resolved.bulge, marks.bulged_faces, marks.bulges),
        (resolved.alpha, marks.full_faces, marks.alphas),
    ):
        if len(faces):
            of_face = np.full(max(int(faces.max()), int(loops.source_faces.max())) + 1, np.nan)
            of_face[faces] = given
            own = of_face[loops.source_faces]
            values[~np.isnan(own)] = own[~np.isnan(own)]


def _note_lost(lost: list[tuple[int, int]]) -> list[str]:
    if not lost:
        return []
    a, b = lost[0]
    number = len(set(lost))
    return [f"{count_of(number, 'mark is', 'marks are')} on vertices that no edge joins, first: {a}-{b}; ignored"]


def _flat_rims(topology: Topology, area: Floats, flat: Bools, chosen: Bools) -> Bools:
    """Interior edges ``(E,)`` of the faces ``chosen (F,)``, but for those between ``flat (F,)`` ones in one plane."""
    rims = np.zeros(len(topology.edges), dtype=bool)
    if chosen.any():
        faces = topology.faces
        rims[topology.edge[chosen[faces]]] = True
        one = np.flatnonzero(topology.twin >= 0)
        other = topology.twin[one]
        both = flat[faces[one]] & flat[faces[other]]
        one, other = one[both], other[both]
        plane = degrees_between(area[faces[one]], area[faces[other]]) < COPLANAR
        rims[topology.edge[one[plane]]] = False
    return rims & topology.interior


def found_marks(resolved: ResolvedMarks, topology: Topology, loops: Loops, holes: Bools) -> Marks:
    """What was found, by vertices and faces of the mesh: alone, it makes the same features.

    Not listed are the creases round flat faces, which these bring along. ``holes (F,)`` are faces of the mesh.
    """
    sharp = topology.interior & resolved.crease.any(axis=1)
    creases = np.flatnonzero((sharp | resolved.named) & ~resolved.rims)
    bent = np.flatnonzero(resolved.edge_normals.any(axis=1))
    curled = np.flatnonzero(~np.isnan(resolved.kappa))
    corners = np.flatnonzero(resolved.corner > 0)
    bulged, full = (np.flatnonzero(~np.isnan(values)) for values in (resolved.bulge, resolved.alpha))
    return Marks(
        crease_edges=topology.edges[creases],
        crease_sharpness=resolved.crease[creases],
        straight_edges=topology.edges[resolved.straight],
        corner_vertices=corners,
        corner_sharpness=resolved.corner[corners],
        flat_faces=loops.source_faces[resolved.flat],
        hole_faces=np.flatnonzero(holes),
        bent_edges=topology.edges[bent],
        edge_normals=resolved.edge_normals[bent],
        curled_edges=topology.edges[curled],
        kappas=resolved.kappa[curled],
        bulged_faces=loops.source_faces[bulged],
        bulges=resolved.bulge[bulged],
        full_faces=loops.source_faces[full],
        alphas=resolved.alpha[full],
    )


# --- what the mesh says without words -------------------------------------------------------------------------


def _normal_creases(topology: Topology, given: Floats) -> tuple[Floats, Bools]:
    """Ends ``(E,2)`` at which the two faces' normals differ, 1 there, and the edges ``(E,)`` where both have some."""
    a, b = corner_links(topology)
    one = np.flatnonzero(topology.twin > np.arange(len(topology.twin)))
    edges, start = topology.edge[one], np.where(topology.forward[one], 0, 1)
    left, right = take_rows(given, a), take_rows(given, b)
    differ = (left[:, 0] != right[:, 0]) | (left[:, 1] != right[:, 1]) | (left[:, 2] != right[:, 2])
    differ[differ] = degrees_between(left[differ], right[differ]) > SAME_NORMAL
    ends = np.zeros((len(topology.edges), 2))
    ends[edges, start] = differ[: len(one)]
    ends[edges, 1 - start] = differ[len(one) :]
    known = np.zeros(len(topology.edges), dtype=bool)
    there: Bools = np.any(given, axis=1)
    known[edges] = (there[a] & there[b]).reshape(2, -1).all(axis=0)
    return ends, known


def _sides(topology: Topology) -> tuple[Ints, Ints, Ints]:
    """The interior edges ``(I,)`` and the faces on their two sides ``(I,)``."""
    one = np.flatnonzero(topology.twin > np.arange(len(topology.twin)))
    faces = topology.faces
    return topology.edge[one], faces[one], faces[topology.twin[one]]


def _turns(topology: Topology, area: Floats) -> Floats:
    """Angle ``(E,)`` in degrees by which the faces turn at each edge, 0 on boundaries and beside faces without area."""
    edges, one, other = _sides(topology)
    turns = np.zeros(len(topology.edges))
    sized = area[one].any(axis=1) & area[other].any(axis=1)
    turns[edges[sized]] = degrees_between(area[one[sized]], area[other[sized]])
    return turns


def _group_creases(topology: Topology, groups: Ints) -> tuple[Bools, list[str]]:
    """Edges ``(E,)`` between faces of different smoothing groups ``(F,)``; a face in group 0 is smooth with none."""
    edges, one, other = _sides(topology)
    flags = are_bit_flags(groups)
    a, b = groups[one], groups[other]
    sharp = np.zeros(len(topology.edges), dtype=bool)
    sharp[edges] = (a & b) == 0 if flags else (a != b) | (a == 0)
    note = "smoothing groups are read as bit flags: a face may be in several, and is smooth with all of them"
    return sharp, [note] if flags else []


def are_bit_flags(groups: Ints) -> bool:
    """Whether the numbers of smoothing groups ``(F,)`` are sums of flags, one for each of several groups of a face.

    Plain numbers count up from 1. Flags leave gaps: at most half of the numbers up to the largest occur, and each
    bit of a sum occurs in another number too, or the sum would join nothing.
    """
    numbers = distinct(groups[groups > 0])[0]
    if not len(numbers) or 2 * len(numbers) > numbers[-1]:
        return False
    bits = (numbers[:, None] >> np.arange(62)) & 1
    sums = bits.sum(axis=1) > 1
    shared = bits.sum(axis=0) > 1
    return bool(sums.any()) and bool(shared[bits[sums].any(axis=0)].all())
