"""Bad arguments of records and fits, and data that cannot be fitted."""

import kreisel as kr
import numpy as np
import pandas
import pytest
from fits import HEAVY, PLACE, simulate, simulate_gyroscope

W = [[1.0, 2.0, 3.0]] * 3
Q = [[1.0, 0.0, 0.0, 0.0]] * 3
SPIN = {"spin": [1.0, 2.0, 3.0]}
RECORD = {"t": [0.0, 0.1, 0.2], "values": SPIN}
TWENTY = simulate_gyroscope(n=20)
FIT = {"scene": HEAVY, "records": TWENTY, "free": "start"}
TABLE = pandas.DataFrame({"t": [0.0, 1.0], "x": [0.1, 0.2], "y": [1.0, 2.0]})
FRAME = {"frame": TABLE, "columns": {"spin": "x"}}
RUBBED = kr.Scene(
    kr.Body(1.0, (1.0, 1.3, 0.6), (0, 0, 0), unphysical=True).turn((0.6, 0.48, 0.0, 0.64)),
    momentum=(0, 0, 1),
    friction=0.1,
    gravity=1,
)
ROTOR = HEAVY.replace(body=HEAVY.body.with_rotor(spin=5.0, inertia=0.3, axis=(1, 2, 3)))


def make_record(values=W, quantity="body_velocity", t=None, sigma=0.1, **words):
    t = np.arange(float(len(values))) if t is None else t
    return kr.Record(t, {quantity: values}, sigma, **words)


def list_rows(function, valid, argument, *rows):
    return [(function, valid, argument, *row) for row in rows]


