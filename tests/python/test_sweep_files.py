"""Tests of the files that a sweep writes."""

import copy
import math
import pickle
import sys

import duckdb
import kreisel as kr
import kreisel._sweep
import numpy as np
import polars
import pyarrow as pa
import pyarrow.csv as text
import pyarrow.parquet as parquet
import pytest
from argument_values import ENSEMBLES
from ensembles import MIXED, random_ensemble
from kreisel._model.broadcasting import BatchParameter
from kreisel._sweep import checksum, sweep_plan
from kreisel._sweep.sweep_plan import dump_canonical_json
from sweeps import LOW, PARTS, REDUCED, SOURCE, TOP, WATCHED, hash_rows, run_sweep

SHAPE = SOURCE.shape
TIMES = [0.5, 4.0]


def ensemble():
    return SOURCE[:].reshape(*SHAPE)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    place = tmp_path_factory.mktemp("runs")
    run_sweep(place / "reduced")
    run_sweep(place / "watched", WATCHED)
    return place


def test_duckdb_queries_the_parts(runs):
    sweep = kr.read_sweep(runs / "reduced")
    is_complete = sweep["status"] == 0
    sql = """
        SELECT spin, max(nutation_max), count(*) FROM '{}/*.parquet'
        WHERE status = 0 GROUP BY spin ORDER BY spin
    """
    rows = duckdb.sql(sql.format(runs / "reduced")).fetchall()
    for (spin, largest, count), expected_spin, nutations, is_row_complete in zip(
        rows, np.linspace(0, 9, 12), sweep["nutation_max"], is_complete, strict=True
    ):
        assert (spin, largest, count) == (
            expected_spin,
            nutations[is_row_complete].max(),
            is_row_complete.sum(),
        )
    sql = """
        SELECT top, event_t[1], len(event_t) = events AND events = len(event_q_w)
        FROM '{}/*.parquet' WHERE events > 0 ORDER BY top
    """
    rows = duckdb.sql(sql.format(runs / "watched")).fetchall()
    found_events = kr.solve(ensemble(), TIMES, "taylor", events=[LOW], max_steps=14).events
    first = np.unique(np.ravel_multi_index(found_events.top.T, SHAPE), return_index=True)
    assert [(top, t) for top, t, _ in rows] == list(
        zip(first[0], found_events.t[first[1]], strict=True)
    )
    assert all(is_equal for *_, is_equal in rows) and len(rows) > 20


def test_polars_queries_the_parts(runs):
    lazy = polars.scan_parquet(runs / "watched" / "*.parquet")
    long = lazy.select("top", "t", "m_z").explode("t", "m_z").collect()
    paths = kr.solve(ensemble(), TIMES, "taylor", max_steps=14, events=[LOW])
    assert long["t"].to_list() == TIMES * SOURCE.size
    assert np.array_equal(long["m_z"].to_numpy(), paths.m[..., 2].ravel(), equal_nan=True)
    least = polars.read_parquet(runs / "reduced" / "*.parquet").filter(polars.col("status") == 0)
    assert least["nutation_min"].min() == np.nanmin(kr.read_sweep(runs / "reduced")["nutation_min"])


def test_a_part_describes_itself(runs):
    sweep = kr.read_sweep(runs / "reduced")
    file = parquet.ParquetFile(runs / "reduced" / "part-000002.parquet")
    metadata = file.metadata.metadata[b"kreisel"].decode()
    assert sweep.hash in metadata and '"part": 2' in metadata and f'"{kr.__version__}"' in metadata
    units = {field.name: field.metadata[b"units"].decode() for field in file.schema_arrow}
    assert units == sweep.units
    assert units["spin"] == "rad/T" and units["reached"] == "T" and units["apex_x_mean"] == ""


def test_reductions_equal_those_of_the_ensemble(tmp_path):
    sweep = run_sweep(tmp_path)
    words = {
        name: word for name, word in REDUCED.items() if name not in ("t", "part_size", "reduce")
    }
    whole = kr.reduce(ensemble(), REDUCED["t"], REDUCED["reduce"], **words)
    columns = {
        "nutation_min": whole["nutation"]["min"],
        "apex_y_mean": whole["apex"]["mean"][..., 1],
    }
    columns |= {name: getattr(whole, name) for name in ("status", "reached", "steps")}
    for name, values in columns.items():
        assert np.array_equal(sweep[name], values, equal_nan=True), name
    assert np.array_equal(sweep["top"].ravel(), np.arange(SOURCE.size))
    for table in (sweep.to_arrow(), sweep.to_pandas()):
        assert np.array_equal(
            table["nutation_min"], columns["nutation_min"].ravel(), equal_nan=True
        )
    grid = sweep.to_xarray()
    assert grid["nutation_min"].dims == ("spin", "gravity")
    assert np.array_equal(grid["nutation_min"], columns["nutation_min"], equal_nan=True)
    assert grid["gravity"].values.tolist() == np.linspace(-1, 1, 25).tolist()
    assert grid["gravity"].units == "L T^-2" and grid.plan == sweep.hash


