"""Tests of bodies with rotors, alone and in ensembles, against known solutions."""

import math
from dataclasses import replace

import kreisel as kr
import numpy as np
import pytest

turn, turn_back, multiply = kr.quaternion.turn, kr.quaternion.turn_back, kr.quaternion.multiply

ROTOR, COM = (0.3, -0.4, 0.8), (0.2, -0.3, 0.4)
TENSOR = [[1.3, 0.1, 0.2], [0.1, 1.8, -0.1], [0.2, -0.1, 2.0]]
START = {"momentum": (0.4, -0.5, 0.9), "attitude": (0.5, 0.5, -0.5, 0.5), "gravity": 1.3}
BODIES = {
    "tensor": kr.Body(1.2, TENSOR, COM, unphysical=True),
    "lagrange": kr.Body(1.2, (1.3, 1.7, 1.3), (0, 0.4, 0), unphysical=True),
    "kowalewski": kr.Body(1.2, (2, 2, 1), (0.7, 0, 0), unphysical=True),
}
GENERAL = kr.Body(1.2, (1.3, 2.1, 1.7), COM, unphysical=True, rotor=ROTOR)
FREE = replace(GENERAL, com=(0, 0, 0), unphysical=False)
HEAVY = kr.Scene(GENERAL, **START)
# Bodies and axes: the axis of symmetry, or the direction of the centre of mass of a spherical body.
# A spherical body whose centre of mass is the fixed point has no particular axis.
AXIAL = [
    (kr.Body(1.2, (1.7, 1.3, 1.3), (-0.4, 0, 0), unphysical=True), (1, 0, 0)),
    (kr.Body(1.2, (1.3, 1.7, 1.3), (0, 0.4, 0), unphysical=True), (0, 1, 0)),
    (kr.Body(1.2, (1.3, 1.3, 1.7), (0, 0, -0.4), unphysical=True), (0, 0, 1)),
    (kr.Body(1.2, (1.3, 1.3, 1.3), (0.3, 0, 0.4), unphysical=True), (0.6, 0, 0.8)),
    (kr.Body(1.2, (1.7, 1.3, 1.3), (0, 0, 0)), (1, 0, 0)),
    (kr.Body(1.2, (1.3, 1.3, 1.3), (0, 0, 0)), (0, 0.6, 0.8)),
]


@pytest.mark.parametrize("t", [300.0, -300.0])
@pytest.mark.parametrize("body, axis", AXIAL)
def test_an_axial_rotor_shifts_the_spin(body, axis, t):
    momentum, moment = 0.7, 1.3 if len(set(body.moments)) == 1 else 1.7
    for gravity in (1.3, -1.3, 0.0):
        scene = kr.Scene(body, **{**START, "gravity": gravity})
        rotor_scene = scene.replace(body=replace(body, rotor=[momentum * x for x in axis]))
        angle = -momentum / moment * t
        rotation = (math.cos(angle / 2), *(math.sin(angle / 2) * x for x in axis))
        plain = kr.solve(scene, [0.0, t], "taylor", digits=30)
        for method, limit in (("exact", 1e-13), ("taylor", 3e-12)):
            path = kr.solve(rotor_scene, [0.0, t], method)
            q = multiply(tuple(plain.q[-1]), rotation)
            assert kr.attitude_error(path.q[-1], q) < limit
            assert np.abs(path.m[-1] - plain.m[-1]).max() < limit


def test_turning_points_equal_those_without_rotor():
    body = kr.Body(1.2, (1.3, 1.3, 0.7), (0, 0, 0.4), unphysical=True)
    rotor_top = kr.exact(kr.Scene(replace(body, rotor=(0, 0, 0.6)), **START))
    plain = kr.exact(kr.Scene(body, **START))
    assert rotor_top.t_least == plain.t_least and rotor_top.motion_type == plain.motion_type
    assert rotor_top.precession_rate == pytest.approx(plain.precession_rate, rel=1e-14)
    assert rotor_top.spin_angle_rate == pytest.approx(plain.spin_angle_rate - 0.6 / 0.7, rel=1e-13)
    assert rotor_top.critical_spin == pytest.approx(plain.critical_spin - 0.6 / 0.7, rel=1e-14)
    path = kr.solve(rotor_top.scene, np.linspace(0, 5, 51), "taylor")
    nodding = np.cross(path.velocity, path.apex)[:, 2] / np.sin(path.nutation)
    potential = rotor_top.potential(path.nutation)
    assert np.abs(path.energy - 0.5 * 1.3 * nodding**2 - potential).max() < 5e-15


