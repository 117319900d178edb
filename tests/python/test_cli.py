"""The command line: options mean the same as in Python, and commands print what Python returns."""

import csv
import json
import math
import re
import runpy
import tempfile
import tomllib
from importlib.metadata import version
from pathlib import Path
from typing import get_args

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call, invoke, join_lines, read_csv
from hypothesis import given, settings
from hypothesis import strategies as st
from kreisel.types import QuantityName
from tops import LAGRANGE

ROOT = Path(__file__).parents[2]
UNITS = {
    "": ["q", "frame", "apex", "body_vertical", "q_low"],
    "rad": ["precession_angle", "nutation", "spin_angle"],
    "rad/T": [
        *("velocity", "body_velocity", "inertial_velocity", "spin"),
        *("wheel_rate", "second_wheel_rate", "third_wheel_rate"),
    ],
    "rad/T^2": ["body_acceleration"],
    "M L^2 T^-1": ["m", "body_momentum", "vertical_momentum", "axial_momentum", "m_low"],
    "M L^2 T^-2": ["torque", "kinetic", "potential", "energy"],
    "M L T^-2": ["pivot_force"],
    "T^-4": ["kowalewski"],
    "T^-3": ["goryachev_chaplygin"],
}
UNIT = {name: unit for unit, names in UNITS.items() for name in names}
ENDINGS = {
    (): [""],
    (3,): ["_x", "_y", "_z"],
    (4,): ["_w", "_x", "_y", "_z"],
    (3, 3): [f"_{row}{column}" for row in "NBT" for column in "xyz"],
}

TOP = kr.scenes.asymmetric
PRECESSING = kr.Scene.spinning(LAGRANGE.body, spin=1.0, tilt=1.0, precession=2.0, gravity=1)
SCENES = {"asymmetric": TOP, "cusps": kr.scenes.cusps, "-": PRECESSING}
METHODS = {
    "": {},
    "--method strang --step 0.125": {"method": "strang", "step": 0.125},
    "--method rk4 --step 0.0625 --every 4": {"method": "rk4", "step": 0.0625, "every": 4},
    "--method extrap --tol 1e-9": {"method": "extrap", "tol": 1e-9},
    "--digits 20": {"digits": 20},
    "--method taylor --max-steps 5000": {"method": "taylor", "max_steps": 5000},
    "--method geometric --error 1e-3": {"method": "geometric", "error": 1e-3},
}
TIMES = {  # {times: (the same in Python, the times of the first part)}
    "6": (6.0, "3"),
    "-2.5": (-2.5, "-1.5"),
    "0:8:0.5": (np.arange(17) * 0.5, "0:4:0.5"),
    "0,0.5,1:4:0.5": ([0.0, *np.arange(1, 9) * 0.5], "0,0.5,1"),
    "0:-4:0.5": (np.arange(9) * -0.5, "0:-2:0.5"),
}
WANTS = ["", "nutation", "precession_angle,spin_angle,velocity", "q,energy,torque", "spin,m,frame"]
EVENTS = {
    "": None,
    "nutation": (kr.events.nutation(),),
    "nutation:direction=-1 crossing:2*m_x-apex_z*apex_z+.5": (
        kr.events.nutation(direction=-1),
        kr.events.crossing({"m_x": 2.0, "apex_z*apex_z": -1.0, "1": 0.5}),
    ),
}


def lay_out(t, quantities):
    """Return columns by their heads, for quantities given as {name: (values, unit)}."""
    table = {"t [T]": np.asarray(t)}
    for name, (values, unit) in quantities.items():
        endings = ENDINGS[values.shape[1:]]
        columns = values.reshape(len(t), len(endings)).T
        for ending, column in zip(endings, columns, strict=True):
            table[f"{name}{ending} [{unit}]" if unit else name + ending] = column
    return table


def tabulate(path, names, degrees=False, unwrap=False):
    """Return the columns of these quantities by their heads, as a user would compute them."""
    quantities = {}
    for name in names:
        values, unit = getattr(path, name), UNIT[name]
        if unwrap and unit == "rad":
            values = np.unwrap(values)
        if degrees and unit.startswith("rad"):
            values, unit = np.degrees(values), unit.replace("rad", "deg")
        quantities[name] = values, unit
    return lay_out(path.t, quantities)


def list_names(path):
    """Return the names of the quantities that kreisel solve writes."""
    return path.want or (("q", "m", "q_low", "m_low") if (path.digits or 0) > 16 else ("q", "m"))


