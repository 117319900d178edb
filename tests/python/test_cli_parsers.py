"""Tests of the parsers of commands, their lists and their options."""

import math
import re
import signal

import click
import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call, list_cells_by_column, make_raiser, record_console_calls
from click.testing import CliRunner
from internals import cli
from kreisel._cli import (
    compare_command,
    event_option,
    fit_command,
    lists,
    output_files,
    parsers,
    text_grid,
    time_option,
)

TOP = kr.scenes.asymmetric


@pytest.fixture
def console_calls(monkeypatch):
    return record_console_calls(monkeypatch, lists, text_grid)


# Help


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("solve", ["[default: auto]", "--t TIME[,...]", "--degrees ", "--unwrap ", "--all-rows "]),
        ("compare", ["[default: taylor]", "[default: 5]", "--steps NUMBER[,...]"]),
        ("fit", ["[default: t]", "[default: start,moments]", "--degrees "]),
    ],
)
def test_help_shows_defaults(command, words):
    text = " ".join(call(f"{command} --help").split()).replace("start, moments", "start,moments")
    for word in words:
        assert word.strip() in text


@pytest.mark.parametrize("command", ["solve thesis", "compare thesis", "resume run"])
def test_times_are_required(command):
    assert "Missing option '--t'" in call(command, code=2)


def test_errors_go_to_standard_error():
    result = CliRunner().invoke(cli.main, ["methods", "rk5"])
    assert result.stdout == "" and result.stderr.startswith("Error: unknown method 'rk5'")
    assert result.stderr.endswith(" did you mean 'rk4'?\n") and result.stderr.count("\n") == 1


def test_a_command_handles_sigterm_like_ctrl_c_and_restores_its_handler():
    before = signal.getsignal(signal.SIGTERM)
    with cli.main_command.convert_sigterm_to_interrupt():
        assert signal.getsignal(signal.SIGTERM) is signal.default_int_handler
    assert signal.getsignal(signal.SIGTERM) is before


# Compare and lists


def test_a_comparison_receives_the_options(monkeypatch):
    calls, result = [], kr.Table((kr.Row("a", "rk4", None, None, 1, 1, 1, 1, 1, 1),))
    monkeypatch.setattr(compare_command, "compare_methods", lambda *w: calls.append(w) or result)
    assert call("compare thesis --t 2 --csv -") == result.to_csv()
    call("compare thesis --t 2 --methods rk4 --steps 0.1,0.2 --tols 1e-3 --truth rk4 --repeats 7")
    scene = kr.scenes.thesis
    assert calls[0] == (scene, 2.0, None, (), (), "taylor", 5)
    assert calls[1] == (scene, 2.0, ["rk4"], [0.1, 0.2], [1e-3], "rk4", 7)


def test_a_comparison_is_printed_with_text_on_the_left(console_calls, monkeypatch, tmp_path):
    rows = (
        kr.Row("a", "rk4", 0.1, None, 0.0123456, 1, 20, 80, 1.26e-3, 2.34e-5),
        kr.Row("a", "extrap", None, 1e-9, 2.0, 1, 5, 80, math.nan, math.nan, "[b]too long[/b]"),
    )
    monkeypatch.setattr(compare_command, "compare_methods", lambda *_: kr.Table(rows))
    file = tmp_path / "a.csv"
    call("compare thesis --t 2 --csv", file)
    assert file.read_text() == kr.Table(rows).to_csv()
    [(words, grid)] = console_calls
    assert words == {"markup": False, "highlight": False}
    assert list_cells_by_column(grid) == {
        "method": ["rk4", "extrap"],
        "step": ["0.1", ""],
        "tol": ["", "1e-09"],
        "ms": ["12.3", "2e+03"],
        "steps": ["20", "5"],
        "attitude error [rad]": ["1.3e-03", "nan"],
        "energy error": ["2.3e-05", "nan"],
        "": ["", "[b]too long[/b]"],
    }
    sides = [column.justify for column in grid.columns]
    assert sides == ["left", *["right"] * 6, "left"]
    assert [column.no_wrap for column in grid.columns] == [True] + 7 * [False]


