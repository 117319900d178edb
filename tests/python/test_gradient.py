"""Tests of bodies in a gravity gradient; tests/truths.json has true states of such bodies."""

import kreisel as kr
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

BODY = kr.Body(1, (0.9, 1.0, 0.4), (0, 0, 0))
ORBIT = {"gradient": 3.0, "turning": (0.0, 1.0, 0.0)}
TOP = kr.Scene(
    kr.Body(1.2, (1.3, 2.1, 1.7), (0.2, -0.3, 0.4), unphysical=True),
    momentum=(0.4, -0.5, 0.9),
    attitude=(0.5, 0.5, -0.5, 0.5),
    gravity=1.3,
    gradient=2.0,
    turning=(0.3, -0.2, 0.4),
)


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0), (2, 0, 1)])
def test_small_librations_have_their_frequencies(order):
    """Check pitch, and the coupled motions of roll and yaw, in every order of axes."""
    a, b, c = 0.9, 1.0, 0.4
    axes = np.eye(3)[list(order)]  # roll, pitch and yaw in the frame of description
    body = kr.Body(1, np.array((a, b, c)) @ axes, (0, 0, 0))
    upright, t = Rotation.from_matrix(axes), np.linspace(0, 400, 4001)
    roll, yaw = (b - c) / a, (b - a) / c
    half, product = 0.5 * (1 + 3 * roll + roll * yaw), 4 * roll * yaw
    squares = half + np.sqrt(half**2 - product) * np.array((1, -1))
    for i, frequencies in (1, [np.sqrt(3 * (a - c) / b)]), (0, np.sqrt(squares)):
        attitude = Rotation.from_rotvec(1e-5 * np.eye(3)[i]) * upright
        path = kr.solve(kr.Scene(body, attitude=attitude, velocity=(0, 0, 0), **ORBIT), t)
        angle = (path.rotation * upright.inv()).as_rotvec()[:, i]
        waves = np.stack([f(w * t) for w in frequencies for f in (np.cos, np.sin)], axis=1)
        rest = angle - waves @ np.linalg.lstsq(waves, angle, rcond=None)[0]
        assert np.abs(rest).max() < 1e-6 * np.abs(angle).max()
        assert np.ptp(path.energy) < 1e-13


def test_tangents_are_the_derivatives_of_paths():
    names = ["start", "moments", "com", "gravity", "rotor", "turning", "gradient"]
    path = kr.solve(TOP, [1.0], tangents=names)

    def shift(name, step):
        if name in ("moments", "com", "rotor"):
            word = {"moments": "inertia"}.get(name, name)
            return TOP.vary(**{word: np.array(getattr(TOP.body, word)) + step})
        return TOP.vary(**{name: np.array(getattr(TOP, name)) + step})

    column = 6
    for name in names[1:]:
        width = 1 if name in ("gravity", "gradient") else 3
        for step in 1e-5 * np.eye(width):
            step = step if width == 3 else step[0]
            ends = [kr.solve(shift(name, sign * step), [1.0], digits=20) for sign in (1, -1)]
            for quantity in ("m", "energy", "torque", "body_acceleration", "pivot_force"):
                slope = (getattr(ends[0], quantity) - getattr(ends[1], quantity))[0] / 2e-5
                found = path.derivative(quantity)[0, ..., column]
                assert np.abs(found - slope).max() < 1e-8, (name, quantity)
            column += 1


def test_the_support_carries_a_set_of_point_masses():
    rng = np.random.default_rng(3)
    places, masses = rng.normal(size=(5, 3)), rng.uniform(0.2, 1.0, 5)
    lever, turning = masses @ places, (0, -0.4, 0)
    inertia = sum(
        m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, places, strict=True)
    )
    body = kr.Body(masses.sum(), inertia, lever / masses.sum())
    top = kr.Scene(body, (0.3, -0.5, 1), gravity=2.0, gradient=1.7, turning=turning)
    path = kr.solve(top, [0.0, 0.7])
    forces = np.array([path.rotation.apply(path.specific_force(r)) for r in places])
    pulls = masses[:, None, None] * forces
    moments = np.cross([path.position(r) for r in places], pulls)
    np.testing.assert_allclose(path.pivot_force, pulls.sum(axis=0), rtol=0, atol=1e-13)
    np.testing.assert_allclose(moments.sum(axis=0), 0.0, rtol=0, atol=1e-13)


def test_gradients_are_refused_by_name_where_they_have_no_meaning():
    with pytest.raises(ValueError, match="a gravity gradient excludes a shaken support"):
        TOP.replace(shaking=(0.1, 5, 0))
    with pytest.raises(ValueError, match="and wheels on free axles"):
        kr.Scene(
            BODY.with_wheel(inertia=0.1, axis=(1, 0, 0), rate=1), momentum=(0, 0, 1), gradient=3
        )
    for method in ("exact", "takahashi_imada4", "bobenko_suris", "veselov2", "hirota_kimura"):
        with pytest.raises(ValueError, match="a gravity gradient"):
            kr.solve(
                TOP.replace(turning=None),
                1.0,
                method,
                **({} if method == "exact" else {"step": 0.1}),
            )
    with pytest.raises(ValueError, match="gravity gradient"):
        kr.exact(TOP.replace(turning=None))


def test_many_bodies_files_fits_and_events_know_the_gradient(tmp_path):
    tops = TOP.vary(gradient=[0.0, 1.0, 2.0])
    paths = kr.solve(tops, np.linspace(0, 1, 5))
    assert tops.axes == ("gradient",) and tops[2] == TOP
    assert kr.Scene.from_toml(tops.to_toml()) == tops and kr.Scene.stack(list(tops)) == tops
    assert (paths[2].q == kr.solve(TOP, np.linspace(0, 1, 5)).q).all()
    run = kr.start(TOP)
    run.to(0.5)
    run.save(tmp_path / "top.run")
    again = kr.resume(tmp_path / "top.run").to(1.0)
    assert (again.q[-1] == run.to(1.0).q[-1]).all() and again.scene.gradient == 2.0
    t = np.linspace(0, 4, 200)
    record = kr.Record(t, {"q": kr.solve(TOP, t).q}, sigma=1e-4)
    fit = kr.fit(TOP.replace(gradient=1.7), record, free=["gradient"])
    assert fit.scene.gradient == pytest.approx(2.0, abs=1e-6)
    turned = kr.solve(TOP, [0, 5], events=kr.events.nutation()).events.path
    falling = np.cross(turned.velocity, turned.apex)[:, 2]
    assert len(turned) > 1 and np.abs(falling).max() < 1e-13
