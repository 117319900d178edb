"""Tests of the argument `want` and of kreisel.plan."""

import math
import pickle
import tracemalloc

import kreisel as kr
import numpy as np
import pytest
from internals import CHUNK_SIZE, HEADING_DEPENDENT, RECORDABLE
from kreisel._solve import ensemble_plan
from tops import FREE, WILD, scene_for, words_for

THESIS = kr.scenes.thesis

TOP = kr.scenes.asymmetric
MANY = np.linspace(0, 20, CHUNK_SIZE + 123)  # more states than in a chunk
TOPS = kr.scenes.thesis.vary(spin=[1.0, 2.0, 3.0], tilt=[[0.2], [0.4]])


# The argument want=


@pytest.mark.parametrize("method", ["strang", "extrap", "exact", "taylor"])
def test_want_does_not_change_the_values(method):
    scene, words = scene_for(method), words_for(method)
    names = [*RECORDABLE]
    whole, path = (
        kr.solve(scene, MANY, method, **words),
        kr.solve(scene, MANY, method, want=names, **words),
    )
    assert path.want == tuple(names) and path.stats == whole.stats and len(path) == len(whole)
    for name in ("t", *names):
        assert np.array_equal(getattr(path, name), getattr(whole, name), equal_nan=True), name
        assert not getattr(path, name).flags.writeable
    with pytest.raises(
        AttributeError, match=r"no 'states': it has only the quantities of .*; solve without want"
    ):
        _ = path.states


def test_only_wanted_quantities_are_recorded():
    path = kr.solve(TOP, 3, want=("energy", "t", "energy"))
    assert path.want == ("energy",) and path.t.tolist() == [0, 3] and path.energy.shape == (2,)
    for name in RECORDABLE.keys() - {"energy"}:
        with pytest.raises(
            AttributeError, match=rf"no '{name}': .*want=\('energy',\).*; add '{name}' to want"
        ):
            getattr(path, name)
    for name in ("states", "end", "rotation", "q_xyzw", "energy_error"):
        with pytest.raises(AttributeError, match=f"no '{name}'"):
            getattr(path, name)
    with pytest.raises(AttributeError, match="did you mean 'energy'"):
        _ = path.enrgy
    again = pickle.loads(pickle.dumps(path))
    assert np.array_equal(again.energy, path.energy) and again.want == path.want
    assert kr.solve(TOP, 3, want=("energy", "kinetic")).energy_error < 1e-14
    assert len(kr.solve(TOP, [], want=("energy",))) == 0


@pytest.mark.parametrize("scene", [TOP, kr.scenes.kowalewski, kr.scenes.goryachev_chaplygin])
def test_quantities_without_heading_are_right(scene):
    times = np.linspace(0, 10, 300)
    names = tuple(name for name in RECORDABLE if name not in HEADING_DEPENDENT)
    path, whole = kr.solve(scene, times, want=names), kr.solve(scene, times, digits=20)
    assert "attitude" in dict(path.plan.left_out)
    for name in names:
        size = np.abs(getattr(whole, name)).max() + np.abs(whole.kinetic).max()
        np.testing.assert_allclose(
            getattr(path, name), getattr(whole, name), atol=1e-11 * size, equal_nan=True
        )
    turning = kr.solve(scene, times, want=(*names, "apex"))
    assert "attitude" not in dict(turning.plan.left_out)
    np.testing.assert_allclose(turning.apex, whole.apex, atol=1e-11)


def test_want_needs_little_memory():
    times, peaks = np.linspace(0, 10, 1_000_000), []
    for words in ({}, {"want": ("energy",)}):
        tracemalloc.start()
        kr.solve(TOP, times, **words)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert (
        peaks[0] > 64e6 and peaks[1] < 28e6
    )  # in bytes: of all states, or of the times, the energy and one chunk of states


@pytest.mark.parametrize(
    "want, kind, message",
    [
        ("energy", TypeError, r"want must be names of quantities, as want=\('apex', 'energy'\)"),
        (7, TypeError, "want must be names"),
        ((), ValueError, "want contains no quantity"),
        (("enrgy",), ValueError, "'enrgy'; did you mean 'energy'"),
        ((3,), ValueError, "unknown quantity in want: '3'"),
    ],
)
def test_want_refuses_invalid_values(want, kind, message):
    for call in (
        lambda: kr.solve(TOP, 1, want=want),
        lambda: kr.plan(TOP, want=want),
        lambda: kr.start(TOP, want=want),
        lambda: kr.stream(TOP, [1.0], want=want),
    ):
        with pytest.raises(kind, match=message):
            call()


