"""Tests of supports that turn or shake: laws of mechanics, derivatives, and what refuses them."""

import math
from dataclasses import replace

import kreisel as kr
import numpy as np
import pytest

multiply, turn, turn_back = kr.quaternion.multiply, kr.quaternion.turn, kr.quaternion.turn_back

TURNING, ABOUT_E3, SHAKING = (0.3, -0.2, 0.5), (0.0, 0.0, 0.6), (0.2, 5.0, 0.3)
START = {"momentum": (0.4, -0.5, 0.9), "attitude": (0.5, 0.5, -0.5, 0.5), "gravity": 1.3}
TENSOR, ROTOR = [[1.3, 0.1, 0.2], [0.1, 1.8, -0.1], [0.2, -0.1, 2.0]], (0.3, -0.4, 0.8)
LAGRANGE = kr.Body(1.2, (1.3, 1.3, 1.7), (0, 0, 0.4), unphysical=True)
BODIES = {
    "general": kr.Body(1.2, (1.3, 2.1, 1.7), (0.2, -0.3, 0.4), unphysical=True),
    "tensor": kr.Body(1.2, TENSOR, (0.2, -0.3, 0.4), unphysical=True, rotor=ROTOR),
    "free": kr.Body(1.2, (1.3, 2.1, 1.7), (0, 0, 0), rotor=ROTOR),
    "free symmetric": kr.Body(1.2, (1.7, 1.3, 1.3), (0, 0, 0)),
    "lagrange": kr.Body(1.2, (1.3, 1.7, 1.3), (0, 0.4, 0), unphysical=True),
    "axial rotor": kr.Body(1.2, (1.3, 1.3, 1.7), (0, 0, 0.4), unphysical=True, rotor=(0, 0, 0.7)),
    "kowalewski": kr.Body(1, (2, 2, 1), (0.7, 0, 0), unphysical=True),
    "spherical": kr.Body(1.2, (1.3, 1.3, 1.3), (0.3, 0.4, 0.5), unphysical=True),
}
TURNED = kr.Scene(BODIES["general"], **START, turning=TURNING)
SHAKEN = kr.Scene(BODIES["general"], **START, shaking=SHAKING)


def to_matrix(inertia):
    inertia = np.array(inertia)
    return np.diag(inertia) if inertia.ndim == 1 else inertia


@pytest.mark.parametrize("t", [40.0, -40.0])
@pytest.mark.parametrize("name", BODIES)
def test_a_turning_support_equals_a_rotated_support_at_rest(name, t):
    """Check supports that turn about the vertical, or about any axis without gravity."""
    for turning, gravity in ((ABOUT_E3, 1.3), (TURNING, 0.0)):
        still = kr.Scene(BODIES[name], **{**START, "gravity": gravity})
        rest = kr.solve(still, [t], "taylor", digits=20)
        path, rate = kr.solve(still.replace(turning=turning), [t]), np.linalg.norm(turning)
        axis = math.sin(-rate * t / 2) / rate * np.array(turning)
        back = (math.cos(rate * t / 2), *axis)
        growth = 1e-13 + 1e-16 * np.exp(0.5 * abs(t))  # some of these tops are chaotic
        assert kr.attitude_error(path.q[-1], multiply(back, tuple(rest.q[-1]))) < growth
        assert np.abs(path.m[-1] - turn(back, tuple(rest.m[-1]))).max() < growth


@pytest.mark.parametrize("name", BODIES)
def test_jacobis_integral_is_conserved(name):
    path = kr.solve(kr.Scene(BODIES[name], **START, turning=TURNING), np.linspace(0, 20, 101))
    scene, body, tensor = path.scene, path.scene.body, to_matrix(path.scene.body.inertia)
    turning = np.array([turn_back(tuple(q), TURNING) for q in path.q])
    kinetic = 0.5 * np.einsum("ni,ij,nj->n", path.body_velocity, tensor, path.body_velocity)
    height = np.array([turn(tuple(q), body.com)[2] for q in path.q])
    potential = body.mass * scene.gravity * height - turning @ body.rotor
    potential -= 0.5 * np.einsum("ni,ij,nj->n", turning, tensor, turning)
    assert np.abs(path.kinetic - kinetic).max() < 1e-13
    assert np.abs(path.potential - potential).max() < 1e-13
    assert np.ptp(path.energy) < 1e-13 and np.ptp(path.kinetic) > 1e-3
    assert path.energy_error < 1e-13
    if any(body.com):
        assert np.ptp(path.vertical_momentum) > 1e-2


