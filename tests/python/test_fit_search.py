"""Tests of how kreisel.fit searches, reports progress and handles interruptions."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call, make_raiser
from fits import GUESS, HEAVY, SIGMA, SYMMETRIC, gyroscope, ratios
from kreisel._cli import fit_command
from kreisel._fit.initial_guess import guess_parameters_from_records
from kreisel._fit.multiple_shooting import choose_segment_count
from kreisel._fit.parameters import FreeParameters, convert_scene_to_fit_point, expand_free_names
from kreisel._fit.rotations import compute_rotation_quaternions, multiply_quaternions
from kreisel._fit.search_session import SearchSession

FREE = ("start", "moments", "com")
CHAOTIC = kr.scenes.asymmetric


def attitudes(end, n, seed=0):
    """Return noisy measurements of the attitude of a chaotic top."""
    t = np.linspace(0.0, end, n)
    turns = compute_rotation_quaternions(0.01 * np.random.default_rng(seed).normal(size=(n, 3)))
    q = multiply_quaternions(kr.solve(CHAOTIC, t, "taylor").q, turns)
    return kr.Record(t, {"q": q}, 0.01)


def chaotic_guess():
    body = CHAOTIC.body
    moments = np.array(body.moments) * (1.5, 0.9, 1.05)
    other = kr.Body(body.mass, moments, com=np.array(body.com) * 1.1, unphysical=True)
    return CHAOTIC.replace(body=other, velocity=(0.0, 0.0, 1.0))


def moment_ratios(scene):
    moments = np.array(scene.body.moments)
    return moments[:2] / moments[2]


def test_multiple_shooting_agrees_with_a_single_motion():
    record = attitudes(12.0, 240)
    single = kr.fit(CHAOTIC, record, FREE, pieces=1)
    pieces = kr.fit(chaotic_guess(), record, FREE, pieces=6)
    assert single.piece_starts == () and pieces.piece_starts == tuple(np.linspace(0, 12, 7)[:-1])
    one, other = single.error_of(moment_ratios), pieces.error_of(moment_ratios)
    assert (np.abs(one[0] - other[0]) < 0.02 * one[1]).all()
    assert np.abs(other[1] / one[1] - 1.0).max() < 0.02
    assert pieces.unidentified == single.unidentified and "6 joined pieces" in str(pieces)
    angles = kr.attitude_error(pieces.path.q, single.path.q)
    assert angles.max() < 1e-3 and (pieces.path.t == record.t).all()


def test_pieces_without_a_measured_motion_start_from_the_motion_of_the_scene():
    t = np.linspace(0.0, 3.0, 120)
    noise = 0.1 * np.random.default_rng(0).normal(size=120)
    record = kr.Record(t, {"energy": kr.solve(HEAVY, t).energy + noise}, 0.1)
    fit = kr.fit(HEAVY.replace(gravity=9.5), record, "gravity", pieces=3)
    single = kr.fit(HEAVY.replace(gravity=9.5), record, "gravity")
    assert len(fit.piece_starts) == 3
    assert abs(fit.values["gravity"] - single.values["gravity"]) < 0.1 * single.error["gravity"]


def test_a_chaotic_motion_is_fitted_by_multiple_shooting():
    rate = kr.lyapunov(CHAOTIC, 500.0).value
    fit = kr.fit(chaotic_guess(), attitudes(15.0 / rate, 800), FREE)
    found, error = fit.error_of(moment_ratios)
    assert fit.has_converged and 0.85 < fit.chi2 / fit.dof < 1.15
    assert len(fit.piece_starts) > 10
    assert (np.abs(found - moment_ratios(CHAOTIC)) < 4.0 * error).all() and (error < 0.003).all()


def test_a_single_motion_that_fits_is_divided_if_errors_grow_much(monkeypatch):
    record = attitudes(12.0, 120)
    whole = kr.fit(CHAOTIC, record, "velocity")
    monkeypatch.setattr("kreisel._fit.search_session._CHAOTIC", 5)
    parts = kr.fit(CHAOTIC, record, "velocity")
    assert whole.piece_starts == () and len(parts.piece_starts) >= 5
    for name, value in whole.values.items():
        assert abs(parts.values[name] - value) < 0.1 * whole.error[name]


def begin_search(record, scene=GUESS):
    """Return a new fit session for a record, and the initial guesses computed from this record."""
    parameters = FreeParameters(scene, expand_free_names(FREE), [record])
    session = SearchSession(parameters, (record,), "linear", 500, None)
    return session, guess_parameters_from_records(parameters, [record])


def test_quantities_without_measurements_agree_with_all_motions():
    t = np.linspace(0.0, 1.0, 30)
    values = {"apex": kr.solve(HEAVY, t).apex, "spin": np.full(30, np.nan)}
    session, _ = begin_search(kr.Record(t, values, 0.01), HEAVY)
    until, cost = session._find_match_end_and_cost(session.parameters.start)
    assert until == 1.0 and cost < 1e-12


def test_the_number_of_parts_of_the_records_is_limited(monkeypatch):
    monkeypatch.setattr("kreisel._fit.search_session._PARTS_MOST", 2)
    session, _ = begin_search(gyroscope())
    tried = []
    session._fit_point_roughly = lambda part, point: tried.append(part.size) or point
    point = session._fit_growing_time_spans(session.parameters.start, 0.0)
    assert point is session.parameters.start
    assert len(tried) == 2 and tried[0] < tried[1] < session.model.size


def test_pieces_that_cannot_fit_are_tried_once(monkeypatch):
    monkeypatch.setattr("kreisel._fit.search_session._PIECES_TRIED", 2)
    noise = 5.0 * np.random.default_rng(0).normal(size=(30, 3))
    session, guesses = begin_search(kr.Record(np.linspace(0, 3, 30), {"body_velocity": noise}, 0.1))
    for guess in guesses:
        assert choose_segment_count(guess.point, session.records) == 3
    session._try_multiple_shooting(guesses, None, 3)
    count = session.evaluations
    assert session.best is None and count > 0
    session._try_multiple_shooting(guesses, None, 2)
    assert session.best is None and session.evaluations == count


def test_pieces_without_measurements_are_not_tried_first():
    rates = gyroscope(n=100).series[0].values.copy()
    rates[:80] = np.nan
    session, guesses = begin_search(
        kr.Record(np.linspace(0, 3, 100), {"body_velocity": rates}, 0.1)
    )
    assert session._try_gapped_fit(guesses[0], 20) and session.evaluations == 0


def test_a_motion_that_a_guess_explains_is_not_divided(monkeypatch):
    monkeypatch.setattr("kreisel._fit.search_session._CHAOTIC", 2)
    session, guesses = begin_search(gyroscope())
    assert choose_segment_count(guesses[0].point, session.records) >= 2
    session._try_multiple_shooting(guesses, None, 2)
    assert session.best is None and session.evaluations == 0


def test_the_noise_of_pieces_is_estimated():
    given = attitudes(6.0, 60)
    fit = kr.fit(CHAOTIC, kr.Record(given.t, {"q": given.series[0].values}), FREE, pieces=3)
    assert len(fit.piece_starts) == 3 and abs(fit.sigma[0]["q"] / 0.01 - 1.0) < 0.2


def test_missing_values_at_the_beginning_do_not_change_a_fit_of_guesses():
    record = gyroscope(n=150)
    values = record.series[0].values.copy()
    values[:60] = np.nan
    holes = kr.Record(record.t, {"body_velocity": values}, SIGMA)
    cut = kr.Record(record.t[60:], {"body_velocity": values[60:]}, SIGMA)
    guesses = HEAVY.vary(velocity=[(4.0, 4.0, 9.0)])
    one, other = (kr.fit(guesses, r, ("velocity", "com")) for r in (holes, cut))
    assert one.chi2 < 1.2 * one.dof
    for name, value in one.values.items():
        assert abs(other.values[name] - value) < 0.01 * one.error[name]


def test_a_reversed_centre_of_mass_is_turned_to_the_side_of_the_guess():
    """Fit gyroscope data, which do not change if vertical and centre of mass are both reversed."""
    com = np.array(HEAVY.body.com)
    turned = multiply_quaternions(np.array([0.0, 1.0, 0.0, 0.0]), np.array(HEAVY.attitude))
    body = kr.Body(1.0, HEAVY.body.moments, com=0.05 * com, unphysical=True)
    start = kr.Scene(body, attitude=turned, body_velocity=(3.0, 2.0, 12.0), gravity=9.81)
    found = kr.fit(start.vary(gravity=[9.81]), gyroscope(n=100), ("start", "com"))
    assert found.chi2 < 1.2 * found.dof
    assert np.allclose(found.scene.body.com, com, atol=0.01)


def simulate_far_fit(seed, names, free=("start", "moments"), rotor=(0.0, 0.0, 0.0), **words):
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
    "seed, names",
    [
        (1, ("m",)),
        (5, ("m",)),
        (3, ("nutation", "spin")),
        (4, ("specific_force",)),
    ],
)
def test_a_search_from_a_far_guess_finds_the_motion(seed, names):
    scene, fit = simulate_far_fit(seed, names)
    assert fit.is_plausible
    for name, moment in zip(("I1", "I2", "I3"), scene.body.moments, strict=True):
        assert abs(fit.values[name] - moment) < 4.5 * fit.error[name] < 1.0


def test_paths_through_parts_of_the_records_are_counted():
    with pytest.warns(UserWarning, match="did not converge"):
        _, fit = simulate_far_fit(0, ("velocity",), rotor=(0.1, 0.2, 0.9), max_evaluations=60)
    assert fit.evaluations <= 60 + 20 and not fit.has_converged
    assert min(fit.scene.body.moments) > 1e-5 * max(fit.scene.body.moments)


def test_another_motion_that_fits_as_well_is_named():
    """Exchange vertical and axial momentum of a symmetric top, which leaves its nutation as it was.

    The moment I3 = axial momentum / spin has then another value.
    """
    body = kr.Body.symmetric(1.0, 0.73, 0.75, -0.29, unphysical=True)
    scene = kr.Scene.spinning(body, spin=0.8, tilt=2.0, precession=0.7, gravity=3.4)
    path, rng = kr.solve(scene, np.linspace(0.02, 5.0, 80)), np.random.default_rng(0)
    values = {n: getattr(path, n) + 1e-3 * rng.normal(size=80) for n in ("nutation", "spin")}
    other = kr.Body.symmetric(1.0, 0.70, 0.69, -0.29, unphysical=True)
    guess = kr.Scene(other, body_velocity=(0.3, 0.2, -0.1), gravity=3.4, attitude=(0, 0.6, 0.8, 0))
    fit = kr.fit(guess, kr.Record(path.t, values, 1e-3))
    assert fit.is_plausible and any("another one fits equally well" in s for s in fit.ambiguous)


@pytest.mark.parametrize("names", [("velocity",), ("apex", "m")])
def test_the_half_turn_of_the_body_nearest_the_guess_is_returned(names):
    body = {"mass": 1.0, "inertia": (2.15, 1.34, 1.44), "unphysical": True}
    words = {"gravity": 0.5675, "turning": (0.033, -0.38, 0.42), "friction": 0.062}
    truth, guess = (
        kr.Scene(
            kr.Body(com=com, **body),
            momentum=m,
            attitude=np.array(q) / np.linalg.norm(q),
            **words,
        )
        for com, m, q in (
            ((0.013, -0.024, -0.26), (0.097, -5.733, -0.987), (0.6468, 0.0551, -0.2788, 0.7077)),
            ((0.0145, -0.0262, -0.286), (0.2, -5.83, -1.67), (0.6396, 0.0896, -0.3206, 0.6929)),
        )
    )
    path, rng = kr.solve(truth, np.linspace(0.02, 4.0, 100)), np.random.default_rng(1)
    values = {name: getattr(path, name) + 2e-3 * rng.normal(size=(100, 3)) for name in names}
    fit = kr.fit(guess, kr.Record(path.t, values, 2e-3), ("start", "com"))
    assert fit.is_plausible and kr.attitude_error(fit.scene.attitude, truth.attitude) < 0.1
    assert abs(fit.values["com_z"] + 0.26) < 4.5 * fit.error["com_z"] < 0.1
    assert sum("half turn" in sentence for sentence in fit.unidentified) == 3


def test_progress_is_reported():
    reports = []
    fit = kr.fit(GUESS, gyroscope(), FREE, progress=lambda *report: reports.append(report))
    counts = [count for count, _ in reports]
    assert counts == sorted(counts) and counts[-1] <= fit.evaluations
    assert min(cost for _, cost in reports) < 1.2


def test_an_exception_in_progress_stops_the_fit():
    with pytest.raises(ZeroDivisionError):
        kr.fit(GUESS, gyroscope(), progress=lambda *_: 1 / 0)


def test_ctrl_c_keeps_the_best_fit_so_far():
    reports = []

    def interrupt(count, cost):
        reports.append(cost)
        if len(reports) == 4:
            raise KeyboardInterrupt

    with pytest.raises(kr.FitInterrupted) as interruption:
        kr.fit(HEAVY, gyroscope(), FREE, progress=interrupt)
    fit = interruption.value.fit
    assert fit is not None and not fit.has_converged and "did not converge" in str(fit)
    assert abs(fit.cost / fit.dof - min(reports)) < 1e-9 * fit.cost


def test_ctrl_c_before_the_first_motion_keeps_nothing(monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("kreisel._fit.residuals.solve", interrupt)
    with pytest.raises(kr.FitInterrupted) as interruption:
        kr.fit(GUESS, gyroscope(), FREE)
    assert (
        interruption.value.fit is None
        and pickle.loads(pickle.dumps(interruption.value)).fit is None
    )


def test_a_fit_that_does_not_converge_is_returned_with_a_warning():
    with pytest.warns(UserWarning, match="did not converge"):
        fit = kr.fit(HEAVY, gyroscope(), FREE, max_evaluations=3)
    assert not fit.has_converged and fit.evaluations <= 8 and "best so far" in str(fit)


@pytest.mark.parametrize("friction, pieces", [(0.0, None), (0.0, 2), (1e-12, None)])
def test_a_start_that_takes_too_many_steps_is_refused(monkeypatch, friction, pieces):
    calls = []
    for module in ("residuals", "search_session"):
        monkeypatch.setattr(f"kreisel._fit.{module}.STEPS_MOST", 1000)
    monkeypatch.setattr(
        "kreisel._fit.residuals.solve", lambda *a, **k: calls.append(a) or kr.solve(*a, **k)
    )
    fast = HEAVY.replace(velocity=(0.0, 0.0, 1e5), friction=friction)
    record = kr.Record(np.linspace(0.0, 1.0, 20), {"energy": np.ones(20)}, 1.0)
    with pytest.raises(
        kr.Error, match=r"the largest number of steps was reached: .* in 1000 steps"
    ):
        kr.fit(fast, record, "gravity", pieces=pieces)
    assert len(calls) < 15
    best = kr.fit(fast.vary(velocity=[(0, 0, 1e5), (0, 0, 1), (0, 0, 2)]), record, "gravity")
    assert best.evaluations > 0 and np.isfinite(best.cost)
    assert abs(np.linalg.norm(kr.solve(best.scene, [0.0]).velocity[0])) < 10.0


def test_residuals_beyond_the_range_of_doubles_are_refused():
    record = kr.Record([0.0, 1.0], {"energy": [1e90, 1e90]}, 1e-180)
    with pytest.raises(ValueError, match="the residuals leave the range of doubles"):
        kr.fit(HEAVY, record, "gravity")


def test_a_motion_that_cannot_be_computed_has_as_many_pieces_as_possible():
    record = kr.Record(np.linspace(-2.0, 2.0, 50), {"energy": np.ones(50)})
    rest = HEAVY.replace(velocity=(0, 0, 0), attitude=(1, 0, 0, 0), friction=100.0)
    with pytest.raises(kr.Error, match="friction"):
        kr.solve(rest, [-2.0])
    assert choose_segment_count(convert_scene_to_fit_point(rest), [record]) == 5


def test_threads_give_the_same_bits():
    record = gyroscope()
    one = kr.fit(GUESS, record, FREE)
    with ThreadPoolExecutor(4) as pool:
        others = list(pool.map(lambda _: kr.fit(GUESS, record, FREE), range(4)))
    assert all(other.values == one.values and other.error == one.error for other in others)


def test_negative_times_are_fitted():
    t = np.linspace(-1.5, 1.5, 300)
    noise = SIGMA * np.random.default_rng(0).normal(size=(300, 3))
    back, forth = kr.solve(HEAVY, t[t < 0.0][::-1]), kr.solve(HEAVY, t[t >= 0.0])
    values = np.concatenate((back.body_velocity[::-1], forth.body_velocity)) + noise
    fit = kr.fit(GUESS, kr.Record(t, {"body_velocity": values}, SIGMA), FREE)
    found, error = fit.error_of(ratios)
    assert (np.abs(found - ratios(HEAVY)) < 4.0 * error).all()
    assert (fit.path.t == t).all()
    assert np.abs(fit.path.body_velocity - values).max() < 6.0 * SIGMA


def test_the_search_leaves_a_guess_at_rest():
    rest = kr.Scene(GUESS.body, momentum=(0, 0, 0), gravity=9.81)
    fit = kr.fit(rest, gyroscope(), FREE)
    found, error = fit.error_of(ratios)
    assert (np.abs(found - ratios(HEAVY)) < 4.0 * error).all()


def turning(t, free=("start", "moments"), change=0.0):
    """Fit the attitudes of a symmetric top that makes 3.2 turns per second.

    The initial guess of the spin differs from the true value by `change`.
    """
    rng = np.random.default_rng(0)
    turns = compute_rotation_quaternions(0.01 * rng.normal(size=(len(t), 3)))
    q = multiply_quaternions(kr.solve(SYMMETRIC, t).q, turns)
    velocity = kr.solve(SYMMETRIC, [0.0]).body_velocity[0] + (0.0, 0.0, change)
    words = {"attitude": SYMMETRIC.attitude, "gravity": SYMMETRIC.gravity}
    start = kr.Scene(SYMMETRIC.body, body_velocity=velocity, **words)
    return kr.fit(start, kr.Record(t, {"q": q}, 0.01), free)


def test_an_equally_good_spin_is_named():
    fit = turning(0.2 * np.arange(100))
    assert fit.has_converged and fit.unidentified == () and len(fit.ambiguous) == 1
    faster = np.linalg.norm(kr.solve(fit.scene, [0.0]).body_velocity) + 2.0 * np.pi / 0.2
    spin = float(fit.ambiguous[0].split("angular velocity ")[1].split()[0])
    assert abs(spin - faster) < 0.1 and "Ambiguous: the spin:" in str(fit)


@pytest.mark.parametrize(
    "t, free",
    [
        (0.02 * np.arange(100), ("start", "moments")),
        (0.2 * np.arange(100), "start"),
        (np.sort(np.random.default_rng(2).uniform(0.0, 20.0, 100)), ("start", "moments")),
    ],
    ids=["many samples a turn", "known moments", "irregular times"],
)
def test_a_spin_that_is_determined_is_not_called_ambiguous(t, free):
    fit = turning(t, free)
    assert fit.ambiguous == () and "Ambiguous" not in str(fit)
    assert abs(fit.values["body_velocity_z"] - 20.0) < 4.0 * fit.error["body_velocity_z"] < 0.05


def test_a_wrong_spin_is_corrected_if_the_moments_are_known():
    fit = turning(0.2 * np.arange(40), "start", -2.0 * np.pi / 0.2)
    assert fit.ambiguous == () and 0.5 < fit.chi2 / fit.dof < 1.5
    assert abs(fit.values["body_velocity_z"] - 20.0) < 4.0 * fit.error["body_velocity_z"] < 0.05


@pytest.mark.parametrize("sigma", [0.02, None])
def test_noise_that_no_motion_fits_is_reported(sigma):
    noise = 5.0 * np.random.default_rng(0).normal(size=(60, 3))
    record = kr.Record(np.linspace(0.0, 3.0, 60), {"body_velocity": noise}, sigma)
    with pytest.warns(UserWarning, match="No motion of this scene fits the records"):
        fit = kr.fit(GUESS, record, FREE, max_evaluations=600)
    assert fit.misfit > 0.5 and fit.evaluations < 700
    assert "No motion of this scene fits the records: the residuals are" in str(fit)


def test_large_noise_of_known_sigma_is_not_reported_as_misfit():
    noise = 20.0 * np.random.default_rng(0).normal(size=(300, 3))
    values = kr.solve(HEAVY, np.linspace(0.0, 3.0, 300)).body_velocity + noise
    record = kr.Record(np.linspace(0.0, 3.0, 300), {"body_velocity": values}, 20.0)
    fit = kr.fit(HEAVY, record, "velocity")
    assert fit.misfit > 0.5 and "No motion" not in str(fit)


@pytest.fixture
def files(tmp_path):
    record = gyroscope()
    table = np.column_stack((record.t, record.series[0].values))
    np.savetxt(tmp_path / "toss.csv", table, delimiter=",", header="time,wx,wy,wz", comments="")
    GUESS.to_toml(tmp_path / "top.toml")
    return tmp_path


def test_the_command_writes_the_scene_and_the_table(files):
    words = "--column body_velocity=wx,wy,wz --time time --sigma 0.02 --free start,moments,com"
    inputs = f"fit {files / 'toss.csv'} {files / 'top.toml'} {words}"
    output = call(inputs, "--save", files / "out.toml", "--csv", files / "out.csv")
    fit = kr.fit(GUESS, gyroscope(), FREE)
    assert output == f"{fit}\n"
    assert kr.Scene.from_toml(files / "out.toml") == fit.scene
    assert (files / "out.csv").read_text().splitlines()[0] == "parameter,value,error,unit"
    assert call(inputs, "--save", "-").startswith("# Fit of 12 parameters")
    call(inputs, "--plot", files / "fit.svg")
    assert (files / "fit.svg").read_text().count("<path") > 20


@pytest.mark.filterwarnings("default")  # a warning must appear as a line of the output
def test_the_command_says_that_noise_does_not_explain_the_residuals(files):
    words = "--column body_velocity=wx,wy,wz --time time --sigma 0.005 --free start,moments,com"
    output = call(f"fit {files / 'toss.csv'} {files / 'top.toml'} {words} --max-evaluations 300")
    assert "Warning: The residuals are" in output and "(not plausible)" in output


def test_the_command_has_an_option_for_the_accelerometer_point(files):
    words = "--column specific_force=wx,wy,wz --time time --sigma 5 --free velocity"
    inputs = f"fit {files / 'toss.csv'} {files / 'top.toml'} {words}"
    assert call(f"{inputs} --point 0,0,0.5").startswith("Fit of 3 parameters to 900 numbers")
    assert "specific_force needs --point" in call(inputs, code=2)
    assert "--point must be 3 numbers" in call(f"{inputs} --point 1,2", code=2)


COLUMNS = "--column body_velocity=wx,wy,wz --time time --sigma 0.02"


@pytest.mark.filterwarnings("default")  # a warning must appear as a line of the output
def test_the_command_returns_1_if_the_fit_does_not_converge(files):
    words = f"{COLUMNS} --free start,moments,com --max-evaluations 3"
    told = call(f"fit {files / 'toss.csv'} {files / 'top.toml'} {words}", code=1)
    assert "Warning: the fit did not converge" in told and "Fit of 12 parameters" in told
    assert "raise --max-evaluations or" in told


@pytest.mark.parametrize("has_result", [True, False])
def test_an_interrupted_command_writes_the_best_fit(files, monkeypatch, has_result):
    best = kr.fit(HEAVY, gyroscope(n=50), "velocity") if has_result else None
    monkeypatch.setattr(
        fit_command, "estimate", make_raiser(kr.FitInterrupted("the fit was interrupted", best))
    )
    line = f"fit {files / 'toss.csv'} {files / 'top.toml'} {COLUMNS} --csv {files / 'out.csv'}"
    told = call(line, code=130)
    assert told == (f"{best}\n" if best else "") + "Error: the fit was interrupted\n"
    assert (files / "out.csv").exists() is has_result


@pytest.mark.parametrize(
    "words, message",
    [
        ("", "unknown column of times 't'"),
        ("--time time", "or pass columns"),
        ("--time time --column spin", "write QUANTITY=VALUE"),
        ("--time time --column spin=wx --sigma zero", "the value must be a number"),
        ("--time time --column spin=wx --sigma 0", "must be positive and finite"),
        ("--time time --column spin=wx --free nothing", "unknown name in free: 'nothing'"),
        ("--time time --column spin=wx --instrument drift", "unknown name in free: 'drift'"),
        ("--time time --column spin=wx --plot fit.csv", "--plot writes .png, not .csv"),
    ],
)
def test_the_command_refuses_invalid_arguments(files, words, message):
    inputs = f"fit {files / 'toss.csv'} {files / 'top.toml'} {words}"
    assert message in call(inputs, code=2)


def test_the_command_refuses_a_missing_file(files):
    message = call(f"fit {files / 'none.csv'} {files / 'top.toml'}", code=2)
    assert message.startswith("Error: No such file") and "none.csv" in message