ROWS = [
    *list_rows(
        kr.Record,
        RECORD,
        "t",
        ([], ValueError, "times"),
        ([[0.0, 0.1, 0.2]], ValueError, "times"),
        ([0.0, 0.2, 0.1], ValueError, r"t\[2\]"),
        ([0.0, np.nan, 0.1], ValueError, r"t\[1\]"),
        ([1j, 2j, 3j], TypeError, "t"),
    ),
    *list_rows(
        kr.Record,
        RECORD,
        "values",
        ({}, ValueError, "empty"),
        ({"omega": W}, ValueError, "velocity"),
        ({"wobble": W}, ValueError, "wobble"),
        ({"kowalewski": [0.0] * 3}, ValueError, "kowalewski"),
        ({"q_w": [1.0] * 3}, ValueError, "attitude"),
        ({"apex": W[:2]}, ValueError, "shape"),
        ({"spin": W}, ValueError, "shape"),
        ({"spin": [1.0, np.inf, 2.0]}, ValueError, "finite"),
        ({"spin": [np.nan] * 3}, ValueError, "NaN"),
        ({"spin": [1.0, 1e150, 2.0]}, ValueError, "units"),
        ({"spin": [0.0, 1e-150, 0.0]}, ValueError, "units"),
        ({"q": [[2.0, 0, 0, 0]] * 3}, ValueError, r"q\[0\]"),
        ({"q": Q, "attitude_xyzw": Q}, ValueError, "twice"),
        ({"nutation": [10.0, 20.0, 30.0]}, ValueError, "degrees"),
        ({"specific_force": W}, ValueError, "point"),
        (3, TypeError, "values"),
        (None, TypeError, "values"),
        ("apex", TypeError, "values"),
        ({3: [1.0] * 3}, TypeError, "strings"),
        ({"spin": "abc"}, TypeError, "spin"),
        ({"spin": None}, TypeError, "spin"),
    ),
    *list_rows(
        kr.Record,
        RECORD,
        "sigma",
        *((bad, ValueError, "sigma") for bad in (0.0, -1.0, np.nan, np.inf, [1.0, 0.0, 1.0])),
        ([1.0] * 2, ValueError, "broadcast"),
        ({"spinn": 1.0}, ValueError, "spin"),
        ("abc", TypeError, "sigma"),
    ),
    *list_rows(
        kr.Record,
        RECORD,
        "free",
        ("drift", ValueError, "bias"),
        ("mounting", ValueError, "mounting"),
        (3, TypeError, "names"),
        ([1], ValueError, "1"),
    ),
    *list_rows(
        kr.Record,
        RECORD | {"values": {"q": Q}},
        "free",
        ("bias", ValueError, "bias"),
        ("scale", ValueError, "scale"),
    ),
    *list_rows(kr.Record, RECORD, "degrees", (1.5, TypeError, "degrees")),
    *list_rows(
        kr.Record,
        RECORD | {"values": {"specific_force": W}},
        "point",
        (None, ValueError, "point"),
        ((1, 2), ValueError, "point"),
        ((1, 2, np.nan), ValueError, "point"),
        ("abc", TypeError, "point"),
        (3.0, (TypeError, ValueError), "point"),
    ),
    *list_rows(kr.Record, RECORD, "point", (PLACE, ValueError, "specific_force")),
    *list_rows(
        kr.Record.from_pandas,
        FRAME,
        "columns",
        (None, ValueError, "x"),
        (3, TypeError, "columns"),
        ({"apex": ("x", 3, "y")}, TypeError, "name"),
        ({"spin": "xx"}, ValueError, "x"),
    ),
    *list_rows(kr.Record.from_pandas, FRAME, "frame", ([1, 2], TypeError, "DataFrame")),
    *list_rows(
        kr.Record.from_pandas, FRAME, "t", ("time", ValueError, "time"), (None, TypeError, "name")
    ),
    *list_rows(
        kr.fit,
        FIT,
        "scene",
        (None, TypeError, "scene"),
        (HEAVY.vary(gravity=[]), ValueError, "members"),
    ),
    *list_rows(
        kr.fit,
        FIT,
        "records",
        ([], ValueError, "empty"),
        ("record", TypeError, "Record"),
        (3, TypeError, "Record"),
        ([HEAVY], TypeError, "Record"),
        (make_record(W[:1]), ValueError, "fewer"),
        (make_record([W[0], W[0]], sigma=None), ValueError, "sigma"),
        (make_record(W, "apex", [1000.0, 1000.2, 1000.5]), ValueError, "subtract"),
        ([TWENTY, make_record([0.5], "velocity_x", [0.5], None)], ValueError, "sigma"),
        ([TWENTY, make_record([1e90] * 2, "energy", [0, 1], 1e-180)], ValueError, "range"),
    ),
    *list_rows(
        kr.fit,
        FIT,
        "free",
        ((), ValueError, "empty"),
        ("mass_", ValueError, "mass"),
        (("com", "lever"), ValueError, "lever"),
        (3, TypeError, "names"),
        ("shaking", ValueError, "rate"),
        (("rotor", "axes"), ValueError, "axes"),
    ),
    *list_rows(
        kr.fit,
        FIT | {"records": make_record([1.0] * 3, "vertical_momentum")},
        "free",
        ("gravity", ValueError, "depend"),
    ),
    *list_rows(
        kr.fit,
        FIT | {"scene": RUBBED},
        "free",
        *((name, ValueError, name) for name in ("com", "axes", "moments")),
    ),
    *list_rows(
        kr.fit,
        FIT | {"scene": RUBBED},
        "records",
        (make_record([0.1] * 9, "body_acceleration_x"), ValueError, "jumps"),
        (make_record(W * 3, "specific_force", point=PLACE), ValueError, "jumps"),
    ),
    *list_rows(kr.fit, FIT | {"scene": ROTOR}, "free", ("axes", ValueError, "rotor")),
    *list_rows(
        kr.fit, FIT | {"scene": kr.scenes.dzhanibekov}, "free", ("lever", ValueError, "com")
    ),
    *list_rows(kr.fit, FIT, "loss", ("soft_l1", ValueError, "soft")),
    *list_rows(
        kr.fit,
        FIT,
        "pieces",
        (0, ValueError, "pieces"),
        (11, ValueError, "10"),
        (2.5, TypeError, "pieces"),
    ),
    *list_rows(kr.fit, FIT, "max_evaluations", (0, ValueError, "max_evaluations")),
    *list_rows(kr.fit, FIT, "progress", (3, TypeError, "progress")),
]


