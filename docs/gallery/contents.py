"""What the gallery contains, paper by paper, and the page that shows it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from figures import (
    Figure,
    against_pn,
    blended,
    cones,
    construction,
    curled_knob,
    feature_kinds,
    fullness,
    loop_normals,
    many_features,
    planar_top,
    rings,
    silhouettes,
    simplified,
    smooth_and_sharp,
    tetrahedra,
    trimmed,
    vases,
)


@dataclass(frozen=True)
class Paper:
    """A paper, the scheme that it is about, and our figures after its."""

    title: str
    scheme: str
    figures: tuple[Figure, ...]


PAPERS = (
    Paper(
        "Leung, Wang, Zhang: Localized construction of curved surfaces from polygon meshes",
        "gregory",
        (
            Figure(
                "construction",
                "1",
                "From polygons to a surface: the pawn's 90 polygons; the curves of its edges, with the edges "
                "themselves thin in black; the patches between the curves, with their grids; the surface.",
                construction,
                {"size": (220, 300)},
            ),
            Figure(
                "simplified",
                "8",
                "From a dense mesh to polygons and back: the triangles; regions that are nearly flat, found by "
                "variational shape approximation; a polygon for each region, the concave ones with red outlines; those "
                "split along the red diagonals; neighbors merged again where the polygon stays convex and nearly flat; "
                "the surface, with the normals and creases that were found.",
                simplified,
                {"size": (220, 300), "columns": 3},
            ),
            Figure(
                "fullness",
                "13",
                "The top of a cube with the paper's cross tangents: the quadratic ones swell it the more the smaller "
                "its alpha is; at the right the linear ones, which have none. All other faces have an alpha of 1.",
                fullness,
                {"view": (30.0, 10.0), "size": (230, 240)},
            ),
            Figure(
                "rings",
                "15",
                "One ring of 48 quads in six shapes: (a) smooth everywhere; (b) with a flat top and bottom; (c) with "
                "edge normals that keep the edges around the axis level; (d) made of cones; (e) flat above and below, "
                "with a crease around the outside; (f) with that crease alone.",
                rings,
                {"columns": 3},
            ),
            Figure(
                "against-pn",
                "17",
                "A body of triangles, quads, pentagons and a hexagon. Averaged normals leave the outline of the "
                "polygons; PN triangles round it, but reflections break between them; on Gregory patches they run on.",
                against_pn,
                {"columns": 3, "stripes": 7},
            ),
            Figure(
                "mushroom",
                "18",
                "The mushroom's 20 polygons as a smooth surface, and with creases on the edges in red.",
                partial(smooth_and_sharp, "mushroom", "mushroom-sharp"),
            ),
            Figure(
                "pawn",
                "19",
                "The pawn as a smooth surface, and with creases on the edges in red.",
                partial(smooth_and_sharp, "pawn", "pawn-sharp"),
                {"size": (220, 300)},
            ),
        ),
    ),
    Paper(
        "Fünfzig, Müller, Hansford, Farin: PNG1 triangles for tangent plane continuous surfaces on the GPU",
        "png1",
        (
            Figure(
                "png1-silhouettes",
                "2",
                "A dodecahedron, which both schemes cut into triangles: PN triangles meet in kinks, at which "
                "reflections break; those of PNG1 triangles run on.",
                silhouettes,
                {"stripes": 6},
            ),
            Figure(
                "png1-cone",
                "9",
                "A cone of six triangles whose normals have its symmetry, seen from above: PNG1, and PN triangles.",
                cones,
                {"view": (15.0, 60.0)},
            ),
            Figure(
                "png1-tetrahedron",
                "10",
                "A tetrahedron with normals away from its middle: smooth, and with a kappa of -0.1 along the edges of "
                "its lowest face, which makes creases there.",
                tetrahedra,
                {"view": (20.0, -15.0)},
            ),
            Figure(
                "png1-creases",
                "12",
                "The knob in triangles: smooth, and with a kappa of -0.05 along the edges in red.",
                curled_knob,
            ),
            Figure(
                "png1-loop",
                "13",
                "A mushroom of 160 triangles; the limit of its subdivision after Loop; PNG1 from the points and "
                "normals of that limit, nearly the same shape; PNG1 from the points and averaged normals.",
                loop_normals,
            ),
        ),
    ),
    Paper(
        "Ko, Lee, Lim, Yoon: Construction and rendering of trimmed blending surfaces with sharp features on a GPU",
        "blend",
        (
            Figure(
                "blend-features",
                "3",
                "Sharp edges in red and what they make: darts, which fade where the edges end; a crease around the "
                "ring; a corner where three red edges of a cube meet.",
                feature_kinds,
                {"columns": 6, "size": (190, 180), "fit": "each"},
            ),
            Figure("blend-trim", "11", "A ring, cut on each of its faces by the image of a disc.", trimmed),
            Figure(
                "blend-surfaces",
                "12",
                "Three control meshes and their blending surfaces.",
                blended,
                {"columns": 6, "size": (190, 190), "fit": "each"},
            ),
            Figure(
                "blend-pawn", "14", "The pawn with sharp edges, in red, seen from above and from below.", many_features,
                {"size": (220, 280)},
            ),
        ),
    ),
    Paper(
        "van Overveld, Wyvill: An algorithm for polygon subdivision based on vertex normals",
        "overveld",
        (
            Figure(
                "overveld-vase",
                "plates 1 to 4",
                "A vase of ten sides: its polygons; the same with averaged normals, which leave the outline straight; "
                "subdivided, with a rim that swings up and down; with normals that keep the rim in its plane.",
                vases,
                {"view": (20.0, 18.0), "size": (220, 300)},
            ),
            Figure(
                "overveld-top",
                "planar polygons",
                "A dodecahedron: subdivided with averaged normals, and with one of its upper faces kept plane.",
                planar_top,
            ),
        ),
    ),
)


def page() -> str:
    """The text of docs/gallery.md."""
    parts = [
        "<!-- Made by docs/gallery/make_gallery.py: run `make gallery` after a change. -->",
        "# Gallery",
        "Figures of the papers that curvify is built on, drawn anew from our own\n"
        "[sample meshes](../sample_meshes/README.md) and some that [the gallery](gallery/meshes.py) makes itself.\n"
        "`make gallery` draws all of them.",
    ]
    for paper in PAPERS:
        parts += [f"## {paper.title}", f"`--scheme {paper.scheme}`"]
        for figure in paper.figures:
            after = f"Figure {figure.after}" if figure.after[0].isdigit() else figure.after.capitalize()
            parts += [f"![{figure.caption}](gallery/{figure.name}.png)", f"*{after}.* {figure.caption}"]
    return "\n\n".join(parts) + "\n"