def test_states_and_events_equal_those_of_the_ensemble(tmp_path):
    sweep = run_sweep(tmp_path, WATCHED)
    whole = kr.solve(ensemble(), TIMES, "taylor", events=[LOW], max_steps=14)
    assert sweep["q_w"].shape == (*SHAPE, 2)
    assert np.array_equal(sweep["q_w"], whole.q[..., 0], equal_nan=True)
    assert np.array_equal(sweep.to_xarray()["m_z"], whole.m[..., 2], equal_nan=True)
    for name in ("top", "states", "which", "direction", "count"):
        assert np.array_equal(getattr(sweep.events, name), getattr(whole.events, name)), name
    assert np.array_equal(sweep["event_t"], whole.events.t)
    frame = sweep.to_pandas()
    assert len(frame) == 2 * SOURCE.size and frame.attrs["units"]["t"] == "T"
    assert np.array_equal(frame["m_x"], whole.m[..., 0].ravel(), equal_nan=True)
    lists = sweep.to_arrow()["event_t"].to_pylist()
    assert [t for times in lists for t in times] == whole.events.t.tolist()


@pytest.mark.parametrize(
    "words",
    [
        {"want": ["spin", "frame"], "t": TIMES},
        {"t": -2.0, "method": "strang", "step": 0.1, "every": 10},
        {"t": [1.0], "method": "taylor", "digits": 20},
        {"t": [], "method": "auto"},
        {"t": 1.0, "method": "geometric", "error": 1e-3},
        {"t": [1.0], "reduce": {"m_x": "variance", "spin": ["where_max", "last"]}},
    ],
)
def test_all_results_of_solve_are_stored(tmp_path, words):
    sweep = run_sweep(tmp_path, {**words, "part_size": 5}, kr.Source.of(MIXED[:4]))
    if "reduce" in words:
        whole = kr.reduce(MIXED[:4], words["t"], words["reduce"])
        assert np.array_equal(sweep["m_x_variance"], whole["m_x"]["variance"])
        assert sweep.units["spin_where_max"] == "T" and sweep.units["m_x_variance"].endswith("^2")
        return
    whole = kr.solve(MIXED[:4], **words)
    assert np.array_equal(sweep["t"], np.broadcast_to(whole.t, sweep["t"].shape))
    if "want" in words:
        assert np.array_equal(sweep["spin"], whole.spin)
        assert np.array_equal(sweep["frame_Tz"], whole.frame[..., 2, 2])
    else:
        assert np.array_equal(sweep["q_z"], whole.q[..., 3])
    if "digits" in words:
        assert np.array_equal(sweep["m_low_y"], whole.m_low[..., 1]) and sweep["m_low_y"].any()
    assert sweep.to_xarray()["status"].shape == (4,)


def test_a_start_named_like_a_result_gets_a_suffix(tmp_path):
    sweep = run_sweep(
        tmp_path, {"t": [1.0], "want": ["spin"]}, kr.Source.grid(TOP, spin=[1.0, 2.0])
    )
    assert sweep["spin_given"].tolist() == [1, 2] and sweep["spin"].shape == (2, 1)
    grid = sweep.to_xarray()
    assert grid["spin"].dims == ("spin_given", "time") and "spin_given" in grid.coords
    assert np.array_equal(grid["spin"].values, sweep["spin"])
    assert grid["spin_given"].values.tolist() == [1, 2]
    assert {"spin_given", "spin"} <= set(sweep.to_pandas())


def test_a_partial_sweep_has_the_rows_of_its_parts(tmp_path):
    run_sweep(tmp_path, parts=range(1, 3))
    sweep = kr.read_sweep(tmp_path, partial=True)
    assert sweep["top"].tolist() == [*range(64, 192)] and sweep["status"].shape == (128,)
    assert len(sweep.to_pandas()) == 128 and sweep.missing == [0, 3, 4]
    grid = sweep.to_xarray()
    is_present = np.zeros(SOURCE.size, bool)
    is_present[64:192] = True
    assert np.array_equal(grid["steps"].values.ravel() >= 0, is_present)
    assert [len(part["top"]) for part in sweep] == [64, 64]
    assert "2 of 5 parts" in repr(sweep)


