"""Tests of tops on turning supports, some against SciPy and Taylor series in decimal arithmetic."""

import math
import pickle

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

multiply, turn, turn_back = kr.quaternion.multiply, kr.quaternion.turn, kr.quaternion.turn_back

TURNING, ABOUT_E3 = (0.3, -0.2, 0.5), (0.0, 0.0, 0.6)
HEAVY = make_scene("general", turning=TURNING)
LAGRANGE = kr.Body(1, (1, 1, 0.5), (0, 0, 0.3))


def rotation(turning, t):
    """Return the rotation of the support up to time `t` as a quaternion."""
    rate = np.linalg.norm(turning)
    return math.cos(rate * t / 2), *(math.sin(rate * t / 2) / rate * np.array(turning))


@pytest.mark.parametrize("end", [2.0, -2.0])
@pytest.mark.parametrize("name", BODIES)
def test_every_method_agrees_with_scipy(name, end):
    compare_methods(make_scene(name, turning=TURNING), end, {"taylor"})
    compare_methods(make_scene(name, turning=TURNING, damping=(0.1, 0.2, 0.3)), end, {"taylor"})
    compare_methods(make_scene(name, turning=ABOUT_E3), end, {"taylor"})


@pytest.mark.parametrize("digits, tolerance", [(None, 1e-14), (20, 1e-18), (30, 1e-27)])
def test_digits_agree_with_decimal_arithmetic(digits, tolerance):
    for name in ("general", "tensor", "lagrange"):
        for damping in (0.0, 0.03):
            scene = make_scene(name, turning=TURNING, damping=damping)
            assert decimal_error(scene, -1.5, digits) < tolerance


@pytest.mark.parametrize("t", [40.0, -40.0])
@pytest.mark.parametrize("name", BODIES)
def test_a_turning_support_equals_a_rotated_support_at_rest(name, t):
    """Compare the motion on a turning support with the rotated motion on a support at rest.

    The support turns about a vertical axis unless gravity is zero.
    """
    for turning, gravity in ((ABOUT_E3, 1.3), (TURNING, 0.0)):
        still = kr.Scene(BODIES[name], **{**START, "gravity": gravity})
        turning_scene = still.replace(turning=turning)
        rest = kr.solve(still, [0.0, t], "taylor", digits=20)
        path = kr.solve(turning_scene, [0.0, t])
        back = rotation(turning, -t)
        growth = 1e-13 + 1e-16 * np.exp(0.5 * abs(t))  # some of these tops are chaotic
        assert kr.attitude_error(path.q[-1], multiply(back, tuple(rest.q[-1]))) < growth
        assert np.abs(path.m[-1] - turn(back, tuple(rest.m[-1]))).max() < growth


def test_quantities_without_the_heading():
    for turning in (TURNING, ABOUT_E3):
        scene, t = make_scene("general", turning=turning), [0.0, 1.0, 3.0]
        whole = kr.solve(scene, t, "taylor")
        few = kr.solve(scene, t, "taylor", want=("nutation", "energy"))
        assert np.abs(few.nutation - whole.nutation).max() < 1e-14
        tops = scene.vary(turning=[turning, (0, 0, 0)])
        many = kr.solve(tops, t, want=("nutation",))
        assert np.abs(many.nutation[0] - whole.nutation).max() < 1e-14
        reductions = kr.reduce(tops, t, {"nutation": "max"})
        assert reductions["nutation"]["max"][0] == pytest.approx(whole.nutation.max(), abs=1e-14)


def list_paths_without_the_heading(scene, t, want, digits, folder):
    """Yield paths with the quantities `want`, from each function that computes or loads paths."""
    words = {"want": want, "digits": digits}
    kr.solve(scene, t, **words).save(folder / "path.npz")
    yield kr.solve(scene, t, **words)
    yield kr.load(folder / "path.npz")
    yield kr.solve(scene, t, digits=digits).only(want)
    yield kr.solve(scene, t, digits=digits, want=("q", *want)).only(want)
    yield kr.start(scene, back=t[-1] < 0.0, **words).to(t)
    yield from kr.stream(scene, t, **words)
    tops = scene.vary(turning=[(0, 0, 0), scene.turning])
    for method in ("auto", "taylor"):
        yield kr.solve(tops, t, method, **words)[1]
        yield kr.solve(tops, t, method, digits=digits)[1].only(want)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("digits", [None, 16, 20])