@pytest.mark.parametrize(
    "effect", [{"turning": TURNING}, {"shaking": SHAKING}, {"friction": 0.05}, {"turning": None}]
)
def test_the_energy_changes_by_the_power_of_damping_friction_and_shaking(effect):
    body, t = BODIES["tensor"], np.linspace(0, 3, 2001)
    words = START | {"momentum": None, "body_velocity": (1.0, -2.0, 2.5)} | effect
    scene = kr.Scene(body, **words, damping=(0.02, 0.03, 0.05))
    path = kr.solve(scene, t)
    axes = np.array([turn(body.axes, e) for e in np.eye(3)])
    power = -((path.body_velocity @ axes.T) ** 2 @ np.array(scene.damping))
    power -= scene.friction * np.abs(path.spin)
    amplitude, rate, phase = scene.shaking
    height = path.apex[:, 2] * np.linalg.norm(body.com) * body.mass
    power += amplitude * rate**3 * np.sin(rate * t + phase) * height
    work = ((power[1:-1:2] * 4 + power[:-2:2] + power[2::2]) * t[1] / 3).sum()  # by Simpson's rule
    assert path.energy[-1] - path.energy[0] == pytest.approx(work, abs=1e-10)
    assert math.isnan(path.energy_error)


@pytest.mark.parametrize("name", ["general", "tensor"])
@pytest.mark.parametrize("word, velocity", [("velocity", (1, 2, 3)), ("body_velocity", (3, -1, 2))])
def test_velocities_are_relative_to_the_support(name, word, velocity):
    body, words = BODIES[name], {"attitude": START["attitude"], "gravity": 1}
    scene = kr.Scene(body, **{word: velocity}, **words, turning=TURNING)
    path = kr.solve(scene, [0.0])
    assert np.abs(getattr(path, word) - velocity).max() < 1e-14
    own = turn_back(scene.attitude, velocity) if word == "velocity" else velocity
    own = to_matrix(body.inertia) @ (np.array(own) + turn_back(scene.attitude, TURNING))
    assert np.abs(path.m[0] - turn(scene.attitude, tuple(own + body.rotor))).max() < 1e-14
    tops = kr.Scene(body, **{word: [velocity]}, turning=[TURNING, (0, 0, 1)], **words)
    assert tops[0] == scene


def test_rates_of_euler_angles_are_relative_to_the_support():
    angles, rates = (0.3, 1.0, 0.2), (1.0, 0.5, 3.0)
    words = {"turning": TURNING, "gravity": 1}
    scene = kr.Scene.from_euler(BODIES["general"], angles, rates, **words)
    assert scene == kr.Scene.from_euler(BODIES["general"], [angles], rates, **words)[0]
    nutation = kr.solve(scene, [0.0, 1e-4], digits=20).nutation
    assert (nutation[1] - nutation[0]) / 1e-4 == pytest.approx(0.5, abs=1e-3)


def test_effects_of_zero_do_not_change_the_path():
    for scene in (kr.scenes.thesis, kr.scenes.asymmetric):
        zeros = {"turning": (0.0, -0.0, 0.0), "shaking": (0, 3.0, 1.0), "friction": 0, "damping": 0}
        body = replace(scene.body, rotor=(-0.0, 0.0, -0.0))
        still = scene.replace(body=body, **zeros)
        assert still.body == scene.body and still.body.kind == scene.body.kind
        for method in kr.methods.values():
            assert method.suits(scene) == method.suits(still)
            if method.suits(scene):
                step = {} if method.adaptive else {"step": 0.01}
                paths = [kr.solve(s, [0, 1.0], method.name, **step) for s in (still, scene)]
                assert paths[0].states.tobytes() == paths[1].states.tobytes(), method.name


