"""`curvify fit`: a coarse mesh and a dense one in, the coarse one fitted to the dense one out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

if TYPE_CHECKING:
    from curvify.mesh import PolygonMesh
    from curvify.simplify import Fitted
    from curvify.simplify.triangles import Triangles

EXAMPLES = (
    (
        "A retopology against its scan",
        "curvify refine coarse.obj scan.ply && curvify fit coarse.obj scan.ply fitted.obj",
    ),
    (
        "Vertices stay where they are, and a report tells what was gained",
        "curvify refine coarse.obj scan.ply && curvify fit coarse.obj scan.ply fitted.ply --fit normals "
        "--report fit.json",
    ),
)


@click.command(name="fit", cls=Command, examples=EXAMPLES, short_help=COMMANDS["fit"])
@click.argument("coarse", metavar="COARSE", type=click.Path(allow_dash=True))
@click.argument("dense", metavar="DENSE", type=click.Path(allow_dash=True))
@click.argument("output", metavar="OUT", type=click.Path(allow_dash=True))
@options.with_options(
    options.fit_mode,
    options.sharp_angle,
    options.sharp_from,
    options.weld,
    options.input_format,
    options.output_format,
    options.precision,
    options.as_text,
    options.no_clobber,
    options.report,
    options.messages,
)
def command(**given: Any) -> None:
    """Fit a coarse mesh to a dense one, so that its surface comes back to it.

    Vertices move and normals tilt until the refined surface is as close to DENSE as it can be. COARSE must lie near
    DENSE, as a retopology made on a scan does. OUT has the faces of COARSE, with normals; its creases, rims and flat
    faces stay what they are, flat faces with their vertices. What DENSE has beyond COARSE pulls at the rims of COARSE.
    """
    fit_files(**given)


def fit_files(
    coarse: str,
    dense: str,
    output: str,
    fit: str,
    sharp_angle: float | None,
    sharp_from: str | None,
    weld: str | None,
    input_format: str | None,
    output_format: str | None,
    precision: str,
    ascii: bool,
    no_clobber: bool,
    report: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Read both, fit, write, measure. Raises CurvifyError."""
    import numpy as np

    from curvify.cli import files
    from curvify.cli.console import Console
    from curvify.cli.run import timed
    from curvify.errors import FormatError, MeshError, OptionError
    from curvify.formats import write_mesh
    from curvify.schemes.gregory import Options
    from curvify.simplify import Fit, fit_mesh
    from curvify.simplify.triangles import prepare_triangles
    from curvify.words import count_of

    console = Console(quiet, verbose)
    given: dict[str, Any] = {"sharp_angle": sharp_angle, "sharp_from": sharp_from, "weld": weld}
    wanted = Fit(fit, options=Options(**{name: value for name, value in given.items() if value is not None}))
    format = files.check_output(output, output_format, no_clobber)
    if ascii and format != "ply":
        raise OptionError(f"--ascii is for PLY; {format} has no such choice")
    if report == files.STREAM and output == files.STREAM:
        raise OptionError("OUT and --report cannot both be standard output")
    if coarse == dense == files.STREAM:
        raise OptionError("COARSE and DENSE cannot both be standard input")
    for path in (coarse, dense):
        files.check_input(path, input_format)
    if report is not None and report != files.STREAM:
        files.check_folder(report)
    seconds: dict[str, float] = {}
    names = [files.shown_name(path, "stdin") for path in (coarse, dense)]
    with timed(seconds, "read"):
        mesh, scan = (files.read_input(path, input_format) for path in (coarse, dense))
        with files.naming(names[1], MeshError):
            triangles, notes = prepare_triangles(scan, weld or "auto")
    with timed(seconds, "fit"), files.naming(names[0], MeshError), console.progress(names[0]) as progress:
        fitted = fit_mesh(mesh, triangles, wanted, progress.stage)
    warnings = [f"{names[0]}: {text}" for text in mesh.warnings]
    warnings += [f"{names[1]}: {text}" for text in [*scan.warnings, *notes]]
    for text in warnings:
        console.warn(text)
    kind = mesh.position_dtype if precision == "input" else np.dtype(precision)
    target = files.shown_name(output, "stdout")
    with timed(seconds, "write"), files.naming(target, FormatError):
        write_mesh(fitted.mesh, output, format, ascii=ascii, dtype=kind)
    steps = fitted.history[0]
    gain = f"{100 * steps[0]:.4f} % became {100 * steps[-1]:.4f} %"
    console.explain(f"{target}: a residual of {gain} in {count_of(len(steps) - 1, 'step')}")
    console.explain(", ".join(f"{stage} {took:.3f} s" for stage, took in seconds.items()))
    if report is not None:
        about = {"coarse": coarse, "dense": dense, "output": output, "options": {**given, "fit": fit}}
        _write_report(report, mesh, fitted, triangles, about, seconds, warnings)


def _write_report(
    path: str,
    mesh: PolygonMesh,
    fitted: Fitted,
    dense: Triangles,
    about: dict[str, Any],
    seconds: dict[str, float],
    warnings: list[str],
) -> None:
    """Measure both meshes and write it down: distances in shares of the bounding box's diagonal."""
    from curvify import __version__
    from curvify.cli.report import SCHEMA, write_report
    from curvify.cli.run import timed
    from curvify.simplify.accuracy import accuracy

    with timed(seconds, "measure"):
        found = {"distances": accuracy(fitted.mesh, dense), "distances_before_fit": accuracy(mesh, dense)}
    counts = {"faces": mesh.face_count, "vertices": mesh.vertex_count, "triangles": dense.face_count}
    write_report(
        path,
        {
            "schema": SCHEMA,
            "curvify": __version__,
            "command": "fit",
            **about,
            "counts": counts,
            "timings": seconds,
            **{key: {name: vars(part) for name, part in parts.items()} for key, parts in found.items()},
            "fit": {"residuals": fitted.history},
            "warnings": warnings,
        },
    )
