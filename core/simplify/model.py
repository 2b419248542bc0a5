"""What is fitted: vertices and sector normals of a coarse mesh, and its patches as functions of them."""

from __future__ import annotations

import numpy as np

from curvify.arrays import cross, distinct
from curvify.convex import Split, split_polygons
from curvify.errors import MeshError
from curvify.mesh import Bools, Floats, Ints, PolygonMesh
from curvify.normals import perpendicular, unit
from curvify.pieces import MAX_SIDES
from curvify.prepare import Coarse, prepare_mesh
from curvify.records import record, replaced
from curvify.schemes.frames import piece_topology
from curvify.schemes.gregory import Options, is_uneven
from curvify.sectors import Features, corner_points, line_tangents
from curvify.simplify.apart import Apart, sample_triangles
from curvify.topology import Topology


@record
class State:
    """``positions (V,3)`` of the vertices and unit ``normals (S,3)`` of the sectors."""

    positions: Floats
    normals: Floats

    def moved(self, steps: Floats, tilts: Floats) -> State:
        """The state after moving vertices by ``steps (V,3)`` and tilting normals by ``tilts (S,2)``."""
        u, v = tangent_frames(self.normals)
        return State(self.positions + steps, unit(self.normals + tilts[:, :1] * u + tilts[:, 1:] * v))


