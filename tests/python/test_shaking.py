"""Tests of shaken supports against SciPy, decimal Taylor series and averaging theory."""

import math

import kreisel as kr
import numpy as np
import pytest
from decimal_series import decimal_error
from moving_tops import (
    BODIES,
    START,
    check_members,
    check_resumed,
    compare_methods,
    compare_tangents,
    integral_of,
    list_unsupported_calls,
    make_scene,
    unit_changes,
)

SHAKING = (0.2, 5.0, 0.3)
HEAVY = make_scene("general", shaking=SHAKING)


@pytest.mark.parametrize("end", [2.0, -2.0])
@pytest.mark.parametrize("name", BODIES)
def test_every_method_agrees_with_scipy(name, end):
    compare_methods(make_scene(name, shaking=SHAKING), end, {"taylor"})
    damped = make_scene(name, shaking=SHAKING, damping=(0.1, 0.2, 0.3), turning=(0.3, -0.2, 0.5))
    compare_methods(damped, end, {"taylor"})


@pytest.mark.parametrize("digits, tolerance", [(None, 1e-14), (20, 1e-18), (30, 1e-27)])
def test_digits_agree_with_decimal_arithmetic(digits, tolerance):
    for name in ("general", "tensor", "lagrange"):
        for words in ({}, {"damping": 0.03, "turning": (0.3, -0.2, 0.5)}):
            scene = make_scene(name, shaking=SHAKING, **words)
            assert decimal_error(scene, 1.5, digits) < tolerance


def test_the_phase_is_accurate_at_late_times():
    rate, phase, t = 20.0, 0.3, 1000.0
    free = kr.Body(1.0, (1.0, 1.0, 1.0), (0, 0, 0.3), unphysical=True)
    scene = kr.Scene(free, momentum=(0, 0, 1), gravity=0.0, shaking=(1e-3, rate, phase))
    path = kr.solve(scene, [0.0, t])
    pull = -1e-3 * rate**2 * math.cos(rate * t + phase)
    assert path.potential[-1] == pytest.approx(0.3 * pull * path.apex[-1, 2], rel=1e-12)


def test_the_power_balance_with_damping():
    scene = HEAVY.replace(damping=(0.02, 0.03, 0.05))
    t = np.linspace(0, 5, 4001)
    path = kr.solve(scene, t)
    amplitude, rate, phase = SHAKING
    loss = -(np.array(scene.damping) * path.body_velocity**2).sum(axis=1)
    height = path.apex[:, 2] * np.linalg.norm(scene.body.com) * scene.body.mass
    power = loss + amplitude * rate**3 * np.sin(rate * t + phase) * height
    assert path.energy[-1] - path.energy[0] == pytest.approx(integral_of(power, t), abs=1e-10)
    assert math.isnan(path.energy_error)
    plain = kr.solve(HEAVY, t)
    assert np.ptp(plain.vertical_momentum) < 1e-13 and np.ptp(plain.energy) > 0.1


@pytest.mark.parametrize("spin", [0.0, 3.0])
def test_the_stability_limit_agrees_with_the_averaged_motion(spin):
    """Compare with Kapitza's condition (I3 spin)^2 + 2 (m l A r)^2 = 4 I1 m g l."""
    body, rate = kr.Body(1.0, (1.0, 1.0, 0.3), (0, 0, 0.5), unphysical=True), 400.0
    stiffness = 4.0 * 1.0 * 9.81 * 0.5 - (0.3 * spin) ** 2
    border = math.sqrt(stiffness / 2.0) / (0.5 * rate)
    greatest = []
    for factor in (0.95, 1.05):
        top = kr.Scene.spinning(
            body, spin, tilt=1e-3, gravity=9.81, shaking=(factor * border, rate, 0.0)
        )
        greatest.append(kr.solve(top, np.linspace(0, 15, 400)).nutation.max())
    assert greatest[0] > 0.5 and greatest[1] < 0.02
    still = kr.solve(top.replace(shaking=None), np.linspace(0, 15, 400))
    assert still.nutation.max() > 0.5


def test_the_end_of_a_path_has_the_phase_at_its_time():
    path = kr.solve(HEAVY, [0.0, 1.0])
    end = path.end
    amplitude, rate, phase = end.shaking
    assert (amplitude, rate) == SHAKING[:2]
    assert math.cos(phase) == pytest.approx(math.cos(5.3), abs=1e-15)
    assert path.scene_at(0) == HEAVY
    next_path = kr.solve(end, [0.0, 1.5])
    whole = kr.solve(HEAVY, [0.0, 2.5])
    assert kr.attitude_error(next_path.q[-1], whole.q[-1]) < 1e-14
    assert next_path.potential[0] == pytest.approx(path.potential[-1], abs=1e-14)


