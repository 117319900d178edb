"""Tests of Lyapunov exponents, other indicators of chaos and their verdicts."""

import copy
import itertools
import pickle

import kreisel as kr
import numpy as np
import pytest
from tops import random_starts

TOP = kr.scenes.asymmetric
UP = (1.0, 0.0, 0.0, 0.0)
EULER = kr.Body(mass=1.0, inertia=(1.0, 1.6, 2.1), com=(0.0, 0.0, 0.0))
INTEGRABLE = {
    "kowalewski": kr.scenes.kowalewski.body,
    "lagrange": kr.scenes.thesis.body,
    "euler": EULER,
    "goryachev_chaplygin": kr.scenes.goryachev_chaplygin.body,
}

# Formulas


def slope(scene, rate, period=None, sign=1.0):
    """Return the asymptotic growth rate of a tangent vector, averaged over whole periods."""
    t = np.array([200.0, 300.0]) / rate
    if period:
        t = period * np.round(t / period)
    indicator = kr.chaos(scene, sign * t)
    assert indicator.certificate < 1e-12
    first, last = indicator.lyapunov_curve * t
    return (last - first) / (t[1] - t[0])


def test_an_unstable_sleeping_top_falls_at_the_rate_of_the_formula():
    body = kr.Body(mass=1.3, inertia=(2.0, 2.0, 0.7), com=(0.0, 0.0, 0.8))
    for spin in (0.0, 1.1, 3.9):
        scene = kr.Scene(body, attitude=UP, momentum=(0.0, 0.0, 0.7 * spin), gravity=1.7)
        rate = np.sqrt(1.3 * 1.7 * 0.8 / 2.0 - (0.7 * spin / (2.0 * 2.0)) ** 2)
        assert abs(slope(scene, rate) - rate) <= 1e-10 * rate


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_satellite_leaves_an_unstable_equilibrium_at_the_rate_of_the_formula(sign):
    """Pitch the axis of the larger moment away from the local vertical."""
    body = kr.Body(1.0, (0.4, 1.0, 0.9), com=(0.0, 0.0, 0.0))
    scene = kr.Scene(body, body_velocity=(0, 0, 0), gradient=0.75, turning=(0, 0.5, 0))
    rate = 0.5 * np.sqrt(3.0 * (0.9 - 0.4) / 1.0)
    assert abs(slope(scene, rate, sign=sign) - rate) <= 1e-9 * rate


def test_supports_and_gradients_do_not_change_the_verdict():
    t = np.array([50.0, 500.0])
    for scene in (TOP, kr.scenes.thesis):
        both = scene.vary(turning=[(0.0, 0.0, 0.4), (0.0, 0.0, 0.0)])
        found = kr.chaos(both, t)
        assert found.is_chaotic[0] == found.is_chaotic[1] and (found.certificate < 1e-9).all()
        assert np.abs(np.diff(found.megno_curve[:, 0])) < 0.5
    tops = kr.Scene.stack([kr.scenes.tumbler, kr.scenes.satellite.vary(precession=0.01)])
    assert kr.chaos(tops, 1000.0).is_chaotic.tolist() == [True, False]
    shaken = TOP.replace(shaking=(1e-9, 3.0, 0.0))
    assert np.abs(np.diff([kr.chaos(top, 50.0).megno for top in (TOP, shaken)])) < 0.5


def assert_regular(scene, t):
    """Assert that a tangent grows at most linearly in time."""
    found, bound = kr.chaos(scene, t), np.log(1.0 + abs(t)) + 5.0
    assert found.lyapunov * abs(t) < bound and found.oli < bound and found.megno < 3.0
    assert found.certificate < 1e-12


@pytest.mark.parametrize("moments", [(1.11, 0.9375, 0.996), (1.0, 1.5, 2.0)])
def test_tangents_of_permanent_rotations_grow_as_the_formula_predicts(moments):
    body, attitude = kr.Body(1.0, moments, com=(0.0, 0.0, 0.0)), (0.5, 0.5, 0.5, 0.5)
    for axis, sign in itertools.product(range(3), (1.0, -1.0)):
        own, one, other = np.roll(moments, -axis)
        square = 1.25**2 * (own - one) * (other - own) / (one * other)
        velocity = 1.25 * np.eye(3)[axis]
        scene = kr.Scene(body, attitude=attitude, body_velocity=velocity, gravity=0.0)
        if square > 0.0:
            rate = np.sqrt(square)
            assert abs(slope(scene, rate, 2.0 * np.pi / 1.25, sign) - rate) < 1e-9
        else:
            assert_regular(scene, sign * 1000.0)


