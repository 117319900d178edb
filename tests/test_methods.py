"""Every method keeps what its row in the table promises: order, integrals, reversibility, the bodies that it applies to.

The starts are tilted: over an upright start no torque acts, and that hides an error of first order."""

import numpy as np
import pytest

import kreisel as kr

BODIES = {
    "lagrange": kr.Body.cuboid(half=(0.8, 0.8, 1), pivot=(0, 0, -1)),
    "kowalewski": kr.Body.cuboid(half=(3**0.5, 1, 0.5), pivot=(0, 0, -0.5)),
    "goryachev_chaplygin": kr.Body.cuboid(half=(7**0.5, 1, 0.5), pivot=(0, 0, -0.5)),
    "asymmetric": kr.Body.cuboid(half=(0.6, 0.8, 1), pivot=(0.1, -0.2, -1)),
}
TILT = np.array([0.8, 0.4, -0.2, 0.4])


def scene(body, momentum=(0.172, -1.862, 1.46), gravity=1.0):
    return kr.Scene(BODIES[body], momentum=momentum, attitude=TILT / np.linalg.norm(TILT), gravity=gravity)


def cases(*, adaptive, **flags):
    """Methods of the kind, each with every body that it applies to."""
    return [
        pytest.param(name, body, id=f"{name}-{body}")
        for name, method in kr.methods.items()
        if method.adaptive == adaptive and all(getattr(method, flag) == value for flag, value in flags.items())
        for body in BODIES
        if method.applies_to(BODIES[body])
    ]


def slope(steps, errors):
    """Of log error over log step, between rounding and where the order does not show yet; None for fewer than three points."""
    good = (errors > 3e-12) & (errors < 3e-2)
    return np.polyfit(np.log(steps[good]), np.log(errors[good]), 1)[0] if good.sum() >= 3 else None


@pytest.mark.parametrize("name, body", cases(adaptive=False))
def test_order(name, body):
    """Measured in q and in m; each must come within 0.2 of the table's, from both sides."""
    t, top = 2.0, scene(body)
    truth = kr.solve(top, t, method="extrap", tol=1e-13)
    steps = t / np.array([20, 40, 80, 160, 320, 640])
    ends = [kr.solve(top, t, method=name, step=h) for h in steps]
    errors_q = np.array([kr.attitude_error(end.q[-1], truth.q[-1]) for end in ends])
    errors_m = np.array([np.linalg.norm(end.m[-1] - truth.m[-1]) for end in ends])
    order = kr.methods[name].order
    for what, errors in {"q": errors_q, "m": errors_m}.items():
        measured = slope(steps, errors)
        assert measured is not None and abs(measured - order) < 0.2, f"{what}: order {measured}, not {order}; {errors}"


@pytest.mark.parametrize("name, body", cases(adaptive=True, exact=False))
def test_tolerance_is_kept(name, body):
    top = scene(body)
    truth = kr.solve(top, 10, method="extrap", tol=1e-13)
    errors = [kr.attitude_error(kr.solve(top, 10, method=name, tol=tol).q[-1], truth.q[-1]) for tol in (1e-6, 1e-9, 1e-12)]
    assert errors[0] < 1e-2 and errors[1] < 1e-5 and errors[2] < 1e-8
    assert errors[0] > errors[1] > errors[2]


@pytest.mark.parametrize("name, body", cases(adaptive=False, reversible=True))
def test_there_and_back(name, body):
    there = kr.solve(scene(body), 30, method=name, step=0.05)
    back = kr.solve(there.scene_at(-1), -30, method=name, step=0.05)
    assert kr.attitude_error(back.q[-1], there.q[0]) < 1e-11
    assert np.abs(back.m[-1] - there.m[0]).max() < 1e-11


@pytest.mark.parametrize("name, body", cases(adaptive=False, symplectic=True))
def test_energy_neither_drifts_nor_grows(name, body):
    """The error of a symplectic method stays within a bound of h^order and has no slope: over four times the run its mean
    moves by less than a part of its amplitude."""
    path = kr.solve(scene(body), 8000, method=name, step=0.05, every=10)
    error = (path.energy - path.energy[0]) / np.abs(path.energy).max()
    quarters = error[1:].reshape(4, -1)
    assert 0 < np.ptp(error) < 2 * 0.05 ** kr.methods[name].order
    assert np.ptp(quarters.mean(axis=1)) < 0.15 * np.ptp(error)
    assert np.ptp(quarters, axis=1).max() < 1.3 * np.ptp(quarters, axis=1).min()


