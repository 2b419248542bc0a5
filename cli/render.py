"""`curvify render`: meshes in, a picture out."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options, pictures
from curvify.cli.group import COMMANDS, Command
from curvify.cli.parameters import POSITIVE, Number, Whole

if TYPE_CHECKING:
    from curvify.gpu.scene import Panel, Settings

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
    (
        "How curved it is, all around",
        "curvify refine coarse.obj dense.ply && curvify render dense.ply round.png --values curvature --turntable 6",
    ),
)


@click.command(name="render", cls=Command, examples=EXAMPLES, short_help=COMMANDS["render"])
@pictures.in_and_out
@options.with_options(
    pictures.style,
    pictures.shading,
    pictures.values,
    pictures.limits,
    pictures.wire,
    pictures.control,
    pictures.stripes,
    pictures.color,
    pictures.view,
    options.option(
        pictures.PICTURE,
        "--turntable",
        type=Whole(1, 360),
        default=1,
        metavar="N",
        help="Draw each IN N times in a row, turned all around.",
    ),
    pictures.up,
    options.option(
        pictures.PICTURE, "--size", default="800x600", show_default=True, metavar="WxH", help="Pixels for each IN."
    ),
    options.option(
        pictures.PICTURE,
        "--background",
        default="white",
        show_default=True,
        metavar="COLOR",
        help="A color, or 'transparent'.",
    ),
    options.option(
        pictures.PICTURE,
        "--field-of-view",
        type=Number(0, 120),
        default=24.0,
        show_default=True,
        metavar="DEG",
        help="Degrees across the shorter side; 0 is a parallel projection.",
    ),
    options.option(
        pictures.PICTURE,
        "--fit",
        type=click.Choice(["auto", "same", "each"]),
        default="auto",
        show_default=True,
        help="One camera for all INs, one for each, or one where they are about the same size and place.",
    ),
    options.option(
        pictures.PICTURE,
        "--caption",
        "captions",
        multiple=True,
        metavar="TEXT",
        help="Text under an IN, once for each.  [default: the files' names if there are several]",
    ),
    options.option(
        pictures.PICTURE,
        "--columns",
        type=POSITIVE,
        metavar="N",
        help="Pictures in a row.  [default: all INs, or the N of --turntable]",
    ),
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
    render_files(pictures.Subjects.taken_from(given), **given)


def render_files(
    subjects: pictures.Subjects,
    output: str,
    captions: tuple[str, ...],
    turntable: int,
    columns: int | None,
    no_clobber: bool,
    quiet: bool,
    verbose: bool,
    **look: Any,
) -> None:
    """Read, draw, write. Raises CurvifyError."""
    from curvify.cli import files
    from curvify.cli.console import Console
    from curvify.gpu.device import open_device
    from curvify.gpu.picture import picture, to_png
    from curvify.gpu.scene import Panel

    console = Console(quiet, verbose)
    pictures.check_output(output, ".png", "pictures are PNG files", no_clobber)
    subjects.check()
    texts = captions_of(subjects.inputs, captions)
    settings = settings_of(**look, columns=columns or (turntable if turntable > 1 else None))
    settings.check(len(texts) * turntable)
    with open_device() as device:
        console.explain(f"{device.renderer}, OpenGL {device.version}")
        layers, over, settings = subjects.layers(settings, console)
        above = [] if over is None else [over]
        panels = [Panel([layer, *above], text) for layer, text in zip(layers, texts, strict=True)]
        image = picture(turned(panels, turntable, settings), settings, device)
    files.write_bytes(to_png(image), output)
    console.explain(f"{output}: {image.shape[1]} x {image.shape[0]} pixels")


def turned(panels: list[Panel], count: int, settings: Settings) -> list[Panel]:
    """Each panel ``count`` times, seen from all around."""
    from dataclasses import replace

    if count == 1:
        return panels
    azimuth, elevation = settings.view
    views = [(azimuth + 360 * k / count, elevation) for k in range(count)]
    return [replace(panel, view=view) for panel in panels for view in views]


def captions_of(inputs: tuple[str, ...], given: tuple[str, ...]) -> tuple[str, ...]:
    """What stands under each input."""
    from curvify.errors import OptionError

    if given:
        if len(given) != len(inputs):
            raise OptionError(f"there are {len(inputs)} INs and {len(given)} captions; give each IN a --caption")
        return given
    if len(inputs) == 1:
        return ("",)
    return tuple(pictures.short_name(name) for name in inputs)


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
