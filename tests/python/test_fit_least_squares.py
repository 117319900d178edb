"""Fits against numerical derivatives, SciPy's least squares and closed forms."""

from functools import cache
from typing import get_args

import kreisel as kr
import numpy as np
import pytest
from fits import (
    HEAVY,
    SYMMETRIC,
    change_parameters,
    differentiate,
    differentiate_record,
    find_difference,
    measure,
    read_parameters,
    simulate,
    solve_at,
    subtract,
)
from kreisel.types import QuantityName
from scipy.optimize import curve_fit, least_squares

T = np.linspace(-0.5, 2.0, 26)
TURN = np.array((0.8, -0.3, 0.4, 0.2)) / np.linalg.norm((0.8, -0.3, 0.4, 0.2))
JUMPING = ("body_acceleration", "specific_force", "pivot_force")  # friction jumps at a stop
SEEN_FROM_BODY = (*JUMPING[:2], "q", "body_velocity", "body_momentum", "body_vertical")
SEEN_FROM_BODY = (*SEEN_FROM_BODY, "inertial_velocity")
CONSTANT = ("t", "kowalewski", "goryachev_chaplygin")
CONSTANT += ("wheel_rate", "second_wheel_rate", "third_wheel_rate")  # refused by name
MEASURABLE = [name for name in get_args(QuantityName) if name not in CONSTANT]
MEASURABLE = [name for name in MEASURABLE if not name.endswith("_low")] + ["specific_force"]
ANCHOR = {"q": 0.003, "body_velocity": 0.01}  # determines all parameters of the top a little


def make_top(turn=None, rotor=(0.0, 0.0, 0.0), **words):
    body = kr.Body(1.1, (1.0, 1.3, 0.7), com=(0.1, -0.2, 0.3), rotor=rotor, unphysical=True)
    return kr.Scene(
        body if turn is None else body.turn(turn),
        attitude=TURN[[1, 0, 3, 2]],
        body_velocity=(1.0, 0.7, -1.5),
        gravity=3.0,
        **words,
    )


SUPPORT = {"turning": (0.3, -0.2, 0.5), "shaking": (0.05, 7.0, 0.4)}
TOPS = {
    "axes": (make_top(TURN, damping=(0.1, 0.15, 0.2)), ("start", "com", "damping", "axes")),
    "support": (
        make_top(TURN, rotor=(0.3, -0.4, 0.5), **SUPPORT),
        ("start", "moments", "rotor", "turning", "shaking"),
    ),
    "friction": (make_top(TURN, friction=0.2), ("start", "moments", "friction")),
    "lever": (make_top(damping=(0.1, 0.2, 0.3)), ("start", "lever", "damping")),
    "turned lever": (make_top(TURN), ("start", "lever")),
    "gravity": (make_top(shaking=SUPPORT["shaking"]), ("start", "gravity")),
    "mass": (make_top(damping=(0.1, 0.2, 0.3)), ("start", "mass")),
}
CASES = [(name, top) for top in ("axes", "support") for name in MEASURABLE]
CASES += [(name, "friction") for name in ("q", "spin", "energy")]
CASES += [("spin_angle", "turned lever")]
CASES += [
    (name, top)
    for top in ("lever", "gravity", "mass")
    for name in ("energy", "potential", "torque", *JUMPING)
]


@cache
def differentiate_anchor(top, names):
    scene = TOPS[top][0]
    parts = [differentiate_record(scene, T, names, q, {}) / s for q, s in ANCHOR.items()]
    return np.concatenate(parts)


