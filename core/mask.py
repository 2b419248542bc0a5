"""An image that says which part of a surface is kept.

Source: Ko, Lee, Lim, Yoon, "Construction and Rendering of Trimmed Blending Surfaces with Sharp Features on a GPU",
section V.5; grey values between black and white and the sampling are ours (docs/blending.md).
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from curvify.errors import FormatError
from curvify.mesh import Bools, Floats
from curvify.records import record

#: Brightness from which a point is kept.
THRESHOLD = 0.5
#: Largest value of a pixel, by the modes of Pillow that have one channel of more than 8 bits.
_WIDE = {"I": 65535.0, "I;16": 65535.0, "I;16B": 65535.0, "I;16L": 65535.0, "I;16N": 65535.0, "F": 1.0}


@record
class Mask:
    """A trimming image: ``values (H,W)`` in 0..1, the first row on top. What is white is kept."""

    values: Floats

    def sample(self, points: Floats) -> Floats:
        """Brightness ``(...)`` at ``points (...,2)``: (0, 0) is the lower left corner of the image, (1, 1) the upper
        right; bilinear between the middles of the pixels, constant beyond them.
        """
        height, width = self.values.shape
        x = np.clip(points[..., 0] * width - 0.5, 0, width - 1)
        y = np.clip((1 - points[..., 1]) * height - 0.5, 0, height - 1)
        column, row = np.minimum(x.astype(np.int64), width - 1), np.minimum(y.astype(np.int64), height - 1)
        right, below = np.minimum(column + 1, width - 1), np.minimum(row + 1, height - 1)
        x, y = x - column, y - row
        upper = (1 - x) * self.values[row, column] + x * self.values[row, right]
        lower = (1 - x) * self.values[below, column] + x * self.values[below, right]
        return (1 - y) * upper + y * lower

    def keeps(self, points: Floats) -> Bools:
        """Which of the ``points (...,2)`` are kept."""
        kept: Bools = self.sample(points) >= THRESHOLD
        return kept

    def inverted(self) -> Mask:
        """The mask that keeps what this one trims."""
        return Mask(1 - self.values)


def read_mask(path: str | os.PathLike[str]) -> Mask:
    """Read a PNG image as a mask: its luminance, times its opacity. Raises FormatError."""
    from PIL import Image, UnidentifiedImageError

    name = os.fspath(path)
    try:
        with Image.open(name, formats=["PNG"]) as image:
            image.load()
            return Mask(_brightness(image))
    except FileNotFoundError:
        raise FormatError(f"{name}: cannot read: there is no such file") from None
    except UnidentifiedImageError:
        raise FormatError(f"{name}: this is no PNG image; give one that is white where to keep the surface") from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise FormatError(f"{name}: cannot be read as a PNG image: {error}") from None


def _brightness(image: Any) -> Floats:
    """Luminance (Rec. 601) times opacity ``(H,W)`` of an image of Pillow."""
    if image.mode in _WIDE:
        return np.clip(np.asarray(image, dtype=np.float64) / _WIDE[image.mode], 0.0, 1.0)
    colors = np.asarray(image.convert("RGBA"), dtype=np.float64) / 255
    return (colors[..., :3] @ [0.299, 0.587, 0.114]) * colors[..., 3]
