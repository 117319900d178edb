"""Tests that method="geometric" meets the requested error or raises an exception."""

import itertools
import math
import re
from types import SimpleNamespace

import kreisel as kr
import numpy as np
import pytest
from kreisel._solve import step_search
from tops import unit

from validation.references.problems import problem_of_scene

THESIS = kr.scenes.thesis

LAGRANGE, KOWALEWSKI, ASYMMETRIC = kr.scenes.thesis, kr.scenes.kowalewski, kr.scenes.asymmetric


@pytest.mark.parametrize("target", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(
    "scene", [LAGRANGE, KOWALEWSKI, ASYMMETRIC], ids=["lagrange", "kowalewski", "asymmetric"]
)
def test_the_requested_error_is_met(scene, target):
    times = np.linspace(0, 20, 41)
    path = kr.solve(scene, times, method="geometric", error=target)
    truth = kr.solve(scene, times, method="kahan_li8", step=0.005)
    true = kr.attitude_error(path.q, truth.q).max()
    assert true <= target and path.error <= target and true <= 3 * path.error + 1e-11
    assert (
        np.array_equal(path.t, times)
        and path.plan.method == path.method
        and path.plan.step == path.step
    )


PENDULUM = kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True)


def tilt_about_e1(angle):
    return (np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0)


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


@pytest.mark.parametrize("seed", range(24))
def test_near_unstable_equilibria_the_error_is_met_or_refused(seed):
    rng = np.random.default_rng(seed)
    scene, target = draw_near_unstable_equilibrium(rng), 10 ** rng.uniform(-9, -4)
    times = np.linspace(0.0, rng.choice([-1, 1]) * rng.uniform(20, 100), 501)
    try:
        path = kr.solve(scene, times, method="geometric", error=target)
    except ValueError as refusal:
        assert "cannot be met" in str(refusal)
        return
    true = kr.attitude_error(path.q, kr.solve(scene, times, digits=20).q).max()
    assert true <= target and path.error / 3 <= max(true, 1e-15) <= 3 * path.error


@pytest.mark.parametrize("end", [1e4, -1e4])
@pytest.mark.parametrize("most", [1, 30, 3000])
def test_a_stopped_search_leaves_a_valid_path(most, end):
    with pytest.raises(kr.Error, match=f"of {end:g}") as error:
        kr.solve(LAGRANGE, end, "geometric", error=1e-6, max_steps=most)
    path = error.value.path
    assert 0.0 <= path.t[-1] / end < 1.0 and np.isfinite(path.states).all()


def turning_over():
    """Return a free body for which numerical errors are largest when it flips over."""
    return kr.Scene(kr.Body(1, (1, 1.7, 2.5), (0, 0, 0)), momentum=(1e-6, 2, 1e-6), gravity=0.0)


def test_error_and_choice_are_those_of_the_path():
    scene, times = turning_over(), [10.0, 20.0, 39.0]
    options = {"method": "geometric", "error": 1e-5}
    path = kr.solve(scene, times, **options)
    truth = kr.solve(scene, times, digits=20)
    errors = kr.attitude_error(path.q, truth.q)
    assert path.error == pytest.approx(errors.max(), rel=1e-6)
    assert path.error < path.plan.choice.error / 3 and path.plan.choice.error <= 1e-5
    assert path[:1].error == pytest.approx(errors[0], rel=1e-6, abs=1e-15)
    of_many = kr.solve(scene.vary(gravity=[0.0]), times, **options)[0]
    alone = kr.solve(scene, times, want=("q",), **options)
    assert of_many.error == alone.error == path.error


@pytest.mark.parametrize(
    "scene, t, target",
    [
        (
            kr.Scene(
                kr.Body.symmetric(1, 1, 0.06830940206246161, 1, unphysical=True),
                momentum=(-1.3239140397159607e-4, -5.742476549929807e-4, 1.0073475594600608e-5),
                attitude=unit((0.08130305842650629, 0.613292368992301, 0.785658275965672, 0.0018)),
                gravity=1,
            ),
            -50.60872601957112,
            8.9e-4,
        ),
        (
            kr.Scene(
                kr.Body.symmetric(1, 1.075, 1.129, 0.9546, unphysical=True),
                momentum=(0, 0, 0),
                attitude=unit((-0.137051384, 0.9447336, -0.08298514438, -0.28602239)),
                gravity=1,
            ),
            5.2211658,
            4.9e-4,
        ),
    ],
    ids=["slow rod", "let go"],
)
def test_long_steps_meet_the_error_between_grid_points(scene, t, target):
    path = kr.solve(scene, t, method="geometric", error=target)
    times = np.linspace(0.0, t, 400)
    true = kr.attitude_error(path(times).q, kr.solve(scene, times, digits=20).q).max()
    assert true <= target and path.plan.step > 0.5