@pytest.mark.parametrize("want", [("nutation",), ("kinetic", "body_velocity")])
def test_every_path_without_the_heading_is_computed_with_it(want, digits, sign, tmp_path):
    t, middle = [0.0, sign, 2.0 * sign], [1.5 * sign, 0.5 * sign]
    whole = kr.solve(HEAVY, middle[::-1], digits=digits)
    for path in list_paths_without_the_heading(HEAVY, t, want, digits, tmp_path):
        assert path.want == want and path.t.tolist() == t
        for name in want:
            difference = getattr(path(middle), name) - getattr(whole, name)[::-1]
            assert np.abs(difference).max() < 1e-13
        assert path.plan.form.startswith("(q, W, P)")
        assert "attitude" not in dict(path.plan.left_out) | dict(path.plan.kept)


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_plans_without_the_heading_contain_the_attitude(method):
    for tops in (HEAVY, HEAVY.vary(gravity=[1.0, 2.0])):
        plan = kr.plan(tops, want=("nutation",), method=method)
        first = plan if isinstance(tops, kr.Scene) else plan.first
        assert first.form.startswith("(q, W, P)")
        assert "attitude" not in dict(first.left_out) | dict(first.kept)


def test_jacobis_integral_is_conserved():
    for name in BODIES:
        path = kr.solve(make_scene(name, turning=TURNING), np.linspace(0, 20, 101))
        scene, body = path.scene, path.scene.body
        tensor = np.array(body.inertia)
        tensor = np.diag(tensor) if tensor.ndim == 1 else tensor
        body_turning = np.array([turn_back(tuple(q), TURNING) for q in path.q])
        velocity = np.array(path.body_velocity)
        kinetic = 0.5 * np.einsum("ni,ij,nj->n", velocity, tensor, velocity)
        height = np.array([turn(tuple(q), body.com)[2] for q in path.q])
        potential = body.mass * scene.gravity * height - body_turning @ body.rotor
        potential -= 0.5 * np.einsum("ni,ij,nj->n", body_turning, tensor, body_turning)
        assert np.abs(path.kinetic - kinetic).max() < 1e-13
        assert np.abs(path.potential - potential).max() < 1e-13
        assert np.ptp(path.energy) < 1e-13 and np.ptp(path.kinetic) > 1e-3
        assert path.energy_error < 1e-13
        if any(body.com):
            assert np.ptp(path.vertical_momentum) > 1e-2


def test_the_power_balance_with_damping():
    scene = make_scene("tensor", turning=TURNING, damping=(0.02, 0.03, 0.05))
    t = np.linspace(0, 10, 2001)
    path = kr.solve(scene, t)
    axes = np.array([turn(scene.body.axes, e) for e in np.eye(3)])
    power = -((path.body_velocity @ axes.T) ** 2 @ np.array(scene.damping))
    assert path.energy[-1] - path.energy[0] == pytest.approx(integral_of(power, t), abs=1e-11)


def test_velocities_are_relative_to_the_support():
    for name in ("general", "tensor"):
        body = BODIES[name]
        inertia = np.array(body.inertia)
        inertia = np.diag(inertia) if inertia.ndim == 1 else inertia
        q = START["attitude"]
        for word, velocity in (("velocity", (1, 2, 3)), ("body_velocity", (3, -1, 2))):
            scene = kr.Scene(body, **{word: velocity}, attitude=q, turning=TURNING, gravity=1)
            path = kr.solve(scene, [0.0])
            assert np.abs(getattr(path, word) - velocity).max() < 1e-14
            own = turn_back(q, velocity) if word == "velocity" else velocity
            own = inertia @ (np.array(own) + turn_back(q, TURNING)) + body.rotor
            assert np.abs(path.m[0] - turn(q, tuple(own))).max() < 1e-14
            words = {word: [velocity], "turning": [TURNING, (0, 0, 1)]}
            tops = kr.Ensemble(body, attitude=q, gravity=1, **words)
            assert tops[0] == scene
    euler_scene = kr.Scene.from_euler(
        body, (0.3, 1.0, 0.2), (1.0, 0.5, 3.0), turning=TURNING, gravity=1
    )
    assert (
        euler_scene
        == kr.Ensemble.from_euler(
            body, [(0.3, 1.0, 0.2)], (1.0, 0.5, 3.0), turning=TURNING, gravity=1
        )[0]
    )
    t = np.linspace(0, 1e-3, 5)
    angles = kr.solve(euler_scene, t, digits=20).nutation
    assert (angles[1] - angles[0]) / t[1] == pytest.approx(0.5, abs=1e-2)


