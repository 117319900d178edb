"""Tests of command-line options and usage errors."""

import csv
import json
import math
import os
import subprocess
import sys

import click
import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call, join_lines
from click.testing import CliRunner
from internals import cli
from kreisel._cli import time_option as shell_times

THESIS = kr.scenes.thesis


def times(words):
    """Return the output times of a command whose option --t has the value `words`."""
    line = f"solve thesis --t {words} --want nutation --csv -"
    return [float(row.split(",")[0]) for row in call(line).splitlines()[1:]]


@pytest.mark.parametrize(
    "words, expected",
    [
        ("3", [0, 3]),
        ("-3", [0, -3]),
        ("0:1:0.25", [0, 0.25, 0.5, 0.75, 1]),
        ("0:1:0.4", [0, 0.4, 0.8]),
        ("0:0.3:0.1", [k * 0.1 for k in range(4)]),
        ("0:-1:0.5", [0, -0.5, -1]),
        ("0:-1:-0.5", [0, -0.5, -1]),
        ("2:3:0.5,7,8:10:2", [2, 2.5, 3, 7, 8, 10]),
        ("1:1:5", [1]),
        ("1,1", [1, 1]),
    ],
)
def test_times_are_numbers_and_grids(words, expected):
    assert times(words) == expected


@pytest.mark.parametrize("steps", [7, 10, 1000, 12345])
@pytest.mark.parametrize("end", [0.7, 1.0, 10.0, 123.4])
def test_a_time_grid_ends_at_its_end_without_drift(steps, end):
    h = end / steps
    t = times(f"0:{end!r}:{h!r}")
    assert t == [k * h for k in range(steps + 1)]
    assert math.isclose(t[-1], end, rel_tol=4e-16)


@pytest.mark.parametrize(
    "words, message",
    [
        ("1,x", "'x' is not a number or a grid start:end:step"),
        ("", "is not a number"),
        ("0:10", "'0:10' is not a number or a grid"),
        ("0:10:0", "cannot go from 0 to 10"),
        ("0:10:-1", "cannot go from 0 to 10"),
        ("0:1e300:1e-300", "too many times"),
        ("nan", "t must be finite, not 'nan'"),
        ("0:inf:1", "t must be finite"),
        ("2,1", "1.0 goes back from 2.0"),
        ("-1,1", "goes back"),
        ("0:5:1,4:6:1", "4.0 goes back from 5.0"),
    ],
)
def test_invalid_times_are_refused(words, message):
    assert message in call("solve thesis --t", words, code=2)


def test_too_many_times_for_the_memory_are_refused(tmp_path):
    line = "solve thesis --t 0:1e12:1e-3 --npz"
    assert "record fewer" in call(line, tmp_path / "a.npz", code=2)
    line = "solve thesis --t 1e15 --method rk4 --step 1 --every 1 --npz"
    assert "record fewer" in call(line, tmp_path / "a.npz", code=2)
    assert os.listdir(tmp_path) == []


EVENTS = [
    ("nutation", kr.events.nutation()),
    ("nutation:direction=1:max_count=2", kr.events.nutation(direction=1, max_count=2)),
    ("nutation:max_count=3:terminal", kr.events.nutation(max_count=3, terminal=True)),
    ("plane:0,1,0", kr.events.plane((0, 1, 0))),
    ("plane:0,1,0:0.1:of=m", kr.events.plane((0, 1, 0), 0.1, of="m")),
    ("cusp:9e-1", kr.events.cusp(0.9)),
    ("kinetic:2.5", kr.events.kinetic(2.5)),
    ("separatrix", kr.events.separatrix(kr.scenes.asymmetric)),
    ("crossing:m_x:0.5:where=apex_z", kr.events.crossing({"m_x": 1}, 0.5, where={"apex_z": 1})),
    (
        "crossing:2*m_x-apex_z*apex_z*1e-1+.5",
        kr.events.crossing({"m_x": 2.0, "apex_z*apex_z": -0.1, "1": 0.5}),
    ),
    ("extremum:-m_y+m_y*3", kr.events.extremum({"m_y": 2.0})),
]


