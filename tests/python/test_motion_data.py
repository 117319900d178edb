"""Tests that kreisel.fit finds a motion from imperfect records, without a good initial guess."""

import kreisel as kr
import numpy as np
import pytest

T = np.linspace(0.0, 2.0, 200)
ROTATION = kr.Body(1.0, (1.0, 1.3, 0.6), com=(0.05, 0.1, 0.4), unphysical=True)
TOP = kr.Scene(ROTATION.turn((0.5, -0.5, 0.1, 0.7)), body_velocity=(3, 2, 12), gravity=9.81)
GUESS = TOP.replace(attitude=(0.6, 0, 0.8, 0), momentum=(0, 0, 1))
TURNING = {"turning": (0.0, 0.0, 0.7)}


def keep(values):
    return values


def flip_signs(values):
    return values * np.random.default_rng(3).choice((-1.0, 1.0), size=(len(values), 1))


def lose_values(values):
    return np.where(np.arange(len(values))[:, None] % 7, values, np.nan)


def add_outliers(values):
    return np.where(np.arange(len(values))[:, None] % 50, values, values + 30.0)


GAP, REPEATED = np.delete(T, slice(80, 95)), np.sort(np.append(T, T[::20]))
RECORDS = {  # measured quantities, times, changed values, the support, the loss
    "attitudes with any signs": (["q"], T, flip_signs, {}, "linear"),
    "attitudes with a gap": (["q"], GAP, keep, {}, "linear"),
    "attitudes on a turning support": (["q"], T, keep, TURNING, "linear"),
    "missing values": (["body_velocity", "body_vertical"], T, lose_values, {}, "linear"),
    "repeated times": (["velocity"], REPEATED, keep, {}, "linear"),
    "outliers": (["body_velocity", "body_vertical"], T, add_outliers, {}, "soft"),
    "a turning gyroscope": (["inertial_velocity", "body_vertical"], T, keep, TURNING, "linear"),
    "the apex": (["apex"], T, keep, {}, "linear"),
}


@pytest.mark.filterwarnings("ignore:The residuals are", "ignore:.*fits as well")
@pytest.mark.parametrize("kind", RECORDS)
def test_the_motion_is_found_from_a_far_guess(kind):
    names, t, change_values, support, loss = RECORDS[kind]
    scene = TOP.replace(**support)
    path = kr.solve(scene, t)
    values = {name: change_values(getattr(path, name)) for name in names}
    record = kr.Record(path.t, values, 0.01)
    free = ("start",) if kind == "the apex" else ("start", "moments")
    fit = kr.fit(GUESS.replace(**support), record, free, loss=loss)
    found = kr.solve(fit.scene, path.t)
    for name in names:
        expected = getattr(path, name)
        if name == "q":
            assert kr.attitude_error(found.q, expected).max() < 1e-3
        else:
            assert np.abs(getattr(found, name) - expected).max() < 1e-3 * np.abs(expected).max()