def test_a_feasible_error_is_met_at_an_unstable_equilibrium():
    scene = kr.Scene(PENDULUM, momentum=(0, 0, 0), attitude=tilt_about_e1(1e-6), gravity=1)
    times = np.linspace(0, 100, 1001)
    path = kr.solve(scene, times, method="geometric", error=3e-3)
    assert kr.attitude_error(path.q, kr.solve(scene, times, digits=20).q).max() <= 3e-3


@pytest.mark.parametrize(
    "tilt, momentum, target", [(1e-8, 0.0, 1e-9), (1e-8, 0.0, 1e-3), (1e-6, 1e-6, 1e-6)]
)
def test_an_impossible_search_is_refused(tilt, momentum, target):
    scene = kr.Scene(PENDULUM, momentum=(momentum, 0, 0), attitude=tilt_about_e1(tilt), gravity=1)
    with pytest.raises(ValueError, match="cannot be met"):
        kr.solve(scene, 100, method="geometric", error=target)


def test_the_choice_shows_its_budget():
    choice = kr.solve(ASYMMETRIC, 20, method="geometric", error=1e-6).plan.choice
    assert choice.budget >= 64 * 20 / choice.step / 4
    assert f"{choice.budget} steps at most" in str(choice)


@pytest.mark.parametrize("name", ["asymmetric", "kowalewski", "dzhanibekov"])
def test_trial_runs_cost_less_than_the_run(name):
    top = getattr(kr.scenes, name)
    choice = kr.solve(top, 20, method="geometric", error=1e-7).plan.choice
    again = kr.solve(top, 20, method=choice.method, step=choice.step)
    assert choice.run == again.stats.evaluations and choice.trials < 1.5 * choice.run


def test_the_choice_shows_method_step_and_cost():
    path = kr.solve(LAGRANGE, 100, method="geometric", error=1e-7)
    plan = path.plan.choice
    assert path.stats.evaluations == plan.run + plan.trials and plan.trials > 0 and len(path) == 2
    assert (
        plan.method in str(path.plan)
        and "1e-07 allowed" in str(path.plan)
        and "in trial runs" in str(path.plan)
    )
    assert 1e-16 < plan.conditioning < 1e-12
    assert kr.solve(LAGRANGE, 1, method="strang", step=0.1).plan.choice is None
    assert 1e-6 < kr.solve(LAGRANGE, 1, method="strang", step=0.1).error < 1e-2


def test_simple_motions_need_few_steps():
    free = LAGRANGE.replace(gravity=0.0)  # the drift of a symmetric body is exact
    assert kr.solve(free, 100, method="geometric", error=1e-9).plan.choice.run <= 30
    still = free.replace(momentum=(0, 0, 0))
    assert kr.solve(still, 5, method="geometric", error=1e-9).q[-1].tolist() == list(still.attitude)


def test_any_times_can_be_requested():
    back = kr.solve(LAGRANGE, [-1, -2.5, -7], method="geometric", error=1e-6)
    truth = kr.solve(LAGRANGE, [-1, -2.5, -7], method="extrap", tol=1e-12)
    assert back.t.tolist() == [-1, -2.5, -7] and kr.attitude_error(back.q, truth.q).max() < 2e-6
    again = kr.solve(LAGRANGE, [0, 0, 1, 1], method="geometric", error=1e-6)
    assert again.t.tolist() == [0, 0, 1, 1] and np.array_equal(again.q[2], again.q[3])
    assert len(kr.solve(LAGRANGE, [], method="geometric", error=1e-6)) == 0
    assert tuple(kr.solve(LAGRANGE, 0, method="geometric", error=1e-6).m[-1]) == LAGRANGE.momentum


