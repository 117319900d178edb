"""Tests of the report's table of run times for computing states at large times."""

from types import SimpleNamespace

import pytest

from validation.parts import formatting, late_states
from validation.references.problems import load_problem

QUICK = SimpleNamespace(quick=True)


def test_only_tops_on_a_torus_have_a_late_state():
    for name, count in (
        ("kowalewski", 1),
        ("goryachev_chaplygin", 1),
        ("thesis", 0),
        ("asymmetric", 0),
    ):
        assert len(list(late_states.list_tasks(load_problem(name), QUICK))) == count


def test_a_late_state_is_measured_against_128_bit():
    [task] = late_states.list_tasks(load_problem("kowalewski"), QUICK)
    findings = task.make()
    assert findings["state"] > 0.0 and findings["taylor"] > 0.0 and findings["error"] < 1e-13
    text = late_states.describe_late_state(findings)
    assert text.startswith("One state at t = 1000:") and "relative to heyoka in 128 bit" in text


def test_without_measurements_the_sentence_is_empty():
    assert late_states.describe_late_state(None) == ""


@pytest.mark.parametrize(
    ("ratio", "text"), [(5578624.0, "5,600,000"), (28.4, "28"), (3610.0, "3,600")]
)
def test_ratios_have_two_digits(ratio, text):
    assert formatting.format_large(ratio) == text
