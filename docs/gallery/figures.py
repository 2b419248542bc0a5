"""The figures of the gallery: after the papers' figures, on our own sample meshes. Each is a row of panels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import curvify
from curvify.formats.dense import to_polygon_mesh
from curvify.gpu.scene import Layer, Lines, Panel, Stroke
from curvify.simplify import Options, simplify
from meshes import (
    SAMPLES,
    at_limit,
    by_patches,
    cone,
    creases,
    cube,
    curled,
    curves_of,
    loop_surface,
    marks_of,
    outlines,
    regions,
    sample,
    subdivided,
    tetrahedron,
    triangulated,
)

EDGES = Stroke(width=1.2)
CURVE = Stroke((0.10, 0.22, 0.45), 1.8)
SHARP = Stroke((0.85, 0.10, 0.08), 3.0)
FINE = Stroke(width=0.7)
LEVEL = 10
View = tuple[float, float] | None


@dataclass(frozen=True)
class Figure:
    """A picture: its name, the figure that it is after, what it shows, its panels, and settings of the picture."""

    name: str
    after: str
    caption: str
    panels: Callable[[], list[Panel]]
    settings: dict[str, Any] = field(default_factory=dict)


def coarse(mesh: curvify.PolygonMesh, text: str, sharp: object = None, view: View = None) -> Panel:
    """A coarse mesh with its edges, those that are sharp in red."""
    layers = [Layer(mesh, shading="flat", wire=EDGES)]
    if sharp is not None:
        layers.append(Layer(mesh, "hidden", lines=[Lines(mesh.positions[np.array(sharp)], SHARP)]))
    return Panel(layers, text, view)


def surface(mesh: curvify.PolygonMesh, text: str, wire: Stroke | None = None, **options: Any) -> Panel:
    """The surface of a mesh."""
    return Panel([Layer(curvify.refine(mesh, level=options.pop("level", LEVEL), **options), wire=wire)], text)


# --- Leung, Wang, Zhang: Gregory patches -----------------------------------------------------------------------------


def construction() -> list[Panel]:
    """The mesh, the curves of its edges, the grids of the patches, the surface."""
    mesh = sample("pawn")
    dense, grid = curvify.refine(mesh, level=LEVEL), curvify.refine(mesh, level=2)
    curves = [Lines(curves_of(dense), CURVE)]
    return [
        coarse(mesh, "polygons"),
        Panel([Layer(dense, "hidden", lines=curves), Layer(mesh, "hidden", wire=FINE)], "curves of the edges"),
        Panel([Layer(dense, lines=curves), Layer(grid, "hidden", wire=FINE)], "patches"),
        Panel([Layer(dense)], "surface"),
    ]


def simplified() -> list[Panel]:
    """Dense triangles, their regions, the regions' polygons before and after concave ones are split, the polygons after
    merging, and the surface over these.
    """
    dense = triangulated(to_polygon_mesh(curvify.refine(sample("pawn"), level=4)))
    options = Options(faces=110)
    found = simplify(dense, options)
    apart, shades, borders = regions(found)
    lines = [Lines(borders, Stroke(width=1.4))]
    whole, concave, pieces, diagonals = outlines(found, options)
    return [
        Panel([Layer(dense, shading="flat", wire=Stroke(width=0.4))], f"{dense.face_count:,} triangles"),
        Panel([Layer(apart, "values", shading="flat", values=shades, lines=lines)], "regions"),
        coarse(whole, "one polygon each", concave),
        coarse(pieces, "convex pieces", diagonals),
        coarse(found.mesh, f"merged: {found.mesh.face_count} polygons"),
        surface(found.mesh, "surface"),
    ]


def fullness() -> list[Panel]:
    """A cube whose top has the paper's alpha."""
    mesh = cube()
    panels = [coarse(mesh, "polygons")]
    for alpha in (0.25, 0.5, 1.0, 1.5):
        marks = curvify.Marks(full_faces=np.array([1]), alphas=np.array([alpha]))
        panels.append(surface(mesh, f"alpha {alpha:g}", cross_tangent="quadratic", marks=marks))
    return [*panels, surface(mesh, "linear", cross_tangent="linear")]


def rings() -> list[Panel]:
    """One ring in six shapes."""
    mesh = sample("ring")
    texts = {
        "ring-a-plain": "(a) no marks",
        "ring-b-flat": "(b) flat above and below",
        "ring-c-level": "(c) edge normals",
        "ring-d-cones": "(d) cones",
        "ring-e-flat-creased": "(e) flat, and a crease",
        "ring-f-creased": "(f) the crease alone",
    }
    return [surface(mesh, text, marks=marks_of(name)) for name, text in texts.items()]


def against_pn() -> list[Panel]:
    """Averaged normals, PN triangles and Gregory patches, lit and mirroring a striped room."""
    mesh = sample("mixed")
    return [
        Panel([Layer(mesh, shading="smooth")], "averaged normals"),
        surface(mesh, "PN triangles", scheme="pn"),
        surface(mesh, "Gregory patches"),
        Panel([Layer(mesh, "zebra", shading="smooth")], "reflections"),
        zebra_of_pn(mesh, "reflections"),
        zebra(mesh, "reflections"),
    ]


def zebra(mesh: curvify.PolygonMesh, text: str, **options: Any) -> Panel:
    """Reflection lines of a surface, by its own normals."""
    return Panel([Layer(curvify.refine(mesh, level=LEVEL, **options), "zebra")], text)


def zebra_of_pn(mesh: curvify.PolygonMesh, text: str) -> Panel:
    """Reflection lines of PN triangles by the normals of their fine faces: those that PN has hide its kinks."""
    return Panel([Layer(by_patches(curvify.refine(mesh, scheme="pn", level=3 * LEVEL)), "zebra")], text)


