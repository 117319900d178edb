"""Counts and sizes that are met exactly, and what is said and shown where there is little."""

import itertools
import math
import os
import re

import kreisel as kr
import numpy as np
import pytest
from kreisel._analysis import costs
from kreisel._ground import files
from kreisel._recording.crew import Crew
from kreisel._recording.path import ROUNDING
from kreisel._verbs import geometric, plans
from shell import call, said

TOP, THESIS, FREE = kr.scenes.asymmetric, kr.scenes.thesis, kr.scenes.dzhanibekov
TRUE = "strang", 0.25 / 16.0
MANY = THESIS.vary(spin=[1.0, 2.0, 3.0], tilt=[[0.2], [0.4]])


# How many members threads take at once


@pytest.mark.parametrize(("n", "threads", "first"), [(10_000, 2, 1256), (100, 2, 56), (5, 4, 5)])
def test_threads_take_ever_fewer_members_and_whole_vectors(n, threads, first):
    slices = list(Crew(threads).slices(n))
    sizes = [end - begin for begin, end in slices]
    assert sizes[0] == first and sum(sizes) == n
    assert [begin for begin, _ in slices[1:]] == [end for _, end in slices[:-1]]
    assert sizes == sorted(sizes, reverse=True) and all(size % 8 == 0 for size in sizes[:-1])


def test_threads_take_so_many_members_at_most():
    assert next(Crew(1).slices(10**6)) == (0, 1 << 15)


# What is told


def test_a_comparison_as_text_has_a_column_each():
    table = kr.compare(THESIS, [1.0], ["rk4", "taylor"], steps=[0.125], tols=[1e-9], repeats=1)
    head, *lines = str(table).splitlines()
    for line, step, tol in zip(lines, ("0.125", ""), ("", "1e-09"), strict=True):
        cells = {name: line[head.index(name) :].split("  ")[0] for name in ("step", "tol")}
        assert cells == {"step": step, "tol": tol}
        assert line.startswith("thesis")


def test_a_truth_of_fixed_step_takes_a_sixteenth_of_the_smallest():
    (row, _) = kr.compare(TOP, [1.0], ["rk4"], steps=[0.25, 0.5], truth="strang", repeats=1)
    ends = [kr.solve(TOP, [1.0], *how, step=step).q for *how, step in (("rk4", 0.25), TRUE)]
    assert row.attitude_error == kr.attitude_error(*ends).max()


def test_costs_are_told_by_three_figures():
    told = [costs._short(x) for x in (0.994, 1.0, 9.94, 10.0, 10.4, 123.4)]
    assert told == ["0.99", "1.0", "9.9", "10", "10", "123"]


def test_the_table_of_costs_has_a_row_for_each_method():
    given = {name: [2e-9, 3e-9, 0.0] for name in kr.methods} | {"rk4": [1e-9, 1e-9, 1e-9]}
    rows = costs._rows(kr.methods, given).splitlines()
    assert len(rows) == 2 + len(kr.methods)
    assert {row.count("|") for row in rows} == {9}
    (strang,) = (row for row in rows if row.startswith("| strang "))
    assert [cell.strip() for cell in strang.split("|")[2:6]] == ["2", "2.0", "3.0", ""]
    (taylor,) = (row for row in rows if row.startswith("| taylor "))
    assert taylor.split("|")[2].strip() == "varies"


def test_events_in_the_shell_are_counted_beyond_the_twentieth():
    def shown(n):
        return call(f"solve thesis --t 1000 --events nutation:most={n}")

    path = kr.solve(THESIS, [1000.0], events=kr.events.nutation(most=21))
    assert len(path.events.t) == 21
    for n, more in ((19, ""), (20, ""), (21, "and 1 more events: --events-csv writes all")):
        text = said(shown(n))
        assert (more in text) and ("more events" in text) == bool(more)


def test_too_many_states_are_counted_in_the_shell(tmp_path):
    file = tmp_path / "path.npz"
    text = said(call("solve thesis --t 0:1e12:0.001 --npz", file, code=2))
    assert "1000000000000001 states" in text and "GB" in text


