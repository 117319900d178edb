"""The page's colours stand out from light and dark grounds, and are told apart by eyes that lack
the red or the green cones.

A contrast is that of WCAG 2.2: 3 is asked of lines, 4.5 of text. How such eyes see is by the
matrices of Machado, Oliveira and Fernandes (2009), in linear RGB; a distance is that of CIELAB,
where 10 is seen at a glance."""

import itertools
import re

import numpy as np
import pytest
from toolbox import ROOT

VIEWER = ROOT / "python/viewer"
EYES = {
    "all cones": np.eye(3),
    "no red cones": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "no green cones": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
}
TO_XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.072175],
        [0.0193339, 0.119192, 0.9503041],
    ]
)
WHITE = TO_XYZ.sum(axis=1)


def colours(file, pattern):
    """Return all values of the form #rrggbb where the pattern matches."""
    found = re.search(pattern, (VIEWER / file).read_text(encoding="utf-8"))
    return re.findall(r"#[0-9a-f]{6}", found[0])


TOPS = colours("scene.js", r"COLOURS = .*")
ARROWS = [colours("view.js", rf"parts\.{name} = arrow.*")[0] for name in "mwp"]
CIRCLES = colours("globe.js", "INK = .*")
LIGHT, DARK = zip(
    *(colours("style.css", rf"--{name}: light-dark.*") for name in ("ground", "panel")), strict=True
)
FAINT = colours("style.css", "--faint: light-dark.*")
HALL = colours("controls.css", r"\.projector \{[^}]*")  # ground, panel, faint, light and dark
EDGES = colours("controls.css", "--edge: light-dark.*")


def linear(colour):
    part = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


def contrast(one, other):
    low, high = sorted(TO_XYZ[1] @ linear(colour) for colour in (one, other))
    return (high + 0.05) / (low + 0.05)


def to_lab(colour, eye):
    """A colour in CIELAB, as an eye sees it."""
    part = TO_XYZ @ np.clip(np.array(EYES[eye]) @ linear(colour), 0, 1) / WHITE
    x, y, z = np.where(part > 216 / 24389, np.cbrt(part), (24389 / 27 * part + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("ground", [*LIGHT, *DARK])
def test_lines_stand_out(ground):
    assert len(TOPS) == 6 and len(ARROWS) == 3
    for colour in [*TOPS, *ARROWS, *CIRCLES]:
        assert contrast(colour, ground) >= 3, colour


@pytest.mark.parametrize("mode", [0, 1], ids=["light", "dark"])
def test_a_projector_shows_lines_and_text(mode):
    ground, panel, faint = HALL[mode::2]
    for colour in [*TOPS, *ARROWS, *CIRCLES]:
        assert contrast(colour, ground) >= 3, colour
    assert min(contrast(faint, ground), contrast(faint, panel)) >= 7


@pytest.mark.parametrize("mode", [0, 1], ids=["light", "dark"])
def test_text_and_borders_stand_out(mode):
    for ground in (LIGHT, DARK)[mode]:
        assert contrast(FAINT[mode], ground) >= 4.5
        assert contrast(EDGES[mode], ground) >= 3


@pytest.mark.parametrize("eye", EYES)
def test_tops_are_told_apart(eye):
    for one, other in itertools.combinations(TOPS, 2):
        assert np.linalg.norm(to_lab(one, eye) - to_lab(other, eye)) > 20, (one, other)


@pytest.mark.parametrize("eye", EYES)
def test_the_first_and_the_second_method_are_told_apart_at_a_glance(eye):
    first, _, second, *_ = TOPS
    assert np.linalg.norm(to_lab(first, eye) - to_lab(second, eye)) > 60


@pytest.mark.parametrize("eye", EYES)
def test_the_momentum_is_told_from_the_first_top(eye):
    assert np.linalg.norm(to_lab(TOPS[0], eye) - to_lab(ARROWS[0], eye)) > 20
