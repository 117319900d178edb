"""Tests of the results of kreisel.solve for ensembles."""

import itertools
import pickle
import time

import kreisel as kr
import numpy as np
import pytest
from ensembles import MIXED, SCENES, TIMES, UNDAMPED, random_ensemble, same, same_bits, same_path

THESIS = kr.scenes.thesis
MANY = THESIS.vary(spin=[1.0, 2.0, 3.0], tilt=[[0.2], [0.4]])

GRID = kr.scenes.cusps.vary(spin=np.linspace(5, 20, 4)[:, None], tilt=np.linspace(0.1, 1, 3))
PATHS = kr.solve(GRID, TIMES)
QUANTITIES = ["apex", "frame", "nutation", "energy", "body_velocity", "kowalewski", "spin_angle"]


def test_quantities_equal_those_of_single_paths_bitwise():
    many = kr.solve(MIXED, TIMES)
    for name in QUANTITIES:
        values = getattr(many, name)
        assert not values.flags.writeable and values is getattr(many, name)
        for i in range(len(SCENES)):
            assert same_bits(values[i], getattr(many[i], name))
    assert same_bits(many.q_xyzw, np.roll(many.q, -1, axis=-1))
    assert not many.q_low.any() and many.m_low.shape == many.m.shape


def test_only_wanted_quantities_are_stored():
    for want in (("nutation", "energy"), ("q_low", "apex"), ("m",)):
        paths = kr.solve(MIXED, TIMES, want=want)
        for name in want:
            expected = getattr(kr.solve(MIXED, TIMES), name)
            assert np.allclose(getattr(paths, name), expected, rtol=0, atol=1e-12)
        for i, scene in enumerate(SCENES):
            assert paths[i].want == want and len(paths[i]) == len(TIMES)
            if kr.methods["exact"].suits(scene):
                assert same_path(paths[i], kr.solve(scene, TIMES, want=want))
        with pytest.raises(AttributeError, match="add 'torque' to want"):
            _ = paths.torque
        with pytest.raises(AttributeError, match="solve without want"):
            _ = paths.states
    failed_paths = kr.solve(
        UNDAMPED, [1.0, 50.0], "rk4", step=0.1, max_steps=20, want=("nutation",)
    )
    assert np.isnan(failed_paths.nutation[:, 1]).all() and len(failed_paths[0]) == 2


def test_indexing_follows_numpy():
    numbers = np.arange(12).reshape(4, 3)
    for key in (
        0,
        -1,
        slice(1, 3),
        (slice(None), 1),
        ...,
        None,
        [2, 0],
        numbers % 2 == 0,
        (1, ...),
    ):
        selection = PATHS[key]
        assert np.array_equal(selection.states, PATHS.states.reshape(12, -1, 8)[numbers[key]])
        assert selection.shape == numbers[key].shape and same(selection, kr.solve(GRID[key], TIMES))
    assert [len(row) for row in PATHS] == [3] * 4 and PATHS[2, 1].scene == GRID[2, 1]
    for key in (4, (0, 3), (0, 0, 0)):
        with pytest.raises(IndexError):
            PATHS[key]
    with pytest.raises(IndexError, match="is not the index of one top"):
        PATHS.message(0)
    with pytest.raises(TypeError, match=r"paths\[0\]"):
        kr.apex(PATHS)
    with pytest.raises(TypeError, match="not an array"):
        np.asarray(PATHS)
    with pytest.raises(AttributeError, match="did you mean 'nutation'"):
        _ = PATHS.nutatio


def test_results_survive_pickling():
    for paths in (PATHS, kr.solve(GRID, TIMES, want=["q"]), kr.solve(GRID, TIMES, digits=20)):
        again = pickle.loads(pickle.dumps(paths))
        assert np.array_equal(again.q, paths.q) and same_path(again[1, 2], paths[1, 2])
    reductions = kr.reduce(GRID, TIMES, {"apex": "max"})
    assert np.array_equal(
        pickle.loads(pickle.dumps(reductions))["apex"]["max"], reductions["apex"]["max"]
    )
    failed_paths = kr.solve(UNDAMPED, 9, "rk4", step=0.1, max_steps=5)
    with pytest.raises(kr.Error) as error:
        failed_paths.check()
    again = pickle.loads(pickle.dumps(error.value))
    assert str(again) == str(error.value) and same(again.paths, failed_paths)