@pytest.mark.parametrize("word, event", EVENTS, ids=[word for word, _ in EVENTS])
def test_events_equal_those_of_python(word, event, tmp_path):
    path = kr.solve(kr.scenes.asymmetric, 20, events=[event])
    line = f"solve asymmetric --t 20 --events {word} --events-csv - --json"
    header, *rows = csv.reader(call(line, tmp_path / "a.json").splitlines())
    assert header[:4] == ["event", "t [T]", "direction", "q_w"]
    assert header[-1] == "m_z [M L^2 T^-1]"
    assert [float(row[1]) for row in rows] == path.events.t.tolist()
    assert [int(row[2]) for row in rows] == path.events.direction.tolist()
    assert {row[0] for row in rows} == {word}
    data = json.loads((tmp_path / "a.json").read_text())
    assert data["events"]["t"] == path.events.t.tolist() and data["t"] == path.t.tolist()


def test_events_are_shown_with_the_wanted_quantities(tmp_path):
    words = "--events nutation --events plane:0,1,0 --want nutation"
    path = kr.solve(kr.scenes.thesis, 20, events=[kr.events.nutation(), kr.events.plane((0, 1, 0))])
    show_events = call(f"solve thesis --t 20 {words} --degrees --events-csv", tmp_path / "e.csv")
    with open(tmp_path / "e.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["event", "t [T]", "direction", "nutation [deg]"]
    assert [row["event"] for row in rows] == [
        ("nutation", "plane:0,1,0")[i] for i in path.events.which
    ]
    np.testing.assert_allclose(
        [float(row["nutation [deg]"]) for row in rows],
        np.degrees(path.events.path.nutation),
        rtol=1e-7,
        atol=1e-6,
    )
    assert f"{path.events.t[0]:.15g}" in show_events


def test_events_beyond_the_twentieth_are_counted():
    show_events = call("solve thesis --t 300 --events nutation")
    events = len(kr.solve(kr.scenes.thesis, 300, events=[kr.events.nutation()]).events)
    assert events > 20 and f"... {events - 20} more events" in show_events


@pytest.mark.parametrize(
    "word, message",
    [
        ("nutatoin", "unknown event 'nutatoin'; did you mean 'nutation'?"),
        ("plane:0,1", "normal must be 3 numbers"),
        ("plane", "normal"),
        ("plane:0,1,0:0:m:9", "'9' is an unexpected argument"),
        ("crossing:omega", "unknown quantity 'omega'"),
        ("nutation:direction=2", "direction must be 1, -1 or 0"),
        ("nutation:terminal=no", "terminal takes no value"),
        ("nutation:max_count=x", "--events nutation:max_count=x: "),
        ("separatrix:1", "unexpected argument"),
        ("", "unknown event ''"),
    ],
)
def test_invalid_events_are_refused(word, message):
    assert message in call("solve asymmetric --t 1 --events", word, code=2)


@pytest.mark.parametrize(
    "line, message",
    [
        ("solve thesi --t 1", "no file or named scene 'thesi'; did you mean 'thesis'?"),
        ("solve qqqq --t 1", "no file or named scene 'qqqq'; known are thesis, kowalewski"),
        ("solve thesis", "Missing option '--t'"),
        ("solve thesis --t 1 --method rk5", "did you mean 'rk4'?"),
        ("solve thesis --t 1 --method rk4", "give --step, as in --step 0.01"),
        ("solve thesis --t 1 --every 3", "give --t as a grid, as in --t 0:10:0.01"),
        ("solve thesis --t 1 --method geometric", "as in --error 1e-6"),
        ("solve thesis --t 1 --error 1e-3", "--error is for --method geometric"),
        ("solve thesis --t 1 --method rk4 --step .1 --tol 1", "leave out --tol"),
        ("solve thesis --t 1 --digits 40", "--digits must be at most 30"),
        ("solve thesis --t 1 --want nutatoin", "did you mean 'nutation'?"),
        ("solve thesis --t 1 --csv -  --json -", "--json -: --csv - is the same file"),
        ("solve thesis --t 1 --events-csv a.csv", "--events-csv needs --events"),
        ("compare thesis --t 1 --methods rk4", "give --steps, as in --steps 0.1,0.01"),
        ("compare thesis --t 1 --methods rk4 --steps 0", "steps must be positive"),
        ("compare thesis --t 1 --methods rk5 --steps .1", "did you mean 'rk4'?"),
        ("compare thesis --t 1 --methods rk4 --steps .1 --truth rk44", "unknown method 'rk44'"),
        ("methods strng", "did you mean 'strang'?"),
        ("scenes thesi", "did you mean 'thesis'?"),
        ("look", "No such command"),
        ("solve thesis --t 1 --stp 3", "No such option"),
    ],
)
def test_errors_take_one_line(line, message):
    output = call(line, code=2)
    assert (
        message in join_lines(output) and output.count("\n") == 1 and output.startswith("Error: ")
    )


def test_a_command_without_arguments_shows_its_help_once():
    told = call("sweep", code=2)
    assert told.startswith("Usage: kreisel sweep ") and told.count("Usage:") == 1
    assert "Error" not in told


def test_an_endless_device_is_refused_as_a_scene():
    assert "at most 1048576 bytes" in call("solve /dev/zero --t 1", code=2)


def test_errors_in_a_scene_from_standard_input_name_standard_input():
    assert "SCENE: standard input: " in call("solve - --t 1", text="a = [", code=2)
    assert "standard input" in call("compare - --t 1", text="[body]\nmass = 1\n", code=2)


def test_a_scene_without_gravity_is_refused_by_the_command_line():
    body = "[body]\nmass = 1\ninertia = [2, 2, 1]\ncom = [0, 0, 0.5]\n"
    told = join_lines(call("solve - --t 1", text="momentum = [0, 0, 1]\n" + body, code=2))
    assert "gravity is required" in told and "9.81" in told
    assert "q_w" in call("solve - --t 1", text="gravity = 9.81\nspinning = { spin = 9 }\n" + body)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_can_be_switched_on(shell):
    result = subprocess.run(
        [sys.executable, "-m", "kreisel"],
        env=os.environ | {"_KREISEL_COMPLETE": f"{shell}_source"},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0
    assert f"_KREISEL_COMPLETE={shell}_complete" in result.stdout


@pytest.mark.parametrize(
    "line, completion",
    [
        ("solve thes", "thesis"),
        ("view dzh", "dzhanibekov"),
        ("scenes kow", "kowalewski"),
        ("methods bobenko_suris4", "bobenko_suris4"),
        ("solve thesis --method geo", "geometric"),
        ("compare thesis --methods rk4,str", "rk4,strang"),
        ("compare thesis --truth tay", "taylor"),
        ("solve thesis --want nutation,prec", "nutation,precession_angle"),
        ("solve thesis --events sep", "separatrix"),
    ],
)
def test_names_are_completed(line, completion):
    words = ["kreisel", *line.split()]
    environment = {
        "_KREISEL_COMPLETE": "bash_complete",
        "COMP_WORDS": " ".join(words),
        "COMP_CWORD": str(len(words) - 1),
    }
    result = CliRunner().invoke(cli.main, prog_name="kreisel", env=environment)
    assert f"plain,{completion}" in result.output.splitlines()


# Boundary values


def test_shell_events_are_counted_beyond_the_twentieth():
    def show_events(n):
        return call(f"solve thesis --t 1000 --events nutation:max_count={n}")

    path = kr.solve(THESIS, [1000.0], events=kr.events.nutation(max_count=21))
    assert len(path.events.t) == 21
    for n, more in ((19, ""), (20, ""), (21, "... 1 more events: --events-csv writes all")):
        text = join_lines(show_events(n))
        assert (more in text) and ("more events" in text) == bool(more)


def test_too_many_states_are_refused_in_the_shell(tmp_path):
    file = tmp_path / "path.npz"
    text = join_lines(call("solve thesis --t 0:1e12:0.001 --npz", file, code=2))
    assert "1000000000000001 states" in text and "GB" in text


def test_shell_grids_of_zero_length_contain_their_start():
    for word in ("0:0:0.1", "0:0:-0.1", "2:2:-1"):
        t = shell_times.parse_times(word).to_array()
        assert t.tolist() == [float(word[0])]
    with pytest.raises(click.BadParameter, match="too many times"):
        shell_times.parse_times(f"0:{2**53}:1")
    with pytest.raises(click.BadParameter, match=r"cannot go from 0 to 4\.94066e-324"):
        shell_times.parse_times("0:5e-324:-1")
