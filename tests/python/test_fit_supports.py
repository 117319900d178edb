"""Tests of fits to tops with friction and moving supports."""

import kreisel as kr
import numpy as np
import pytest
from fits import HEAVY, SYMMETRIC, gyroscope
from kreisel._fit.multiple_shooting import ShootingModel
from kreisel._fit.parameters import FreeParameters, expand_free_names
from kreisel._fit.residuals import ResidualModel
from moving_tops import Motion

scipy_integrate = pytest.importorskip("scipy.integrate")
curve_fit = pytest.importorskip("scipy.optimize").curve_fit

SIGMA = 0.01
TURNING = (0.3, -0.2, 1.5)
SHAKING = (0.02, 15.0, 0.4)
ROTOR = HEAVY.body.with_rotor(spin=5.0, inertia=0.3, axis=(1.0, 2.0, -1.0))
GUESS = kr.Scene(
    kr.Body(1.0, (1.0, 1.1, 1.2), com=(0.0, 0.0, 0.3), unphysical=True),
    momentum=(0, 0, 1),
    gravity=9.81,
)
HEADING = "the heading: a rotation of the start about the vertical"


def integrate(scene, t):
    """Return attitudes and angular velocities relative to a frictionless support, from SciPy."""
    motion = Motion(scene)
    begin = np.array([*scene.attitude, *scene.momentum])
    found = scipy_integrate.solve_ivp(
        lambda t, y: motion.rates(t, y, 0.0),
        (t[0], t[-1]),
        begin,
        "DOP853",
        t,
        rtol=1e-9,
        atol=1e-9,
    )
    q = found.y[:4].T / np.linalg.norm(found.y[:4], axis=0)[:, None]
    return q, np.array([motion.relative(y) for y in found.y.T])


def rotate_randomly(q, rng):
    vectors = SIGMA * rng.normal(size=(len(q), 3)).T
    half = 0.5 * np.linalg.norm(vectors, axis=0)
    small = (np.cos(half), *(0.5 * np.sinc(half / np.pi) * vectors))
    return np.stack(kr.quaternion.multiply(tuple(q.T), small), axis=-1)


def simulate(scene, seed, end=3.0, n=150):
    """Simulate measurements of the attitude and angular velocity relative to the support."""
    t, rng = np.linspace(0.0, end, n), np.random.default_rng(seed)
    q, velocity = integrate(scene, t)
    measurements = velocity + SIGMA * rng.normal(size=velocity.shape)
    return kr.Record(t, {"q": rotate_randomly(q, rng), "body_velocity": measurements}, SIGMA)


def run_down(t, spin, damping, friction, moment):
    """Return the spin of a sleeping top with damping and dry friction."""
    decay = np.exp(-damping / moment * t)
    return np.maximum(spin * decay - friction * (1.0 - decay) / damping, 0.0)


def is_near(fit, expected, most=4.0):
    return all(abs(fit.values[name] - value) < most * fit.error[name] for name, value in expected)


@pytest.mark.parametrize("loss", ["linear", "soft"])
def test_a_decaying_spin_determines_friction_and_damping(loss):
    top = kr.Scene.spinning(SYMMETRIC.body, spin=20.0, tilt=0.0, gravity=9.81, damping=0.05)
    t, truth = np.linspace(0.0, 10.0, 200), (20.0, 0.1, 1.0)
    rng = np.random.default_rng(3)
    spin = run_down(t, *truth, 0.6) + SIGMA * rng.normal(size=200)
    assert (spin[-30:] < 0.1).all()  # the record reaches past the stop
    values, covariance = curve_fit(
        lambda t, *p: run_down(t, *p, 0.6), t, spin, (19.0, 0.05, 0.8), np.full(200, SIGMA), True
    )
    for friction in (0.0, 0.8):
        guess = top.replace(friction=friction)
        record = kr.Record(t, {"spin": spin}, SIGMA)
        fit = kr.fit(guess, record, ("velocity", "damping", "friction"), loss=loss)
        assert 0.7 < fit.chi2 / fit.dof < 1.2
        pairs = (("body_velocity_z", 0), ("damping_1 = damping_2 = damping_3", 1), ("friction", 2))
        for name, k in pairs:
            error = covariance[k, k] ** 0.5
            assert abs(fit.values[name] - values[k]) < (0.01 if loss == "linear" else 1.0) * error
            assert fit.error[name] == pytest.approx(error, rel=0.02 if loss == "linear" else 0.2)


