"""Laws of every quantity: its value follows from the state, and it scales as its unit says.

The formulas are those of docs/theory/supports.md, in the frame of description of the body.
"""

import inspect
import re
from typing import get_args

import kreisel as kr
import numpy as np
import pytest
from drawn_tops import KINDS, LAWS, change_body, scale_scene, subtract_paths, tops
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from kreisel.types import QuantityName
from moving_tops import Motion, turn

NAMES = [name for name in get_args(QuantityName) if not name.endswith("_low")]
EXTREMES = (
    *({}, {"friction": 3.0}, {"body_velocity": (0, 0, 0)}, {"attitude": (1, 0, 0, 0)}),
    {"turning": (0.0, 4.7e-5, 5.5e-5)},
)
STIFF = (2e4, (4e3, 2e3, 0.5), (0.0, 1e4, 1e4), 1e3)  # values of damping


@st.composite
def paths(draw, damping=None, times=(0.0, 0.4, 1.7, 9.0, 40.0)):
    """Draw the path of a scene, forward or, without stiff damping, backward in time."""
    scene = draw(tops()).replace(**draw(st.sampled_from(EXTREMES)))
    if damping is not None:
        rotor = draw(st.sampled_from((0.0, 30.0, 3e3))) * np.array((0.3, -0.4, 0.8))
        scene = change_body(scene, rotor=rotor).replace(damping=damping)
    is_back = draw(st.integers(0, 3)) == 0 and max(scene.damping) < 1.0
    try:
        return kr.solve(scene, [-0.3, -1.1] if is_back else times, "taylor")
    except kr.Error:  # a top that friction holds has no unique past
        assume(not is_back)
        raise


def tilt_of(apex):
    """Return the matrix of the rotation from e3 to the apex for which spin angles are zero."""
    if apex[2] < -0.5:
        return tilt_of(-apex) @ np.diag((1.0, -1.0, -1.0))
    x, y, z = apex
    cross = np.array(((0.0, 0.0, x), (0.0, 0.0, y), (-x, -y, 0.0)))
    return np.eye(3) + cross + cross @ cross / (1.0 + z)


def compute_fourth_integral(motion, own, up, kind):
    """Return K or the magnitude of G, in the axes of a Kowalewski or Chaplygin body."""
    moments, axes = np.linalg.eigh(np.linalg.inv(motion.inverse))
    first = -motion.apex
    basis = np.array((first, np.cross(axes[:, 0], first), axes[:, 0]))
    scene, reach = motion.scene, np.linalg.norm(motion.com)
    m = basis @ own / moments[2]
    p = scene.body.mass * scene.gravity * reach / moments[2] * (basis @ up)
    if kind == "kowalewski":
        return abs((m[0] + 1j * m[1]) ** 2 + 2.0 * (p[0] + 1j * p[1])) ** 2
    return abs(m[2] * (m[0] ** 2 + m[1] ** 2) + m[0] * p[2])


def compute_acceleration(motion, t, y, spin, size):
    """Return the angular acceleration relative to the support, in the frame of the body."""
    (own, turning), relative, friction = (
        motion.see_from_body(y),
        motion.relative(y),
        motion.scene.friction,
    )
    holding = motion.find_holding(t, y)
    is_zero = abs(spin) <= 1e-12 * size
    torque = np.clip(holding, -friction, friction) if is_zero else -friction * np.sign(spin)
    total = motion.torque(t, y) + torque * motion.apex - np.cross(relative + turning, own)
    return motion.inverse @ total - np.cross(turning, relative)