@pytest.mark.parametrize(("quantity", "top"), CASES)
def test_the_covariance_is_that_of_numerical_derivatives(quantity, top):
    """Check every measurable quantity with a free instrument, beside rough attitudes and rates.

    A fit of exact measurements finds the top again in a few steps only with right derivatives.
    """
    scene, free = TOPS[top]
    values = measure(scene, T, quantity, {}).reshape(len(T), -1)
    spread = np.std(values, axis=0)
    is_constant = spread.min() < 1e-3 * np.abs(values).max() and quantity != "q"
    labels = {1: [""], 3: ["_x", "_y", "_z"]}.get(len(spread), [f"_{k}" for k in range(9)])
    settings = {} if is_constant else {"delay[1]": 0.02}
    if quantity != "q":
        settings |= {f"bias[1].{quantity}{label}": 0.05 for label in labels}
    if quantity != "q" and not is_constant:
        settings |= {
            f"scale[1].{quantity}{label}": 1.1 - 0.05 * k for k, label in enumerate(labels)
        }
    if quantity in SEEN_FROM_BODY:
        settings |= {"mounting[1]_x": 0.05, "mounting[1]_y": -0.04, "mounting[1]_z": 0.03}
    sigma = 0.002 * (1.0 if is_constant else float(np.std(values)))
    records = [
        simulate(scene, T, ANCHOR, noise=0.0),
        simulate(scene, T, {quantity: sigma}, noise=0.0, settings=settings),
    ]
    rng = np.random.default_rng(1)
    heads = tuple({"start": "body_velocity", "moments": "I"}.get(name, name) for name in free)
    changed = [name for name in read_parameters(scene) if name.startswith(heads)]
    changed = [name for name in changed if "axes" not in name]
    guess = change_parameters(scene, {name: 0.003 * rng.normal() for name in changed})
    fit = kr.fit(guess, records, free)
    names, is_own = fit.names, np.array(["[" not in name for name in fit.names])
    own = tuple(np.array(names)[is_own])
    assert fit.chi2 < 1e-10 and fit.evaluations < 200 and fit.unidentified == ()
    assert np.abs(find_difference(fit, scene, own)).max() < 1e-7
    assert {name: fit.values[name] for name in settings} == pytest.approx(settings, abs=1e-7)
    rough = np.zeros((len(T) * 6, len(names)))
    rough[:, is_own] = differentiate_anchor(top, own)
    jacobian = np.vstack((rough, differentiate_record(scene, T, names, quantity, settings) / sigma))
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    errors = np.sqrt(np.diag(covariance))
    found = fit.covariance / np.outer(errors, errors)
    assert found == pytest.approx(covariance / np.outer(errors, errors), abs=1e-4)


def minimize(scene, record, names, loss):
    """Return SciPy's minimum, and the derivatives of the residuals there, for one quantity."""
    [series] = record.series
    sigma = 1.0 if series.sigma is None else series.sigma

    def compute_residuals(x, base=scene):
        changed = change_parameters(base, dict(zip(names, x, strict=True)))
        model = solve_at(changed, record.t, series.name)
        return (subtract(series.name, model, series.values) / sigma).ravel()

    zero = np.zeros(len(names))
    found = least_squares(compute_residuals, zero, "3-point", loss=loss, xtol=1e-12)
    best = change_parameters(scene, dict(zip(names, found.x, strict=True)))
    return found, differentiate(lambda x: compute_residuals(x, best), zero)


@pytest.mark.parametrize(
    ("scene", "quantity", "free", "is_sigma_given", "loss"),
    [
        (HEAVY.replace(friction=0.5), "body_velocity", ("velocity", "friction"), True, "linear"),
        (HEAVY, "body_velocity", ("velocity", "moments"), False, "linear"),
        (HEAVY.replace(damping=(0.1, 0.2, 0.3)), "q", ("start", "damping"), True, "linear"),
        (HEAVY.replace(shaking=(0.05, 9.0, 0.4)), "m", ("velocity", "shaking"), False, "linear"),
        (HEAVY, "q", ("start", "com"), True, "soft"),
        (HEAVY, "body_velocity", ("velocity", "moments"), True, "soft"),
    ],
)
def test_scipy_finds_the_same_minimum_and_covariance(scene, quantity, free, is_sigma_given, loss):
    """Check the covariance of least squares and of an M-estimator (Huber and Ronchetti, 7.6)."""
    record = simulate(scene, np.linspace(0.0, 2.0, 24), {quantity: 0.02}, seed=4)
    values = record.series[0].values.copy()
    if loss == "soft":  # outliers
        values[::8] = values[1::8]
    record = kr.Record(record.t, {quantity: values}, 0.02 if is_sigma_given else None)
    fit = kr.fit(scene, record, free, loss=loss)
    found, jacobian = minimize(scene, record, fit.names, {"soft": "soft_l1"}.get(loss, loss))
    assert fit.dof == found.fun.size - len(fit.names)
    weight = (1.0 + (found.fun**2 if loss == "soft" else 0.0)) ** -0.5
    square = ((found.fun * weight) ** 2).sum() / fit.dof / np.mean(weight**3) ** 2
    if is_sigma_given:
        square = square if loss == "soft" else 1.0
        assert fit.inflation == pytest.approx(np.sqrt(square), rel=1e-3)
        assert fit.cost == pytest.approx(2.0 * found.cost, rel=1e-6)
    covariance = square * np.linalg.inv(jacobian.T @ jacobian)
    errors = np.sqrt(np.diag(covariance))
    assert np.abs((find_difference(fit, scene, fit.names) - found.x) / errors).max() < 1e-3
    units = np.outer(errors, errors)
    assert fit.covariance / units == pytest.approx(covariance / units, abs=3e-3)
    assert [fit.error[name] for name in fit.names] == pytest.approx(errors, rel=2e-3)