# Tops and bodies


def test_lists_are_nested_up_to_an_edge():
    def nested(depth):
        made = THESIS
        for _ in range(depth):
            made = [made]
        return made

    assert kr.Ensemble.of(nested(32)).shape == (1,) * 32
    for depth in (33, 34):
        with pytest.raises(ValueError, match="must not be nested without end"):
            kr.Ensemble.of(nested(depth))


def test_equal_bodies_of_other_bits_are_not_made_one():
    one, other = (kr.Body(1.0, (4.0, 4.5, 3.0), (0.0, 0.0, z)) for z in (1.0, 1.5))
    mixed = kr.Ensemble.of([THESIS.replace(body=b) for b in (one, one, other)])
    np.testing.assert_array_equal(mixed.body.com[:, 2], [1.0, 1.0, 1.5])
    same = kr.Ensemble.of([THESIS.replace(body=one)] * 3)
    assert same.body is one


def test_a_row_of_bodies_is_spread_over_a_grid():
    bodies = kr.Ensemble.of([[TOP, FREE, THESIS]]).body
    grid = bodies._over((2, 3))
    assert bodies._over((1, 3)) is bodies
    assert grid.shape == (2, 3) and np.array_equal(grid.com[0], grid.com[1])
    assert np.array_equal(grid.com[:1], bodies.com)


def test_tops_may_lean_by_up_to_half_a_turn():
    body = THESIS.body
    told = kr.Scene.spinning(body, tilt=math.pi, spin=10.0, steady=True)
    many = kr.Ensemble.spinning(body, tilt=[0.5, math.pi], spin=10.0, steady=True)
    assert told.attitude[0] == pytest.approx(0.0, abs=1e-15) and len(many) == 2
    for wrong in (math.nextafter(math.pi, 4.0), -5e-324):
        with pytest.raises(ValueError, match=r"tilt"):
            kr.Ensemble.spinning(body, tilt=[0.5, wrong], spin=10.0, steady=True)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_what_counts_as_symmetric_does_not_depend_on_the_units(scale):
    moments = np.array([1.0, 1.0 + 1e-11, 0.5]) * scale
    far = 0.5 * scale**0.5
    unlike = kr.Body(1.0, tuple(moments), (0, 0, far))
    with pytest.raises(ValueError, match="symmetric"):
        kr.Scene.spinning(unlike, tilt=0.5, spin=10.0, steady=True)
    alike = kr.Body(1.0, (scale, scale, 0.5 * scale), (0, 0, far))
    both = kr.Ensemble.of([THESIS.replace(body=unlike), THESIS.replace(body=alike)]).body
    with pytest.raises(ValueError, match=r"^body\[0\]: "):
        kr.Ensemble.spinning(both, tilt=0.5, spin=10.0, steady=True)
    leans = kr.Body(1.0, tuple(moments), (1e-3 * far, 0, far))
    path = kr.solve(TOP.replace(body=leans), [0.0])
    with pytest.raises(ValueError, match="no rod belongs to this top"):
        kr.rod(path)


def test_bodies_alike_about_their_axes_precess_steadily_one_by_one():
    bodies = [kr.Body(1.0, (4.0, 4.0, c), (0, 0, z)) for c, z in ((3.0, 1.0), (2.0, -0.5))]
    many = kr.Ensemble.of([THESIS.replace(body=body) for body in bodies]).body
    made = kr.Ensemble.spinning(many, tilt=0.5, spin=10.0, steady=True)
    for i, body in enumerate(bodies):
        one = kr.Scene.spinning(body, tilt=0.5, spin=10.0, steady=True)
        np.testing.assert_allclose(made[i].momentum, one.momentum, rtol=1e-14, atol=1e-14)


def test_the_least_energy_is_that_of_the_lower_of_two_hollows():
    for side in (1.0, -1.0):
        body = kr.Body(1.0, (1.0, 2.0, 2.5), (0.0, 0.0, side * 1e-5))
        with pytest.raises(ValueError, match="the least energy there is") as refused:
            kr.starts(body, energy=-5.0, vertical=1.0, n=1)
        least = float(str(refused.value).split()[-1])
        assert least == pytest.approx(1.0 / 5.0 - 9.81e-5, abs=2e-7) or least == pytest.approx(
            1.0 / 5.0 - 1e-5, abs=1e-12
        )


