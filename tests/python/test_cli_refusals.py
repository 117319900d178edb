"""Refusals of the command line: one line with a key word, exit code 2, and no file touched."""

import random
from typing import get_args

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import KREISEL, PLAN, call, invoke, join_lines
from kreisel.types import QuantityName

ENDLESS = "solve asymmetric --t 1e9 --max-steps 100000"


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """Return a folder with inputs of all commands, which refused commands leave unchanged."""
    folder = tmp_path_factory.mktemp("inputs")
    kr.scenes.asymmetric.to_toml(folder / "top")
    run = kr.start(kr.scenes.thesis, "taylor")
    run.to(5.0)
    run.save(folder / "run")
    record = kr.solve(kr.scenes.asymmetric, np.linspace(0.0, 1.0, 9), want=("body_velocity",))
    record.to_csv(folder / "record")
    light = "momentum = [0, 0, 1]\n[body]\nmass = 1\ninertia = [2, 2, 1]\ncom = [0, 0, 1]\n"
    (folder / "motion").write_text("t,qw,qx,qy,qz\n0,1,0,0,0\n1,0,1,0,0\n")
    texts = {"plan.toml": PLAN, "wrong.toml": "tt = 1", "noise": "no run", "light": light}
    for name, text in texts.items():
        (folder / name).write_text(text)
    for link, name in {"link": "top", "a_link": "a"}.items():
        (folder / link).symlink_to(name)
    for name in ("folder", "folder.npz"):
        (folder / name).mkdir()
    return folder


def read_files(folder):
    """Return the contents of all files by their names."""
    files = (file for file in folder.rglob("*") if file.is_file())
    return {file.relative_to(folder): file.read_bytes() for file in files}


