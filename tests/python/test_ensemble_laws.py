"""Tests that the members of an ensemble do not affect each other."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from ensembles import SCENES, TIMES, UNDAMPED, random_ensemble, same, same_path

N = 300
TOPS = random_ensemble(N)
WHOLE = kr.solve(TOPS, TIMES)


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_results_do_not_depend_on_threads(threads):
    assert same(kr.solve(TOPS, TIMES, threads=threads), WHOLE)


def test_results_do_not_depend_on_the_executor():
    with ThreadPoolExecutor(2) as pool:
        assert same(kr.solve(TOPS, TIMES, executor=pool), WHOLE)
    with ProcessPoolExecutor(2) as pool:
        assert same(kr.solve(TOPS, TIMES, executor=pool), WHOLE)
        assert same(kr.solve(TOPS, np.tile(TIMES, (N, 1)), executor=pool), WHOLE)


@pytest.mark.parametrize(
    "selection", [slice(7, 8), slice(3, 100, 7), [5, 299, 5, 0], slice(None, None, -1)]
)
def test_results_do_not_depend_on_other_members(selection):
    assert same(kr.solve(TOPS[selection], TIMES), WHOLE[selection])


LOW = [kr.events.nutation(direction=1)]


@pytest.mark.parametrize(
    "words",
    [
        {"digits": 20},
        {"events": LOW},
        {"want": ["nutation", "q_low"]},
        {"method": "taylor", "max_steps": 12},
        {"method": "geometric", "error": 1e-14},
    ],
)
def test_process_pools_report_the_same_failures_and_messages(words):
    square = TOPS[:40].reshape(5, 8)
    own = kr.solve(square, TIMES, **words)
    with ProcessPoolExecutor(2) as pool:
        pooled = kr.solve(square, TIMES, executor=pool, **words)
    assert np.array_equal(own.status, pooled.status) and np.array_equal(own.steps, pooled.steps)
    for place in np.ndindex(5, 8):
        assert same_path(own[place], pooled[place], events="events" in words)
        assert own.message(place) == pooled.message(place)


def test_results_do_not_depend_on_the_shape():
    square = kr.solve(TOPS.reshape(15, 20), TIMES)
    assert np.array_equal(square.states.reshape(N, len(TIMES), 8), WHOLE.states)
    assert same(square[3, 2:5], WHOLE[62:65]) and same(square[:, 4], WHOLE[4::20])
    assert same_path(square[14, 19], WHOLE[-1])
    alone = kr.solve(TOPS[:1].reshape(()), TIMES)
    assert alone.shape == () and np.array_equal(alone.states, WHOLE.states[0])
    assert same_path(alone[()], WHOLE[0])


def test_results_do_not_depend_on_other_requests():
    more = kr.solve(TOPS, [0.0, 0.1, 0.5, 1.7, 2.0, 5.0])
    assert np.array_equal(more.states[:, [0, 2, 4, 5]], WHOLE.states)
    own = kr.solve(TOPS, np.tile(TIMES, (N, 1)))
    assert same(own, WHOLE) and own.t.shape == (N, len(TIMES)) and WHOLE.t.shape == (len(TIMES),)


@pytest.mark.parametrize("name", kr.methods)
def test_members_move_like_single_tops(name):
    method = kr.methods[name]
    scenes = [scene for scene in SCENES if method.suits(scene)]
    words = {} if method.adaptive else {"step": 0.125}
    for times in ([0.0, 0.25, 0.3, 1.0], [-0.25, -0.3, -1.0]):
        many = kr.solve(kr.Ensemble.of(scenes), times, name, **words).check()
        for i, scene in enumerate(scenes):
            alone = kr.solve(scene, times, name, **words)
            if name == "taylor" and not any(scene.damping):
                difference = kr.attitude_error(many[i].q, alone.q).max()
                assert difference < 1e-13, (
                    "beyond the rounding differences of Taylor series in lanes"
                )
            else:
                assert same_path(many[i], alone), name


@pytest.mark.parametrize("name", ["auto", "taylor"])
def test_taylor_errors_in_ensembles_are_like_those_of_single_tops(name):
    tops = random_ensemble(60, seed=5)[np.arange(60) % 3 > 0]
    times = np.linspace(0, 50, 11)
    many = kr.solve(tops, times, name)
    truth = kr.solve(tops, times, digits=20)
    ensemble_errors = [kr.attitude_error(many.q[i], truth.q[i]).max() for i in range(len(tops))]
    single_errors = [
        kr.attitude_error(kr.solve(top, times, name).q, truth.q[i]).max()
        for i, top in enumerate(tops)
    ]
    assert 0.0 < np.median(ensemble_errors) < 3.0 * np.median(single_errors) and max(
        ensemble_errors
    ) < 10.0 * max(single_errors)


def test_a_failed_top_does_not_affect_others():
    paths = kr.solve(TOPS, TIMES, "taylor", max_steps=12)
    has_failed = paths.status != 0
    assert 0 < has_failed.sum() < N and paths.failed.tolist() == np.flatnonzero(has_failed).tolist()
    for selection in (has_failed, ~has_failed):
        assert same(paths[selection], kr.solve(TOPS[selection], TIMES, "taylor", max_steps=12))
    good = np.arange(len(TIMES)) < paths.state_counts[:, None]
    free = kr.solve(TOPS, TIMES, "taylor")
    assert kr.attitude_error(paths.q[good], free.q[good]).max() < 1e-12
    assert np.isnan(paths.q[~good]).all() and np.isnan(paths.energy[~good]).all()
    assert not np.isnan(paths.energy[good]).any()
    assert np.array_equal(paths.states[..., 0], np.broadcast_to(TIMES, (N, len(TIMES))))
    assert set(paths.status_names[has_failed]) == {"ERR_LIMIT"} and (paths.steps <= 12).all()


def test_max_steps_is_the_same_for_one_top_and_an_ensemble():
    times = [1.0, 2.0, 3.0, 5.0]
    for limit in (1, 2, 3):
        many = kr.solve(kr.Ensemble.of([kr.scenes.thesis]), times, max_steps=limit)
        with pytest.raises(kr.Error) as alone:
            kr.solve(kr.scenes.thesis, times, max_steps=limit)
        assert many.status_names.tolist() == [alone.value.status] == ["ERR_LIMIT"]
        assert same_path(many[0], alone.value.path)
    enough = kr.solve(kr.Ensemble.of([kr.scenes.thesis]), times, max_steps=4)
    assert enough.failed.size == 0


def test_a_failed_member_has_the_path_of_a_failed_single_run():
    paths = kr.solve(UNDAMPED, [1.0, 100.0], "rk4", step=0.01, max_steps=500)
    assert len(paths.failed) == len(UNDAMPED)
    for i, scene in enumerate(UNDAMPED):
        with pytest.raises(kr.Error) as alone:
            kr.solve(scene, [1.0, 100.0], "rk4", step=0.01, max_steps=500)
        assert same_path(paths[i], alone.value.path) and paths.message(i) == str(alone.value)
        assert paths.reached[i] == alone.value.path.t[-1]
    with pytest.raises(
        kr.Error, match=r"top\[0\], the first of 5 of 5: the largest number"
    ) as first:
        paths.check()
    assert first.value.paths is paths and first.value.status == "ERR_LIMIT"
    assert same_path(first.value.path, paths[0])


def test_errors_of_one_member_are_its_status():
    fast = kr.Ensemble(TOPS[1].body, momentum=[(0, 0, 1), (0, 0, 1e300), (1, 0, 0)], gravity=1)
    late = kr.solve(fast, [1.0, 2.0])
    assert late.status_names.tolist() == ["OK", "ERR_RESOLUTION", "OK"]
    assert "more turns than a double" in late.message(1) and late.message(0) == "success"
    own = kr.solve(fast[::2], [[1.0, 2.0], [1.0, 1e300]])
    assert own.status_names.tolist() == ["OK", "ERR_RESOLUTION"]
    steps = kr.Ensemble(kr.scenes.cusps.body, momentum=(0, 0, 3), gravity=[1.0, 1e9])
    large = kr.solve(steps, 1.0, "bobenko_suris4", step=0.1)
    assert large.status_names.tolist() == ["OK", "ERR_STEP_SIZE"]
    assert "would suffice" in large.message(1)


def test_reductions_do_not_depend_on_threads():
    reductions = {"nutation": ("min", "max", "mean", "variance", "last", "where_min", "where_max")}
    first, *others = (kr.reduce(TOPS, TIMES, reductions, threads=n) for n in (1, 2, 3))
    with ProcessPoolExecutor(2) as pool:
        others.append(kr.reduce(TOPS, TIMES, reductions, executor=pool))
    for other in others:
        for kind, values in first["nutation"].items():
            assert np.array_equal(values, other["nutation"][kind])
