"""Tests that the report includes a new method automatically."""

import ast
from dataclasses import fields

import kreisel as kr
import pytest
from toolbox import ROOT

from validation.competitors import method_families, single_runs
from validation.parts import (
    atlas_cases,
    atlas_cells,
    omissions,
    published,
    random_tops,
    stiff_needle,
)
from validation.references.problems import load_problem

MACHINERY = [
    file
    for folder in ("competitors", "drawing", "parts", "report")
    for file in sorted((ROOT / "validation" / folder).glob("*.py"))
]
NAMED = {  # files that contain the name of a method, each with the reason
    "advice": {"exact", "taylor"},  # the methods whose times for late states are stated
    "calls": {"taylor"},  # the method that is compared with heyoka's series
    "chaos": {"taylor"},  # the method that integrates the tangents for the exponents
    "omissions": {"suzuki4", "taylor"},  # the methods whose omissions are measured
    "ensemble_runs": {"exact", "taylor", "gsl_rk8pd"},  # methods for many tops in one call
    "published": {"rk4"},  # a method that is used only to get the angular velocity at the start
    "fastest": {"gsl_rk8pd"},  # the peer in the tables
    "frequency_data": {"taylor"},  # the method whose frequencies are compared with the closed form
    "late_states": {"exact", "taylor"},  # the closed form, and the series that it is compared with
    "stiff_needle": {"exact"},  # the reference, and not a method that is compared
    "style": {"exact", "taylor", "gsl_rk8pd", "gsl_bsimp"},  # lines of one style in all figures
}
NEW = "of_a_later_day"


class NewMethod(kr.Method):
    """A user-defined method that behaves exactly like the method suzuki4."""

    def suits(self, scene):
        return kr.methods["suzuki4"].suits(scene)


@pytest.fixture
def new_method(monkeypatch):
    suzuki4, solve = kr.methods["suzuki4"], kr.solve

    def solve_with_new_method(scene, t, method="auto", **words):
        return solve(scene, t, "suzuki4" if method == NEW else method, **words)

    monkeypatch.setattr(kr, "solve", solve_with_new_method)
    words = {field.name: getattr(suzuki4, field.name) for field in fields(suzuki4)}
    monkeypatch.setitem(kr.methods, NEW, NewMethod(**words | {"name": NEW}))


def test_a_new_method_appears_everywhere(new_method):
    case = next(case for case in atlas_cases.gravity_cases())
    assert NEW in {cell["method"] for cell in atlas_cells.make_cells(case)}
    assert NEW in {line["method"] for line in stiff_needle.measure_needle()}
    assert NEW in {run["method"] for run in random_tops.measure_kind("general", 1)}
    (problem,) = (
        candidate
        for candidate in published.load_problems()
        if candidate.name == "simo_wong_fast_top"
    )
    assert NEW in {row["by"] for row in published.measure_problem(problem, quick=True)}
    assert NEW in {row["name"] for row in omissions.measure_forms(1)}
    assert NEW in {
        contender.name for contender in single_runs.list_contenders(load_problem("asymmetric"))
    }
    assert [title for title, (own, _) in method_families.group_methods().items() if NEW in own] == [
        "fixed step, order 3 and 4"
    ]


def test_every_method_is_in_one_family_or_a_peer():
    places = [name for own, _ in method_families.group_methods().values() for name in own]
    peers = next(iter(method_families.group_methods().values()))[1]
    assert sorted(places + [name for name in peers if name in kr.methods]) == sorted(kr.methods)


@pytest.mark.parametrize("file", MACHINERY, ids=lambda file: file.stem)
def test_general_files_name_no_method(file):
    words = {
        node.value
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.Constant) and node.value in kr.methods
    }
    assert words == NAMED.get(file.stem, set()) & set(kr.methods)
