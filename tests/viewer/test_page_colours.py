"""Tests of colours: their contrast, and their distances for readers without red or green cones.

Contrasts are those of WCAG 2.2, which requires 3 for lines and 4.5 for text. Colour vision is
simulated by the matrices of Machado, Oliveira and Fernandes (2009) in linear RGB. Distances are
measured in CIELAB, where a distance of 10 is seen immediately.
"""

import itertools
import json
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


def find_colours(file, pattern):
    """Return the colours #rrggbb where the pattern matches."""
    found = re.search(pattern, (VIEWER / file).read_text(encoding="utf-8"))
    return re.findall(r"#[0-9a-f]{6}", found[0])


TOPS = find_colours("scene.js", r"COLOURS = .*")
ARROWS = [find_colours("view.js", rf"parts\.{name} = makeArrow.*")[0] for name in "mwp"]
CIRCLES = find_colours("apex_sphere.js", "INK = .*")
LIGHT, DARK = zip(
    *(find_colours("style.css", rf"--{name}: light-dark.*") for name in ("ground", "panel")),
    strict=True,
)
FAINT = find_colours("style.css", "--faint: light-dark.*")
HALL = find_colours("controls.css", r"\.projector \{[^}]*")  # ground, panel, faint: light, dark
EDGES = find_colours("controls.css", "--edge: light-dark.*")


def to_linear(colour):
    part = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


def compute_contrast(one, other):
    low, high = sorted(TO_XYZ[1] @ to_linear(colour) for colour in (one, other))
    return (high + 0.05) / (low + 0.05)


def to_lab(colour, eye):
    """Return the CIELAB coordinates of a colour as perceived by `eye`."""
    part = TO_XYZ @ np.clip(np.array(EYES[eye]) @ to_linear(colour), 0, 1) / WHITE
    x, y, z = np.where(part > 216 / 24389, np.cbrt(part), (24389 / 27 * part + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("ground", [*LIGHT, *DARK])
def test_lines_stand_out(ground):
    assert len(TOPS) == 6 and len(ARROWS) == 3
    for colour in [*TOPS, *ARROWS, *CIRCLES]:
        assert compute_contrast(colour, ground) >= 3, colour


@pytest.mark.parametrize("mode", [0, 1], ids=["light", "dark"])
def test_a_projector_shows_lines_and_text(mode):
    ground, panel, faint = HALL[mode::2]
    for colour in [*TOPS, *ARROWS, *CIRCLES]:
        assert compute_contrast(colour, ground) >= 3, colour
    assert min(compute_contrast(faint, ground), compute_contrast(faint, panel)) >= 7


@pytest.mark.parametrize("mode", [0, 1], ids=["light", "dark"])
def test_text_and_borders_stand_out(mode):
    for ground in (LIGHT, DARK)[mode]:
        assert compute_contrast(FAINT[mode], ground) >= 4.5
        assert compute_contrast(EDGES[mode], ground) >= 3


@pytest.mark.parametrize("eye", EYES)
def test_tops_are_told_apart(eye):
    for one, other in itertools.combinations(TOPS, 2):
        assert np.linalg.norm(to_lab(one, eye) - to_lab(other, eye)) > 20, (one, other)


@pytest.mark.parametrize("eye", EYES)
def test_the_first_and_the_second_method_are_told_apart_at_a_glance(eye):
    first, _, second, *_ = TOPS
    assert np.linalg.norm(to_lab(first, eye) - to_lab(second, eye)) > 60


TEXTS = [
    (preset["name"], text)
    for preset in json.loads((VIEWER / "presets.json").read_text(encoding="utf-8"))
    for text in [preset["about"], *(each["text"] for each in preset.get("exercises", []))]
]


@pytest.mark.parametrize("name, text", TEXTS)
def test_a_text_says_where_a_coloured_top_is(name, text):
    """Check that texts identify a top not only by colour, but by its side or its dashed line."""
    for colour in re.findall(r"\b(red|yellow|violet|green)\b", text.lower()):
        first = text.lower().index(colour)
        around = text.lower()[max(0, first - 40) : first + 50]
        assert re.search("left|right|dashed", around), (name, colour)


@pytest.mark.parametrize("eye", EYES)
def test_the_momentum_is_told_from_the_first_top(eye):
    assert np.linalg.norm(to_lab(TOPS[0], eye) - to_lab(ARROWS[0], eye)) > 20