def test_without_pyarrow_the_error_names_the_extra_and_nothing_is_written(
    tmp_path, runs, monkeypatch
):
    sweep = kr.read_sweep(runs / "reduced")
    for name in [name for name in sys.modules if name.split(".")[0] == "pyarrow"]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.delitem(sys.modules, "kreisel._sweep.parquet")
    monkeypatch.delattr(kreisel._sweep, "parquet")
    calls = (
        lambda: run_sweep(tmp_path / "runs"),
        lambda: kr.read_sweep(runs / "reduced"),
        lambda: kr.Source.columns(TOP, "tops.parquet"),
        sweep.to_arrow,
    )
    for call in calls:
        with pytest.raises(ModuleNotFoundError, match=r"pyarrow.* pip install 'kreisel\[sweep\]'"):
            call()
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("tops", [*[t for t in ENSEMBLES if t.size], MIXED, random_ensemble(40)])
def test_an_ensemble_is_a_source(tmp_path, tops):
    source = kr.Source.of(tops)
    assert source[:] == tops.ravel() and len(source) == tops.size
    assert source[tops.size - 1] == tops.ravel()[-1]
    sweep = kr.sweep(tops, [0.5, 1.0], folder=tmp_path, part_size=7)
    again = kr.read_sweep(tmp_path)
    assert np.array_equal(again["q_y"], kr.solve(tops, [0.5, 1.0]).q[..., 2])
    assert again._store.plan.source[:] == tops.ravel() and again.axes == sweep.axes


def test_a_large_ensemble_has_a_file_beside_the_plan(tmp_path):
    tops = kr.Ensemble(
        TOP.body, momentum=np.random.default_rng(3).normal(size=(25000, 3)), gravity=1
    )
    words = {"t": [0.1], "reduce": {"energy": "last"}, "method": "strang", "step": 0.1}
    sweep = kr.sweep(tops, folder=tmp_path, **words, part_size=10000)
    (file,) = tmp_path.glob("starts-*.npy")
    assert (tmp_path / "plan.json").stat().st_size < 10000
    assert np.array_equal(np.load(file), tops.momentum)
    whole = kr.reduce(tops, [0.1], {"energy": "last"}, "strang", step=0.1)
    assert np.array_equal(sweep["energy_last"], whole["energy"]["last"])
    assert np.array_equal(sweep["momentum_y"], tops.momentum[:, 1])
    with pytest.raises(ValueError, match="is of another plan"):
        kr.sweep(tops[::-1], folder=tmp_path, **words, part_size=10000)
    np.save(file, np.zeros((25000, 3)))
    with pytest.raises(ValueError, match="damaged: its numbers do not match its name"):
        kr.read_sweep(tmp_path)


def test_a_grid_has_the_order_of_its_arguments(tmp_path):
    source = kr.Source.grid(TOP, momentum=[(0, 0, 1), (1, 2, 3)], gravity=[1, 2, 3], damping=0.1)
    tops = TOP.vary(
        momentum=np.array([[(0, 0, 1)], [(1, 2, 3)]]), gravity=[1.0, 2.0, 3.0], damping=0.1
    )
    assert source.shape == (2, 3) and source.axes == ("momentum", "gravity")
    assert source[:] == tops.ravel() and source[4] == tops[1, 1] == source[-2]
    sweep = run_sweep(tmp_path, {"t": [1.0], "part_size": 4}, source)
    assert sweep["momentum_y"].tolist() == [[0] * 3, [2] * 3]
    steady = kr.Source.grid(kr.scenes.sleeping, spin=[20, 30], tilt=[10, 20], degrees=True)
    assert steady[3] == kr.scenes.sleeping.vary(spin=30, tilt=20, degrees=True)[()]
    inertia = kr.Source.grid(TOP, inertia=[(2, 2, 1), (2, 3, 2)], com=[(0, 0, 1)] * 3)
    assert inertia.shape == (2, 3) and inertia[5].body.inertia == (2, 3, 2)
    assert kr.Source.grid(TOP, inertia=np.diag([2, 2, 1]), mass=[1, 2])[1].body.moments == (2, 2, 1)


