"""Tests of degrees and units: arguments and tables in degrees mean the same as those in radians."""

import json
import math

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call
from hypothesis import given, settings
from hypothesis import strategies as st

BODY = kr.Body(0.5, (0.003, 0.003, 0.001), (0, 0, 0.06))
TOP = kr.Scene.spinning(BODY, 30.0, 0.5, 1.0, gravity=9.81)
HEAVY = kr.Scene(
    kr.Body(0.5, (0.003, 0.0035, 0.001), (0, 0, 0.06)), body_velocity=(0, 3, 40), gravity=9.81
)
# All quantities that have an angle or its derivative in their units.
ANGULAR = {
    **dict.fromkeys(["precession_angle", "nutation", "spin_angle"], "rad"),
    **dict.fromkeys(["velocity", "body_velocity", "inertial_velocity", "spin"], "rad/T"),
    "body_acceleration": "rad/T^2",
}
NAMES = ["q", "m", *ANGULAR, "apex", "frame", "energy", "torque"]
T = np.linspace(0.0, 0.5, 6)

# Arguments

SUPPORT = {"turning": ("x", "y", "z"), "shaking": ("amplitude", "rate", "phase")}
STARTS = {  # {name of the start: {argument: endings of its components}}
    "spinning": {"spin": "", "tilt": "", "precession": "", **SUPPORT},
    "steady": {"spin": "", "tilt": ""},
    "from_euler": {"angles": "012", "rates": "012", **SUPPORT},
    "velocity": {"velocity": "xyz", **SUPPORT},
    "body_velocity": {"body_velocity": "xyz", **SUPPORT},
}
OPTIONAL = "precession", "rates", "turning", "shaking"
FLAGS = "steady", "degrees"


def construct(kind, words):
    make = kind.from_euler if "angles" in words else kind.spinning
    return make(BODY, gravity=9.81, **words)


def parse_toml(words):
    table = ", ".join(f"{name} = {json.dumps(value)}" for name, value in words.items())
    body = "body = { mass = 0.5, inertia = [0.003, 0.003, 0.001], com = [0, 0, 0.06] }"
    name = "from_euler" if "angles" in words else "spinning"
    return kr.Scene.from_toml(f"{name} = {{ gravity = 9.81, {table} }}\n{body}\n")


def give_twice(words):
    return {name: v if name in FLAGS else [v, v] for name, v in words.items()}


def write_columns(words, folder, has_units):
    """Return a source of the two equal rows of a CSV file."""
    endings = {name: ends for start in STARTS.values() for name, ends in start.items()}
    angle, heads = "deg" if "degrees" in words else "rad", []
    for name in words:
        unit = angle if name in ("tilt", "angles") else f"{angle}/T"
        units = {"amplitude": "L", "phase": angle}
        names = [f"{name}_{end}" for end in endings[name]] if name not in FLAGS else []
        names = [name] if name in ("spin", "tilt", "precession") else names
        heads += [f"{n} [{units.get(n.rpartition('_')[2], unit)}]" for n in names]
    heads = heads if has_units else [head.partition(" ")[0] for head in heads]
    row = ",".join(str(x) for n, v in words.items() if n not in FLAGS for x in np.ravel(v))
    (folder / "tops.csv").write_text(f"{','.join(heads)}\n{row}\n{row}\n")
    flags = {n: v for n, v in words.items() if n in FLAGS and (n != "degrees" or not has_units)}
    return kr.Source.columns(TOP, folder / "tops.csv", **flags)[:]


WAYS = {
    "Scene": lambda words, _: construct(kr.Scene, words),
    "many": lambda words, _: construct(kr.Scene, give_twice(words)),
    "TOML": lambda words, _: parse_toml(words),
    "vary": lambda words, _: TOP.vary(**give_twice(words)),
    "grid": lambda words, _: kr.Source.grid(TOP, mass=[0.5, 0.5], **words)[:],
    "random": lambda words, _: kr.Source.random(TOP, 2, **give_twice(words))[:],
    "columns": lambda words, folder: write_columns(words, folder, has_units=False),
    "heads": lambda words, folder: write_columns(words, folder, has_units=True),
    "of": lambda words, _: kr.Source.of(TOP.vary(**give_twice(words)))[:],
}
CASES = [
    (way, start)
    for way in WAYS
    for start in STARTS
    if start in ("spinning", "steady", "from_euler") or way not in ("Scene", "many", "TOML")
]