def test_errors_below_the_conditioning_are_refused():
    with pytest.raises(
        ValueError, match=r"cannot be met at t = 100.*changes the attitude by about \d"
    ):
        kr.solve(ASYMMETRIC, 100, method="geometric", error=1e-10)


@pytest.mark.parametrize(
    "words, message",
    [
        ({}, "give the allowed error"),
        ({"error": 1e-6, "step": 0.1}, "leave step out"),
        ({"error": 1e-6, "tol": 1e-3, "every": 2}, "leave tol and every out"),
        ({"error": 0.5}, "at most 0.1"),
        ({"error": -1e-6}, "positive"),
        ({"error": 1e-6, "method": "strang", "step": 0.1}, "error is for method='geometric'"),
    ],
)
def test_unsuitable_arguments_are_refused(words, message):
    with pytest.raises(ValueError, match=message):
        kr.solve(LAGRANGE, 10, **{"method": "geometric", **words})


def energy_drift(scene, end, method, step):
    path = kr.solve(scene, end, method=method, step=step, every=1)
    return np.abs(path.energy / path.energy[0] - 1.0).max()


def load_published(name):
    """Return a test problem from the literature, and its published results."""
    pytest.importorskip("heyoka")
    from validation.parts.published import load_problems

    (top,) = (top for top in load_problems() if top.name == name)
    return problem_of_scene(name, top.scene).to_scene(), top.entry


def test_energy_errors_of_suzuki4_are_those_of_a_published_table():
    scene, entry = load_published("gni_asymmetric_heavy_top")
    table = {float(h): error for h, error in entry["table"].items() if h != "what"}
    for step, error in table.items():
        assert energy_drift(scene, 1000, "suzuki4", step) == pytest.approx(error, rel=0.03)
    errors = [energy_drift(scene, 1000, "kahan_li8", step) for step in table]
    assert len(errors) == 5 and all(b <= a for a, b in itertools.pairwise(errors))


@pytest.mark.parametrize(("order", "bound"), [(2, 1e-9), (4, 1e-13), (6, 1e-13), (8, 1e-13)])
def test_energy_errors_of_the_top_of_simo_and_wong(order, bound):
    """Check the energy error of the best method of each order at the published step size."""
    scene, _ = load_published("simo_wong_fast_top")
    errors = [
        energy_drift(scene, 10, name, np.radians(26) / 50.0)
        for name, method in kr.methods.items()
        if not method.adaptive and method.order == order and method.applies_to(scene.body)
    ]
    assert min(errors) <= bound


def test_a_hanging_top_with_rounding_errors_is_solved():
    """Check hanging tops, whose energy can be below the minimum because of rounding errors."""
    random = np.random.default_rng(8)
    for symmetric in (True, False) * 20:
        half = random.uniform(0.5, 1.5, 3)
        if symmetric:
            half[1] = half[0]
        pivot = np.array((0.0, 0.0, -half[2])) if symmetric else -half * random.uniform(0.2, 1, 3)
        body = kr.Body.cuboid(half=half, pivot=pivot)
        # the centre of mass is turned to -e3
        down = np.array(body.com) / np.linalg.norm(body.com) - (0, 0, 1)
        scene = kr.Scene(
            body, (0, 0, 0), (0, *unit(down)) if np.linalg.norm(down) else (0, 1, 0, 0), gravity=1
        )
        assert kr.solve(scene, 5, "geometric", error=1e-6).error <= 1e-6


def test_the_search_continues_after_a_refused_step():
    inertia = (
        (10.437340318241358, -0.4022846743539838, -0.55360749190751),
        (-0.4022846743539838, 18.44618605609903, -2.3071714201043183),
        (-0.55360749190751, -2.3071714201043183, 16.34563885498536),
    )
    com = (0.09368302711849157, 0.3904260796252954, 0.5372881854466329)
    scene = kr.Scene(
        kr.Body(10.998507429433324, inertia, com),
        momentum=(5.068198554729943, -17.973015404899954, -5.3371235868883895),
        attitude=(
            0.12559319782286385,
            -0.04531533029063025,
            -0.9541112022693307,
            0.26803858529221253,
        ),
        gravity=1,
    )
    times = np.linspace(0, 78.32659960393634, 33)[1:]
    path = kr.solve(scene, times, "geometric", error=0.09172786661884054)
    assert kr.attitude_error(path.q, kr.solve(scene, times, digits=20).q).max() < 0.0918


