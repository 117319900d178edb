"""Indicators of chaos and sections in sweeps equal those of the functions."""

import json
import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from kreisel._sweep import runner
from kreisel._sweep import store as folder_of
from sweeps import LOW, TOP, rows_hash

SOURCE = kr.Source.grid(TOP, spin=np.linspace(0, 9, 4), gravity=np.linspace(-1, 1, 5))
DIRECTION = [0, 0, 0, 1, 0, 0]
PLANE = kr.events.plane((0, 0, 1), 0.3)
GROWN = {
    "lyapunov": {"t": 30, "tol": 1e-9},
    "megno": {"t": [-3, -9.5], "direction": DIRECTION},
    "oli": {"t": 20.0, "max_steps": 60},
}
MET = [
    {"n": 5, "max_wait": -4},
    {"n": 3, "event": PLANE, "max_wait": 2.5, "max_steps": 50, "tol": 1e-9},
]
WORDS = [{"verb": verb, **words} for verb, words in GROWN.items()]
WORDS += [{"verb": "section", **words} for words in MET]


def ensemble():
    return SOURCE[:].reshape(*SOURCE.shape)


@pytest.fixture(params=["parquet", "npy"])
def form(request, monkeypatch):
    monkeypatch.setattr(folder_of, "_best_form", lambda: request.param)
    return request.param


@pytest.fixture(scope="module")
def pool():
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as made:
        yield made


@pytest.mark.parametrize("verb", GROWN)
def test_indicators_are_those_of_the_ensemble(tmp_path, form, verb):
    found = kr.sweep(SOURCE, to=tmp_path, verb=verb, part=7, **GROWN[verb])
    whole = getattr(kr, verb)(ensemble(), **GROWN[verb])
    columns = {verb: whole.value, "certificate": whole.certificate, f"{verb}_curve": whole.curve}
    columns["t"] = np.broadcast_to(whole.t, whole.curve.shape)
    for name, values in columns.items():
        assert np.array_equal(found[name], values, equal_nan=True), name
    assert np.array_equal(found["status"] != 0, whole.status != "OK")
    assert np.isfinite(found[verb]).any()
    assert (found["status"] != 0).any() == (verb == "oli")
    assert found.units[f"{verb}_curve"] == found.units[verb] == ("T^-1" * (verb == "lyapunov"))
    assert found.events is None and found.plan[verb]["t"] == GROWN[verb]["t"]
    grid = found.to_xarray()
    assert grid[f"{verb}_curve"].dims == ("spin", "gravity", "time")
    assert np.array_equal(grid["time"], whole.t) and grid[verb].shape == SOURCE.shape
    frame = found.to_pandas()
    assert np.array_equal(frame[f"{verb}_curve"], whole.curve.ravel(), equal_nan=True)


def test_a_single_top_has_a_section_too(tmp_path):
    alone, words = kr.scenes.asymmetric.vary(spin=[1.0]), {"n": 3, "max_wait": 20.0}
    found = kr.sweep(alone, to=tmp_path, verb="section", **words)
    assert found["event_t"].size == 3
    assert np.array_equal(found["event_t"], kr.section(alone, **words).states[:, 0])


@pytest.mark.parametrize("words", MET)
def test_sections_are_those_of_the_ensemble(tmp_path, form, words):
    found = kr.sweep(SOURCE, to=tmp_path, verb="section", part=7, **words)
    whole = kr.section(ensemble(), **words)
    for name in ("status", "reached", "steps"):
        assert np.array_equal(found[name], getattr(whole, name)), name
    assert np.array_equal(found["events"], whole.count)
    assert 0 < whole.count.sum() < SOURCE.size * words["n"]
    flat = np.column_stack([found[f"event_{name}"] for name in ("t", "q_w", "q_z", "m_x", "m_z")])
    assert np.array_equal(flat, whole.states[:, [0, 1, 4, 5, 7]])
    lists = found.to_arrow()["event_t"].to_pylist()
    assert [len(times) for times in lists] == whole.count.ravel().tolist()
    assert found.units["event_t"] == "T" and found.units["event_m_x"] == "M L^2 T^-1"
    assert found.events is None and "event_t" not in found.to_xarray()


@pytest.mark.parametrize("words", WORDS)
def test_who_makes_them_does_not_show(tmp_path, pool, words):
    kr.sweep(SOURCE, to=tmp_path / "processes", part=7, executor=pool, **words)
    kr.sweep(SOURCE, to=tmp_path / "one", part=7, threads=1, **words)
    kr.sweep(SOURCE, to=tmp_path / "two", part=7, threads=2, parts=range(1, 3), **words)
    kr.sweep(SOURCE, to=tmp_path / "two", part=7, threads=2, **words)
    assert len({rows_hash(tmp_path / each) for each in ("processes", "one", "two")}) == 1
    again = kr.read_sweep(tmp_path / "one")
    told = json.loads((tmp_path / "one" / "plan.json").read_text())["plan"]
    assert told == json.loads(json.dumps(again.plan))
    with pytest.raises(ValueError, match="is of another plan"):
        kr.sweep(SOURCE, to=tmp_path / "one", part=7, **words | {"tol": 1e-7})


