"""Tests of closed-form solutions for ensembles of Kowalewski and Goryachev-Chaplygin tops."""

import signal

import kreisel as kr
import numpy as np
import pytest
from ensembles import same, same_bits
from kreisel._solve import exact_ensemble

ATTITUDE = (0.8, 0.4, -0.2, 0.4)


def scene(moments, com, momentum):
    body = kr.Body(1.3, moments, com, unphysical=True)
    return kr.Scene(body, momentum=momentum, attitude=ATTITUDE, gravity=9.81)


# The centres of mass of the first two lie on no given axis, so their internal axes are others.
KOWALEWSKI = scene((1.4, 1.4, 0.7), (0.72, 0.54, 0.0), (0.3, 1.1, 0.8))
CHAPLYGIN = scene((2.8, 0.7, 2.8), (0.72, 0.0, -0.54), (0.9, 2.1, 0.0))
LAGRANGE = scene((0.7, 1.4, 1.4), (0.9, 0.0, 0.0), (0.3, 1.1, 0.8))
TILTED = CHAPLYGIN.replace(momentum=(0.9, 2.1, 0.1))  # its momentum has a vertical component
SCENES = [KOWALEWSKI, CHAPLYGIN, LAGRANGE, KOWALEWSKI.replace(momentum=(-1.0, 0.5, 2.0))]
TOPS = kr.Ensemble.of(SCENES).reshape(2, 2)
TIMES = np.linspace(0.5, 40.0, 150)


@pytest.mark.parametrize("t", [[0.0, 1.0], [1.0, 2.0, 5.0], [3.0, -1.0, 0.0, -7.0], [], [-2.0]])
def test_states_equal_those_of_single_scenes_bitwise(t):
    for i, one in enumerate(SCENES):
        assert same_bits(kr.exact(SCENES)(t)[i], kr.exact(one)(t).states)
        assert same_bits(kr.exact(TOPS)(t)[divmod(i, 2)], kr.exact(one)(t).states)


def test_each_top_may_have_its_own_times():
    own = np.random.default_rng(3).normal(size=(2, 2, 5))
    states = kr.exact(TOPS)(own)
    for i in np.ndindex(2, 2):
        assert np.array_equal(states[i], kr.exact(TOPS[i])(own[i]).states)


def test_attributes_equal_those_of_single_scenes():
    forms = kr.exact(TOPS)
    for i in np.ndindex(2, 2):
        one = kr.exact(TOPS[i])
        for name in ("period", "precession_rate", "spin_angle_rate"):
            assert np.array_equal(getattr(forms, name)[i], getattr(one, name), equal_nan=True)
        for name in ("frequencies", "certificate"):
            value = getattr(forms, name)[i]
            if TOPS[i].body.kind == "lagrange":
                assert np.isnan(value).all() and not hasattr(one, name)
            else:
                assert np.array_equal(value, getattr(one, name))
    assert forms.frequencies.shape == (2, 2, 3)
    with pytest.raises(ValueError, match=r"top\[0, 0\]: turning points exist for"):
        _ = forms.motion_type


def test_a_refused_scene_is_named():
    with pytest.raises(ValueError, match=r"scene\[1\]: this motion .* vertical component"):
        kr.exact([CHAPLYGIN, TILTED, TILTED])
    with pytest.raises(ValueError, match=r"top\[1\], the first of 2 such: no closed form is known"):
        damped = CHAPLYGIN.replace(damping=(0.1, 0.1, 0.1))
        kr.exact(kr.Ensemble.of([CHAPLYGIN, damped, kr.scenes.asymmetric]))


def test_solve_equals_single_runs():
    paths = kr.solve(TOPS, TIMES, method="exact")
    assert paths.method == "exact" and not paths.failed.size
    assert same(paths, kr.solve(TOPS, TIMES, method="exact", threads=1))
    back = kr.solve(TOPS, -TIMES, method="exact")
    for i in np.ndindex(2, 2):
        one = kr.solve(TOPS[i], TIMES, method="exact")
        assert np.abs(paths[i].states - one.states).max() < 2e-14
        if TOPS[i].body.kind != "lagrange":  # batches set up Lagrange tops in the user's units
            assert np.array_equal(paths[i].states, one.states) and paths[i].stats == one.stats
            other = kr.solve(TOPS[i], -TIMES, method="exact")
            assert np.array_equal(back[i].states, other.states)


