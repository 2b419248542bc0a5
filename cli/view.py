"""`curvify view`: meshes in, a web page to turn them in out."""

from __future__ import annotations

from typing import Any

import click

from curvify.cli import options, pictures
from curvify.cli.group import COMMANDS, Command

EXAMPLES = (
    (
        "The surface, with the mesh that it was made from to switch on and off",
        "curvify refine coarse.obj dense.ply && curvify view dense.ply page.html --control coarse.obj",
    ),
    ("Reflection lines first", "curvify view coarse.obj page.html --style zebra --shading smooth"),
    (
        "Several meshes to flick through, their height as colors",
        "curvify refine coarse.obj dense.ply && curvify view coarse.obj dense.ply page.html --values z",
    ),
)


@click.command(name="view", cls=Command, examples=EXAMPLES, short_help=COMMANDS["view"])
@click.argument("inputs", metavar="IN...", nargs=-1, required=True, type=click.Path(allow_dash=True))
@click.argument("output", metavar="OUT", type=click.Path(allow_dash=True))
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
    pictures.up,
    options.option(
        pictures.PICTURE, "--background", default="white", show_default=True, metavar="COLOR", help="A color."
    ),
    options.input_format,
    options.no_clobber,
    options.messages,
)
def command(**given: Any) -> None:
    """Write a web page that shows meshes, to turn, zoom and compare.

    OUT is one HTML file with everything in it, to open or to pass on: it needs a browser with WebGL 2, and no network.
    The options are what it starts with; keys and buttons change them: h shows which. Several INs take turns under one
    eye. '-' is standard input or output.
    """
    view_files(**given)


def view_files(
    inputs: tuple[str, ...],
    output: str,
    style: str,
    shading: str,
    values: str | None,
    limits: tuple[float, float] | None,
    wire: bool,
    control: str | None,
    stripes: int,
    color: str,
    view: str,
    up: str,
    background: str,
    input_format: str | None,
    no_clobber: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Read, pack, write. Raises CurvifyError."""
    from curvify.cli.console import Console
    from curvify.gpu.camera import parse_view
    from curvify.gpu.colors import parse_color
    from curvify.gpu.scene import Layer, Settings, Stroke
    from curvify.gpu.viewer import viewer_page

    console = Console(quiet, verbose)
    names = [*inputs, *([control] if control is not None else [])]
    pictures.check_names(names, output, ".html", "pages are HTML files", input_format, no_clobber)
    style = pictures.style_of(style, values, limits)
    settings = Settings(
        background=parse_color(background), view=parse_view(view), up=up, stripes=stripes, color=parse_color(color)
    )
    meshes = {name: pictures.read(name, input_format, console) for name in dict.fromkeys(names)}
    shown = [pictures.vertex_values(meshes[name], values) for name in inputs]
    settings = pictures.with_scale(settings, shown, values, limits)
    line = Stroke() if wire else None
    layers = [
        Layer(meshes[name], style, shading, wire=line, values=part) for name, part in zip(inputs, shown, strict=True)
    ]
    over = pictures.control_layer(meshes[control]) if control is not None else None
    page = viewer_page(layers, [pictures.short_name(name) for name in inputs], over, settings).encode()
    pictures.write(page, output)
    console.explain(f"{output}: {len(page):,} bytes")
