"""Tests of ensembles of bodies with rotors."""

from dataclasses import replace

import kreisel as kr
import numpy as np
import pytest
from decimal_series import Series, attitude_error
from ensembles import same

ROTOR = np.array((0.3, -0.4, 0.8))
COM = (0.2, -0.3, 0.4)
TENSOR = [[1.3, 0.1, 0.2], [0.1, 1.8, -0.1], [0.2, -0.1, 2.0]]
BODIES = {
    "largest N": kr.Body(1.2, (2.1, 1.3, 1.7), COM, unphysical=True),
    "largest B": kr.Body(1.2, (1.3, 2.1, 1.7), COM, unphysical=True),
    "largest T": kr.Body(1.2, (1.3, 1.7, 2.1), COM, unphysical=True),
    "tensor": kr.Body(1.2, TENSOR, COM, unphysical=True),
    "thin": kr.Body(1.2, (1.3, 1.29, 0.2), COM, unphysical=True),
    "free": kr.Body(1.2, (1.3, 2.1, 1.7), (0, 0, 0)),
    "free symmetric": kr.Body(1.2, (1.7, 1.3, 1.3), (0, 0, 0)),
    "lagrange": kr.Body(1.2, (1.3, 1.7, 1.3), (0, 0.4, 0), unphysical=True),
    "kowalewski": kr.Body(1.2, (2, 2, 1), (0.7, 0, 0), unphysical=True),
    "spherical": kr.Body(1.2, (1.3, 1.3, 1.3), (0.3, 0.4, 0.5), unphysical=True),
    "nearly equal": kr.Body(1.2, (1.3, 1.3 * (1 + 2.0**-50), 1.7), COM, unphysical=True),
}
START = {"momentum": (0.4, -0.5, 0.9), "attitude": (0.5, 0.5, -0.5, 0.5), "gravity": 1.3}
# every axis alone, all axes, none, and rotors of extreme sizes
ROTORS = np.array([*np.diag(ROTOR), ROTOR, (0, 0, 0), 1e-9 * ROTOR, 1e-300 * ROTOR, -6.0 * ROTOR])
GENERAL = kr.Scene(BODIES["largest B"], **START)


def random_gyrostats(n, seed=3):
    """Return `n` random tops, two thirds of which have a rotor."""
    rng = np.random.default_rng(seed)
    kinds = [list(BODIES.values())[i % len(BODIES)] for i in range(n)]
    bodies = [replace(body, rotor=rng.normal(size=3) * (i % 3 > 0)) for i, body in enumerate(kinds)]
    return kr.Ensemble.of([kr.Scene(body, rng.normal(size=3), gravity=1.3) for body in bodies])


@pytest.mark.parametrize("t", [0.6, -0.6])
@pytest.mark.parametrize("name", BODIES)
def test_lanes_agree_with_decimal_arithmetic(name, t):
    tops = kr.Scene(BODIES[name], **START).vary(rotor=ROTORS)
    paths = kr.solve(tops, [t / 3, t], "taylor")
    assert kr.plan(tops, method="taylor").lanes == len(ROTORS)
    for i in range(len(ROTORS)) if t > 0.0 else (3, 7):
        q, m = Series(tops[i], digits=28).to(t)
        size = 1.0 + np.abs(ROTORS[i]).max()
        assert attitude_error(q, paths.q[i, 1]) < 3e-14 * size
        assert np.abs(paths.m[i, 1] - np.array(m, float)).max() < 3e-14 * size


def test_integrals_of_long_motions_are_constant():
    tops = random_gyrostats(66)
    paths = kr.solve(tops, [0.0, -200.0], "taylor")
    for values in (paths.energy, paths.vertical_momentum):
        assert np.abs(np.diff(values)).max() < 1e-12


TOPS = random_gyrostats(120)
TIMES = [0.0, 0.5, 2.0, 5.0]


@pytest.mark.parametrize("method", ["taylor", "auto"])
def test_a_top_depends_on_no_other(method):
    whole = kr.solve(TOPS, TIMES, method)
    assert not whole.status.any()
    for threads in (1, 3):
        assert same(kr.solve(TOPS, TIMES, method, threads=threads), whole)
    for selection in (slice(4, 5), slice(3, 100, 7), slice(None, None, -1)):
        assert same(kr.solve(TOPS[selection], TIMES, method), whole[selection])
    plain = kr.Ensemble.of([top for top in TOPS if not any(top.body.rotor)])
    assert np.array_equal(kr.solve(plain, TIMES, method).states, whole.states[::3])
    pieces = np.concatenate([piece.states for piece in kr.stream(TOPS, TIMES, method, chunk=32)])
    assert np.array_equal(pieces, whole.states)


def test_lanes_without_the_heading_give_the_same_quantities():
    names = ("nutation", "energy", "spin", "vertical_momentum")
    level = kr.solve(TOPS, TIMES, "taylor", want=names)
    whole = kr.solve(TOPS, TIMES, "taylor")
    for name in names:
        assert np.abs(getattr(level, name) - getattr(whole, name)).max() < 1e-12
    rows = kr.reduce(TOPS, TIMES, {"spin": ("max",), "energy": ("last",)}, method="taylor")
    assert np.abs(rows["spin"]["max"] - whole.spin.max(axis=1)).max() < 1e-12