@pytest.mark.parametrize("name", BODIES)
def test_methods_apply_to_supports_that_turn_about_the_vertical_as_to_those_at_rest(name):
    for words in ({}, {"friction": 0.1}, {"damping": 0.1}, {"shaking": SHAKING}, {"gravity": 0}):
        still = kr.Scene(BODIES[name], **START | words)
        upright, tilted = (still.replace(turning=turning) for turning in (ABOUT_E3, TURNING))
        for method in kr.methods.values():
            assert method.suits(upright) == method.suits(still) or method.name == "exact"
            assert method.suits(tilted) == (method.suits(still) and method.turning)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("want", [("nutation",), ("kinetic", "body_velocity")])
def test_paths_without_the_heading_are_computed_with_it(want, sign):
    t, middle = [0.0, sign, 2.0 * sign], [1.5 * sign, 0.5 * sign]
    whole = kr.solve(TURNED, middle[::-1])
    tops = TURNED.vary(turning=[(0, 0, 0), TURNING])
    for path in (kr.solve(TURNED, t, want=want), kr.solve(tops, t, want=want)[1]):
        assert "attitude" not in dict(path.plan.left_out) | dict(path.plan.kept)
        for name in want:
            difference = getattr(path(middle), name) - getattr(whole, name)[::-1]
            assert np.abs(difference).max() < 1e-13
    reductions = kr.reduce(tops, t, {"kinetic": "max"})
    expected = kr.solve(TURNED, t).kinetic.max()
    assert reductions["kinetic"]["max"][1] == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("back", [False, True])
def test_a_run_without_heading_is_resumed_after_the_support_stops(back):
    sign, run = -1.0 if back else 1.0, kr.start(TURNED, want=("nutation",), back=back)
    run.to(sign)
    run.change(turning=(0, 0, 0))
    copy = kr.resume(run.checkpoint)
    for one in (run, copy):
        one.push((0.1, 0.2, 0.3))
    assert run.to([1.5 * sign]).nutation == copy.to([1.5 * sign]).nutation
    for one in (run, copy):
        one.change(turning=TURNING)
    assert run.to([2.0 * sign]).nutation == kr.resume(copy.checkpoint).to([2.0 * sign]).nutation


def test_a_change_of_the_turning_keeps_the_momentum():
    run = kr.start(TURNED)
    before = run.to([1.0])
    run.change(turning=(0, 0, 2.0))
    after = run.to([1.0, 1.5])
    assert not np.abs(after.m[0] - before.m[0]).any()
    change = np.array(TURNING) - (0, 0, 2.0)
    assert np.abs(after.velocity[0] - before.velocity[0] - change).max() < 1e-14
    expected = kr.solve(before.end.replace(turning=(0, 0, 2.0)), [0.5])
    assert np.abs(after.q[-1] - expected.q[-1]).max() < 1e-14


def test_the_phase_is_accurate_at_late_times():
    rate, phase, t = 20.0, 0.3, 1000.0
    ball = kr.Body(1.0, (1.0, 1.0, 1.0), (0, 0, 0.3), unphysical=True)
    scene = kr.Scene(ball, momentum=(0, 0, 1), gravity=0.0, shaking=(1e-3, rate, phase))
    path = kr.solve(scene, [t])
    pull = -1e-3 * rate**2 * math.cos(rate * t + phase)
    assert path.potential[-1] == pytest.approx(0.3 * pull * path.apex[-1, 2], rel=1e-12)


@pytest.mark.parametrize("spin", [0.0, 3.0])
def test_the_stability_limit_agrees_with_the_averaged_motion(spin):
    """Compare with Kapitza's condition (I3 spin)^2 + 2 (m l A r)^2 = 4 I1 m g l."""
    body, rate = kr.Body(1.0, (1.0, 1.0, 0.3), (0, 0, 0.5), unphysical=True), 400.0
    border = math.sqrt((4.0 * 9.81 * 0.5 - (0.3 * spin) ** 2) / 2.0) / (0.5 * rate)
    greatest = []
    for shaking in ((0.95 * border, rate, 0.0), (1.05 * border, rate, 0.0), None):
        top = kr.Scene.spinning(body, spin, tilt=1e-3, gravity=9.81, shaking=shaking)
        greatest.append(kr.solve(top, np.linspace(0, 15, 400)).nutation.max())
    assert greatest[0] > 0.5 and greatest[1] < 0.02 and greatest[2] > 0.5