def test_the_integrals_of_zhukovsky_and_volterra():
    path = kr.solve(kr.Scene(FREE, **START), np.linspace(0, 50, 101))
    own = np.array([turn_back(tuple(q), m) for q, m in zip(path.q, path.m, strict=True)])
    energy = (((own - FREE.rotor) ** 2) / FREE.moments).sum(axis=1) / 2
    assert np.abs(np.linalg.norm(own, axis=1) - np.linalg.norm(own[0])).max() < 1e-14
    assert np.abs(energy - energy[0]).max() < 1e-14 and np.abs(path.energy - energy).max() < 1e-14
    assert np.ptp(own, axis=0).min() > 0.1


def test_ensembles_vary_the_rotor_and_their_plans_count_it():
    tops = HEAVY.vary(rotor=np.diag(ROTOR), velocity=(0.3, 0.0, -0.2))
    words = {**START, "momentum": None, "velocity": (0.3, 0, -0.2)}
    assert tops[1] == kr.Scene(replace(GENERAL, rotor=(0, -0.4, 0)), **words)
    axial = kr.Scene(kr.Body(1, (1, 1, 0.5), (0, 0, 0.3)), **START)
    tops = axial.vary(rotor=[(0, 0, 0), (0, 0, 0.2), (0, 0.1, 0)])
    plan = kr.plan(tops, [0.0, 1.0])
    assert (plan.closed_form, plan.lanes, plan.alone) == (2, 1, 0)
    tops = kr.Scene.stack([HEAVY, HEAVY.replace(damping=0.1), HEAVY.replace(friction=0.1)])
    plan = kr.plan(tops, [0.0, 1.0])
    assert (plan.closed_form, plan.lanes, plan.alone) == (0, 2, 1)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("rotor", [-0.9, 0.25, 0.6])
def test_steady_rotations_are_left_at_the_rate_of_the_formula(axis, rotor):
    moments, spin = (1.0, 1.6, 2.1), 1.3
    own, one, other = np.roll(moments, -axis)
    square = -((own - one) * spin + rotor) * ((own - other) * spin + rotor) / (one * other)
    body = kr.Body(1.0, moments, (0, 0, 0), rotor=rotor * np.eye(3)[axis])
    scene = kr.Scene(body, body_velocity=spin * np.eye(3)[axis], gravity=0.0)
    for sign in (1.0, -1.0):
        period = 2.0 * np.pi / spin
        t = sign * period * np.round(np.array([300.0, 600.0]) / period)
        indicator = kr.chaos(scene, t)
        first, last = indicator.lyapunov_curve * np.abs(t)
        assert indicator.certificate < 1e-12
        if square > 0.0:
            assert abs((last - first) / abs(t[1] - t[0]) - np.sqrt(square)) < 1e-9
        else:
            assert last < np.log(1.0 + abs(t[1])) + 5.0


@pytest.mark.parametrize("momentum", [0.4, -0.9])
def test_a_sleeping_gyrostat_falls_at_the_rate_of_the_formula(momentum):
    body = kr.Body(1.3, (2.0, 2.0, 0.7), (0.0, 0.0, 0.8), rotor=(0, 0, momentum))
    scene = kr.Scene(body, velocity=(0.0, 0.0, 1.1), gravity=1.7)
    rate = np.sqrt(1.3 * 1.7 * 0.8 / 2.0 - ((0.7 * 1.1 + momentum) / 4.0) ** 2)
    t = np.array([200.0, 300.0]) / rate
    first, last = kr.chaos(scene, t).lyapunov_curve * t
    assert abs((last - first) / (t[1] - t[0]) - rate) <= 1e-10 * rate