def test_a_random_top_depends_only_on_the_seed_and_its_index():
    words = {"seed": 5, "momentum": None, "angles": [(0, 0, 0), (1, 2, 3)]}
    many, more = kr.Source.random(TOP, 1000, **words), kr.Source.random(TOP, 10**12, **words)
    assert many[:] == more[:1000] and many[700:] == more[700:1000] and many[3] == more[3]
    assert more[10**12 - 1] == more[-1]
    other = kr.Source.random(TOP, 1000, **words, gravity=(-1, 1))[:]
    assert np.array_equal(other.coords["angles"], many[:].coords["angles"])
    assert not np.array_equal(
        kr.Source.random(TOP, 9, **words | {"seed": 6})[:].momentum, many[:9].momentum
    )
    down, angles = other.coords["gravity"], other.coords["angles"]
    assert -1 <= down.min() < -0.95 and 0.95 < down.max() <= 1 and abs(down.mean()) < 0.06
    assert np.allclose(angles.mean(axis=0), [0.5, 1, 1.5], atol=0.1)
    assert abs(np.corrcoef(down, angles[:, 0])[0, 1]) < 0.1


def test_scattered_tops_equal_those_of_the_scene(tmp_path):
    words = {"seed": 3, "attitude": 0.01, "momentum": (0.1, 0.2, 0.3), "gravity": 0.1}
    source = kr.Source.scatter(TOP, 500, **words)
    assert source[100:200] == TOP.scatter(500, **words)[100:200]
    sweep = run_sweep(tmp_path, {"t": [1.0], "part_size": 99}, source)
    assert np.array_equal(sweep["gravity"], TOP.scatter(500, **words).gravity)
    assert np.array_equal(sweep["momentum_z"], TOP.scatter(500, **words).momentum[:, 2])


def test_sources_and_sweeps_can_be_copied_and_have_a_repr(tmp_path):
    sweep = run_sweep(tmp_path, parts=range(2))
    for source in (SOURCE, kr.Source.random(TOP, 7, spin=(0, 1)), kr.Source.of(MIXED)):
        again = pickle.loads(pickle.dumps(source))
        assert again[2:5] == source[2:5] and copy.copy(source)[1] == source[1]
        with pytest.raises(AttributeError, match=r"construct a new kreisel\.Source"):
            source.scene = TOP
    assert pickle.loads(pickle.dumps(sweep)).present == [0, 1]
    assert repr(SOURCE) == "<kreisel.Source of shape (12, 25): spin, gravity>"
    assert repr(sweep) == "<kreisel.SweepResult of shape (12, 25): 2 of 5 parts>"
    with pytest.raises(IndexError, match="index 300 is out of range for 300 tops"):
        SOURCE[300]


def test_columns_of_files_are_parameters(tmp_path):
    momenta, down = np.random.default_rng(0).normal(size=(40, 3)), np.linspace(0, 1, 40)
    flat = {f"momentum_{axis}": momenta[:, i] for i, axis in enumerate("xyz")} | {"gravity": down}
    parquet.write_table(pa.table(flat), tmp_path / "tops.parquet")
    text.write_csv(pa.table(flat), tmp_path / "tops.csv")
    tops = TOP.vary(momentum=momenta, gravity=down)
    hashes = set()
    for ending in ("parquet", "csv"):
        source = kr.Source.columns(TOP, tmp_path / f"tops.{ending}")
        assert source[:] == tops and source.shape == (40,)
        run_sweep(tmp_path / ending, {"t": [1.0], "part_size": 9}, source)
        hashes.add(hash_rows(tmp_path / ending))
    assert len(hashes) == 1
    odd = tmp_path / "odd.parquet"
    for table, columns in {
        "unknown column 'gravty'; did you mean 'gravity'": {"gravty": down},
        "'momentum_x' is a component of momentum, .* missing: momentum_y, momentum_z$": {
            "momentum_x": down,
            "gravity": down,
        },
        "'angles_2' is a component of angles, .* column is missing: angles_1$": {
            "angles_2": down,
            "angles_0": down,
        },
        "'gravity' has missing values": {"gravity": [1.0, None]},
        r"odd\.parquet: its column 'gravity' must be numbers, not string": {"gravity": ["a", "b"]},
        "gravity must be finite": {"gravity": [1.0, np.nan]},
        "must be rows of one length": {"gravity": down[:0]},
    }.items():
        parquet.write_table(pa.table(columns), odd)
        with pytest.raises((ValueError, TypeError), match=table):
            kr.Source.columns(TOP, odd)
    (tmp_path / "twice.csv").write_text("gravity,spin,gravity\n1,2,3\n")
    with pytest.raises(ValueError, match=r"twice\.csv: it has several columns 'gravity'"):
        kr.Source.columns(TOP, tmp_path / "twice.csv")
    (tmp_path / "none.parquet").write_bytes(b"precious")
    with pytest.raises(ValueError, match="cannot be read"):
        kr.Source.columns(TOP, tmp_path / "none.parquet")


