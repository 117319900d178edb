"""Tests of bodies with rotors."""

import math
from dataclasses import replace

import kreisel as kr
import numpy as np
import pytest
from decimal_series import decimal_error
from moving_tops import START, compare_methods, compare_tangents, integral_of

turn, turn_back, multiply = kr.quaternion.turn, kr.quaternion.turn_back, kr.quaternion.multiply

ROTOR = (0.3, -0.4, 0.8)
GENERAL = kr.Body(1.2, (1.3, 2.1, 1.7), (0.2, -0.3, 0.4), unphysical=True, rotor=ROTOR)
TENSOR = kr.Body(
    1.2,
    [[1.3, 0.1, 0.2], [0.1, 1.8, -0.1], [0.2, -0.1, 2.0]],
    (0.2, -0.3, 0.4),
    unphysical=True,
    rotor=ROTOR,
)
BODIES = {
    "general": GENERAL,
    "largest N": replace(GENERAL, inertia=(2.1, 1.3, 1.7)),
    "largest T": replace(GENERAL, inertia=(1.3, 1.7, 2.1)),
    "tensor": TENSOR,
    "free": replace(GENERAL, com=(0, 0, 0)),
    "kowalewski": kr.Body(1, (2, 2, 1), (0.7, 0, 0), unphysical=True, rotor=(0, 0, 0.5)),
    "lagrange": kr.Body.symmetric(1.2, 1.3, 1.7, 0.4, unphysical=True),
    "free symmetric": kr.Body(1.2, (1.7, 1.3, 1.3), (0, 0, 0), rotor=ROTOR),
    "spherical": kr.Body(1.2, (1.3, 1.3, 1.3), (0.3, 0.4, 0.5), unphysical=True, rotor=ROTOR),
}
BODIES["lagrange"] = replace(BODIES["lagrange"], rotor=ROTOR)
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


@pytest.mark.parametrize("end", [2.0, -2.0])
@pytest.mark.parametrize("name", BODIES)
def test_every_method_agrees_with_scipy(name, end):
    fewest = {"taylor", "strang", "rk4", "extrap", "implicit_midpoint"}
    compare_methods(kr.Scene(BODIES[name], **START), end, fewest)


# The Taylor series adds the torque of the rotor to products of two angular velocities. The factor
# of such a product is zero if two moments are equal, and tiny if they are nearly equal.
NEARLY = replace(GENERAL, inertia=(1.3, 1.3 * (1 + 2.0**-50), 1.7))


@pytest.mark.parametrize(
    "body", [GENERAL, TENSOR, BODIES["kowalewski"], BODIES["spherical"], NEARLY]
)
@pytest.mark.parametrize("digits, tolerance", [(None, 1e-14), (20, 1e-18), (30, 1e-27)])
def test_digits_agree_with_decimal_arithmetic(body, digits, tolerance):
    for damping in (0.0, 0.03):
        scene = kr.Scene(body, **START, damping=damping)
        assert decimal_error(scene, -1.5, digits) < tolerance


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
        for path in (
            kr.solve(rotor_scene, [0.0, t], "exact"),
            kr.solve(rotor_scene, [0.0, t], "taylor"),
        ):
            limit = 1e-13 if path.method == "exact" else 3e-12
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
    kinetic = path.energy - 0.5 * 1.3 * nodding**2
    potential = [rotor_top.potential(angle) for angle in path.nutation]
    assert np.abs(kinetic - potential).max() < 5e-15 and np.ptp(potential) > 0.05


def test_the_integrals_of_zhukovsky_and_volterra():
    path = kr.solve(kr.Scene(BODIES["free"], **START), np.linspace(0, 50, 101))
    body = path.scene.body
    own = np.array([turn_back(tuple(q), m) for q, m in zip(path.q, path.m, strict=True)])
    energy = (((own - body.rotor) ** 2) / body.moments).sum(axis=1) / 2
    assert np.abs(np.linalg.norm(own, axis=1) - np.linalg.norm(own[0])).max() < 1e-14
    assert np.abs(energy - energy[0]).max() < 1e-14 and np.abs(path.energy - energy).max() < 1e-14
    assert np.ptp(own, axis=0).min() > 0.1