def test_reductions_equal_those_of_the_states():
    kinds = "min", "max", "mean", "variance", "last", "where_min", "where_max"
    reductions = kr.reduce(GRID, TIMES, {"nutation": kinds, "apex": ("max",), "m_x": "last"})
    nutation, t = PATHS.nutation, np.array(TIMES)
    for kind in ("min", "max"):
        assert np.array_equal(reductions["nutation"][kind], getattr(nutation, kind)(axis=-1))
        times = t[getattr(nutation, f"arg{kind}")(axis=-1)]
        assert np.array_equal(reductions["nutation"][f"where_{kind}"], times)
    assert np.array_equal(reductions["nutation"]["last"], nutation[..., -1])
    assert np.allclose(reductions["nutation"]["mean"], nutation.mean(axis=-1), rtol=1e-14)
    assert np.allclose(reductions["nutation"]["variance"], nutation.var(axis=-1), rtol=1e-12)
    assert np.array_equal(reductions["apex"]["max"], PATHS.apex.max(axis=-2))
    assert np.array_equal(reductions["m_x"]["last"], PATHS.m[..., -1, 0])
    assert (
        list(reductions) == ["nutation", "apex", "m_x"] == list(reductions.keys())
        and len(reductions) == 3
    )
    assert (
        "apex" in reductions
        and "spin" not in reductions
        and not reductions["apex"]["max"].flags.writeable
    )
    assert np.array_equal(reductions[1]["apex"]["max"], reductions["apex"]["max"][1])
    with pytest.raises(TypeError, match="contain no paths"):
        reductions[0, 0]
    with pytest.raises(KeyError, match="did you mean 'nutation'"):
        reductions["nutatio"]


def test_reductions_of_failed_tops_are_nan():
    reductions = kr.reduce(UNDAMPED, [1.0, 9.0], {"spin": "max"}, "rk4", step=0.1, max_steps=20)
    assert np.isnan(reductions["spin"]["max"]).all() and (reductions.state_counts == 1).all()
    with pytest.raises(kr.Error, match=r"top\[0\], the first of 5 of 5") as error:
        reductions.check()
    assert error.value.paths is reductions and error.value.path.t.tolist() == [
        reductions.reached[0]
    ]


def test_states_are_written_into_a_given_array():
    out = np.full((4, 3, len(TIMES), 8), 7.0)
    paths = kr.solve(GRID, TIMES, out=out)
    assert np.shares_memory(paths.states, out) and np.array_equal(out, PATHS.states)
    assert not paths.states.flags.writeable and out.flags.writeable


def test_tables_have_the_names_of_the_axes_and_units():
    pytest.importorskip("xarray")
    data = PATHS.to_xarray("apex", "nutation", degrees=True)
    assert data["apex"].dims == ("spin", "tilt", "time", "axis")
    assert data["nutation"].attrs["units"] == "deg" and data["time"].attrs["units"] == "T"
    assert np.array_equal(data["apex"], PATHS.apex) and data.attrs["method"] == "auto"
    assert np.array_equal(data["spin"], np.linspace(5, 20, 4)) and data["status"].shape == (4, 3)
    own = kr.solve(GRID, np.broadcast_to(TIMES, (4, 3, 4))).to_xarray()
    assert own["t"].dims == ("spin", "tilt", "time") and own["q"].dims[-1] == "quaternion"
    reductions = kr.reduce(GRID, TIMES, {"nutation": "variance", "apex": "where_max", "m_x": "min"})
    table = reductions.to_xarray()
    assert table["nutation_variance"].attrs["units"] == "(rad)^2"
    assert table["apex_where_max"].dims == ("spin", "tilt", "axis")
    assert table["apex_where_max"].attrs["units"] == "T"
    frame = reductions.to_pandas()
    assert len(frame) == 12 and frame.attrs["units"]["m_x_min"] == "M L^2 T^-1"
    assert (
        frame["apex_z_where_max"].tolist()
        == reductions["apex"]["where_max"][..., 2].ravel().tolist()
    )
    assert frame["tilt"].tolist() == np.tile(np.linspace(0.1, 1, 3), 4).tolist()


@pytest.mark.parametrize(
    "parameters",
    [
        {"spin": [1.0, 5.0, 9.0]},
        {"spin": [1.0, 5.0, 9.0], "gravity": [1.0, 2.0, 3.0]},
        {"spin": [[1.0], [5.0]], "tilt": [0.1, 0.2]},
        {"body_velocity": [[1.0, 2.0, 3.0], [3.0, 2.0, 1.0]]},
    ],
)
def test_a_parameter_named_like_a_quantity_gets_a_suffix(parameters):
    pytest.importorskip("xarray")
    tops, name = kr.scenes.asymmetric.vary(**parameters), next(iter(parameters))
    paths = kr.solve(tops, [0.0, 1.0], want=(name, "energy"))
    data, renamed_dims = paths.to_xarray(), {"spin": "spin_given"}
    assert np.array_equal(data[name].values, getattr(paths, name))
    assert np.array_equal(np.ravel(data[f"{name}_given"].values), np.ravel(parameters[name]))
    dims = [renamed_dims.get(axis, axis) for axis in tops.axes]
    assert data["energy"].dims == (*dims, "time") and name not in data.coords
    assert name in paths.to_xarray("energy").coords