REFUSALS = [  # (command line, words that the message contains)
    # names
    ("look", "No such command"),
    ("solve thesi --t 1", "did you mean 'thesis'"),
    ("solve qqqq --t 1", "known are thesis, kowalewski"),
    ("methods strng", "did you mean 'strang'"),
    ("solve thesis --t 1 --stp 3", "--step"),
    ("solve thesis --t 1 --method rk5", "did you mean 'rk4'"),
    ("solve thesis --t 1 --want nutatoin", "did you mean 'nutation'"),
    # times
    ("solve thesis", "--t"),
    ("resume run", "--t"),
    ("solve thesis --t 1,x", "'x'"),
    ("solve thesis --t ''", "is not a number"),
    ("solve thesis --t 0:10", "'0:10'"),
    ("solve thesis --t 0:10:0", "from 0 to 10"),
    ("solve thesis --t 0:1e12:1e-3 --npz a", "record fewer"),
    ("solve thesis --t 1e15 --method rk4 --step 1 --every 1 --npz a", "record fewer"),
    ("solve thesis --t nan", "finite"),
    ("solve thesis --t 0:1e300:1e-300", "too many times"),
    ("solve thesis --t 2,1", "1.0 goes back from 2.0"),
    ("solve thesis --t 0:5:1,4:6:1", "4.0 goes back from 5.0"),
    # options that need each other, or exclude each other
    ("solve thesis --t 1 --method rk4", "give --step"),
    ("solve thesis --t 1 --every 3", "--every needs"),
    ("solve thesis --t 1 --method geometric", "--error"),
    ("solve thesis --t 1 --method rk4 --step .1 --tol 1", "leave out --tol"),
    ("solve thesis --t 1 --digits 40", "--digits must be at most 30"),
    ("solve thesis --t 1 --max-steps -1", "--max-steps must be at least 0"),
    ("solve thesis --t 1 --events-csv a.csv", "needs --events"),
    ("solve thesis --t 9 --method geometric --error 1e-3 --save a", "--save"),
    ("solve asymmetric --t 1 --method geometric --error 1e-6 --events nutation", "--events"),
    ("compare thesis --t 1 --methods rk4", "give --steps"),
    ("compare thesis --t 1 --methods rk4 --steps 0", "--steps must be positive"),
    # events
    ("solve asymmetric --t 1 --events nutatoin", "did you mean 'nutation'"),
    ("solve asymmetric --t 1 --events plane:0,1", "3 numbers"),
    ("solve asymmetric --t 1 --events crossing:omega", "'omega'"),
    ("solve asymmetric --t 1 --events crossing:2*-m_x", "'2*-m_x'"),
    (f"solve asymmetric --t 1 --events crossing:{40 * 'm'}+", "sum of products"),
    ("solve asymmetric --t 1 --events nutation:direction=2", "direction"),
    ("solve asymmetric --t 1 --events nutation:direction=up", "'up'"),
    ("solve asymmetric --t 1 --events nutation:direction=1:direction=-1", "already given"),
    ("solve asymmetric --t 1 --events nutation:terminal=no", "terminal"),
    ("solve asymmetric --t 1 --events separatrix:1", "unexpected"),
    # scenes
    ("solve /dev/zero --t 1", "1048576 bytes"),
    ("solve light --t 1", "gravity"),
    ("solve wrong.toml --t 1", "[body]"),
    ("compare - --t 1", "standard input"),
    # saved runs
    ("resume run --t 5", "reached t = 5.0"),
    ("resume run --t -9", "goes back"),
    ("resume run --t 9 --every 2", "fixed step"),
    ("resume top --t 9", "top: "),
    ("resume /dev/zero --t 9", "not a saved run"),
    ("resume nothing --t 9", "No such file"),
    # output files
    *(
        (f"{ENDLESS} {option} {place}", word)
        for option in ("--csv", "--json", "--npz", "--save", "--events nutation --events-csv")
        for place, word in [
            ("no/file", "there is no folder"),
            ("folder", "folder"),
            ("x" * 300, "too long"),
            ("a.xlsx", ".xlsx"),
        ]
    ),
    ("view cusps --save a.csv", "--save writes .html"),
    *(
        (f"{ENDLESS.replace('asymmetric', 'top')} {files}", "is the same file")
        for files in (
            "--csv a --json a",
            "--csv a --json ./a",
            "--csv a --save a_link",
            "--json - --npz -",
            "--csv /dev/stdout --json -",
            "--csv top",
            "--save link",
            "--events loop --events-csv a --csv a",
        )
    ),
    ("compare top --t 1 --methods rk4 --steps 0.1 --csv top", "is the same file"),
    ("view top --save link", "is the same file"),
    ("fit record top --plot record", "is the same file"),
    ("fit record top --save top", "is the same file"),
    ("resume run --t 9 --csv ./run", "is the same file"),
    # fits
    ("fit nothing.csv asymmetric", "nothing.csv"),
    ("fit record asymmetric --free strat", "did you mean 'start'"),
    ("fit record asymmetric --max-evaluations 0", "--max-evaluations must be at least 1"),
    ("fit record asymmetric --sigma spin=1 --sigma spin=2", "already given"),
    ("fit record asymmetric --sigma x", "--sigma x"),
    ("fit record asymmetric --column spin=a --column spin=c", "already given"),
    ("fit record asymmetric --column spin", "--column spin"),
    ("fit record asymmetric --point 1,2", "--point"),
    ("fit record asymmetric --degrees", "--degrees"),
    ("fit record asymmetric --instrument bais", "--instrument"),
    *(
        (f"fit record asymmetric --plot {file}", file)
        for file in ("a", "a.foo", "a.jpg", "-.foo", "a.toml", "no/a.png")
    ),
    # scores
    ("score nothing.csv --case tumble", "nothing.csv"),
    ("score motion", "give --case"),
    ("score motion --case tumbl", "did you mean 'tumble'"),
    ("score record --case tumble", "no column qw"),
    ("score wrong.toml --case tumble", "wrong.toml"),
    ("score motion --case tumble --scene top", "not both"),
    ("score motion --case tumble --level nan", "--level"),
    ("score motion --case tumble --level good", "engine, science"),
    ("score motion --case tumble --steps 1,2", "--steps must be 1 positive number"),
    ("score motion --case tumble --plot a.jpg", "a.jpg"),
    ("score motion --case tumble --plot motion.png --steps 0", "--steps"),
    # sweeps
    ("sweep plan.toml", "--folder"),
    ("sweep wrong.toml --folder runs", "did you mean 't'"),
    ("sweep plan.toml --folder .", "not a folder of a sweep"),
    *(
        (f"sweep plan.toml --folder runs --parts {parts}", "is not a range of parts")
        for parts in ("3", "3:", ":3", "4:3", "-1:3", "a:3", "3:a", "1:2:3")
    ),
    ("sweep plan.toml --folder runs --parts 0:9", "--parts must lie between 0 and 5"),
    ("sweep plan.toml --folder runs --workers 0", "--workers"),
    ("sweep plan.toml --folder runs --workers 1 --dask x", "--dask"),
    ("sweep status none", "there is no folder"),
    ("sweep status .", "not a folder of a sweep"),
    # others
    ("report --quick", "source"),
]