def test_the_power_balance_with_damping():
    scene = HEAVY.replace(damping=(0.02, 0.03, 0.05))
    t = np.linspace(0, 10, 2001)
    path = kr.solve(scene, t)
    power = -(np.array(scene.damping) * path.body_velocity**2).sum(axis=1)
    assert path.energy[-1] - path.energy[0] == pytest.approx(integral_of(power, t), abs=1e-11)


def test_a_rotor_at_rest_does_not_change_the_path():
    for rotor in ((0, 0, 0), (-0.0, 0.0, -0.0)):
        for name, scene in {"lagrange": kr.scenes.thesis, "general": kr.scenes.asymmetric}.items():
            still = scene.replace(body=replace(scene.body, rotor=rotor))
            assert still == scene and still.body.kind == name
            for method in kr.methods.values():
                if method.suits(scene):
                    step = {} if method.adaptive else {"step": 0.01}
                    one = kr.solve(still, [0, 1.0], method.name, **step)
                    other = kr.solve(scene, [0, 1.0], method.name, **step)
                    assert one.states.tobytes() == other.states.tobytes(), method.name


def test_members_of_an_ensemble_equal_single_tops():
    rotors = np.array([(0.1, 0.2, 0.3), (0, 0, -0.4), (0, 0.5, 0)])
    tops = HEAVY.vary(rotor=rotors, velocity=(0.3, 0.0, -0.2))
    assert tops[1] == kr.Scene(
        replace(GENERAL, rotor=(0, 0, -0.4)), **{**START, "momentum": None}, velocity=(0.3, 0, -0.2)
    )
    assert kr.Ensemble.of([tops[0], tops[1]])[1] == tops[1] == kr.Source.of(tops)[1]
    for method, options in {"taylor": {}, "kahan_li8": {"step": 0.02}}.items():
        paths = kr.solve(tops, [0.0, 1.0], method, **options)
        for i, path in enumerate(paths):
            alone = kr.solve(tops[i], [0.0, 1.0], method, **options)
            # taylor in lanes has rounding errors of its own
            if method == "taylor":
                assert np.abs(path.states - alone.states).max() < 1e-14
            else:
                assert path.states.tobytes() == alone.states.tobytes()
    axial = kr.Scene(kr.Body(1, (1, 1, 0.5), (0, 0, 0.3)), **START).vary(
        rotor=[(0, 0, 0), (0, 0, 0.2), (0, 0.1, 0)]
    )
    plan = kr.plan(axial, [0.0, 1.0])
    assert (plan.closed_form, plan.lanes, plan.alone) == (2, 1, 0)
    assert not kr.solve(axial, [0.0, 1.0]).status.any()


def test_velocities_include_the_rotor():
    for body in (GENERAL, TENSOR):
        scene = kr.Scene(body, body_velocity=(1, 2, 3), attitude=START["attitude"], gravity=1)
        inertia = np.array(body.inertia)
        inertia = np.diag(inertia) if inertia.ndim == 1 else inertia
        expected = inertia @ (1, 2, 3) + body.rotor
        assert np.abs(kr.solve(scene, [0.0]).body_momentum - expected).max() < 1e-14
        assert np.abs(kr.solve(scene, [0.0]).body_velocity - (1, 2, 3)).max() < 1e-14
        run = kr.start(scene)
        run.to(1.0)
        before = run.to(1.0).body_velocity[-1]
        run.change(body=replace(body, rotor=(0, 1, 0)), keep="velocity")
        assert np.abs(run.to(1.0).body_velocity[-1] - before).max() < 1e-14