def test_max_steps_keeps_the_states_reached():
    tops = kr.scenes.asymmetric.vary(gravity=[0.0, 0.5, 1.0])
    times = [0.0, 1.0, 1.0, 9.0, 20.0]
    for sign in (1.0, -1.0):
        t = sign * np.array(times)
        paths = kr.solve(tops, t, "geometric", error=1e-6, max_steps=20)
        assert paths.failed.tolist() == [0, 1, 2] and paths.state_counts[0] == 4
        for i, n in enumerate(paths.state_counts.tolist()):
            true = kr.solve(tops[i], t[:n]).q
            assert kr.attitude_error(paths.states[i, :n, 1:5], true).max(initial=0.0) < 1e-9
            assert np.isnan(paths.states[i, n:, 1:]).all()


# Boundary values


def test_an_error_is_at_most_a_tenth_of_a_radian():
    assert step_search.validate_error_tolerance(0.1, {"step": None}) == 0.1
    with pytest.raises(ValueError, match=r"at most 0\.1 rad, not 0\.100"):
        step_search.validate_error_tolerance(math.nextafter(0.1, 1.0), {})
    with pytest.raises(ValueError, match="leave step and every out"):
        step_search.validate_error_tolerance(0.1, {"step": 1.0, "tol": None, "every": 2})


class Search:
    """A stub for the step-size search that returns given errors instead of integrating."""

    conditioning, first, budget = 1e-9, 10, 1000
    method, order, end, target = "strang", 2, 8.0, 1e-9

    def __init__(self, errors):
        self.errors, self.asked = iter(errors), []

    def integrate_and_measure_error(self, steps):
        self.asked.append(steps)
        error = next(self.errors)
        return None if error is None else (np.zeros((1, 8)), error)

    def predict_needed_step_count(self, steps, error):
        return steps + 1

    def make_unmet_error_exception(self, reason):
        return ValueError(reason)


def run_search(monkeypatch, errors, **more):
    search = Search(errors)
    search.__dict__.update(more)
    monkeypatch.setattr(step_search, "StepSearch", lambda *_: search)
    monkeypatch.setattr(
        step_search, "_make_path_from_search", lambda search, states, error, steps: (error, steps)
    )
    return search, lambda: step_search.search_path_within_error(THESIS, np.array([8.0]), 1e-9, 0)


def test_the_search_refines_by_the_observed_errors(monkeypatch):
    enough = step_search._ENOUGH * 1e-9
    search, choice = run_search(monkeypatch, [1.0, None, 1e-3, 1e-6, enough])
    assert choice() == (enough, 14) and search.asked == [10, 11, 12, 13, 14]
    search, choice = run_search(monkeypatch, itertools.repeat(1e-8))
    with pytest.raises(ValueError, match=re.escape("rounding errors reach 1.0e-08 rad, and finer")):
        choice()
    assert search.asked == [10, *(11 * 2**k for k in range(len(search.asked) - 1))]
    assert len(search.asked) == step_search._STALLS + 1
    search, choice = run_search(monkeypatch, [1e-6, 1e-8, 0.5e-8, 1e-9, enough])
    assert choice() == (enough, 14)


def test_a_search_ends_with_its_budget(monkeypatch):
    enough = step_search._ENOUGH * 1e-9
    _, choice = run_search(monkeypatch, [1e-3, enough], budget=21)
    assert choice() == (enough, 11)
    _, choice = run_search(monkeypatch, [1e-3, enough], budget=20)
    with pytest.raises(ValueError, match="the search is limited to 20 steps"):
        choice()
    _, choice = run_search(monkeypatch, [enough], conditioning=math.nextafter(1e-9, 1.0))
    with pytest.raises(ValueError, match="the rounding of the scene alone exceeds it"):
        choice()


def test_large_errors_are_not_extrapolated():
    search = SimpleNamespace(target=0.01, order=4)
    finer = step_search.StepSearch.predict_needed_step_count
    assert finer(search, 100, 0.1) == finer(search, 100, 0.2) == 400
    assert finer(search, 100, 0.0999) == 224
    assert finer(search, 100, 0.0) == 111
