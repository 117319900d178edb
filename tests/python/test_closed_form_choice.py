"""Tests of how the method 'auto' chooses between closed forms and Taylor series."""

import kreisel as kr
import numpy as np
import pytest
from kreisel._options import closed_form_choice

ATTITUDE = (0.8, 0.4, -0.2, 0.4)
RATIOS = {"kowalewski": 2.0, "goryachev_chaplygin": 4.0}


def top_of(kind, moments=None, com=(1.0, 0.0, 0.0), momentum=(0.3, 1.1, 0.0), **words):
    moments = moments or (RATIOS[kind], RATIOS[kind], 1.0)
    body = kr.Body(1.0, moments, com, unphysical=True)
    return kr.Scene(body, momentum, ATTITUDE, **{"gravity": 1, **words})


def random_scenes(kind, n, seed=1):
    rng = np.random.default_rng(seed)
    for _ in range(n):
        momentum = rng.normal(size=3) * 10.0 ** rng.uniform(-1.0, 1.0)
        momentum[2] *= kind == "kowalewski"
        yield top_of(kind, momentum=momentum)


@pytest.fixture(params=[*RATIOS])
def kind(request):
    return request.param


LONG = {"kowalewski": 5e3, "goryachev_chaplygin": 4e5}  # times at which the closed form is faster


@pytest.mark.parametrize("make_times", [float, int, lambda t: [1.0, t], lambda t: np.array([t])])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_long_paths_use_the_closed_form(kind, make_times, sign):
    scene, t = top_of(kind), sign * LONG[kind]
    times = np.abs(make_times(abs(t))) * sign
    path = kr.solve(scene, times, want=["q"])
    assert path.method == "exact" and path._options.requested_method == "auto"
    assert np.array_equal(path.q, kr.solve(scene, times, method="exact").q)
    assert "takes no more time" in path.plan.why and path.plan.why == kr.plan(scene, times).why


@pytest.mark.parametrize("t", [0.0, 1, -3.0, [], [1.0, 20.0], np.array([5.0, 30.0]), (2.0, 9.0)])
def test_short_paths_use_the_series(kind, t):
    path = kr.solve(top_of(kind), t)
    assert path.method == "taylor" and "steps of the series, and about" in path.plan.why
    assert kr.plan(top_of(kind), t).why == path.plan.why


def test_many_states_use_the_series(kind):
    scene, end = top_of(kind), 2.0 * LONG[kind]
    assert kr.plan(scene, np.linspace(0.0, end, 100)).method == "exact"
    assert kr.plan(scene, np.linspace(0.0, end, int(4.0 * end))).method == "taylor"


@pytest.mark.parametrize(
    "t", [[np.nan], np.inf, "late", [[1.0, 1e9]], [1e9, 1.0, 1e8], np.array("x")]
)
def test_invalid_times_are_rejected(kind, t):
    with pytest.raises((TypeError, ValueError), match=r"\bt\b|times"):
        kr.solve(top_of(kind), t)


def test_requests_that_need_steps_use_the_series(kind):
    scene, t = top_of(kind), LONG[kind]
    assert kr.solve(scene, 30.0, tangents="start").method == "taylor"
    assert kr.solve(scene, 30.0, events=kr.events.nutation()).method == "taylor"
    assert kr.start(scene).method == "taylor" and "in runs" in kr.start(scene).plan.why
    assert next(iter(kr.stream(scene, [1.0, t], chunk=1))).method == "taylor"
    assert kr.plan(kr.Ensemble.of([scene]), t).first.method == "taylor"
    for words in ({"tol": 1e-9}, {"step": 0.1}, {"digits": 16}):
        plan = kr.plan(scene, t, **words)
        assert plan.method == "taylor" and ("neither step" in plan.why or "digits" in plan.why)


@pytest.mark.parametrize(
    "words",
    [
        {"moments": "nextafter"},
        {"com": (1.0, 1e-15, 0.0)},
        {"com": (1.0, 0.0, 1e-15)},
        {"gravity": -9.81},
        {"momentum": (0.3, 1.1, 1e-16)},
    ],
)
def test_rounding_errors_of_the_scene_are_not_neglected(kind, words):
    pair = 0.1 * RATIOS[kind]
    if "moments" in words:
        words = {"moments": (pair, pair, float(np.nextafter(0.1, 1.0)))}
    scene = top_of(kind, **words)
    plan = kr.plan(scene, LONG[kind])
    if words in ({"com": (1.0, 1e-15, 0.0)}, {"gravity": -9.81}) or (
        "momentum" in words and kind == "kowalewski"
    ):
        assert plan.method == "exact"
    else:
        assert plan.method == "taylor"
        assert "only up to rounding" in plan.why or "vertical component" in plan.why


def test_scenes_without_closed_form_use_the_series(kind):
    still = np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0
    rest = top_of(kind, momentum=(0.0, 0.0, 0.0)).replace(attitude=still)
    assert "closed form of a" in kr.plan(rest, 1e9).why and kr.plan(rest, 1e9).method == "taylor"
    damped = top_of(kind, damping=(0.1, 0.1, 0.1))
    assert kr.plan(damped, 1e9).method == "taylor" and "damping" in kr.plan(damped, 1e9).why
    vertical = top_of("goryachev_chaplygin", momentum=(0.3, 1.1, 0.5))
    assert "vertical component" in kr.plan(vertical, 1e9).why


def test_a_large_certificate_is_refused(kind, monkeypatch):
    assert kr.plan(top_of(kind), LONG[kind]).method == "exact"
    monkeypatch.setattr(closed_form_choice, "_ERROR_PER_CERTIFICATE", 1e7)
    plan = kr.plan(top_of(kind), LONG[kind])
    assert plan.method == "taylor" and "exceeds the limit" in plan.why
    path = kr.solve(top_of(kind), LONG[kind], want=["q"])
    assert path.method == "taylor" and path.plan.why == plan.why


def test_the_closed_form_is_set_up_by_the_method_only(kind, monkeypatch):
    def refuse(*_):
        raise AssertionError("another set-up")

    scene, t = top_of(kind), LONG[kind]
    monkeypatch.setattr(closed_form_choice, "torus_plan", refuse)
    path = kr.solve(scene, t)
    monkeypatch.undo()
    assert path.method == "exact"
    assert np.array_equal(path.q, kr.solve(scene, t, "exact").q)


def test_the_estimate_of_steps_is_near_the_number_of_steps(kind):
    for scene in random_scenes(kind, 60):
        end = 300.0 / scene._rotation_rate
        steps = kr.solve(scene, [end], "taylor").stats.steps
        assert 0.8 < steps / closed_form_choice._estimate_taylor_steps(scene, end) < 5.0


def test_the_closed_form_is_more_accurate_than_the_series():
    for scene in random_scenes("kowalewski", 12, seed=5):
        end = 1.01 * 2e3 / closed_form_choice._estimate_taylor_steps(scene, 1.0)
        path = kr.solve(scene, [end])
        assert path.method == "exact"
        truth, series = kr.solve(scene, [end], digits=20), kr.solve(scene, [end], "taylor")
        error, other = (kr.attitude_error(p.q, truth.q)[0] for p in (path, series))
        assert error < other