def read_printed_table(text):
    """Return the columns of a printed table of states by their heads."""
    lines = [line for line in text.splitlines() if re.match(r" +\S", line) and "─" not in line]
    head, *rows = [re.split(r"  +", line.strip()) for line in lines]
    if head == ["first", "last"]:
        return {name: np.array(numbers, float) for name, *numbers in rows}
    return dict(zip(head, np.array(rows, float).T, strict=True))


def read_json(text):
    """Return the object, and its columns by their heads."""
    data = json.loads(text, parse_constant=pytest.fail)
    units = data["units"]
    quantities = {name: (np.array(data[name]), units[name]) for name in units if name != "t"}
    return data, lay_out(data["t"], quantities)


def check_table(found, expected, rtol=1e-13):
    assert list(found) == list(expected)
    for head in expected:
        np.testing.assert_allclose(found[head], expected[head], rtol, 1e-12, err_msg=head)


def check_events(rows, words, path, degrees):
    """Check the columns of --events-csv."""
    expected = path.events
    table = tabulate(expected.path, list_names(path), degrees)
    assert list(rows.pop("event")) == [words[i] for i in expected.which]
    assert rows.pop("direction").tolist() == expected.direction.tolist()
    check_table(rows, table)


CHOICES = {"scene": SCENES, "t": TIMES, "want": WANTS, "events": EVENTS}
CHOICES |= dict.fromkeys(("degrees", "unwrap"), (False, True))
SOLVE = st.fixed_dictionaries({name: st.sampled_from([*each]) for name, each in CHOICES.items()})


def build_solve_command(method, options):
    """Return a command line, its words without times, its events, and the path by Python."""
    words = METHODS[method]
    if words.get("method", "taylor") != "taylor":
        options["events"] = ""  # only this method finds events
    if "every" in words and ":" in options["t"]:
        options["t"] = "6"  # the time to reach
    t = TIMES[options["t"]][0]
    names = options["events"].split()
    line = " ".join([method, *(f"--events {name}" for name in names)])
    line += f" --want {options['want']}" if options["want"] else ""
    want = options["want"].split(",") if options["want"] else None
    top = SCENES[options["scene"]]
    path = kr.solve(top, t, want=want, events=EVENTS[options["events"]], **words)
    flags = "".join(f" --{flag}" for flag in ("degrees", "unwrap") if options[flag])
    return line, flags, names, path


@pytest.mark.parametrize("route", ["csv", "json", "npz", "print"])
@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=6, deadline=None)
@given(options=SOLVE)
def test_every_option_of_solve_means_the_same_as_in_python(method, route, options):
    line, flags, names, path = build_solve_command(method, options)
    line = f"solve {options['scene']} --t {options['t']} {line}{flags}"
    text = PRECESSING.to_toml() if options["scene"] == "-" else None
    angles = {"degrees": options["degrees"], "unwrap": options["unwrap"]}
    expected = tabulate(path, list_names(path), **angles)
    with tempfile.TemporaryDirectory() as folder:
        events_file = Path(folder, "events")
        if names:
            line += f" --events-csv {events_file}"
        if route == "csv":
            check_table(read_csv(call(f"{line} --csv -", text=text)), expected)
        elif route == "json":
            data, table = read_json(call(f"{line} --json -", text=text))
            check_table(table, expected)
            assert data["scene"] == tomllib.loads(path.scene.to_toml()) and data["stopped"] is None
            for word in ("method", "step", "tol", "digits"):
                assert data[word] == getattr(path, word)
            assert data["stats"] == path.stats._asdict() and data["kreisel"] == kr.__version__
            if names:
                met = tabulate(path.events.path, list_names(path), options["degrees"])
                found = [data["events"][head.partition(" ")[0]] for head in met]
                np.testing.assert_allclose(found, [*met.values()], 1e-13, 1e-12)
        elif route == "npz":
            call(f"{line} --npz {folder}/top", text=text)
            again = kr.load(f"{folder}/top.npz")
            check_table(tabulate(again, list_names(path), **angles), expected)
            assert again.scene == path.scene and again.stats == path.stats
        else:
            output = call(f"{line} --all-rows", text=text)
            if not names:  # the printed table of events follows
                check_table(read_printed_table(output), expected, rtol=1e-7)
            assert f"{len(path)} states by {path.method}: {path.stats.steps} step" in output
        if names:
            check_events(read_csv(events_file.read_text()), names, path, options["degrees"])


