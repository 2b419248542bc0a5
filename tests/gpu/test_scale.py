"""The scale of values: its range, its numbers, its bar, and colors that agree with it."""

from __future__ import annotations

import numpy as np
import pytest

from curvify import OptionError, PolygonMesh
from curvify.gpu.colors import parse_color
from curvify.gpu.picture import picture
from curvify.gpu.scale import Scale, draw_bar, scale_of, texts
from curvify.gpu.scene import Layer, Panel, Settings
from curvify.palette import VALUE_COLORS
from opengl import device_or_skip

WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)


def test_a_scale_spans_all_finite_values():
    scale = scale_of([np.array([3.0, np.nan, -1.0]), np.array([np.inf, 7.0])], "heat")
    assert (scale.low, scale.high, scale.title) == (-1.0, 7.0, "heat")
    assert scale.ticks.tolist() == [-1.0, 1.0, 3.0, 5.0, 7.0]


def test_extremes_may_be_left_out():
    values = np.concatenate([np.linspace(0, 1, 99), [1000.0]])
    assert scale_of([values], outside=0.02).high < 2


def test_ranges_that_are_none():
    with pytest.raises(OptionError, match="no values"):
        scale_of([np.full(3, np.nan)])
    with pytest.raises(OptionError, match="two numbers in order"):
        Scale(2.0, 1.0)
    with pytest.raises(OptionError, match="two numbers in order"):
        Scale(0.0, np.inf)


@pytest.mark.parametrize(
    ("numbers", "shown"),
    [
        ([0, 0.25, 0.5], ["0.00", "0.25", "0.50"]),
        ([0, 50, 100], ["0", "50", "100"]),
        ([0, 1e-7], ["0", "1e-07"]),
        ([1.23456, 1.23457], ["1.2345600", "1.2345700"]),
        ([2, 2], ["2", "2"]),
    ],
)
def test_numbers_are_short_and_differ(numbers, shown):
    assert texts(np.array(numbers, dtype=float)) == shown


def test_the_bar_runs_through_the_colors():
    bar = draw_bar(Scale(0.0, 1.0), 400, 12, BLACK, WHITE)
    assert bar.shape[1:] == (400, 3)
    row = bar[8]
    colored = np.flatnonzero((row != 255).any(axis=1))
    ends = [np.rint(255 * np.array(parse_color(VALUE_COLORS[k]))) for k in (0, -1)]
    assert np.abs(row[colored[0]] - ends[0]).max() <= 1 and np.abs(row[colored[-1]] - ends[1]).max() <= 1
    titled = draw_bar(Scale(0.0, 1.0, "height"), 400, 12, BLACK, WHITE)
    assert titled.shape[0] > bar.shape[0]


def test_a_narrow_bar_shows_its_ends_alone():
    def gaps(width: int) -> int:
        """Wide gaps between the numbers under the bar."""
        inked = np.flatnonzero((draw_bar(Scale(0.0, 1000.0), width, 12, BLACK, WHITE)[18:] < 128).any(axis=(0, 2)))
        return int((np.diff(inked) > 12).sum())

    assert (gaps(150), gaps(600)) == (1, 4)
    assert draw_bar(Scale(0.0, 1000.0), 40, 12, BLACK, None).shape[2] == 4


def test_one_scale_colors_all_panels():
    square = PolygonMesh.from_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    settings = Settings(size=(40, 40), view=(0.0, 90.0), scale=Scale(0.0, 10.0))
    with device_or_skip() as device:

        def drawn(value: float, limits: tuple[float, float] | None = None) -> np.ndarray:
            layer = Layer(square, "values", values=np.full(4, value), limits=limits)
            return picture([Panel([layer])], settings, device)

        low, high, own = drawn(0.0), drawn(10.0), drawn(0.0, (-10.0, 0.0))
    assert low.shape[0] > 40
    assert high[20, 20].astype(int).sum() > low[20, 20].astype(int).sum() + 200
    assert np.abs(own[20, 20].astype(int) - high[20, 20]).max() <= 1