def test_lists_are_printed_as_plain_text(console_calls):
    call("methods")
    call("quantities")
    for words, grid in console_calls:
        assert words == {"markup": False, "highlight": False}
        first, *rest = [column.no_wrap for column in grid.columns]
        assert first and not any(rest)
    console_calls.clear()
    call("methods rk4")
    assert [text.split()[0] for _, text in console_calls] == [
        *("name", "text", "order", "kind", "conserves", "for", "with", "reference")
    ]
    assert {tuple(words.items()) for words, _ in console_calls} == {
        (("markup", False), ("highlight", False))
    }
    assert "order      4" in [text for _, text in console_calls]
    assert "with       rotors" in [text for _, text in console_calls]
    console_calls.clear()
    call("methods exact")
    assert "kind       closed form" in [text for _, text in console_calls]


def test_documents_end_with_one_line_break(monkeypatch):
    monkeypatch.setattr(lists, "format_methods_page", lambda _: "a page\n")
    assert call("methods --markdown") == "a page\n"
    for line in ("scenes cusps", "view cusps --save -"):
        output = call(line)
        assert output.endswith("\n") and not output.endswith("\n\n")


# Times


@pytest.mark.parametrize(
    ("words", "t", "rest"),
    [
        ("0:4:1", 1.0, [2.0, 3.0, 4.0]),
        ("0:4:1", 0.5, [1.0, 2.0, 3.0, 4.0]),
        ("0:-4:1", -2.0, [-3.0, -4.0]),
        ("0:2:1,3,4:6:2", 3.0, [4.0, 6.0]),
        ("1:2:1", 0.0, [1.0, 2.0]),
        ("0:4:1", 4.0, []),
    ],
)
def test_later_times_are_those_beyond_the_present_one(words, t, rest):
    times = time_option.parse_times(words)
    later = times.select_later_times(t)
    assert list(later) == rest and len(later) == len(rest) and later.one is False
    assert len(later.grids) == len([grid for grid in later.grids if grid.count])
    if rest:
        assert later.end == rest[-1] and later.to_array().tolist() == rest


@pytest.mark.parametrize("words", ["0:10:0.1", "0:-10:0.1", "0.3:7:0.7,8:9:0.1"])
def test_later_times_have_the_same_bits_as_in_the_whole_grid(words):
    whole = later = time_option.parse_times(words)
    for t in 0.5, 3.0, 8.3:
        later = later.select_later_times(t)
        assert list(later) == [time for time in whole if abs(time) > t]
        assert later.to_array().tolist() == list(later)


@pytest.mark.parametrize("words, one", [("3", True), ("3,4", False), ("3:3:1", False)])
def test_a_single_number_is_the_time_to_reach(words, one):
    times = time_option.parse_times(words)
    assert times.one is one
    if one:
        assert times.to_solve_argument() == 3.0
    else:
        assert np.array_equal(times.to_solve_argument(), times.to_array())


@pytest.mark.parametrize(
    ("words", "count"),
    [
        ("0:1:0.3", 4),
        ("0:0.9:0.3", 4),
        ("0:1:0.35", 3),
        ("0:1:0.6", 2),
        ("0:1:0.7", 2),
        ("0:1:2", 1),
        ("0:1:2.5", 1),
        ("1e6:1000000.3:0.1", 4),
        ("0:0.29999999:0.1", 3),
        ("-1:-2:0.25", 5),
    ],
)
def test_a_grid_contains_the_multiples_of_its_step(words, count):
    grid = time_option.parse_times(words).grids[0]
    start, end, step = map(float, words.split(":"))
    assert grid.count == count and grid.start == start
    assert grid.step == math.copysign(step, end - start)
    assert grid[2] == start + 2 * grid.step


@pytest.mark.parametrize("ends", [[0.0], [0.0, 1.0, 1.0], [-1.0, -1.0, -2.0], [1.0, 5.0]])
def test_times_may_repeat_but_not_change_direction(ends):
    time_option._refuse_unordered_time_grids(ends)
    if len(ends) > 1:
        with pytest.raises(
            click.BadParameter, match=f"but {ends[0]!r} goes back from {ends[-1]!r}"
        ):
            time_option._refuse_unordered_time_grids([*ends, ends[0], ends[-1]])


# Parsers


