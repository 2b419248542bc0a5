"""`curvify fit`: a coarse mesh and a dense one in, the coarse one fitted to the dense one out."""

from __future__ import annotations

from typing import Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

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
#: A residual, as a share of the diagonal, that meshes which belong together do not keep.
FAR = 0.05


@click.command(name="fit", cls=Command, examples=EXAMPLES, short_help=COMMANDS["fit"])
@click.argument("coarse", metavar="COARSE", type=click.Path(allow_dash=True))
@click.argument("dense", metavar="DENSE", type=click.Path(allow_dash=True))
@click.argument("output", metavar="OUT", type=click.Path(allow_dash=True))
@options.with_options(
    options.fit_mode,
    options.sharp_angle,
    options.sharp_from,
    options.weld,
    options.polygons_out,
    options.report,
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
    fit: str,
    sharp_angle: float | None,
    sharp_from: str | None,
    weld: str | None,
    report: str | None,
    quiet: bool,
    verbose: bool,
    **ends: Any,
) -> None:
    """Read both, fit, write, measure. Raises CurvifyError."""
    from curvify.cli import files
    from curvify.cli.console import Console
    from curvify.cli.polygons import Ends
    from curvify.cli.run import timed
    from curvify.errors import MeshError
    from curvify.schemes.gregory import Options
    from curvify.simplify import Fit, fit_mesh
    from curvify.simplify.triangles import prepare_triangles
    from curvify.words import count_of

    console = Console(quiet, verbose)
    given: dict[str, Any] = {"sharp_angle": sharp_angle, "sharp_from": sharp_from, "weld": weld}
    wanted = Fit(fit, options=Options(**{name: value for name, value in given.items() if value is not None}))
    there = Ends({"COARSE": coarse, "DENSE": dense}, report=report, **ends)
    format = there.check()
    seconds: dict[str, float] = {}
    names = there.names
    with timed(seconds, "read"):
        mesh, scan = there.read()
        with files.naming(names[1], MeshError):
            triangles, notes = prepare_triangles(scan, weld or "auto")
    with timed(seconds, "fit"), files.naming(names[0], MeshError), console.progress(names[0]) as progress:
        fitted = fit_mesh(mesh, triangles, wanted, progress.stage)
    steps = fitted.history[0]
    if steps[-1] > FAR:
        notes.append(f"the fitted surface stays {100 * steps[-1]:.3g} % of the diagonal away from it; are they a pair?")
    warnings = [f"{names[0]}: {text}" for text in mesh.warnings]
    warnings += [f"{names[1]}: {text}" for text in [*scan.warnings, *notes]]
    warnings += there.losses(format)
    for text in warnings:
        console.warn(text)
    with timed(seconds, "write"):
        there.write(fitted.mesh, format, mesh)
    gain = f"{100 * steps[0]:.4f} % became {100 * steps[-1]:.4f} %"
    console.explain(f"{there.target}: a residual of {gain} in {count_of(len(steps) - 1, 'step')}")
    console.explain_times(seconds)
    if report is not None:
        from curvify.cli.report import write_fit_report

        counts = {"faces": mesh.face_count, "vertices": mesh.vertex_count, "triangles": triangles.face_count}
        about = {"coarse": coarse, "dense": dense, "output": there.output, "options": {**given, "fit": fit}}
        write_fit_report(report, "fit", {**about, "counts": counts}, mesh, fitted, triangles, seconds, warnings)
