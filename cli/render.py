"""`curvify render`: meshes in, a picture out."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

if TYPE_CHECKING:
    from curvify.cli.console import Console
    from curvify.gpu.scene import Layer, Settings
    from curvify.mesh import PolygonMesh

EXAMPLES = (
    ("A picture of a mesh, its polygons drawn in", "curvify render coarse.obj picture.png --wire"),
    (
        "Reflection lines, here of averaged normals: they break where the surface has a kink",
        "curvify render coarse.obj zebra.png --style zebra --shading smooth",
    ),
    (
        "The surface under the mesh that it was made from",
        "curvify refine coarse.obj - --output-format ply | curvify render - both.png --control coarse.obj",
    ),
    (
        "Side by side, from above, on nothing",
        "curvify render coarse.obj coarse.obj pair.png --view 0,60 --background transparent --size 400x400",
    ),
)

PICTURE, LOOK = "Picture", "Look"


@click.command(name="render", cls=Command, examples=EXAMPLES, short_help=COMMANDS["render"])
@click.argument("inputs", metavar="IN...", nargs=-1, required=True, type=click.Path(allow_dash=True))
@click.argument("output", metavar="OUT", type=click.Path(allow_dash=True))
@options.with_options(
    options.option(
        LOOK,
        "--style",
        type=click.Choice(["shaded", "zebra", "normals"]),
        default="shaded",
        show_default=True,
        help="Light and shade; the reflection of a striped room, which breaks where the surface has a kink; normals "
        "as colors.",
    ),
    options.option(
        LOOK,
        "--shading",
        type=click.Choice(["auto", "flat", "smooth"]),
        default="auto",
        show_default=True,
        help="Normals to shade with: the file's, or where it has none flat for coarse meshes and smooth for fine ones "
        "(auto); each face's own (flat); averages at the vertices (smooth).",
    ),
    options.option(LOOK, "--wire", is_flag=True, help="Draw the edges of the polygons."),
    options.option(LOOK, "--control", metavar="FILE", help="Draw the edges and vertices of this mesh over each IN."),
    options.option(
        LOOK,
        "--stripes",
        type=options.POSITIVE,
        default=10,
        show_default=True,
        metavar="N",
        help="Dark bands of a zebra's room, from floor to ceiling.",
    ),
    options.option(
        LOOK,
        "--color",
        default="#99b3d1",
        show_default=True,
        metavar="COLOR",
        help="Color of a shaded surface: a name that HTML knows, or #rrggbb.",
    ),
    options.option(
        PICTURE,
        "--view",
        default="oblique",
        show_default=True,
        metavar="VIEW",
        help="oblique, front, right, back, left, top, bottom, isometric, or AZIMUTH,ELEVATION in degrees.",
    ),
    options.option(
        PICTURE,
        "--up",
        type=click.Choice(["z", "y"]),
        default="z",
        show_default=True,
        help="The axis that points up; the front is then seen from -y or +z.",
    ),
    options.option(
        PICTURE, "--size", default="800x600", show_default=True, metavar="WxH", help="Pixels for each IN."
    ),
    options.option(
        PICTURE,
        "--background",
        default="white",
        show_default=True,
        metavar="COLOR",
        help="A color, or 'transparent'.",
    ),
    options.option(
        PICTURE,
        "--field-of-view",
        type=click.FloatRange(0, 120),
        default=24.0,
        show_default=True,
        metavar="DEG",
        help="Degrees across the shorter side; 0 is a parallel projection.",
    ),
    options.option(
        PICTURE,
        "--fit",
        type=click.Choice(["auto", "same", "each"]),
        default="auto",
        show_default=True,
        help="One camera for all INs, one for each, or one where they are about the same size and place.",
    ),
    options.option(
        PICTURE,
        "--caption",
        "captions",
        multiple=True,
        metavar="TEXT",
        help="Text under an IN, once for each.  [default: the files' names if there are several]",
    ),
    options.option(PICTURE, "--columns", type=options.POSITIVE, metavar="N", help="INs in a row.  [default: all]"),
    options.input_format,
    options.no_clobber,
    options.messages,
)
def command(**given: Any) -> None:
    """Draw meshes side by side into a PNG picture.

    The camera sees all of each mesh. Normals of the file are used as they are, so that creases show. The picture is
    drawn with OpenGL, without a display; a GPU is used where there is one, and none is needed. '-' is standard input
    or output.
    """
    render_files(**given)


def render_files(
    inputs: tuple[str, ...],
    output: str,
    style: str,
    shading: str,
    wire: bool,
    control: str | None,
    captions: tuple[str, ...],
    input_format: str | None,
    no_clobber: bool,
    quiet: bool,
    verbose: bool,
    **look: Any,
) -> None:
    """Read, draw, write. Raises CurvifyError."""
    from curvify.cli.console import Console
    from curvify.gpu.device import open_device
    from curvify.gpu.picture import picture, to_png
    from curvify.gpu.scene import Layer, Panel, Stroke

    console = Console(quiet, verbose)
    names = [*inputs, *([control] if control is not None else [])]
    check_names(names, output, input_format, no_clobber)
    texts = captions_of(inputs, captions)
    settings = settings_of(**look)
    settings.check(len(inputs))
    with open_device() as device:
        console.explain(f"{device.renderer}, OpenGL {device.version}")
        meshes = {name: read(name, input_format, console) for name in dict.fromkeys(names)}
        over = [control_layer(meshes[control])] if control is not None else []
        panels = [
            Panel([Layer(meshes[name], style, shading, wire=Stroke() if wire else None), *over], text)
            for name, text in zip(inputs, texts, strict=True)
        ]
        image = picture(panels, settings, device)
    write(to_png(image), output)
    console.explain(f"{output}: {image.shape[1]} x {image.shape[0]} pixels")


def check_names(names: list[str], output: str, format: str | None, no_clobber: bool) -> None:
    """Raise CurvifyError for names that cannot be read or written, so far as they tell."""
    from pathlib import Path

    from curvify.cli import files
    from curvify.errors import FormatError, OptionError

    if output != files.STREAM and Path(output).suffix.lower() != ".png":
        raise FormatError(f"{output}: pictures are PNG files; give the last name the suffix .png")
    files.check_target(output, no_clobber)
    if names.count(files.STREAM) > 1:
        raise OptionError("standard input can be read only once")
    for name in names:
        if name != files.STREAM:
            files.check_input(name, format_of(name, format))


def format_of(name: str, format: str | None) -> str | None:
    """``--input-format`` for the files whose suffix does not tell, None for the others."""
    from pathlib import Path

    from curvify.formats import READ_FORMATS

    return None if Path(name).suffix.lower().removeprefix(".") in READ_FORMATS else format


def captions_of(inputs: tuple[str, ...], given: tuple[str, ...]) -> tuple[str, ...]:
    """What stands under each input."""
    from pathlib import Path

    from curvify.cli import files
    from curvify.errors import OptionError

    if given:
        if len(given) != len(inputs):
            raise OptionError(f"there are {len(inputs)} INs and {len(given)} captions; give each IN a --caption")
        return given
    if len(inputs) == 1:
        return ("",)
    return tuple(files.shown_name(Path(name).name, "stdin") for name in inputs)


def settings_of(size: str, background: str, view: str, color: str, **others: Any) -> Settings:
    """How the picture is taken. Raises OptionError for what cannot be understood."""
    from curvify.gpu.camera import parse_view
    from curvify.gpu.colors import parse_color
    from curvify.gpu.scene import Settings

    ground = None if background == "transparent" else parse_color(background)
    return Settings(size_of(size), ground, parse_view(view), color=parse_color(color), **others)


def size_of(text: str) -> tuple[int, int]:
    """Width and height of ``WIDTHxHEIGHT``."""
    from curvify.errors import OptionError

    found = re.fullmatch(r"0*([1-9]\d{0,8})x0*([1-9]\d{0,8})", text.strip().lower())
    if found is None:
        raise OptionError(f"--size {text}: give width and height in pixels, as in 800x600")
    return int(found[1]), int(found[2])


def read(name: str, format: str | None, console: Console) -> PolygonMesh:
    """A mesh with faces; what its file warns of is told."""
    from curvify.cli import files
    from curvify.errors import MeshError

    mesh = files.read_input(name, format_of(name, format))
    shown = files.shown_name(name, "stdin")
    if not mesh.face_count:
        raise MeshError(f"{shown}: the mesh has no faces; there is nothing to show")
    for text in mesh.warnings:
        console.warn(f"{shown}: {text}")
    return mesh


def control_layer(mesh: PolygonMesh) -> Layer:
    """Edges and vertices of a control mesh; where it lies behind itself they show faintly."""
    from curvify.gpu.scene import Layer, Stroke

    ink = (0.72, 0.17, 0.10)
    return Layer(mesh, "hidden", wire=Stroke(ink, 1.8, hidden=0.18), dots=Stroke(ink, 6.0, hidden=0.0))


def write(data: bytes, output: str) -> None:
    """Write a file, completely or not at all, or to standard output."""
    from curvify.cli import files
    from curvify.formats import atomic_file

    if output == files.STREAM:
        stdout = files.CountedStdout()
        stdout.write(data)
        stdout.flush()
        return
    with atomic_file(output) as out:
        out.write(data)