def smooth_and_sharp(name: str, marks: str) -> list[Panel]:
    """A mesh and its surface, without and with marks."""
    mesh, chosen = sample(name), marks_of(marks)
    return [
        coarse(mesh, "polygons"),
        surface(mesh, "smooth"),
        coarse(mesh, "creases in red", chosen.crease_edges),
        surface(mesh, "with creases", marks=chosen),
    ]


# --- Fünfzig, Müller, Hansford, Farin: PNG1 triangles ----------------------------------------------------------------


def silhouettes() -> list[Panel]:
    """PN and PNG1, lit and mirroring a striped room."""
    mesh = sample("dodecahedron")
    return [
        coarse(mesh, "polygons"),
        surface(mesh, "PN", scheme="pn"),
        zebra_of_pn(mesh, "its reflections"),
        surface(mesh, "PNG1", scheme="png1"),
        zebra(mesh, "its reflections", scheme="png1"),
    ]


def cones() -> list[Panel]:
    """A cone of six triangles."""
    mesh = cone()
    return [
        coarse(mesh, "triangles"),
        surface(mesh, "PNG1", scheme="png1", wire=FINE, level=4),
        surface(mesh, "PN", scheme="pn", wire=FINE, level=4),
    ]


def tetrahedra() -> list[Panel]:
    """A tetrahedron, smooth and with a creased face."""
    mesh, base = tetrahedron(), [[0, 1], [1, 2], [2, 0]]
    return [
        coarse(mesh, "triangles"),
        surface(mesh, "PNG1", scheme="png1"),
        surface(mesh, "kappa -0.1 below", scheme="png1", marks=curled(base, -0.1)),
    ]


def curled_knob() -> list[Panel]:
    """A turned part, smooth and with creases of a height."""
    mesh = triangulated(sample("knob"))
    ring = [[8 * row + k, 8 * row + (k + 1) % 8] for row in (0, 1, 4, 5) for k in range(8)]
    return [
        coarse(mesh, "triangles", ring),
        surface(mesh, "PNG1", scheme="png1"),
        surface(mesh, "kappa -0.05 on the red edges", scheme="png1", marks=curled(ring, -0.05)),
    ]


def loop_normals() -> list[Panel]:
    """Loop's surface, and PNG1 from its points with its normals and with averaged ones."""
    mesh = subdivided(triangulated(sample("mushroom")))
    limit = at_limit(mesh)
    averaged = limit.with_(corner_normals=None)
    return [
        coarse(mesh, "triangles"),
        Panel([Layer(loop_surface(mesh), shading="auto")], "Loop's limit surface"),
        surface(limit, "PNG1, Loop's normals", scheme="png1"),
        surface(averaged, "PNG1, averaged normals", scheme="png1"),
    ]


# --- Ko, Lee, Lim, Yoon: blending surfaces ---------------------------------------------------------------------------


def feature_kinds() -> list[Panel]:
    """A dart, a crease and corners, each beside the mesh."""
    panels = []
    for mesh, sharp, text in (
        (cube(), np.array([[4, 5], [5, 7]]), "darts"),
        (sample("ring"), marks_of("ring-f-creased").crease_edges, "crease"),
        (cube(), np.array([[5, 4], [5, 7], [5, 1]]), "corner"),
    ):
        panels += [coarse(mesh, "sharp edges", sharp), surface(mesh, text, scheme="blend", marks=creases(sharp))]
    return panels


def trimmed() -> list[Panel]:
    """A surface cut by an image on each of its faces."""
    mesh, mask = sample("torus"), curvify.read_mask(SAMPLES / "disc.png")
    whole = curvify.surface(mesh, scheme="blend")
    return [
        coarse(mesh, "polygons"),
        surface(mesh, "surface", scheme="blend"),
        Panel([Layer(whole.trim(mask, level=LEVEL))], "trimmed by a disc"),
    ]


def blended() -> list[Panel]:
    """Control meshes and their blending surfaces."""
    return [
        panel
        for name in ("torus", "mixed", "pawn")
        for panel in (coarse(sample(name), "polygons"), surface(sample(name), "surface", scheme="blend"))
    ]


def many_features() -> list[Panel]:
    """A pawn with creases, seen from two sides."""
    mesh, sharp = sample("pawn"), marks_of("pawn-sharp").crease_edges
    dense = curvify.refine(mesh, scheme="blend", level=LEVEL, marks=creases(sharp))
    above, below = (30.0, 25.0), (30.0, -35.0)
    return [
        coarse(mesh, "sharp edges", sharp, above),
        coarse(mesh, "from below", sharp, below),
        Panel([Layer(dense)], "surface", above),
        Panel([Layer(dense)], "from below", below),
    ]


# --- van Overveld, Wyvill: subdivision by normals --------------------------------------------------------------------


def vases() -> list[Panel]:
    """A vase whose rim swings, and one whose rim is kept in its plane."""
    mesh = sample("vase")
    return [
        coarse(mesh, "polygons"),
        Panel([Layer(mesh, shading="smooth")], "averaged normals"),
        surface(mesh, "rim not kept", scheme="overveld"),
        surface(mesh, "rim kept plane", scheme="overveld", rim=True),
    ]


def planar_top() -> list[Panel]:
    """A dodecahedron, one of whose faces is kept plane."""
    mesh = sample("dodecahedron")
    top = int(np.argmax([mesh.positions[face, 2].mean() for face in mesh.faces()]))
    return [
        coarse(mesh, "polygons"),
        surface(mesh, "nothing kept", scheme="overveld"),
        surface(mesh, "a face kept plane", scheme="overveld", planar=(top,)),
    ]
