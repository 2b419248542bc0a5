"""Colors: names and numbers, what a screen shows and linear light, and the colors of values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from curvify.errors import OptionError
from curvify.mesh import Floats

Color = tuple[float, float, float]
Image = NDArray[np.uint8]

#: Colors of values from low to high, evenly apart: dark to light all along, so that they work in gray too.
VALUE_COLORS = ("#20124d", "#2b2a80", "#1f4f9a", "#15759a", "#1f9a8a", "#4fb96c", "#95d04f", "#d8de55", "#fdf3a8")
#: What has no value.
NO_VALUE_COLOR = "#b0b0b0"


def parse_color(text: str) -> Color:
    """Red, green and blue, 0 to 1 as a screen shows them, of ``#rgb``, ``#rrggbb`` or a name that HTML knows.

    Raises OptionError for what is no color.
    """
    from PIL import ImageColor

    try:
        red, green, blue = ImageColor.getrgb(text)[:3]
    except ValueError:
        raise OptionError(f"unknown color '{text}'; give a name such as white, or #rrggbb") from None
    return red / 255, green / 255, blue / 255


def to_linear(shown: Floats | Color) -> Floats:
    """Linear light of what a screen shows, both 0 to 1 (IEC 61966-2-1, sRGB)."""
    values = np.asarray(shown, dtype=np.float32)
    return np.where(values > 0.04045, ((values + 0.055) / 1.055) ** 2.4, values / 12.92).astype(np.float32)


def to_shown(light: Floats) -> Floats:
    """What a screen shows for linear light, both 0 to 1."""
    values = np.clip(light, 0.0, 1.0)
    return np.where(values > 0.0031308, 1.055 * values ** (1 / 2.4) - 0.055, 12.92 * values).astype(np.float32)


def to_bytes(image: Floats, background: Color | None) -> Image:
    """A picture ``(h,w,3)`` from premultiplied linear light ``(h,w,4)``; ``(h,w,4)`` where the background is None."""
    alpha = np.clip(image[..., 3:], 0.0, 1.0)
    if background is not None:
        shown = to_shown(image[..., :3] + (1 - alpha) * to_linear(background))
    else:
        light = np.divide(image[..., :3], alpha, out=np.zeros_like(image[..., :3]), where=alpha > 0)
        shown = np.concatenate([to_shown(light), alpha], axis=-1)
    return np.rint(255 * shown).astype(np.uint8)
