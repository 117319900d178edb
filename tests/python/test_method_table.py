"""Tests of the Markdown table of methods."""

import kreisel as kr
from kreisel._analysis import method_table


def test_costs_have_at_most_three_digits():
    texts = [method_table._format_cost_ratio(x) for x in (0.994, 1.0, 9.94, 10.0, 10.4, 123.4)]
    assert texts == ["0.99", "1.0", "9.9", "10", "10", "123"]


def test_the_table_of_costs_has_a_row_for_each_method():
    costs = {name: [2e-9, 3e-9, 0.0] for name in kr.methods} | {"rk4": [1e-9, 1e-9, 1e-9]}
    rows = method_table._format_methods_table_rows(kr.methods, costs).splitlines()
    assert len(rows) == 2 + len(kr.methods)
    assert {row.count("|") for row in rows} == {9}
    (strang,) = (row for row in rows if row.startswith("| strang "))
    assert [cell.strip() for cell in strang.split("|")[2:6]] == ["2", "2.0", "3.0", ""]
    (taylor,) = (row for row in rows if row.startswith("| taylor "))
    assert taylor.split("|")[2].strip() == "varies"


def test_the_closed_form_has_all_properties_of_the_motion():
    exact = kr.methods["exact"]
    assert exact.exact and exact.symplectic and exact.reversible and exact.adaptive
    assert exact.rotors and not (exact.implicit or exact.algebraic or exact.digits)