# Paths


def test_a_top_of_many_with_one_time():
    for t, step in ((1.0, 0.125), (-1.0, -0.125)):
        path = kr.solve(MANY, [t], "strang", step=0.125)
        assert path[0, 1].t.tolist() == [t] and path[0, 1].step == step
        alone = kr.solve(MANY[0, 1], [t], "strang", step=0.125)
        assert np.array_equal(path[0, 1].states, alone.states)
    assert kr.solve(MANY, [-1.0, 0.0][:1], "strang", step=0.125)[1, 2].step == -0.125


def test_a_tolerance_is_told_to_be_below_rounding_where_it_is():
    with pytest.raises(kr.Error) as refused:
        kr.solve(TOP, [10.0], "extrap", tol=ROUNDING / 64, max_steps=1000)
    assert "which is below the rounding of doubles" in str(refused.value)


def test_frequencies_need_so_many_states():
    t = np.linspace(0.0, 30.0, 64)
    path = kr.solve(TOP, t)
    kr.frequencies(path, 64)
    with pytest.raises(ValueError, match="n must be at most the number of states, 64, not 65"):
        kr.frequencies(path, 65)
    with pytest.raises(ValueError, match="the path must have at least 64 states, not 63"):
        kr.frequencies(kr.solve(TOP, t[:63]), 64)


def test_a_path_of_two_lowest_points_has_a_nutation():
    closed = kr.exact(THESIS)
    period = closed.period
    begin = closed.t_greatest + 0.9 * period
    told = kr.solve(THESIS, np.linspace(begin, begin + 1.2 * period, 400))
    assert kr.apex(told).nutation().period == pytest.approx(period, rel=1e-5)
    short = kr.solve(THESIS, np.linspace(begin, begin + 1.05 * period, 400))
    with pytest.raises(ValueError, match="the axis has 1 lowest points"):
        kr.apex(short).nutation()


def test_kept_vectors_name_their_components():
    pytest.importorskip("xarray")
    kept = kr.solve(MANY, 1.0, reduce={"apex": "mean", "energy": "max"}).to_xarray()
    (name,) = (name for name in kept.data_vars if kept[name].ndim == 3)
    inner = kept[name].dims[-1]
    assert kept[inner].values.tolist() == ["x", "y", "z"]


def test_tables_of_tops_in_a_row_have_the_times_of_each():
    pytest.importorskip("xarray")
    tops = THESIS.vary(spin=[1.0, 2.0, 3.0])
    own = np.arange(6.0).reshape(3, 2)
    data = kr.solve(tops, own).to_xarray("energy")
    assert data["t"].dims == ("spin", "time") and np.array_equal(data["t"], own)
    assert kr.solve(tops, [1.0, 2.0]).to_xarray("energy")["time"].values.tolist() == [1.0, 2.0]


# Plots


def test_plots_take_so_many_paths_and_round_ticks():
    pytest.importorskip("matplotlib")
    from kreisel._analysis.plot import MOST
    from matplotlib.ticker import MaxNLocator

    path = kr.solve(THESIS, np.linspace(0.0, 5.0, 50))
    figure = kr.plot([path] * MOST).figure
    charts = [one for one in figure.axes if one.get_ylabel()]
    assert charts
    for chart in charts:
        for axis in (chart.xaxis, chart.yaxis):
            assert isinstance(axis.get_major_locator(), MaxNLocator)
            assert axis.get_major_locator().tick_values(0, 13).tolist() == [0, 5, 10, 15]
    with pytest.raises(ValueError, match=f"a list of 1 to {MOST} paths, not of {MOST + 1}"):
        kr.plot([path] * (MOST + 1))


# Files