@pytest.mark.parametrize(
    ("text", "terms"),
    [
        ("2*m_x+apex_z*apex_z-0.5", {"m_x": 2.0, "apex_z*apex_z": 1.0, "1": -0.5}),
        ("1e-3*m_x-2e+2*3*q_w", {"m_x": 1e-3, "q_w": -600.0}),
        ("m_x + m_x - 3*m_x", {"m_x": -1.0}),
        ("m_x--0.5", {"m_x": 1.0, "1": 0.5}),
        ("m_x+-0.5", {"m_x": 1.0, "1": -0.5}),
        ("--m_x - -1e-3 --+-2.e-1*m_y", {"m_x": 1.0, "1": 1e-3, "m_y": -0.2}),
    ],
)
def test_polynomials_are_sums_of_products(text, terms):
    assert event_option._parse_event_polynomial(text) == terms


@pytest.mark.parametrize(
    "text", ["", " ", "+", "m_x+", "m_x-", "2*", "2*-m_x", "*m_x", "2**m_x", 40 * "m" + "+"]
)
def test_incomplete_polynomials_are_refused(text):
    with pytest.raises(ValueError, match="is not a sum of products"):
        event_option._parse_event_polynomial(text)


@pytest.mark.parametrize(
    "word, message",
    [
        ("nutation:direction=1:direction=-1", "direction is already given"),
        ("nutation:terminal:terminal", "terminal is already given"),
        ("cusp:0.5:within=0.25", "within is already given"),
        ("separatrix:scene=cusps", "scene is already given"),
        ("nutation:max_count=1.5", "max_count must be a whole number, not '1.5'"),
        ("nutation:direction=up", "direction must be a whole number, not 'up'"),
        ("cusp:within=small", "within must be a number, not 'small'"),
        ("plane:0,1,0:zero", "offset must be a number, not 'zero'"),
        ("crossing:m_x+:0.5", "'m_x+' is not a sum of products such as 2*m_x*m_y-0.5"),
    ],
)
def test_wrong_arguments_of_events_are_refused(word, message):
    with pytest.raises(parsers.UsageError, match=re.escape(f"--events {word}: {message}") + "$"):
        event_option.parse_event_option(TOP, (word,))


def test_without_events_there_is_no_list():
    assert event_option.parse_event_option(TOP, ()) is None
    events = event_option.parse_event_option(
        TOP, ("cusp:within=0.25", "plane:normal=0,1,0:offset=2")
    )
    assert events == [kr.events.cusp(0.25), kr.events.plane((0, 1, 0), 2.0)]


def test_names_are_completed_by_their_beginning():
    complete = parsers.make_name_completer(["alpha", "beta", "alps"])
    assert [item.value for item in complete(None, None, "al")] == ["alpha", "alps"]
    items = parsers.make_name_completer(["alpha"], files=True)(None, None, "al")
    assert [(item.value, item.type) for item in items] == [("al", "file"), ("alpha", "plain")]
    last = parsers.make_list_completer(["alpha", "beta"])
    assert [item.value for item in last(None, None, "x,be")] == ["x,beta"]
    assert [item.value for item in last(None, None, "")] == ["alpha", "beta"]


@pytest.mark.parametrize(
    ("message", "text"),
    [
        ("leave out tol=1e-3, max_steps=5", "leave out --tol 1e-3, --max-steps 5"),
        ("steps=[0.1, 0.2] is too long", "steps=[0.1, 0.2] is too long"),
        ("t is wrong, and tol too", "--t is wrong, and tol too"),
        ("give tol or leave step", "give --tol or leave --step"),
        ("max_steps must be at least 0", "--max-steps must be at least 0"),
        ("raise max_steps", "raise --max-steps"),
        ("give max_steps or leave out max_steps", "give --max-steps or leave out --max-steps"),
        ("tol=(1, 2)", "--tol 1,2"),
        ("give t as a list", "give --t as a grid, as in --t 0:10:0.01"),
    ],
)
def test_arguments_in_messages_become_options(message, text):
    options = ("t", "tol", "step", "max_steps")
    assert parsers.replace_arguments_by_options(message, options) == text
    assert parsers.replace_arguments_by_options(message, ()) == message


@pytest.mark.parametrize(
    "error, text",
    [(MemoryError(), "it needs more memory"), (MemoryError("t is long"), "--t is long")],
)
def test_a_lack_of_memory_is_a_usage_error(error, text):
    with (
        pytest.raises(parsers.UsageError, match=f"^{text}$") as caught,
        parsers.convert_errors_to_usage_errors(("t",)),
    ):
        raise error
    assert caught.value.exit_code == 2


# Output files