def test_plans_count_rotors_in_lanes():
    plan = kr.plan(TOPS, TIMES, method="taylor")
    assert (plan.closed_form, plan.lanes, plan.alone) == (0, 120, 0)
    assert "in lanes" in plan.first.kernel
    tops = kr.Ensemble.of([GENERAL, GENERAL.replace(damping=0.1), TOPS[1].replace(friction=0.1)])
    plan = kr.plan(tops, TIMES)
    assert (plan.closed_form, plan.lanes, plan.alone) == (0, 1, 2)


@pytest.mark.parametrize(
    "event",
    [
        kr.events.nutation(direction=1),
        kr.events.crossing("apex_z", 0.1),
        kr.events.extremum("body_momentum_x"),
        kr.events.plane((0.3, -0.5, 0.8), of="body_velocity", direction=-1),
    ],
)
def test_sections_have_every_event_of_each_top(event):
    tops = random_gyrostats(22, seed=6)
    section = kr.section(tops, event, n=12, max_wait=60.0)
    assert section.count.sum() > 120
    for i in range(22):
        found = kr.solve(tops[i], 40.0, "taylor", events=[event]).events
        mine = section.states[section.top == i]
        count = min(len(mine), len(found.t))
        assert count == 12 or len(mine[mine[:, 0] <= 40.0]) == len(found.t)
        assert np.abs(mine[:count] - found.states[:count]).max(initial=0.0) < 1e-7


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("rotor", [-0.9, 0.25, 0.6])
def test_steady_rotations_are_left_at_the_rate_of_the_formula(axis, rotor):
    moments, spin = (1.0, 1.6, 2.1), 1.3
    own, one, other = np.roll(moments, -axis)
    square = -((own - one) * spin + rotor) * ((own - other) * spin + rotor) / (one * other)
    body = kr.Body(1.0, moments, (0, 0, 0), rotor=rotor * np.eye(3)[axis])
    scene = kr.Scene(body, body_velocity=spin * np.eye(3)[axis], gravity=0.0)
    for sign in (1.0, -1.0):
        turn = 2.0 * np.pi / spin
        t = sign * turn * np.round(np.array([300.0, 600.0]) / turn)
        indicator = kr.lyapunov(scene, t)
        first, last = indicator.curve * np.abs(t)
        assert indicator.certificate < 1e-12
        if square > 0.0:
            assert abs((last - first) / abs(t[1] - t[0]) - np.sqrt(square)) < 1e-9
        else:
            assert last < np.log(1.0 + abs(t[1])) + 5.0


def test_a_sleeping_gyrostat_falls_at_the_rate_of_the_formula():
    for momentum in ((0.0, 0.0, 0.4), (0.0, 0.0, -0.9)):
        body = kr.Body(1.3, (2.0, 2.0, 0.7), (0.0, 0.0, 0.8), rotor=momentum)
        scene = kr.Scene(body, velocity=(0.0, 0.0, 1.1), gravity=1.7)
        total = 0.7 * 1.1 + momentum[2]
        rate = np.sqrt(1.3 * 1.7 * 0.8 / 2.0 - (total / 4.0) ** 2)
        t = np.array([200.0, 300.0]) / rate
        first, last = kr.lyapunov(scene, t).curve * t
        assert abs((last - first) / (t[1] - t[0]) - rate) <= 1e-10 * rate


def test_growths_are_those_of_the_tangents_of_each_path():
    tops, t = random_gyrostats(33, seed=8), [-5.0, -60.0]
    indicator = kr.lyapunov(tops, t)
    assert indicator.certificate.max() < 1e-12 and set(indicator.status) == {"OK"}
    for i in (1, 2, 4, 13, 20):
        path = kr.solve(tops[i], t, "taylor", tangents="start", digits=20)
        size = np.log(np.abs(path.tangents).max(axis=(1, 2)))
        assert np.abs(indicator.curve[i] * np.abs(t) - size).max() < 4.0
        alone = kr.lyapunov(tops[i], t)
        assert np.array_equal(alone.curve, indicator.curve[i])
        assert alone.certificate == indicator.certificate[i]
    plain = kr.lyapunov(tops[::3], t)
    assert np.array_equal(plain.curve, indicator.curve[::3])


def test_directions_of_known_solutions_of_a_gyrostat_are_refused():
    scene = GENERAL.replace(body=replace(GENERAL.body, rotor=ROTOR))
    start = kr.solve(scene, [0.0])
    flow = [*start.body_velocity[0].tolist(), *start.torque[0].tolist()]
    turn = [*start.body_vertical[0].tolist(), *np.cross((0, 0, 1), start.m[0]).tolist()]
    for direction in (flow, turn):
        with pytest.raises(ValueError, match="no tangent in the direction"):
            kr.megno(scene, 5.0, direction=direction)
