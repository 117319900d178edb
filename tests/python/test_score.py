"""Scores of programs with planted mistakes, which a small simulator plays."""

import json
from functools import cache
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import invoke

SUITE = Path(__file__).parents[2] / "suite"
NONE = (0, 0, 0)
TURN = np.array([0.5, 0.5, 0.5, 0.5])


def rotate(q):
    w, x, y, z = q
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * (w * cross + cross @ cross)


def multiply(a, b):
    v = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *v])


@cache
def simulate(name, mistake="", h=0.02, end=3.0, step=None):
    """Return (t, q, w) of a case by the method `step`, with w in the body."""
    file = json.loads((SUITE / f"{name}.json").read_text())
    words, start = file["parameters"], file["initial"]
    tensor = np.array(words["inertia"])
    tensor = np.diag(tensor) if tensor.ndim == 1 else tensor
    lever = words["mass"] * words["gravity"] * np.array(words["center_of_mass"])
    drag, rotor = words.get("damping", 0) * np.eye(3), np.array(words.get("rotor_momentum", NONE))
    q, w = np.array(start["attitude"]), np.array(start["angular_velocity"])
    sign = {"no gyroscopic term": 0, "wrong sign of the gyroscopic term": -1}.get(mistake, 1)
    if mistake == "radians read as degrees":
        w = np.radians(w)
    elif mistake == "no gravity":
        lever = 0 * lever
    elif mistake == "damping as a rate":
        drag = drag @ tensor
    is_in_space = mistake in ("inertia not rotated into space", "inertia rotated by the inverse")

    def find_rates(y):
        q, w = y[:4] / np.linalg.norm(y[:4]), y[4:]
        r, w4 = rotate(q), np.array([0, *w])
        if is_in_space:  # with a wrong inertia in space
            a = np.eye(3) if "not" in mistake else r.T
            moment = a @ tensor @ a.T
            torque = np.cross(r @ lever, (0, 0, -1)) + np.cross(moment @ w, w)
            return np.array([*multiply(w4, q) / 2, *np.linalg.solve(moment, torque)])
        torque = np.cross(r[2], lever) - drag @ w + sign * np.cross(tensor @ w + rotor, w)
        pair = (w4, q) if "used in space" in mistake else (q, w4)
        return np.array([*multiply(*pair) / 2, *np.linalg.solve(tensor, torque)])

    rows = [np.array([*q, *(rotate(q) @ w if is_in_space else w)])]
    for _ in range(round(end / h)):
        rows.append((step or make_runge_kutta_step)(find_rates, rows[-1], h))
    states = np.array(rows)
    q = states[:, :4] / np.linalg.norm(states[:, :4], axis=1)[:, None]
    return h * np.arange(len(states)), q, states[:, 4:]


def make_runge_kutta_step(rates, y, h):
    a = rates(y)
    b = rates(y + h / 2 * a)
    c = rates(y + h / 2 * b)
    return y + h / 6 * (a + 2 * (b + c) + rates(y + h * c))


def make_implicit_step(rates, y, h):
    new = y
    for _ in range(9):
        new = y + h * rates(new)
    return new


def make_explicit_step(rates, y, h):
    return y + h * rates(y)


MOTIONS = [  # (mistake, case)
    ("no gyroscopic term", "asymmetric_top"),
    ("no gyroscopic term", "tumble"),
    ("wrong sign of the gyroscopic term", "tumble"),
    ("wrong sign of the gyroscopic term", "rotor_driven"),
    ("angular velocity of the body used in space", "asymmetric_top"),
    ("angular velocity of the body used in space", "tumble"),
    ("inertia not rotated into space", "asymmetric_top"),
    ("inertia rotated by the inverse", "products"),
    ("radians read as degrees", "tumble"),
    ("no gravity", "asymmetric_top"),
    ("damping as a rate", "damped"),
]
RELABELLINGS = [
    ("scalar last read as scalar first", lambda q: q[:, [1, 2, 3, 0]]),
    (
        "scalar last read as scalar first and inverse attitude",
        lambda q: q[:, [1, 2, 3, 0]] * [-1, -1, -1, 1],
    ),
    ("scalar first read as scalar last", lambda q: q[:, [3, 0, 1, 2]]),
    ("inverse attitude", lambda q: q * [1, -1, -1, -1]),
    ("left-handed axes", lambda q: q * [1, -1, -1, 1]),
    ("left-handed axes", lambda q: q[:, [0, 1, 3, 2]] * [1, -1, -1, -1]),
    ("y up instead of z", lambda q: q[:, [0, 1, 3, 2]] * [1, 1, 1, -1]),
    ("other axes of space", lambda q: np.array([multiply(TURN, row) for row in q])),
    ("other axes of the body", lambda q: np.array([multiply(row, TURN) for row in q])),
]


