"""The forms of a record: however measurements are given, the fit is the same."""

from functools import cache

import kreisel as kr
import numpy as np
import pandas
import pytest
from fits import HEAVY, PLACE, SIGMA, simulate, simulate_gyroscope, solve_at, to_rotation

T = np.linspace(0.0, 2.0, 40)
FREE = ("start", "moments")
AXES = ("x", "y", "z")
W = np.array(simulate(HEAVY, T, {"body_velocity": SIGMA}).series[0].values)
Q = np.array(simulate(HEAVY, T, {"q": 0.01}).series[0].values)
SIGNS = np.where(np.arange(40) % 3, 1.0, -1.0)[:, None]
HOLES = np.insert(W, [3, 7, 7, 20], np.nan, axis=0), np.insert(T, [3, 7, 7, 20], T[[3, 7, 7, 20]])
COLUMNS = {f"body_velocity_{axis}": column for axis, column in zip(AXES, W.T, strict=True)}
DEGREES = {f"{name} [deg/T]": np.degrees(column) for name, column in COLUMNS.items()}
TABLE = pandas.DataFrame({"t": T, **COLUMNS})
NAMED = {"columns": {"body_velocity": ("a", "b", "c")}, "t": "time", "sigma": SIGMA}
IN_DEGREES = {"sigma": np.degrees(SIGMA)}


def write_csv(file, columns, separator=","):
    rows = zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True)
    lines = [separator.join(map(str, row)) for row in [columns, *rows]]
    file.write_text("\n".join(["", *lines, ""]))
    return file


def rename(columns, names):
    return dict(zip(names, columns.values(), strict=True))


def read_table(table, separator=",", **words):
    """Return a function that writes a table to a file in a folder and reads them as a record."""
    words = {"sigma": SIGMA} | words
    return lambda folder: kr.Record.from_csv(
        write_csv(folder / "record.csv", table, separator), **words
    )


def make_rates(values=W, t=T, sigma=SIGMA, **words):
    return lambda _: kr.Record(t, {"body_velocity": values}, sigma, **words)


def make_attitudes(name, values):
    return lambda _: kr.Record(T, {name: values}, 0.01)


HALVES = [make_rates(W[rows], T[rows])(None) for rows in (slice(25, None), slice(0, 25))]
GYROSCOPE_FORMS = {
    "lists": make_rates(W.tolist(), T.tolist()),
    "commas": read_table({"t": T, **COLUMNS}),
    "semicolons": read_table({"t": T, **COLUMNS}, ";"),
    "tabs": read_table({"t": T, **COLUMNS}, "\t"),
    "named columns": read_table(rename({"t": T, **COLUMNS}, ("time", "a", "b", "c")), **NAMED),
    "words in other columns": read_table(
        {**rename({"t": T, **COLUMNS}, ("time", "a", "b", "c")), "note": ["none"] * 40}, **NAMED
    ),
    "heads with units": read_table({"t [T]": T, **DEGREES}, **IN_DEGREES),
    "degrees in a file": read_table(
        {"t": T, **rename(DEGREES, COLUMNS)}, degrees=True, **IN_DEGREES
    ),
    "pandas": lambda _: kr.Record.from_pandas(TABLE, sigma=SIGMA),
    "an index": lambda _: kr.Record.from_pandas(TABLE.set_index("t"), sigma=SIGMA),
    "pandas in degrees": lambda _: kr.Record.from_pandas(
        pandas.DataFrame({"t": T, **DEGREES}), **IN_DEGREES
    ),
    "degrees": make_rates(np.degrees(W), degrees=True, **IN_DEGREES),
    "components": lambda _: kr.Record(T, COLUMNS, SIGMA),
    "two records": lambda _: HALVES,
    "missing rows": make_rates(*HOLES),
    "sigma by name": make_rates(sigma={"body_velocity": SIGMA}),
    "sigmas of components": make_rates(sigma=[SIGMA] * 3),
    "sigmas of rows": make_rates(sigma=[SIGMA] * 40),
    "sigmas of all values": make_rates(sigma=np.full((40, 3), SIGMA)),
}
ATTITUDE_FORMS = {
    "other signs": make_attitudes("q", Q * SIGNS),
    "scalar last": make_attitudes("q_xyzw", np.roll(Q, -1, axis=1)),
    "attitude": make_attitudes("attitude", Q),
    "attitude, scalar last": make_attitudes("attitude_xyzw", np.roll(Q, -1, axis=1)),
    **{
        f"a rotation as {name}": make_attitudes(name, to_rotation(Q))
        for name in ("q", "q_xyzw", "attitude", "attitude_xyzw")
    },
    "a file": read_table(
        {"t": T, **dict(zip(("q_w", "q_x", "q_y", "q_z"), Q.T, strict=True))}, sigma=0.01
    ),
    "a file, scalar last": read_table(
        {"t": T, **dict(zip("xyzw", np.roll(Q, -1, axis=1).T, strict=True))},
        columns={"attitude_xyzw": tuple("xyzw")},
        sigma=0.01,
    ),
    "degrees": lambda _: kr.Record(T, {"q": Q}, np.degrees(0.01), degrees=True),
}


@cache
def fit_plain_record(is_attitude):
    record = make_attitudes("q", Q) if is_attitude else make_rates()
    return kr.fit(HEAVY, record(None), FREE)