def test_ways_to_say_the_same_are_one_plan(tmp_path):
    alike = [
        ({"verb": "megno", "t": 1, "direction": np.array(DIRECTION)}, {"direction": DIRECTION}),
        ({"verb": "section", "n": 500, "event": LOW}, {"n": None, "event": None}),
    ]
    for words, other in alike:
        folder = tmp_path / words["verb"]
        one = kr.sweep(SOURCE, to=folder, parts=range(0), **words)
        assert kr.sweep(SOURCE, to=folder, parts=range(0), **words | other).hash == one.hash
    hashes = {
        kr.sweep(SOURCE, 5, to=tmp_path / verb, verb=verb, parts=range(0)).hash
        for verb in ("solve", "lyapunov", "oli")
    }
    assert len(hashes) == 3


def test_a_scattered_top_tells_its_start(tmp_path):
    source = kr.Source.scatter(TOP, 6, seed=2, gravity=0.1)
    found = kr.sweep(source, 5, to=tmp_path, verb="oli", part=4)
    assert np.array_equal(found["gravity"], source[:].gravity)
    assert np.array_equal(found["oli"], kr.oli(source[:], 5).value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('verb = "lyapunov"\nt = 20\ntol = 1e-9', {"verb": "lyapunov", "t": 20, "tol": 1e-9}),
        (
            "verb = 'megno'\nt = { from = 1, to = 3, n = 3 }\ndirection = [0, 0, 0, 1, 0, 0]",
            {"verb": "megno", "t": [1, 2, 3], "direction": DIRECTION},
        ),
        (
            "verb = 'section'\nn = 3\nmax_wait = 5\nevent = { event = 'plane', normal = [0, 0, 1], "
            "offset = 0.3 }",
            {"verb": "section", "n": 3, "max_wait": 5, "event": PLANE},
        ),
    ],
)
def test_a_plan_in_a_file_is_the_plan_in_words(tmp_path, text, words):
    table = "\npart = 4\nscene = 'asymmetric'\n[grid]\nspin = [1, 2]\n"
    (tmp_path / "plan.toml").write_text(text + table)
    done = kr.sweep(tmp_path / "plan.toml", to=tmp_path / "runs")
    source = kr.Source.grid(TOP, spin=[1, 2])
    assert kr.sweep(source, to=done.folder, part=4, **words).hash == done.hash
    assert not done.missing
    with pytest.raises(ValueError, match="is a whole plan"):
        kr.sweep(tmp_path / "plan.toml", to=tmp_path / "runs", verb="oli")


@pytest.mark.parametrize(
    ("error", "said", "words"),
    [
        (ValueError, "unknown verb 'lyapunow'; did you mean 'lyapunov'", {"verb": "lyapunow"}),
        (ValueError, "unknown verb", {"verb": 3}),
        (TypeError, "t is missing", {"verb": "megno"}),
        (ValueError, "megno has no word 'reduce'", {"verb": "megno", "reduce": {"spin": "min"}}),
        (ValueError, "lyapunov has no word 'method'", {"verb": "lyapunov", "method": "taylor"}),
        (ValueError, "solve has no word 'max_wait'", {"t": 1, "max_wait": 3}),
        (ValueError, "section has no word 't'", {"verb": "section", "t": 1}),
        (ValueError, "section has no word 'events'", {"verb": "section", "events": LOW}),
        (ValueError, "not 0", {"verb": "oli", "t": 0}),
        (ValueError, "which all tops of a sweep share", {"verb": "oli", "t": np.ones((4, 5, 2))}),
        (ValueError, "direction must be six", {"verb": "oli", "t": 1, "direction": [1, 2]}),
        (ValueError, "tol must be", {"verb": "oli", "t": 1, "tol": -1}),
        (ValueError, "max_steps must be", {"verb": "oli", "t": 1, "max_steps": -1}),
        (ValueError, "n must be at least 1", {"verb": "section", "n": 0}),
        (ValueError, "max_wait must not be zero", {"verb": "section", "max_wait": 0}),
        (ValueError, "max_wait must be a number", {"verb": "section", "max_wait": np.ones((4, 5))}),
        (ValueError, "max_wait must be finite", {"verb": "section", "max_wait": np.nan}),
        (TypeError, "event", {"verb": "section", "event": 3}),
        (ValueError, "leave max_count", {"verb": "section", "event": kr.events.loop(max_count=3)}),
        (MemoryError, "smaller parts", {"verb": "section", "n": 10**12}),
    ],
)
def test_words_that_cannot_be_are_told_before_anything_runs(tmp_path, error, said, words):
    with pytest.raises(error, match=said):
        kr.sweep(SOURCE, to=tmp_path / "runs", **words)
    assert not (tmp_path / "runs").exists()


def test_a_damped_top_has_no_indicator(tmp_path):
    source = kr.Source.grid(TOP, damping=[(0, 0, 0), (1, 1, 1)])
    with pytest.raises(ValueError, match="a damped top has no such indicator"):
        kr.sweep(source, 1, to=tmp_path / "runs", verb="oli")
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("words", WORDS, ids=lambda words: words["verb"])
def test_ctrl_c_keeps_what_is_done_and_the_same_call_goes_on(tmp_path, monkeypatch, words):
    def stop(share):
        if share > 0.5:
            raise KeyboardInterrupt

    monkeypatch.setattr(runner, "_TELL", 0.0)
    with pytest.raises(kr.SweepInterrupted, match="the same") as told:
        kr.sweep(SOURCE, to=tmp_path / "stopped", part=4, progress=stop, **words)
    assert told.value.sweep.done and told.value.sweep.missing
    for name in ("stopped", "whole"):
        kr.sweep(SOURCE, to=tmp_path / name, part=4, **words)
    assert rows_hash(tmp_path / "stopped") == rows_hash(tmp_path / "whole")