def test_nutation_is_accurate_at_the_poles():
    for angle in (1e-12, 1e-5, 1.0, math.pi - 1e-5):
        scene = kr.scenes.thesis.replace(
            attitude=(math.cos(angle / 2), math.sin(angle / 2), 0, 0), momentum=(0, 0, 1)
        )
        assert kr.solve(scene, [0.0]).nutation[0] == pytest.approx(angle, abs=1e-15, rel=1e-15)


def test_failures_keep_wanted_quantities():
    paths = []
    for words in ({}, {"want": ("energy",)}):
        with pytest.raises(kr.Error) as failure:
            kr.solve(WILD, [0.5, 50.0], "rk4", step=0.5, **words)
        paths.append(failure.value.path)
    whole, part = paths
    assert np.array_equal(part.energy, whole.energy)
    assert part.t.tolist() == whole.t.tolist() == [0.5]


def test_geometric_records_wanted_quantities():
    path = kr.solve(kr.scenes.thesis, 5, "geometric", error=1e-6, want=("apex",))
    assert path.want == ("apex",) and path.error < 1e-6 and path.plan.choice.target == 1e-6


# Plans


def plan_omissions(scene, *t, **words):
    return dict(kr.plan(scene, *t, **words).left_out)


def plan_surplus(scene, **words):
    return dict(kr.plan(scene, **words).kept)


def test_plan_describes_method_form_and_memory():
    plan = kr.plan(TOP, want=("nutation", "energy"))
    assert plan.method == "taylor" and "general" in plan.why
    assert plan.columns == ("t", "nutation", "energy") and plan.bytes == 24
    assert plan.kernel in ("avx512", "avx2", "neon", "base") and plan.order in (12, 16, 18, 22, 28)
    assert plan.form.startswith("(W, P)")
    assert all(len(line) < 200 for line in str(plan).splitlines())
    assert "left out" in str(plan) and "24 bytes a state" in str(plan)
    assert kr.plan(TOP, 100).bytes == 64
    tops = TOP.vary(spin=[1.0, 2.0])
    assert "16 bytes a state" in str(kr.plan(tops, want=("nutation", "energy"), method="taylor"))
    assert kr.plan(TOP, digits=30).columns[-1] == "m_low"
    closed = kr.plan(kr.scenes.thesis)
    assert closed.method == "exact" and "closed form" in closed.why


def test_plan_lists_omitted_computations():
    omissions = plan_omissions(TOP, want=("nutation", "energy"))
    assert "rotated about the vertical" in omissions["attitude"]
    assert "attitude" not in plan_omissions(TOP, 100) and "states in between" in plan_omissions(
        TOP, 100
    )
    assert "states in between" not in plan_omissions(TOP, [1, 2, 3])
    assert "attitude" in plan_surplus(TOP, want=("energy",), digits=30)
    assert "attitude" in plan_surplus(TOP, want=("energy",), method="strang", step=0.1)
    assert "gravity" in plan_omissions(FREE.replace(gravity=0))
    assert "torque" in plan_surplus(TOP.replace(gravity=0), method="taylor")
    turns = plan_omissions(kr.scenes.thesis, method="strang", step=0.1)
    assert "two of the four rotations of a drift" in turns


def test_plan_refuses_invalid_arguments():
    with pytest.raises(ValueError, match="'geometric' chooses by trial runs"):
        kr.plan(TOP, method="geometric")
    with pytest.raises(ValueError, match="has a fixed step: give step"):
        kr.plan(TOP, method="rk4")
    with pytest.raises(TypeError, match=r"scene must be a kreisel\.Scene"):
        kr.plan(3)
    for words in ({"threads": 2}, {"reduce": {"energy": "min"}}):
        with pytest.raises(
            ValueError, match=rf"^{next(iter(words))}: only for a kreisel\.Ensemble"
        ):
            kr.plan(TOP, **words)


def test_the_plan_equals_that_of_the_path():
    for words in (
        {},
        {"want": ("energy",)},
        {"digits": 20},
        {"method": "strang", "step": 0.1},
        {"tol": 1e-3},
    ):
        path = kr.solve(TOP, 5, **words)
        assert (
            path.plan == kr.plan(TOP, 5, **words)
            and path.plan == pickle.loads(pickle.dumps(path)).plan
        )
    assert kr.exact(kr.scenes.thesis)(3).plan.method == "exact"
    assert kr.solve(TOP, -5, "strang", step=0.1).plan.step == 0.1


