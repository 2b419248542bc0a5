"""Colors by name or number, and pictures from light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from curvify.errors import OptionError
from curvify.mesh import Floats
from curvify.palette import to_linear, to_shown

Color = tuple[float, float, float]
Image = NDArray[np.uint8]


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


def to_bytes(image: Floats, background: Color | None) -> Image:
    """A picture ``(h,w,3)`` from premultiplied linear light ``(h,w,4)``; ``(h,w,4)`` where the background is None."""
    alpha = np.clip(image[..., 3:], 0.0, 1.0)
    if background is not None:
        shown = to_shown(image[..., :3] + (1 - alpha) * to_linear(background))
    else:
        light = np.divide(image[..., :3], alpha, out=np.zeros_like(image[..., :3]), where=alpha > 0)
        shown = np.concatenate([to_shown(light), alpha], axis=-1)
    return np.rint(255 * shown).astype(np.uint8)
