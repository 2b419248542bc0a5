"""`curvify refine`: coarse mesh in, dense mesh out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

if TYPE_CHECKING:
    from curvify.cli.run import Run

EXAMPLES = (
    ("A smooth surface through the vertices of coarse.obj", "curvify refine coarse.obj dense.ply"),
    ("Finer, as triangles, with measurements", "curvify refine coarse.obj dense.stl -k 8 --report dense.json"),
    ("Sharp edges where faces turn by more than 40 degrees", "curvify refine coarse.obj dense.ply --sharp-angle 40"),
    ("How large would that be?", "curvify refine coarse.obj dense.ply -k 100 --dry-run"),
    ("A dense scan as a smooth surface over 500 polygons", "curvify refine coarse.obj smooth.ply --simplify 500"),
    (
        "A round hole in every face",
        "curvify refine coarse.obj dense.ply --scheme blend --trim disc.png",
    ),
    (
        "In a pipeline",
        "cat coarse.obj | curvify refine - - --input-format obj --output-format ply > dense.ply",
    ),
)


@click.command(name="refine", cls=Command, examples=EXAMPLES, short_help=COMMANDS["refine"])
@options.in_and_out
@options.with_options(
    options.scheme,
    options.level,
    options.cross_tangent,
    options.alpha,
    options.bulge,
    options.normals,
    options.chart,
    options.blend_order,
    options.kappa,
    options.crease_units,
    options.overveld,
    options.simplify,
    options.fit_first,
    options.marks,
    options.sharp_angle,
    options.sharp_from,
    options.sharp_model,
    options.boundary_corners,
    options.trim,
    options.trim_map,
    options.trim_mode,
    options.trim_invert,
    options.weld,
    options.split_rule,
    options.input_format,
    options.output_format,
    options.triangulate,
    options.weld_normals,
    options.precision,
    options.as_text,
    options.no_clobber,
    options.report,
    options.backend,
    options.threads,
    options.max_faces,
    options.dry_run,
    options.messages,
)
def command(**given: Any) -> Run:
    """Turn a coarse polygon mesh into a dense mesh of a smooth surface.

    The surface passes exactly through the vertices of IN. The suffixes of IN and OUT tell their formats (OBJ, PLY, OFF,
    STL, GLB, ...); '-' is standard input or output. OUT appears complete or not at all, and the same input gives the
    same bytes.
    """
    from curvify.cli.run import Request, refine_file

    return refine_file(Request(**given))
