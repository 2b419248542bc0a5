"""`curvify compare`: do two meshes agree? The exit code tells."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options
from curvify.cli.answers import print_json
from curvify.cli.group import COMMANDS, Command
from curvify.cli.parameters import FILE, POSITIVE, Length, Number

if TYPE_CHECKING:
    from curvify.mesh import Floats, PolygonMesh

EXAMPLES = (
    (
        "A golden check: is the output still what was stored?",
        "curvify refine coarse.obj now.ply && curvify compare golden.ply now.ply --tolerance 0.0001%",
    ),
    (
        "How far is a finer mesh from a coarser one of the same surface?",
        "curvify refine coarse.obj fine.ply -k 9 && curvify compare golden.ply fine.ply --surface",
    ),
    ("Where do they differ?", "curvify compare golden.ply coarse.obj --surface --heatmap heat.ply"),
)
#: Formats that hold vertex colors, and a picture.
HEAT_FORMATS = ("png", "ply", "obj", "off", "glb")


@click.command(name="compare", cls=Command, examples=EXAMPLES, short_help=COMMANDS["compare"])
@click.argument("a", metavar="A", type=FILE)
@click.argument("b", metavar="B", type=FILE)
@options.with_options(
    options.option(
        "Tolerances",
        "--tolerance",
        type=Length(),
        metavar="T",
        help="How far points may be apart, in units of the file, or as a share of the diagonal of A: 0.001%. Without "
        "it every number must be equal.",
    ),
    options.option(
        "Tolerances",
        "--normal-tolerance",
        type=Number(min=0, max=180),
        metavar="DEG",
        help="How far normals may be apart.  [default: 0.1 with --tolerance]",
    ),
    options.option(
        "Comparison",
        "--surface",
        is_flag=True,
        help="Compare the surfaces, whatever the faces: the largest distance and the mean one, over samples of both.",
    ),
    options.option(
        "Comparison",
        "--samples",
        type=POSITIVE,
        default=100_000,
        show_default=True,
        metavar="N",
        help="Points on each mesh for --surface.",
    ),
    options.input_format,
    options.option(
        "Output",
        "--heatmap",
        metavar="FILE",
        help="Write B with vertex colors that show how far it is from A: from dark, not at all, to light, the most; "
        "with the suffix .png, a picture of it.",
    ),
    options.as_json,
    options.quiet,
)
def command(**given: Any) -> None:
    """Compare two meshes; the exit code tells whether they agree.

    It is 0 if B agrees with A, 1 if it does not. Without --surface the faces must be the same, and positions, normals,
    texture coordinates, colors, materials and groups are compared vertex by vertex; the worst is named. With --surface
    the faces do not matter: distances are measured between the surfaces, both ways, and compared with the tolerances
    that are given; without any, the answer is the measurements and the exit code 0. Vertices and faces are counted
    from 0.
    """
    compare_files(**given)


def compare_files(
    a: str,
    b: str,
    tolerance: tuple[float, bool] | None,
    normal_tolerance: float | None,
    surface: bool,
    samples: int,
    input_format: str | None,
    heatmap: str | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Read both, compare, print; ends the command with 1 where they differ. Raises CurvifyError."""
    from curvify.cli import files
    from curvify.errors import OptionError

    if a == b == files.STREAM:
        raise OptionError("A and B cannot both be standard input")
    if heatmap is not None:
        check_heatmap(heatmap)
    one, other = (_read(path, input_format) for path in (a, b))
    limit = _length(tolerance, one)
    answer = compare(one, other, limit, normal_tolerance, surface, samples)
    if heatmap is not None:
        answer["heatmap"] = write_heatmap(heatmap, one, other, surface)
    passed = all(finding.passed for finding in answer["checks"])
    if as_json:
        checks = [finding.as_dict() for finding in answer["checks"]]
        print_json("compare", {"a": a, "b": b, "passed": passed, **answer, "checks": checks})
    elif not quiet:
        click.echo("\n".join(_lines(files.shown_name(b, "stdin"), answer)))
    if not passed:
        click.get_current_context().exit(1)


