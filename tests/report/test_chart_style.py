"""Tests that all readers can distinguish the colours and markers of charts.

The charts are tested on a light and on a dark background.
"""

from itertools import combinations

import kreisel as kr
import pytest
from colour_vision import VISION, compute_contrast, lab_distance

from validation.competitors import ensemble_runs
from validation.competitors.method_families import group_methods
from validation.competitors.single_runs import PEERS
from validation.drawing import cost_curves
from validation.drawing.style import COLOURS, MARKERS, choose_line_styles, make_panel, plt


@pytest.mark.parametrize("vision", VISION)
def test_colours_differ_for_every_reader(vision):
    for one, other in combinations(COLOURS, 2):
        distance = lab_distance(one, other, vision)
        assert distance > 20, f"{one} and {other}: {distance:.0f}"


@pytest.mark.parametrize("paper", ["#ffffff", "#15171a"])
def test_colours_can_be_seen_on_the_page(paper):
    assert all(compute_contrast(colour, paper) > 2.5 for colour in COLOURS)


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


def test_a_program_looks_the_same_in_all_figures():
    """Check that each program has the same line style in all figures."""
    lead = choose_line_styles(["kreisel"], ["heyoka", "GSL rk8pd", "SciPy DOP853"])
    many = choose_line_styles(["exact", "taylor"], ["heyoka, batches", "gsl_rk8pd"])
    family = choose_line_styles(["extrap", "taylor"], ["gsl_bsimp", "gsl_rk8pd", "heyoka"])
    assert lead["heyoka"] == many["heyoka, batches"] == family["heyoka"]
    assert lead["GSL rk8pd"] == many["gsl_rk8pd"] == family["gsl_rk8pd"]
    assert lead["kreisel"] == many["taylor"] == family["taylor"]
    everybody = [*(peer.name for peer in PEERS), *(mover.name for mover in ensemble_runs.PEERS)]
    styles = choose_line_styles([], everybody)
    assert set(styles) == set(everybody), "each other integrator has a stroke"


class Run:
    failure = ""

    def __init__(self, seconds, error):
        self.seconds, self.attitude_error = seconds, error


def test_leading_methods_have_their_own_colour_in_small_figures(monkeypatch):
    """Check that labels have the colours and markers of their lines."""
    drawings = []
    monkeypatch.setattr(
        cost_curves, "figure_to_svg", lambda figure: drawings.append(figure) or "<svg>"
    )
    groups = {
        "taylor": [Run(2.0, 1e-3), Run(3.0, 1e-12)],
        "extrap_kirchhoff": [Run(1.0, 1e-2), Run(4.0, 1e-10)],
        "rk4": [Run(5.0, 1e-2), Run(6.0, 1e-4)],
        "heyoka": [Run(9.0, 1e-3), Run(10.0, 1e-12)],
    }
    figure = ("attitude_error", "seconds")
    leaders = cost_curves.select_leaders(groups, ["extrap_kirchhoff", "rk4", "taylor"], [figure])
    assert leaders == ["extrap_kirchhoff", "taylor"]
    cost_curves.draw_overview(groups, leaders, ("heyoka",), figure[0], "error", figure[1])
    (axes,) = drawings[0].axes
    lines = [line for line in axes.lines if len(line.get_xdata()) == 2]
    keys = [line for line in axes.lines if len(line.get_xdata()) == 1]
    styles = [(line.get_color(), line.get_marker()) for line in lines]
    assert len(set(styles)) == 4 and len({colour for colour, _ in styles}) == 4
    assert {(key.get_color(), key.get_marker()) for key in keys} == {
        style for style in styles if style[1] != "None"
    }
    assert {text.get_text() for text in axes.texts} == {*leaders, "heyoka"}
    plt.close(drawings[0])


def test_panels_have_room_for_the_longest_name():
    figure, axes = make_panel()
    longest = max(kr.methods, key=len)
    text = axes.text(1.07, 0.5, longest, transform=axes.transAxes, fontsize=9)
    figure.canvas.draw()
    assert text.get_window_extent().x1 <= figure.bbox.x1
    plt.close(figure)