@pytest.mark.parametrize(("function", "valid", "argument", "bad", "exception", "word"), ROWS)
def test_bad_arguments_are_refused(function, valid, argument, bad, exception, word):
    with pytest.raises(exception, match=word):
        function(**valid | {argument: bad})


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("t,spin\n", "numbers"),
        ("time,spin\n0,1\n", "time"),
        ("t,rpm\n0,1\n", "columns"),
        ("t,spin\n0,1\n1,two\n", "row 2"),
        ("t;spin\n0;0,5\n", "decimal points"),
        ("t,spin\n0,1\n1\n", "row 2"),
        ("t,spin,spin\n0,1,2\n", "same name"),
        ("t,spin\n0,\n", "no measurement"),
        ("t,spin [rad/T],spin [deg/T]\n0,1,2\n", "several"),
        ("t,spin [deg/T],nutation [rad]\n0,1,1\n", "deg"),
        ("\xff\xfe", "UTF-8"),
    ],
)
def test_invalid_files_are_refused(tmp_path, text, word):
    (tmp_path / "record.csv").write_bytes(text.encode("latin-1"))
    with pytest.raises(ValueError, match=word):
        kr.Record.from_csv(tmp_path / "record.csv")
    with pytest.raises(OSError):
        kr.Record.from_csv(tmp_path / "none.csv")


def test_a_fit_refuses_bad_arguments_of_its_methods():
    fit = kr.fit(HEAVY, TWENTY, "velocity")
    for function in (lambda _: None, lambda _: "I1", lambda _: 1j):
        with pytest.raises(TypeError, match="numbers"):
            fit.error_of(function)
    for words in ({"n": 0}, {"n": 1, "seed": -1}):
        with pytest.raises(ValueError, match="at least"):
            fit.scatter(**words)


@pytest.mark.parametrize("name", ["body_velocity", "energy"])
def test_records_before_a_start_that_friction_holds_are_refused(name):
    scene = HEAVY.replace(friction=3.0)
    late, path = kr.solve(scene, [4.0]).end, kr.solve(scene, np.linspace(2.0, 6.0, 50))
    before = make_record(getattr(path, name), name, np.linspace(-2.0, 2.0, 50), 0.02)
    with pytest.raises(ValueError, match="friction holds"):
        kr.fit(late, before, ("start", "friction"), max_evaluations=30)


def test_angles_of_a_top_that_stays_upright_are_refused():
    """Check spin angles, which are undefined, and a guess that leans or stays upright."""
    body = kr.Body(1.0, (1.0, 1.3, 0.6), com=(0.0, 0.0, 0.4), unphysical=True)
    upright = kr.Scene(body, body_velocity=(0.0, 0.0, 30.0), gravity=9.81)
    lean = upright.replace(attitude=(np.cos(0.05), np.sin(0.05), 0.0, 0.0))
    readings = simulate(upright, np.linspace(0.0, 2.4, 60), {"spin": 0.02, "spin_angle": 0.02})
    for guess, word in ((lean, "undefined at all"), (upright, "depend")):
        with pytest.raises(ValueError, match=f"spin_angle .*{word}"):
            kr.fit(guess, readings, "start")


def test_a_motion_that_cannot_be_computed_is_refused():
    slow = make_record([1.0] * 20, "energy", np.linspace(0.0, 1.0, 20))
    with pytest.raises(ValueError, match="resolve"):
        kr.fit(HEAVY.replace(velocity=(0.0, 0.0, 1e30)), slow, "gravity")


@pytest.mark.parametrize(
    "values",
    [
        {"spin": [1e100, 0.0, 1.0]},
        {"spin": [1e-100, 0.0, 0.0]},
        {"nutation": [4.0 * np.pi, 0.0, 1.0]},
        {"q": [[1.0009, 0.0, 0.0, 0.0]] * 3},
        {"q": [[np.nan, 9.0, 0.0, 0.0], *Q[:2]]},
    ],
)
def test_values_at_the_limits_and_repeated_times_are_accepted(values):
    assert kr.Record([0.0, 0.0, 1.0], values).size > 2