def test_the_phase_continues_after_a_push_and_a_change():
    check_resumed(HEAVY, [{"method": "taylor"}, {"method": "taylor", "digits": 20}])
    run = kr.start(HEAVY)
    run.to([1.0])
    run.push((0.1, 0.2, 0.3))
    again = kr.resume(run.checkpoint)
    after = run.to([1.0, 2.5])
    assert again.to([1.0, 2.5]).states.tobytes() == after.states.tobytes()
    scene = kr.solve(HEAVY, [1.0]).end
    scene = scene.replace(momentum=np.add(scene.momentum, (0.1, 0.2, 0.3)))
    assert kr.attitude_error(after.q[-1], kr.solve(scene, [1.5]).q[-1]) < 1e-14
    assert kr.attitude_error(after.end.attitude, after.q[-1]) == 0.0
    assert math.cos(after.end.shaking[2]) == pytest.approx(math.cos(5.0 * 2.5 + 0.3), abs=1e-14)
    run.change(shaking=(0.1, 3.0, 0.0))
    path = run.to([2.5, 3.0])
    expected = after.end.replace(shaking=(0.1, 3.0, 7.5))
    assert kr.attitude_error(path.q[-1], kr.solve(expected, [0.5]).q[-1]) < 1e-14


def test_events_use_the_phase_at_their_time():
    low = kr.events.nutation(direction=1)
    found = kr.solve(HEAVY, 10.0, events=[low]).events
    path = kr.solve(HEAVY, np.linspace(0, 10, 20001))
    falls = np.diff(path.apex[:, 2]) < 0.0
    assert len(found.t) == np.count_nonzero(falls[:-1] & ~falls[1:]) > 2
    whole = kr.solve(HEAVY, found.t)
    assert np.abs(whole.q - found.path.q).max() < 1e-13
    section = kr.section(HEAVY.vary(momentum=[(0, 0, 1), (0, 1, 0)]), n=3)
    first = kr.solve(HEAVY.replace(momentum=(0, 1, 0)), 20.0, events=[low]).events
    assert np.abs(section.t[section.top == 1] - first.t[:3]).max() < 1e-12


def test_members_of_an_ensemble_equal_single_tops():
    tops = HEAVY.vary(shaking=[(0.1, 2.0, 0.0), (0.2, 7.0, 1.0), (0.1, 1e-3, 0)])
    assert kr.Ensemble.of([tops[0], tops[1]])[1] == tops[1] == kr.Source.of(tops)[1]
    check_members(tops, [0.0, 1.0])
    check_members(tops, [0.0, -1.0], digits=20)
    grid = kr.Source.grid(HEAVY, shaking=[(0, 0, 1), (0.1, 1, 0)], gravity=[1.0, 2.0])
    assert grid[3].shaking == (0.1, 1, 0)
    assert kr.Scene.from_toml(HEAVY.to_toml()) == HEAVY and "shaking=(0.2" in repr(HEAVY)


def test_a_sweep_names_the_components(tmp_path):
    pytest.importorskip("pyarrow")
    source = kr.Source.grid(HEAVY, shaking=[(0.1, 2.0, 0.0), (0.2, 7.0, 1.0)])
    sweep = kr.sweep(source, [1.0], folder=tmp_path / "swept", want=("nutation",))
    assert sweep["shaking_rate"].tolist() == [2.0, 7.0]
    assert sweep.units["shaking_amplitude"] == "L" and sweep.units["shaking_rate"] == "rad/T"


@pytest.mark.parametrize("digits", [16, 30])
def test_tangents_agree_with_differences(digits):
    for name in ("general", "tensor"):
        scene = make_scene(name, shaking=SHAKING, damping=(0.1, 0.2, 0.3))
        compare_tangents(scene, 2.0, unit_changes(scene, "shaking"), digits)
        compare_tangents(scene, 2.0, unit_changes(scene, "gravity"), digits)


@pytest.mark.parametrize(
    "shaking",
    [(math.nan, 1, 0), (0.1, 0, 0), (0.1, -1, 0), (0.1, 1, math.inf), "x", (1, 2), 1.0],
)
def test_invalid_shaking_is_refused(shaking):
    for make in (
        lambda: HEAVY.replace(shaking=shaking),
        lambda: HEAVY.vary(shaking=shaking),
        lambda: kr.Ensemble(HEAVY.body, momentum=(0, 0, 1), shaking=shaking, gravity=1),
        lambda: kr.Scene.from_euler(HEAVY.body, (0, 1, 0), shaking=shaking, gravity=1),
        lambda: kr.start(HEAVY).change(shaking=shaking),
    ):
        with pytest.raises((TypeError, ValueError), match="shaking"):
            make()


def test_functions_without_shaken_supports_refuse_them():
    path = kr.solve(HEAVY, np.linspace(0, 10, 101))
    axial = kr.Body(1, (1, 1, 0.5), (0, 0, 0.3))
    for call in (
        *list_unsupported_calls(HEAVY, path),
        lambda: kr.solve(kr.Scene(axial, **START, shaking=SHAKING), 1.0, "bobenko_suris", step=0.1),
        lambda: kr.view(HEAVY, open=False),
        lambda: kr.events.separatrix(HEAVY),
        lambda: kr.Scene.spinning(
            axial, spin=9.0, tilt=0.3, steady=True, shaking=SHAKING, gravity=1
        ),
    ):
        with pytest.raises(ValueError, match="shak"):
            call()