def test_bodies_keep_their_rotors(tmp_path):
    tensor = replace(BODIES["tensor"], rotor=ROTOR)
    assert GENERAL.principal_rotor == ROTOR
    assert np.abs(np.array(turn(tensor.axes, tensor.principal_rotor)) - ROTOR).max() < 1e-15
    for body in (GENERAL, tensor):
        scene = kr.Scene(body, **START)
        assert kr.Scene.from_toml(scene.to_toml()) == scene
        kr.solve(scene, [0.0, 1.0]).save(tmp_path / "path.npz")
        assert kr.load(tmp_path / "path.npz").scene == scene
    cone = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
    cone = cone.with_rotor(spin=10, inertia=0.1, axis=(0, 0, 5))
    assert cone.rotor == (0, 0, 1) and (GENERAL + GENERAL).rotor == (0.6, -0.8, 1.6)
    half = (math.sqrt(0.5), math.sqrt(0.5), 0, 0)
    assert GENERAL.turn(half).rotor == pytest.approx((0.3, -0.8, -0.4), abs=1e-15)
    assert GENERAL.shift((0, 0, 1)).rotor == ROTOR and replace(GENERAL, rotor=(0, 0, 0)) != GENERAL


def find_flow(scene):
    """Return the direction in which the motion itself changes the start."""
    start = kr.solve(scene, [0.0])
    return [*start.body_velocity[0].tolist(), *start.torque[0].tolist()]


OBLIQUE = kr.Scene(replace(BODIES["lagrange"], rotor=ROTOR), **START)
LONE = kr.Scene(kr.Body(1, (1, 1, 0.5), (0, 0, 0.3), rotor=(0, 0, 0.2)), **START)
MAPS = ("bobenko_suris", "bobenko_suris2", "bobenko_suris4", "veselov2", "hirota_kimura")
WHEEL = {"spin": 1.0, "inertia": 1.0, "axis": (0, 0, 1)}


def make_wheel(**words):
    return lambda: GENERAL.with_rotor(**WHEEL | words)


@pytest.mark.parametrize(
    "call, word",
    [
        *[
            (lambda x=x: replace(GENERAL, rotor=x), "rotor")
            for x in ((math.nan, 0, 0), (0, math.inf, 0), "x", (1, 2), 1.0)
        ],
        (lambda: kr.Body([1, 2], (1, 1, 1), (0, 0, 0), rotor=(1, 2)), "rotor"),
        (lambda: HEAVY.vary(rotor=1.0), "rotor"),
        (make_wheel(spin=math.nan), "spin"),
        (make_wheel(inertia=-1.0), "inertia"),
        (make_wheel(axis=(0, 0, 0)), "axis"),
        (make_wheel(axis=(0, math.inf, 0)), "axis"),
        (make_wheel(spin=1e200, inertia=1e200), "spin"),
        *[(lambda x=x: kr.solve(LONE, 1.0, x, step=0.01), "rotors") for x in MAPS],
        (lambda: kr.solve(OBLIQUE, 1.0, "blanes_moan6", step=0.01), "rotor"),
        (lambda: kr.exact(HEAVY), "rotor"),
        (lambda: kr.exact(HEAVY.vary(mass=[1.0, 2.0])), "rotor"),
        (lambda: kr.solve(HEAVY, 1.0, "exact"), "rotor"),
        (lambda: kr.rod(kr.solve(HEAVY, [0.0, 1.0])), "rotor"),
        (lambda: kr.starts(GENERAL, energy=2.0, vertical=0.5, n=2, gravity=1), "rotor"),
        (lambda: kr.Scene.spinning(LONE.body, spin=9, tilt=0.3, steady=True, gravity=1), "rotor"),
        (lambda: LONE.vary(spin=[9.0, 8.0], steady=True), "rotor"),
        (lambda: kr.events.separatrix(HEAVY.replace(gravity=0)), "rotor"),
        (lambda: kr.solve(HEAVY, 1.0, events=[kr.events.kinetic(1.0)]), "rotor"),
        (lambda: kr.chaos(HEAVY, 5.0, direction=find_flow(HEAVY)), "direction"),
    ],
)
def test_bad_rotors_and_functions_for_bodies_without_rotors_are_refused(call, word):
    with pytest.raises((TypeError, ValueError), match=word):
        call()


def test_a_rotor_makes_a_special_body_general():
    scene = kr.Scene(replace(BODIES["kowalewski"], rotor=(0, 0, 0.5)), **START)
    path = kr.solve(scene, [0.0])
    assert scene.body.kind == "general" and np.isnan(path.kowalewski[0])
    assert np.isnan(kr.solve(LONE, [0.0]).modified_energy(0.01)[0])