def tangent_frames(normals: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors ``(S,3)`` across each unit normal."""
    u = perpendicular(normals)
    return u, cross(normals, u)


@record
class Group:
    """Patches of one kind: ``apart``, the number ``first`` of their first sample, ``vertices (f,n)`` and ``sectors
    (f,n)`` of their corners, and the sectors ``beyond (f,n,2)`` their sides.
    """

    apart: Apart
    first: int
    vertices: Ints
    sectors: Ints
    beyond: Ints

    @property
    def sample_count(self) -> int:
        """Samples of one patch."""
        return 6 * self.apart.sides + 1

    @property
    def rows(self) -> slice:
        """The samples of these patches among all."""
        return slice(self.first, self.first + len(self.vertices) * self.sample_count)

    def arrays(self, state: State) -> tuple[Floats, Floats, Floats]:
        """Points, normals and normals beyond the sides, as `Apart` takes them."""
        return state.positions[self.vertices], state.normals[self.sectors], state.normals[self.beyond]


@record
class Openings:
    """Sines ``(C,3)`` with which patches open at each corner and along the side after it, and with which the polygon
    turns there; the corners ``adjusted (C,)`` that cannot keep their normals.
    """

    sines: Floats
    adjusted: Bools


@record
class Samples:
    """Samples of all patches: ``points``, unit ``normals (M,3)``; how they open."""

    points: Floats
    normals: Floats
    openings: Openings


@record
class Model:
    """A coarse mesh as the refiner sees it, and its patches.

    ``coarse`` prepared with normals everywhere, ``sharp (E,2)`` as its features have it; ``topology`` of its convex
    pieces; ``sectors (C,)`` of their corners, numbered from 0; ``start`` the mesh as it is; ``free_vertices (V,)`` and
    ``free_sectors (S,)`` may change; ``groups`` of patches; ``sample_faces (M,)`` the piece of each sample;
    ``triangles (T,3)`` between samples.
    """

    coarse: Coarse
    sharp: Bools
    topology: Topology
    sectors: Ints
    start: State
    free_vertices: Bools
    free_sectors: Bools
    groups: list[Group]
    sample_faces: Ints
    triangles: Ints

    @property
    def face_count(self) -> int:
        """Number of pieces."""
        return len(self.topology.offsets) - 1

    @property
    def edge_length(self) -> float:
        """Mean length of the edges at the start."""
        return float(self.edge_lengths(self.start).mean())

    def edge_lengths(self, state: State) -> Floats:
        """Length of each edge ``(E,)``."""
        a, b = self.topology.edges.T
        return np.linalg.norm(state.positions[b] - state.positions[a], axis=1)

    @property
    def free_faces(self) -> Bools:
        """Pieces ``(F,)`` at which anything may change."""
        return self.faces_with(self.free_vertices[self.topology.vertices] | self.free_sectors[self.sectors])

    def faces_with(self, corners: Bools) -> Bools:
        """Pieces ``(F,)`` with any of the corners ``(C,)``."""
        return np.bincount(self.topology.faces, corners) > 0

    def at(self, state: State) -> Model:
        """The model with the lines of a state, which follow from its positions."""
        lines = line_tangents(self.coarse.topology, state.positions, self.sharp, self.coarse.marks.straight)[0]
        groups = [replaced(g, apart=replaced(g.apart, lines=lines[g.vertices])) for g in self.groups]
        return replaced(self, groups=groups)

    def openings(self, state: State) -> Openings:
        """How all patches open."""
        sines, adjusted = self._no_openings()
        for group in self.groups:
            opening, lost = group.apart.openings(*group.arrays(state))
            sines[group.apart.corners], adjusted[group.apart.corners] = opening, lost
        return Openings(sines, adjusted)

    def _no_openings(self) -> tuple[Floats, Bools]:
        count = len(self.topology.vertices)
        return np.empty((count, 3)), np.empty(count, dtype=bool)

    def samples(self, state: State) -> Samples:
        """Samples of all patches."""
        points, normals = np.empty((len(self.sample_faces), 3)), np.empty((len(self.sample_faces), 3))
        sines, adjusted = self._no_openings()
        for group in self.groups:
            at, upright, opening, lost = group.apart.with_normals(*group.arrays(state))
            points[group.rows], normals[group.rows] = at.reshape(-1, 3), upright.reshape(-1, 3)
            sines[group.apart.corners], adjusted[group.apart.corners] = opening, lost
        return Samples(points, normals, Openings(sines, adjusted))

    def mesh(self, state: State) -> PolygonMesh:
        """The coarse mesh with the positions and the normals of a state."""
        coarse = self.coarse
        mesh = coarse.mesh
        assert mesh.corner_normals is not None
        normals = mesh.corner_normals.copy()
        normals[coarse.loops.source_corners] = state.normals[distinct(coarse.sectors)[1]]
        return mesh.with_(positions=state.positions[coarse.stand_in], corner_normals=normals)


def build_model(mesh: PolygonMesh, options: Options) -> Model:
    """The model of a mesh, with the normals that the refiner resolves for it.

    Raises MeshError where edges have more than two faces.
    """
    mesh = with_resolved_normals(mesh, options)
    coarse = prepare_mesh(mesh, options)
    if coarse.topology.nonmanifold.any():
        raise MeshError("edges with more than two faces cannot be fitted; 'curvify repair' takes them apart")
    loops = coarse.loops
    split = split_polygons(
        coarse.positions, loops.offsets, loops.vertices, rule=options.split_rule, max_sides=MAX_SIDES
    )
    topology = piece_topology(coarse, split)
    features = coarse.features()
    labels, sectors = distinct(coarse.sectors)
    start = State(coarse.positions, features.unfitted[labels])
    free_vertices, free_sectors = _free(coarse, sectors, features)
    sectors = sectors[split.source_corners]
    data = _corners(coarse, features, split, topology, options)
    groups = _groups(data, topology, coarse.positions, sectors, options)
    sample_faces = np.concatenate([np.repeat(group.apart.faces, group.sample_count) for group in groups])
    triangles = np.concatenate([_triangles(group) for group in groups])
    return Model(
        coarse,
        features.sharp,
        topology,
        sectors,
        start,
        free_vertices,
        free_sectors,
        groups,
        sample_faces,
        triangles,
    )


def with_resolved_normals(mesh: PolygonMesh, options: Options) -> PolygonMesh:
    """The mesh with a normal at every corner: given ones, and those that the refiner would compute."""
    coarse = prepare_mesh(mesh, options)
    normals = np.zeros((mesh.corner_count, 3)) if mesh.corner_normals is None else mesh.corner_normals.copy()
    normals[coarse.loops.source_corners] = coarse.features().unfitted
    return mesh.with_(corner_normals=normals)


def _free(coarse: Coarse, sectors: Ints, features: Features) -> tuple[Bools, Bools]:
    """Vertices ``(V,)`` and sectors ``(S,)`` that nothing but the file's positions and normals decides.

    Flat faces and straight edges hold their corners; corner vertices and whatever else the refiner computes hold
    normals.
    """
    topology, marks = coarse.topology, coarse.marks
    if coarse.given is None:  # the normals only repeat flat faces
        return np.zeros(len(coarse.positions), dtype=bool), np.zeros(int(sectors.max()) + 1, dtype=bool)
    stiff = np.zeros(len(coarse.positions), dtype=bool)
    stiff[topology.edges[marks.straight]] = True
    flat = marks.flat[topology.faces]
    held = stiff.copy()
    held[topology.vertices[flat]] = True
    used = np.zeros(len(held), dtype=bool)
    used[topology.vertices] = True
    computed = np.abs(coarse.given - features.unfitted).max(axis=1) > 1e-9
    computed |= (features.corners | stiff)[topology.vertices] | flat
    return used & ~held, np.bincount(sectors, computed) == 0


@record
class Corners:
    """What `Apart` holds of each corner ``(C,...)`` of the pieces; see there."""

    across: Ints
    sharp: Bools
    interior: Bools
    lines: Floats
    pointed: Bools
    stiff: Bools
    weight: Floats
    bent: Floats
    straight: Bools
    beside: Floats
    bulge: Floats

    def of(self, faces: Ints, corners: Ints, options: Options, uneven: bool) -> Apart:
        """Some ``faces (f,)`` with their ``corners (f,n)``."""
        parts = {name: getattr(self, name)[corners] for name in Corners.__annotations__ if name != "bulge"}
        return Apart(
            faces=faces,
            corners=corners,
            bulge=self.bulge[corners[:, 0]],
            kind=options.cross_tangent,
            uneven=uneven,
            **parts,
        )


def _corners(coarse: Coarse, features: Features, split: Split, topology: Topology, options: Options) -> Corners:
    marks, count, at = coarse.marks, len(coarse.topology.edges), topology.vertices
    known = topology.edge < count  # the others are diagonals
    edge = np.where(known, topology.edge, 0)
    sharp = features.sharp[edge] & known[:, None]
    sharp = np.where(topology.forward[:, None], sharp, sharp[:, ::-1])
    pointed, weight = corner_points(coarse.topology, features.sharp, marks.corner)
    lines = line_tangents(coarse.topology, coarse.positions, features.sharp, marks.straight)[0]
    area = coarse.area[split.source_faces][topology.faces]
    twin, here = topology.twin, np.arange(len(topology.twin))
    inner = twin >= 0
    across = np.stack([np.where(inner, topology.next[twin], here), np.where(inner, twin, topology.next)], axis=1)
    bulge = np.where(np.isnan(marks.bulge), options.bulge, marks.bulge)[split.source_faces]
    return Corners(
        across=across,
        sharp=sharp,
        interior=inner,
        lines=lines[at],
        pointed=pointed[at],
        stiff=features.corners[at],
        weight=weight[at],
        bent=np.where(known[:, None], marks.edge_normals[edge], 0.0),
        straight=marks.straight[edge] & known,
        beside=area + np.where(inner[:, None], area[twin], area),
        bulge=bulge[topology.faces],
    )


def _groups(data: Corners, topology: Topology, positions: Floats, sectors: Ints, options: Options) -> list[Group]:
    """The pieces by number of sides, evenness and whether a side is sharp."""
    groups: list[Group] = []
    first, start = 0, topology.offsets[:-1]
    crossed = np.bincount(topology.faces, data.sharp.any(axis=1)) > 0
    for size in np.flatnonzero(np.bincount(topology.sizes)):
        faces = np.flatnonzero(topology.sizes == size)
        corners = start[faces][:, None] + np.arange(size)
        points = np.moveaxis(positions[topology.vertices[corners]], 2, 0)
        kinds = 2 * is_uneven(points) + crossed[faces]
        for kind in np.flatnonzero(np.bincount(kinds)):
            rows = np.flatnonzero(kinds == kind)
            apart = data.of(faces[rows], corners[rows], options, bool(kind >= 2))
            group = Group(apart, first, topology.vertices[apart.corners], sectors[apart.corners], sectors[apart.across])
            groups.append(group)
            first = group.rows.stop
    return groups


def _triangles(group: Group) -> Ints:
    """Triangles ``(t,3)`` between the samples of a group's patches."""
    starts = group.first + group.sample_count * np.arange(len(group.vertices))
    return (starts[:, None, None] + sample_triangles(group.apart.sides)).reshape(-1, 3)