def test_the_events_of_a_body_with_a_rotor():
    path = kr.solve(HEAVY, np.linspace(0, 20, 20000))
    level = float(path.kinetic[0]) * 1.2
    event = kr.events.kinetic(level, rotor=ROTOR)
    found = kr.solve(HEAVY, 20.0, events=[event]).events
    assert len(found.t) == np.count_nonzero(np.diff(np.sign(path.kinetic - level))) > 2
    assert np.abs(found.path.kinetic - level).max() < 1e-14
    for name, column in {"m_x": path.m[:, 0], "body_momentum_y": path.body_momentum[:, 1]}.items():
        level = 0.9 * float(np.median(column))
        for scene in (HEAVY, HEAVY.replace(damping=1e-300)):
            found = kr.solve(scene, 20.0, events=[kr.events.crossing(name, level)]).events
            assert len(found.t) == np.count_nonzero(np.diff(np.sign(column - level))) > 0
    for top in (HEAVY, HEAVY.scatter(2, momentum=0.1)):
        with pytest.raises(ValueError, match="rotor=body"):
            kr.solve(top, 1.0, events=[kr.events.kinetic(level)])


@pytest.mark.parametrize("digits", [16, 30])
def test_tangents_agree_with_differences(digits):
    names, step = ("start", "moments"), 1e-5
    for damping in (0.0, 0.04):
        scene = HEAVY.replace(damping=damping)
        path = kr.solve(scene, [0.0, 2.0], "taylor", tangents=names, digits=digits)
        plain = kr.solve(scene, [0.0, 2.0], "taylor", digits=digits)
        assert path.states.tobytes() == plain.states.tobytes()
        columns = []
        for change in [("momentum", k) for k in range(3)] + [("inertia", k) for k in range(3)]:
            name, k = change
            ends = []
            for sign in (1.0, -1.0):
                offset = sign * step * np.eye(3)[k]
                if name == "momentum":
                    neighbour = scene.replace(momentum=np.array(scene.momentum) + offset)
                else:
                    neighbour = scene.replace(
                        body=replace(GENERAL, inertia=np.array((1.3, 2.1, 1.7)) + offset)
                    )
                ends.append(kr.solve(neighbour, [0.0, 2.0], "taylor"))
            q = (ends[0].q[-1] - ends[1].q[-1]) / (2 * step)
            back = tuple(plain.q[-1] * (1, -1, -1, -1))
            rotation = 2 * np.array(multiply(back, tuple(q)))[1:]
            columns.append([*rotation, *((ends[0].m[-1] - ends[1].m[-1]) / (2 * step))])
        assert np.abs(path.tangents[-1][:, 3:] - np.array(columns).T).max() < 1e-8


@pytest.mark.parametrize("digits", [16, 30])
def test_tangents_by_the_rotor(digits):
    for body in (GENERAL, TENSOR):
        scene = kr.Scene(body, **START, damping=(0.02, 0.3, 0.1))

        def change(k, scene=scene):
            axis = np.array(turn(scene.body.axes, np.eye(3)[k]))
            return lambda increment: scene.replace(
                body=replace(scene.body, rotor=np.array(scene.body.rotor) + increment * axis)
            )

        compare_tangents(scene, 2.0, [("rotor", change(k)) for k in range(3)], digits)
    names = ("start", "moments", "com", "gravity", "mass", "rotor")
    assert 1e-16 < kr.solve(HEAVY, [0.0, 2.0], tangents=names).conditioning[-1] < 1e-13


def test_closed_forms_of_ensembles_with_axial_rotors_equal_single_ones():
    for body, axis in AXIAL[:4]:
        tops = kr.Scene(body, **START).vary(rotor=np.outer((0.0, 0.7, -1.2), axis))
        form, t = kr.exact(tops), np.array([-2.0, 0.0, 3.0])
        ahead = kr.solve(tops, t[1:], "exact")
        assert np.isnan(form.certificate).all()
        for i in range(3):
            alone = kr.exact(tops[i])
            for times in (t, t[2:]):
                assert form(times)[i].tobytes() == alone(times).states.tobytes()
            for name in (
                "period",
                "precession_rate",
                "spin_angle_rate",
                "critical_spin",
                "t_least",
            ):
                assert getattr(form, name)[i] == getattr(alone, name)
            assert ahead.states[i][1].tobytes() == alone(3.0).states.tobytes()
            one = kr.solve(tops[i], t[1:], "exact")
            assert np.abs(ahead.states[i] - one.states).max() < 1e-15