@pytest.mark.parametrize("truth", [0.0, 0.7])
def test_curve_fit_finds_the_same_velocity_and_friction_of_a_heavy_top(truth):
    scene = HEAVY.replace(friction=truth)
    record = gyroscope(scene, end=6.0, n=100)
    [series] = record.series

    def model(_, x, y, z, friction):
        trial = HEAVY.replace(body_velocity=(x, y, z), friction=abs(friction))
        return kr.solve(trial, record.t).body_velocity.ravel()

    fit = kr.fit(scene.replace(friction=0.3), record, ("velocity", "friction"))
    values, covariance = curve_fit(
        model, record.t, series.values.ravel(), (3.0, 2.0, 12.0, 0.3), np.full(300, 0.02), True
    )
    values[3] = abs(values[3])
    errors = np.sqrt(covariance.diagonal())
    assert is_near(fit, [("friction", truth), ("body_velocity_z", 12.0), ("body_velocity_x", 3.0)])
    assert fit.names == (*(f"body_velocity_{axis}" for axis in "xyz"), "friction")
    found = np.array([fit.values[name] for name in fit.names])
    assert (np.abs(found - values) < 1e-3 * errors).all()
    assert [fit.error[name] for name in fit.names] == pytest.approx(errors, rel=2e-4)


def test_a_fit_at_the_bound_of_friction_is_reported():
    t = np.linspace(0.0, 3.0, 100)
    spin = kr.solve(SYMMETRIC, t).spin + 0.02 * t  # a motor drives the top a little
    fit = kr.fit(SYMMETRIC, kr.Record(t, {"spin": spin}, 0.1), ("velocity", "friction"))
    assert fit.values["friction"] == 0.0 == fit.scene.friction
    assert fit.at_bound == ("friction is zero: negative friction is excluded",)
    assert "At a bound: friction is zero" in str(fit) and np.isfinite(fit.error["friction"])
    assert fit.nonlinearity < 100.0


def test_a_fit_at_the_bound_of_damping_is_reported():
    t = np.linspace(0.0, 3.0, 100)
    body = kr.Body.symmetric(1.0, 1.0, 0.6, 0.0, unphysical=True)
    top = kr.Scene(body, body_velocity=(0.0, 0.0, 5.0), damping=0.1, gravity=1)
    fit = kr.fit(top, kr.Record(t, {"spin": 5.0 + 0.02 * t}, 0.1), ("velocity", "damping"))
    assert tuple(fit.scene.damping) == (0.0, 0.0, 0.0)
    assert fit.at_bound == (
        "damping_1 = damping_2 = damping_3 is zero: negative damping is excluded",
    )


def test_a_delay_and_the_phase_of_shaking_cannot_both_be_determined():
    scene = HEAVY.replace(shaking=SHAKING)
    fit = kr.fit(scene, gyroscope(scene, n=80, free="delay"), ("start", "shaking"))
    assert fit.unidentified == (HEADING, "the delay against the start: a shift in time")


@pytest.mark.parametrize(
    "words, start",
    [
        ({"turning": TURNING}, {}),
        ({"shaking": SHAKING}, {"shaking": (0.01, 15.0, 0.0)}),
        ({"turning": TURNING, "shaking": SHAKING}, {"shaking": (0.01, 15.0, 0.0)}),
    ],
)
@pytest.mark.parametrize("free", ["fixed", "free"])
def test_fits_on_moving_supports(words, start, free):
    records = simulate(HEAVY.replace(**words), 5)
    guess = GUESS.replace(**(words if free == "fixed" else start))
    names = ("start", "moments", "com", *(words if free == "free" else ()))
    fit = kr.fit(guess, records, names)
    assert 0.8 < fit.chi2 / fit.dof < 1.2
    [scale] = fit.unidentified
    assert (
        scale == "the scale of the moments: moments, damping and com have an unknown common factor"
    )
    expected = {}
    if free == "free" and "turning" in words:
        expected |= dict(zip(("turning_x", "turning_y", "turning_z"), TURNING, strict=True))
    if free == "free" and "shaking" in words:
        parts = ("shaking_amplitude", "shaking_rate", "shaking_phase")
        expected |= dict(zip(parts, SHAKING, strict=True))
    assert is_near(fit, expected.items())
    ratios = fit.moment_ratios
    for name, value in (("I1 / I3", 1.0 / 0.6), ("I2 / I3", 1.3 / 0.6)):
        assert abs(ratios[name][0] - value) < 4.0 * ratios[name][1] < 0.05