def run_down(t, spin, damping, friction, moment=0.6):
    """Return the spin of a sleeping top with damping and dry friction."""
    decay = np.exp(-damping / moment * t)
    return np.maximum(spin * decay - friction * (1.0 - decay) / damping, 0.0)


@pytest.mark.parametrize("loss", ["linear", "soft"])
@pytest.mark.parametrize("guess", [0.0, 0.8])
def test_a_decaying_spin_determines_friction_and_damping(loss, guess):
    """Compare with a fit of the closed form to a record that reaches past the stop."""
    top = kr.Scene.spinning(SYMMETRIC.body, spin=20.0, tilt=0.0, gravity=9.81, damping=0.05)
    t, rng = np.linspace(0.0, 10.0, 200), np.random.default_rng(3)
    spin = run_down(t, 20.0, 0.1, 1.0) + 0.01 * rng.normal(size=200)
    values, covariance = curve_fit(
        run_down, t, spin, (19.0, 0.05, 0.8), np.full(200, 0.01), absolute_sigma=True
    )
    free = ("velocity", "damping", "friction")
    fit = kr.fit(top.replace(friction=guess), kr.Record(t, {"spin": spin}, 0.01), free, loss=loss)
    is_linear, errors = loss == "linear", np.sqrt(np.diag(covariance))
    names = ("body_velocity_z", "damping_1 = damping_2 = damping_3", "friction")
    assert 0.7 < fit.chi2 / fit.dof < 1.2
    for name, value, error in zip(names, values, errors, strict=True):
        assert abs(fit.values[name] - value) < (0.01 if is_linear else 1.0) * error
        assert fit.error[name] == pytest.approx(error, rel=0.02 if is_linear else 0.2)
    correlations = covariance / np.outer(errors, errors)
    rows = [fit.names.index(name) for name in names]
    found = fit.covariance[np.ix_(rows, rows)]
    found /= np.outer(*2 * [np.sqrt(np.diag(found))])
    assert found == pytest.approx(correlations, abs=0.01)


def test_derivatives_are_right_after_stops():
    """Compare errors with derivatives by differences for a record that contains several stops."""
    scene, t = HEAVY.replace(friction=3.0, damping=(0.02,) * 3), np.linspace(0.0, 6.0, 43)
    stops = kr.solve(scene, 6.0, events=[kr.events.stopped()]).events.t
    assert len(stops) > 1 and np.abs(t - stops[:, None]).min() > 0.01
    record = simulate(scene, t, {"body_velocity": 0.01}, noise=0.0)
    fit = kr.fit(scene, record, ("velocity", "moments", "damping", "friction"))

    def predict_rates(x):
        changed = change_parameters(scene, dict(zip(fit.names, x, strict=True)))
        return kr.solve(changed, t).body_velocity / 0.01

    jacobian = differentiate(predict_rates, np.zeros(len(fit.names)), 1e-6)
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    units = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert fit.covariance / units == pytest.approx(covariance / units, abs=1e-3)