def test_ensembles_refuse_closed_forms_that_a_rotor_excludes():
    for gravity in (0.0, 1.3):
        scene = kr.Scene(GENERAL, **{**START, "gravity": gravity})
        for tops in (scene.vary(mass=[1.0, 2.0]), scene.vary(momentum=[(0, 0, 1), (0, 1, 0)])):
            with pytest.raises(ValueError, match="rotor"):
                kr.exact(tops)
            with pytest.raises(ValueError, match="rotor"):
                kr.solve(tops, 1.0, "exact")
            assert kr.plan(tops, [0.0, 1.0]).closed_form == 0
            assert not kr.solve(tops, [0.0, 1.0]).status.any()


def measure(scene, names, n=200, end=3.0, sigma=0.005):
    """Return noisy measurements of the given quantities."""
    t, rng = np.linspace(0.0, end, n), np.random.default_rng(4)
    path = kr.solve(scene, t)
    values = {name: np.array(getattr(path, name)) for name in names}
    # an attitude turns by twice the change of its quaternion
    scale = {"q": 0.5 * sigma}
    noisy = {k: v + scale.get(k, sigma) * rng.normal(size=v.shape) for k, v in values.items()}
    if "q" in noisy:
        noisy["q"] /= np.linalg.norm(noisy["q"], axis=1)[:, None]
    return kr.Record(t, noisy, sigma)


@pytest.mark.parametrize(
    "names", [("body_velocity", "apex"), ("velocity", "apex"), ("kinetic", "m")]
)
def test_a_fit_finds_the_body_that_carries_a_known_rotor(names):
    truth = HEAVY.replace(momentum=(1.0, -2.0, 3.0))
    record = measure(truth, names)
    guess = truth.replace(body=replace(GENERAL, inertia=(1.4, 2.0, 1.8)), momentum=(0.9, -1.9, 3.2))
    fit = kr.fit(guess, record)
    assert fit.has_converged and fit.scene.body.rotor == ROTOR
    for name, moment in {"I1": 1.3, "I2": 2.1, "I3": 1.7}.items():
        assert abs(fit.values[name] - moment) < 4.0 * fit.error[name] < 0.1
    assert fit.chi2 < 1.3 * fit.dof


def test_a_fit_guesses_the_start_of_a_body_with_a_rotor():
    truth = HEAVY.replace(momentum=(1.0, -2.0, 3.0))
    guess = truth.replace(momentum=(0.0, 0.0, 0.1), attitude=(1.0, 0.0, 0.0, 0.0))
    for name in ("q", "body_velocity"):
        fit = kr.fit(guess, measure(truth, (name,)))
        assert fit.chi2 < 1.3 * fit.dof
    axial = kr.Body(1.0, (1.0, 1.0, 0.6), (0, 0, 0.4), unphysical=True, rotor=(0, 0, 5.0))
    spinning = kr.Scene.spinning(axial, spin=12.0, tilt=0.8, precession=1.5, gravity=9.81)
    still = spinning.replace(momentum=(0, 0, 1), attitude=(1.0, 0.0, 0.0, 0.0))
    fit = kr.fit(still, measure(spinning, ("apex",)), ("start",))
    assert fit.chi2 < 1.3 * fit.dof
    assert kr.solve(fit.scene, [0.0]).spin[0] == pytest.approx(12.0, rel=0.01)
    with pytest.raises(ValueError, match="axes cannot be free"):
        kr.fit(truth, measure(truth, ("q",)), ("start", "axes"))


def test_runs_are_resumed_with_the_same_bits():
    for method, options in {"taylor": {}, "suzuki4": {"step": 0.02}, "extrap": {}}.items():
        run = kr.start(HEAVY, method, **options)
        run.to(1.0)
        again = kr.resume(run.checkpoint)
        assert again.scene == HEAVY
        assert run.to(2.0).states.tobytes() == again.to(2.0).states.tobytes()