@pytest.mark.parametrize("method", [method for method in METHODS if "geometric" not in method])
@settings(max_examples=8, deadline=None)
@given(options=SOLVE)
def test_a_resumed_run_continues_with_the_same_bits(method, options):
    """Check two parts of a run against the whole, with every option except --unwrap."""
    line, _, names, path = build_solve_command(method, options)
    line += " --degrees" if options["degrees"] else ""
    text = PRECESSING.to_toml() if options["scene"] == "-" else None
    with tempfile.TemporaryDirectory() as folder:
        start = f"solve {options['scene']} {line} --save {folder}/run"
        kept = " ".join(re.findall("--every [0-9]+|--degrees", line))
        tables, met = [], []
        for command, t in (
            (start, TIMES[options["t"]][1]),
            (f"resume {folder}/run {kept}", options["t"]),
            (start, options["t"]),
        ):
            files = f"--csv - --events-csv {folder}/events" if names else "--csv -"
            tables.append(call(f"{command} --t {t} {files}", text=text).splitlines())
            met += [Path(folder, "events").read_text().splitlines()[1:]] if names else []
        assert kr.resume(f"{folder}/run").t == path.t[-1]
    first, rest, whole = tables
    assert first[0] == rest[0] == whole[0]
    times = {repr(t) for t in path.t.tolist()}
    rows = [row for row in first[1:] + rest[1:] if row.partition(",")[0] in times]
    assert rows == whole[1:]
    if names:
        first, rest, whole = ([row.partition(",")[2] for row in rows] for rows in met)
        assert first + rest == whole


# Times and events


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("3", [0, 3]),
        ("0:1:0.25", [0, 0.25, 0.5, 0.75, 1]),
        ("0:1:0.4", [0, 0.4, 0.8]),
        ("0:0.29999999:0.1", [0, 0.1, 0.2]),
        ("0:-1:-0.5", [0, -0.5, -1]),
        ("2:3:0.5,7,8:10:2", [2, 2.5, 3, 7, 8, 10]),
        ("1:1:5", [1]),
        ("2:2:-1", [2]),
        ("1,1", [1, 1]),
    ],
)
def test_times_are_numbers_and_grids(words, expected):
    table = read_csv(call(f"solve thesis --t {words} --want nutation --csv -"))
    assert table["t [T]"].tolist() == expected


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 300), st.floats(0.1, 1e3), st.sampled_from([1.0, -1.0]))
def test_a_time_grid_ends_at_its_end_without_drift(steps, end, sign):
    end, step = sign * end, sign * end / steps
    table = read_csv(call(f"solve thesis --t 0:{end!r}:{step!r} --want nutation --csv -"))
    assert table["t [T]"].tolist() == [k * step for k in range(steps + 1)]
    assert math.isclose(table["t [T]"][-1], end, rel_tol=4e-16)


EVENT_WORDS = {
    "nutation:direction=1:max_count=2": kr.events.nutation(direction=1, max_count=2),
    "nutation:max_count=3:terminal": kr.events.nutation(max_count=3, terminal=True),
    "plane:0,1,0:0.1:of=m": kr.events.plane((0, 1, 0), 0.1, of="m"),
    "plane:normal=0,1,0:offset=.1": kr.events.plane((0, 1, 0), 0.1),
    "cusp:9e-1": kr.events.cusp(0.9),
    "kinetic:2.5": kr.events.kinetic(2.5),
    "separatrix": kr.events.separatrix(TOP),
    "crossing:m_x:0.5:where=apex_z": kr.events.crossing({"m_x": 1}, 0.5, where={"apex_z": 1}),
    "crossing:--m_x - -1e-3 --+-2.e-1": kr.events.crossing({"m_x": 1.0, "1": 1e-3 - 0.2}),
    "crossing:1e-3*m_x-2e+2*3*q_w": kr.events.crossing({"m_x": 1e-3, "q_w": -600.0}),
    "extremum:m_x+m_x-3*m_x+2*m_y": kr.events.extremum({"m_x": -1.0, "m_y": 2.0}),
}


@pytest.mark.parametrize("word", EVENT_WORDS)
def test_events_are_described_as_in_python(word):
    path = kr.solve(TOP, 20, events=EVENT_WORDS[word])
    words = ["solve", "asymmetric", "--t", 20, "--events", word, "--events-csv", "-"]
    rows = read_csv(invoke(words).stdout)
    check_events(rows, [word], path, degrees=False)
    assert path.events or word == "separatrix"


# What is printed


