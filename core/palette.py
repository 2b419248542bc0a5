"""The colors of values, in files and in pictures, and the light that a screen gives for a number."""

from __future__ import annotations

import numpy as np

from curvify.mesh import Floats

#: Colors of values from low to high, evenly apart: dark to light all along, so that they work in gray too.
VALUE_COLORS = ("#20124d", "#2b2a80", "#1f4f9a", "#15759a", "#1f9a8a", "#4fb96c", "#95d04f", "#d8de55", "#fdf3a8")
#: What has no value.
NO_VALUE_COLOR = "#b0b0b0"


def to_linear(shown: Floats | tuple[float, ...]) -> Floats:
    """Linear light of what a screen shows, both 0 to 1 (IEC 61966-2-1, sRGB)."""
    values = np.asarray(shown, dtype=np.float32)
    return np.where(values > 0.04045, ((values + 0.055) / 1.055) ** 2.4, values / 12.92).astype(np.float32)


def to_shown(light: Floats) -> Floats:
    """What a screen shows for linear light, both 0 to 1."""
    values = np.clip(light, 0.0, 1.0)
    return np.where(values > 0.0031308, 1.055 * values ** (1 / 2.4) - 0.055, 12.92 * values).astype(np.float32)


def light_of(color: str) -> Floats:
    """Linear light ``(3,)`` of ``#rrggbb``."""
    return to_linear(np.frombuffer(bytes.fromhex(color[1:]), dtype=np.uint8) / 255)


def value_stops() -> Floats:
    """Linear light ``(n,3)`` of the colors of values."""
    return np.stack([light_of(color) for color in VALUE_COLORS])


def value_colors(shares: Floats) -> Floats:
    """Linear light ``(n,3)`` of shares ``(n,)`` of the way from the lowest value, 0, to the highest, 1.

    As the shader ``value_color`` mixes it: straight between the stops, those beyond the ends as the ends, NaN gray.
    """
    stops = value_stops()
    known = ~np.isnan(shares)
    at = np.clip(np.where(known, shares, 0.0), 0.0, 1.0) * (len(stops) - 1)
    light = np.stack([np.interp(at, np.arange(len(stops)), channel) for channel in stops.T], axis=1)
    light[~known] = light_of(NO_VALUE_COLOR)
    return light