def compute_quantities(scene, t, y):
    """Return {name: (value, size of its terms)} for the state y = (attitude, momentum)."""
    motion, mass = Motion(scene), scene.body.mass
    (own, turning), relative = motion.see_from_body(y), motion.relative(y)
    tensor, apex, h = np.linalg.inv(motion.inverse), motion.apex, motion.rotor
    matrix = np.array([turn(tuple(y[:4]), e) for e in np.eye(3)]).T
    axes, up = np.array([turn(scene.body.axes, e) for e in np.eye(3)]), matrix[2]
    amplitude, rate, phase = scene.shaking
    g = scene.gravity - amplitude * rate**2 * np.cos(rate * t + phase)
    weight, top, inertial = mass * g * motion.com, matrix @ apex, relative + turning
    ease, momentum = np.abs(motion.inverse).max(), np.abs(own).max() + np.abs(h).max()
    omega = ease * momentum + np.abs(turning).max()
    spin, tilted = relative @ apex, tilt_of(apex).T @ up
    pole = 1.0 / max(np.hypot(top[0], top[1]), 1e-300)
    energy = momentum * omega + np.abs(weight).max() + 1.0
    alpha = ease * (energy + scene.friction + max(scene.damping) * omega) + omega**2
    kinetic = 0.5 * relative @ tensor @ relative
    potential = weight @ up - 0.5 * turning @ tensor @ turning - h @ turning
    acceleration = compute_acceleration(motion, t, y, spin, omega)
    return {
        "velocity": (matrix @ relative, omega),
        "body_velocity": (relative, omega),
        "inertial_velocity": (inertial, omega),
        "spin": (spin, omega),
        "body_acceleration": (acceleration, alpha),
        "pivot_force": (
            mass
            * matrix
            @ compute_point_force(acceleration, inertial, relative, g * up, motion.com),
            mass * (2.0 * np.abs(motion.com).max() * (alpha + omega**2) + np.abs(g)),
        ),
        "torque": (np.cross(matrix @ weight, (0.0, 0.0, -1.0)), energy),
        "frame": ((matrix @ axes.T).T, 1.0),
        "apex": (top, 1.0),
        "body_vertical": (up, 1.0),
        "body_momentum": (own, momentum),
        "vertical_momentum": (y[6], momentum),
        "axial_momentum": (own @ apex, momentum),
        "kinetic": (kinetic, energy),
        "potential": (potential, energy),
        "energy": (kinetic + potential, energy),
        "nutation": (np.arctan2(np.hypot(top[0], top[1]), top[2]), 1.0),
        "precession_angle": (np.arctan2(top[0], -top[1]), pole),
        "spin_angle": (np.arctan2(tilted[0], tilted[1]), pole),
        **{
            name: (compute_fourth_integral(motion, own, up, name), (omega**2 + energy * ease) ** 2)
            for name in ("kowalewski", "goryachev_chaplygin")
        },
    }


def compute_point_force(acceleration, inertial, relative, support, place):
    """Return the force on a unit mass at a point, from angular velocities seen from the body."""
    change = acceleration + np.cross(inertial - relative, relative)
    return np.cross(change, place) + np.cross(inertial, np.cross(inertial, place)) + support


def compute_specific_force(scene, t, y, place):
    """Return the acceleration of a point minus that of gravity, in the frame of the body."""
    truth = {name: value for name, (value, _) in compute_quantities(scene, t, y).items()}
    rates = [truth[name] for name in ("body_acceleration", "inertial_velocity", "body_velocity")]
    amplitude, rate, phase = scene.shaking
    g = scene.gravity - amplitude * rate**2 * np.cos(rate * t + phase)
    return compute_point_force(*rates, g * truth["body_vertical"], place)