def test_a_support_at_rest_does_not_change_the_path():
    for scene in (kr.scenes.thesis, kr.scenes.asymmetric):
        still = scene.replace(turning=(0.0, -0.0, 0.0), shaking=(0, 3.0, 1.0), friction=0)
        for method in kr.methods.values():
            if method.suits(scene):
                assert method.suits(still)
                step = {} if method.adaptive else {"step": 0.01}
                one = kr.solve(still, [0, 1.0], method.name, **step)
                other = kr.solve(scene, [0, 1.0], method.name, **step)
                assert one.states.tobytes() == other.states.tobytes(), method.name


def test_members_of_an_ensemble_equal_single_tops():
    tops = HEAVY.vary(turning=[(0.1, 0.2, 0.3), (0, 0, 0.4), (1, 0, 0)], velocity=(0.3, 0, -0.2))
    expected = {**START, "momentum": None}
    assert tops[0] == kr.Scene(
        BODIES["general"], **expected, velocity=(0.3, 0, -0.2), turning=(0.1, 0.2, 0.3)
    )
    assert kr.Ensemble.of([tops[0], tops[1]])[1] == tops[1] == kr.Source.of(tops)[1]
    assert pickle.loads(pickle.dumps(tops)) == tops and tops.coords["turning"].shape == (3, 3)
    check_members(tops, [0.0, 1.0])
    check_members(tops, [0.0, -1.0], digits=20)
    grid = kr.Source.grid(HEAVY, turning=[(0, 0, 1), (0, 1, 0)], gravity=[1.0, 2.0])
    assert grid[1].turning == (0, 0, 1) and grid[2].turning == (0, 1, 0)
    assert HEAVY.scatter(2, momentum=0.1)[1].turning == TURNING
    plan = kr.plan(tops, [0.0, 1.0])
    assert plan.closed_form + plan.lanes + plan.alone == 3


def test_runs_are_resumed_and_changed():
    check_resumed(HEAVY, [{"method": "taylor"}, {"method": "taylor", "digits": 30}])
    run = kr.start(HEAVY)
    before = run.to([1.0])
    run.change(turning=(0, 0, 2.0))
    after = run.to([1.0, 1.5])
    assert np.abs(after.m[0] - before.m[0]).max() == 0.0
    change = np.array(TURNING) - (0, 0, 2.0)
    assert np.abs(after.velocity[0] - before.velocity[0] - change).max() < 1e-14
    expected = kr.solve(before.end.replace(turning=(0, 0, 2.0)), [0.5])
    assert np.abs(after.q[-1] - expected.q[-1]).max() < 1e-14


@pytest.mark.parametrize("back", [False, True])
def test_a_run_without_heading_is_resumed_after_the_support_stops(back):
    sign, run = -1.0 if back else 1.0, kr.start(HEAVY, want=("nutation",), back=back)
    run.to(sign)
    run.change(turning=(0, 0, 0))
    assert dict(run.plan.kept)["attitude"] == "the support turned at the start of the run"
    copy = kr.resume(run.checkpoint)
    for one in (run, copy):
        one.push((0.1, 0.2, 0.3))
    assert run.to([1.5 * sign]).nutation == copy.to([1.5 * sign]).nutation
    for one in (run, copy):
        one.change(turning=TURNING)
    assert run.to([2.0 * sign]).nutation == kr.resume(copy.checkpoint).to([2.0 * sign]).nutation


def test_toml_and_archives_contain_the_turning(tmp_path):
    assert kr.Scene.from_toml(HEAVY.to_toml()) == HEAVY and "turning" in repr(HEAVY)
    assert (
        "turning" not in repr(HEAVY.replace(turning=None)) + HEAVY.replace(turning=None).to_toml()
    )
    assert HEAVY.replace(turning=None) != HEAVY and eval(repr(HEAVY), vars(kr)) == HEAVY
    kr.solve(HEAVY, [0.0, 1.0]).save(tmp_path / "path.npz")
    assert kr.load(tmp_path / "path.npz").scene == HEAVY
    start = "[spinning]\nspin = 9\ngravity = 1\nturning = [0, 0, 1]\n"
    body = "[body.cone]\nradius = 1\nheight = 2\npivot = [0, 0, 0]\nmass = 1\n"
    scene = kr.Scene.from_toml(start + body)
    assert scene.turning == (0, 0, 1) and kr.solve(scene, [0.0]).spin[0] == pytest.approx(9.0)


