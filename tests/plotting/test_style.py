"""Colours are computed, not believed: contrast, colour blindness, grey print."""

from itertools import combinations

import matplotlib.style
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from skarxlag.plotting._style import (
    ANY_PAGE,
    LINE_STYLES,
    MARKERS,
    NEUTRAL,
    PALETTE,
    condition_styles,
    ink,
)

#: Machado, Oliveira and Fernandes (2009), severity 1.0, on linear RGB.
SIGHT = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}
#: IEC 61966-2-1: linear sRGB to XYZ.
XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
PAGES = ["#ffffff", "#121212", "#14181e"]


def linear(color):
    rgb = np.array(to_rgb(color))
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def contrast(one, other):
    """WCAG 2 contrast ratio."""
    low, high = sorted(float(XYZ[1] @ linear(color)) + 0.05 for color in (one, other))
    return high / low


def lab(rgb):
    """CIE 1976 L*a*b* of linear sRGB under D65."""
    t = XYZ @ np.clip(rgb, 0, 1) / [0.95047, 1.0, 1.08883]
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def smallest_distance(colors, matrix):
    seen = [lab(matrix @ linear(color)) for color in colors]
    return min(np.linalg.norm(a - b) for a, b in combinations(seen, 2))


@pytest.mark.parametrize("page", PAGES)
@pytest.mark.parametrize("color", [*PALETTE, NEUTRAL])
def test_every_colour_stands_out_from_white_and_dark_pages(color, page):
    assert contrast(color, page) >= 3


@pytest.mark.parametrize("page", PAGES)
def test_text_of_images_without_background_is_readable(page):
    assert contrast(ANY_PAGE["text.color"], page) >= 4


@pytest.mark.parametrize("sight", SIGHT)
def test_colours_are_apart_for_every_eye(sight):
    # The palette of Okabe and Ito, which has too little contrast for two pages, reaches
    # 17 to 26.
    assert smallest_distance([*PALETTE, NEUTRAL], SIGHT[sight]) >= 20
    assert len({to_rgb(color) for color in PALETTE}) == len(PALETTE) == 8


def test_conditions_have_the_same_style_in_every_figure():
    names = ["Normal", "IR", "OR"]
    first = condition_styles(names)
    assert list(first) == names and first == condition_styles([*names, "Ball"][:3])
    assert condition_styles([*names, "Ball"])["OR"] == first["OR"]
    assert [style["color"] for style in first.values()] == list(PALETTE[:3])
    assert condition_styles([1, 2]).keys() == {"1", "2"}


def test_styles_differ_without_colour_and_beyond_eight_conditions():
    styles = list(condition_styles(range(8)).values())
    assert len({style["marker"] for style in styles}) == len(MARKERS) == 8
    assert len({str(style["linestyle"]) for style in styles}) == len(LINE_STYLES) == 8
    many = condition_styles(range(30)).values()
    assert len({(style["color"], style["marker"]) for style in many}) == 30
    assert len({(style["color"], str(style["linestyle"])) for style in many}) == 30


@pytest.mark.parametrize("style", ["default", "dark_background"])
def test_ink_is_the_colour_of_text(style):
    with matplotlib.style.context(style):
        assert to_rgb(ink()) == to_rgb(
            {"default": "black", "dark_background": "white"}[style]
        )
    with matplotlib.rc_context(ANY_PAGE):
        assert ink() == NEUTRAL
