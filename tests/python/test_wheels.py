"""Tests of wheels on free axles, against integrations whose states include their rates."""

import kreisel as kr
import numpy as np
import pytest
from scipy.integrate import solve_ivp

turn_back, multiply = kr.quaternion.turn_back, kr.quaternion.multiply
TENSOR = np.array([[1.6, 0.1, 0.2], [0.1, 1.9, -0.1], [0.2, -0.1, 2.0]])
BODY = kr.Body(1.2, TENSOR, (0.2, -0.3, 0.4), unphysical=True).with_rotor(
    spin=5, inertia=0.2, axis=(1, 1, 0)
)
FIRST = {"inertia": 0.5, "axis": (0.2, -0.4, 1), "rate": 9.0}
SECOND = {"inertia": 0.3, "axis": (1, 0, 0), "rate": -4.0}
THIN = kr.Body(0.5, (0.0405, 0.0405, 0.0135), (0, 0, 0.06), unphysical=True)
SPIN = {"inertia": 0.0135, "axis": (0, 0, 2), "rate": 50}


def integrate(body, wheels, q, velocity, t, gravity, damping=0.0, turning=(0, 0, 0)):
    """Return the attitude, the angular velocity in the body and the rates of the wheels at t."""
    axes = np.array([np.array(one["axis"]) / np.linalg.norm(one["axis"]) for one in wheels])
    moments = np.array([one["inertia"] for one in wheels])
    inertia, lever = np.array(body.inertia), body.mass * gravity * np.array(body.com)
    without = inertia - (axes.T * moments) @ axes

    def find_rates(_, y):
        q, w, rates = tuple(y[:4]), y[4:7], y[7:]
        u = w - turn_back(q, turning)
        momentum = inertia @ w + body.rotor + (moments * rates) @ axes
        torque = np.cross(turn_back(q, (0, 0, 1)), lever) - damping * u
        change = np.linalg.solve(without, np.cross(momentum, w) + torque)
        return [*(0.5 * np.array(multiply(q, (0, *u)))), *change, *(-axes @ change)]

    start = [*q, *(velocity + np.array(turn_back(q, turning))), *(one["rate"] for one in wheels)]
    y = solve_ivp(find_rates, (0, t), start, method="DOP853", rtol=3e-14, atol=1e-14).y[:, -1]
    return y[:4], y[4:7] - turn_back(tuple(y[:4]), turning), y[7:]


@pytest.mark.parametrize("t", [2.5, -2.5])
@pytest.mark.parametrize("more", [{}, {"damping": 0.1}, {"turning": (0.3, -0.2, 0.4)}])
def test_wheels_turn_freely(more, t):
    q, velocity = (0.5, 0.5, -0.5, 0.5), (0.3, -0.7, 0.5)
    truth = integrate(BODY, [FIRST, SECOND], q, velocity, t, 9.81, **more)
    body = BODY.with_wheel(**FIRST).with_wheel(**SECOND)
    words = {"attitude": q, "gravity": 9.81, **more}
    top = kr.Scene(body, body_velocity=velocity, **words)
    assert kr.Scene(body, momentum=top.momentum, **words) == top
    assert kr.Scene.from_toml(top.to_toml()) == top
    tops = kr.Scene(
        BODY.with_wheel(**{**FIRST, "rate": [9.0, 1.0]}).with_wheel(**SECOND),
        body_velocity=velocity,
        **words,
    )
    for path in (kr.solve(top, [0, t]), kr.solve(tops, [0, t])[0]):
        assert kr.attitude_error(path.q[-1], truth[0]) < 3e-11
        assert np.abs(path.body_velocity[-1] - truth[1]).max() < 3e-11
        found = np.stack([path.wheel_rate, path.second_wheel_rate], axis=-1)
        assert np.abs(found - [[9.0, -4.0], truth[2]]).max() < 3e-11
        assert np.isnan(path.third_wheel_rate).all()
        assert kr.solve(path.end, [0.0]).wheel_rate[0] == pytest.approx(truth[2][0], rel=1e-11)


def test_the_rate_has_derivatives_and_a_unit():
    top = kr.Scene(BODY.with_wheel(**FIRST), momentum=(1, 2, 3), gravity=9.81)
    path = kr.solve(top, [1.0], tangents="start")
    for i, push in enumerate(1e-5 * np.eye(3)):
        rates = [
            kr.solve(top.replace(momentum=top.momentum + sign * push), [1.0]).wheel_rate
            for sign in (1, -1)
        ]
        slope = (rates[0] - rates[1]) / 2e-5
        assert path.derivative("wheel_rate")[0, 3 + i] == pytest.approx(slope[0], rel=1e-7)
    assert path.to_pandas("wheel_rate", degrees=True).wheel_rate[1.0] == np.degrees(path.wheel_rate)


def test_a_frame_may_have_no_mass_if_the_body_is_symmetric():
    disk = THIN.with_wheel(**SPIN)
    top = kr.Scene.spinning(disk, spin=0.4, tilt=1.0, gravity=9.81)
    motor = THIN.with_rotor(spin=50, inertia=0.0135, axis=(0, 0, 1))
    path = kr.solve(top, [0.0, 3.0])
    same = kr.solve(kr.Scene.spinning(motor, spin=0.4, tilt=1.0, gravity=9.81), [0.0, 3.0])
    assert path.method == "exact" and (path.wheel_rate == 50).all()
    assert kr.attitude_error(path.q[-1], same.q[-1]) < 1e-14
    assert kr.Scene(disk + BODY, momentum=(0, 0, 1), gravity=1).body.inertia[2][2] == 2.0
    with pytest.raises(ValueError, match="nothing but a free wheel turns about its axle"):
        top.replace(damping=0.1)
    with pytest.raises(ValueError, match="give the frame a moment about the axle"):
        turned = kr.Body(0.5, (0.0405, 0.0305, 0.0135), (0, 0, 0.06), unphysical=True)
        kr.Scene(turned.with_wheel(**SPIN), momentum=(0, 0, 1), gravity=9.81)


def test_impossible_wheels_are_refused_by_name():
    with pytest.raises(ValueError, match=r"must not exceed 0\.0135, the moment of the whole body"):
        THIN.with_wheel(**{**SPIN, "inertia": 0.014})
    with pytest.raises(ValueError, match=r"inertia\[1\] = 0.014"):
        THIN.with_wheel(**{**SPIN, "inertia": [0.013, 0.014]})
    with pytest.raises(ValueError, match="axis must not be zero"):
        THIN.with_wheel(**{**SPIN, "axis": (0, 0, 0)})
    with pytest.raises(ValueError, match="at most 3 wheels"):
        BODY.with_wheel(**FIRST).with_wheel(**FIRST).with_wheel(**SECOND).with_wheel(**SECOND)
    flat = kr.Body(1, (1.9, 1, 1), (0, 0, 0)).with_wheel(inertia=0.5, axis=(0, 0, 1), rate=1)
    with pytest.raises(ValueError, match="no body contains this wheel"):
        kr.Scene(flat, momentum=(0, 0, 1))
    with pytest.raises(ValueError, match="the rotor includes the momentum of a wheel"):
        kr.Scene(BODY.with_wheel(**FIRST), momentum=(0, 0, 1), gravity=1).vary(rotor=(0, 0, 1))