@pytest.mark.parametrize("degrees", [False, True])
def test_varied_parameters_have_units(degrees):
    top, angle = kr.scenes.sleeping, "deg" if degrees else "rad"
    tops = top.vary(
        tilt=[[1.0], [2.0]], gravity=9.0, shaking=[[0.1, 1, 0], [0.1, 2, 0]], degrees=degrees
    )
    units = {"tilt": angle, "shaking": f"L, {angle}/T, {angle}"}
    copies = tops, tops[1:], tops[[0, 1]], tops.reshape(4), pickle.loads(pickle.dumps(tops))
    for ensemble in copies:
        reductions = kr.reduce(ensemble, 1.0, {"spin": "max"})
        dataset, table = reductions.to_xarray(), reductions.to_pandas()
        assert {name: dataset[name].attrs["units"] for name in units} == units
        assert {name: table.attrs["units"][name] for name in units} == units
    indicator = kr.megno(top.vary(gravity=[1.0, 2.0]), 30.0)
    assert indicator.to_pandas().attrs["units"]["gravity"] == "L T^-2"


@pytest.mark.parametrize("digits", [20, 30])
def test_low_words_equal_those_of_single_tops(digits):
    many = kr.solve(MIXED, TIMES, digits=digits)
    quantities = kr.solve(MIXED, TIMES, digits=digits, want=["q_low", "nutation"])
    assert np.array_equal(quantities.q_low, many.q_low) and many.method == "auto"
    for i, scene in enumerate(SCENES):
        alone = kr.solve(scene, TIMES, digits=digits)
        assert same_path(many[i], alone) and np.array_equal(many[i].q_low, alone.q_low)
        assert np.array_equal(many.m_low[i], alone.m_low) and many[i].stats == alone.stats
    assert not np.array_equal(many[1:3][0].q_low, 0 * many[1].q)


def test_events_equal_those_of_single_tops():
    low, high = kr.events.nutation(direction=1), kr.events.nutation(direction=-1, max_count=1)
    ends = kr.events.nutation(direction=-1, max_count=1, terminal=True)
    for events in (low, [low, high], [low, ends]):
        many = kr.solve(MIXED, [1.0, 5.0, 10.0], events=events)
        found = many.events
        assert found.count.sum() == len(found) and (np.diff(found.top) >= 0).all()
        for i, scene in enumerate(SCENES):
            alone = kr.solve(scene, [1.0, 5.0, 10.0], events=events)
            assert same_path(many[i], alone, events=True), i
            assert np.array_equal(found.t[found.top == i], alone.events.t)
        assert many[2:4].events.count.tolist() == found.count[2:4].tolist()
        assert many[[3, 1]].events.t.tolist() == [*many[3].events.t, *many[1].events.t]
    assert (many.state_counts < 3).any() and not many.failed.size
    none = kr.solve(MIXED, 1.0).events
    assert len(none) == 0 and none.q.shape == (0, 4) and none.m.shape == (0, 3)
    square = kr.solve(MIXED.reshape(2, 3), 9.0, events=low, want=["spin"]).events
    assert square.top.shape == (len(square), 2) and square.q.shape == (len(square), 4)


def test_geometric_chooses_a_method_for_each_top():
    tops = MIXED[:5]
    many = kr.solve(tops, [0.5, 2.0], "geometric", error=1e-6)
    assert many.method == "geometric" and not many.failed.size
    for i, scene in enumerate(tops):
        alone = kr.solve(scene, [0.5, 2.0], "geometric", error=1e-6)
        assert same_path(many[i], alone) and many[i].plan.choice == alone.plan.choice
    failed_paths = kr.solve(tops, [0.5, 2.0], "geometric", error=2e-15, want=["nutation"])
    assert len(failed_paths.failed) > 0 and "cannot be met" in failed_paths.message(
        int(failed_paths.failed[0])
    )
    still = kr.solve(tops, [0.0, 0.0], "geometric", error=1e-6)
    assert np.array_equal(still.q[:, 1], tops.attitude) and not still.failed.size


