"""Patches of a polygon mesh before their insides are filled: pieces of faces, edge curves, shared normal fields."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property

import numpy as np

from curvify.arrays import by_component, cross, take_rows, values_of
from curvify.convex import Split
from curvify.mesh import Floats, Ints
from curvify.prepare import Coarse
from curvify.records import field, record
from curvify.sampling import Sampling
from curvify.schemes.base import BezierEdges, Edges, PatchClass, Patches
from curvify.schemes.construction import Construction
from curvify.schemes.frames import Frame
from curvify.sectors import Features
from curvify.topology import Topology


@record
class Patchwork:
    """Pieces of faces with their curves and normals.

    ``topology`` of the pieces; ``split`` where they come from, in terms of the cleaned loops; per edge
    ``curves (3,E,d+1)``; ``fields (3,N,q+1)`` edge normals and ``side_field (C,)`` the one of each half-edge; ``normals
    (C,3)`` of the corners; ``construction``: how a device builds them. In memory the points of an edge lie together.
    """

    coarse: Coarse
    features: Features
    split: Split
    topology: Topology
    curves: Floats
    fields: Floats
    side_field: Ints
    normals: Floats
    warnings: list[str] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    construction: Construction | None = None

    @classmethod
    def on(
        cls, coarse: Coarse, features: Features, split: Split, frame: Frame, curves: Floats, fields: Floats
    ) -> Patchwork:
        """The pieces of a frame with ``curves (E,d+1,3)`` and ``fields (N,q+1,3)``."""
        curves, fields = (np.ascontiguousarray(points).transpose(2, 0, 1) for points in (curves, fields))
        return cls(coarse, features, split, frame.topology, curves, fields, frame.side_field, frame.normals)

    @cached_property
    def steps(self) -> tuple[Floats, Floats]:
        """Steps ``(3,C)`` from each corner to the next points of its two cubic curves, ahead and back."""
        return _corner_tangents(self.topology, self.coarse.positions, self.curves.transpose(1, 2, 0))

    @cached_property
    def sines(self) -> Floats:
        """Sine ``(C,)`` of the angle between the two steps at each corner, negative where the patch folds there."""
        return _corner_sines(*self.steps, self.normals)

    def corner_points(self, corners: Ints) -> Floats:
        """Positions ``(3,f,n)`` of corners ``(f,n)``."""
        return take_rows(self.coarse.positions, self.topology.vertices[corners].T).T

    def corner_normals(self, corners: Ints) -> Floats:
        """Normals ``(3,f,n)`` of corners ``(f,n)``."""
        return take_rows(self.normals, corners.T).T

    def side_curves(self, corners: Ints) -> Floats:
        """Bezier points ``(3,f,n,d+1)`` of the half-edges ``(f,n)``, each in its own direction."""
        return self.in_direction(self.curves, self.topology.edge[corners], corners)

    def side_fields(self, corners: Ints) -> Floats:
        """Bezier points ``(3,f,n,q+1)`` of the normal fields of the half-edges ``(f,n)``."""
        return self.in_direction(self.fields, self.side_field[corners], corners)

    def in_direction(self, points: Floats, rows: Ints, corners: Ints) -> Floats:
        """The Bezier points ``(3,f,n,d)`` of some rows of ``points (3,N,d)``, turned where half-edges run backward.

        In memory the faces come last.
        """
        size = points.shape[2]
        stored = points.transpose(1, 2, 0).reshape(-1, 3 * size)
        found = by_component(take_rows(stored, rows.T.reshape(-1))).T.reshape(size, 3, *rows.T.shape)
        return np.where(self.topology.forward[corners].T, found, found[::-1]).transpose(1, 3, 2, 0)

    def size_classes(self) -> Iterator[tuple[int, Ints]]:
        """Polygon sizes and the pieces ``(f,)`` of each."""
        sizes = self.topology.sizes
        for size in values_of(sizes):
            yield size, np.flatnonzero(sizes == size)

    def patches(self, classes: list[PatchClass], sampling: Callable[[int, int], Sampling]) -> Patches:
        """Everything a backend and the numbering need."""
        edges = BezierEdges(self.curves, self.fields, self.construction)
        patches = assemble_patches(
            self.coarse, self.split, self.topology, edges, self.side_field, self.normals, sampling
        )
        patches.classes = classes
        patches.warnings += self.warnings
        patches.counts |= self.counts
        return patches


def assemble_patches(
    coarse: Coarse,
    split: Split,
    topology: Topology,
    edges: Edges,
    side_field: Ints,
    normals: Floats,
    sampling: Callable[[int, int], Sampling],
) -> Patches:
    """Patches over the pieces of a split mesh, their classes still missing."""
    loops = coarse.loops
    return Patches(
        positions=coarse.positions,
        topology=topology,
        source_faces=loops.source_faces[split.source_faces],
        source_corners=loops.source_corners[split.source_corners],
        stand_in=coarse.stand_in,
        inner_faces=loops.source_faces[split.diagonal_faces],
        edges=edges,
        side_field=side_field,
        normals=normals,
        classes=[],
        sampling=sampling,
        mesh=coarse.mesh,
        warnings=list(coarse.warnings),
        counts=dict(coarse.counts),
        marks=coarse.marks.counts,
    )


def _corner_tangents(topology: Topology, positions: Floats, curves: Floats) -> tuple[Floats, Floats]:
    """Steps ``(3,C)`` from each corner to the next points of its two curves ``(E,4,3)``: ahead and back."""
    point = take_rows(positions, topology.vertices).T
    stored, first = curves.reshape(-1, 3), 4 * topology.edge
    ahead, back = first + 2 - topology.forward, (first + 1 + topology.forward)[topology.prev]
    return by_component(take_rows(stored, ahead)).T - point, by_component(take_rows(stored, back)).T - point


def _corner_sines(out: Floats, back: Floats, normals: Floats) -> Floats:
    """Sine ``(C,)`` between the two curves at each corner, negative where the patch folds there."""
    lengths = np.sqrt(np.einsum("ic,ic->c", out, out) * np.einsum("ic,ic->c", back, back))
    volume = np.einsum("ic,ci->c", cross(out, back, axis=0), normals)
    return np.divide(volume, lengths, out=np.zeros_like(volume), where=lengths > 0)
