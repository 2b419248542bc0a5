"""The scheme ``overveld``: subdivision by vertex normals alone, pass by pass, each edge cut in its middle.

Source: van Overveld, Wyvill, "An algorithm for polygon subdivision based on vertex normals" (1997); what differs from
the print, and why, is in docs/triangles.md. Unlike the other schemes it has no surface to be evaluated: every pass
takes the normals that the last one made. Its driver is ``curvify.subdivision``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.arrays import cross
from curvify.errors import MeshError, OptionError
from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.normals import degrees_between, dot, unit
from curvify.options import MeshOptions
from curvify.prepare import Coarse, prepare_mesh
from curvify.records import field, record
from curvify.schemes.frames import piece_topology
from curvify.schemes.overveld_edges import EDGE_RULES, MIDPOINT_NORMALS
from curvify.schemes.overveld_pass import Rules
from curvify.schemes.overveld_polygons import Polygons
from curvify.topology import Topology
from curvify.triangulation import triangulate_polygons
from curvify.weld import split_wedges
from curvify.words import count_of

#: More passes than this are refused: four to this power triangles for each.
MOST_PASSES = 24
#: Border edges whose cross product is below this share of their lengths have no plane.
NO_RIM_PLANE = 0.02
#: A normal of which less than this remains in the plane of the rim keeps its direction: the sheet is flat there.
LEAST_IN_PLANE = 0.5

name = "overveld"
summary = "subdivision by vertex normals, pass by pass: interpolates vertices; edges may stop at a length"
source = "van Overveld, Wyvill: An algorithm for polygon subdivision based on vertex normals"
faces = "any polygons; concave ones are triangulated"
continuity = "C0; kinks halve with every pass"
keeps = "vertices, given normals, creases; rims with --rim, flat faces with --planar"
normals = ("midpoint rule",)


@dataclass(frozen=True)
class Options(MeshOptions):
    """``depth`` passes (None: as many as give at least the segments of the level), or, with ``max_edge``, at most as
    many until no edge is longer; ``edge_rule`` ``curvature`` or ``stretched``; ``midpoint_normal`` how the middles of
    edges are shaded: ``quad``, ``perp``, ``avg``, or ``geometry``, from the new triangles; ``apex`` from 0, full, to 1
    for polygons with more than 4 sides; ``rim`` bends normals on the border into its plane; the vertices of the faces
    ``planar`` get the face's normal.
    """

    depth: int | None = None
    max_edge: float | None = None
    edge_rule: str = "curvature"
    midpoint_normal: str = "quad"
    apex: float = 0.0
    rim: bool = False
    planar: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.edge_rule not in EDGE_RULES:
            raise OptionError(f"edge_rule must be one of {', '.join(EDGE_RULES)}, not {self.edge_rule!r}")
        if self.midpoint_normal not in MIDPOINT_NORMALS:
            raise OptionError(
                f"midpoint_normal must be one of {', '.join(MIDPOINT_NORMALS)}, not {self.midpoint_normal!r}"
            )
        if self.depth is not None and not 1 <= self.depth <= MOST_PASSES:
            raise OptionError(f"depth must be from 1 to {MOST_PASSES}, not {self.depth}")
        if self.max_edge is not None and not (self.max_edge > 0 and np.isfinite(self.max_edge)):
            raise OptionError(f"max_edge must be a positive length, not {self.max_edge}")
        if not np.isfinite(self.apex):
            raise OptionError(f"apex must be a finite number, not {self.apex}")

    @property
    def rules(self) -> Rules:
        """The rules of a pass."""
        return Rules(self.edge_rule, self.midpoint_normal, self.max_edge)


@record
class Recursion:
    """A mesh ready to be subdivided.

    ``polygons`` of the first pass; values of wedges are the unit normal, then uv if ``has_uvs``, then the color.
    ``topology`` of the cleaned mesh; ``mesh`` as it was read; ``warnings`` and ``counts`` for the report.
    """

    polygons: Polygons
    options: Options
    topology: Topology
    mesh: PolygonMesh
    has_uvs: bool
    warnings: list[str] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    marks: dict[str, dict[str, int]] = field(default_factory=dict)


def prepare(mesh: PolygonMesh | Coarse, options: Options | None = None) -> Recursion:
    """The polygons of the first pass. Raises MeshError where there is nothing to refine."""
    options = options or Options()
    coarse = prepare_mesh(mesh, options)
    normals = corner_normals(coarse, options)
    loops = coarse.loops
    split, fanned = triangulate_polygons(coarse.positions, loops.offsets, loops.vertices, concave_only=True)
    topology = piece_topology(coarse, split)
    corners = loops.source_corners[split.source_corners]
    values = _corner_values(coarse.mesh, normals[split.source_corners] + 0.0, corners)
    own = np.flatnonzero(coarse.mesh.face_vertices[corners] == topology.vertices)
    wedges, base, repeated = split_wedges(topology.vertices, values, own, len(coarse.positions), len(coarse.positions))
    polygons = Polygons(
        coarse.positions,
        np.concatenate([_vertex_values(coarse, values, base), values[repeated]]),
        topology.vertices[repeated],
        topology,
        wedges,
        loops.source_faces[split.source_faces],
        loops.source_faces[split.diagonal_faces],
    )
    cut = int((np.bincount(split.source_faces, minlength=len(loops.source_faces)) > 1).sum())
    recursion = Recursion(polygons, options, coarse.topology, coarse.mesh, coarse.mesh.corner_uvs is not None)
    recursion.counts = coarse.counts | {"concave_faces": cut}
    recursion.warnings = coarse.warnings + _notes(coarse, cut, fanned) + coarse.unused_marks((), name)
    recursion.marks = coarse.marks.counts
    return recursion


def corner_normals(coarse: Coarse, options: Options) -> Floats:
    """Unit normal ``(C,3)`` of each corner: given ones as they are, computed ones as the other schemes have them, with
    the rules for rims and planar faces.
    """
    features = coarse.features()
    normals = features.normals.copy()
    if coarse.given is not None:  # the edge rule takes them as they are
        marked = (coarse.marks.corner > 0).any() or coarse.marks.straight.any()
        kept = ~(features.corners & marked)[coarse.topology.vertices]
        normals[kept] = features.unfitted[kept]
    if options.rim:
        vertices, planes = rim_planes(coarse.topology, coarse.positions)
        _into_planes(coarse.topology, normals, vertices, planes)
    if options.planar:
        _flatten(coarse, normals, np.array(options.planar, dtype=np.int64))
    return normals


def rim_planes(topology: Topology, positions: Floats) -> tuple[Ints, Floats]:
    """Border vertices where two border edges span a plane, and its unit normals (section 2.8)."""
    edge = np.flatnonzero(topology.twin < 0)
    tails, heads = topology.vertices[edge], topology.vertices[topology.next[edge]]
    count = topology.vertex_count
    once = (np.bincount(tails, minlength=count) == 1) & (np.bincount(heads, minlength=count) == 1)
    into, out = (np.full(count, -1) for _ in range(2))
    out[tails], into[heads] = heads, tails
    vertices = np.flatnonzero(once)
    before = positions[vertices] - positions[into[vertices]]
    after = positions[out[vertices]] - positions[vertices]
    across = cross(before, after)
    lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    bent = np.linalg.norm(across, axis=1) > NO_RIM_PLANE * lengths
    return vertices[bent], unit(across[bent])


def _into_planes(topology: Topology, normals: Floats, vertices: Ints, planes: Floats) -> None:
    """Project the normals at some vertices into planes through them, where enough of them remains."""
    place = np.full(topology.vertex_count, -1)
    place[vertices] = np.arange(len(vertices))
    corners = np.flatnonzero(place[topology.vertices] >= 0)
    across = planes[place[topology.vertices[corners]]]
    inside = normals[corners] - dot(normals[corners], across) * across
    enough = np.linalg.norm(inside, axis=1) >= LEAST_IN_PLANE
    normals[corners[enough]] = unit(inside[enough])


def _flatten(coarse: Coarse, normals: Floats, planar: Ints) -> None:
    """Give the vertices of planar faces the face's normal, for all their faces."""
    topology, source = coarse.topology, coarse.loops.source_faces
    if planar.min() < 0 or planar.max() >= coarse.mesh.face_count:
        raise MeshError(f"--planar: faces are numbered 0 to {coarse.mesh.face_count - 1}")
    faces = np.flatnonzero(np.isin(source, planar))
    corners = np.flatnonzero(np.isin(topology.faces, faces))
    facing = unit(coarse.area)[topology.faces[corners]]
    if not facing.any(axis=1).all():
        flat = source[topology.faces[corners[~facing.any(axis=1)][0]]]
        raise MeshError(f"--planar: face {flat} has no area and no plane")
    chosen = np.zeros((topology.vertex_count, 3))
    chosen[topology.vertices[corners]] = facing
    apart = degrees_between(facing, chosen[topology.vertices[corners]]) > 1e-3
    if apart.any():
        raise MeshError(
            f"--planar: vertex {topology.vertices[corners[apart][0]]} is in two planar faces that are not parallel"
        )
    mine = chosen[topology.vertices].any(axis=1)
    normals[mine] = chosen[topology.vertices[mine]]


