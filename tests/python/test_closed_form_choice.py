"""Tests of how the method 'auto' chooses between closed forms and Taylor series."""

import kreisel as kr
import numpy as np
import pytest
from tops import TILT

EPS = 2.0**-52
ATTITUDE = (0.8, 0.4, -0.2, 0.4)
RATIOS = {"kowalewski": 2.0, "goryachev_chaplygin": 4.0}
LONG = {"kowalewski": 5e3, "goryachev_chaplygin": 1e4}  # times at which the closed form is faster
SLEEPER = kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True)


def make_top(kind, momentum=(0.3, 1.1, 0.0), attitude=ATTITUDE, **words):
    body = kr.Body(1.0, (RATIOS[kind], RATIOS[kind], 1.0), (1.0, 0.0, 0.0), unphysical=True)
    return kr.Scene(body, momentum, attitude, **{"gravity": 1, **words})


@pytest.mark.parametrize("kind", RATIOS)
def test_long_paths_of_few_states_use_the_closed_form(kind):
    scene, t = make_top(kind), LONG[kind]
    for times in (t, int(t), [1.0, t], -t, np.array([-t])):
        path = kr.solve(scene, times, want=["q"])
        assert path.method == "exact" and path.plan.why == kr.plan(scene, times).why
        assert np.array_equal(path.q, kr.solve(scene, times, method="exact").q)
    for times in (0.0, 1, -3.0, [], [1.0, 20.0], (2.0, 9.0)):
        path = kr.solve(scene, times)
        assert path.method == "taylor" and path.plan.why == kr.plan(scene, times).why
    assert kr.plan(scene, np.linspace(0.0, 2.0 * t, 100)).method == "exact"
    assert kr.plan(scene, np.linspace(0.0, 2.0 * t, int(8.0 * t))).method == "taylor"
    assert kr.plan(scene.replace(gravity=-9.81), t).method == "exact"


@pytest.mark.parametrize("kind", RATIOS)
def test_requests_and_scenes_without_closed_form_use_the_series(kind):
    scene, t = make_top(kind), LONG[kind]
    assert kr.solve(scene, 30.0, tangents="start").method == "taylor"
    assert kr.solve(scene, 30.0, events=kr.events.nutation()).method == "taylor"
    assert kr.start(scene).method == "taylor"
    assert next(iter(kr.stream(scene, [1.0, t], chunk=1))).method == "taylor"
    assert kr.plan(kr.Scene.stack([scene]), t).method == "taylor"
    for words in ({"tol": 1e-9}, {"step": 0.1}, {"digits": 16}):
        assert kr.plan(scene, t, **words).method == "taylor"
    still = make_top(kind, (0.0, 0.0, 0.0), (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0))
    damped = make_top(kind, damping=(0.1, 0.1, 0.1))
    leaning = make_top("goryachev_chaplygin", (0.3, 1.1, 1e-16))
    reasons = "closed form of a", "damping", "turning", "vertical"
    tops = still, damped, scene.replace(turning=(0, 0, 0.1)), leaning
    for top, why in zip(tops, reasons, strict=True):
        plan = kr.plan(top, 1e9)
        assert plan.method == "taylor" and why in plan.why


NEARLY = {  # bodies with a small deviation from a Lagrange top
    "com": lambda d: kr.Body(1, (1, 1, 0.5), (d, 0, 1), unphysical=True),
    "moments": lambda d: kr.Body(1, (1, 1 + d, 0.5), (0, 0, 1), unphysical=True),
    "sphere": lambda d: kr.Body(1, (1, 1 + d, 1 - d / 5), (0.6, 0.5, 0.4), unphysical=True),
}


@pytest.mark.parametrize("kind", NEARLY)
def test_only_differences_above_rounding_change_the_kind(kind):
    for difference in (4e-14, 9e-13, 2e-10):
        scene = kr.Scene(NEARLY[kind](difference), (0, 0.3, 1), TILT, gravity=1)
        assert scene.body.kind == "general" and kr.solve(scene, 1).method == "taylor"
        for call in (
            lambda scene=scene: kr.exact([scene]),
            lambda scene=scene: kr.solve(scene, 1, "exact"),
            lambda scene=scene: kr.solve(scene, 1, "bobenko_suris4", step=0.01),
        ):
            with pytest.raises(ValueError, match="'lagrange' only up to"):
                call()
    scene = kr.Scene(NEARLY[kind](8 * EPS), (0, 0.3, 1), TILT, gravity=1)
    assert scene.body.kind == "lagrange" and kr.solve(scene, 1).method == "exact"
    truth = kr.solve(scene, 10, digits=30)
    for path in (kr.solve(scene, 10), kr.solve(scene, 10, "kahan_li8", step=0.01)):
        error = kr.attitude_error(path.q[-1], truth.q[-1])
        assert error < 2e-13 and path.error == pytest.approx(error, rel=0.5, abs=3e-16)


def test_tiny_asymmetries_and_tilts_make_a_top_fall():
    body = kr.Body(1, (1, 1, 0.5), (0.9e-12, 0, 1), unphysical=True)
    scene = kr.Scene(body, momentum=(0, 0, 1), gravity=1)
    path, truth = kr.solve(scene, 35), kr.solve(scene, 35, digits=30)
    assert kr.attitude_error(path.q[-1], truth.q[-1]) < 1e-9 and truth.apex[-1, 2] < 0.9
    for lean, push, method in ((1e-300, 0, "taylor"), (0, 1e-75, "taylor"), (1e-69, 0, "exact")):
        scene = kr.Scene(SLEEPER, (0, push, 0), (1, lean, 0, 0), gravity=1)
        fall = -np.log(max(lean, push))  # the time of the fall
        path = kr.solve(scene, [fall - 5, fall + 1.5])
        assert path.method == method and path.nutation[0] < 0.2 and path.nutation[1] > 1
        assert path.error < 1e-8
        if method == "taylor":
            with pytest.raises(ValueError, match="tilt and velocity are below 1e-70"):
                kr.exact(scene)
    for upright in ((1, 0, 0, 0), (0, 1, 0, 0), (0.6, 0, 0, 0.8)):
        stands = kr.exact(kr.Scene(SLEEPER, (0, 0, 0.5), upright, gravity=1))
        assert stands.period == np.inf and stands(1e3).nutation[0] in (0, np.pi)
