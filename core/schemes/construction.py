"""What a device needs to build control vectors itself: positions, distinct corner normals, and how they connect.

A scheme that can be built on a device names the program that does it (gpu/shaders, whose functions are twins of the
scheme's own) and gives it an edge's ends, their normals, and the vectors of those edges that a sharp feature bends.
The control vectors that the scheme builds itself remain the reference; a backend that has no program for a scheme, or
no room, takes those.

A *side* is an edge as the faces see it that share its normals: the first E sides are the edges themselves, then come
the other sides of creases (``Patches.side_field``).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from curvify.arrays import distinct, take_rows
from curvify.mesh import Bools, Floats, Ints
from curvify.normals import dot, unit
from curvify.records import record
from curvify.topology import Topology, position_classes

if TYPE_CHECKING:
    from curvify.schemes.base import Basis
    from curvify.schemes.patchwork import Patchwork

#: Texels of the curve and the normal field of a side: four Bezier points, one texel for each component.
CURVE_TEXELS, EDGE_TEXELS = 3, 6
#: Tangents that agree with the scheme's rule to this sine are built by it.
SAME_TANGENT = 1e-6
#: A rule that leaves less than this of a vector would lose digits in single precision.
LEAST_LEFT = 0.02

#: The rule for tangents at the ends of smooth edges: vectors ``(N,3)``, of any length, for the unit chord, the normal
#: at the end and the mean of the normals at both.
TangentRule = Callable[[Floats, Floats, Floats], Floats]


@record
class Inputs:
    """What goes to a device once for a mesh.

    ``positions (V,3)``, distinct corner ``normals (D,3)``; per side the vertices and the normals of its start and its
    end, ``sides (N,4)``, and ``features (N,)``, its row of ``vectors (M,k,3)`` or -1; ``corners (C,)`` twice the side
    of each half-edge, plus 1 where it runs backward; ``links (N,4)`` what a program may want to know of its sides.
    """

    positions: Floats
    normals: Floats
    sides: Ints
    features: Ints
    vectors: Floats
    corners: Ints
    links: Ints | None = None


class Construction:
    """A surface that a device can build: ``program`` names the source of its functions, ``constants`` are fixed when
    they are compiled, ``numbers`` are arguments of all. Of the constants ``CURVE_POINTS`` and ``FIELD_POINTS`` are the
    Bezier points of an edge and of a normal field, ``VECTORS`` those of a feature, ``SIDE_TEXELS`` what is made for
    each side of a patch.

    The first pass makes ``EDGE_TEXELS`` of four numbers for each side: those of its curve, then those of its normal
    field; ``field_texels`` in a second pass where the fields need the first. ``inputs`` are made when asked for.
    """

    def __init__(
        self,
        program: str,
        make_inputs: Callable[[], Inputs],
        constants: Mapping[str, int],
        numbers: Mapping[str, float | tuple[float, ...]] | None = None,
        field_texels: int = 0,
    ) -> None:
        self.program, self.field_texels = program, field_texels
        self.numbers: dict[str, float | tuple[float, ...]] = dict(numbers or {})
        self.constants: dict[str, int] = dict(constants)
        self._make_inputs = make_inputs
        self._inputs: Inputs | None = None
        self._lock = threading.Lock()

    @property
    def inputs(self) -> Inputs:
        """What goes to the device; made once."""
        with self._lock:
            if self._inputs is None:
                self._inputs = self._make_inputs()
            return self._inputs


def linear_columns(basis: Basis) -> Floats:
    """The columns ``(3,S,L)`` of a basis whose side fields' ends have no weight."""
    return basis.linear


@record
class Pass:
    """A pass of a program over some patches, or over their ``sides``: a list ``name`` of so many ``texels`` for each,
    made by ``function``, for the passes after it.
    """

    name: str
    function: str
    texels: int
    sides: bool