@pytest.mark.parametrize(("line", "word"), REFUSALS, ids=[line[:60] for line, _ in REFUSALS])
def test_invalid_commands_are_refused_in_one_line(line, word, inputs, monkeypatch):
    monkeypatch.chdir(inputs)
    before = read_files(inputs)
    result = invoke([part.replace("''", "") for part in line.split()], "[body]\nmass = 1\n")
    assert result.exit_code == 2 and isinstance(result.exception, SystemExit)
    assert result.stdout == "" and result.stderr.startswith("Error: ")
    assert result.stderr.count("\n") == 1 and word in join_lines(result.stderr)
    assert read_files(inputs) == before


def test_a_command_without_arguments_shows_its_help_once():
    told = call("sweep", code=2)
    assert told.startswith("Usage: kreisel sweep ") and told.count("Usage:") == 1
    assert "Error" not in told


# Words of random command lines. The first half of each text contains words that are often valid.
NUMBERS = "0.1 1e-3 1 0.25 2 1e-9 0 -1 nan inf 1e400 x 2**3"
COUNTS = "1 3 1000 20 0 -1 1.5 x"
FILES = "a - b c a.csv b.json no/a . , top /dev/full \udce9"
METHODS = " ".join([*kr.methods, "auto auto", 5 * "geometric exakt , rk4,strang "])
WORDS = {  # {name of an argument or option: words}
    "scene": " ".join([*kr.scenes.about, "top - nothing , . noise thesi /dev/null"]),
    "run": "run run nothing noise .",
    "name": " ".join([*kr.methods, *kr.scenes.about, "x"]),
    "t": f"1 -2 0:1:0.1 0:-1:.3 0,0,0 1e3 1,2,0:9:3 1:0:1 :: 0:1 1e99 {NUMBERS}",
    "method": METHODS,
    "methods": METHODS,
    "truth": METHODS,
    "steps": f"0.1,0.2 {NUMBERS}",
    "tols": f"1e-9 {NUMBERS}",
    "digits": f"16 20 30 {COUNTS}",
    "want": " ".join([*get_args(QuantityName), 6 * "nutation,energy , nutatoin "]),
    "events": "nutation loop plane:0,1,0 crossing:m_x:1 separatrix nutation:terminal extremum:1 "
    "crossing:m_x*q_w*q_x kinetic:x plane ::: loop:= cusp:0",
}
DEFAULTS = {
    "solve": "--t 1 --max-steps 1000",
    "resume": "--t 7 --max-steps 1000",
    "compare": "--t 1 --methods rk4 --steps 0.1 --repeats 1",
    "view": "--save a.html",
}


def draw_command_line(dice):
    """Return random words of a command that runs quickly."""
    name = dice.choice(["solve"] * 6 + ["resume", "resume", "compare", "view", "methods", "scenes"])
    words = [name, *DEFAULTS.get(name, "").split()]
    parameters = KREISEL.commands[name].params
    options = [one for one in parameters if one.opts[0].startswith("--")]
    for one in dice.sample(options, min(len(options), dice.randint(0, 3))):
        kind = {"integer": COUNTS, "float": NUMBERS}.get(one.type.name, FILES)
        pool = WORDS.get(one.name, kind).split()
        half = pool[: len(pool) // 2 + 1] if dice.random() < 0.8 else pool
        words += [one.opts[0], *([] if one.is_flag else [dice.choice(half)])]
    for one in parameters:
        if one not in options and one.name in WORDS and dice.random() < 0.97:
            words.append(dice.choice(WORDS[one.name].split()))
    if dice.random() < 0.1:
        words.insert(dice.randint(0, len(words)), dice.choice(["--", "extra", "--steps", "-h"]))
    return words


@pytest.mark.parametrize("seed", range(6))
def test_random_command_lines_end_with_an_exit_code(inputs, tmp_path, monkeypatch, seed):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("webbrowser.open", lambda _: False)
    dice, codes = random.Random(seed), set()
    for _ in range(60):
        for name in ("top", "run", "noise"):
            (tmp_path / name).write_bytes((inputs / name).read_bytes())
        words = draw_command_line(dice)
        result = invoke(words, dice.choice([kr.scenes.cusps.to_toml(), "", "a = ["]))
        has_ended = result.exception is None or isinstance(result.exception, SystemExit)
        assert has_ended and result.exit_code in (0, 1, 2), (words, result.exception, result.output)
        codes.add(result.exit_code)
        if result.exit_code:
            last = result.stderr.splitlines()[-1]
            assert last.startswith("Error: ") and len(last) < 500, (words, result.stderr)
    assert {0, 2} <= codes