def test_bodies_keep_their_rotors(tmp_path):
    assert GENERAL.principal_rotor == ROTOR and not any(replace(GENERAL, rotor=(0, 0, 0)).rotor)
    assert np.abs(np.array(turn(TENSOR.axes, TENSOR.principal_rotor)) - ROTOR).max() < 1e-15
    for body in (GENERAL, TENSOR):
        scene = kr.Scene(body, **START)
        assert kr.Scene.from_toml(scene.to_toml()) == scene
        kr.solve(scene, [0.0, 1.0]).save(tmp_path / "path.npz")
        assert kr.load(tmp_path / "path.npz").scene == scene
    text = "momentum = [0, 0, 3]\ngravity = 1\n[body]\nrotor = [0, 0, 1]\n[body.cone]\n"
    cone = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
    other_body = kr.Scene.from_toml(
        text + "radius = 1\nheight = 2\npivot = [0, 0, 0]\nmass = 1\n"
    ).body
    assert other_body == cone.with_rotor(spin=10, inertia=0.1, axis=(0, 0, 5))
    assert (GENERAL + GENERAL).rotor == (0.6, -0.8, 1.6)
    half = (math.sqrt(0.5), math.sqrt(0.5), 0, 0)
    assert GENERAL.turn(half).rotor == pytest.approx((0.3, -0.8, -0.4), abs=1e-15)
    assert GENERAL.shift((0, 0, 1)).rotor == ROTOR and "rotor" in repr(GENERAL)
    assert replace(GENERAL, rotor=(0, 0, 0)) != GENERAL


@pytest.mark.parametrize("rotor", [(math.nan, 0, 0), (0, math.inf, 0), "x", (1, 2), 1.0])
def test_invalid_rotors_are_refused(rotor):
    with pytest.raises((TypeError, ValueError), match="rotor"):
        replace(GENERAL, rotor=rotor)
    with pytest.raises((TypeError, ValueError), match="rotor"):
        kr.Bodies([1, 2], (1, 1, 1), (0, 0, 0), rotor=rotor)
    with pytest.raises((TypeError, ValueError), match="rotor"):
        HEAVY.vary(rotor=rotor)


@pytest.mark.parametrize(
    "words, message",
    [
        ({"spin": math.nan}, "spin"),
        ({"inertia": -1.0}, "inertia"),
        ({"axis": (0, 0, 0)}, "axis"),
        ({"axis": (0, math.inf, 0)}, "axis"),
        ({"spin": 1e200, "inertia": 1e200}, "spin"),
    ],
)
def test_invalid_arguments_of_with_rotor(words, message):
    with pytest.raises(ValueError, match=message):
        GENERAL.with_rotor(**{"spin": 1.0, "inertia": 1.0, "axis": (0, 0, 1), **words})


def test_functions_without_rotors_refuse_them():
    axial = kr.Scene(kr.Body(1, (1, 1, 0.5), (0, 0, 0.3), rotor=(0, 0, 0.2)), **START)
    for name in ("bobenko_suris", "bobenko_suris2", "bobenko_suris4", "veselov2", "hirota_kimura"):
        with pytest.raises(ValueError, match="bodies without rotors"):
            kr.solve(axial, 1.0, name, step=0.01)
    with pytest.raises(ValueError, match="rotors along the axis"):
        kr.solve(kr.Scene(BODIES["lagrange"], **START), 1.0, "blanes_moan6", step=0.01)
    path = kr.solve(HEAVY, [0.0, 1.0])
    for call in (
        lambda: kr.exact(HEAVY),
        lambda: kr.solve(HEAVY, 1.0, "exact"),
        lambda: kr.solve(HEAVY.replace(gravity=0), 1.0, "exact"),
        lambda: kr.exact(axial, map="bobenko_suris", step=0.01),
        lambda: kr.rod(path),
        lambda: kr.starts(GENERAL, energy=2.0, vertical=0.5, n=2, gravity=1),
        lambda: kr.Scene.spinning(axial.body, spin=9.0, tilt=0.3, steady=True, gravity=1),
        lambda: axial.vary(spin=[9.0, 8.0], steady=True),
        lambda: kr.events.separatrix(HEAVY.replace(gravity=0)),
    ):
        with pytest.raises(ValueError, match="rotor"):
            call()
    kowalewski = kr.Scene(BODIES["kowalewski"], **START)
    assert kowalewski.body.kind == "general" and np.isnan(kr.solve(kowalewski, [0.0]).kowalewski[0])
    assert np.isnan(kr.solve(axial, [0.0]).modified_energy(0.01)[0])