def test_a_file_may_not_be_written_twice(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    places = output_files.parse_output_files([("--csv", "a"), ("--json", None), ("--npz", "b")], ())
    assert places == [("--csv", "a"), ("--npz", "b.npz")]
    assert [place.is_stdout for place in places] == [False, False]
    assert output_files.parse_output_files([("--csv", "-")], ("-",)) == [("--csv", "-")]
    with pytest.raises(parsers.UsageError, match=r"^--csv a: a is the same file$"):
        output_files.parse_output_files([("--csv", "a")], ("-", "a"))
    with pytest.raises(parsers.UsageError, match=r"^--json a: --csv a is the same file$"):
        output_files.parse_output_files([("--csv", "a"), ("--json", "a")], ("b",))
    with pytest.raises(parsers.UsageError, match=r"^--save writes \.html, not \.csv: a\.csv$"):
        output_files.parse_output_files([("view --save", "a.csv")], ())


# Fits


class StubFit:
    names, units = ("mass", "q_x"), ("M", "")
    has_converged = True

    def __init__(self):
        self.values = {"mass": 1.5, "q_x": 0.1}
        self.error = {"mass": 0.25, "q_x": math.inf}

    def __str__(self):
        return "summary"

    def to_toml(self):
        return "mass = 1.5\n"


CSV = "parameter,value,error,unit\nmass,1.5,0.25,M\nq_x,0.1,inf,\n"


@pytest.mark.parametrize(
    ("save", "csv_file", "text"),
    [
        (None, None, "summary\n"),
        ("-", None, "mass = 1.5\n"),
        (None, "-", CSV),
        ("a.toml", "-", CSV),
        ("-", "a.csv", "mass = 1.5\n"),
        ("a.toml", "a.csv", "summary\n"),
    ],
)
def test_the_results_of_a_fit_go_to_their_files(
    save, csv_file, text, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    fit_command._write_fit_results(StubFit(), save, csv_file, None)
    assert capsys.readouterr().out == text
    files = {"a.toml": "mass = 1.5\n", "a.csv": CSV}
    for name in (save, csv_file):
        if name in files:
            assert (tmp_path / name).read_text() == files[name]
    assert len(list(tmp_path.iterdir())) == len({save, csv_file} & set(files))


@pytest.mark.parametrize(
    ("words", "sigma"),
    [((), None), (("0.5",), 0.5), (("q=0.5",), {"q": 0.5}), (("q=1", "m=2"), {"q": 1.0, "m": 2.0})],
)
def test_standard_deviations_belong_to_all_or_to_single_quantities(words, sigma):
    assert fit_command._parse_sigma_options(words) == sigma


@pytest.mark.parametrize("words", [("x",), ("q=x",), ("0.5", "q=1"), ("q=",), ("=1",)])
def test_other_standard_deviations_are_refused(words):
    with pytest.raises(parsers.UsageError, match="--sigma"):
        fit_command._parse_sigma_options(words)


def test_columns_are_names_or_lists_of_names():
    assert fit_command._parse_quantity_columns(()) is None
    columns = fit_command._parse_quantity_columns(("q=a,b,c", "nutation=n"))
    assert columns == {"q": ["a", "b", "c"], "nutation": "n"}


@pytest.mark.parametrize("has_converged, code", [(True, 0), (False, 1)])
def test_a_fit_that_has_not_converged_ends_with_an_exit_code(has_converged, code, monkeypatch):
    calls, fit = [], StubFit()
    fit.has_converged = has_converged
    monkeypatch.setattr(fit_command, "_read_measurement_record", lambda *w: calls.append(w))
    monkeypatch.setattr(fit_command, "estimate", lambda *w, **more: calls.append((w, more)) or fit)
    result = CliRunner().invoke(cli.main, ["fit", "a.csv", "cusps"])
    assert result.exit_code == code and result.stdout == "summary\n"
    assert calls[0] == ("a.csv", None, "t", (), [], None, None)
    words = (kr.scenes.cusps, None, ["start", "moments"])
    assert calls[1] == (words, {"loss": "linear", "pieces": None, "max_evaluations": 2000})


def test_a_missing_record_is_a_usage_error(monkeypatch):
    monkeypatch.setattr(fit_command.Record, "from_csv", make_raiser(OSError("no disk")))
    with pytest.raises(parsers.UsageError, match=r"^no disk$"):
        fit_command._read_measurement_record("a", None, "t", (), [], None, None)
