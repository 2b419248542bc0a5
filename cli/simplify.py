"""`curvify simplify`: a dense mesh in, few convex polygons with normals and marks out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

if TYPE_CHECKING:
    from curvify.mesh import PolygonMesh

EXAMPLES = (
    ("About 2000 polygons", "curvify simplify coarse.obj few.obj --faces 2000"),
    ("There and back", "curvify simplify coarse.obj few.ply --faces 500 && curvify refine few.ply smooth.ply"),
    ("How far the result is from the input", "curvify simplify coarse.obj few.obj --faces 500 --report few.json"),
    ("Polygons with their vertices on IN", "curvify simplify coarse.obj few.obj --faces 500 --fit none"),
)


@click.command(name="simplify", cls=Command, examples=EXAMPLES, short_help=COMMANDS["simplify"])
@options.in_and_out
@options.with_options(
    options.faces,
    options.proxies,
    options.fit,
    options.max_error,
    options.compactness,
    options.dense_angle,
    options.weld,
    options.split_rule,
    options.polygons_out,
    options.report,
)
def command(**given: Any) -> None:
    """Turn a dense triangle mesh into few convex polygons that refine back to it.

    Normals, creases and flat faces are written along, so that 'curvify refine' needs no options. Normals and vertices
    are fitted: the refined surface, not the polygons, comes as close to IN as it can. With '--fit none' the vertices
    lie on IN. Closed meshes stay closed, and the topology stays as it is. The same input gives the same bytes.
    """
    simplify_file(**given)


def simplify_file(
    input: str,
    faces: int | None,
    proxies: int | None,
    fit: str,
    max_error: tuple[float, bool] | None,
    compactness: float,
    sharp_angle: float,
    weld: str | None,
    split_rule: str | None,
    report: str | None,
    quiet: bool,
    verbose: bool,
    **ends: Any,
) -> None:
    """Read, simplify, fit, write, measure. Raises CurvifyError."""
    from curvify.cli import files
    from curvify.cli.console import Console
    from curvify.cli.polygons import Ends
    from curvify.cli.run import timed
    from curvify.errors import MeshError, OptionError
    from curvify.simplify import Fit, Options, simplify_and_fit
    from curvify.words import count_of

    console = Console(quiet, verbose)
    if faces is None and proxies is None:
        raise OptionError("how far? give --faces, for example --faces 1000")
    chosen = Options(faces, proxies, compactness, sharp_angle, split_rule or "best", weld or "auto")
    there = Ends({"IN": input}, report=report, **ends)
    format = there.check()
    seconds: dict[str, float] = {}
    with timed(seconds, "read"):
        (mesh,) = there.read()
    wanted = Fit(fit, max_error=share_of_diagonal(max_error, mesh))
    (name,) = there.names
    with timed(seconds, "simplify"), files.naming(name, MeshError), console.progress(name) as progress:
        result = simplify_and_fit(mesh, chosen, wanted, progress.stage)
    warnings = [*(f"{name}: {text}" for text in result.warnings), *there.losses(format)]
    for text in warnings:
        console.warn(text)
    with timed(seconds, "write"):
        there.write(result.mesh, format, mesh)
    counts = result.counts
    console.explain(
        f"{there.target}: {count_of(counts['triangles'], 'triangle')} became {count_of(counts['faces'], 'face')} on "
        f"{count_of(counts['vertices'], 'vertex', 'vertices')}, with {count_of(counts['crease_edges'], 'crease edge')} "
        f"and {count_of(counts['flat_faces'], 'flat face')}"
    )
    console.explain_times(seconds)
    if report is not None:
        from curvify.cli.report import write_fit_report

        every = vars(chosen) | {"fit": fit, "max_error": wanted.max_error}
        about = {"input": input, "output": there.output, "options": every, "counts": counts}
        start = result.simplified
        write_fit_report(report, "simplify", about, start.mesh, result.fitted, start.original, seconds, warnings)


def share_of_diagonal(length: tuple[float, bool] | None, mesh: PolygonMesh) -> float | None:
    """A length of the command line as a share of the mesh's diagonal. Raises OptionError for 0."""
    import numpy as np

    from curvify.errors import OptionError

    if length is None:
        return None
    number, is_share = length
    if number == 0:
        raise OptionError("no surface comes closer than 0; give a larger --max-error")
    if is_share or not mesh.face_count:
        return number
    return number / max(float(np.linalg.norm(np.ptp(mesh.positions[mesh.face_vertices], axis=0))), 1e-300)
