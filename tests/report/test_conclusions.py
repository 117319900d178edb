"""What the report concludes from what it found. Nothing here asserts a time."""

import pytest

from validation.parts import atlas, left_out, truth
from validation.parts.judge import DRIFT
from validation.truth import reference
from validation.truth.problems import HORIZONS, SHORT, load


@pytest.mark.parametrize("name", HORIZONS)
def test_the_truths_agree_within_the_conditioning_and_the_sentence_says_so(name):
    kept = reference.stored(name, SHORT)
    line = {
        "scene": name,
        "conditioning": kept["conditioning"],
        "ways": list(reference.ways(load(name), SHORT, kept)),
    }
    ((_, many, _),) = truth.agreement([line])
    assert many < 1e-6, "of a rounding of the data"
    assert truth.concluded([line]).startswith(
        "On every scene the truths of many digits agree within the conditioning"
    )
    apart = line | {"ways": [("heyoka, 128 bit, momentum", 2 * kept["conditioning"])]}
    assert truth.concluded([apart]).startswith(f"On all scenes but {name} the truths")


def cell(method, verdict, mark="", shown_by="second run"):
    return {
        "method": method,
        "case": "a case",
        "verdict": verdict,
        "mark": mark,
        "shown_by": shown_by,
    }


def concluded(found):
    return atlas.concluded(atlas.Atlas(found, []))


def test_the_verdict_on_the_atlas_counts_what_is_there():
    said = concluded(
        [
            cell("a", "right", shown_by=""),
            cell("a", "degraded", DRIFT),
            cell("b", "silent", "!", ""),
        ]
    )
    assert (
        "Of 3 cells one is wrong in silence: b on a case" in said
        and "1 are right, 1 degraded" in said
    )
    assert "Of 1 cells none is wrong in silence." in concluded([cell("a", "right", shown_by="")])
    assert concluded([]) == ""


def test_what_is_left_out_is_said_and_measured():
    found = left_out.examine(load("thesis"), SHORT, 1)
    rows = {row["case"]: row for row in found["rows"]}
    assert set(found["plans"]) == {"all", "level"} and all(
        "left out" in text for text in found["plans"].values()
    )
    assert rows["states on the way"]["bytes"] * 100 < rows["states on the way"]["bytes_with"]
    assert rows["attitude"]["bytes"] < rows["attitude"]["bytes_with"], (
        "two numbers and the time for six and the time"
    )
    assert (
        rows["the general form of the body"]["bytes"]
        == rows["the general form of the body"]["bytes_with"]
    )
    assert all(row["seconds"] > 0 and row["seconds_with"] > 0 for row in rows.values())
