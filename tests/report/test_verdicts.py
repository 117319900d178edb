"""What the report concludes, and that it takes in every method. Nothing here asserts a time."""

import ast
import re
from dataclasses import fields

import kreisel as kr
import pytest
from toolbox import ROOT

from validation.parts import atlas, cases, cells, ensemble, left_out, published, stiff, truth
from validation.parts.judge import DRIFT
from validation.peers import contenders, families
from validation.report import main as report
from validation.truth import reference
from validation.truth.problems import HORIZONS, SHORT, load

MACHINERY = [
    file
    for folder in ("peers", "drawing", "parts", "report")
    for file in sorted((ROOT / "validation" / folder).glob("*.py"))
]
NAMED = {  # why each of these files knows a method by name
    "left_out": {"suzuki4", "taylor"},  # what is left out of which
    "published": {"rk4"},  # asked for the angular velocity at the start, where it does nothing
    "race": {"gsl_rk8pd"},  # whom the tables compare with
    "readme_picture": {"bobenko_suris"},  # what is drawn
    "stiff": {"exact"},  # a truth, not one of those compared
}
NEW = "of_a_later_day"


class Newcomer(kr.Method):
    """suzuki4 under a name that nothing knows."""

    def suits(self, scene):
        return kr.methods["suzuki4"].suits(scene)


@pytest.fixture
def newcomer(monkeypatch):
    known, solve = kr.methods["suzuki4"], kr.solve

    def solving(scene, t, method="auto", **words):
        return solve(scene, t, "suzuki4" if method == NEW else method, **words)

    monkeypatch.setattr(kr, "solve", solving)
    words = {field.name: getattr(known, field.name) for field in fields(known)}
    monkeypatch.setitem(kr.methods, NEW, Newcomer(**words | {"name": NEW}))


def test_a_method_of_a_later_day_is_everywhere(newcomer):
    case = next(case for case in cases.gravities())
    assert NEW in {cell["method"] for cell in cells.examine(case)}
    assert NEW in {line["method"] for line in stiff.examine()}
    assert NEW in {run["method"] for run in ensemble.examine("general", 1)}
    (problem,) = (it for it in published.problems() if it.name == "simo_wong_fast_top")
    assert NEW in {row["by"] for row in published.examine(problem, quick=True)}
    assert NEW in {row["name"] for row in left_out.by_form(1)}
    assert NEW in {who.name for who in contenders.ours(load("asymmetric"))}
    assert [title for title, (own, _) in families.families().items() if NEW in own] == [
        "fixed step, order 3 and 4"
    ]


def test_every_method_is_in_one_family_or_a_peer():
    places = [name for own, _ in families.families().values() for name in own]
    peers = next(iter(families.families().values()))[1]
    assert sorted(places + [name for name in peers if name in kr.methods]) == sorted(kr.methods)


@pytest.mark.parametrize("file", MACHINERY, ids=lambda file: file.stem)
def test_the_machinery_knows_no_method_by_name(file):
    words = {
        node.value
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.Constant) and node.value in kr.methods
    }
    assert words == NAMED.get(file.stem, set()) & set(kr.methods)


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


ODD = {
    "free": kr.Scene(kr.Body(1.0, (1.0, 0.8, 0.5), (0.0, 0.0, 0.0)), body_velocity=(0.5, 0.2, 3.0)),
    "nanoparticle": cases.at(
        lambda: cases.lagrange(1.2e-33, 1e-33, 1e-18, 1e-9),
        body_velocity=(1e6, 0.0, 1e9),
        gravity=9.81,
    )(),
}


@pytest.mark.parametrize("name", ODD)
def test_the_report_takes_odd_scenes(name, tmp_path):
    ODD[name].to_toml(tmp_path / f"{name}.toml")
    assert report.main(["--quick", "--out", str(tmp_path), str(tmp_path / f"{name}.toml")]) == 0
    page = (tmp_path / "index.html").read_text()
    assert f'id="{name}"' in page and not re.search(
        r"{{|{%|\bNone\b|\bnan\b|\binf\b|Undefined", page
    )


@pytest.mark.parametrize("content", ["", "[body\nmass = 1", "mass = 1"])
def test_the_report_refuses_what_is_no_scene_by_name(content, tmp_path, capsys):
    (tmp_path / "wrong.toml").write_text(content)
    assert report.main(["--quick", "--out", str(tmp_path), str(tmp_path / "wrong.toml")]) == 2
    assert "wrong.toml" in capsys.readouterr().out.replace("\n", "")


def test_the_report_refuses_a_top_that_rests_for_ever(tmp_path, capsys):
    ODD["free"].replace(momentum=(0.0, 0.0, 0.0)).to_toml(tmp_path / "still.toml")
    assert report.main(["--quick", "--out", str(tmp_path), str(tmp_path / "still.toml")]) == 2
    assert "rests for ever" in capsys.readouterr().out.replace("\n", " ")


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