@pytest.mark.parametrize("digits", [16, 30])
def test_tangents_agree_with_differences(digits):
    for name in ("general", "tensor"):
        scene = make_scene(name, turning=TURNING, damping=(0.1, 0.2, 0.3))
        compare_tangents(scene, 2.0, unit_changes(scene, "turning"), digits)
        compare_tangents(scene, 2.0, unit_changes(scene, "damping"), digits)


def test_conditioning_includes_the_turning():
    every = ("start", "moments", "com", "gravity", "mass", "turning")
    path = kr.solve(HEAVY, [0.0, 2.0], "taylor", tangents=every)
    assert 1e-16 < path.conditioning[-1] < 1e-13
    fixed = kr.solve(HEAVY.replace(turning=None), [0.0, 2.0], "taylor", tangents=every[:-1])
    assert 1e-16 < fixed.conditioning[-1] < 1e-13
    less = kr.solve(HEAVY, [0.0, 2.0], "taylor", tangents=every[:-1])
    with pytest.raises(
        AttributeError,
        match=r"no 'conditioning': solve with tangents .* all parameters that are not 0$",
    ):
        less.conditioning  # noqa: B018
    assert kr.solve(HEAVY, [0.0, 5.0]).error < 1e-13


@pytest.mark.parametrize("turning", [(math.nan, 0, 0), (0, math.inf, 0), "x", (1, 2), 1.0])
def test_invalid_turning_is_refused(turning):
    for make in (
        lambda: HEAVY.replace(turning=turning),
        lambda: HEAVY.vary(turning=turning),
        lambda: kr.Ensemble(HEAVY.body, momentum=(0, 0, 1), turning=turning, gravity=1),
        lambda: kr.Scene.from_euler(HEAVY.body, (0, 1, 0), turning=turning, gravity=1),
        lambda: kr.Source.grid(HEAVY, turning=[turning, turning]),
        lambda: kr.start(HEAVY).change(turning=turning),
    ):
        with pytest.raises((TypeError, ValueError), match="turning"):
            make()


@pytest.mark.parametrize("name", ["lagrange", "axial rotor", "free symmetric", "kowalewski"])
@pytest.mark.parametrize("times", [[0.5, 9.0], [-2.0]])
def test_an_ensemble_chooses_the_method_of_a_single_top(name, times):
    top = make_scene(name, turning=ABOUT_E3)
    members = kr.solve(top.vary(gravity=[1.3, 0.0]), times)
    for member, gravity in zip(members, (1.3, 0.0), strict=True):
        single = kr.solve(top.replace(gravity=gravity), times)
        assert member.method == single.method
        assert np.array_equal(member.states, single.states)


def test_functions_without_turning_supports_refuse_them():
    path = kr.solve(HEAVY, np.linspace(0, 10, 101))
    for call in (
        *list_unsupported_calls(HEAVY, path),
        lambda: kr.solve(
            kr.Scene(LAGRANGE, **START, turning=TURNING), 1.0, "bobenko_suris", step=0.1
        ),
        lambda: kr.events.separatrix(HEAVY),
        lambda: kr.solve(HEAVY, 1.0, events=[kr.events.kinetic(1.0)]),
        lambda: kr.Scene.spinning(
            LAGRANGE, spin=9.0, tilt=0.3, steady=True, turning=TURNING, gravity=1
        ),
        lambda: kr.Scene(LAGRANGE, **START).vary(spin=[9.0], steady=True, turning=TURNING),
        lambda: kr.exact(kr.Scene(LAGRANGE, **START, turning=ABOUT_E3)),
        lambda: kr.exact(kr.Scene(LAGRANGE, **START).vary(turning=[ABOUT_E3, (0, 0, 1)])),
        lambda: kr.apex(kr.solve(make_scene("lagrange", turning=TURNING), path.t)).nutation(),
    ):
        with pytest.raises(ValueError, match=r"\bturning\b"):
            call()


def test_error_messages_name_an_alternative():
    upright = make_scene("lagrange", turning=ABOUT_E3)
    path = kr.solve(upright, np.linspace(0, 10, 101))
    for call in (
        lambda: kr.exact(upright),
        lambda: kr.lyapunov(upright, 10.0),
        lambda: kr.megno(upright.vary(mass=[1.0, 2.0]), 10.0),
        lambda: kr.rod(path),
        lambda: kr.apex(path).nutation(),
        lambda: kr.events.separatrix(upright),
        lambda: kr.solve(upright, 1.0, "geometric", error=1e-3),
    ):
        with pytest.raises(ValueError, match=r"replace\(turning=None\) gives the same motion"):
            call()
    for call, instead in (
        (lambda: kr.lyapunov(HEAVY, 10.0), "tangents='start'"),
        (lambda: kr.solve(HEAVY, 1.0, "geometric", error=1e-3), "method='taylor'"),
        (lambda: kr.events.separatrix(HEAVY), r"kr.events.nutation\(\)"),
    ):
        with pytest.raises(ValueError, match=instead):
            call()


