"""Tests of how the report stores measurements and selects the fastest run."""

import os
from dataclasses import replace
from io import StringIO

import kreisel as kr
import pytest
from rich.console import Console

from validation.competitors import timing
from validation.competitors.method_families import group_methods
from validation.parts import fastest, scene_runs
from validation.parts.result_cache import ResultStore, write_atomic
from validation.parts.tasks import TYPICAL, Task, estimate_minutes, run_tasks
from validation.report.main import make_progress


def row(error, energy, seconds):
    values = {"tol": error, "attitude_error": error, "energy_error": energy, "samples": [seconds]}
    return scene_runs.Measurement("thesis", 1.0, "m", False, **values)


def test_accidentally_small_errors_do_not_win():
    lucky, honest, finer = row(1e-13, 1e-13, 1), row(5e-7, 1e-8, 2), row(1e-8, 1e-9, 3)
    assert fastest.fastest_reaching([lucky, honest, finer], 1e-6) is lucky
    assert fastest.fastest_reaching([lucky, honest, finer], 1e-9) is None, (
        "the next tighter run is worse"
    )
    assert fastest.fastest_reaching([row(1e-13, 1e-5, 1), honest, finer], 1e-6) is honest, (
        "the energy disagrees"
    )
    assert fastest.fastest_reaching([honest], 1e-6) is None, "nothing tighter bears it out"
    closed_form = replace(honest, tol=None)
    assert fastest.fastest_reaching([closed_form], 1e-6) is closed_form


def test_findings_are_stored_and_not_recomputed(tmp_path):
    calls = []

    def make(i):
        if i == 2 and len(calls) < 3:
            calls.append("interrupted")
            raise KeyboardInterrupt
        calls.append(i)
        return i

    class Bar:
        add_task = update = advance = staticmethod(lambda *args, **words: None)

    tasks = [Task(f"task/{i}", lambda i=i: make(i)) for i in range(4)]
    with pytest.raises(KeyboardInterrupt):
        run_tasks(tasks, ResultStore(tmp_path / "findings.jsonl", ["as before"]), Bar)
    run_tasks(tasks, ResultStore(tmp_path / "findings.jsonl", ["as before"]), Bar)
    assert calls == [0, 1, "interrupted", 2, 3]
    text = (tmp_path / "findings.jsonl").read_text()
    (tmp_path / "findings.jsonl").write_text(text + "[cut off")
    assert ResultStore(tmp_path / "findings.jsonl", ["as before"]).under("task/") == [0, 1, 2, 3]
    assert ResultStore(tmp_path / "findings.jsonl", ["another machine"]).known == {}


def test_the_time_said_beforehand_is_that_of_the_remaining_tasks(tmp_path, monkeypatch):
    store = ResultStore(tmp_path / "findings.jsonl", [])
    tasks = [Task(f"task/{i}", lambda: 1, 90.0) for i in range(4)]
    for slowness, minutes in ((1.0, 6), (3.0, 18)):
        monkeypatch.setattr(timing, "time_once", lambda call, slowness=slowness: TYPICAL * slowness)
        assert estimate_minutes(tasks, store) == minutes
    store.put("task/0", 1)
    store.put("task/1", 1)
    assert estimate_minutes(tasks, store) == 9


def test_a_report_without_a_terminal_prints_progress_in_tenths():
    console = Console(file=StringIO(), width=80)
    with make_progress(console) as bar:
        task = bar.add_task("", total=40.0)
        for i in range(40):
            bar.update(task, description=f"part/{i} [x]")
            bar.advance(task, 1.0)
    lines = console.file.getvalue().splitlines()
    for tenth, line in enumerate(lines[:10], 1):
        assert line == f"{10 * tenth:3} %  part/{4 * tenth - 1} [x]"
    assert len(lines) == 11 and "100 %" in lines[10]


def test_findings_after_a_truncated_line_are_kept(tmp_path):
    file = tmp_path / "findings.jsonl"
    ResultStore(file, ["as before"]).put("a", 1)
    with file.open("a") as out:
        out.write('["cu')
    ResultStore(file, ["as before"]).put("b", 2)
    assert ResultStore(file, ["as before"]).known == {"a": 1, "b": 2}


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_files_are_written_atomically(tmp_path, monkeypatch, call):
    file = tmp_path / "index.html"
    write_atomic(file, "old")

    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(os, call, full)
        with pytest.raises(OSError, match="No space"):
            write_atomic(file, "new")
    assert file.read_text() == "old" and os.listdir(tmp_path) == ["index.html"]
    write_atomic(file, "new\r\n")
    assert file.read_bytes() == b"new\r\n"


def test_every_method_is_in_one_family_or_a_peer():
    families = group_methods().values()
    peers = next(iter(families))[1]
    places = [name for own, _ in families for name in own]
    assert sorted(places + [name for name in peers if name in kr.methods]) == sorted(kr.methods)