def test_a_gyroscope_on_a_turntable_measures_inertial_velocity():
    table = HEAVY.replace(turning=(0.0, 0.0, 2.0))
    t = np.linspace(0.0, 3.0, 150)
    at_rest = HEAVY.replace(
        momentum=table.momentum
    )  # the same motion, seen from the inertial frame
    noise = SIGMA * np.random.default_rng(7).normal(size=(150, 3))
    values = kr.solve(at_rest, t).body_velocity + noise
    guess, free = GUESS.replace(turning=(0.0, 0.0, 2.0)), ("start", "moments", "com")
    right = kr.fit(guess, kr.Record(t, {"inertial_velocity": values}, SIGMA), free)
    plain = kr.fit(GUESS, kr.Record(t, {"body_velocity": values}, SIGMA), free)
    assert right.chi2 == pytest.approx(plain.chi2, rel=1e-6)
    assert right.moment_ratios["I1 / I3"] == pytest.approx(plain.moment_ratios["I1 / I3"], rel=1e-5)
    verticals = (
        kr.solve(plain.scene, [0.0]).body_vertical,
        kr.solve(right.scene, [0.0]).body_vertical,
    )
    assert np.abs(verticals[0] - verticals[1]).max() < 1e-5


def test_the_apex_seen_from_a_turntable_needs_no_initial_guess():
    """Fit a top to measurements of its apex made on a turntable."""
    rate, t = 0.7, np.linspace(0.0, 4.0, 200)
    x, y, z = kr.solve(SYMMETRIC, t).apex.T
    sine, cosine = np.sin(rate * t), np.cos(rate * t)
    apex = np.stack((cosine * x + sine * y, cosine * y - sine * x, z), axis=-1)
    apex += 0.005 * np.random.default_rng(4).normal(size=apex.shape)
    body = kr.Body.symmetric(1.0, 1.7, 1.5, 0.4, unphysical=True)
    guess = kr.Scene(body, momentum=(0, 0, 1), gravity=9.81, turning=(0.0, 0.0, rate))
    fit = kr.fit(guess, kr.Record(t, {"apex": apex}, 0.005), ("start", "moments"))
    assert 0.8 < fit.chi2 / fit.dof < 1.2
    assert abs(fit.values["I1 = I2"] - 1.0) < 4.0 * fit.error["I1 = I2"] < 0.05


def test_the_apex_beyond_a_stop_needs_no_initial_guess():
    top = SYMMETRIC.replace(friction=2.5)
    path = kr.solve(top, np.linspace(0.0, 6.0, 200), events=[kr.events.stopped()])
    assert path.events.t[0] == pytest.approx(0.6 * 20.0 / 2.5)
    apex = path.apex + 0.01 * np.random.default_rng(1).normal(size=path.apex.shape)
    body = kr.Body.symmetric(1.0, 1.7, 1.5, 0.4, unphysical=True)
    guess = kr.Scene(body, momentum=(0, 0, 1), gravity=9.81)
    record = kr.Record(path.t, {"apex": apex}, 0.01)
    fit = kr.fit(guess, record, ("start", "moments", "friction"))
    assert 0.8 < fit.chi2 / fit.dof < 1.2
    assert is_near(fit, [("friction", 2.5), ("I1 = I2", 1.0)])
    assert fit.error["friction"] < 0.01


def test_rotor_friction_and_turning_are_found_together():
    scene = HEAVY.replace(body=ROTOR, friction=1.0, turning=(0.0, 0.0, 0.5))
    path = kr.solve(scene, np.linspace(0.0, 3.0, 150))
    rng = np.random.default_rng(2)
    noisy = path.inertial_velocity + SIGMA * rng.normal(size=(150, 3))
    attitudes = kr.Record(path.t + 0.01, {"q": rotate_randomly(path.q, rng)}, SIGMA, free="delay")
    records = [kr.Record(path.t, {"inertial_velocity": noisy}, SIGMA), attitudes]
    guess = scene.replace(friction=0.5, turning=(0.0, 0.1, 0.2))
    fit = kr.fit(guess, records, ("start", "rotor", "friction", "turning"))
    rotor = zip(("rotor_x", "rotor_y", "rotor_z"), scene.body.rotor, strict=True)
    expected = [("friction", 1.0), ("turning_z", 0.5), ("delay[1]", 0.01), *rotor]
    assert is_near(fit, expected) and 0.8 < fit.chi2 / fit.dof < 1.2