@pytest.mark.parametrize(("way", "start"), CASES)
@settings(max_examples=6, deadline=None)
@given(data=st.data())
def test_all_angles_and_rates_are_given_in_degrees(way, start, data, tmp_path_factory):
    number, words = st.floats(0.05, 3.0), {}
    for name, endings in STARTS[start].items():
        if name not in OPTIONAL or data.draw(st.booleans(), name):
            words[name] = data.draw(st.tuples(*[number] * 3) if endings else number, name)
    degrees = {name: np.degrees(value).tolist() for name, value in words.items()}
    if "shaking" in words:
        degrees["shaking"][0] = words["shaking"][0]
    if start == "steady":
        words["spin"], degrees["spin"] = 100.0, math.degrees(100.0)
        words, degrees = words | {"steady": True}, degrees | {"steady": True}
    folder = tmp_path_factory.mktemp("tops")
    one = WAYS[way](words, folder)
    other = WAYS[way](degrees | {"degrees": True}, folder)
    for name in ("momentum", "attitude", "turning", "shaking"):
        expected = np.asarray(getattr(one, name))
        np.testing.assert_allclose(
            getattr(other, name), expected, rtol=0, atol=1e-14 * (np.abs(expected).max() or 1.0)
        )


def test_sweeps_keep_degrees_in_their_files(tmp_path):
    source = kr.Source.grid(TOP, spin=[600.0, 900.0], tilt=20.0, degrees=True)
    kr.sweep(source, [0.0], folder=tmp_path / "grid", want=("spin",))
    table = kr.read_sweep(tmp_path / "grid").to_pandas()
    units = table.attrs["units"]
    assert (units["spin_given"], units["spin"]) == ("deg/T", "rad/T")
    np.testing.assert_allclose(table["spin"], np.radians(table["spin_given"]), rtol=1e-13)


# Tables


def write_pandas(path, names, words, folder):
    return kr.Record.from_pandas(path.to_pandas(*names, **words))


def write_csv(path, names, words, folder):
    path.to_csv(folder / "top.csv", *names, **words)
    return kr.Record.from_csv(folder / "top.csv")


def write_xarray(path, names, words, folder):
    data = path.to_xarray(*names, **words)
    units = {data[name].attrs["units"] for name in names if name in ANGULAR}
    values = {name: data[name].values for name in names}
    return kr.Record(data["time"].values, values, degrees="deg" in "".join(units))


def run_command(path, names, words, options):
    line = f"solve - --t {','.join(map(repr, path.t.tolist()))} --want {','.join(names)}"
    flags = "".join(f" --{name}" for name in words if words[name])
    return call(f"{line}{flags} {options}", text=path.scene.to_toml())


def solve_to_csv(path, names, words, folder):
    run_command(path, names, words, f"--csv {folder / 'top.csv'}")
    return kr.Record.from_csv(folder / "top.csv")


def solve_to_json(path, names, words, folder):
    data = json.loads(run_command(path, names, words, "--json -"))
    units = {data["units"][name] for name in names if name in ANGULAR}
    values = {name: data[name] for name in names}
    return kr.Record(data["t"], values, degrees="deg" in "".join(units))


WRITERS = [write_pandas, write_csv, write_xarray, solve_to_csv, solve_to_json]


