"""Tests of events in streams and resumed runs."""

import itertools
import json
import pickle
import zlib

import kreisel as kr
import numpy as np
import pytest
from kreisel import events
from toolbox import python
from tops import GENERAL

LOOKED_FOR = [
    events.nutation(),
    events.plane((1, 0.3, -0.2), direction=1),
    events.crossing({"m_x*apex_y": 1, "m_y*apex_x": -1}, where={"apex_z": 1, "1": 0.9}),
    events.nutation(max_count=4),
]
WAYS = {
    "plain": {},
    "tol": {"tol": 1e-5},
    "digits": {"digits": 30},
    "want": {"want": ("energy",)},
}


def same(parts, whole):
    """Assert that consecutive paths contain the same states and events as a single path."""
    for name in ("states", "which", "direction"):
        values = np.concatenate([getattr(part.events, name) for part in parts])
        assert np.array_equal(values, getattr(whole.events, name)), name
    low = [part.events.path.q_low for part in parts]
    assert np.array_equal(np.concatenate(low), whole.events.path.q_low)
    for name in ("t", *(whole.want or ("states",))):
        values = np.concatenate([getattr(part, name) for part in parts])
        assert np.array_equal(values, getattr(whole, name)), name


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["forth", "back"])
@pytest.mark.parametrize("words", WAYS.values(), ids=WAYS)
@pytest.mark.parametrize("chunk", [1, 7, 1000])
def test_a_stream_finds_the_events_of_solve(words, chunk, sign):
    times = sign * np.linspace(0, 30, 61)
    whole = kr.solve(GENERAL, times, events=LOOKED_FOR, **words)
    assert np.bincount(whole.events.which).min() >= 2
    for t in (times, iter(times)):
        parts = list(kr.stream(GENERAL, t, events=LOOKED_FOR, chunk=chunk, **words))
        same(parts, whole)
        assert parts[-1].stats == whole.stats and len(parts[0]) == min(chunk, 61)


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["forth", "back"])
@pytest.mark.parametrize("words", WAYS.values(), ids=WAYS)
def test_a_saved_run_finds_the_events_of_solve(words, sign):
    """Save and resume a run at each event, and shortly before and after it."""
    event_times = kr.solve(GENERAL, sign * 30.0, events=LOOKED_FOR).events.t
    neighbours = np.concatenate(
        [event_times, np.nextafter(event_times, 0.0), np.nextafter(event_times, sign * 99.0)]
    )
    times = sign * np.unique(np.abs(np.concatenate([neighbours, sign * np.linspace(0, 30, 17)])))
    whole = kr.solve(GENERAL, times, events=LOOKED_FOR, **words)
    run, parts = kr.start(GENERAL, events=LOOKED_FOR, back=sign < 0, **words), []
    for t in times:
        parts.append(run.to([t]))
        run = (kr.resume(run.checkpoint), pickle.loads(pickle.dumps(run)))[len(parts) % 2]
    same(parts, whole)
    assert run.events == tuple(LOOKED_FOR)


def test_events_are_found_across_chunks():
    times = np.linspace(0, 30, 40_000)
    whole = kr.solve(GENERAL, times, events=LOOKED_FOR)
    energies = kr.solve(GENERAL, times, events=LOOKED_FOR, want=("energy",))
    assert np.array_equal(energies.events.states, whole.events.states)
    assert np.array_equal(energies.events.which, whole.events.which)
    assert np.array_equal(energies.energy, whole.energy)


# Terminal events


LAST = [events.nutation(max_count=3, terminal=True), events.loop()]


def test_a_terminal_event_ends_a_stream():
    times = np.linspace(0, 50, 501)
    whole = kr.solve(GENERAL, times, events=LAST)
    parts = list(kr.stream(GENERAL, times, events=LAST, chunk=10))
    same(parts, whole)
    assert parts[-1].t[-1] == whole.t[-1] < 50
    endless = kr.stream(GENERAL, (0.1 * k for k in itertools.count()), events=LAST, chunk=5)
    assert list(endless)[-1].t[-1] == whole.t[-1]


def test_a_terminal_event_ends_a_run():
    whole = kr.solve(GENERAL, 50, events=LAST)
    run = kr.start(GENERAL, events=LAST)
    assert not run.ended
    first = run.to(0.5 * whole.t[-1])
    assert not run.ended
    rest = kr.resume(run.checkpoint).to(50)
    last = run.to(50)
    assert run.ended and run.t == last.t[-1] == whole.t[-1] == rest.t[-1]
    assert np.array_equal(
        np.concatenate([first.events.states, last.events.states]), whole.events.states
    )
    for other_run in (run, kr.resume(run.checkpoint)):
        assert other_run.ended and list(other_run.stream([60.0, 70.0])) == []
        with pytest.raises(ValueError, match=r"this run has ended at t = .* a terminal event"):
            other_run.to(60)
    next_path = kr.start(last.end, events=LAST).to(50)
    assert len(next_path.events) > 2


