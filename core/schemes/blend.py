"""The scheme ``blend``: local geometries around the vertices, blended over charts, with darts, creases and corners.

Source: Ko, Lee, Lim, Yoon, "Construction and Rendering of Trimmed Blending Surfaces with Sharp Features on a GPU",
after Ying and Zorin, "A Simple Manifold-Based Construction of Surfaces of Arbitrary Smoothness". What differs from the
print, and why, is in docs/blending.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.arrays import cross, values_of
from curvify.convex import Split, split_polygons, whole_faces
from curvify.errors import OptionError
from curvify.mesh import Bools, Floats, Ints, PolygonMesh
from curvify.normals import dot, unit
from curvify.options import MeshOptions
from curvify.pieces import MAX_SIDES, split_notes
from curvify.prepare import Coarse, prepare_mesh
from curvify.records import record, replaced
from curvify.sampling import kite_sampling
from curvify.schemes.base import PatchClass, Patches
from curvify.schemes.blend_charts import CURVE, POINT, Charts, find_rings, make_charts, sector_kinds, smooth_kinds
from curvify.schemes.blend_fit import fit_paper_curves, fit_sectors, fit_smooth, soften
from curvify.schemes.blend_lines import (
    EndCurves,
    FeatureMarks,
    Lines,
    end_curves,
    find_lines,
    line_tangents,
    start_ends,
)
from curvify.schemes.blend_network import Network, blend_edges
from curvify.schemes.frames import piece_topology
from curvify.schemes.patchwork import assemble_patches
from curvify.schemes.quads import Quads, edge_middles, face_centers, split_to_quads, whole_quads
from curvify.topology import Topology, fans
from curvify.words import count_of

CHARTS = ("auto", "conformal", "polar")
SHARP_MODELS = ("sided", "paper", "paper-fixed")
BOUNDARY_CORNERS = ("keep", "smooth")
#: Kinds of marks that only other schemes know.
UNUSED_MARKS = ("edge normal", "bulge", "alpha", "kappa")

name = "blend"
summary = "local geometries blended over charts; darts, creases, corners; interpolates vertices, not given normals"
source = "Ko, Lee, Lim, Yoon: Construction and Rendering of Trimmed Blending Surfaces with Sharp Features on a GPU"
faces = "any polygons; unless all are quads, each is divided into quads, concave ones and those over 64 sides are split"
keeps = "vertices, creases, rims; not given normals"
continuity = "G1"
normals = ("exact",)


@dataclass(frozen=True)
class Options(MeshOptions):
    """``chart``: ``conformal`` as in the paper, ``polar``, or ``auto``, the better one for each valence;
    ``blend_order`` of the blending function, 3 or 5; ``sharp_model``: ``sided``, or the ``paper``'s points and curves,
    with its misprints mended in ``paper-fixed``; ``boundary_corners``: whether to ``keep`` the corners of open
    boundaries or to ``smooth`` them; ``split_rule`` for concave faces. The others are those of all schemes.
    """

    chart: str = "auto"
    blend_order: int = 3
    sharp_model: str = "sided"
    boundary_corners: str = "keep"
    split_rule: str = "best"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, choices in (
            ("chart", CHARTS),
            ("blend_order", (3, 5)),
            ("sharp_model", SHARP_MODELS),
            ("boundary_corners", BOUNDARY_CORNERS),
        ):
            value = getattr(self, name)
            if value not in choices:
                raise OptionError(f"{name} must be one of {', '.join(map(str, choices))}, not {value!r}")


def prepare(mesh: PolygonMesh | Coarse, options: Options | None = None) -> Patches:
    """Patches for every face of the mesh. Raises MeshError where there is nothing to refine."""
    options = options or Options()
    coarse = prepare_mesh(mesh, options)
    work = build_surface(coarse, options)
    topology = work.topology
    first = topology.first
    side_field, half_edges = _sides(work, first)
    edges = blend_edges(work.network, topology, first, half_edges, work.curves, work.face_normals)
    normals = corner_normals(work)
    patches = assemble_patches(coarse, work.split, topology, edges, side_field, normals, kite_sampling)
    for sides in values_of(topology.sizes):
        ids = np.flatnonzero(topology.sizes == sides)
        patches.classes.append(PatchClass(sides, ids, work.network.kite_forms(topology, ids)))
    _note(patches, work, options)
    return patches


@record
class BlendWork:
    """A mesh on its way to a surface: the pieces of its faces, ``split`` and their ``topology``; their ``lines``, the
    ``lone (E,)`` creases without effect, and the ``network`` of quads; ``curves`` of the features at the
    quads' edge ends, or None; ``face_normals (C,3)`` of the coarse mesh at the corners of the pieces.
    """

    split: Split
    topology: Topology
    lines: Lines
    lone: Bools
    network: Network
    curves: EndCurves | None
    face_normals: Floats


def build_surface(coarse: Coarse, options: Options) -> BlendWork:
    """Divide the faces into quads, find the features, and fit the local geometries."""
    sharp = replaced(coarse.marks, crease=(coarse.marks.crease > 0).astype(np.float64))
    features = replaced(coarse, marks=sharp).features()  # softened later, once
    split = _split(coarse, options.split_rule)
    topology = piece_topology(coarse, split)
    normals = features.normals[split.source_corners]
    marks = _feature_marks(coarse, topology, options)
    lines = find_lines(topology, coarse.positions, marks)
    if (topology.sizes == 4).all():
        quads, inner = whole_quads(coarse.positions, topology), lines
    else:
        quads, inner = _divide(coarse.positions, topology, normals, lines, marks)
    charts, curves = fit_charts(quads, inner, _sharpness(coarse, len(quads.positions)), options)
    lone = lines.lone if inner is lines else lines.lone & ~marks.sharp.all(axis=1)  # halves of edges meet sharp
    return BlendWork(split, topology, lines, lone, Network(quads, charts, options.blend_order), curves, normals)


def _split(coarse: Coarse, rule: str) -> Split:
    """The faces cut into convex pieces; quads stay whole where the mesh has nothing else."""
    loops = coarse.loops
    if (np.diff(loops.offsets) == 4).all():
        quads = loops.vertices.reshape(-1, 4)
        if (quads[:, :2] != quads[:, 2:]).all():
            return whole_faces(loops.offsets, loops.vertices)
    return split_polygons(coarse.positions, loops.offsets, loops.vertices, rule=rule, max_sides=MAX_SIDES)


def _feature_marks(coarse: Coarse, topology: Topology, options: Options) -> FeatureMarks:
    """What makes features on the pieces; diagonals are smooth."""
    sharp, straight = np.zeros((len(topology.edges), 2), dtype=bool), np.zeros(len(topology.edges), dtype=bool)
    sharp[: len(coarse.marks.crease)] = coarse.marks.crease > 0
    straight[: len(coarse.marks.straight)] = coarse.marks.straight
    return FeatureMarks(sharp, straight, coarse.marks.corner > 0, options.boundary_corners == "keep")


def _sharpness(coarse: Coarse, count: int) -> Floats:
    """Sharpness of the creases at the ``count`` vertices of the quads: that of the sharpest; in the middle of an edge
    the mean of its ends.
    """
    crease, edges = coarse.marks.crease, coarse.topology.edges
    result = np.ones(count)
    at_ends = np.zeros(coarse.topology.vertex_count)
    np.maximum.at(at_ends, edges, crease)
    result[: len(at_ends)] = at_ends
    if count > len(at_ends):
        result[len(at_ends) : len(at_ends) + len(edges)] = crease.mean(axis=1)
    return result


def _divide(
    positions: Floats, topology: Topology, normals: Floats, lines: Lines, marks: FeatureMarks
) -> tuple[Quads, Lines]:
    """Quads from polygons, and the features on them: each half of an edge goes on in the other."""
    feature = ~topology.interior | marks.sharp.all(axis=1)
    tangents = line_tangents(topology, positions, lines.partner)
    tangents[np.repeat(marks.straight, 2)] = 0.0
    middles = edge_middles(positions, topology, normals, tangents, feature)
    quads = split_to_quads(positions, topology, middles, face_centers(positions, topology, normals))
    base, corners = quads.topology, np.arange(len(topology.vertices))
    through = feature[topology.edge]
    none = np.zeros_like(through)
    start = np.stack([lines.start, none, none, through[topology.prev]], axis=1).reshape(-1)
    end = np.stack([through, none, none, lines.end[topology.prev]], axis=1).reshape(-1)
    counts = np.stack([lines.counts, 2 * through, 0 * lines.counts, 2 * through[topology.prev]], axis=1).reshape(-1)
    ends, whole = start_ends(base), start_ends(topology)
    image = np.empty(2 * len(topology.edges), dtype=np.int64)
    image[whole ^ 1] = ends[quads.sides[:, 1]] ^ 1
    image[whole] = ends[quads.sides[:, 0]]
    partner = np.full(2 * len(base.edges), -1)
    joined = np.flatnonzero(lines.partner >= 0)
    partner[image[joined]] = image[lines.partner[joined]]
    before, after = ends[quads.sides[corners[through], 0]] ^ 1, ends[quads.sides[corners[through], 1]]
    partner[before], partner[after] = after, before
    return quads, Lines(start, end, partner, fans(base), counts, np.zeros(len(base.edges), dtype=bool))


def fit_charts(
    quads: Quads, lines: Lines, sharpness: Floats, options: Options
) -> tuple[Charts, EndCurves | None]:
    """Charts with their local geometries; and the curves of the features, where all faces beside them follow those.

    ``sharpness (V,)`` of the creases at the quads' vertices.
    """
    topology, positions = quads.topology, quads.positions
    if options.sharp_model != "sided":
        return _paper_charts(quads, lines, options), None
    rings = find_rings(topology, lines.fans, lines.start)
    smooth = lines.counts[rings.first] < 2
    sectors = np.flatnonzero(~smooth)
    kinds = np.empty(len(smooth), dtype=np.int64)
    kinds[smooth] = smooth_kinds(rings.sizes[smooth], options.chart)
    if len(sectors):
        kinds[sectors] = sector_kinds(topology, positions, rings, sectors, lines.partner)
    charts = make_charts(rings, kinds)
    fit_smooth(charts, topology, positions)
    ends = start_ends(topology)
    features = np.concatenate([ends[lines.start], ends[lines.end] ^ 1])
    curves = end_curves(topology, positions, lines.partner, features)
    fit_sectors(charts, topology, positions, curves)
    soften(charts, topology, sharpness)
    return charts, curves


def _paper_charts(quads: Quads, lines: Lines, options: Options) -> Charts:
    """Table 1 of the paper: a surface where no feature is, a curve, for each face its own, on two, else a point."""
    topology, positions = quads.topology, quads.positions
    rings = find_rings(topology, lines.fans, lines.counts == 2)
    counts = lines.counts[rings.first]
    kinds = np.where(counts == 0, smooth_kinds(rings.sizes, options.chart), np.where(counts == 2, CURVE, POINT))
    charts = make_charts(rings, kinds)
    fit_smooth(charts, topology, positions)
    crease = rings.first[kinds == CURVE]
    corners, ends = lines.around(topology)
    two = lines.counts[corners] == 2
    pairs = np.full((len(topology.vertices), 2), -1)
    pairs[lines.fans[corners[two]][::2]] = ends[two].reshape(-1, 2)
    fixed = options.sharp_model == "paper-fixed"
    fit_paper_curves(charts, topology, positions, crease, pairs[lines.fans[crease]], fixed)
    return charts


def corner_normals(work: BlendWork) -> Floats:
    """Unit normal ``(C,3)`` of the surface at each corner, one for each chart; that of the faces where it has none."""
    charts, corners = work.network.charts, work.network.quads.kites[:, 0]
    chart = charts.rings.chart[corners]
    first, second = charts.coefficients[:, 3], charts.coefficients[:, 1]
    normal = cross(first, second)
    square, speeds = dot(normal, normal)[:, 0], dot(first, first)[:, 0] * dot(second, second)[:, 0]
    none = ~(square > 1e-20 * speeds)
    own = np.zeros_like(normal)
    own[chart[::-1]] = work.face_normals[::-1]
    return unit(np.where(none[:, None], own, normal))[chart]


def _sides(work: BlendWork, first: Ints) -> tuple[Ints, Ints]:
    """Normal field ``(C,)`` of each half-edge, and a half-edge ``(N,)`` for each field.

    Half-edges of one edge share a field if they share the charts of its quads' vertices.
    """
    topology, quads = work.topology, work.network.quads
    chart, following = work.network.charts.rings.chart, quads.topology.next
    passed = np.concatenate([chart[quads.sides], chart[following[quads.sides[:, -1:]]]], axis=1)
    passed = np.where(topology.forward[:, None], passed, passed[:, ::-1])
    differs: Bools = (passed != passed[first[topology.edge]]).any(axis=1)
    own = np.flatnonzero(differs)
    own = own[np.argsort(topology.edge[own], kind="stable")]
    side_field = topology.edge.copy()
    side_field[own] = len(first) + np.arange(len(own))
    return side_field, np.concatenate([first, own])


def _note(patches: Patches, work: BlendWork, options: Options) -> None:
    """Warnings and counts of what was split, and of marks without effect."""
    split, coarse_faces = work.split, patches.source_faces
    patches.counts.update({f"{reason}_faces": number for reason, number in split.counts.items()})
    patches.warnings += split_notes(split, source_faces=coarse_faces)
    lone = np.flatnonzero(work.lone & (options.sharp_model == "sided"))
    patches.counts["lone_creases"] = len(lone)
    patches.warnings += _unused_marks(patches)
    if len(lone):
        a, b = work.topology.edges[lone[0]]
        patches.warnings.append(
            f"{count_of(len(lone), 'crease')} of a single edge, first: {a}-{b}: darts at both ends leave nothing sharp"
        )


def _unused_marks(patches: Patches) -> list[str]:
    """Marks that this scheme has no use for."""
    counts = dict.fromkeys(UNUSED_MARKS, 0)
    for kinds in patches.marks.values():
        for kind in counts:
            counts[kind] += kinds.get(kind, 0)
    found = [count_of(number, f"mark {kind}", f"marks {kind}") for kind, number in counts.items() if number]
    return [f"the scheme blend has no use for {', '.join(found)}"] if found else []
