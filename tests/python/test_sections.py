"""Tests of Poincare sections of ensembles against known results."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from ensembles import SCENES
from tops import CORNER, FREE, LAGRANGE

TOP = kr.scenes.asymmetric

TOPS = kr.Ensemble.of([kr.scenes.asymmetric.replace(momentum=m) for m in np.eye(3) + 0.3])
LOW = kr.events.nutation(direction=1)
LOOP = kr.events.loop()
FIELDS = "states", "top", "count", "status", "reached", "steps", "max_wait"


def same(one, other):
    return all(np.array_equal(getattr(one, f), getattr(other, f)) for f in FIELDS)


def random_ensemble(n):
    momenta = np.random.default_rng(5).normal(size=(n, 3))
    return kr.Ensemble(CORNER, momentum=momenta, attitude=(0.8, 0.4, -0.2, 0.4), gravity=1)


@pytest.mark.parametrize("scene", [LAGRANGE, kr.scenes.cusps])
def test_the_section_of_a_lagrange_top_contains_its_lowest_points(scene):
    section, exact = kr.section(scene, n=50), kr.exact(scene)
    assert np.abs(section.t - exact.t_greatest - exact.period * np.arange(50)).max() < 1e-10
    assert np.abs(section.nutation - exact.greatest_nutation).max() < 1e-12
    assert np.ptp(section.axial_momentum) < 1e-12
    turns = np.diff(section.precession_angle) - exact.precession_rate * exact.period
    halves = (
        2.0 if exact.motion_type == "rosette" else 1.0
    )  # a passage through the pole does not count as a turn
    assert np.abs(np.exp(1j * halves * turns) - 1.0).max() < 1e-10


def test_the_section_of_a_free_body_lies_on_its_ellipsoid():
    section = kr.section(FREE, kr.events.plane((0, 0, 1), of="body_velocity", direction=1), n=40)
    energy = 0.5 * (section.body_velocity * section.body_momentum).sum(axis=1)
    assert np.abs(section.body_velocity[:, 2]).max() < 1e-12
    assert np.ptp(energy) < 1e-12 * energy[0]
    assert np.ptp(np.linalg.norm(section.m, axis=1)) < 1e-12
    # the accuracy that is possible near the middle axis
    assert np.abs(np.diff(section.t) - 2.0 * kr.exact(FREE).period).max() < 1e-6


@pytest.mark.parametrize("event", [LOW, LOOP])
def test_kowalewskis_integral_is_constant_on_sections(event):
    tops = kr.starts(kr.scenes.kowalewski.body, energy=1.0, vertical=0.5, n=4, gravity=1)
    section = kr.section(tops, event, n=100, max_wait=200)
    assert len(section.t) > 100
    for i in range(4):
        path = section[i]
        assert np.ptp(path.kowalewski) <= 1e-11 * max(1.0, path.kowalewski.max(initial=0.0))
    assert np.ptp(section.energy) < 1e-12 and np.ptp(section.vertical_momentum) < 1e-12


def test_a_section_equals_the_events_of_paths():
    section = kr.section(TOPS, n=8)
    paths = kr.solve(TOPS, float(section.t.max()) + 1.0, "taylor", events=[LOW])
    for i in range(3):
        own_section, event_path = section[i], paths[i].events.path
        assert isinstance(own_section, kr.Path) and len(own_section) == 8
        assert np.abs(own_section.states - event_path.states[:8]).max() < 1e-8
    assert section.top.tolist() == sorted(section.top.tolist()) and section.n == 8


def test_sections_can_be_indexed_and_printed():
    section = kr.section(TOPS, n=5)
    assert len(section) == 3 and section.shape == (3,) and section.count.tolist() == [5, 5, 5]
    assert section.frame.shape == (15, 3, 3) and section.q.shape == (15, 4)
    assert np.array_equal(section.apex[5:10], section[1].apex)
    assert "15 states of 3 tops" in repr(section) and not section.t.flags.writeable
    assert (
        same(section[[2, 0]][1:], section[:1]) and section[np.array([True, False, True])].size == 2
    )
    with pytest.raises(AttributeError, match="did you mean 'nutation'"):
        _ = section.nutatoin
    with pytest.raises(TypeError, match="not an array"):
        np.asarray(section)
    square = kr.section(TOPS[:2].reshape(1, 2), n=5)
    assert square.top.shape == (10, 2) and np.array_equal(square.states, section[:2].states)
    assert kr.section(TOPS[:0], n=5).states.shape == (0, 8)


def test_the_section_of_a_top_does_not_depend_on_other_tops():
    tops, words = random_ensemble(120), {"n": 12, "max_wait": 60}
    whole = kr.section(tops, **words)
    assert same(kr.section(tops, threads=1, **words), whole)
    assert same(kr.section(tops, threads=3, **words), whole)
    assert same(kr.section(tops[17:60:3], **words), whole[17:60:3])
    for pool in (ThreadPoolExecutor(2), ProcessPoolExecutor(2)):
        with pool:
            assert same(kr.section(tops, executor=pool, **words), whole)
    few = kr.section(tops, n=5, max_wait=60)
    assert np.array_equal(few[7].states, whole[7].states[:5])


def test_sections_can_go_backward_in_time():
    back = kr.section(TOPS, n=6, max_wait=-100)
    assert (back.t < 0).all() and (np.diff(back[0].t) < 0).all() and (back.max_wait == -100).all()
    ahead = kr.section(
        kr.Ensemble.of([s.replace(momentum=-np.array(s.momentum)) for s in TOPS]), n=6
    )
    assert np.abs(ahead.t + back.t).max() < 1e-8


def test_a_top_without_events_is_reported():
    tops = kr.Ensemble.of([kr.scenes.steady_precession, kr.scenes.thesis, kr.scenes.thesis])
    section = kr.section(tops, n=10, max_wait=[50, 50, 3])
    assert section.status_names.tolist() == ["ERR_EVENT", "OK", "ERR_EVENT"]
    assert section.count.tolist() == [0, 10, 0] and section.failed.tolist() == [0, 2]
    assert section.reached[0] == pytest.approx(50) and len(section.t) == 10 == len(section.energy)
    assert "0 of 10 events found by t = 50, after waiting for 50" in section.message(0)
    with pytest.raises(kr.Error, match=r"top\[0\], the first of 2 of 3") as failure:
        section.check()
    assert failure.value.paths is section and len(failure.value.path) == 0
    rest = kr.section(kr.Scene(LAGRANGE.body, (0, 0, 0), gravity=1), n=3)
    assert rest.status_names.tolist() == ["ERR_EVENT"]


@pytest.mark.parametrize("scene", SCENES)
def test_every_kind_of_top_has_sections(scene):
    section = kr.section(scene, kr.events.crossing("body_momentum_y"), n=3, max_wait=200)
    assert len(section.t) > 0 and np.abs(section.body_momentum[:, 1]).max() < 1e-12
    assert len(kr.section(scene, LOW, n=2, digits=20, max_wait=100).t) == 2


@pytest.mark.parametrize("name", ["spin", "body_velocity_x", "body_momentum_z", "apex_z"])
def test_a_single_component_can_be_the_event(name):
    """Check events at extrema of the spin and of single vector components."""
    turning = kr.events.extremum(name)
    found = kr.solve(TOPS[0], 40, events=[turning]).events
    assert len(found) > 3 and np.abs(kr.section(TOPS[0], turning, 3).t - found.t[:3]).max() < 1e-9


def test_progress_and_interruption():
    reports = []
    kr.section(random_ensemble(40), n=5, progress=reports.append)
    assert reports[-1] == 1.0

    def stop(_):
        raise KeyboardInterrupt

    with pytest.raises(kr.Interrupted) as interruption:
        kr.section(random_ensemble(4000), n=2000, progress=stop)
    section = interruption.value.paths
    assert isinstance(section, kr.Section) and (section.status_names == "ERR_INTERRUPTED").any()
    assert np.isfinite(section.states).all() and len(section.states) == section.count.sum()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"tops": [LAGRANGE]}, "tops must be a kreisel.Ensemble"),
        ({"event": "nutation"}, "events must be an event of kreisel.events"),
        ({"event": kr.events.nutation(max_count=3)}, "leave max_count and terminal out"),
        ({"event": kr.events.nutation(terminal=True)}, "leave max_count and terminal out"),
        ({"n": 0}, "n must be at least 1"),
        ({"n": 2.5}, "n must be a whole number"),
        ({"n": 2**50}, "GB"),
        ({"max_wait": 0}, "max_wait must not be zero"),
        ({"max_wait": np.inf}, "max_wait must be finite"),
        ({"max_wait": [1, 2]}, r"max_wait must be a number or an array of shape \(3,\)"),
        ({"tol": -1}, "tol"),
        ({"tol": 1e-9, "digits": 20}, "digits"),
        ({"threads": 0}, "threads must be at least 1"),
        ({"progress": 3}, "progress"),
        ({"executor": 3}, "executor must be one of concurrent.futures"),
    ],
)
def test_invalid_arguments_are_refused(words, message):
    with pytest.raises((TypeError, ValueError, MemoryError), match=message):
        kr.section(**({"tops": TOPS} | words))


# Boundary values


def test_max_wait_limits_a_section():
    first = kr.section(TOP, n=1).t[0]
    assert kr.section(TOP, n=1, max_wait=1.001 * first).count.tolist() == [1]
    late = kr.section(TOP, n=1, max_wait=0.999 * first)
    assert late.count.tolist() == [0] and late.failed.tolist() == [0]
    for wrong, message in ((0.0, "max_wait must not be zero"), ([1.0, 2.0], r"of shape \(1,\)")):
        with pytest.raises(ValueError, match=message):
            kr.section(TOP, n=1, max_wait=wrong)
    for event in (kr.events.nutation(max_count=2), kr.events.nutation(terminal=True)):
        with pytest.raises(ValueError, match="leave max_count and terminal out"):
            kr.section(TOP, event, 1)
    with pytest.raises(ValueError, match="n must be"):
        kr.section(TOP, n=0)


def test_a_body_at_rest_has_no_section():
    rest = kr.Scene(FREE.body, attitude=(1, 0, 0, 0), momentum=(0, 0, 0), gravity=0.0)
    path = kr.section(kr.Ensemble.of([rest, TOP]), n=2)
    assert path.count.tolist() == [0, 2]
