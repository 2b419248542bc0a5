"""`curvify simplify`: a dense mesh in, few convex polygons with normals and marks out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

if TYPE_CHECKING:
    from curvify.mesh import PolygonMesh
    from curvify.simplify.pipeline import Result

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
    options.input_format,
    options.output_format,
    options.precision,
    options.as_text,
    options.no_clobber,
    options.report,
    options.messages,
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
    output: str,
    faces: int | None,
    proxies: int | None,
    fit: str,
    max_error: tuple[float, bool] | None,
    compactness: float,
    sharp_angle: float,
    weld: str | None,
    split_rule: str | None,
    input_format: str | None,
    output_format: str | None,
    precision: str,
    ascii: bool,
    no_clobber: bool,
    report: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Read, simplify, fit, write, measure. Raises CurvifyError."""
    import numpy as np

    from curvify.cli import files
    from curvify.cli.console import Console
    from curvify.cli.run import timed
    from curvify.errors import FormatError, MeshError, OptionError
    from curvify.formats import write_mesh
    from curvify.simplify import Fit, Options, simplify_and_fit
    from curvify.words import count_of

    console = Console(quiet, verbose)
    if faces is None and proxies is None:
        raise OptionError("how far? give --faces, for example --faces 1000")
    chosen = Options(faces, proxies, compactness, sharp_angle, split_rule or "best", weld or "auto")
    format = files.check_output(output, output_format, no_clobber)
    if ascii and format != "ply":
        raise OptionError(f"--ascii is for PLY; {format} has no such choice")
    if report == files.STREAM and output == files.STREAM:
        raise OptionError("OUT and --report cannot both be standard output")
    files.check_input(input, input_format)
    if report is not None and report != files.STREAM:
        files.check_folder(report)
    seconds: dict[str, float] = {}
    with timed(seconds, "read"):
        mesh = files.read_input(input, input_format)
    wanted = Fit(fit, max_error=share_of_diagonal(max_error, mesh))
    name, target = files.shown_name(input, "stdin"), files.shown_name(output, "stdout")
    with timed(seconds, "simplify"), files.naming(name, MeshError), console.progress(name) as progress:
        result = simplify_and_fit(mesh, chosen, wanted, progress.stage)
    warnings = [f"{name}: {text}" for text in result.warnings]
    for text in warnings:
        console.warn(text)
    kind = mesh.position_dtype if precision == "input" else np.dtype(precision)
    with timed(seconds, "write"), files.naming(target, FormatError):
        write_mesh(result.mesh, output, format, ascii=ascii, dtype=kind)
    counts = result.counts
    console.explain(
        f"{target}: {count_of(counts['triangles'], 'triangle')} became {count_of(counts['faces'], 'face')} on "
        f"{count_of(counts['vertices'], 'vertex', 'vertices')}, with {count_of(counts['crease_edges'], 'crease edge')} "
        f"and {count_of(counts['flat_faces'], 'flat face')}"
    )
    console.explain(", ".join(f"{stage} {took:.3f} s" for stage, took in seconds.items()))
    if report is not None:
        every = vars(chosen) | {"fit": fit, "max_error": wanted.max_error}
        about = {"input": input, "output": output, "options": every}
        _write_report(report, result, about, seconds, warnings)


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


def _write_report(
    path: str, result: Result, about: dict[str, Any], seconds: dict[str, float], warnings: list[str]
) -> None:
    """Measure what was made and write it down: distances in shares of the bounding box's diagonal."""
    from curvify import __version__
    from curvify.cli.report import SCHEMA, write_report
    from curvify.cli.run import timed
    from curvify.simplify.accuracy import accuracy

    simplified, fitted = result.simplified, result.fitted
    with timed(seconds, "measure"):
        found = {"distances": accuracy(result.mesh, simplified.original)}
        if fitted.history:
            found["distances_before_fit"] = accuracy(simplified.mesh, simplified.original)
    write_report(
        path,
        {
            "schema": SCHEMA,
            "curvify": __version__,
            "command": "simplify",
            **about,
            "counts": result.counts,
            "timings": seconds,
            **{key: {name: vars(part) for name, part in parts.items()} for key, parts in found.items()},
            "fit": {"residuals": fitted.history, "max_error": fitted.largest} if fitted.history else None,
            "warnings": warnings,
        },
    )