@record
class DeviceForm:
    """How a device makes the control vectors of a form: ``columns`` of them for each patch, by the function ``column``,
    after the ``passes``.

    ``corners (f,)`` the first corner of each patch, ``shapes (f,)`` a number for each. Where the form has side fields,
    ``fields`` names the functions for them; they take texels of each side, in threes: ``slots`` (first, number).
    ``table`` gives the columns ``(o,S,K)`` of a basis, with what the ends of side fields weigh. ``numbers`` are further
    arguments.
    """

    construction: Construction
    corners: Ints
    column: str
    columns: int
    passes: tuple[Pass, ...] = ()
    shapes: Floats | None = None
    fields: str = ""
    slots: tuple[int, int] = (0, 0)
    table: Callable[[Basis], Floats] = linear_columns
    numbers: Mapping[str, float | tuple[float, ...]] = {}

    def texels(self, size: int) -> int:
        """Texels of the control vectors of a patch with so many sides: three for four columns."""
        return 3 * (-(-self.columns // 4) + size * self.slots[1])

    def most_texels(self, size: int) -> int:
        """Texels of the longest list that a patch with so many sides needs on the way."""
        made = (step.texels * (size if step.sides else 1) for step in self.passes)
        return max([self.texels(size), *made])

    def origins(self, rows: Ints) -> Floats:
        """First corners ``(f,3)`` of some patches: what the device's control vectors are relative to."""
        inputs = self.construction.inputs
        corners = inputs.corners[self.corners[rows]]
        return take_rows(inputs.positions, inputs.sides[corners >> 1, corners & 1])

    @property
    def field_constants(self) -> dict[str, int]:
        """Constants of the functions for the side fields."""
        return self.construction.constants | {"SIDE_STRIDE": 3 * self.slots[1]} if self.fields else {}


def smooth_rule(along: Floats, normal: Floats, mean: Floats) -> Floats:
    """Tangents ``(N,3)`` of ``edges.smooth_tangents`` where no fallback serves, not of unit length."""
    return along * dot(normal, mean) - mean * dot(normal, along)


def projected_rule(along: Floats, normal: Floats, _: Floats) -> Floats:
    """Tangents ``(N,3)`` of ``edges.projected_tangents`` where no fallback serves, not of unit length."""
    return along - dot(along, normal) * normal


@record
class SideFrame:
    """The sides of some pieces: one of the ``half_edges (N,)`` of each, their ``edges (N,)``; in canonical direction
    the ``lengths (N,)`` of the chords, unit chords ``along (N,3)`` and end normals ``pairs (N,2,3)``; ``normals (D,3)``
    the distinct ones, ``ends (N,2)`` which of them the pairs are.
    """

    topology: Topology
    half_edges: Ints
    edges: Ints
    lengths: Floats
    along: Floats
    normals: Floats
    ends: Ints

    @property
    def pairs(self) -> Floats:
        return take_rows(self.normals, self.ends)


def side_frame(work: Patchwork) -> SideFrame:
    """The sides of a work."""
    topology = work.topology
    normals, which = distinct_normals(topology.vertices, work.normals)
    half_edges = np.empty(work.fields.shape[1], dtype=np.int64)
    half_edges[work.side_field] = np.arange(len(topology.vertices))
    edges = topology.edge[half_edges]
    tail, head = which[half_edges], which[topology.next[half_edges]]
    forward = topology.forward[half_edges]
    ends = np.stack([np.where(forward, tail, head), np.where(forward, head, tail)], axis=1)
    start, end = (take_rows(work.coarse.positions, topology.edges[edges, i]) for i in (0, 1))
    chord = end - start
    return SideFrame(topology, half_edges, edges, np.linalg.norm(chord, axis=1), unit(chord), normals, ends)


def distinct_normals(vertices: Ints, normals: Floats) -> tuple[Floats, Ints]:
    """The distinct normals ``(D,3)`` of the corners ``(C,)`` at each vertex, and the one of each corner ``(C,)``."""
    corners = np.arange(len(vertices))
    lead = np.empty(vertices.max(initial=-1) + 1, dtype=np.int64)
    lead[vertices[::-1]] = corners[::-1]
    first = lead[vertices]
    others = np.flatnonzero((normals != take_rows(normals, first)).any(axis=1))
    keys = first.copy()
    if len(others):
        classes = position_classes(normals[others])
        keys[others] = len(vertices) * (1 + classes) + first[others]
    which = distinct(keys)[1]
    chosen = np.empty(which.max(initial=-1) + 1, dtype=np.int64)
    chosen[which] = corners
    return take_rows(normals, chosen), which


def assemble_inputs(work: Patchwork, frame: SideFrame, tangents: Floats, rule: TangentRule, others: Floats) -> Inputs:
    """Inputs for sides whose edges have unit end ``tangents (E,2,3)``, with ``others (N,k,3)`` as further vectors.

    Sides whose tangents are those of the ``rule`` and whose other vectors are zero need none. Tangents stand first.
    """
    found = np.flatnonzero(~_ruled(frame, tangents, rule) | others.any(axis=(1, 2)))
    features = np.full(len(frame.edges), -1)
    features[found] = np.arange(len(found))
    vectors = np.concatenate([tangents[frame.edges[found]], others[found]], axis=1)
    sides = np.concatenate([frame.topology.edges[frame.edges], frame.ends], axis=1)
    corners = 2 * work.side_field + ~frame.topology.forward
    return Inputs(work.coarse.positions, frame.normals, sides, features, vectors, corners)


def _ruled(frame: SideFrame, tangents: Floats, rule: TangentRule) -> Bools:
    """Sides ``(N,)`` whose tangents at both ends are the rule's, safely so in single precision."""
    pairs = frame.pairs
    mean = pairs.mean(axis=1)
    result = np.ones(len(frame.edges), dtype=bool)
    for end in (0, 1):
        made = rule(frame.along, pairs[:, end], mean)
        wanted = take_rows(tangents[:, end], frame.edges)
        ahead = dot(made, wanted)
        off = made - ahead * wanted
        ahead = ahead[:, 0]
        result &= (ahead > LEAST_LEFT) & (dot(off, off)[:, 0] <= (SAME_TANGENT * ahead) ** 2)
    return result