def test_a_plan_in_a_file_equals_the_plan_of_the_same_arguments(tmp_path):
    parquet.write_table(pa.table({"gravity": np.linspace(-1, 1, 9)}), tmp_path / "tops.parquet")
    TOP.to_toml(tmp_path / "top.toml")
    head = "t = { from = 0, to = 2, n = 3 }\ntol = 1e-9\npart_size = 4\nscene = "
    tables = {
        "asymmetric": "[grid]\nspin = [1, 2]\ngravity = { from = 0, to = 1, n = 5 }",
        "top.toml": "[columns]\nfile = 'tops.parquet'",
    }
    sources = {
        "asymmetric": kr.Source.grid(TOP, spin=[1, 2], gravity=np.linspace(0, 1, 5)),
        "top.toml": kr.Source.columns(TOP, tmp_path / "tops.parquet"),
    }
    for name, table in tables.items():
        (tmp_path / "plan.toml").write_text(f"{head}'{name}'\n{table}\n")
        sweep = kr.sweep(tmp_path / "plan.toml", folder=tmp_path / name.replace(".", "_"))
        again = kr.sweep(sources[name], [0, 1, 2], tol=1e-9, part_size=4, folder=sweep.folder)
        assert again.hash == sweep.hash
    plan = (
        "t = [1.0]\nmethod = 'taylor'\n[[events]]\nevent = 'crossing'\nfunction = { m_x = 2 }\n"
        "value = 0.1\n[scatter]\nn = 5\nseed = 2\ngravity = 0.1\n[scene]\n" + TOP.to_toml()
    )
    (tmp_path / "plan.toml").write_text(plan.replace("[body]", "[scene.body]"))
    sweep = kr.sweep(tmp_path / "plan.toml", folder=tmp_path / "events")
    crossing = kr.events.crossing({"m_x": 2}, 0.1)
    source = kr.Source.scatter(TOP, 5, seed=2, gravity=0.1)
    again = kr.sweep(source, [1.0], "taylor", events=crossing, folder=sweep.folder)
    assert again.hash == sweep.hash and sweep.events is not None and sweep.parts < PARTS


def test_a_damping_of_one_number_applies_to_all_axes():
    source = kr.Source.grid(TOP, damping=[[0.1], [0.2]])
    assert source[1] == TOP.replace(damping=0.2) and source.shape == (2,)


@pytest.mark.parametrize(
    ("source", "part", "parts"),
    [
        (kr.Source.random(TOP, 10**18, spin=(0.0, 20.0)), None, 7629394531250),
        (kr.Source.random(TOP, 10**9, spin=(0.0, 20.0)), 1, 10**9),
    ],
)
def test_a_plan_of_many_parts_lists_only_existing_files(tmp_path, source, part, parts):
    words = {"folder": tmp_path, "part_size": part, "reduce": {"nutation": "max"}}
    if part is None:
        words["parts"] = range(0)
        sweep = kr.sweep(source, 1.0, **words)
        assert sweep.present == []
    else:
        sweep = kr.sweep(source, 1.0, **words, parts=range(parts - 2, parts))
        assert sweep.present == [parts - 2, parts - 1]
        assert kr.read_sweep(tmp_path, partial=True)["top"].tolist() == sweep.present
        with pytest.raises(ValueError, match=r"999999998 of 1000000000 parts are missing: 0, 1, 2"):
            sweep["top"]
    (tmp_path / "part-0000001.parquet").write_bytes(b"of no part")
    (tmp_path / f"part-{parts}.parquet").write_bytes(b"of no part")
    assert sweep.parts == parts and kr.read_sweep(tmp_path).present == sweep.present


# Boundary values


def test_a_file_may_contain_only_its_checksum():
    whole = checksum.fill_in_checksum(bytearray(checksum.PLACEHOLDER.encode()))
    assert checksum.has_correct_checksum(bytes(whole))
    assert not checksum.has_correct_checksum(b"") and not checksum.has_correct_checksum(
        bytes(whole[1:])
    )
    assert not checksum.has_correct_checksum(bytes(whole[:-1] + b"?"))


def test_long_parameters_have_a_file_beside_the_plan():
    most = sweep_plan._MAX_INLINE
    ((name, shape, values),) = sweep_plan._list_parameters_as_json(
        [BatchParameter("spin", np.arange(float(most)), ())]
    )
    assert (name, shape, len(values)) == ("spin", [], most)
    ((*_, file_name),) = sweep_plan._list_parameters_as_json(
        [BatchParameter("spin", np.arange(float(most + 1)), (3,))]
    )
    assert isinstance(file_name, str)


def test_a_plan_contains_only_numbers_that_json_allows():
    with pytest.raises(ValueError, match="not JSON compliant"):
        dump_canonical_json({"step": math.nan})