def test_multiple_shooting_keeps_the_shaking_phase():
    scene = HEAVY.replace(body=ROTOR, turning=TURNING, shaking=SHAKING, friction=0.5)
    record = gyroscope(scene, n=120, sigma=0.02)
    free = ("start", "turning", "shaking", "friction")
    single, pieces = (kr.fit(scene, record, free, pieces=k) for k in (1, 3))
    assert len(pieces.piece_starts) == 3
    for name in ("friction", "turning_z", "shaking_amplitude", "shaking_rate", "shaking_phase"):
        assert abs(pieces.values[name] - single.values[name]) < 0.05 * single.error[name]
    assert np.abs(pieces.path.body_velocity - single.path.body_velocity).max() < 1e-3


@pytest.mark.parametrize(
    "words, start, first",
    [
        ({"turning": TURNING}, ["start"], 0.0),
        ({"shaking": SHAKING}, ["start"], 0.0),
        ({"friction": 0.5}, ["start"], 0.0),
        ({}, ["attitude"], -0.5),
        ({"turning": TURNING}, ["velocity"], -0.5),
    ],
)
def test_derivatives_of_shooting_gaps_are_right(words, start, first):
    scene = HEAVY.replace(body=ROTOR, **words)
    record = gyroscope(scene, n=12, end=1.0, sigma=0.05)
    record = kr.Record(record.t + first, {"body_velocity": record.series[0].values}, 0.05)
    parameters = FreeParameters(
        scene, expand_free_names((*start, "moments", "rotor", *words)), [record]
    )
    model = ShootingModel(parameters, [record], [record.series[0].sigma], 2)
    pieces = model.build_segment_starts(parameters.start)
    assert np.abs(model.evaluate_residuals(pieces).residuals[model.data_size :]).max() < 1e-9
    natural = np.minimum(model.estimate_parameter_scales(pieces), 1.0)
    jacobian = model.evaluate_residuals(pieces).jacobian * natural
    for k in range(model.width):
        step = 1e-5 * natural * (np.arange(model.width) == k)
        residuals = [
            model.evaluate_residuals(model.add_step_within_bounds(pieces, sign * step)).residuals
            for sign in (1.0, -1.0)
        ]
        difference = (residuals[0] - residuals[1]) / 2e-5
        assert np.abs(difference - jacobian[:, k]).max() < 1e-5 * np.abs(jacobian).max()


def test_derivatives_are_right_after_stops():
    scene = HEAVY.replace(friction=3.0, damping=0.02)
    stops = kr.solve(scene, 6.0, events=[kr.events.stopped()]).events.t
    t = np.linspace(0.0, 6.0, 25)
    assert len(stops) > 1 and np.abs(t - stops[:, None]).min() > 0.01
    record = kr.Record(t, {"body_velocity": kr.solve(scene, t).body_velocity}, 0.3, free="delay")
    names = expand_free_names(("start", "moments", "com", "damping", "friction"))
    parameters = FreeParameters(scene, names, [record])
    model = ResidualModel(parameters, [record], [record.series[0].sigma])
    natural = model.estimate_parameter_scales(parameters.start)
    jacobian = model.evaluate_residuals(parameters.start).jacobian * natural
    for k in range(parameters.size):
        step = 1e-6 * natural * (np.arange(parameters.size) == k)
        ends = [model.add_step_within_bounds(parameters.start, sign * step) for sign in (1.0, -1.0)]
        residuals = [model.evaluate_residuals(end, has_jacobian=False).residuals for end in ends]
        difference = (residuals[0] - residuals[1]) / 2e-6
        assert np.abs(difference - jacobian[:, k]).max() < 1e-5 * np.abs(jacobian).max()


def test_equivalent_motions_resolve_to_the_one_near_the_guess():
    scene = HEAVY.replace(turning=TURNING, shaking=SHAKING)
    t = np.linspace(0.0, 3.0, 200)
    values = kr.solve(scene, t).inertial_velocity + SIGMA * np.random.default_rng(1).normal(
        size=(200, 3)
    )
    guess = scene.replace(shaking=(0.005, 15.0, 9.7), turning=(0.35, -0.1, 1.4))
    record = kr.Record(t, {"inertial_velocity": values}, SIGMA)
    fit = kr.fit(guess, record, ("start", "turning", "shaking"))
    assert 0.8 < fit.chi2 / fit.dof < 1.2
    assert fit.scene.shaking[0] == pytest.approx(0.02, rel=0.1)
    assert abs(fit.scene.shaking[2] - 0.4) < 4.0 * fit.error["shaking_phase"]
    direction = np.arctan2(fit.scene.turning[1], fit.scene.turning[0])
    assert direction == pytest.approx(np.arctan2(-0.1, 0.35), abs=1e-12)


