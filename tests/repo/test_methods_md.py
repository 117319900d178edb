"""Tests that METHODS.md is up to date."""

import kreisel as kr
from internals import page_of_methods, table_of_costs
from toolbox import ROOT


def test_the_table_has_a_row_for_each_method():
    lines = [line for line in page_of_methods(kr.methods).splitlines() if line.startswith("|")]
    assert len(lines) == 2 + len(kr.methods) and all(
        line.count("|") == lines[0].count("|") for line in lines
    )
    assert all(any(line.startswith(f"| {name} |") for line in lines) for name in kr.methods)


def test_costs_are_relative_to_those_of_rk4(monkeypatch):
    peers = [100e-9, 200e-9, 400e-9]
    costs = {name: [3 * cost for cost in peers] for name in kr.methods} | {"rk4": peers}
    monkeypatch.setattr(table_of_costs, "_measure_step_times_of_methods", lambda _: costs)
    text = page_of_methods(kr.methods)
    assert "rk4 took 100 ns for the first top" in text
    assert "| strang | 2 | 3.0 | 3.0 | 3.0 |" in text and "| rk4 | 4 | 1.0 | 1.0 | 1.0 |" in text


def test_methods_md_is_up_to_date():
    """Check that METHODS.md agrees with the current table, apart from the measured costs.

    To update METHODS.md, run `kreisel methods --markdown > METHODS.md`.
    """

    def cells(text):
        lines = [line for line in text.splitlines() if line.startswith("| ") and "---" not in line]
        rows = [line.strip("| ").split(" | ") for line in lines]
        return {row[0]: row[1:2] + row[-3:] for row in rows}

    page_text = (ROOT / "METHODS.md").read_text()
    now = cells(page_of_methods(kr.methods))
    optional = {"gsl_rk8pd", "gsl_bsimp"} - set(kr.methods)
    assert {name: row for name, row in cells(page_text).items() if name not in optional} == now
    assert "`kreisel methods --markdown > METHODS.md`" in page_text