def _corner_values(mesh: PolygonMesh, normals: Floats, corners: Ints) -> Floats:
    """Values ``(C,3+c)`` of corners: normal, uv, color."""
    parts = [normals]
    if mesh.corner_uvs is not None:
        parts.append(np.nan_to_num(mesh.corner_uvs[corners]))
    if mesh.vertex_colors is not None:
        parts.append(mesh.vertex_colors[mesh.face_vertices[corners]].astype(np.float64))
    return np.concatenate(parts, axis=1)


def _vertex_values(coarse: Coarse, values: Floats, base: Ints) -> Floats:
    """Values ``(V,3+c)`` of the vertices: of their base corner, or of the vertex they were welded to; zero for those in
    no face, but for the color.
    """
    corners = base[coarse.stand_in]
    result = np.where(corners[:, None] >= 0, values[corners], 0.0)
    colors = coarse.mesh.vertex_colors
    if colors is not None:
        result[:, values.shape[1] - colors.shape[1] :] = colors
    return result


def _notes(coarse: Coarse, cut: int, fanned: Ints) -> list[str]:
    """What was cut."""
    notes = []
    if cut:
        notes.append(f"{count_of(cut, 'concave face')} triangulated")
    if len(fanned):
        first = coarse.loops.source_faces[fanned.min()]
        notes.append(f"{count_of(len(fanned), 'face')} without a proper triangulation cut into a fan, first: {first}")
    return notes
