"""Panels to one picture: side by side, with captions, as an array or a PNG file."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from curvify.gpu.colors import Color, Image, to_bytes
from curvify.gpu.device import Device, open_device
from curvify.gpu.render import draw_panels
from curvify.gpu.scale import draw_bar
from curvify.gpu.scene import Panel, Settings
from curvify.palette import to_linear

if TYPE_CHECKING:
    from PIL import ImageFont

#: Height of the letters of a caption as a part of a panel's shorter side, and the least in pixels.
LETTERS, LEAST_LETTERS = 1 / 22, 10
#: Height of the strip under a panel that a caption stands in, in heights of its letters.
STRIP = 2.1
INK: Color = (0.20, 0.21, 0.23)
#: Where the background is dark, and where it is not known.
CHALK: Color = (0.88, 0.89, 0.91)
PENCIL: Color = (0.50, 0.51, 0.53)


def picture(panels: Sequence[Panel], settings: Settings | None = None, device: Device | None = None) -> Image:
    """Panels side by side, ``(height,width,3)`` or, on no background, ``(height,width,4)``, uint8.

    Every panel has the size that ``settings`` say; where any has a caption, a strip under each adds to it, and the bar
    of a scale comes under all. ``device`` is opened and closed for this picture where none is given. Raises OptionError
    and MeshError for what cannot be drawn, DeviceError where there is no OpenGL.
    """
    settings = settings or Settings()
    settings.check(len(panels))
    if device is not None:
        parts = draw_panels(panels, settings, device)
    else:
        with open_device() as own:
            parts = draw_panels(panels, settings, own)
    captions = [panel.caption for panel in panels]
    if any(captions):
        parts = [_with_caption(part, text, settings) for part, text in zip(parts, captions, strict=True)]
    image = _grid(parts, settings)
    if settings.scale is None:
        return image
    ground = settings.background
    bar = draw_bar(settings.scale, image.shape[1], _letters(settings.size), _ink(ground), ground)
    return np.concatenate([image, bar])


def _letters(size: tuple[int, int]) -> int:
    """Height of letters for panels of a size."""
    return max(LEAST_LETTERS, round(LETTERS * min(size)))


def _grid(parts: Sequence[Image], settings: Settings) -> Image:
    """Pictures of one size in rows, with background where the last row is not full."""
    columns = min(settings.columns or len(parts), len(parts))
    height, width, channels = parts[0].shape
    rows = -(-len(parts) // columns)
    image = np.empty((rows * height, columns * width, channels), dtype=np.uint8)
    image[:] = to_bytes(np.zeros((1, 1, 4), dtype=np.float32), settings.background)
    for k, part in enumerate(parts):
        row, column = divmod(k, columns)
        image[row * height : (row + 1) * height, column * width : (column + 1) * width] = part
    return image


def _with_caption(image: Image, text: str, settings: Settings) -> Image:
    """A picture with a strip under it that holds a line of text."""
    from PIL import Image as Pillow
    from PIL import ImageDraw

    height, width = image.shape[:2]
    letters = _letters((width, height))
    strip = round(STRIP * letters)
    mask = Pillow.new("L", (width, strip))
    font, text = _fitting(text, letters, width - letters)
    ImageDraw.Draw(mask).text((width / 2, strip / 2 - letters * 0.1), text, fill=255, font=font, anchor="mm")
    share = np.asarray(mask, dtype=np.float32)[..., None] / 255
    ink = np.append(to_linear(_ink(settings.background)), np.float32(1.0))
    return np.concatenate([image, to_bytes(share * ink, settings.background)])


def _fitting(text: str, letters: int, width: int) -> tuple[ImageFont.FreeTypeFont | ImageFont.ImageFont, str]:
    """Pillow's own font at a size, and as much of a text as fits into a width in pixels."""
    from PIL import ImageFont

    font = ImageFont.load_default(letters)
    if font.getlength(text) <= width:
        return font, text
    while text and font.getlength(text + "...") > width:
        text = text[:-1]
    return font, text + "..."


def _ink(background: Color | None) -> Color:
    """A color to write with that can be read on the background."""
    if background is None:
        return PENCIL
    return CHALK if float(to_linear(background) @ np.array([0.21, 0.72, 0.07])) < 0.2 else INK


def to_png(image: Image) -> bytes:
    """The PNG file of a picture ``(h,w,3|4)``."""
    from PIL import Image as Pillow

    out = io.BytesIO()
    Pillow.fromarray(image).save(out, "PNG", optimize=True)
    return out.getvalue()