@pytest.mark.parametrize("write", WRITERS)
@settings(max_examples=10, deadline=None)
@given(
    names=st.lists(st.sampled_from(NAMES), min_size=1, max_size=4, unique=True),
    degrees=st.booleans(),
    unwrap=st.booleans(),
)
def test_written_tables_are_read_as_the_same_numbers(
    write, names, degrees, unwrap, tmp_path_factory
):
    path = kr.solve(HEAVY, T, want=names)
    words = {"degrees": degrees, "unwrap": unwrap}
    record = write(path, names, words, tmp_path_factory.mktemp("table"))
    assert record.t.tolist() == T.tolist()
    for series in record.series:
        expected = getattr(path, series.quantity).reshape(len(T), -1)
        expected = expected if series.part is None else expected[:, [series.part]]
        if unwrap and series.is_angle:
            turns = (series.values - expected) / (2.0 * np.pi)
            expected = expected + 2.0 * np.pi * np.rint(turns)
        np.testing.assert_allclose(series.values, expected, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("degrees", [False, True])
def test_events_are_read_as_the_same_numbers(degrees, tmp_path):
    names = ["nutation", "body_velocity", "energy"]
    path = kr.solve(HEAVY, T, events=[kr.events.nutation()], want=names)
    run_command(path, names, {"degrees": degrees}, f"--events nutation --events-csv {tmp_path}/a")
    columns = {**dict.fromkeys(names), "body_velocity": [f"body_velocity_{i}" for i in "xyz"]}
    columns = {name: column or name for name, column in columns.items()}
    record = kr.Record.from_csv(tmp_path / "a", columns)
    assert len(record.t) == len(path.events) > 0
    for series in record.series:
        expected = getattr(path.events.path, series.name).reshape(len(record.t), -1)
        np.testing.assert_allclose(series.values, expected, rtol=1e-14)


@pytest.mark.parametrize("name", [name for name in NAMES if name != "q"])
def test_degrees_change_the_numbers_and_units_of_angular_quantities_alone(name):
    path = kr.solve(HEAVY, T)
    plain, degrees = path.to_pandas(name), path.to_pandas(name, degrees=True)
    factor = 180.0 / np.pi if name in ANGULAR else 1.0
    np.testing.assert_allclose(path.euler(degrees=True), np.degrees(path.euler()), rtol=1e-15)
    np.testing.assert_allclose(degrees, factor * plain, rtol=1e-15)
    for column in plain:
        unit = plain.attrs["units"][column]
        assert unit == ANGULAR[name] if name in ANGULAR else "rad" not in unit
        assert degrees.attrs["units"][column] == unit.replace("rad", "deg")


def test_a_fit_reads_what_solve_writes_in_degrees(tmp_path):
    HEAVY.to_toml(tmp_path / "heavy.toml")
    line = f"solve {tmp_path}/heavy.toml --t 0:0.3:0.01 --want nutation,body_velocity --degrees"
    call(line, "--csv", tmp_path / "top.csv")
    heads, *rows = (tmp_path / "top.csv").read_text().splitlines()
    names = ",".join(head.partition(" ")[0] for head in heads.split(","))
    (tmp_path / "plain.csv").write_text("\n".join([names, *rows, ""]))
    guess = tmp_path / "guess.toml"
    HEAVY.replace(body_velocity=(0, 3.1, 39.5)).to_toml(guess)
    for words in ("top.csv", "top.csv --degrees", "plain.csv --degrees"):
        line = f"fit {tmp_path}/{words} {guess} --free velocity --sigma 1e-3 --save {guess}.fit"
        call(line)
        fit = kr.Scene.from_toml(f"{guess}.fit")
        np.testing.assert_allclose(fit.momentum, HEAVY.momentum, rtol=1e-9, atol=1e-12)


def test_units_that_contradict_are_refused(tmp_path):
    for heads, degrees, word in (
        ("t [s],spin [rad/s]", True, "degrees"),
        ("t,nutation [deg]", False, "degrees"),
        ("t,nutation [deg],spin [rad/s]", None, "spin"),
        ("t,spin [rpm]", None, "rpm"),
    ):
        (tmp_path / "top.csv").write_text(f"{heads}\n{'0.5,' * heads.count(',')}0.5\n")
        with pytest.raises(ValueError, match=word):
            kr.Record.from_csv(tmp_path / "top.csv", degrees=degrees)
