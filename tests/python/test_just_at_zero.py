"""What is exactly nothing, or exactly as much as may be."""

import math
from types import SimpleNamespace

import kreisel as kr
import numpy as np
import pytest
from inside import cli
from kreisel._drawing import solids
from kreisel._model import varied
from kreisel._recording.path import ROUNDING, stopped
from kreisel._request import times
from kreisel._showing.cli import times as shell_times
from kreisel._sweeping import planned, seal
from kreisel._verbs import geometric

TOP, THESIS, FREE = kr.scenes.asymmetric, kr.scenes.thesis, kr.scenes.dzhanibekov


def test_grids_of_the_shell_without_length_have_their_start():
    assert cli.main is not None
    for word in ("0:0:0.1", "0:0:-0.1", "2:2:-1"):
        t = shell_times.times(word).array()
        assert t.tolist() == [float(word[0])]
    with pytest.raises(Exception, match="more times than can be counted"):
        shell_times.times(f"0:{2**53}:1")
    with pytest.raises(Exception, match=r"does not lead from 0 to 4\.94066e-324"):
        shell_times.times("0:5e-324:-1")


def test_rows_of_times_from_an_iterator_that_begin_with_the_start_lead_on():
    told, _ = times.direction(iter([np.array([0.0, 1.0]), np.array([2.0])]))
    assert told is False
    assert times.direction(iter([np.array([0.0, -1.0])]))[0] is True


def test_a_machine_that_does_not_tell_its_memory_has_enough(monkeypatch):
    def silent(name):
        raise ValueError(name)

    monkeypatch.setattr(times.os, "sysconf", silent)
    assert times.memory() == 2**63
    monkeypatch.setattr(times.os, "sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 3}.__getitem__)
    assert times.memory() == 12288


def test_a_top_may_be_as_fast_as_it_likes_where_no_time_is_asked_for():
    fast = THESIS.replace(momentum=(0, 0, 1e18))
    for more in ({}, {"tangents": "start"}):
        assert len(kr.solve(fast, [], **more)) == 0
        with pytest.raises(ValueError, match=r"by t = 1\.0 this top turns by"):
            kr.solve(fast, [1.0], **more)


def test_what_is_rounded_is_rounded_by_less_than_all():
    tensor = np.diag([2.0, 3.0, 4.0])
    assert kr.Body(1.0, tensor, (0, 0, 0), rounded=0.0).moments == (2.0, 3.0, 4.0)
    almost = kr.Body(1.0, tensor, (0, 0, 0), rounded=math.nextafter(1.0, 0.0))
    assert almost.rounded < 1.0
    for wrong in (1.0, -5e-324, math.nan):
        with pytest.raises(ValueError, match="rounded must be"):
            kr.Body(1.0, tensor, (0, 0, 0), rounded=wrong)


def test_solids_have_no_edge_of_nothing():
    for make in (kr.Bodies.ellipsoid, kr.Bodies.cuboid):
        for half in ([[1.0, 1.0, 0.0]], [[0.0, 1.0, 1.0], [1.0, 1.0, 1.0]]):
            with pytest.raises(ValueError, match="half"):
                make(half, (0.0, 0.0, 0.5), mass=1.0)
        assert make([[1.0, 1.0, 5e-9]], (0.0, 0.0, 0.5), mass=1.0).shape == (1,)


def test_a_turn_by_nothing_is_none():
    q = tuple(np.array([x, x]) for x in (0.8, 0.0, 0.6, 0.0))
    with np.errstate(all="ignore"):
        turned = varied._turned_first(q, tuple(np.array([0.0, r]) for r in (0.0, 0.25, 0.0)))
    assert [float(x[0]) for x in turned] == [0.8, 0.0, 0.6, 0.0]
    angle = 2.0 * math.atan2(0.6, 0.8) + 0.25
    assert float(turned[2][1]) == pytest.approx(math.sin(0.5 * angle))


def test_a_cusp_may_be_as_near_to_rest_as_roundings_let_it():
    assert kr.events.cusp(within=1e-7)
    with pytest.raises(ValueError, match="within must be at least 1e-7"):
        kr.events.cusp(within=math.nextafter(1e-7, 0.0))


def test_a_separatrix_without_gravity_is_that_of_the_free_body():
    free = TOP.replace(gravity=0.0)
    assert kr.events.separatrix(free) == kr.events.separatrix(
        TOP.replace(body=kr.Body(TOP.body.mass, TOP.body.inertia, (0, 0, 0)))
    )
    assert kr.events.separatrix(TOP).direction == -1
    assert kr.events.separatrix(TOP.replace(gravity=-1.0)).direction == 1


def test_a_body_at_rest_waits_for_a_section_in_vain():
    rest = kr.Scene(FREE.body, attitude=(1, 0, 0, 0), momentum=(0, 0, 0), gravity=0.0)
    path = kr.section(kr.Ensemble.of([rest, TOP]), n=2)
    assert path.count.tolist() == [0, 2]


def test_a_seal_may_be_all_that_a_file_has():
    whole = seal.sealed(bytearray(seal.OPEN.encode()))
    assert seal.is_whole(bytes(whole))
    assert not seal.is_whole(b"") and not seal.is_whole(bytes(whole[1:]))
    assert not seal.is_whole(bytes(whole[:-1] + b"?"))


def test_words_of_a_plan_stand_in_it_up_to_a_size():
    most = planned._INLINE
    ((name, shape, inside),) = planned._words(
        {"spin": SimpleNamespace(value=(), values=np.arange(float(most)))}
    )
    assert (name, shape, len(inside)) == ("spin", [], most)
    ((*_, beside),) = planned._words(
        {"spin": SimpleNamespace(value=(3,), values=np.arange(float(most + 1)))}
    )
    assert isinstance(beside, str)


def test_the_rounding_itself_is_not_below_rounding():
    for tol, said in ((ROUNDING, False), (0.5 * ROUNDING, True)):
        path = SimpleNamespace(tol=tol)
        error = stopped("ERR_STEP", path, "it got to t = 1")
        assert ("below the rounding" in str(error)) == said and f"tol = {tol!r}" in str(error)


def test_an_error_of_a_tenth_tells_nothing_of_finer_steps():
    search = SimpleNamespace(target=0.01, order=4)
    finer = geometric._Search.finer
    assert finer(search, 100, 0.1) == finer(search, 100, 0.2) == 400
    assert finer(search, 100, 0.0999) == 224
    assert finer(search, 100, 0.0) == 111


def test_signs_of_nothing_are_kept():
    plus, minus = (kr.Body(1.0, (2.0, 2.0, 1.0), (z, 0.0, 0.5)) for z in (0.0, -0.0))
    both = kr.Ensemble.of([THESIS.replace(body=body) for body in (plus, minus)])
    assert both.shape == (2,) and np.all(both.body.com == [0.0, 0.0, 0.5])


def test_a_body_of_any_size_is_drawn_as_what_it_is():
    moments = np.array([2.0, 2.0, 1.0])
    for size in (1e-10, 1.0, 1e10):
        leans, stands = (
            solids.solid_of(1.0, moments * size**2, size * np.array([x, 0.0, 0.3]))[0]
            for x in (0.1, 0.0)
        )
        assert len(leans) == 6 and len(stands) > 100
