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
    view_files(pictures.Subjects.taken_from(given), **given)


def view_files(
    subjects: pictures.Subjects,
    output: str,
    stripes: int,
    color: str,
    view: str,
    up: str,
    background: str,
    no_clobber: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Read, pack, write. Raises CurvifyError."""
    from curvify.cli import files
    from curvify.cli.console import Console
    from curvify.gpu.camera import parse_view
    from curvify.gpu.colors import parse_color
    from curvify.gpu.scene import Settings
    from curvify.gpu.viewer import viewer_page

    console = Console(quiet, verbose)
    pictures.check_output(output, ".html", "pages are HTML files", no_clobber)
    subjects.check()
    settings = Settings(
        background=parse_color(background), view=parse_view(view), up=up, stripes=stripes, color=parse_color(color)
    )
    layers, over, settings = subjects.layers(settings, console)
    page = viewer_page(layers, [pictures.short_name(name) for name in subjects.inputs], over, settings).encode()
    files.write_bytes(page, output)
    console.explain(f"{output}: {len(page):,} bytes")