def test_a_terminal_event_ends_wanted_quantities():
    times = np.linspace(0, 50, 60_000)
    whole = kr.solve(GENERAL, times, events=LAST)
    apex_path = kr.solve(GENERAL, times, events=LAST, want=("apex",))
    assert np.array_equal(apex_path.t, whole.t) and np.array_equal(apex_path.apex, whole.apex)
    assert apex_path.t[-1] == apex_path.events.t[-1]


# Interrupted runs, and invalid checkpoints


def test_a_stopped_run_loses_no_event():
    whole = kr.solve(GENERAL, 3e3, events=[events.nutation()])
    run, reports = kr.start(GENERAL, events=[events.nutation()], max_steps=1000), []
    with pytest.raises(kr.Error, match="largest number of steps") as error:
        run.to(3e3, progress=reports.append)
    assert 0 < run.t < 3e3
    next_run = kr.resume(run.checkpoint, max_steps=0)
    parts = [error.value.path, next_run.to(3e3)]
    states = np.concatenate([part.events.states for part in parts])
    assert np.array_equal(states, whole.events.states)


def test_ctrl_c_works_with_dense_times():
    code = """
import numpy as np, kreisel as kr
def stop(t):
    raise KeyboardInterrupt
try:
    kr.solve(kr.scenes.asymmetric, np.linspace(0, 1e-3, 5_000_000), events=[], progress=stop)
except kr.Interrupted as stopped:
    print(len(stopped.path))
"""
    result = python(code)
    assert result.returncode == 0, result.stderr
    assert 1000 < int(result.stdout) < 5_000_000


@pytest.mark.parametrize("verb", [kr.solve, kr.stream])
def test_every_is_refused_with_events(verb):
    with pytest.raises(ValueError, match="every needs a method of fixed step"):
        verb(GENERAL, 1.0, events=LOOKED_FOR, every=2)
    with pytest.raises(ValueError, match=r"events need the polynomials .* 'strang' computes none"):
        verb(GENERAL, 1.0, "strang", step=0.1, events=LOOKED_FOR, every=2)


def test_a_run_shows_its_events():
    run = kr.start(GENERAL, events=events.nutation(), want=("energy",))
    assert run.method == "taylor" and run.events == (events.nutation(),)
    assert ("attitude", "events may need it") in run.plan.kept
    path = run.to(3.0)
    assert path.plan.kept == run.plan.kept and path.want == ("energy",)
    assert kr.start(GENERAL).events is None and len(kr.start(GENERAL).to(1.0).events) == 0
    with pytest.raises(TypeError, match="events must be an event"):
        kr.start(GENERAL, events="nutation")


def forge_checkpoint(run, **changes):
    """Return a checkpoint with a modified header and a correct checksum."""
    line, _, memory = run.checkpoint[21:].partition(b"\n")
    body = json.dumps(json.loads(line) | changes).encode() + b"\n" + memory
    return b"kreisel run\n%08x\n" % zlib.crc32(body) + body


ROW = {
    "terms": [[1.0, "apex_z", "1"]],
    "where": [],
    "extremum": True,
    "direction": 0,
    "max_count": None,
    "terminal": False,
}


def event_header(**words):
    return {"events": [ROW | words]}


def test_a_rewritten_valid_checkpoint_is_accepted():
    run = kr.start(GENERAL, events=[events.nutation()])
    run.to(5.0)
    assert kr.resume(forge_checkpoint(run)).to(9.0).events.t.size
    assert kr.resume(forge_checkpoint(run, events=[ROW])).events == (events.nutation(),)


@pytest.mark.parametrize(
    "changes",
    [
        event_header(terms=[[1.0, "apex_y", "1"]]),
        event_header(terms=[[1.0, "apex_q", "1"]]),
        event_header(terms=[["1", "apex_z", "1"]]),
        event_header(terms=[[float("nan"), "apex_z", "1"]]),
        event_header(terms=[[1.0, "apex_z"]]),
        event_header(terms=[]),
        event_header(terms=3),
        event_header(where=[[1.0, "apex_z", "1"]]),
        event_header(extremum=1),
        event_header(extremum=False),
        event_header(direction=7),
        event_header(direction=1),
        event_header(max_count=0),
        event_header(terminal="yes"),
        {"events": [{"terms": ROW["terms"]}]},
        {"events": [7]},
        {"events": None},
        {"events": []},
        {"events": [ROW, ROW]},
        {"events": 3},
        {"found": []},
        {"found": [1, 2]},
        {"found": [-1]},
        {"found": [2**63]},
        {"found": ["1"]},
        {"found": 3},
        {"method": "strang", "step": 0.1},
    ],
)
def test_hostile_checkpoints_are_refused(changes):
    run = kr.start(GENERAL, events=[events.nutation()])
    run.to(5.0)
    with pytest.raises(ValueError, match="the checkpoint is not a checkpoint of a run"):
        kr.resume(forge_checkpoint(run, **changes))
