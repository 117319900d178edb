"""Small promises of runs, plans, events and the command line."""

import dataclasses
import subprocess
import sys
from pathlib import Path

import kreisel as kr
import pytest
from kreisel import events

TOP = kr.scenes.asymmetric


def test_a_run_that_has_not_begun_has_cost_nothing():
    run = kr.start(TOP, "strang", step=0.01)
    assert (run.t, tuple(run.stats)) == (0.0, (0, 0, 0, 0))
    assert tuple(kr.resume(run.checkpoint).stats) == (0, 0, 0, 0)
    assert repr(run) == "<kreisel.Run: strang at t = 0, 0 steps>"


def test_an_event_cannot_be_changed():
    event = events.nutation()
    with pytest.raises(dataclasses.FrozenInstanceError):
        event.direction = 1


def test_the_plan_keeps_an_attitude_only_where_a_method_computes_it_anyway():
    def kept(method, want, **words):
        return dict(kr.plan(TOP, method=method, want=want, **words).kept)

    assert "strang computes it" in kept("strang", ("energy",), step=0.01)["attitude"]
    assert "attitude" not in kept("strang", ("apex",), step=0.01)
    assert "attitude" not in kept("strang", None, step=0.01)
    assert "attitude" not in kept("taylor", ("energy",))
    assert "no form without it" in kept("taylor", ("energy",), digits=30)["attitude"]
    symmetric = kr.plan(kr.scenes.thesis, method="exact", want=("energy",))
    assert "attitude" not in dict(symmetric.kept)


def test_the_plan_keeps_what_two_equal_moments_or_no_torque_would_save():
    def kept(scene, **words):
        return set(dict(kr.plan(scene, method="taylor", **words).kept))

    assert kept(TOP) == set() and kept(kr.scenes.thesis) == {"general form"}
    assert kept(TOP.replace(gravity=0.0)) == {"torque"}
    assert "general form" not in dict(kr.plan(kr.scenes.thesis, method="strang", step=0.1).kept)


def test_a_report_is_made_by_the_tree_in_which_it_is_asked_for(tmp_path):
    folder = tmp_path / "validation"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "__main__.py").write_text("def main(words):\n    print('made here', words)\n")
    kreisel = Path(sys.executable).parent / "kreisel"  # whose folder is first in sys.path
    done = subprocess.run(
        [kreisel, "report", "--quick"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=60,
    )
    assert done.stdout == "made here ['--quick']\n" and done.returncode == 0