@LAWS
@given(st.one_of(paths(), paths(4e1), paths(2e4)))
def test_every_quantity_follows_from_the_state(path):
    place = np.array((0.4, -0.7, 0.5))
    wheels = {"wheel_rate", "second_wheel_rate", "third_wheel_rate"}  # see test_wheels.py
    known = {*compute_quantities(path.scene, 0.0, path.states[0, 1:])}
    assert {*NAMES} == {"t", "q", "m", *known, *wheels}
    for i, state in enumerate(path.states):
        t, y = state[0], state[1:]
        truth = compute_quantities(path.scene, t, y)
        for name, (value, size) in truth.items():
            own = getattr(path, name)[i]
            if name in ("precession_angle", "spin_angle"):
                own = value + np.remainder(own - value + np.pi, 2.0 * np.pi) - np.pi
                size = size if size < 1e3 else np.inf  # the angle is undefined at the pole
            elif name in ("kowalewski", "goryachev_chaplygin"):
                value = np.nan if np.isnan(own) else value
                own = abs(own)
            assert np.abs(own - value).max() <= 1e-12 * size or np.isnan(value).all(), name
        force = compute_specific_force(path.scene, t, y, place)
        size = truth["body_acceleration"][1] + np.abs(force).max()
        assert np.abs(path.specific_force(place)[i] - force).max() < 1e-12 * size


@pytest.mark.parametrize("damping", [None, *STIFF])
@settings(LAWS, max_examples=16)
@given(data=st.data())
def test_motions_obey_the_equations_of_motion(damping, data):
    """Compare differences of attitudes and velocities with the velocities and accelerations."""
    path, step = data.draw(paths(damping)), 2.0**-19
    for t in path.t[1:]:
        near = kr.solve(path.scene, [t - step, t, t + step][:: int(np.sign(t))], digits=20)
        ahead, here, behind = near[2], near[1], near[0]
        if len({*np.sign(near.spin)}) > 1 and path.scene.friction:
            continue  # the acceleration jumps where the spin ends
        truth = compute_quantities(path.scene, t, here.states[0, 1:])
        turn = subtract_paths(ahead, behind)[:, :3]
        change = ahead.body_velocity - behind.body_velocity
        body, speed = path.scene.body, np.abs(here.body_velocity).max()
        drag = (max(path.scene.damping) + np.abs(body.rotor).max()) / min(body.moments)
        for name, rise in (("body_velocity", turn), ("body_acceleration", change)):
            value = truth[name][0]
            rate = np.sign(t) * rise[0] / (2.0 * step)
            size = 1.0 + np.abs(value).max() + drag * speed
            assert np.abs(rate - value).max() < 1e-6 * size, name


def find_unit(kind, name):
    """Return the unit (powers of M, L and T) that the documentation of a quantity states."""
    first_line = inspect.getdoc(getattr(kind, name)).splitlines()[0]
    above, _, below = "".join(re.findall(r"\[((?:rad|[MLT])[^\]]*)\]", first_line)).partition("/")
    powers = np.zeros(3, int)
    for sign, units in ((1, above), (-1, below)):
        for base, power in re.findall(r"([MLT])(?:\^(-?\d+))?", units):
            powers["MLT".index(base)] += sign * int(power or 1)
    return powers


@pytest.mark.parametrize("kind", KINDS)
@settings(LAWS, max_examples=20)
@given(st.data(), st.tuples(*[st.integers(1, 9)] * 3), st.booleans())
def test_every_quantity_scales_as_its_unit_says(kind, data, powers, is_ensemble):
    def scale(unit):
        return 2.0 ** int(np.dot(unit, powers))

    scene, t, place = (
        data.draw(tops((kind,))),
        np.array([0.0, 0.4, 1.7]),
        np.array((0.4, -0.7, 0.5)),
    )
    other = scale_scene(scene, scale)
    if is_ensemble:
        scene, other = (s.vary(gravity=np.array((1.0, 0.5)) * s.gravity) for s in (scene, other))
    one, two = kr.solve(scene, t), kr.solve(other, t * scale((0, 0, 1)))
    for name in NAMES:
        unit = find_unit(type(one), name)
        np.testing.assert_array_equal(getattr(one, name) * scale(unit), getattr(two, name), name)
    if not is_ensemble:
        force = one.specific_force(place) * scale(find_unit(type(one), "specific_force"))
        np.testing.assert_array_equal(force, two.specific_force(place * scale((0, 1, 0))))