def test_streams_equal_the_whole_result():
    pieces = list(kr.stream(GRID, TIMES, chunk=20))
    assert [len(piece) for piece in pieces] == [5, 5, 2]
    assert np.array_equal(
        np.concatenate([p.states for p in pieces]), PATHS.states.reshape(12, -1, 8)
    )
    own = np.arange(1.0, 13.0).reshape(4, 3, 1)
    ends = [t for piece in kr.stream(GRID, own, chunk=1) for t in piece.states[:, 0, 0]]
    assert ends == list(range(1, 13))
    reports = []
    list(kr.stream(random_ensemble(9), 1.0, chunk=4, progress=reports.append))
    assert reports[-1] == 1.0 and len(reports) == 5


def test_plans_count_tops_by_solver_and_bytes():
    plan = kr.plan(MIXED, TIMES, threads=2)
    assert (plan.closed_form, plan.lanes, plan.alone) == (3, 2, 1) and plan.threads == 2
    assert plan.states == 4 and plan.seconds > 0.0
    assert "3 by closed form, 2 in lanes, 1 one by one" in str(plan)
    assert kr.plan(MIXED).seconds is None and kr.plan(MIXED).bytes == 64
    assert kr.plan(UNDAMPED, TIMES, method="strang", step=0.1).alone == 5
    assert kr.plan(MIXED, TIMES, digits=20).alone == 6 and kr.plan(GRID).closed_form == 12
    small = kr.plan(MIXED, range(1000), reduce={"spin": "max"})
    assert small.bytes < kr.plan(MIXED, range(1000), want=["spin"]).bytes / 50
    assert kr.plan(MIXED[:0], TIMES).seconds == 0.0
    assert kr.plan(MIXED, [1.0]).seconds > 0.0 == kr.plan(MIXED, []).seconds


@pytest.mark.parametrize(
    "words", [{}, {"want": ("spin", "m")}, {"digits": 20}, {"reduce": {"apex": ("min", "max")}}]
)
def test_plans_have_the_size_of_the_results(words):
    reductions = words.get("reduce")
    result = kr.reduce(MIXED, TIMES, reductions) if reductions else kr.solve(MIXED, TIMES, **words)
    buffers = result._buffers
    arrays = {**buffers._get_allocated_arrays_by_name(), **buffers.columns}
    assert kr.plan(MIXED, TIMES, **words).bytes == sum(one.nbytes for one in arrays.values())


def test_the_time_estimate_scales_with_duration_and_states(monkeypatch):
    """Estimate run times with a timer that advances by one second at each call."""
    monkeypatch.setattr(time, "perf_counter", itertools.count().__next__)
    words = {"method": "strang", "step": 0.001, "threads": 1}
    ends = {end: kr.plan(UNDAMPED, [end], **words).seconds for end in (0.0, 1.0, 5.0, 1e3)}
    steps = {0.0: 1.0, 1.0: 1.0, 5.0: 5e3 / 2048, 1e3: 1e6 / 2048}
    assert ends == pytest.approx(steps, rel=1e-9)
    assert kr.plan(UNDAMPED, [0.8], method="strang", step=1e-4, threads=4).seconds == pytest.approx(
        8000 / 2048 / 4, rel=1e-9
    )
    few, many = (kr.plan(UNDAMPED, np.linspace(1, 2, n), **words).seconds for n in (100, 10**5))
    assert few == 1.0 and many == pytest.approx(10**5 / 2048, rel=1e-12)


# Boundary values


def test_members_with_a_single_time_equal_single_tops():
    for t, step in ((1.0, 0.125), (-1.0, -0.125)):
        path = kr.solve(MANY, [t], "strang", step=0.125)
        assert path[0, 1].t.tolist() == [t] and path[0, 1].step == step
        alone = kr.solve(MANY[0, 1], [t], "strang", step=0.125)
        assert np.array_equal(path[0, 1].states, alone.states)
    assert kr.solve(MANY, [-1.0, 0.0][:1], "strang", step=0.125)[1, 2].step == -0.125


def test_reductions_are_a_mapping_that_shows_its_names():
    reductions = kr.reduce(MANY, 1.0, {"nutation": ("min", "max"), "apex": "mean"})
    assert list(reductions.keys()) == ["nutation", "apex"]
    shapes = {
        name: {kind: x.shape for kind, x in kinds.items()} for name, kinds in reductions.items()
    }
    assert shapes == {"nutation": {"min": (2, 3), "max": (2, 3)}, "apex": {"mean": (2, 3, 3)}}
    np.testing.assert_allclose(reductions["nutation"]["min"], [[0.2] * 3, [0.4] * 3], rtol=1e-14)
    assert "shape (2, 3), nutation: min max, apex: mean" in repr(reductions)


def test_an_empty_ensemble_has_no_events():
    events = kr.solve(MANY[:0], 9.0, events=kr.events.nutation()).events
    assert events.t.shape == (0,) and events.states.shape == (0, 8) and events.count.shape == (0, 3)
