"""Tests of fits to records that leave something undetermined: vertical apexes, sparse samples."""

import kreisel as kr
import numpy as np
import pytest

TOP = kr.scenes.asymmetric_regular  # its apex is vertical at t = 0
T = np.linspace(0.0, 6.0, 150)
ANGLES = ("nutation", "precession_angle", "spin_angle")
SIGMA = 0.02


def lean(angle):
    return TOP.replace(attitude=(np.cos(0.5 * angle), np.sin(0.5 * angle), 0.0, 0.0))


def make_record(scene=TOP, t=T, names=ANGLES):
    """Simulate noisy readings at increasing times, of which the first may be negative."""
    rng = np.random.default_rng(0)
    paths = kr.solve(scene, t[t < 0.0][::-1]), kr.solve(scene, t[t >= 0.0])
    values = {}
    for name in names:
        before, after = (getattr(path, name) for path in paths)
        values[name] = np.append(before[::-1], after) + SIGMA * rng.normal(size=len(t))
    return kr.Record(t, values, SIGMA)


def leave_out_first_angles(record):
    values = {one.name: one.values[:, 0].copy() for one in record.series}
    for name in ANGLES[1:]:
        values[name][0] = np.nan
    return kr.Record(T, values, SIGMA)


@pytest.mark.parametrize("angle", [0.0, 0.1])
def test_angles_of_an_upright_top_are_left_out(angle):
    """Check guesses whose apex is vertical or leans, of a top whose apex is vertical at t = 0."""
    record = make_record()
    with pytest.warns(UserWarning, match="left out"):
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


def test_times_of_undefined_angles_are_those_of_the_motion():
    """Check a record in both directions of time beside another record."""
    t = np.concatenate((-T[40:0:-5], T[:100:5]))
    first, second = make_record(t=t, names=ANGLES[1:]), make_record(t=T[1:], names=("spin",))
    with pytest.warns(UserWarning, match="t = 0 left out"):
        found = kr.fit(TOP, [first, second], "start")
    assert [record.missing for record in found.records] == [2, 0]


GENERAL = kr.Body(1.0, (1.0, 1.5, 1.25), com=(0.1, 0.2, 0.3), unphysical=True)
SYMMETRIC = kr.Body.symmetric(1.0, 1.0, 0.6, 0.4, unphysical=True)


@pytest.mark.parametrize(
    ("body", "spin", "samples", "alias"),
    [
        (SYMMETRIC, 20.0, 32.0, 52.0),  # the samples per turn at the rate of 1 rad per unit of time
        (SYMMETRIC, 20.0, 128.0, None),
        (GENERAL, 20.0, 128.0, None),
    ],
)
def test_sparse_samples_allow_another_spin(body, spin, samples, alias):
    """Check that the other spin makes one turn more between two samples."""
    scene = kr.Scene(body, body_velocity=(0, 0, spin), attitude=(0.8, 0.6, 0, 0), gravity=1)
    path = kr.solve(scene, 2.0 * np.pi / samples * np.arange(12))
    text = str(kr.fit(scene, kr.Record(path.t, {"q": path.q}, SIGMA), "velocity"))
    assert ("samples per turn" in text) == (alias is not None)
    assert alias is None or f"{alias:g} instead of {spin:g}" in text
