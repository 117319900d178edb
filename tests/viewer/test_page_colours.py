"""Tests of colour contrast and of colours for colour-blind users.

WCAG 2.2 requires a contrast of 3 for lines and of 4.5 for text. A colour difference of 10 in CIELAB
is noticed immediately.
"""

import itertools
import json
import re

import pytest
from colour_vision import VISION, compute_contrast, lab_distance
from toolbox import ROOT

VIEWER = ROOT / "python/viewer"


def find_colours(file, pattern):
    """Return the hexadecimal colours in the text that matches `pattern`."""
    match = re.search(pattern, (VIEWER / file).read_text(encoding="utf-8"))
    return re.findall(r"#[0-9a-f]{6}", match[0])


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


@pytest.mark.parametrize("ground", [*LIGHT, *DARK])
def test_lines_have_enough_contrast(ground):
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
def test_text_and_borders_have_enough_contrast(mode):
    for ground in (LIGHT, DARK)[mode]:
        assert compute_contrast(FAINT[mode], ground) >= 4.5
        assert compute_contrast(EDGES[mode], ground) >= 3


@pytest.mark.parametrize("vision", VISION)
def test_colours_of_tops_are_distinguishable(vision):
    for one, other in itertools.combinations(TOPS, 2):
        assert lab_distance(one, other, vision) > 20, (one, other)


@pytest.mark.parametrize("vision", VISION)
def test_colours_of_the_first_two_methods_are_very_different(vision):
    first, _, second, *_ = TOPS
    assert lab_distance(first, second, vision) > 60


TEXTS = [
    (preset["name"], text)
    for preset in json.loads((VIEWER / "presets.json").read_text(encoding="utf-8"))
    for text in [preset["about"], *(each["text"] for each in preset.get("exercises", []))]
]


@pytest.mark.parametrize("name, text", TEXTS)
def test_texts_identify_tops_not_only_by_colour(name, text):
    """Check that each colour has the place or the line style of its top nearby in its sentence."""
    for sentence in re.split(r"(?<=\.)\s", text.lower()):
        for colour in re.finditer(r"\b(red|yellow|violet|green)\b", sentence):
            context = sentence[max(0, colour.start() - 40) : colour.start() + 50]
            assert re.search(r"\b(left|right|dashed)\b", context), (name, colour[0], sentence)


@pytest.mark.parametrize("vision", VISION)
def test_the_momentum_differs_in_colour_from_the_first_top(vision):
    assert lab_distance(TOPS[0], ARROWS[0], vision) > 20