@pytest.mark.parametrize("name", [name for name, method in kr.methods.items() if method.splitting])
def test_plan_lists_omitted_rotations_of_a_drift(name):
    asymmetric, text = kr.scenes.asymmetric, "two of the four rotations of a drift"
    assert kr.scenes.thesis.body.is_symmetric and not asymmetric.body.is_symmetric
    assert text in plan_omissions(kr.scenes.thesis, method=name, step=0.1)
    if kr.methods[name].suits(asymmetric):
        assert text not in plan_omissions(asymmetric, method=name, step=0.1)


# Details of plans and of the argument want=


def test_a_plan_shows_its_total_size():
    plan = kr.plan(TOPS, [1.0, 2.0, 3.0], threads=2)
    assert f"3 states each: {1e-6 * plan.bytes:.3g} MB in all" in str(plan)
    assert f"about {plan.seconds:.2g} s, measured on 6 of the tops" in str(plan)


def test_a_plan_measures_tops_at_individual_times(monkeypatch):
    calls = []
    lanes = ensemble_plan.LANES

    def run_and_note(rows, few, some, begin, end, times, work):
        calls.append(np.array(times))
        return lanes.run(rows, few, some, begin, end, times, work)

    monkeypatch.setattr(ensemble_plan, "LANES", lanes._replace(run=run_and_note))
    own = np.arange(1.0, 101.0)[:, None] * np.array([0.001, 0.002])
    kr.plan(THESIS.vary(spin=np.linspace(1.0, 2.0, 100)), own)
    indices = np.linspace(0, 99, 16).astype(int)
    np.testing.assert_array_equal(calls[0], own[indices])


def test_low_words_are_recorded_only_for_wanted_quantities():
    assert kr.solve(TOP, [1.0], digits=16, want=["q"]).q_low.tolist() == [[0.0] * 4]
    with pytest.raises(AttributeError, match="q_low"):
        _ = kr.solve(TOP, [1.0], digits=17, want=["q"]).q_low


@pytest.mark.parametrize(
    "want, digits, names",
    [
        (("q",), 20, "'q_low'"),
        (("q",), 30, "'q_low'"),
        (("q_low",), 30, "'q'"),
        (("energy",), 20, "'q' and 'q_low'"),
        (("energy",), None, "'q'"),
        (("energy",), 16, "'q'"),
    ],
)
def test_a_path_without_error_names_the_quantities_to_add(want, digits, names):
    path = kr.solve(TOP, [1.0], want=want, digits=digits)
    with pytest.raises(AttributeError, match=rf"no 'error': .*; add {names} to want$"):
        _ = path.error
    assert "error" not in dir(path)
    more = tuple(name.strip("'") for name in names.split(" and "))
    whole = kr.solve(TOP, [1.0], want=want + more, digits=digits)
    assert whole.error == kr.solve(TOP, [1.0], digits=digits).error and "error" in dir(whole)


def test_the_plan_lists_the_attitude_only_for_methods_that_compute_it():
    def plan_surplus(method, want, **words):
        return dict(kr.plan(TOP, method=method, want=want, **words).kept)

    assert "strang always computes it" in plan_surplus("strang", ("energy",), step=0.01)["attitude"]
    assert "attitude" not in plan_surplus("strang", ("apex",), step=0.01)
    assert "attitude" not in plan_surplus("strang", None, step=0.01)
    assert "attitude" not in plan_surplus("taylor", ("energy",))
    assert "always computes it" in plan_surplus("taylor", ("energy",), digits=30)["attitude"]
    symmetric = kr.plan(kr.scenes.thesis, method="exact", want=("energy",))
    assert "attitude" not in dict(symmetric.kept)


def test_the_plan_lists_unused_savings_of_taylor():
    def plan_surplus(scene, **words):
        return set(dict(kr.plan(scene, method="taylor", **words).kept))

    assert plan_surplus(TOP) == set() and plan_surplus(kr.scenes.thesis) == {"general form"}
    assert plan_surplus(TOP.replace(gravity=0.0)) == {"torque"}
    assert "general form" not in dict(kr.plan(kr.scenes.thesis, method="strang", step=0.1).kept)


def test_a_plan_counts_closed_forms_of_the_method_exact():
    plan = kr.plan(TOPS, [1.0], method="exact")
    assert (plan.closed_form, plan.lanes, plan.alone) == (6, 0, 0)