def test_undetermined_directions_are_named():
    top = kr.Scene(
        kr.Body(1.0, (1.0, 1.3, 0.6), (0, 0, 0), unphysical=True),
        body_velocity=(1.0, 2.0, 5.0),
        friction=0.4,
    )
    scale = (
        "the scale of the moments: only their ratios, and damping and friction over moments, matter"
    )
    attitude = "the attitude in space, which a body without torque does not show"
    sentences = kr.fit(top, gyroscope(top), ("start", "moments", "friction")).unidentified
    assert sentences == (scale, HEADING, attitude)
    heavy = HEAVY.replace(friction=1.0)
    sentences = kr.fit(
        heavy, gyroscope(heavy), ("start", "moments", "com", "friction")
    ).unidentified
    scale = (
        "the scale of the moments: moments, damping, friction and com have an unknown common factor"
    )
    assert sentences == (scale, HEADING)
    scene = HEAVY.replace(turning=TURNING)
    t = np.linspace(0.0, 3.0, 150)
    record = kr.Record(t, {"inertial_velocity": kr.solve(scene, t).inertial_velocity}, SIGMA)
    [heading] = kr.fit(scene, record, ("start", "turning")).unidentified
    assert heading == "the heading: a rotation of the start and of turning about the vertical"


@pytest.mark.parametrize("name", ["body_velocity", "energy"])
def test_records_before_a_start_that_friction_holds_are_refused(name):
    late = kr.solve(HEAVY.replace(friction=3.0), [4.0]).end
    before = getattr(kr.solve(HEAVY.replace(friction=3.0), np.linspace(2.0, 6.0, 50)), name)
    record = kr.Record(np.linspace(-2.0, 2.0, 50), {name: before}, 0.02)
    with pytest.raises(ValueError, match=r"before the start at t = 0, where friction holds"):
        kr.fit(late, record, ("start", "friction"), max_evaluations=30)


@pytest.mark.parametrize(
    "record, free, message",
    [
        ({"body_velocity": np.zeros((9, 3))}, "shaking", "shaking is free, but its rate is 0"),
        ({"body_velocity": np.zeros((9, 3))}, "com", "com cannot be free for a top with friction"),
        ({"body_velocity": np.zeros((9, 3))}, "axes", "axes cannot be free for a top with fric"),
        ({"body_velocity": np.zeros((9, 3))}, "moments", "moments cannot be free for a top with"),
        ({"body_acceleration_x": np.zeros(9)}, "start", "body_acceleration_x cannot be fitted"),
        ({"specific_force": np.zeros((9, 3))}, "start", "it jumps where the spin stops"),
    ],
)
def test_parameters_without_derivatives_are_refused(record, free, message):
    point = (0, 0, 1) if "specific_force" in record else None
    body = kr.Body(1.0, (1.0, 1.3, 0.6), (0, 0, 0), unphysical=True).turn((0.6, 0.48, 0.0, 0.64))
    scene = kr.Scene(body, momentum=(0, 0, 1), friction=0.1, gravity=1)
    with pytest.raises(ValueError, match=message):
        kr.fit(scene, kr.Record(np.arange(9.0), record, 0.1, point=point), free)


def test_results_contain_friction_turning_and_shaking():
    scene = HEAVY.replace(friction=0.5, turning=TURNING, shaking=SHAKING)
    fit = kr.fit(scene, gyroscope(scene, n=60), ("start", "turning", "shaking", "friction"))
    units = dict(zip(fit.names, fit.units, strict=True))
    assert units["friction"] == "M L^2 T^-2" and units["turning_y"] == "rad/T"
    assert [units[f"shaking_{part}"] for part in ("amplitude", "rate", "phase")] == [
        "L",
        "rad/T",
        "rad",
    ]
    again = kr.Scene.from_toml(fit.to_toml())
    assert again == fit.scene and again.friction == fit.values["friction"]
    tops = fit.scatter(5, seed=1)
    assert np.ptp(tops.turning[:, 0]) > 0.0 and (np.asarray(tops.friction) >= 0.0).all()
    size, error = fit.error_of(lambda scene: np.linalg.norm(scene.turning))
    assert abs(size - np.linalg.norm(TURNING)) < 4.0 * error < 1.0
