"""Derivatives of patches by the positions and normals at their corners: forward differences, slot by slot.

A slot is one way in which one corner of a patch can change: its position along an axis, a tilt of its normal, or a tilt
of the normal beyond a sharp side. A patch depends on nothing else, so all patches of a group are changed at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from curvify.mesh import Bools, Floats, Ints
from curvify.normals import unit
from curvify.records import record
from curvify.simplify.apart import Apart
from curvify.simplify.model import Group, Model, State, tangent_frames

#: Step of the differences, as a share of the mean edge and in radians.
STEP = 1e-6
#: Patches evaluated at once.
BATCH = 512


@record
class Unknowns:
    """Numbers of the unknowns: three for each free vertex, then two for each free sector.

    ``vertices (V,)`` and ``sectors (S,)`` have the first one of each, -1 where held; ``moves`` of them are of
    vertices, ``count`` are there in all.
    """

    vertices: Ints
    sectors: Ints
    moves: int
    count: int

    @classmethod
    def of(cls, vertices: Bools, sectors: Bools) -> Unknowns:
        """Numbers for the vertices ``(V,)`` and sectors ``(S,)`` that may change."""
        moves = 3 * int(vertices.sum())
        first = np.where(vertices, 3 * np.cumsum(vertices) - 3, -1)
        second = np.where(sectors, moves + 2 * np.cumsum(sectors) - 2, -1)
        return cls(first, second, moves, moves + 2 * int(sectors.sum()))


@record
class Slot:
    """One way to change all patches of a group: ``array`` 0 points, 1 normals, 2 normals beyond, at ``place`` in it,
    along ``axis``; ``unknowns (f,)`` the number of the unknown that does so, -1 where none does.
    """

    array: int
    place: tuple[int, ...]
    axis: int
    unknowns: Ints


@record
class Derivatives:
    """Derivatives by the slots of a group: ``unknowns (f,k)``; of samples ``points (f,m,3,k)``; of ``sines
    (f,n,3,k)``.
    """

    unknowns: Ints
    points: Floats
    sines: Floats


def slots_of(group: Group, unknowns: Unknowns) -> list[Slot]:
    """The slots that are free in any patch of a group."""
    apart, found = group.apart, []
    for k in range(apart.sides):
        found += _numbered(0, (k,), 3, unknowns.vertices[group.vertices[:, k]])
        found += _numbered(1, (k,), 2, unknowns.sectors[group.sectors[:, k]])
        for end in (0, 1):
            beyond = unknowns.sectors[group.beyond[:, k, end]]
            found += _numbered(2, (k, end), 2, np.where(apart.sharp[:, k, end], beyond, -1))
    return [slot for slot in found if (slot.unknowns >= 0).any()]


def _numbered(array: int, place: tuple[int, ...], axes: int, first: Ints) -> list[Slot]:
    return [Slot(array, place, axis, np.where(first < 0, -1, first + axis)) for axis in range(axes)]


def derivatives(model: Model, group: Group, state: State, unknowns: Unknowns) -> Derivatives | None:
    """Derivatives of a group's samples and sines; None where nothing is free. Lines are held."""
    slots = slots_of(group, unknowns)
    if not slots:
        return None
    count = len(group.vertices)
    arrays = group.arrays(state)
    frames = np.stack(tangent_frames(state.normals))
    labels = (group.vertices, group.sectors, group.beyond)
    points, sines = group.apart.samples(*arrays)
    by_points, by_sines = np.empty((*points.shape, len(slots))), np.empty((*sines.shape, len(slots)))
    length = STEP * model.edge_length
    many = max(BATCH // count, 1)
    for begin in range(0, len(slots), many):
        part = slots[begin : begin + many]
        changed = [np.repeat(array[None], len(part), axis=0) for array in arrays]
        for row, slot in enumerate(part):
            _change(changed[slot.array][row], slot, length, frames, labels[slot.array])
        moved, opened = _samples(group.apart, changed, len(part))
        steps = np.array([STEP if slot.array else length for slot in part])
        block = slice(begin, begin + len(part))
        by_points[..., block] = np.moveaxis((moved - points) / steps[:, None, None, None], 0, -1)
        by_sines[..., block] = np.moveaxis((opened - sines) / steps[:, None, None, None], 0, -1)
    return Derivatives(np.stack([slot.unknowns for slot in slots], axis=1), by_points, by_sines)


def _change(array: Floats, slot: Slot, length: float, frames: Floats, sectors: Ints) -> None:
    """Change an array ``(f,...,3)`` of a group by a slot, in place; ``sectors (f,...)`` of its normals."""
    at: Any = (slice(None), *slot.place)
    if slot.array == 0:
        array[at][:, slot.axis] += length
    else:
        array[at] = unit(array[at] + STEP * frames[slot.axis][sectors[at]])


def _samples(apart: Apart, arrays: list[Floats], copies: int) -> tuple[Floats, Floats]:
    """Samples ``(c,f,m,3)`` and sines ``(c,f,n,3)`` of copies of all patches with arrays ``(c,f,...)`` of their own."""
    every = apart.take(np.tile(np.arange(len(apart.faces)), copies))
    found = every.samples(*(array.reshape(-1, *array.shape[2:]) for array in arrays))
    points, sines = (values.reshape(copies, -1, *values.shape[1:]) for values in found)
    return points, sines