TRANSCRIPTS = [  # (command line, words that its output contains in this order)
    ("--version", [f"kreisel, version {kr.__version__}", version("kreisel")]),
    ("--help", ["compare", "fit", "resume", "solve", "sweep", "view", "130"]),
    ("solve --help", ["--t TIME[,...]", "[required]", "[default: auto]", "nutation:max_count=3"]),
    ("resume --help", ["counts whole turns from the first state"]),
    ("sweep run --help", ["--parts A:B", "--dask ADDRESS"]),
    ("report --help", ["accuracy, speed and stability", "--thesis"]),
    ("methods", list(kr.methods)),
    ("methods rk4", ["order      4", "kind       algebraic", "rotors", "Kutta 1901"]),
    ("scenes", [*kr.scenes.about]),
    ("scenes cusps", [kr.scenes.about["cusps"], kr.scenes.cusps.to_toml()]),
    ("quantities", [f"{name} {UNIT[name]}".rstrip() for name in get_args(QuantityName)[1:]]),
    ("solve asymmetric --t 1 --want kowalewski --json -", ['"kowalewski": [null, null]']),
    ("solve cusps --t 1 --want nutation,spin --degrees",
     ["nutation [deg] 53.13010235", "spin [deg/T] 343.774677"]),
    ("solve asymmetric_regular --t 5 --method geometric --error 1e-6",
     [str(kr.solve(kr.scenes.asymmetric_regular, 5, "geometric", error=1e-6).plan.choice)]),
    ("solve cusps --t 0:0:1 --want nutation", ["1 state by exact: "]),
    ("solve cusps --t 0:40:1 --want nutation", [" 19 ", "... 1 row omitted: --all-rows", " 21 "]),
    ("solve cusps --t 0:99:1 --want nutation", [" 19 ", "... 60 rows omitted", "--csv", " 80 "]),
    ("solve asymmetric --t 0:50:1 --want spin_angle", ["angles jump by whole turns: --unwrap"]),
]  # fmt: skip