def check_same_fit(record, is_attitude):
    fit, plain = kr.fit(HEAVY, record, FREE), fit_plain_record(is_attitude)
    assert list(fit.values.values()) == pytest.approx(list(plain.values.values()), rel=1e-7)
    assert list(fit.error.values()) == pytest.approx(list(plain.error.values()), rel=1e-6)
    assert fit.chi2 == pytest.approx(plain.chi2) and fit.dof == plain.dof
    assert fit.unidentified == plain.unidentified and fit.is_plausible


@pytest.mark.parametrize("form", GYROSCOPE_FORMS)
def test_all_forms_of_rates_give_the_same_fit(tmp_path, form):
    check_same_fit(GYROSCOPE_FORMS[form](tmp_path), is_attitude=False)


@pytest.mark.parametrize("form", ATTITUDE_FORMS)
def test_attitudes_have_the_names_and_forms_of_a_scene(tmp_path, form):
    check_same_fit(ATTITUDE_FORMS[form](tmp_path), is_attitude=True)


@pytest.mark.parametrize(
    "quantity", ["nutation", "spin", "apex", "frame", "body_acceleration_y", "q", "specific_force"]
)
@pytest.mark.parametrize("degrees", [False, True])
def test_a_table_of_a_path_is_a_record(tmp_path, quantity, degrees):
    """Check that a table that kreisel wrote is read back, and that its motion fits exactly."""
    if quantity == "specific_force":
        values = solve_at(HEAVY, T, quantity)
        table = {"t": T, **dict(zip((f"{quantity}_{x}" for x in AXES), values.T, strict=True))}
        file, words = write_csv(tmp_path / "path.csv", table), {"point": PLACE}
    else:
        name, words, file = quantity.removesuffix("_y"), {}, tmp_path / "path.csv"
        kr.solve(HEAVY, T, want=(name,)).to_csv(file, degrees=degrees)
    frame = pandas.read_csv(file)
    for record in (
        kr.Record.from_csv(file, sigma=0.1, **words),
        kr.Record.from_pandas(frame, sigma=0.1, **words),
    ):
        fit = kr.fit(HEAVY, record, "velocity")
        assert fit.chi2 < 1e-15 and fit.has_converged


def test_elements_of_a_frame_may_be_measured_alone(tmp_path):
    """Check each column of a file of a whole frame, and of vectors with some components only."""
    frame = solve_at(HEAVY, T, "frame")
    names = [f"frame_{row}{axis}" for row in "NBT" for axis in AXES]
    for columns in (names, names[2:7]):
        path = kr.solve(HEAVY, T, want=("frame",))
        path.to_csv(tmp_path / "frame.csv")
        record = kr.Record.from_csv(tmp_path / "frame.csv", {n: n for n in columns}, sigma=0.1)
        assert record.size == 40 * len(columns)
        assert kr.fit(HEAVY, record, "velocity").chi2 < 1e-15
    assert frame.shape == (40, 3, 3)


def test_missing_values_are_left_out_and_counted():
    values = np.array(simulate_gyroscope(n=200, end=2.0).series[0].values)
    values[::7] = values[3, 1] = np.nan
    times = np.linspace(0.0, 2.0, 200)
    record = kr.Record(times, {"body_velocity": values}, SIGMA)
    is_complete = ~np.isnan(values).any(axis=1)
    whole = kr.Record(times[is_complete], {"body_velocity": values[is_complete]}, SIGMA)
    fit, other = kr.fit(HEAVY, record), kr.fit(HEAVY, whole)
    assert (
        record.missing == 3 * 29 + 1 and record.size == 600 - 88 and "88 left out" in repr(record)
    )
    assert "88 values are left out" in str(fit) and fit.dof == other.dof + 2
    assert np.isnan(fit.residuals[0]["body_velocity"][7]).all()
    assert abs(fit.values["I1"] - other.values["I1"]) < 0.3 * fit.error["I1"]
    q = [[1.0, 0, 0, 0], [np.nan] * 4, [0, 1.0, 0, 0], [np.nan, 1.0, 0, 0]]
    assert kr.Record(range(4), {"q": q, "spin": [1, 2, 3, np.nan]}).missing == 3 + 3 + 1
    assert "3 times, t = 0 .. 2; spin; 3 numbers; free bias, delay" in repr(
        kr.Record(range(3), {"spin": range(3)}, free=("delay", "bias"))
    )


def test_angles_beyond_a_turn_are_those_within_it():
    shifted = solve_at(HEAVY, T, "precession_angle") + 2.0 * np.pi
    record = kr.Record(T, {"precession_angle": shifted}, 0.1)
    many = kr.Record(T, {"precession_angle": np.degrees(shifted) + 3600.0}, 0.1, degrees=True)
    for one in (record, many):
        assert kr.fit(HEAVY, one, "velocity").chi2 < 1e-12


def test_records_are_read_only():
    record = simulate(HEAVY, T, {"specific_force": 0.1})
    [series] = record.series
    for array in (record.t, series.values, series.measured, series.sigma, record.point):
        assert not array.flags.writeable


@pytest.mark.parametrize(("name", "right"), [("q", "q_xyzw"), ("attitude_xyzw", "attitude")])
def test_quaternions_of_the_other_order_are_named(name, right):
    q = solve_at(HEAVY, T, "q")
    wrong = np.roll(q, -1, axis=1) if name == "q" else q
    with pytest.warns(UserWarning, match=f"name them {right}"):
        kr.fit(HEAVY, kr.Record(T, {name: wrong}, 1e-3), max_evaluations=200)