@pytest.mark.parametrize("gravity", [1.0, -3.0])
@pytest.mark.parametrize("step", [0.1, 0.5])
def test_bobenko_suris_keeps_its_integrals(step, gravity):
    path = kr.solve(scene("lagrange", gravity=gravity), 1e6 * step, method="bobenko_suris", step=step, every=1000)
    size = np.abs(path.kinetic + path.potential).max()
    assert np.ptp(path.vertical) == 0
    assert np.ptp(path.axial) < 1e-12
    assert np.ptp(path.modified_energy(step)) < 1e-11 * size
    assert np.ptp(path.energy) > 1e-3 * size


@pytest.mark.parametrize("gravity", [1.0, -3.0])
@pytest.mark.parametrize("step", [0.1, 0.5])
def test_bobenko_suris2_keeps_its_integrals(step, gravity):
    path = kr.solve(scene("lagrange", gravity=gravity), 1e6 * step, method="bobenko_suris2", step=step, every=1000)
    modified = path.energy - step**2 * (path.torque**2).sum(axis=1) / (8 * path.scene.body.moments[0])
    assert np.ptp(path.vertical) == 0
    assert np.ptp(path.axial) < 1e-12
    assert np.ptp(modified) < 1e-11 * np.abs(path.energy).max()
    assert np.ptp(path.energy) > 1e-5 * np.abs(path.energy).max()


def test_the_maps_are_conjugate():
    """Half a kick apart: the axes of bobenko_suris, begun half a kick early, are those of bobenko_suris2."""
    top, h = scene("lagrange"), 0.1
    start = kr.solve(top, [0.0])
    early = top.replace(momentum=start.m[0] - 0.5 * h * start.torque[0])
    one = kr.solve(early, 100 * h, method="bobenko_suris", step=h, every=1)
    two = kr.solve(top, 100 * h, method="bobenko_suris2", step=h, every=1)
    assert np.abs(one.apex - two.apex).max() < 1e-12
    assert np.abs(one.m + 0.5 * h * one.torque - two.m).max() < 1e-12


@pytest.mark.parametrize("body", ["lagrange", "kowalewski", "goryachev_chaplygin"])
def test_strang_turns_a_free_symmetric_body_exactly(body):
    top = scene(body, gravity=0.0)
    one, many = (kr.solve(top, 12.0, method="strang", step=h) for h in (12.0, 0.1))
    assert kr.attitude_error(one.q[-1], many.q[-1]) < 1e-13
    assert np.abs(one.m[-1] - top.momentum).max() < 1e-15


def test_fourth_integrals_are_constant():
    kowalewski = kr.solve(scene("kowalewski"), np.linspace(0, 50, 101), method="extrap", tol=1e-13)
    assert np.ptp(kowalewski.kowalewski) < 1e-9 * kowalewski.kowalewski[0]
    level = scene("goryachev_chaplygin", momentum=(0.172, -1.862, 0.0))
    path = kr.solve(level, np.linspace(0, 50, 101), method="extrap", tol=1e-13)
    assert np.abs(path.goryachev_chaplygin).max() > 1e-3
    assert np.ptp(path.goryachev_chaplygin) < 1e-9
    raised = kr.solve(scene("goryachev_chaplygin"), np.linspace(0, 50, 101), method="extrap", tol=1e-13)
    assert np.ptp(raised.goryachev_chaplygin) > 1e-2


def test_spin_is_exact_for_fast_tops():
    """The total twist is: over a fast upright top the Cayley map alone would lose the angle at once."""
    top = kr.Scene(BODIES["lagrange"], momentum=(0.0, 0.0, 80.0))
    path = kr.solve(top, 10, method="bobenko_suris", step=0.1)
    angle = 80.0 / BODIES["lagrange"].moments[2] * 10 / 2
    assert kr.attitude_error(path.q[-1], (np.cos(angle), 0, 0, np.sin(angle))) < 1e-12


@pytest.mark.parametrize("name", [name for name in kr.methods if not kr.methods[name].applies_to(BODIES["asymmetric"])])
def test_lagrange_methods_refuse_other_bodies(name):
    for body in ("kowalewski", "goryachev_chaplygin", "asymmetric"):
        with pytest.raises(ValueError, match="does not apply"):
            kr.solve(scene(body), 1, method=name, step=0.1)
