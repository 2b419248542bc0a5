"""Every option that a command may have, once, as a decorator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from curvify.cli.group import Option
from curvify.cli.parameters import FILE, POSITIVE, Length, Number, Whole
from curvify.schemes import NAMES

Function = TypeVar("Function", bound=Callable[..., Any])

SURFACE, SIMPLIFYING, SHARP, TRIMMING, MESH, OUTPUT, RUNNING, MESSAGES = (
    "Surface",
    "Simplifying",
    "Sharp features",
    "Trimming",
    "Input mesh",
    "Output",
    "Running",
    "Messages",
)


#: More faces than this in one range are a slip of the keyboard.
MOST_FACES = 10_000_000


def option(heading: str, *names: str, **attributes: Any) -> Callable[[Function], Function]:
    """An option under a heading of the help."""
    return click.option(*names, cls=Option, heading=heading, **attributes)


def with_options(*decorators: Callable[[Any], Any]) -> Callable[[Function], Function]:
    """Several options, in the order of the help."""

    def decorate(function: Function) -> Function:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


in_and_out = with_options(
    click.argument("input", metavar="IN", type=FILE),
    click.argument("output", metavar="OUT", type=FILE),
)

only_in = click.argument("input", metavar="IN", type=FILE)

# --- surface ----------------------------------------------------------------------------------------------------

scheme = option(
    SURFACE,
    "--scheme",
    type=click.Choice(NAMES),
    default=NAMES[0],
    show_default=True,
    help="How the surface is made; 'curvify schemes' explains.",
)
level = option(
    SURFACE,
    "-k",
    "--level",
    type=POSITIVE,
    default=5,
    show_default=True,
    help="Every edge becomes 2 K segments, a polygon with n sides n K^2 quads, a triangle of the triangle schemes "
    "(2 K)^2 triangles.",
    metavar="K",
)
cross_tangent = option(
    SURFACE,
    "--cross-tangent",
    type=click.Choice(["precise", "smooth", "linear", "quadratic"]),
    help="How fast the surface leaves the edges: 'precise' for accuracy, 'smooth' its forerunner, the others as in "
    "the paper.  [default: precise]",
)
alpha = option(
    SURFACE,
    "--alpha",
    type=float,
    metavar="A",
    help="Fullness of 'quadratic', above 0  [default: 1]; of phong, from 0 to 1  [default: 0.75]",
)
bulge = option(
    SURFACE,
    "--bulge",
    type=float,
    metavar="B",
    help="Swell faces by this part of their size, of 'precise' and 'smooth'; below 0, sink them.  [default: 0]",
)
normals = option(
    SURFACE,
    "--normals",
    type=click.Choice(["exact", "paper", "smooth"]),
    help="Normals of the surface itself; the paper's approximation (gregory); or such as vary smoothly (png1).  "
    "[default: exact]",
)
kappa = option(
    SURFACE,
    "--kappa",
    type=float,
    metavar="K",
    help="png1: lift faces along their creases by this length; below 0, sharper ridges.  [default: 0]",
)
crease_units = option(
    SURFACE,
    "--crease-units",
    type=click.Choice(["absolute", "edge"]),
    help="Whether kappa is a length or a share of the edge's.  [default: absolute]",
)


def face_list(context: click.Context, parameter: click.Parameter, value: str | None) -> tuple[int, ...]:
    """Faces from text such as ``3,7-9``."""
    faces: list[int] = []
    for part in [] if value is None else value.split(","):
        first, dash, last = (piece.strip() for piece in part.partition("-"))
        plain = first.isdecimal() and (last.isdecimal() if dash else not last)
        if not plain or not 0 <= int(last or first) - int(first) < MOST_FACES:
            raise click.BadParameter(f"{part!r} is no face or range of faces; write for example 3,7-9")
        faces += range(int(first), int(last or first) + 1)
    return tuple(faces)


overveld = with_options(
    option(
        SURFACE,
        "--depth",
        type=POSITIVE,
        metavar="D",
        help="overveld: passes; each halves every edge.  [default: enough for --level]",
    ),
    option(
        SURFACE,
        "--max-edge",
        type=float,
        metavar="L",
        help="overveld: halve only edges longer than this, until none is left.",
    ),
    option(
        SURFACE,
        "--edge-rule",
        type=click.Choice(["curvature", "stretched"]),
        help="overveld: how edges bend.  [default: curvature]",
    ),
    option(
        SURFACE,
        "--midpoint-normal",
        type=click.Choice(["quad", "perp", "avg", "geometry"]),
        help="overveld: normals in the middle of edges: quadratic, across the curve, mean, or of the new triangles.  "
        "[default: quad]",
    ),
    option(
        SURFACE,
        "--apex",
        type=float,
        metavar="LAMBDA",
        help="overveld: apex of polygons over 4 sides, from full (0) to their middle (1).  [default: 0]",
    ),
    option(SURFACE, "--rim", is_flag=True, help="overveld: keep plane rims of open meshes plane."),
    option(
        SURFACE,
        "--planar",
        metavar="FACES",
        callback=face_list,
        help="overveld: keep these faces plane, for example 3,7-9 (counted from 0).",
    ),
)

chart = option(
    SURFACE,
    "--chart",
    type=click.Choice(["auto", "conformal", "polar"]),
    help="blend: the parameters around a vertex: the paper's, polar ones, or for each number of faces the better.  "
    "[default: auto]",
)
blend_order = option(
    SURFACE,
    "--blend-order",
    type=click.Choice(["3", "5"]),
    callback=lambda _context, _parameter, value: None if value is None else int(value),
    help="blend: degree of the blending function; 5 bounds the curvature at vertices of three faces.  [default: 3]",
)

# --- simplifying ------------------------------------------------------------------------------------------------

faces = option(SIMPLIFYING, "--faces", type=POSITIVE, metavar="N", help="How many polygons there should be.")
proxies = option(
    SIMPLIFYING, "--proxies", type=POSITIVE, metavar="K", help="Make polygons of so many regions, instead of --faces."
)
compactness = option(
    SIMPLIFYING,
    "--compactness",
    type=Number(min=0),
    default=4.0,
    show_default=True,
    metavar="L",
    help="Weight of short regions against flat ones; try 16 for smooth organic shapes, 0 for flat ones only.",
)
dense_angle = option(
    SIMPLIFYING,
    "--sharp-angle",
    type=Number(min=0, max=180, min_open=True),
    default=30.0,
    show_default=True,
    metavar="DEG",
    help="Where the triangles of IN turn by more than this, they are sharp.",
)
simplify = option(
    SIMPLIFYING,
    "--simplify",
    type=POSITIVE,
    metavar="N",
    help="First turn IN into N polygons, as 'curvify simplify --faces N' does.",
)
FITS = click.Choice(["none", "normals", "full"])
fit = option(
    SIMPLIFYING,
    "--fit",
    type=FITS,
    default="full",
    show_default=True,
    help="What is fitted to IN so that refining OUT comes back to it: vertices and normals, normals only, or nothing.",
)
fit_first = option(
    SIMPLIFYING,
    "--fit",
    type=FITS,
    help="What is fitted as with 'curvify simplify'  [default: full for gregory, none for other schemes]",
)
fit_mode = option(
    SIMPLIFYING,
    "--fit",
    type=click.Choice(["normals", "full"]),
    default="full",
    show_default=True,
    help="What is fitted: vertices and normals, or normals only.",
)
max_error = option(
    SIMPLIFYING,
    "--max-error",
    type=Length(),
    metavar="E",
    help="Spend up to a fifth of the faces where the refined surface is farther from IN than this, in units of the "
    "file or as a share of the diagonal: 0.2%.",
)

# --- trimming ---------------------------------------------------------------------------------------------------

trim = option(
    TRIMMING,
    "--trim",
    metavar="FILE",
    help="Keep what a PNG image has white. Needs memory for the whole dense mesh.",
)
trim_map = option(
    TRIMMING,
    "--trim-map",
    type=click.Choice(["face", "uv"]),
    help="Lay the image on each quad, from its first corner on, and on each of the n quads of other polygons, without "
    "regard to neighbors (face); or on the mesh by its texture coordinates (uv).  [default: face]",
)
trim_mode = option(
    TRIMMING,
    "--trim-mode",
    type=click.Choice(["clip", "drop"]),
    help="Cut along the image, or leave out the cells that are not kept whole. What is smaller than a cell is missed.  "
    "[default: clip]",
)
trim_invert = option(TRIMMING, "--trim-invert", is_flag=True, help="Keep what is black instead.")

# --- input ------------------------------------------------------------------------------------------------------

marks = option(
    SHARP,
    "--marks",
    metavar="FILE",
    help="Creases, straight edges, flat faces and more from a JSON file, over what IN says itself; "
    "'curvify marks' writes one to start from.",
)
sharp_angle = option(
    SHARP,
    "--sharp-angle",
    type=float,
    metavar="DEG",
    help="Make edges sharp at which the faces turn by more than this angle.",
)
sharp_model = option(
    SHARP,
    "--sharp-model",
    type=click.Choice(["sided", "paper", "paper-fixed"]),
    help="blend: a surface on each side of a crease; the points and curves of the paper; those with its misprints "
    "mended. A crease shows only where the mesh bends.  [default: sided]",
)
boundary_corners = option(
    SHARP,
    "--boundary-corners",
    type=click.Choice(["keep", "smooth"]),
    help="blend: keep the corners of open boundaries, or smooth them.  [default: keep]",
)
sharp_from = option(
    SHARP,
    "--sharp-from",
    type=click.Choice(["auto", "none", "angle", "normals", "groups", "tags"]),
    help="What of IN makes edges sharp: its tags, else normals that differ (unless they only repeat flat faces), else "
    "smoothing groups, else --sharp-angle (auto); one of these alone, normals in any case; or nothing (none).  "
    "[default: auto]",
)
weld = option(
    MESH,
    "--weld",
    type=click.Choice(["auto", "always", "never"]),
    help="Close seams between open edges that coincide (auto), merge all equal positions (always), or neither.  "
    "[default: auto]",
)
split_rule = option(
    MESH,
    "--split-rule",
    type=click.Choice(["best", "closest"]),
    help="How concave faces are cut: few well-shaped pieces, or the paper's rule.  [default: best]",
)
max_sides = option(
    MESH,
    "--max-sides",
    type=Whole(min=3),
    default=64,
    show_default=True,
    metavar="N",
    help="Cut faces with more sides than this.",
)
input_format = option(
    MESH, "--input-format", metavar="NAME", help="Format of IN where its suffix does not tell: obj, ply, off, stl, ..."
)

# --- output -----------------------------------------------------------------------------------------------------

output_format = option(
    OUTPUT, "--output-format", metavar="NAME", help="Format of OUT where its suffix does not tell, as for '-'."
)
triangulate = option(OUTPUT, "--triangulate", is_flag=True, help="Write triangles instead of quads.")
weld_normals = option(
    OUTPUT, "--weld-normals", is_flag=True, help="Give every vertex one normal, the mean of its sides, also on creases."
)
precision = option(
    OUTPUT,
    "--precision",
    type=click.Choice(["input", "float32", "float64"]),
    default="input",
    show_default=True,
    help="Type of the numbers in OUT; 'input' is that of a PLY file, float32 for others.",
)
as_text = option(OUTPUT, "--ascii", "ascii", is_flag=True, help="Write PLY as text.")
as_json = option(OUTPUT, "--json", "as_json", is_flag=True, help="Print JSON.")
no_clobber = option(OUTPUT, "--no-clobber", is_flag=True, help="Fail if OUT exists already.")
report = option(
    OUTPUT, "--report", metavar="FILE", help="Write measurements of the surface and the run as JSON; '-' for stdout."
)

# --- running ----------------------------------------------------------------------------------------------------

backend = option(
    RUNNING,
    "--backend",
    type=click.Choice(["auto", "cpu", "gpu"]),
    default="auto",
    show_default=True,
    help="What evaluates the surface; 'auto' is the GPU for large work if there is one, 'curvify backends' explains.",
)
threads = option(
    RUNNING,
    "--threads",
    type=POSITIVE,
    metavar="N",
    help="Threads to use; the result does not depend on it.  [default: one per processor]",
)
max_faces = option(
    RUNNING,
    "--max-faces",
    type=POSITIVE,
    default=50_000_000,
    show_default=True,
    metavar="N",
    help="Refuse to make more faces than this.",
)
dry_run = option(RUNNING, "--dry-run", is_flag=True, help="Say how large OUT would be and stop.")

# --- messages ---------------------------------------------------------------------------------------------------

quiet = option(MESSAGES, "-q", "--quiet", is_flag=True, help="No warnings and no progress bar, only errors.")
verbose = option(MESSAGES, "-v", "--verbose", is_flag=True, help="Explain what was done and how long it took.")
messages = with_options(quiet, verbose)


#: Where a command that changes polygons writes them, and how.
polygons_out = with_options(input_format, output_format, precision, as_text, no_clobber, messages)
