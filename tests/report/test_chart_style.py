"""Tests that all readers can distinguish the colours and markers of charts.

The charts are tested on a light and on a dark background.
"""

from itertools import combinations

import kreisel as kr
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from validation.competitors.method_families import group_methods
from validation.drawing import cost_curves
from validation.drawing.style import COLOURS, MARKERS, choose_line_styles, make_panel, plt

# Source: Machado, Oliveira and Fernandes (2009), full dichromacy, for linear RGB.
VISION = {
    "normal": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
}
TO_XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
WHITE = TO_XYZ.sum(axis=1)


def linear(colour):
    c = np.array(to_rgb(colour))
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def lab(colour, vision):
    xyz = TO_XYZ @ np.clip(np.array(vision) @ linear(colour), 0, 1) / WHITE
    x, y, z = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def contrast(one, other):
    dark, light = sorted(TO_XYZ[1] @ linear(colour) for colour in (one, other))
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("vision", VISION)
def test_colours_differ_for_every_reader(vision):
    for one, other in combinations(COLOURS, 2):
        apart = np.linalg.norm(lab(one, VISION[vision]) - lab(other, VISION[vision]))
        assert apart > 20, f"{one} and {other}: {apart:.0f}"


@pytest.mark.parametrize("paper", ["#ffffff", "#15171a"])
def test_colours_can_be_seen_on_the_page(paper):
    assert all(contrast(colour, paper) > 2.5 for colour in COLOURS)


def pair(style):
    return style["color"], style["marker"]


def test_no_two_methods_of_a_panel_share_a_colour():
    for family, peers in group_methods().values():
        styles = choose_line_styles(family, peers)
        own = [name for name in family if name not in peers]
        assert len({styles[name]["color"] for name in own}) == len(own)
    everybody = choose_line_styles(list(kr.methods), ())
    assert len(set(map(pair, everybody.values()))) == len(kr.methods)
    assert len(MARKERS) == len(COLOURS) + 1


class Run:
    failure = ""

    def __init__(self, seconds, error):
        self.seconds, self.attitude_error = seconds, error


def test_methods_that_lead_have_their_own_colour_in_the_small_figures(monkeypatch):
    """Check that each label repeats the colour and the marker of the line that it names."""
    drawn = []
    monkeypatch.setattr(
        cost_curves, "figure_to_svg", lambda figure: drawn.append(figure) or "<svg>"
    )
    groups = {
        "taylor": [Run(2.0, 1e-3), Run(3.0, 1e-12)],
        "extrap_kirchhoff": [Run(1.0, 1e-2), Run(4.0, 1e-10)],
        "rk4": [Run(5.0, 1e-2), Run(6.0, 1e-4)],
        "heyoka": [Run(9.0, 1e-3), Run(10.0, 1e-12)],
    }
    figure = ("attitude_error", "seconds")
    named = cost_curves.select_leaders(groups, ["extrap_kirchhoff", "rk4", "taylor"], [figure])
    assert named == ["extrap_kirchhoff", "taylor"]
    cost_curves.draw_overview(groups, named, ("heyoka",), figure[0], "error", figure[1])
    (axes,) = drawn[0].axes
    lines = [line for line in axes.lines if len(line.get_xdata()) == 2]
    keys = [line for line in axes.lines if len(line.get_xdata()) == 1]
    styles = [(line.get_color(), line.get_marker()) for line in lines]
    assert len(set(styles)) == 4 and len({colour for colour, _ in styles}) == 4
    assert {(key.get_color(), key.get_marker()) for key in keys} == {
        style for style in styles if style[1] != "None"
    }
    assert {text.get_text() for text in axes.texts} == {*named, "heyoka"}
    plt.close(drawn[0])


def test_panels_have_room_for_the_longest_name():
    figure, axes = make_panel()
    longest = max(kr.methods, key=len)
    text = axes.text(1.07, 0.5, longest, transform=axes.transAxes, fontsize=9)
    figure.canvas.draw()
    assert text.get_window_extent().x1 <= figure.bbox.x1
    plt.close(figure)
