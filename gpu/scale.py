"""The colors of values: what range they span, and the bar that explains them under a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curvify.errors import OptionError
from curvify.gpu.colors import Color, Image, to_bytes
from curvify.mesh import Floats
from curvify.palette import to_linear, value_colors

#: Numbers along the bar.
TICKS = 5
#: Length of the bar in a picture, as a part of its width, and at most in heights of its letters.
LENGTH, LONGEST = 0.8, 30.0


@dataclass(frozen=True)
class Scale:
    """Values ``low`` and ``high`` have the first and the last color; ``title`` says what they are."""

    low: float
    high: float
    title: str = ""

    def __post_init__(self) -> None:
        """Raises OptionError for a range that is none."""
        if not (np.isfinite(self.low) and np.isfinite(self.high) and self.low <= self.high):
            raise OptionError(f"the limits of the colors must be two numbers in order, not {self.low:g}, {self.high:g}")

    @property
    def ticks(self) -> Floats:
        """Values evenly apart, for numbers beside the bar."""
        return np.linspace(self.low, self.high, TICKS)


def scale_of(values: Sequence[Floats], title: str = "", outside: float = 0.0) -> Scale:
    """A scale for all values that are finite, but for a part of them at each end: ``outside``, 0 to 0.5.

    Raises OptionError where there are none.
    """
    every = np.concatenate([part[np.isfinite(part)] for part in values])
    if not len(every):
        raise OptionError("there are no values to show")
    low, high = np.quantile(every, [outside, 1 - outside])
    return Scale(float(low), float(high), title)


def texts(numbers: Floats) -> list[str]:
    """Numbers as short texts that differ where the numbers do, with as many digits as their steps need."""
    span = float(np.ptp(numbers))
    largest = float(np.abs(numbers).max())
    if span == 0 or largest >= 1e5 or largest < 1e-3:
        return [f"{number:.3g}" for number in numbers]
    digits = max(0, 1 - int(np.floor(np.log10(span / max(len(numbers) - 1, 1)))))
    return [f"{number:.{min(digits, 9)}f}" for number in numbers]


def draw_bar(scale: Scale, width: int, letters: int, ink: Color, background: Color | None) -> Image:
    """The bar with its numbers and title, on a strip as wide as the picture ``(h,width,3|4)``."""
    from PIL import Image as Pillow
    from PIL import ImageDraw, ImageFont

    font = ImageFont.load_default(letters)
    length = max(2, round(min(LENGTH * width, LONGEST * letters)))
    left, top, high = (width - length) // 2, round(0.3 * letters), letters
    strip = round((4.1 if scale.title else 2.8) * letters)
    mask = Pillow.new("L", (width, strip))
    pen = ImageDraw.Draw(mask)
    for place, text in _placed(texts(scale.ticks), length, font):
        pen.text((left + place, top + high + 0.8 * letters), text, fill=255, font=font, anchor="mm")
    if scale.title:
        pen.text((width / 2, strip - 0.9 * letters), scale.title, fill=255, font=font, anchor="mm")
    share = np.asarray(mask, dtype=np.float32)[..., None] / 255
    light = share * np.append(to_linear(ink), np.float32(1.0))
    light[top : top + high, left : left + length] = _ramp(length)
    return to_bytes(light, background)


def _placed(words: list[str], length: int, font: object) -> list[tuple[float, str]]:
    """Where the numbers stand along the bar; only the two at its ends where there is no room for all."""
    places = np.linspace(0, length, len(words))
    widest = max(font.getlength(word) for word in words)  # type: ignore[attr-defined]
    pairs = list(zip(places.tolist(), words, strict=True))
    return pairs if 1.3 * widest < places[1] else [pairs[0], pairs[-1]]


def _ramp(length: int) -> Floats:
    """The colors from the first to the last ``(length,4)``, in linear light as the shader mixes them."""
    light = value_colors(np.linspace(0, 1, length))
    return np.append(light, np.ones((length, 1)), axis=1).astype(np.float32)
