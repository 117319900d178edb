"""Tests that sweeps compute the same chaos indicators and sections as the public functions."""

import json
import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from kreisel._sweep import runner
from sweeps import LOW, TOP, hash_rows

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
WORDS = [{"task": task, **words} for task, words in GROWN.items()]
WORDS += [{"task": "section", **words} for words in MET]


def ensemble():
    return SOURCE[:].reshape(*SOURCE.shape)


@pytest.fixture(scope="module")
def pool():
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
        yield executor


@pytest.mark.parametrize("task", GROWN)
def test_indicators_equal_those_of_the_ensemble(tmp_path, task):
    sweep = kr.sweep(SOURCE, folder=tmp_path, task=task, part_size=7, **GROWN[task])
    whole = getattr(kr, task)(ensemble(), **GROWN[task])
    columns = {task: whole.value, "certificate": whole.certificate, f"{task}_curve": whole.curve}
    columns |= {"is_chaotic": whole.is_chaotic, "is_doubtful": whole.is_doubtful}
    columns["t"] = np.broadcast_to(whole.t, whole.curve.shape)
    for name, values in columns.items():
        assert np.array_equal(sweep[name], values, equal_nan=values.dtype.kind == "f"), name
    assert np.array_equal(sweep["status"] != 0, whole.status != "OK")
    assert np.isfinite(sweep[task]).any()
    assert (sweep["status"] != 0).any() == (task == "oli")
    assert sweep.units[f"{task}_curve"] == sweep.units[task] == ("T^-1" * (task == "lyapunov"))
    assert sweep.events is None and sweep.plan[task]["t"] == GROWN[task]["t"]
    grid = sweep.to_xarray()
    assert grid[f"{task}_curve"].dims == ("spin", "gravity", "time")
    assert np.array_equal(grid["time"], whole.t) and grid[task].shape == SOURCE.shape
    frame = sweep.to_pandas()
    assert np.array_equal(frame[f"{task}_curve"], whole.curve.ravel(), equal_nan=True)


def test_a_single_top_has_a_section_too(tmp_path):
    alone, words = kr.scenes.asymmetric.vary(spin=[1.0]), {"n": 3, "max_wait": 20.0}
    sweep = kr.sweep(alone, folder=tmp_path, task="section", **words)
    assert sweep["event_t"].size == 3
    assert np.array_equal(sweep["event_t"], kr.section(alone, **words).states[:, 0])


@pytest.mark.parametrize("words", MET)
def test_sections_equal_those_of_the_ensemble(tmp_path, words):
    sweep = kr.sweep(SOURCE, folder=tmp_path, task="section", part_size=7, **words)
    whole = kr.section(ensemble(), **words)
    for name in ("status", "reached", "steps"):
        assert np.array_equal(sweep[name], getattr(whole, name)), name
    assert np.array_equal(sweep["events"], whole.count)
    assert 0 < whole.count.sum() < SOURCE.size * words["n"]
    flat = np.column_stack([sweep[f"event_{name}"] for name in ("t", "q_w", "q_z", "m_x", "m_z")])
    assert np.array_equal(flat, whole.states[:, [0, 1, 4, 5, 7]])
    lists = sweep.to_arrow()["event_t"].to_pylist()
    assert [len(times) for times in lists] == whole.count.ravel().tolist()
    assert sweep.units["event_t"] == "T" and sweep.units["event_m_x"] == "M L^2 T^-1"
    assert sweep.events is None and "event_t" not in sweep.to_xarray()


@pytest.mark.parametrize("words", WORDS)
def test_results_do_not_depend_on_the_workers(tmp_path, pool, words):
    kr.sweep(SOURCE, folder=tmp_path / "processes", part_size=7, executor=pool, **words)
    kr.sweep(SOURCE, folder=tmp_path / "one", part_size=7, threads=1, **words)
    kr.sweep(SOURCE, folder=tmp_path / "two", part_size=7, threads=2, parts=range(1, 3), **words)
    kr.sweep(SOURCE, folder=tmp_path / "two", part_size=7, threads=2, **words)
    assert len({hash_rows(tmp_path / each) for each in ("processes", "one", "two")}) == 1
    again = kr.read_sweep(tmp_path / "one")
    plan = json.loads((tmp_path / "one" / "plan.json").read_text())["plan"]
    assert plan == json.loads(json.dumps(again.plan))
    with pytest.raises(ValueError, match="is of another plan"):
        kr.sweep(SOURCE, folder=tmp_path / "one", part_size=7, **words | {"tol": 1e-7})


def test_equivalent_arguments_give_one_plan(tmp_path):
    pairs = [
        ({"task": "megno", "t": 1, "direction": np.array(DIRECTION)}, {"direction": DIRECTION}),
        ({"task": "section", "n": 500, "event": LOW}, {"n": None, "event": None}),
    ]
    for words, other in pairs:
        folder = tmp_path / words["task"]
        one = kr.sweep(SOURCE, folder=folder, parts=range(0), **words)
        assert kr.sweep(SOURCE, folder=folder, parts=range(0), **words | other).hash == one.hash
    hashes = {
        kr.sweep(SOURCE, 5, folder=tmp_path / task, task=task, parts=range(0)).hash
        for task in ("solve", "lyapunov", "oli")
    }
    assert len(hashes) == 3


