"""Tests that random command lines never cause a traceback."""

import random

import kreisel as kr
import pytest
from click.testing import CliRunner
from internals import RECORDABLE, cli, view

# The first half of each list contains words that are often valid. They are drawn more often.
NUMBERS = [
    "0.1",
    "1e-3",
    "1",
    "0.25",
    "2",
    "1e-9",
    "0",
    "-1",
    "nan",
    "inf",
    "1e400",
    "x",
    "",
    "2**3",
]
COUNTS = ["1", "3", "1000", "20", "0", "-1", "1.5", "x"]
TIMES = ["1", "-2", "0:1:0.1", "0:-1:.3", "0,0,0", "1e3", "1,2,0:9:3", "1:0:1", "::", "0:1", "1e99"]
SCENES = [*kr.scenes.about, *(["top.toml", "-"] * 5)]
SCENES += ["nothing", "", ".", "binary", "thesi", "/dev/null"] * 3
METHODS = [*kr.methods, "auto", "auto", "taylor", *(["geometric", "exakt", "", "rk4,strang"] * 5)]
FILES = [
    "a",
    "-",
    "b",
    "top",
    "c",
    "a.csv",
    "b.json",
    "no/a",
    ".",
    "",
    "top.toml",
    "/dev/full",
    "\udce9",
]
EVENTS = ["nutation", "loop", "plane:0,1,0", "crossing:m_x:1", "separatrix", "nutation:terminal"]
EVENTS += ["extremum:1", "crossing:m_x*q_w*q_x", "kinetic:x", "plane", ":::", "loop:=", "cusp:0"]
WANTS = [*RECORDABLE, *(["nutation,energy", "t", ",", "nutatoin", ""] * 6)]
OPTIONS = {
    "--t": TIMES + NUMBERS,
    "--method": METHODS,
    "--step": NUMBERS,
    "--tol": NUMBERS,
    "--digits": ["16", "20", "30", *COUNTS],
    "--error": NUMBERS,
    "--every": COUNTS,
    "--max-steps": COUNTS,
    "--want": WANTS,
    "--events": EVENTS,
    "--csv": FILES,
    "--json": FILES,
    "--npz": FILES,
    "--events-csv": FILES,
    "--save": FILES,
    "--methods": METHODS,
    "--steps": ["0.1,0.2", *NUMBERS],
    "--tols": ["1e-9", *NUMBERS],
    "--truth": METHODS,
    "--repeats": COUNTS[4:],
    "--degrees": [],
    "--markdow": [],
    "-h": [],
}
OF = {"solve": list(OPTIONS)[:15], "compare": list(OPTIONS)[15:20], "resume": list(OPTIONS)[10:15]}


def draw_word(dice, words):
    """Return a random word, mostly from the first half of `words`."""
    return dice.choice(words[: (len(words) + 1) // 2] if dice.random() < 0.8 else words)


def line(dice):
    """Return a random command line that runs quickly."""
    command = dice.choice(
        ["solve"] * 6 + ["compare", "resume", "view", "methods", "scenes", "look"]
    )
    words = [command]
    if dice.random() < 0.97:
        runs = ["run", "run", "run", *SCENES[-3:]]
        words.append(draw_word(dice, runs if command == "resume" else SCENES))
    if command in OF and dice.random() < 0.97:
        words += ["--t", draw_word(dice, TIMES)]
    if command in ("solve", "resume"):
        words += ["--max-steps", "1000"]
    if command == "compare":
        words += ["--repeats", "1", "--steps", "0.1", "--methods", draw_word(dice, METHODS)]
    if command == "view":
        words += ["--save", draw_word(dice, FILES)]
    options = OF.get(command, [])
    for option in dice.sample(options, min(len(options), dice.randint(0, 3))):
        words += [option, *([draw_word(dice, OPTIONS[option])] if OPTIONS[option] else [])]
    if dice.random() < 0.1:
        words.insert(dice.randint(0, len(words)), dice.choice([*OPTIONS, "--", "extra"]))
    return words


@pytest.mark.parametrize("seed", range(10))
def test_random_command_lines_end_with_an_exit_code(tmp_path, monkeypatch, seed):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(view, "open_viewer", lambda _: ("nowhere", False))
    kr.start(kr.scenes.asymmetric, "strang", step=0.1, max_steps=1000).save("run")
    (tmp_path / "binary").write_bytes(bytes(range(256)))
    dice, codes = random.Random(seed), []
    for _ in range(50):
        kr.scenes.asymmetric.to_toml("top.toml")
        words = line(dice)
        text = dice.choice([kr.scenes.cusps.to_toml(), "", "a = ["])
        result = CliRunner().invoke(cli.main, words, input=text)
        has_ended = result.exception is None or isinstance(result.exception, SystemExit)
        assert has_ended and result.exit_code in (0, 1, 2), (words, result.exception, result.output)
        codes.append(result.exit_code)
        if result.exit_code:
            last = result.stderr.splitlines()[-1]
            assert last.startswith("Error: ") and len(last) < 500, (words, result.stderr)
    assert {0, 2} <= set(codes)