@pytest.mark.parametrize("loss", [{"damping": (0.1, 0.2, 0.3)}, {"friction": 0.3}])
def test_messages_suggest_a_support_at_rest_only_without_damping_and_friction(loss):
    words = {"turning": (0, 0, 8.0), **loss}
    upright, heavy = make_scene("lagrange", **words), make_scene("kowalewski", **words)
    here, at_rest = (kr.solve(s, [3.0]) for s in (upright, upright.replace(turning=None)))
    assert abs(here.nutation[0] - at_rest.nutation[0]) > 1e-3
    path = kr.solve(upright, np.linspace(0, 1, 101))
    for call in (
        lambda: kr.exact(upright),
        lambda: kr.exact(heavy),
        lambda: kr.exact(upright.vary(mass=[1.0, 2.0])),
        lambda: kr.exact([upright.replace(damping=None, friction=None), upright]),
        lambda: kr.lyapunov(upright, 10.0),
        lambda: kr.rod(path),
        lambda: kr.apex(path).nutation(),
        lambda: kr.events.separatrix(upright),
        lambda: kr.solve(upright, 1.0, "geometric", error=1e-3),
    ):
        with pytest.raises(ValueError, match=r"turning support|damp|friction") as error:
            call()
        assert "replace(turning=None)" not in str(error.value)


def find_refusal(scene, method):
    """Return the message with which kr.solve refuses `method`, or an empty string."""
    words = {} if kr.methods[method].adaptive else {"step": 0.1}
    try:
        kr.solve(scene, 0.1, method, **words)
    except ValueError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("gravity", [1.3, 0.0])
def test_refusals_of_methods_name_the_true_reason(name, gravity):
    """Check that a support that turns about e3 is never the stated reason, in contrast to others.

    A method without the property `turning` applies to such a support if it applies at rest.
    """
    still = make_scene(name).replace(gravity=gravity)
    for method, properties in kr.methods.items():
        for environment in ({}, {"friction": 0.1}, {"damping": 0.1}, {"shaking": (0.1, 3.0, 0.0)}):
            scene = still.replace(**environment)
            upright = find_refusal(scene.replace(turning=ABOUT_E3), method)
            assert upright == find_refusal(scene, method), (method, environment)
        for turning in ((0.0, 0.6, 0.0), TURNING):
            tilted = find_refusal(still.replace(turning=turning), method)
            reason = "it is for tops whose support does not turn, or turns about e3; these apply"
            assert (reason in tilted) != properties.turning, method


def test_refusals_on_a_support_that_turns_about_e3_describe_the_body():
    upright = make_scene("lagrange", turning=ABOUT_E3)
    expected = "of kind 'lagrange': it is for bodies with the centre of mass at the fixed point; th"
    for tops in (upright, upright.vary(mass=[1.0, 2.0])):
        with pytest.raises(ValueError, match=expected):
            kr.solve(tops, 1.0, "hirota_kimura", step=0.1)
    falling = kr.Scene(
        LAGRANGE, attitude=(1, 1e-80, 0, 0), momentum=(0, 0, 0), turning=ABOUT_E3, gravity=1
    )
    assert "whose initial tilt and velocity are below" in find_refusal(falling, "exact")


@pytest.mark.parametrize("moment", [2.0, 4.0])  # of a Kowalewski and of a Goryachev-Chaplygin top
@pytest.mark.parametrize("momentum", [(0.4, -0.5, 0.0), (0.4, -0.5, 0.9)])
def test_plans_name_the_true_reason_on_a_support_that_turns_about_e3(moment, momentum):
    body = kr.Body(1, (moment, moment, 1), (0.7, 0, 0), unphysical=True)
    scene = kr.Scene(body, **START | {"momentum": momentum})
    why = kr.plan(scene.replace(turning=ABOUT_E3), 1.0).why
    if kr.methods["exact"].suits(scene):
        assert "on turning supports; the method 'exact' takes the closed form" in why
    else:
        assert why == kr.plan(scene, 1.0).why and "vertical component" in why