def test_a_scattered_top_has_its_start_in_columns(tmp_path):
    source = kr.Source.scatter(TOP, 6, seed=2, gravity=0.1)
    sweep = kr.sweep(source, 5, folder=tmp_path, task="oli", part_size=4)
    assert np.array_equal(sweep["gravity"], source[:].gravity)
    assert np.array_equal(sweep["oli"], kr.oli(source[:], 5).value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('task = "lyapunov"\nt = 20\ntol = 1e-9', {"task": "lyapunov", "t": 20, "tol": 1e-9}),
        (
            "task = 'megno'\nt = { from = 1, to = 3, n = 3 }\ndirection = [0, 0, 0, 1, 0, 0]",
            {"task": "megno", "t": [1, 2, 3], "direction": DIRECTION},
        ),
        (
            "task = 'section'\nn = 3\nmax_wait = 5\nevent = { event = 'plane', normal = [0, 0, 1], "
            "offset = 0.3 }",
            {"task": "section", "n": 3, "max_wait": 5, "event": PLANE},
        ),
    ],
)
def test_a_plan_in_a_file_equals_the_plan_of_the_same_arguments(tmp_path, text, words):
    table = "\npart_size = 4\nscene = 'asymmetric'\n[grid]\nspin = [1, 2]\n"
    (tmp_path / "plan.toml").write_text(text + table)
    sweep = kr.sweep(tmp_path / "plan.toml", folder=tmp_path / "runs")
    source = kr.Source.grid(TOP, spin=[1, 2])
    assert kr.sweep(source, folder=sweep.folder, part_size=4, **words).hash == sweep.hash
    assert not sweep.missing
    with pytest.raises(ValueError, match="is a whole plan"):
        kr.sweep(tmp_path / "plan.toml", folder=tmp_path / "runs", task="oli")


@pytest.mark.parametrize(
    ("error", "message", "words"),
    [
        (ValueError, "unknown task 'lyapunow'; did you mean 'lyapunov'", {"task": "lyapunow"}),
        (ValueError, "unknown task", {"task": 3}),
        (TypeError, "t is missing", {"task": "megno"}),
        (
            ValueError,
            "megno has no argument 'reduce'",
            {"task": "megno", "reduce": {"spin": "min"}},
        ),
        (ValueError, "lyapunov has no argument 'method'", {"task": "lyapunov", "method": "taylor"}),
        (ValueError, "solve has no argument 'max_wait'", {"t": 1, "max_wait": 3}),
        (ValueError, "section has no argument 't'", {"task": "section", "t": 1}),
        (ValueError, "section has no argument 'events'", {"task": "section", "events": LOW}),
        (ValueError, "and not 0", {"task": "oli", "t": 0}),
        (ValueError, "the same for all tops of a sweep", {"task": "oli", "t": np.ones((4, 5, 2))}),
        (ValueError, "direction must be six", {"task": "oli", "t": 1, "direction": [1, 2]}),
        (ValueError, "tol must be", {"task": "oli", "t": 1, "tol": -1}),
        (ValueError, "max_steps must be", {"task": "oli", "t": 1, "max_steps": -1}),
        (ValueError, "n must be at least 1", {"task": "section", "n": 0}),
        (ValueError, "max_wait must not be zero", {"task": "section", "max_wait": 0}),
        (ValueError, "max_wait must be a number", {"task": "section", "max_wait": np.ones((4, 5))}),
        (ValueError, "max_wait must be finite", {"task": "section", "max_wait": np.nan}),
        (TypeError, "event", {"task": "section", "event": 3}),
        (ValueError, "leave max_count", {"task": "section", "event": kr.events.loop(max_count=3)}),
        (MemoryError, "smaller parts", {"task": "section", "n": 10**12}),
    ],
)
def test_invalid_arguments_raise_before_anything_runs(tmp_path, error, message, words):
    with pytest.raises(error, match=message):
        kr.sweep(SOURCE, folder=tmp_path / "runs", **words)
    assert not (tmp_path / "runs").exists()


def test_a_damped_top_has_no_indicator(tmp_path):
    source = kr.Source.grid(TOP, damping=[(0, 0, 0), (1, 1, 1)])
    with pytest.raises(ValueError, match="a damped top has no indicator of chaos"):
        kr.sweep(source, 1, folder=tmp_path / "runs", task="oli")
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("words", WORDS, ids=lambda words: words["task"])
def test_ctrl_c_keeps_stored_parts_and_the_same_call_resumes(tmp_path, monkeypatch, words):
    def stop(share):
        if share > 0.5:
            raise KeyboardInterrupt

    monkeypatch.setattr(runner, "_PROGRESS_SECONDS", 0.0)
    with pytest.raises(kr.SweepInterrupted, match="repeating the call") as interruption:
        kr.sweep(SOURCE, folder=tmp_path / "stopped", part_size=4, progress=stop, **words)
    assert interruption.value.sweep.present and interruption.value.sweep.missing
    for name in ("stopped", "whole"):
        kr.sweep(SOURCE, folder=tmp_path / name, part_size=4, **words)
    assert hash_rows(tmp_path / "stopped") == hash_rows(tmp_path / "whole")
