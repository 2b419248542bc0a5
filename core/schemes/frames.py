"""Pieces of faces and what their edges must do, before a scheme draws its curves."""

from __future__ import annotations

import numpy as np

from curvify.arrays import ranking, take_rows
from curvify.convex import Split
from curvify.edges import Directions, bending_normals, smooth_tangents
from curvify.mesh import Bools, Floats, Ints
from curvify.polygons import newell_normals
from curvify.prepare import Coarse
from curvify.records import record
from curvify.sectors import Features, end_normals
from curvify.topology import Topology, link_half_edges


@record
class Frame:
    """Pieces of faces and what their edges must do, before a scheme draws its curves.

    ``topology`` of the pieces; ``normals (C,3)`` of their corners; per edge, in canonical direction, ``start``, ``end
    (E,3)``, unit end ``tangents (E,2,3)`` and ``bending (E,3)``. Then the edges' sides: ``side_field (C,)`` numbers
    them for every half-edge; ``half_edges (N,)`` names one half-edge of each and ``pairs (N,2,3)`` its end normals in
    canonical direction. The first E are those of the edges' first half-edges; half-edges with other normals, on
    creases, have one of their own.
    """

    topology: Topology
    normals: Floats
    start: Floats
    end: Floats
    tangents: Floats
    bending: Floats
    side_field: Ints
    half_edges: Ints
    pairs: Floats

    @property
    def side_edges(self) -> Ints:
        """Edge of each side ``(N,)``."""
        return self.topology.edge[self.half_edges]


def edge_frame(
    coarse: Coarse,
    features: Features,
    split: Split,
    directions: Directions = smooth_tangents,
    apart: Bools | None = None,
) -> Frame:
    """The frame of the pieces: the features' tangents on the mesh's edges, ``directions`` on diagonals.

    The half-edges of edges ``apart (E,)`` of the mesh have a side each, also where their normals agree.
    """
    positions, base = coarse.positions, coarse.topology
    topology = piece_topology(coarse, split)
    normals = take_rows(features.normals, split.source_corners)
    count = len(base.edges)
    first = topology.first
    ends = end_normals(topology, normals, first)
    start, end = take_rows(positions, topology.edges[:, 0]), take_rows(positions, topology.edges[:, 1])
    tangents, bending = features.tangents, features.bending
    if len(topology.edges) > count:
        a, b = ends[count:, 0], ends[count:, 1]
        chord = (end - start)[count:]
        area = newell_normals(positions, split.face_offsets, split.face_vertices)[topology.faces[first[count:]]]
        extra = bending_normals(chord, a, b, area)
        across = np.stack([directions(chord, n, extra) for n in (a, b)], axis=1)
        tangents, bending = np.concatenate([tangents, across]), np.concatenate([bending, extra])
    each = np.zeros(len(topology.edges), dtype=bool)
    if apart is not None:
        each[:count] = apart
    side_field, half_edges, pairs = _sides(topology, normals, first, ends, each)
    return Frame(topology, normals, start, end, tangents, bending, side_field, half_edges, pairs)


def _sides(topology: Topology, normals: Floats, first: Ints, ends: Floats, each: Bools) -> tuple[Ints, Ints, Floats]:
    """Sides of edges as in `Frame`: those of the ``first (E,)`` half-edges have the end normals ``ends (E,2,3)``; edges
    of which ``each`` half-edge needs a side of its own.
    """
    side_field = topology.edge.copy()
    some = np.zeros(topology.vertex_count, dtype=np.int64)
    some[topology.vertices] = np.arange(len(normals))
    several = (normals != take_rows(normals, some[topology.vertices])).any(axis=1)
    if not several.any() and not each.any():
        return side_field, first, ends
    split = np.zeros(topology.vertex_count, dtype=bool)
    split[topology.vertices[several]] = True
    near = np.flatnonzero(split[topology.vertices] | split[topology.vertices[topology.next]] | each[topology.edge])
    own, edge = end_normals(topology, normals, near), topology.edge[near]
    differs = (own != ends[edge]).any(axis=(1, 2)) | (each[edge] & (near != first[edge]))
    own, near = own[differs], near[differs]
    order = ranking(topology.edge[near])
    own, near = own[order], near[order]
    side_field[near] = len(ends) + np.arange(len(near))
    return side_field, np.concatenate([first, near]), np.concatenate([ends, own])


def piece_topology(coarse: Coarse, split: Split) -> Topology:
    """Topology of the pieces: the mesh's edges keep their numbers, diagonals follow."""
    base = coarse.topology
    if len(split.face_vertices) == len(base.vertices) and not len(split.diagonal_faces):
        return base
    inner = split.diagonals >= 0
    edge = np.where(inner, len(base.edges) + split.diagonals, base.edge[split.source_corners])
    heads = np.empty_like(split.face_vertices)
    heads[:-1] = split.face_vertices[1:]
    heads[split.face_offsets[1:] - 1] = split.face_vertices[split.face_offsets[:-1]]
    diagonals = np.empty((len(split.diagonal_faces), 2), dtype=np.int64)
    diagonals[split.diagonals[inner]] = np.stack([split.face_vertices[inner], heads[inner]], axis=1)
    edges = np.concatenate([base.edges, diagonals])
    return link_half_edges(coarse.positions, split.face_offsets, split.face_vertices, edges, edge)


