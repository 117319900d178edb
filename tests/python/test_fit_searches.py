"""Searches from poor guesses, in pieces and of other minima, and what a fit says about them."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from fits import (
    GUESS,
    HEAVY,
    SIGMA,
    SYMMETRIC,
    SYMMETRIC_GUESS,
    change_parameters,
    compute_ratios,
    is_near,
    simulate,
    simulate_gyroscope,
    solve_at,
)

BODY = ("start", "moments", "com")
CHAOTIC = kr.scenes.asymmetric
SUPPORT = {"turning": (0.3, -0.2, 1.5), "shaking": (0.02, 15.0, 0.4)}
ROTOR = (0.5, -0.8, 2.0)
WITH_ROTOR = HEAVY.replace(
    body=kr.Body(1.0, HEAVY.body.moments, com=HEAVY.body.com, rotor=ROTOR, unphysical=True)
)


@pytest.fixture(scope="module")
def fit():
    return kr.fit(GUESS, simulate_gyroscope(), BODY)


def has_ratios(fit, scene, most=4.0):
    found, error = fit.error_of(compute_ratios)
    return (np.abs(found - compute_ratios(scene)) < most * error).all() and (error[:2] < 0.05).all()


FAR = {
    "rates": (HEAVY, {"body_velocity": SIGMA}, {}, BODY),
    "rates before and after the start": (HEAVY, {"body_velocity": SIGMA}, {}, BODY),
    "rates in space": (HEAVY, {"velocity": SIGMA}, {"body": HEAVY.body}, BODY),
    "rates and vertical": (HEAVY, {"body_velocity": SIGMA, "body_vertical": 0.01}, {}, BODY),
    "attitudes": (HEAVY, {"q": 0.01}, {}, BODY),
    "damping": (
        HEAVY.replace(damping=0.2),
        {"body_velocity": SIGMA},
        {"damping": 0.01},
        (*BODY, "damping"),
    ),
    "friction": (HEAVY.replace(friction=2.0), {"q": 0.01}, {}, (*BODY, "friction")),
    "turning": (
        HEAVY.replace(turning=SUPPORT["turning"]),
        {"q": 0.01, "body_velocity": 0.01},
        {},
        (*BODY, "turning"),
    ),
    "shaking": (
        HEAVY.replace(shaking=SUPPORT["shaking"]),
        {"q": 0.01, "body_velocity": 0.01},
        {"shaking": (0.01, 15.0, 0.0)},
        (*BODY, "shaking"),
    ),
    "both": (
        HEAVY.replace(**SUPPORT),
        {"q": 0.01, "body_velocity": 0.01},
        {"shaking": (0.01, 15.0, 0.0)},
        (*BODY, "turning", "shaking"),
    ),
    "moving, known": (HEAVY.replace(**SUPPORT), {"q": 0.01, "body_velocity": 0.01}, SUPPORT, BODY),
    "an accelerometer": (
        HEAVY,
        {"body_velocity": SIGMA, "specific_force": 0.05},
        {},
        BODY,
    ),
    "rates of a turntable": (
        HEAVY.replace(turning=(0.0, 0.0, 2.0)),
        {"inertial_velocity": SIGMA, "body_vertical": 0.01},
        {"turning": (0.0, 0.0, 2.0)},
        BODY,
    ),
    "at rest": (HEAVY, {"body_velocity": SIGMA}, {"momentum": (0, 0, 0)}, BODY),
}


@pytest.mark.parametrize("name", FAR)
def test_a_guess_of_another_motion_is_enough(name):
    """Check that records make better guesses, and that the search needs few paths."""
    scene, sigmas, words, free = FAR[name]
    t = np.linspace(-1.5, 1.5, 150) if "before" in name else np.linspace(0.0, 3.0, 150)
    found = kr.fit(GUESS.replace(**words), simulate(scene, t, sigmas), free)
    assert found.has_converged and found.is_plausible and 0.8 < found.chi2 / found.dof < 1.2
    assert has_ratios(found, scene) and found.evaluations < 120
    assert (found.path.t == t).all()
    for part in ("turning", "shaking", "friction"):
        if part in free:
            true = np.atleast_1d(getattr(scene, part))
            names = [parameter for parameter in found.names if parameter.startswith(part)]
            assert is_near(found, zip(names, true, strict=True))


@pytest.mark.parametrize(
    ("scene", "sigmas", "free", "words"),
    [
        (SYMMETRIC, {"apex": 0.005}, ("start", "moments"), {}),
        (SYMMETRIC, {"apex_x": 0.005, "apex_y": 0.005}, ("start", "moments"), {}),
        (SYMMETRIC, {"nutation": 0.005, "precession_angle": 0.005}, ("start", "moments"), {}),
        (
            SYMMETRIC.replace(turning=(0.0, 0.0, 0.7)),
            {"apex": 0.005},
            ("start", "moments"),
            {"turning": (0.0, 0.0, 0.7)},
        ),
        (
            SYMMETRIC.replace(friction=2.5),
            {"apex": 0.01},
            ("start", "moments", "friction"),
            {},
        ),
    ],
)
def test_the_apex_alone_is_enough(scene, sigmas, free, words):
    """Check records of a tip or its angles, also from a turntable and beyond a stop."""
    t = np.linspace(0.0, 6.0 if scene.friction else 4.0, 200)
    record = simulate(scene, t, sigmas, seed=4)
    found = kr.fit(SYMMETRIC_GUESS.replace(**words), record, free)
    assert 0.8 < found.chi2 / found.dof < 1.2 and found.scene.body.kind == "lagrange"
    assert abs(found.values["I1 = I2"] - 1.0) < 4.0 * found.error["I1 = I2"] < 0.05
    assert not scene.friction or (
        is_near(found, {"friction": 2.5}) and found.error["friction"] < 0.01
    )


@pytest.mark.parametrize("quantity", ["q", "body_velocity", "velocity", "apex", "m"])
@pytest.mark.parametrize("count", [2, 5])
def test_few_measurements_are_fitted_from_the_given_guess(quantity, count):
    record = simulate(HEAVY, np.linspace(0.0, 0.2, count), {quantity: 0.001}, noise=0.0)
    guess = change_parameters(HEAVY, {"body_velocity_x": 0.1, "body_velocity_z": -0.1})
    found = kr.fit(guess, record, "velocity")
    assert found.chi2 < 1e-12
    if quantity not in ("apex", "m") or count > 2:
        true = {f"body_velocity_{x}": v for x, v in zip("xyz", (3.0, 2.0, 12.0), strict=True)}
        assert is_near(found, true, most=0.01)


def test_a_guess_whose_motion_cannot_be_computed_is_replaced_by_one_from_the_records():
    top, t = kr.scenes.asymmetric_regular, np.linspace(0.0, 6.0, 100)
    lean = top.replace(attitude=(np.cos(0.15), np.sin(0.15), 0.0, 0.0))
    names = ("nutation", "precession_angle", "spin_angle", "body_velocity")
    record = simulate(lean, t, dict.fromkeys(names, SIGMA))
    fit = kr.fit(lean.replace(velocity=(0.0, 0.0, 1e30)), record, "velocity")
    assert fit.has_converged and fit.is_plausible and fit.records[0].missing == 0


def fit_far_record(seed, names, free=("start", "moments"), rotor=(0.0, 0.0, 0.0), **words):
    """Fit simulated measurements, starting from an upright top with other moments and velocity."""
    rng, t = np.random.default_rng((1, seed)), np.linspace(0.02, 5.0, 80)
    densities = rng.uniform(0.2, 1.2, 3)
    others = densities * (1.0 + 0.06 * rng.uniform(-1.0, 1.0, 3))
    com, q = rng.normal(size=3) * 0.4, rng.normal(size=4)
    bodies = [
        kr.Body(1.0, d.sum() - d, com, rotor=rotor, unphysical=True) for d in (densities, others)
    ]
    velocity, attitude = rng.normal(size=3) * 1.5, q / np.linalg.norm(q)
    scene = kr.Scene(bodies[0], body_velocity=velocity, attitude=attitude, gravity=2.0)
    guess = kr.Scene(bodies[1], body_velocity=rng.normal(size=3), gravity=2.0)
    path = kr.solve(scene, t)
    point = (0.1, 0.2, -0.3) if "specific_force" in names else None
    values = {n: path.specific_force(point) if point else getattr(path, n) for n in names}
    noisy = {name: value + 1e-3 * rng.normal(size=value.shape) for name, value in values.items()}
    return scene, kr.fit(guess, kr.Record(t, noisy, 1e-3, point=point), free, **words)


@pytest.mark.parametrize(
    ("seed", "names"),
    [(1, ("m",)), (5, ("m",)), (3, ("nutation", "spin")), (4, ("specific_force",))],
)
def test_a_search_from_a_far_guess_finds_the_motion(seed, names):
    scene, fit = fit_far_record(seed, names)
    assert fit.is_plausible
    for name, moment in zip(("I1", "I2", "I3"), scene.body.moments, strict=True):
        assert abs(fit.values[name] - moment) < 4.5 * fit.error[name] < 1.0


def test_paths_through_parts_of_the_records_are_counted():
    with pytest.warns(UserWarning, match="did not converge"):
        _, fit = fit_far_record(0, ("velocity",), rotor=(0.1, 0.2, 0.9), max_evaluations=60)
    assert fit.evaluations <= 60 + 20 and not fit.has_converged
    assert min(fit.scene.body.moments) > 1e-5 * max(fit.scene.body.moments)  # no needle


@pytest.mark.parametrize(
    ("spin", "precession", "is_discrete"), [(1.5, 2.0, True), (0.8, 0.7, False)]
)
def test_another_motion_that_fits_as_well_is_named(spin, precession, is_discrete):
    """Exchange vertical and axial momentum of a symmetric top, which leaves its nutation as it was.

    The moment I3 = axial momentum / spin has then another value. If the two are almost equal, the
    fit does not determine I3, and this is all that it says.
    """
    body = kr.Body.symmetric(1.0, 0.73, 0.75, -0.29, unphysical=True)
    scene = kr.Scene.spinning(body, spin=spin, tilt=2.0, precession=precession, gravity=3.4)
    path, rng = kr.solve(scene, np.linspace(0.02, 5.0, 80)), np.random.default_rng(0)
    values = {n: getattr(path, n) + 1e-3 * rng.normal(size=80) for n in ("nutation", "spin")}
    other = kr.Body.symmetric(1.0, 0.70, 0.69, -0.29, unphysical=True)
    guess = kr.Scene(other, body_velocity=(0.3, 0.2, -0.1), gravity=3.4, attitude=(0, 0.6, 0.8, 0))
    fit = kr.fit(guess, kr.Record(path.t, values, 1e-3))
    assert fit.is_plausible and np.isfinite(fit.error["I3"]) == is_discrete
    found = [fit.values["I3"], *(float(s.split("I3 = ")[1].rstrip(".")) for s in fit.ambiguous)]
    true = [path.vertical_momentum[0] / spin, 0.75] if is_discrete else found[:1]
    assert sorted(found) == pytest.approx(true, abs=0.01)


@pytest.mark.parametrize("names", [("velocity",), ("apex", "m")])
@pytest.mark.parametrize("axis", [None, 0, 1, 2])
def test_the_half_turn_of_the_body_nearest_the_guess_is_returned(names, axis):
    """Start from the attitude after a half turn, but from another motion."""
    signs = np.ones(3) if axis is None else np.where(np.arange(3) == axis, 1.0, -1.0)
    half_turn = (1.0, 0.0, 0.0, 0.0) if axis is None else (0.0, *0.5 * (signs + 1.0))
    com = np.array((0.013, -0.024, -0.26))
    body = kr.Body(1.0, (2.15, 1.34, 1.44), com=com, unphysical=True)
    q = np.array((0.6468, 0.0551, -0.2788, 0.7077))
    words = {"gravity": 0.5675, "turning": (0.033, -0.38, 0.42), "friction": 0.062}
    momentum = (0.097, -5.733, -0.987)
    truth = kr.Scene(body, momentum=momentum, attitude=q / np.linalg.norm(q), **words)
    guess = kr.Scene(
        kr.Body(1.0, body.moments, com=1.1 * signs * com, unphysical=True),
        attitude=kr.quaternion.multiply(truth.attitude, half_turn),
        body_velocity=signs * kr.solve(truth, [0.0]).body_velocity[0] + (2.0, -1.0, 1.0),
        **words,
    )
    record = simulate(truth, np.linspace(0.02, 4.0, 60), dict.fromkeys(names, 2e-3), seed=1)
    fit = kr.fit(guess, record, ("start", "com"))
    assert fit.is_plausible and kr.attitude_error(fit.scene.attitude, guess.attitude) < 0.2
    assert abs(fit.values["com_z"] + 0.26 * signs[2]) < 4.5 * fit.error["com_z"] < 0.1
    assert sum("half turn" in sentence for sentence in fit.unidentified) == 3


def test_equivalent_motions_resolve_to_the_one_near_the_guess():
    """Check the side of the centre of mass, the phase of shaking and the azimuth of turning."""
    for side in (1.0, -1.0):
        body = kr.Body(1.0, GUESS.body.moments, com=(0.0, 0.0, 0.3 * side), unphysical=True)
        assert (
            kr.fit(GUESS.replace(body=body), simulate_gyroscope(n=150), BODY).values["com_z"] * side
            > 0.0
        )
    turned = kr.quaternion.multiply((0.0, 1.0, 0.0, 0.0), HEAVY.attitude)
    near = kr.Body(1.0, HEAVY.body.moments, com=0.05 * np.array(HEAVY.body.com), unphysical=True)
    start = kr.Scene(near, attitude=turned, body_velocity=(3.0, 2.0, 12.0), gravity=9.81)
    found = kr.fit(start.vary(gravity=[9.81]), simulate_gyroscope(n=100), ("start", "com"))
    assert found.is_plausible and np.allclose(found.scene.body.com, HEAVY.body.com, atol=0.01)
    scene = HEAVY.replace(**SUPPORT)
    guess = scene.replace(shaking=(0.005, 15.0, 9.7), turning=(0.35, -0.1, 1.4))
    record = simulate(scene, np.linspace(0.0, 3.0, 200), {"inertial_velocity": 0.01}, seed=1)
    fit = kr.fit(guess, record, ("start", "turning", "shaking"))
    assert 0.8 < fit.chi2 / fit.dof < 1.2 and fit.scene.shaking[0] == pytest.approx(0.02, rel=0.1)
    assert abs(fit.scene.shaking[2] - 0.4) < 4.0 * fit.error["shaking_phase"]
    direction = np.arctan2(fit.scene.turning[1], fit.scene.turning[0])
    assert direction == pytest.approx(np.arctan2(-0.1, 0.35), abs=1e-12)


def test_a_fit_of_guesses_returns_the_best():
    fast = kr.solve(HEAVY, [0.0]).velocity[0] * 1.01
    velocities, gravities = [(0.0, 0.0, -5.0), fast, (5.0, 0.0, 0.0)], [9.0, 9.81, 10.6]
    guesses = HEAVY.vary(velocity=velocities, gravity=gravities)
    best = kr.fit(guesses, simulate_gyroscope(), "start")
    for i in (0, 2):
        with pytest.warns(UserWarning, match="sigma explains"):
            assert kr.fit(guesses[i : i + 1], simulate_gyroscope(), "start").cost > 2.0 * best.cost
    assert 0.8 < best.chi2 / best.dof < 1.2 and best.scene.gravity == 9.81
    values = np.array(simulate_gyroscope(n=150).series[0].values)
    values[:60] = np.nan  # missing at the beginning
    t = np.linspace(0.0, 3.0, 150)
    late = kr.fit(
        HEAVY.vary(velocity=[(4.0, 4.0, 9.0)]),
        kr.Record(t, {"body_velocity": values}, SIGMA),
        ("velocity", "com"),
    )
    assert late.is_plausible and np.allclose(late.scene.body.com, HEAVY.body.com, atol=0.02)


def fit_sparse_attitudes(t, free=("start", "moments"), change=0.0):
    """Fit the attitudes of a symmetric top that makes 3.2 turns per second."""
    guess = change_parameters(SYMMETRIC, {"body_velocity_z": change})
    return kr.fit(guess, simulate(SYMMETRIC, t, {"q": 0.01}), free)


def test_an_equally_good_spin_is_named():
    fit = fit_sparse_attitudes(0.2 * np.arange(100))
    assert fit.has_converged and fit.unidentified == () and len(fit.ambiguous) == 1
    faster = np.linalg.norm(kr.solve(fit.scene, [0.0]).body_velocity) + 2.0 * np.pi / 0.2
    spin = float(fit.ambiguous[0].split("angular velocity ")[1].split()[0])
    assert abs(spin - faster) < 0.1 and "Ambiguous: the spin:" in str(fit)


@pytest.mark.parametrize(
    ("t", "free", "change"),
    [
        (0.02 * np.arange(100), ("start", "moments"), 0.0),
        (0.2 * np.arange(100), "start", 0.0),
        (np.sort(np.random.default_rng(2).uniform(0.0, 20.0, 100)), ("start", "moments"), 0.0),
        (0.2 * np.arange(40), "start", -2.0 * np.pi / 0.2),
    ],
    ids=["many samples a turn", "known moments", "irregular times", "a wrong guess"],
)
def test_a_spin_that_is_determined_is_not_called_ambiguous(t, free, change):
    fit = fit_sparse_attitudes(t, free, change)
    assert fit.ambiguous == () and "Ambiguous" not in str(fit) and 0.5 < fit.chi2 / fit.dof < 1.5
    assert abs(fit.values["body_velocity_z"] - 20.0) < 4.0 * fit.error["body_velocity_z"] < 0.05


@pytest.mark.parametrize(
    ("scene", "sigmas", "free", "begin"),
    [
        (CHAOTIC, {"q": 0.01}, BODY, 0.0),
        (HEAVY, {"body_velocity": SIGMA}, ("start", "moments"), -1.0),
        (HEAVY, {"specific_force": 0.05}, ("velocity", "moments"), 0.0),
        (HEAVY, {"energy": 0.1}, ("gravity",), 0.0),
        (WITH_ROTOR, {"body_velocity": SIGMA}, ("start", "rotor"), 0.0),
        (
            HEAVY.replace(friction=0.5, **SUPPORT),
            {"body_velocity": SIGMA},
            ("start", "turning", "shaking", "friction"),
            0.0,
        ),
    ],
)
def test_pieces_agree_with_a_single_motion(scene, sigmas, free, begin):
    t = np.linspace(begin, 8.0 if scene is CHAOTIC else 3.0, 120)
    record = simulate(scene, t, sigmas)
    single, pieces = (kr.fit(scene, record, free, pieces=count) for count in (1, 3))
    assert single.piece_starts == () and len(pieces.piece_starts) == 3
    assert 0.0 in pieces.piece_starts and "3 joined pieces" in str(pieces)
    assert pieces.unidentified == single.unidentified and pieces.nonlinearity == 0.0
    for name, error in single.error.items():
        if np.isfinite(error):
            assert abs(pieces.values[name] - single.values[name]) < 0.25 * error
            assert pieces.error[name] == pytest.approx(error, rel=0.1)
    one, other = single.path.body_velocity, pieces.path.body_velocity
    assert np.abs(one - other).max() < 2e-3 * np.abs(one).max()
    assert pieces.path.t == pytest.approx(t)


def test_a_chaotic_motion_is_fitted_by_multiple_shooting():
    """Check that a record of many Lyapunov times determines moments from a wrong guess."""
    rate = kr.chaos(CHAOTIC, 200.0).lyapunov
    record = simulate(CHAOTIC, np.linspace(0.0, 20.0 / rate, 400), {"q": 0.01})
    body = CHAOTIC.body
    wrong = kr.Body(
        body.mass,
        np.array(body.moments) * (1.5, 0.9, 1.05),
        com=np.array(body.com) * 1.1,
        unphysical=True,
    )
    fit = kr.fit(CHAOTIC.replace(body=wrong, velocity=(0.0, 0.0, 1.0)), record, BODY)
    assert fit.has_converged and 0.85 < fit.chi2 / fit.dof < 1.15 and len(fit.piece_starts) > 10
    for k, (ratio, error) in enumerate(fit.moment_ratios.values()):
        assert abs(ratio - body.moments[k] / body.moments[2]) < 4.0 * error < 0.02


def test_the_noise_of_pieces_is_estimated():
    record = simulate(CHAOTIC, np.linspace(0.0, 6.0, 60), {"q": 0.01}, sigma=None)
    fit = kr.fit(CHAOTIC, record, BODY, pieces=3)
    assert len(fit.piece_starts) == 3 and abs(fit.sigma[0]["q"] / 0.01 - 1.0) < 0.2


@pytest.mark.parametrize("loss", ["linear", "soft"])
def test_residuals_that_noise_does_not_explain_are_reported(loss):
    with pytest.warns(UserWarning, match="false minimum"):
        found = kr.fit(HEAVY, simulate_gyroscope(n=80, noise=2.0, sigma=0.5 * SIGMA), loss=loss)
    assert 1.8 < found.excess < 2.2 and found.is_plausible is False
    assert "(not plausible)" in str(found) and "(not plausible)" in found.to_toml()
    good = kr.fit(HEAVY, simulate_gyroscope(n=80), loss=loss)
    assert good.excess == 0.0 and good.is_plausible is True and "(plausible)" in str(good)
    unknown = simulate(HEAVY, np.linspace(0.0, 3.0, 80), {"body_velocity": SIGMA}, sigma=None)
    found = kr.fit(HEAVY, unknown, loss=loss)
    assert found.is_plausible is None and "plausible" not in str(found)


def test_a_motion_of_another_top_is_not_plausible():
    with pytest.warns(UserWarning, match="another top"):
        other = kr.fit(GUESS, simulate_gyroscope(SYMMETRIC, end=1.0), ("velocity",))
    assert other.is_plausible is False and other.has_converged


@pytest.mark.parametrize("sigma", [0.02, None])
def test_noise_that_no_motion_fits_is_reported(sigma):
    noise = 5.0 * np.random.default_rng(0).normal(size=(60, 3))
    record = kr.Record(np.linspace(0.0, 3.0, 60), {"body_velocity": noise}, sigma)
    with pytest.warns(UserWarning, match="No motion of this scene fits the records"):
        fit = kr.fit(GUESS, record, BODY, max_evaluations=200)
    assert fit.misfit > 0.5 and fit.evaluations < 300 and "No motion of this scene" in str(fit)


def test_large_noise_of_known_sigma_is_not_reported_as_misfit():
    fit = kr.fit(HEAVY, simulate_gyroscope(sigma=20.0), "velocity")
    assert fit.misfit > 0.5 and fit.is_plausible and "No motion" not in str(fit)


@pytest.mark.parametrize("kind", ["gyroscope", "tip", "a first row"])
def test_outliers_do_not_spoil_a_soft_fit(kind):
    rng, t = np.random.default_rng(7), np.linspace(0.0, 3.0, 200)
    quantity, sigma = ("body_velocity", SIGMA) if kind == "gyroscope" else ("apex", 0.005)
    scene = HEAVY if kind == "gyroscope" else SYMMETRIC
    values = np.array(simulate(scene, t, {quantity: sigma}).series[0].values)
    rows = np.arange(200) < 1 if kind == "a first row" else rng.random(200) < 0.03
    values[rows] = rng.uniform(-1.0, 1.0, (int(rows.sum()), 3)) * np.abs(values).max()
    bad = kr.Record(t, {quantity: values}, sigma)
    if kind == "gyroscope":
        assert has_ratios(kr.fit(GUESS, bad, BODY, loss="soft"), HEAVY)
    else:
        soft = kr.fit(SYMMETRIC_GUESS, bad, ("start", "moments"), loss="soft")
        assert (
            soft.is_plausible and is_near(soft, {"I1 = I2": 1.0}) and soft.error["I1 = I2"] < 0.02
        )


@pytest.mark.filterwarnings("ignore:The residuals are")  # larger than sigma by chance
def test_correlated_residuals_enlarge_the_errors():
    """Compare with the scatter of fits to noise whose neighbours have the correlation 0.9."""
    found, stated = [], []
    t, true = np.linspace(0.0, 3.0, 200), solve_at(HEAVY, np.linspace(0.0, 3.0, 200), "velocity")
    for seed in range(12):
        noise = np.random.default_rng(seed).normal(size=(200, 3))
        for k in range(1, 200):
            noise[k] = 0.9 * noise[k - 1] + np.sqrt(1.0 - 0.81) * noise[k]
        fit = kr.fit(HEAVY, kr.Record(t, {"velocity": true + SIGMA * noise}, SIGMA), "velocity")
        found.append(list(fit.values.values()))
        stated.append(list(fit.error.values()))
        assert 0.7 < fit.residual_correlation < 0.95 and 2.5 < fit.inflation < 6.0
        assert "correlated" in str(fit) and "enlarged" in str(fit)
    assert (np.mean(stated, axis=0) / np.std(found, axis=0) > 0.5).all()
    plain = kr.fit(HEAVY, simulate_gyroscope())
    assert plain.inflation == 1.0 and "correlated" not in str(plain)


def test_one_attitude_reading_beside_a_gyroscope_needs_a_sigma():
    """Check that the free attitude absorbs the heading of the only attitude reading."""
    t, q = np.linspace(0.0, 2.0, 40), np.full((40, 4), np.nan)
    q[20] = simulate(HEAVY, t, {"q": 0.1}).series[0].values[20]
    values = {"body_velocity": simulate_gyroscope(n=40, end=2.0).series[0].values, "q": q}
    with pytest.warns(UserWarning, match="sigma of q is estimated from .* give sigma"):
        found = kr.fit(HEAVY, kr.Record(t, values), "start")
    [sentence] = found.uncertain_sigma
    assert f"Uncertain: {sentence}." in str(found)
    found = kr.fit(HEAVY, kr.Record(t, values, {"q": 0.1}), "start")
    assert found.uncertain_sigma == () and "Uncertain" not in str(found)


def test_only_unknown_noise_is_estimated_with_the_soft_loss():
    t, noise = np.linspace(0.0, 1.0, 60), np.random.default_rng(0).normal(size=(60, 4))
    path = kr.solve(HEAVY, t)
    values = {
        "apex": path.apex + 0.01 * noise[:, :3],
        "energy": path.energy + 2.0 * noise[:, 3],
        "spin": np.full(60, np.nan),
        "nutation": np.where(t < t[4], path.nutation, np.nan),
    }
    with pytest.warns(UserWarning, match="sigma of nutation is estimated from"):
        found = kr.fit(HEAVY, kr.Record(t, values, {"apex": 0.013}), "velocity", loss="soft")
    assert found.sigma[0]["apex"] == 0.013
    spread = 1.4826 * np.median(np.abs(2.0 * noise[:, 3]))
    assert found.sigma[0]["energy"] == pytest.approx(spread, rel=0.03)
    assert np.isnan(found.sigma[0]["spin"]).all()  # nothing was measured


def test_steady_precession_is_reported_as_uninformative():
    body = kr.Body.symmetric(1.0, 1.0, 0.6, 0.4, unphysical=True)
    steady = kr.Scene.spinning(body, spin=20.0, tilt=0.8, steady=True, gravity=9.81)
    fit = kr.fit(steady, simulate(steady, np.linspace(0.0, 4.0, 200), {"apex": 0.01}, seed=1))
    assert fit.nonlinearity > 0.3 and "not normal" in str(fit)


def test_progress_is_reported():
    reports = []
    fit = kr.fit(GUESS, simulate_gyroscope(), BODY, progress=lambda *report: reports.append(report))
    counts = [count for count, _ in reports]
    assert counts == sorted(counts) and counts[0] > 0 and counts[-1] <= fit.evaluations
    assert min(cost for _, cost in reports) < 1.2


def test_an_exception_in_progress_stops_the_fit():
    with pytest.raises(ZeroDivisionError):
        kr.fit(GUESS, simulate_gyroscope(), progress=lambda *_: 1 / 0)


def interrupt_after(count, scene, record):
    """Return the fit that an interrupt keeps, and the costs that were reported before it."""
    costs = []

    def interrupt(_, cost):
        costs.append(cost)
        if len(costs) == count:
            raise KeyboardInterrupt

    with pytest.raises(kr.Interrupted) as interruption:
        kr.fit(scene, record, BODY, progress=interrupt)
    return pickle.loads(pickle.dumps(interruption.value)).result, costs


def test_ctrl_c_keeps_the_best_fit_so_far():
    fit, costs = interrupt_after(4, HEAVY, simulate_gyroscope())
    assert not fit.has_converged and "did not converge" in str(fit)
    assert abs(fit.cost / fit.dof - min(costs)) < 1e-9 * fit.cost
    wrong = HEAVY.replace(velocity=(0.0, 0.0, 1.0))
    members = kr.Scene.stack([HEAVY, wrong])
    whole = kr.fit(HEAVY, simulate_gyroscope(), BODY)
    fit, _ = interrupt_after(20, members, simulate_gyroscope())
    assert fit.has_converged and fit.cost == pytest.approx(whole.cost, rel=1e-6)


def test_ctrl_c_while_another_order_of_quaternions_is_tried_keeps_the_fit():
    t, reports = np.linspace(0.0, 1.0, 30), []
    wrong = kr.Record(t, {"q": np.roll(solve_at(HEAVY, t, "q"), -1, axis=1)}, 1e-3)

    def report(*_):
        reports.append(None)
        if len(reports) == limit:
            raise KeyboardInterrupt

    limit = None
    with pytest.warns(UserWarning, match="name them q_xyzw"):
        whole = kr.fit(HEAVY, wrong, "velocity", max_evaluations=50, progress=report)
    limit, reports = len(reports), []
    with pytest.raises(kr.Interrupted) as interruption:
        kr.fit(HEAVY, wrong, "velocity", max_evaluations=50, progress=report)
    assert interruption.value.result.cost == whole.cost


def test_ctrl_c_before_the_first_motion_keeps_nothing():
    assert interrupt_after(1, HEAVY, simulate_gyroscope())[0] is None


def test_a_fit_that_does_not_converge_is_returned_with_a_warning():
    with pytest.warns(UserWarning, match="did not converge"):
        fit = kr.fit(HEAVY, simulate_gyroscope(), BODY, max_evaluations=3)
    assert not fit.has_converged and fit.evaluations <= 8 and "best so far" in str(fit)


def test_threads_give_the_same_bits(fit):
    with ThreadPoolExecutor(4) as pool:
        others = list(pool.map(lambda _: kr.fit(GUESS, simulate_gyroscope(), BODY), range(3)))
    assert all(other.values == fit.values and other.error == fit.error for other in others)


@pytest.mark.parametrize("factor", [2.0**-40, 2.0**40])
def test_fits_do_not_depend_on_units(fit, factor):
    moments = np.array(GUESS.body.moments) * factor
    body = kr.Body(factor, moments, com=GUESS.body.com, unphysical=True)
    other = kr.fit(GUESS.replace(body=body, momentum=(0, 0, factor)), simulate_gyroscope(), BODY)
    assert (
        np.abs(other.error_of(compute_ratios)[0] / fit.error_of(compute_ratios)[0] - 1.0).max()
        < 1e-6
    )
    assert other.unidentified == fit.unidentified


def test_exact_data_give_the_true_parameters():
    exact = kr.fit(GUESS, simulate_gyroscope(n=200, noise=0.0), BODY)
    assert np.abs(exact.error_of(compute_ratios)[0] - compute_ratios(HEAVY)).max() < 1e-9