def test_a_trial_file_that_another_took_away_is_no_failure(monkeypatch, tmp_path):
    close = os.close

    def closed(handle):
        name = os.readlink(f"/proc/self/fd/{handle}")
        close(handle)
        os.unlink(name)

    monkeypatch.setattr(files.os, "close", closed)
    files.refuse_no_place(tmp_path / "path.csv")
    assert list(tmp_path.iterdir()) == []


def test_a_scene_may_be_so_long(tmp_path):
    text = THESIS.to_toml()
    for over in (0, 1):
        file = tmp_path / "scene.toml"
        file.write_text(text + "#" + " " * ((1 << 20) - len(text) - 2 + over) + "\n")
        assert file.stat().st_size == (1 << 20) + over
        for read in (kr.Scene.from_toml, kr.load):
            if over:
                with pytest.raises(ValueError, match=r"more than 1048576 bytes|would be shorter"):
                    read(file)
            else:
                assert read(file) == THESIS


# Searches for a step


class Search:
    """A search whose runs err as it is told."""

    conditioning, first, budget = 1e-9, 10, 1000
    method, order, end, target = "strang", 2, 8.0, 1e-9

    def __init__(self, errors):
        self.errors, self.asked = iter(errors), []

    def run(self, steps):
        self.asked.append(steps)
        error = next(self.errors)
        return None if error is None else (np.zeros((1, 8)), error)

    def finer(self, steps, error):
        return steps + 1

    def refusal(self, why):
        return ValueError(why)


def searched(monkeypatch, errors, **more):
    search = Search(errors)
    search.__dict__.update(more)
    monkeypatch.setattr(geometric, "_Search", lambda *_: search)
    monkeypatch.setattr(geometric, "_path", lambda search, states, error, steps: (error, steps))
    return search, lambda: geometric.best(THESIS, np.array([8.0]), 1e-9, 0)


def test_a_search_goes_on_by_what_it_found(monkeypatch):
    enough = geometric._ENOUGH * 1e-9
    search, found = searched(monkeypatch, [1.0, None, 1e-3, 1e-6, enough])
    assert found() == (enough, 14) and search.asked == [10, 11, 12, 13, 14]
    search, found = searched(monkeypatch, itertools.repeat(1e-8))
    with pytest.raises(ValueError, match=re.escape("a run come to 1.0e-08 rad, and finer")):
        found()
    assert search.asked == [10, *(11 * 2**k for k in range(len(search.asked) - 1))]
    assert len(search.asked) == geometric._STALLS + 1
    search, found = searched(monkeypatch, [1e-6, 1e-8, 0.5e-8, 1e-9, enough])
    assert found() == (enough, 14)


def test_a_search_ends_with_its_budget(monkeypatch):
    enough = geometric._ENOUGH * 1e-9
    _, found = searched(monkeypatch, [1e-3, enough], budget=21)
    assert found() == (enough, 11)
    _, found = searched(monkeypatch, [1e-3, enough], budget=20)
    with pytest.raises(ValueError, match="a search may take 20 steps"):
        found()
    _, found = searched(monkeypatch, [enough], conditioning=math.nextafter(1e-9, 1.0))
    with pytest.raises(ValueError, match="the data do not hold so much"):
        found()


def test_a_plan_measures_tops_at_their_own_times(monkeypatch):
    seen = []
    fill = plans.fill

    def filled(rows, few, some, begin, end, times, work):
        seen.append(np.array(times))
        return fill(rows, few, some, begin, end, times, work)

    monkeypatch.setattr(plans, "fill", filled)
    own = np.arange(1.0, 101.0)[:, None] * np.array([0.001, 0.002])
    kr.plan(THESIS.vary(spin=np.linspace(1.0, 2.0, 100)), own)
    at = np.linspace(0, 99, 16).astype(int)
    np.testing.assert_array_equal(seen[0], own[at])


def test_up_to_sixteen_digits_nothing_is_left_out_of_what_is_wanted():
    assert kr.solve(TOP, [1.0], digits=16, want=["q"]).q_low.tolist() == [[0.0] * 4]
    with pytest.raises(AttributeError, match="q_low"):
        _ = kr.solve(TOP, [1.0], digits=17, want=["q"]).q_low
