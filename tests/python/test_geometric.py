"""Tests that method="geometric" meets the requested error or raises an exception."""

import kreisel as kr
import numpy as np
import pytest

LAGRANGE, ASYMMETRIC = kr.scenes.thesis, kr.scenes.asymmetric
PENDULUM = kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True)


def solve(scene, t, error, **more):
    return kr.solve(scene, t, method="geometric", error=error, **more)


def find_error(scene, path):
    return kr.attitude_error(path.q, kr.solve(scene, path.t, digits=20).q).max()


def tilt_about_e1(angle):
    return (np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0)


@pytest.mark.parametrize("target", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("name", ["thesis", "kowalewski", "asymmetric"])
def test_the_requested_error_is_met_and_the_choice_is_shown(name, target):
    scene, times = kr.scenes.get_scene(name), np.linspace(0, 20, 41)
    path = solve(scene, times, target)
    dense = path(np.linspace(0, 20, 333))  # also between the points of the grid
    true, choice = find_error(scene, dense), path.plan.choice
    assert true <= target and path.error <= target and true <= 3 * path.error + 1e-11
    assert np.array_equal(path.t, times)
    assert (path.method, path.step) == (path.plan.method, path.plan.step)
    again = kr.solve(scene, times, method=choice.method, step=choice.step)
    assert np.array_equal(again.states, path.states) and choice.run == again.stats.evaluations
    assert path.stats.evaluations == choice.run + choice.trials
    assert 0 < choice.trials < 2.5 * choice.run and choice.budget >= 16 * 20 / choice.step
    text = str(path.plan)
    assert choice.method in text and f"{target:g} allowed" in text and str(choice.budget) in text


def draw_near_unstable_equilibrium(rng):
    """Return a free body turning nearly about its middle axis, or an upright top nearly at rest."""
    small = rng.normal(size=3) * 10 ** rng.uniform(-9, -4)
    if rng.random() < 0.4:
        body = kr.Body(1, (1, rng.uniform(1.6, 2.0), 2.5), (0, 0, 0))
        return kr.Scene(body, momentum=small + np.array((0, rng.uniform(1, 3), 0)), gravity=0.0)
    moments = (1.0, rng.choice([1.0, 1.3]), rng.uniform(0.4, 1.0))
    body = kr.Body(1.0, moments, (0.0, 0.0, rng.uniform(0.5, 1.0)), unphysical=True)
    tilt = tilt_about_e1(10 ** rng.uniform(-8, -3))
    return kr.Scene(body, momentum=small * rng.integers(2), attitude=tilt, gravity=1)


@pytest.mark.parametrize("seed", range(12))
def test_near_unstable_equilibria_the_error_is_met_or_refused(seed):
    rng = np.random.default_rng(seed)
    scene, target = draw_near_unstable_equilibrium(rng), 10 ** rng.uniform(-9, -4)
    times = np.linspace(0.0, rng.choice([-1, 1]) * rng.uniform(20, 100), 201)
    try:
        path = solve(scene, times, target)
    except ValueError as refusal:
        assert "cannot be met" in str(refusal)
        return
    true = find_error(scene, path)
    assert true <= target and path.error / 3 <= max(true, 1e-15) <= 3 * path.error


def test_errors_below_what_rounding_allows_are_refused():
    upright = kr.Scene(PENDULUM, (0, 0, 0), attitude=tilt_about_e1(1e-8), gravity=1)
    for scene, target in ((ASYMMETRIC, 1e-10), (upright, 1e-9), (upright, 1e-3)):
        with pytest.raises(ValueError, match="cannot be met"):
            solve(scene, 100, target)
    path = solve(upright.replace(attitude=tilt_about_e1(1e-6)), np.linspace(0, 100, 1001), 3e-3)
    assert find_error(path.scene, path) <= 3e-3


@pytest.mark.parametrize("end", [1e4, -1e4])
@pytest.mark.parametrize("most", [1, 30, 3000])
def test_a_stopped_search_leaves_a_valid_path(most, end):
    with pytest.raises(kr.Error) as error:
        solve(LAGRANGE, end, 1e-6, max_steps=most)
    path = error.value.path
    assert 0.0 <= path.t[-1] / end < 1.0 and np.isfinite(path.states).all()
    t = np.sign(end) * np.array([0.0, 1.0, 1.0, 9.0, 20.0])
    paths = solve(ASYMMETRIC.vary(gravity=[0.0, 0.5]), t, 1e-6, max_steps=20)
    for i, n in enumerate(paths.state_counts.tolist()):
        true = kr.solve(ASYMMETRIC.replace(gravity=0.5 * i), t[:n]).q
        error = kr.attitude_error(paths.states[i, :n, 1:5], true).max(initial=0.0)
        assert n == (4, 0)[i] and error < 1e-9
        assert np.isnan(paths.states[i, n:, 1:]).all()


def test_the_stated_error_is_that_of_the_recorded_states():
    body = kr.Body(1, (1, 1.7, 2.5), (0, 0, 0))  # errors are largest when it flips over
    scene, times = kr.Scene(body, momentum=(1e-6, 2, 1e-6), gravity=0.0), [10.0, 20.0, 39.0]
    path = solve(scene, times, 1e-5)
    errors = kr.attitude_error(path.q, kr.solve(scene, times, digits=20).q)
    assert path.error == pytest.approx(errors.max(), rel=1e-6)
    assert path.error < path.plan.choice.error / 3 and path.plan.choice.error <= 1e-5
    assert path[:1].error == pytest.approx(errors[0], rel=1e-6, abs=1e-15)
    of_many = solve(scene.vary(gravity=[0.0]), times, 1e-5)[0]
    assert of_many.error == solve(scene, times, 1e-5, want=("q",)).error == path.error


def test_simple_motions_and_any_times_are_accepted():
    free = LAGRANGE.replace(gravity=0.0)  # the drift of a symmetric body is exact
    assert solve(free, 100, 1e-9).plan.choice.run <= 30
    for t in ([-1, -2.5, -7], [0, 0, 1, 1], [], [0]):
        path = solve(LAGRANGE, t, 1e-6)
        truth = kr.solve(LAGRANGE, t, digits=20)
        assert path.t.tolist() == t
        assert kr.attitude_error(path.q, truth.q).max(initial=0.0) < 1e-6
