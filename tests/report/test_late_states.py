"""Tests of the report's table of run times for computing states at large times."""

from types import SimpleNamespace

from validation.parts import late_states
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
