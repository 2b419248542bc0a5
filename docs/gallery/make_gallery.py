"""Draw the gallery: ``python docs/gallery/make_gallery.py [FIGURE...]``, or ``make gallery`` for all of it.

The pictures are written beside this file, their captions into docs/gallery.md. The same device gives the same bytes;
another one may differ in a last bit here and there.
"""

from __future__ import annotations

import sys
from pathlib import Path

from contents import PAPERS, page
from figures import Figure

from curvify.gpu.device import Device, open_device
from curvify.gpu.picture import picture, to_png
from curvify.gpu.scene import Settings

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent / "gallery.md"


def draw(figure: Figure, device: Device) -> bytes:
    """The PNG file of a figure."""
    settings = Settings(**{"size": (280, 240), "field_of_view": 20.0, **figure.settings})
    return to_png(picture(figure.panels(), settings, device))


def main(names: list[str]) -> None:
    """Draw the figures of these names, or all of them and the page."""
    figures = {figure.name: figure for paper in PAPERS for figure in paper.figures}
    for name in names:
        if name not in figures:
            sys.exit(f"there is no figure {name}; choose from {', '.join(figures)}")
    with open_device() as device:
        for name in names or figures:
            (HERE / f"{name}.png").write_bytes(draw(figures[name], device))
    if not names:
        PAGE.write_text(page())


if __name__ == "__main__":
    main(sys.argv[1:])
