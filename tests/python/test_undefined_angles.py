"""Tests of fits to precession and spin angles where the apex is vertical."""

import warnings

import fits
import kreisel as kr
import numpy as np
import pytest

TOP = kr.scenes.asymmetric_regular  # its apex is vertical at t = 0
T = np.linspace(0.0, 6.0, 150)
ANGLES = ("nutation", "precession_angle", "spin_angle")
SIGMA = 0.02


def lean(angle):
    return TOP.replace(attitude=(np.cos(0.5 * angle), np.sin(0.5 * angle), 0.0, 0.0))


def make_record(scene=TOP, t=T, seed=0, names=ANGLES, free=()):
    """Simulate noisy readings at increasing times, of which the first may be negative."""
    rng = np.random.default_rng(seed)
    paths = kr.solve(scene, t[t < 0.0][::-1]), kr.solve(scene, t[t >= 0.0])
    values = {}
    for name in names:
        before, after = (getattr(path, name) for path in paths)
        values[name] = np.append(before[::-1], after) + SIGMA * rng.normal(size=len(t))
    return kr.Record(t, values, SIGMA, free=free)


def leave_out_first_angles(record):
    values = {
        one.name: np.where(
            (np.arange(len(T)) > 0) | (one.name == "nutation"), one.values[:, 0], np.nan
        )
        for one in record.series
    }
    return kr.Record(T, values, SIGMA)


@pytest.mark.parametrize("angle", [0.0, 0.002, 0.1])
def test_angles_of_an_upright_top_are_left_out(angle):
    """Check guesses whose apex is vertical or leans, of a top whose apex is vertical at t = 0."""
    record = make_record()
    motion = "fitted motion" if angle else "scene"
    message = f"^precession_angle and spin_angle at t = 0 left out: .* of the {motion} is vertical"
    with pytest.warns(UserWarning, match=message):
        found = kr.fit(lean(angle), record)
    assert found.has_converged and found.nonlinearity < 0.3
    assert "2 values are left out" in str(found) and found.records[0].missing == 2
    assert np.isnan(found.residuals[0]["spin_angle"]).tolist() == [True] + [False] * 149
    assert not np.isnan(found.residuals[0]["nutation"]).any() and record.missing == 0
    expected = kr.fit(TOP, leave_out_first_angles(record))
    for name in expected.names:
        error = expected.error[name]
        assert abs(found.values[name] - expected.values[name]) < 1e-3 * error
        assert found.error[name] == pytest.approx(error, rel=1e-3) and error > 1e-3
    for k in range(3):
        name = f"I{k + 1}"
        assert abs(found.values[name] - TOP.body.moments[k]) < 4.0 * found.error[name]


def test_times_of_undefined_angles_are_those_of_the_motion():
    """Check records in both directions of time with a late clock and with a second record."""
    t = np.concatenate((-T[40:0:-5], T[:100:5]))
    first = make_record(t=t, names=("precession_angle", "spin_angle"))
    with pytest.warns(UserWarning, match="^precession_angle and spin_angle at t = 0 left out"):
        found = kr.fit(TOP, [first, make_record(t=T[1:], names=("spin",))], "start")
    assert [record.missing for record in found.records] == [2, 0]
    late = make_record(t=T, free="delay")
    with pytest.warns(UserWarning, match="at t = 0 left out"):
        found = kr.fit(TOP, [late, make_record(t=T[1:])], "start")
    assert abs(found.values["delay[0]"]) < 4.0 * found.error["delay[0]"] < 0.01


def test_defined_angles_are_not_left_out():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = kr.fit(TOP, make_record(t=T[1:]), "start")
        assert found.records[0].missing == 0
        nutation = kr.fit(TOP, make_record(names=("nutation", "spin")), "velocity")
        assert nutation.records[0].missing == 0


def test_many_times_of_undefined_angles_are_counted():
    record = make_record(t=np.concatenate((np.zeros(5), T[1:])))
    with pytest.warns(UserWarning, match="at t = 0, 0, 0 and 2 other times left out"):
        kr.fit(TOP, record, "start")


UPRIGHT = kr.Scene(
    kr.Body(1.0, (1.0, 1.3, 0.6), com=(0.0, 0.0, 0.4), unphysical=True),
    body_velocity=(0.0, 0.0, 30.0),
    gravity=9.81,
)


def test_angles_that_are_undefined_at_all_times_are_refused():
    record = make_record(UPRIGHT, T[:60], names=("spin", "spin_angle"))
    guess = UPRIGHT.replace(attitude=lean(0.1).attitude)
    with pytest.raises(ValueError, match="spin_angle is undefined at all its times, because the"):
        kr.fit(guess, record, "start")
    with pytest.raises(ValueError, match="spin_angle does not depend on the free parameters"):
        kr.fit(UPRIGHT, record, "start")


def test_a_guess_that_stays_upright_leaves_out_no_angle():
    """Check that the records of a leaning top give another guess."""
    guess = fits.SYMMETRIC_GUESS
    record = make_record(fits.SYMMETRIC, 0.5 * T, names=("nutation", "precession_angle"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = kr.fit(guess, record)
    assert found.records[0].missing == 0 and 0.8 < found.chi2 / found.dof < 1.2


def test_a_guess_that_cannot_be_solved_leaves_out_no_angles():
    fast = lean(0.3).replace(velocity=(0.0, 0.0, 1e30))
    with pytest.raises(ValueError, match="double precision cannot resolve its attitude"):
        kr.solve(fast, T)
    fit = kr.fit(fast, make_record(lean(0.3)), ["velocity"])
    assert fit.has_converged and fit.chi2 < 1.2 * fit.dof
    assert sum(record.missing for record in fit.records) == 0