def _read(path: str, format: str | None) -> PolygonMesh:
    """A mesh with a surface; ``format`` counts where the suffix does not tell."""
    from curvify.cli import files
    from curvify.errors import MeshError

    mesh, name = files.open_input(path, files.format_of(path, format))
    if not mesh.face_count:
        raise MeshError(f"{name}: the mesh has no faces; give a mesh with polygons")
    return mesh


def _length(tolerance: tuple[float, bool] | None, mesh: PolygonMesh) -> float | None:
    """The tolerance in units of the file."""
    if tolerance is None or not tolerance[1]:
        return None if tolerance is None else tolerance[0]
    import numpy as np

    return tolerance[0] * float(np.linalg.norm(np.ptp(mesh.positions, axis=0)))


def compare(
    a: PolygonMesh, b: PolygonMesh, tolerance: float | None, normals: float | None, surface: bool, samples: int
) -> dict[str, Any]:
    """The findings as ``checks``, and what was measured between the surfaces as ``apart``."""
    from curvify.compare import compare_meshes, compare_surfaces

    if not surface:
        return {"checks": compare_meshes(a, b, tolerance or 0.0, normals)}
    checks, apart = compare_surfaces(a, b, tolerance, normals, samples)
    return {"checks": checks, "apart": apart.as_dict()}


def check_heatmap(path: str) -> None:
    """Raise CurvifyError where the heat map cannot be written, so far as that is known before the work."""
    from curvify.cli import files
    from curvify.formats import find_format

    find_format(path, None, HEAT_FORMATS)
    files.check_folder(path)


def write_heatmap(path: str, a: PolygonMesh, b: PolygonMesh, surface: bool) -> dict[str, Any]:
    """Write B, colored by its distance from A; what the colors mean."""
    from curvify.deviation import deviations, heat_map
    from curvify.formats import write_mesh

    values = deviations(b, a, surface)
    most = float(values.max())
    if path.lower().endswith(".png"):
        draw_heatmap(path, b, values, most)
    else:
        write_mesh(heat_map(b, values, most), path)
    return {"file": path, "most": most}


def draw_heatmap(path: str, mesh: PolygonMesh, values: Floats, most: float) -> None:
    """Write a picture of the mesh from two opposite sides, colored by its distances ``(V,)``, with their scale."""
    from curvify.cli import files
    from curvify.gpu.picture import picture, to_png
    from curvify.gpu.scale import Scale
    from curvify.gpu.scene import Layer, Panel, Settings

    azimuth, elevation = Settings().view
    views = (azimuth, elevation), (azimuth + 180, -elevation)
    panels = [Panel([Layer(mesh, "values", values=values)], view=view) for view in views]
    settings = Settings(size=(600, 500), scale=Scale(0.0, most, "distance, units of the file"))
    files.write_bytes(to_png(picture(panels, settings)), path)


def _lines(name: str, answer: dict[str, Any]) -> list[str]:
    from curvify.cli.console import as_line

    lines = [as_line(name, finding, finding.name) for finding in answer["checks"]]
    if len(lines) == 1 and "apart" not in answer:  # the topology differs
        lines[0] += "; --surface compares what has other faces"
    apart, heat = answer.get("apart"), answer.get("heatmap")
    if apart is not None and not answer["checks"]:
        lines.append(
            f"{name}: up to {apart['hausdorff']:.4g} apart, {100 * apart['share']:.3g} % of A's diagonal, "
            f"rms {apart['rms']:.4g}, mean {apart['mean']:.4g}; normals "
            f"{apart['normal_most']:.3g} degrees in 99 of 100 places, {apart['normal_mean']:.3g} in the mean"
        )
    if heat is not None:
        lines.append(f"{heat['file']}: the lightest color stands for {heat['most']:.4g}")
    return lines