@pytest.mark.parametrize(("line", "words"), TRANSCRIPTS, ids=[line for line, _ in TRANSCRIPTS])
def test_commands_print_these_words(line, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    output, place = join_lines(call(line)), 0
    for word in map(join_lines, words):
        assert word in output[place:], word
        place = output.index(word, place)


def test_methods_md_is_up_to_date():
    """Check all but the measured costs of the page, which methods_page.py writes."""

    def read_rows(text):
        lines = [line.strip("| ").split(" | ") for line in text.splitlines()]
        return {cells[0]: cells for cells in lines if cells[0] in kr.methods}

    now = read_rows(runpy.run_path(ROOT / "docs/making/methods_page.py")["format_methods_page"]())
    page = read_rows((ROOT / "METHODS.md").read_text())
    assert now.keys() == page.keys() == kr.methods.keys() and now["rk4"][2:5] == ["1.0"] * 3
    for name, cells in page.items():
        assert (*cells[:2], *cells[-3:]) == (*now[name][:2], *now[name][-3:])


def test_a_run_prints_its_energy_error_and_its_first_events():
    events = [kr.events.nutation()]
    path = kr.solve(kr.scenes.thesis, 0.125 * np.arange(2401), "taylor", tol=1e-7, events=events)
    output = call("solve thesis --t 0:300:0.125 --method taylor --tol 1e-7 --events nutation")
    assert f"energy error {path.energy_error:.2g}" in output
    count = len(path.events)
    assert count > 21 and f"... {count - 20} more events: --events-csv" in output
    rows = np.array(re.findall(r"^  nutation +(\S+) +([+-]1) +$", output, re.MULTILINE), float)
    expected = np.column_stack([path.events.t, path.events.direction])[:20]
    np.testing.assert_allclose(rows, expected, rtol=1e-13)
    damped = TOP.replace(damping=(0.1, 0.2, 0.1)).to_toml()
    assert "energy error" not in call("solve - --t 5", text=damped)


def test_long_paths_are_written_in_chunks_as_one_path(tmp_path):
    """Check the joints of the chunks, also of unwrapped angles and of archives with events."""
    files = f"--csv {tmp_path}/a --npz {tmp_path}/a --events nutation"
    call(f"solve asymmetric --t 0:2000:0.05 --want spin_angle,m --unwrap {files}")
    times = 0.05 * np.arange(40001)
    path = kr.solve(TOP, times, want=["spin_angle", "m"], events=[kr.events.nutation()])
    table = read_csv((tmp_path / "a").read_text())
    check_table(table, tabulate(path, path.want, unwrap=True), rtol=1e-9)
    again = kr.load(tmp_path / "a.npz")
    assert np.array_equal(again.t, times) and again.want == path.want
    np.testing.assert_allclose(again.events.t, path.events.t, rtol=0, atol=1e-9)
    assert np.array_equal(again.events.direction, path.events.direction)


def test_a_resumed_run_counts_turns_from_its_first_state(tmp_path):
    line, run = "solve asymmetric --want spin_angle --csv -", tmp_path / "run"
    whole = read_csv(call(f"{line} --t 0:50:0.05 --unwrap"))["spin_angle [rad]"]
    call(f"{line} --t 20 --save", run)
    text = run.read_bytes()
    rest = read_csv(call("resume - --t 0:50:0.05 --unwrap --csv -", text=text))["spin_angle [rad]"]
    turns = (whole[-len(rest) :] - rest) / (2.0 * np.pi)
    assert abs(rest[0]) <= np.pi and np.round(turns[0]) != 0.0
    assert turns == pytest.approx(np.full(len(rest), np.round(turns[0])), abs=1e-12)


@pytest.mark.parametrize("line", ["solve asymmetric --t 9 --events nutation", "methods"])
def test_narrow_terminals_cut_no_number_and_no_word(line, monkeypatch):
    words = []
    for columns in ("500", "20"):
        monkeypatch.setenv("COLUMNS", columns)
        words.append(sorted(word for word in call(line).split() if not set(word) <= {"─"}))
    assert words[0] == words[1] and "…" not in "".join(words[1])


# Other commands


@pytest.mark.parametrize(
    ("options", "t", "words"),
    [
        (
            "--t 2 --methods rk4,extrap --steps 0.1,0.05 --tols 1e-9",
            2.0,
            {"methods": ["rk4", "extrap"], "steps": [0.1, 0.05], "tols": [1e-9]},
        ),
        (
            "--t 0:2:0.5 --methods rk4 --steps 0.1 --truth exact",
            [0, 0.5, 1, 1.5, 2],
            {"methods": ["rk4"], "steps": [0.1], "truth": "exact"},
        ),
        ("--t 1 --steps 2", 1.0, {"steps": [2.0]}),
    ],
)
def test_compare_measures_the_same_errors_as_in_python(options, t, words, tmp_path):
    table = kr.compare(kr.scenes.thesis, t, repeats=1, **{"truth": "taylor"} | words)
    output = call(f"compare thesis {options} --repeats 1 --csv", tmp_path / "a.csv")
    rows = [*csv.DictReader((tmp_path / "a.csv").read_text().splitlines())]
    for row, expected in zip(rows, table, strict=True):
        for name in ("scene", "method", "steps", "evaluations", "failure"):
            assert row[name] == str(getattr(expected, name))
        for name in ("step", "tol", "attitude_error", "energy_error"):
            value = getattr(expected, name)
            assert row[name] == ("" if value is None else repr(value))
        assert row["method"] in output and f"{expected.attitude_error:.1e}" in output
        assert not row["failure"] or join_lines(row["failure"])[:20] in join_lines(output)
    assert call(f"compare thesis {options} --repeats 1 --csv -").count("\n") == len(rows) + 1


def test_an_interrupted_comparison_prints_its_finished_rows(monkeypatch):
    ticks = iter(range(3))

    def read_clock():
        try:
            return float(next(ticks))
        except StopIteration:
            raise KeyboardInterrupt from None

    monkeypatch.setattr("time.perf_counter", read_clock)
    output = call("compare asymmetric --t 1 --methods taylor,extrap --repeats 1", code=130)
    assert "taylor" in output and "extrap " not in output and "1 of 2 runs" in output


@pytest.mark.parametrize(
    ("line", "completion"),
    [
        ("solve thes", "thesis"),
        ("compare thesis --methods rk4,str", "rk4,strang"),
        ("solve thesis --want nutation,prec", "nutation,precession_angle"),
        ("fit a.csv thesis --free start,mom", "start,moments"),
    ],
)
def test_names_are_completed(line, completion):
    words = ["kreisel", *line.split()]
    environment = {
        "_KREISEL_COMPLETE": "bash_complete",
        "COMP_WORDS": " ".join(words),
        "COMP_CWORD": str(len(words) - 1),
    }
    result = invoke([], env=environment, prog_name="kreisel")
    assert f"plain,{completion}" in result.output.splitlines()
    environment = {"_KREISEL_COMPLETE": "zsh_source"}
    assert "zsh_complete" in invoke([], env=environment, prog_name="kreisel").output