@pytest.mark.parametrize("attitude", [UP, (0.0, 1.0, 0.0, 0.0)], ids=["sleeping", "hanging"])
def test_fast_tops_about_the_vertical_are_regular(attitude):
    body = kr.Body.symmetric(1.0, 1.0, 0.5, 0.5)
    for spin, t in ((50.0, 100.0), (-1000.0, 10.0), (200.0, -10.0), (1e4, 10.0)):
        velocity = (0.0, 0.0, spin)
        assert_regular(kr.Scene(body, attitude=attitude, velocity=velocity, gravity=1.0), t)


def test_the_exponent_agrees_with_the_tangents_of_a_path():
    t = np.array([20.0, 60.0])
    path = kr.solve(TOP, t, tangents="start", digits=20)
    size = np.log(np.abs(path.tangents).max(axis=(1, 2)))
    curve = kr.chaos(TOP, t).lyapunov_curve
    assert np.all(np.abs(curve * t - size) < 4.0) and np.all(curve > 0.1)
    assert np.all(kr.chaos(TOP, -t).lyapunov_curve > 0.1)
    one, same, other = (
        kr.chaos(TOP, [10.0], direction=d).lyapunov
        for d in ([0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [0.2, 0.4, 0.6, 0.8, 1.0, 1.2], [1.0] + [0.0] * 5)
    )
    assert abs(one - same) < 1e-12 < abs(one - other)


def test_curves_have_the_requested_times_and_the_same_end():
    indicator, back = kr.chaos(TOP, 20.0), kr.chaos(TOP, -20.0)
    assert indicator.t[-1] == 20.0 and np.array_equal(back.t, -indicator.t)
    np.testing.assert_allclose(indicator.t, np.geomspace(0.02, 20.0, 32), rtol=1e-12)
    for t in ([20.0], np.linspace(0.1, 20.0, 200)):
        assert kr.chaos(TOP, t).lyapunov == indicator.lyapunov
    stop = {}.__getitem__  # raises KeyError in a progress function
    with pytest.raises(KeyError):
        kr.chaos(TOP.vary(gravity=np.linspace(0.5, 1.0, 2000)), 1e3, progress=stop)
    rough = kr.chaos(TOP, 20.0, tol=1e-5)
    assert rough.lyapunov == pytest.approx(indicator.lyapunov, rel=1e-2)
    assert rough.certificate > indicator.certificate
    assert isinstance(indicator.certificate, float) and indicator.status == "OK"


# Verdicts


def test_known_tops_have_the_expected_verdict():
    for name in ("thesis", "kowalewski", "goryachev_chaplygin", "asymmetric_regular", "cusps"):
        indicator = kr.chaos(kr.scenes.get_scene(name), 3000)
        verdict = indicator.is_chaotic, indicator.doubt, indicator.is_doubtful
        assert verdict == (False, "", False), name
    indicator = kr.chaos(TOP, 1000)
    assert (indicator.is_chaotic, indicator.doubt, indicator.is_doubtful) == (True, "", False)
    assert indicator.threshold == 4.0 < indicator.megno and "chaotic" in repr(indicator)


@pytest.mark.parametrize("name", INTEGRABLE)
def test_no_integrable_top_is_called_chaotic(name):
    """Check that random integrable tops are not classified as chaotic, unless in doubt."""
    q, m = random_starts(24, 5)
    m[:, 2] *= name != "goryachev_chaplygin"  # integrable only without vertical momentum
    tops = kr.Scene(INTEGRABLE[name], momentum=m, attitude=q, gravity=1)
    found = kr.chaos(tops, [3000.0])
    assert not found.is_chaotic[~found.is_doubtful].any() and found.is_doubtful.mean() < 0.1


def test_every_doubtful_verdict_has_a_reason():
    short = kr.chaos(kr.scenes.thesis, 100.0)
    assert short.is_doubtful and not short.is_chaotic
    assert short.turns < 100 and "turns" in short.doubt
    assert "near the threshold" in kr.chaos(TOP, 75.0).doubt
    rough = kr.chaos(TOP, 1000.0, tol=0.5)
    assert rough.certificate > 0.01 and "certificate" in rough.doubt
    indicator = kr.chaos(TOP.vary(gravity=[1.0, 1e30]), [1000.0], max_steps=20000)
    assert indicator.status[1] != "OK" and indicator.doubt.tolist() == ["", indicator.status[1]]
    assert indicator.is_chaotic.tolist() == [True, False] == [not x for x in indicator.is_doubtful]
    assert indicator.failed.tolist() == [1]
    quick = kr.chaos(TOP, 400.0)
    assert quick.turns < 100.0 and quick.megno > 8.0 and quick.doubt == ""
    body = kr.Body.symmetric(1.0, 1.0, 0.5, 0.5)  # integrable, but with a positive exponent
    unstable = kr.chaos(kr.Scene(body, velocity=(0.0, 0.0, 0.1), gravity=1.0), 1000.0)
    assert unstable.is_chaotic and unstable.doubt == ""


def test_turns_are_counted_in_the_tops_own_time_scale():
    scene = kr.Scene(kr.Body(2.0, (3.0, 4.0, 5.0), (0, 0, 0)), momentum=(0.0, 0.0, 10.0))
    assert kr.chaos(scene, [-50.0]).turns == pytest.approx(50.0 / np.pi, rel=1e-14)
    hanging = kr.Scene(kr.Body(2.0, (3.0, 4.0, 5.0), (0, 0, 0.7)), momentum=(0.1, 0, 0), gravity=9)
    rate = np.sqrt(2.0 * 9.0 * 0.7 / 5.0)
    assert kr.chaos(hanging, [50.0]).turns == pytest.approx(50.0 * rate / (2 * np.pi), rel=1e-14)
    doubled = TOP.replace(gravity=4.0, momentum=2.0 * np.array(TOP.momentum))
    one, two = kr.chaos(TOP, [50.0]), kr.chaos(doubled, [25.0])
    assert two.lyapunov == 2.0 * one.lyapunov and two.turns == one.turns


def test_tables_and_copies_have_the_values_of_each_top():
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    tops = TOP.vary(gravity=np.array([[0.5], [1.0]]), spin=[0.0, 1.0, 2.0])
    indicator = kr.chaos(tops, [100.0, 800.0])
    frame, data = indicator.to_pandas(), indicator.to_xarray()
    assert frame["gravity"].tolist() == [0.5] * 3 + [1.0] * 3 and frame.attrs["t"] == 800.0
    assert frame.attrs["units"]["lyapunov"] == "T^-1"
    assert np.array_equal(data["lyapunov"], indicator.lyapunov_curve)
    for name in ("is_chaotic", "doubt", "certificate", "turns", "status"):
        assert np.array_equal(frame[name], getattr(indicator, name).ravel()), name
        assert np.array_equal(data[name], getattr(indicator, name))
    for one in (copy.deepcopy(indicator), pickle.loads(pickle.dumps(indicator))):
        assert np.array_equal(one.oli_curve, indicator.oli_curve)
        assert not one.oli_curve.flags.writeable
    empty = kr.chaos(TOP.scatter(3, momentum=0.1)[:0], 5.0)
    assert empty.oli_curve.shape == (0, 32) and len(empty.to_pandas()) == 0 == len(empty.doubt)


# Refusals: callable, valid arguments, argument, bad value, exception, word

VALID = {"scene": TOP, "t": 1.0}
SHAKEN = TOP.replace(shaking=(0.1, 3.0, 0.0))
START = kr.solve(TOP, [0.0])
FLOW = [*START.body_velocity[0].tolist(), *START.torque[0].tolist()]
TURN = [*START.body_vertical[0].tolist(), *np.cross((0, 0, 1), START.m[0]).tolist()]
REFUSALS = [
    *((kr.chaos, VALID, "t", t, ValueError, "0") for t in (0.0, [0.0, 1.0], [])),
    (kr.chaos, VALID, "t", float("nan"), ValueError, "finite"),
    (kr.chaos, VALID, "t", 1e300, ValueError, "precision"),
    (kr.chaos, VALID, "tol", 2.0, ValueError, "below 1"),
    (kr.chaos, VALID, "direction", FLOW, ValueError, "direction"),
    (kr.chaos, VALID, "direction", TURN, ValueError, "direction"),
    (kr.chaos, VALID, "scene", 3, TypeError, "Scene"),
    (kr.chaos, VALID, "scene", TOP.replace(damping=0.1), ValueError, "damped"),
    (kr.chaos, VALID | {"t": 100.0}, "max_steps", 3, kr.Error, "steps"),
    (kr.chaos, {"scene": kr.scenes.tumbler, "t": 100.0}, "max_steps", 3, kr.Error, "steps"),
    (kr.chaos, VALID | {"scene": SHAKEN}, "direction", TURN, ValueError, "direction"),
    (kr.chaos, VALID, "scene", TOP.replace(friction=0.1), ValueError, "friction"),
]


@pytest.mark.parametrize(("call", "valid", "name", "bad", "error", "word"), REFUSALS)
def test_bad_arguments_are_refused(call, valid, name, bad, error, word):
    with pytest.raises(error, match=word):
        call(**valid | {name: bad})