def test_scenes_grids_and_sweeps_keep_the_components(tmp_path):
    pytest.importorskip("pyarrow")
    for scene, name in ((TURNED, "turning"), (SHAKEN, "shaking")):
        plain = scene.replace(**{name: None})
        assert kr.Scene.from_toml(scene.to_toml()) == eval(repr(scene), vars(kr)) == scene != plain
        assert name in scene.to_toml() and name not in plain.to_toml() + repr(plain)
    values = [(0.1, 2.0, 0.0), (0.2, 7.0, 1.0)]
    source = kr.Source.grid(SHAKEN, shaking=values, gravity=[1.0, 2.0])
    assert source[1].shaking == values[0] and source[2].shaking == values[1]
    sweep = kr.sweep(source, [1.0], folder=tmp_path / "swept", want=("nutation",))
    assert np.ravel(sweep["shaking_rate"]).tolist() == [2.0, 2.0, 7.0, 7.0]
    assert sweep.units["shaking_amplitude"] == "L" and sweep.units["shaking_rate"] == "rad/T"


@pytest.mark.parametrize("effect", [{"turning": TURNING}, {"friction": 0.05}])
def test_conditioning_needs_the_tangents_by_all_parameters(effect):
    scene = kr.Scene(BODIES["general"], **START, **effect)
    names = ("start", "moments", "com", "gravity", "mass")
    with pytest.raises(AttributeError, match="not 0"):
        _ = kr.solve(scene, [2.0], "taylor", tangents=names).conditioning
    path = kr.solve(scene, [2.0], "taylor", tangents=(*names, *effect))
    assert 1e-16 < path.conditioning[-1] < 1e-13


def list_unsupported_calls(scene, name, value):
    """Yield calls that are refused because the support moves."""
    path, upright = kr.solve(scene, np.linspace(0, 10, 101)), LAGRANGE
    yield lambda: kr.exact(scene)
    yield lambda: kr.solve(scene, 1.0, "exact")
    yield lambda: kr.solve(scene, 1.0, "takahashi_imada4", step=0.1)
    yield lambda: kr.solve(scene, 1.0, "geometric", error=1e-3)
    yield lambda: kr.rod(path)
    yield lambda: kr.frequencies(path)
    yield lambda: kr.events.separatrix(scene)
    words = {"spin": 9.0, "tilt": 0.3, "steady": True, "gravity": 1, name: value}
    yield lambda: kr.Scene.spinning(upright, **words)
    words = {**START, name: value}
    yield lambda: kr.solve(kr.Scene(upright, **words), 1.0, "bobenko_suris", step=0.1)
    for bad in ((math.nan, 1, 0), (0.1, 1, math.inf), "x", (1, 2), 1.0):
        yield lambda bad=bad: scene.replace(**{name: bad})
        yield lambda bad=bad: scene.vary(**{name: bad})
        yield lambda bad=bad: kr.start(scene).change(**{name: bad})
        yield lambda bad=bad: kr.Scene(scene.body, (0, 0, 1), gravity=1, **{name: bad})
        yield lambda bad=bad: kr.Scene.from_euler(upright, (0, 1, 0), gravity=1, **{name: bad})


@pytest.mark.parametrize("scene, name", [(TURNED, "turning"), (SHAKEN, "shaking")])
def test_bad_arguments_and_functions_for_supports_at_rest_are_refused(scene, name):
    calls = list(list_unsupported_calls(scene, name, getattr(scene, name)))
    if name == "turning":
        calls.append(lambda: kr.solve(scene, 1.0, events=[kr.events.kinetic(1.0)]))
        calls.append(
            lambda: kr.Scene(LAGRANGE, **START).vary(spin=[9.0], steady=True, turning=TURNING)
        )
        calls.append(lambda: kr.exact(kr.Scene(LAGRANGE, **START, turning=ABOUT_E3)))
    else:
        calls.append(lambda: scene.replace(shaking=(0.1, 0, 0)))
    for call in calls:
        with pytest.raises((TypeError, ValueError), match=name[:4]):
            call()
