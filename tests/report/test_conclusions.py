"""Tests of the conclusions in the report. No assertion depends on run times."""

from types import SimpleNamespace

import pytest

from validation.parts import atlas, fastest, omissions, scene_runs, truth, workprecision
from validation.parts.verdicts import DRIFT
from validation.references import reference
from validation.references.problems import HORIZONS, SHORT, load_problem


@pytest.mark.parametrize("name", HORIZONS)
def test_references_agree_within_the_conditioning(name):
    entry = reference.load_truth(name, SHORT)
    line = {
        "scene": name,
        "conditioning": entry["conditioning"],
        "ways": list(reference.compare_computations(load_problem(name), SHORT, entry)),
    }
    ((_, many, _),) = truth.summarize_agreement([line])
    assert many < 1e-6, "of a rounding of the data"
    assert truth.conclude([line]).startswith(
        "On every scene the high-precision results agree within the conditioning"
    )
    outlier = line | {"ways": [("heyoka, 128 bit, momentum", 2 * entry["conditioning"])]}
    assert truth.conclude([outlier]).startswith(f"On all scenes but {name} the high-precision")


def cell(method, verdict, mark="", sign="second run"):
    return {
        "method": method,
        "case": "a case",
        "verdict": verdict,
        "mark": mark,
        "shown_by": sign,
    }


def conclude(cells):
    return atlas.conclude(atlas.Atlas(cells, []))


def test_the_conclusion_on_the_atlas_counts_verdicts():
    conclusion = conclude(
        [
            cell("a", "right", sign=""),
            cell("a", "degraded", DRIFT),
            cell("b", "silent", "!", ""),
        ]
    )
    assert (
        "One of 3 cells is silently wrong: b on a case" in conclusion
        and "33 % are right: " in conclusion
        and "0 % are within the requested tolerance. " in conclusion
        and "33 % are degraded: " in conclusion
    )
    assert "None of 1 cells is silently wrong." in conclude([cell("a", "right", sign="")])
    assert conclude([]) == ""


def run(scene, method, seconds):
    values = {"attitude_error": 1e-13, "energy_error": 1e-13, "samples": [seconds]}
    return scene_runs.Measurement(scene, 1.0, method, method == "heyoka", **values)


def test_similar_times_are_a_tie():
    rows = []
    for scene, own, peer in (
        ("won", 1.0, 1.34),
        ("ahead", 1.0, 1.33),
        ("behind", 1.33, 1.0),
        ("lost", 1.34, 1.0),
        ("alone", 1.0, None),
    ):
        rows.append(run(scene, "taylor", own))
        rows += [run(scene, "heyoka", peer)] if peer else []
    scenes = list(dict.fromkeys(row.scene for row in rows))
    conclusion = workprecision.conclude(
        workprecision.Comparison([(SimpleNamespace(name=scene), 1.0) for scene in scenes], {}, rows)
    )
    n = len(fastest.TARGETS)
    assert conclusion.startswith(
        f"In {2 * n} of {5 * n} cases (5 scenes, {n} accuracies) kreisel is fastest: "
        f"taylor ({2 * n}). {2 * n} cases are ties: "
    )
    assert "ahead at 1e-3 rad (taylor and heyoka)" in conclusion.split("ties: ")[1].split(". ")[0]
    losses = conclusion.split("Another integrator is faster for ")[1]
    assert losses.count("lost at") == n and losses.count(" at ") == n
    (tie,) = [one for one in fastest.run_races(rows, ["ahead"]) if one[1] == 1e-3]
    assert (
        workprecision.describe_ties([tie])
        == "One case is a tie: ahead at 1e-3 rad (taylor and heyoka)."
    )


def test_only_faster_runs_recover_the_compile_time():
    """Check the sentence on heyoka's compile time when heyoka is faster, is slower, or was not
    run."""
    rows = [run("lost", "taylor", 1.25), run("won", "taylor", 0.5)]
    peers = [run("lost", "heyoka", 1.0), run("won", "heyoka", 1.0)]
    for peer in peers:
        peer.setup_seconds = 2.0
    n = len(fastest.TARGETS)
    text = workprecision.describe_payment(rows + peers, ["lost", "won"])
    assert text.startswith(f"It is paid in {n} of {2 * n} rows of the summary, after 8 to 8 runs;")
    text = workprecision.describe_payment(rows[1:] + peers[1:], ["won"])
    assert text.startswith(f"It is paid in none of {n} rows of the summary")
    assert workprecision.describe_payment(rows, ["lost", "won"]) == ""


def test_omissions_are_listed_and_measured():
    findings = omissions.measure_scene(load_problem("thesis"), SHORT, 1)
    rows = {row["case"]: row for row in findings["rows"]}
    assert set(findings["plans"]) == {"all", "level"} and all(
        "left out" in text for text in findings["plans"].values()
    )
    assert rows["intermediate states"]["bytes"] * 100 < rows["intermediate states"]["bytes_with"]
    assert rows["attitude"]["bytes"] < rows["attitude"]["bytes_with"], (
        "two numbers and the time for six and the time"
    )
    assert (
        rows["the general form of the body"]["bytes"]
        == rows["the general form of the body"]["bytes_with"]
    )
    assert all(row["seconds"] > 0 and row["seconds_with"] > 0 for row in rows.values())


@pytest.mark.parametrize(
    "ratios, expected",
    [
        ([1.0, 1.01, 3.0], "makes no difference in the median (1 to 3 times as fast)"),
        ([0.5, 0.82, 1.1], "makes a run 22 % slower in the median (0.5 to 1.1 times as fast)"),
        ([1.0, 1.5, 4.0], "makes a run 1.5 times as fast in the median (1 to 4 times as fast)"),
        ([1.04], "makes a run 4 % faster in the median (1 to 1 times as fast)"),
    ],
)
def test_a_saving_is_worded_by_its_median(ratios, expected):
    assert omissions.describe_saving("gravity", ratios) == f"Leaving out gravity {expected}."