def test_results_do_not_depend_on_threads():
    momenta = np.random.default_rng(1).normal(size=(40, 3)) * (1.0, 1.0, 0.0)
    tops = kr.Ensemble.of(
        [(KOWALEWSKI, CHAPLYGIN)[i % 2].replace(momentum=m) for i, m in enumerate(momenta)]
    )
    one, two = (kr.solve(tops, TIMES[:70], method="exact", threads=n) for n in (1, 2))
    assert same(one, two) and one.failed.size < 5


@pytest.mark.parametrize("scenes", [[CHAPLYGIN, TILTED], [TILTED, CHAPLYGIN], [LAGRANGE, TILTED]])
def test_a_refused_member_fails_alone(scenes):
    paths = kr.solve(kr.Ensemble.of(scenes), TIMES, method="exact")
    i = scenes.index(TILTED)
    assert paths.failed.tolist() == [i] and np.isnan(paths.q[i]).all()
    with pytest.raises(kr.Error, match=rf"top\[{i}\]: .* vertical component"):
        paths.check()
    other = kr.solve(kr.Ensemble.of([scenes[1 - i]]), TIMES, method="exact")
    assert np.array_equal(paths[1 - i].states, other[0].states)


def test_reductions_and_quantities_equal_those_of_the_states():
    paths, quantities = (kr.solve(TOPS, TIMES, "exact", want=w) for w in (None, ["energy", "apex"]))
    assert np.array_equal(quantities.energy, paths.energy)
    assert np.array_equal(quantities.apex, paths.apex)
    reductions = kr.reduce(TOPS, TIMES, {"nutation": ("min", "last")}, "exact")["nutation"]
    assert np.array_equal(reductions["min"], paths.nutation.min(axis=-1))
    assert np.array_equal(reductions["last"], paths.nutation[..., -1])
    parts = list(kr.stream(TOPS, TIMES, "exact", chunk=300))
    assert np.array_equal(np.concatenate([part.q for part in parts]), paths.q.reshape(4, -1, 4))


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs a timer with a signal")
@pytest.mark.parametrize("threads", [1, 2])
def test_ctrl_c_stops_the_preparation_of_many_tops(threads, monkeypatch):
    monkeypatch.setattr(exact_ensemble, "validate_thread_count", lambda *_: threads)
    tops = CHAPLYGIN.vary(momentum=np.broadcast_to((0.9, 2.1, 0.0), (200_000, 3)))
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.1)
    try:
        with pytest.raises(KeyboardInterrupt):
            kr.exact(tops)  # the set-up of all tops would take minutes
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_plans_count_closed_forms():
    plan = kr.plan(TOPS, TIMES, method="exact")
    assert plan.closed_form == 4 and plan.first.method == "exact"
    plan = kr.plan(TOPS, 1e6)
    assert plan.closed_form == 1 and plan.lanes == 3 and "in runs, streams" in plan.first.why
    assert [kr.solve(TOPS, 1e4)[i].method for i in ((0, 0), (0, 1), (1, 0))] == [
        "taylor",
        "taylor",
        "exact",
    ]


def test_a_sweep_records_the_closed_form(tmp_path):
    momenta = [(0.9, 2.1, 0.0), (0.9, 2.1, 0.1), (0.3, -1.4, 0.0)]
    tops = CHAPLYGIN.vary(momentum=momenta)
    sweep = kr.sweep(tops, 30.0, "exact", folder=tmp_path, reduce={"nutation": "last"})
    paths = kr.solve(tops, 30.0, "exact")
    assert sweep["status"].tolist() == paths.status.tolist() == [0, 6, 0]
    assert np.array_equal(sweep["nutation_last"], paths.nutation[:, -1], equal_nan=True)