def write(file, t, q, w=None, unit=""):
    """Write a CSV file in single precision, as engines have it."""
    columns = np.column_stack([t, q] if w is None else [t, q, w])
    rates = "".join(f",omega.{axis}{unit}" for axis in "xyz")
    head = "time [s],quat_w,quat_x,quat_y,quat_z" + rates * (w is not None)
    np.savetxt(file, columns, "%.7g", delimiter=",", header=head, comments="")
    return str(file)


@pytest.mark.parametrize(("mistake", "case"), MOTIONS)
def test_the_mistake_in_the_equations_is_named(mistake, case, tmp_path):
    score = kr.score(write(tmp_path / f"{case}_60Hz.csv", *simulate(case, mistake)))
    assert not score.is_within and mistake in score.mistakes
    if case == "asymmetric_top":  # without gravity, some mistakes cause the same motion
        assert score.mistakes == (mistake,)


@pytest.mark.parametrize(("mistake", "relabel"), RELABELLINGS)
def test_the_mistake_in_the_attitudes_is_named(mistake, relabel, tmp_path):
    t, q, _ = simulate("asymmetric_top")
    assert kr.score(write(tmp_path / "asymmetric_top.csv", t, relabel(q))).mistakes == (mistake,)


@pytest.mark.parametrize(
    ("case", "mistake"),
    [
        ("friction", "no friction"),
        ("turning_support", "support at rest"),
        ("shaking_support", "support does not shake"),
        ("damped", "no damping"),
    ],
)
def test_an_effect_that_is_left_out_is_named(case, mistake):
    file = json.loads((SUITE / f"{case}.json").read_text())
    words, start = file["parameters"], file["initial"]
    body = kr.Body(words["mass"], words["inertia"], words["center_of_mass"], unphysical=True)
    velocity = {"body_velocity": start["angular_velocity"], "attitude": start["attitude"]}
    t = np.linspace(0.0, 3.0, 151)
    path = kr.solve(kr.Scene(body, **velocity, gravity=words["gravity"]), t)
    assert mistake in kr.score({"t": t, "q": path.q}, case).mistakes


def test_two_mistakes_at_once_are_named(tmp_path):
    t, q, _ = simulate("asymmetric_top", "no gravity")
    score = kr.score(write(tmp_path / "asymmetric_top.csv", t, q * [1, -1, -1, -1]))
    assert score.mistakes == ("no gravity and inverse attitude",)
    assert "likely mistake: no gravity" in str(score) and "base64" in score._repr_html_()
    assert (
        "quaternions not normalized" in kr.score({"t": t, "q": 1.5 * q}, "asymmetric_top").mistakes
    )


@pytest.mark.parametrize(
    ("mistake", "step"), [("damping", make_implicit_step), ("gain", make_explicit_step)]
)
def test_numerical_damping_and_gain_of_energy_are_named(mistake, step, tmp_path):
    score = kr.score(write(tmp_path / "tumble.csv", *simulate("tumble", h=1 / 60, step=step)))
    assert len(score.mistakes) == 1 and f"numerical {mistake}" in score.mistakes[0]
    assert (score.energy_error < -0.01) == (mistake == "damping")


def test_velocities_in_space_and_in_degrees_are_recognized(tmp_path):
    t, q, w = simulate("tumble")
    in_space = np.array([rotate(a) @ b for a, b in zip(q, w, strict=True)])
    degrees = ("angular velocity in degrees",)
    for given, unit, mistakes in (
        (in_space, "", ()),
        (np.degrees(w), "", degrees),
        (np.degrees(w), " [deg/s]", ()),
        (np.degrees(in_space), "", degrees),
    ):
        score = kr.score(write(tmp_path / "tumble.csv", t, q, given, unit))
        assert score.mistakes == mistakes and score.velocity_error < 1e-4


def test_the_order_of_a_right_program_is_found():
    steps = 0.08, 0.04, 0.02
    runs = [dict(zip("tqw", simulate("asymmetric_top", h=h), strict=True)) for h in steps]
    score = kr.score(runs, "asymmetric_top", level=1e-4)
    assert score.order == pytest.approx(4.0, abs=0.4) and score.is_within
    np.testing.assert_allclose(score.steps, steps)
    assert score.attitude_error[0] > score.attitude_error[2] == score.attitude_error.min()
    assert abs(score.energy_error[2]) < 1e-6 and score.mistakes == ()


def test_a_run_that_ends_in_nan_is_above_every_level():
    t, q, w = map(np.copy, simulate("tumble", end=0.2))
    q[-2:] = np.nan
    score = kr.score({"t": t, "q": q, "w": w}, "tumble", level=3.0)
    assert not score.is_within and "not finite" in score.mistakes[0]


def test_the_exit_code_tells_whether_the_error_is_within_the_level(tmp_path):
    steps = 0.08, 0.04
    files = [write(tmp_path / f"tumble_{h}.csv", *simulate("tumble", h=h)) for h in steps]
    picture = tmp_path / "errors.png"
    good = invoke(["score", *files, "--plot", str(picture)])
    assert good.exit_code == 0 and "order of convergence" in good.stdout
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert invoke(["score", files[0], "--level", "science"]).exit_code == 1
