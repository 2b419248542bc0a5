"""The last resort at corners that fold where no cut helps: creases made straight, normals that lean less.

Positions and polygons stay as they are. Both remedies are ours.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.arrays import distinct, take_rows
from curvify.mesh import Bools, Floats, Ints, PolygonMesh
from curvify.normals import degrees_between, sector_normals, unit
from curvify.options import MeshOptions
from curvify.prepare import Coarse, prepare_mesh
from curvify.records import replaced
from curvify.schemes.construction import distinct_normals
from curvify.simplify.folds import ROUNDS, Folds, folded_corners
from curvify.topology import Topology

#: How far each polygon ``(F,)`` of a mesh errs.
Errors = Callable[[PolygonMesh], Floats]
#: A crease of a flat polygon that leaves its chord by more than this (degrees) at a corner that folds is made straight.
OFF_CHORD = 10.0
#: The shares of the way to the mean normal of their polygons by which normals are turned, one after the other.
TURNS = (0.25, 0.5)


def relax_folded(mesh: PolygonMesh, errors: Errors | None = None) -> PolygonMesh:
    """The mesh with fewer reversed corners, of which only marks and normals differ.

    With ``errors`` the largest of them does not grow where creases are made straight.
    """
    return lean_less(straighten_folded(mesh, errors))


def straighten_folded(mesh: PolygonMesh, errors: Errors | None = None) -> PolygonMesh:
    """Mark creases of flat polygons as straight that leave their chords at reversed corners, where that helps.

    Between polygons that are nearly in one plane the direction across both normals, which a crease takes, is hardly
    determined: a tenth of a degree in a normal can turn it by sixty. With ``errors`` creases stay as they are where
    polygons would err more than any does.
    """
    tried, limit = np.zeros(0, dtype=np.int64), np.inf
    for _ in range(ROUNDS):
        coarse, folds = prepare_mesh(mesh, MeshOptions(weld="never")), folded_corners(mesh)
        edges = _creases_to_straighten(mesh, coarse, folds)
        edges = edges[~np.isin(edges, tried)]
        if not len(edges):
            break
        tried = np.concatenate([tried, edges])
        before = _reversed_at(coarse.topology, folds)
        after = _reversed_at(coarse.topology, folded_corners(_with_straight(mesh, coarse.topology.edges[edges])))
        edges = edges[after[edges] < before[edges]]
        if errors is not None and len(edges):
            limit = min(limit, float(errors(mesh).max()))
            edges = edges[_harmless(mesh, coarse.topology, edges, errors, limit)]
        mesh = _with_straight(mesh, coarse.topology.edges[edges])
    return mesh


def _harmless(mesh: PolygonMesh, topology: Topology, edges: Ints, errors: Errors, limit: float) -> Bools:
    """Which of ``edges (e,)``, made straight, leave the errors of all polygons at their ends within the limit."""
    large = errors(_with_straight(mesh, topology.edges[edges])) > limit
    touched = np.zeros(topology.vertex_count, dtype=bool)
    touched[topology.vertices[large[topology.faces]]] = True
    return np.asarray(~touched[topology.edges[edges]].any(axis=1))


def _with_straight(mesh: PolygonMesh, edges: Ints) -> PolygonMesh:
    """The mesh with further straight edges."""
    straight = np.concatenate([mesh.marks.straight_edges.reshape(-1, 2), edges])
    return mesh.with_(marks=replaced(mesh.marks, straight_edges=straight))


def _reversed_at(topology: Topology, folds: Folds) -> Ints:
    """How many reversed corners lie between each edge ``(E,)`` and another."""
    corners = np.flatnonzero(folds.reversed)
    sides = topology.edge[np.concatenate([corners, topology.prev[corners]])]
    return np.bincount(sides, minlength=len(topology.edges))


def _creases_to_straighten(mesh: PolygonMesh, coarse: Coarse, folds: Folds) -> Ints:
    """Creases of flat polygons, at reversed corners, that leave their chords."""
    topology, features = coarse.topology, coarse.features()
    edges = np.flatnonzero((_reversed_at(topology, folds) > 0) & features.sharp.any(axis=1))
    level = np.isin(topology.faces, mesh.marks.flat_faces)
    edges = edges[level[topology.first[edges]] | level[topology.last[edges]]]
    start, end = (take_rows(coarse.positions, topology.edges[edges, i]) for i in (0, 1))
    off = [degrees_between(features.tangents[edges, i], end - start) for i in (0, 1)]
    return edges[np.maximum(*off) > OFF_CHORD]


def lean_less(mesh: PolygonMesh) -> PolygonMesh:
    """Turn the normals at reversed corners toward the mean of the polygons there, as little as helps."""
    if mesh.corner_normals is None:
        return mesh
    coarse = prepare_mesh(mesh, MeshOptions(weld="never"))
    normals, sector = distinct_normals(mesh.face_vertices, mesh.corner_normals)
    mean = np.empty_like(normals)
    mean[sector] = sector_normals(mesh.positions, mesh.face_offsets, mesh.face_vertices, coarse.area, sector)
    folds, given = folded_corners(mesh), normals
    for turn in TURNS:
        pending = distinct(sector[folds.reversed])[0]
        if not len(pending):
            break
        trial = normals.copy()
        trial[pending] = unit((1 - turn) * given[pending] + turn * mean[pending])
        after = _reversed_around(folded_corners(mesh.with_(corner_normals=trial[sector])), sector)
        unhelped = pending[after[pending] >= _reversed_around(folds, sector)[pending]]
        trial[unhelped] = normals[unhelped]
        turned = mesh.with_(corner_normals=trial[sector])
        found = folded_corners(turned)
        if found.polygons(found.reversed).sum() < folds.polygons(folds.reversed).sum():
            mesh, folds, normals = turned, found, trial
    return mesh


def _reversed_around(folds: Folds, sector: Ints) -> Ints:
    """How many corners are reversed in the polygons around each sector ``(S,)``."""
    by_face = np.bincount(folds.faces[folds.reversed], minlength=int(folds.faces[-1]) + 1)
    around = np.zeros(int(sector.max()) + 1, dtype=np.int64)
    np.add.at(around, sector, by_face[folds.faces])
    return around
