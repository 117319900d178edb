"""Tests that a sweep has the results of the public functions, however it is run and read."""

import os
import pickle
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import kreisel as kr
import numpy as np
import pyarrow as pa
import pyarrow.csv as text
import pyarrow.parquet as parquet
import pytest
from ensembles import MIXED, random_ensemble, same_bits
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from sweeps import LOW, REDUCED, SOURCE, TOP, hash_rows, run_sweep

EXAMPLES = settings(
    deadline=None,
    max_examples=int(os.environ.get("KREISEL_CALLS", 40)),
    derandomize=True,
    phases=[Phase.generate],  # a sweep takes long to be made simpler
)
SLEEPING = kr.scenes.sleeping
BODIES = kr.Body.symmetric(1, i1=[2, 3, 4], i3=1, height=0.5)
DIRECTION = [0, 0, 0, 1, 0, 0]
PLANE = kr.events.plane((0, 0, 1), 0.3)
SCATTER = {"seed": 3, "attitude": 0.01, "momentum": (0.1, 0.2, 0.3), "gravity": 0.1}
RANDOM = kr.Source.random(SLEEPING, 20, spin=(0, 900), tilt=(0, 90), degrees=True)
STEADY = {"spin": [2000.0, 3000.0], "tilt": [10.0, 20.0], "degrees": True, "steady": True}
TOPS = {  # a source of each kind, and the same tops as an ensemble
    "grid": (
        SOURCE,
        TOP.vary(spin=np.linspace(0, 9, 6)[:, None], gravity=np.linspace(-1, 1, 5)),
    ),
    "vectors": (
        kr.Source.grid(TOP, momentum=[(0, 0, 1), (1, 2, 3)], gravity=[1, 2, 3], damping=0.1),
        TOP.vary(momentum=np.array([[(0, 0, 1)], [(1, 2, 3)]]), gravity=[1, 2, 3], damping=0.1),
    ),
    "bodies": (
        kr.Source.grid(TOP, inertia=[(2, 2, 1), (2, 3, 2)], com=[(0, 0, 1), (0, 0, 2)], mass=2),
        TOP.vary(inertia=np.array([[(2, 2, 1)], [(2, 3, 2)]]), com=[(0, 0, 1), (0, 0, 2)], mass=2),
    ),
    "steady, in degrees": (
        kr.Source.grid(SLEEPING, **STEADY),
        SLEEPING.vary(**STEADY | {"spin": [[2000.0], [3000.0]]}),
    ),
    "turning support": (
        kr.Source.grid(TOP, turning=[(0, 0, 0.5), (0.1, 0.2, 0.3)], shaking=(0.1, 5, 0.3)),
        TOP.vary(turning=[(0, 0, 0.5), (0.1, 0.2, 0.3)], shaking=(0.1, 5, 0.3)),
    ),
    "scattered": (kr.Source.scatter(TOP, 20, **SCATTER), TOP.scatter(20, **SCATTER)),
    "random, in degrees": (RANDOM, RANDOM[:]),
    "ensemble": (kr.Source.of(MIXED), MIXED),
    "ensemble of bodies": (
        kr.Source.of(kr.Scene(BODIES, momentum=np.ones((4, 1, 3)), gravity=1)),
        kr.Scene(BODIES, momentum=np.ones((4, 1, 3)), gravity=1),
    ),
    "ensemble in degrees": (
        kr.Source.of(SLEEPING.vary(tilt=[1.0, 2.0, 3.0], degrees=True)),
        SLEEPING.vary(tilt=[1.0, 2.0, 3.0], degrees=True),
    ),
    "random ensemble": (kr.Source.of(random_ensemble(9)), random_ensemble(9)),
}
CHAOTIC = [name for name in TOPS if name not in ("ensemble", "vectors", "turning support")]
TASKS = {
    "states": {"t": [0.5, 2.0]},
    "wanted": {"t": [0.5, 2.0], "want": ["spin", "frame"]},
    "low words": {"t": [1.0], "method": "taylor", "digits": 20},
    "steps": {"t": -1.0, "method": "taylor", "tol": 1e-6},
    "step search": {"t": 1.0, "method": "geometric", "error": 1e-3},
    "no times": {"t": []},
    "events": {"t": [0.5, 4.0], "method": "taylor", "events": [LOW, PLANE], "max_steps": 14},
    "reduced": {name: word for name, word in REDUCED.items() if name != "part_size"},
    "moments": {"t": [0.5, 1.0], "reduce": {"m_x": "variance", "spin": ["where_max", "last"]}},
    "chaos": {"task": "chaos", "t": 2.0},
    "lyapunov": {"task": "lyapunov", "t": 3, "tol": 1e-9},
    "megno": {"task": "megno", "t": [-1, -3.5], "direction": DIRECTION},
    "oli": {"task": "oli", "t": 3.0, "max_steps": 20},
    "section": {"task": "section", "n": 5, "max_wait": -4},
    "plane": {"task": "section", "n": 3, "event": PLANE, "max_wait": 2.5, "max_steps": 50},
}
GROWTH = "chaos", "lyapunov", "megno", "oli"
COMPONENTS = {"q": "wxyz", "m": "xyz", "q_low": "wxyz", "m_low": "xyz", "apex": "xyz"}
COMPONENTS |= {"frame": ["".join(pair) for pair in product("NBT", "xyz")]}


UNITS = dict.fromkeys(["t", "reached", "event_t", "spin_where_max"], "T")
UNITS |= dict.fromkeys(["m_x", "event_m_z"], "M L^2 T^-1") | {"m_x_variance": "(M L^2 T^-1)^2"}
UNITS |= dict.fromkeys(["q_w", "apex_x_mean", "megno", "megno_curve", "oli", "status"], "")
UNITS |= dict.fromkeys(["lyapunov", "lyapunov_curve"], "T^-1") | {"gravity": "L T^-2"}
UNITS |= {"nutation_min": "rad", "spin": "rad/T", "spin_last": "rad/T"}


def split_components(name, values, ending=""):
    """Return the components of a quantity, as columns of a sweep."""
    if name not in COMPONENTS:
        return {name + ending: values}
    inner = (3, 3) if name == "frame" else (len(COMPONENTS[name]),)
    places = zip(COMPONENTS[name], np.ndindex(inner), strict=True)
    return {f"{name}_{c}{ending}": values[(..., *place)] for c, place in places}


def call_task(tops, words):
    """Return the result of the public function that a sweep calls."""
    words = dict(words)
    task = words.pop("task", "solve")
    if "reduce" in words:
        return kr.reduce(tops, reductions=words.pop("reduce"), **words)
    return getattr(kr, "chaos" if task in GROWTH else task)(tops, **words)


def list_columns(tops, words):
    """Return the expected columns of a sweep, with the shape of the tops."""
    whole, task = call_task(tops, words), words.get("task", "solve")
    if task in GROWTH:
        names = ["lyapunov", "megno", "oli"] if task == "chaos" else [task]
        names += [f"{name}_curve" for name in names]
        names += ["certificate", "is_chaotic", "is_doubtful"]
        columns = {name: getattr(whole, name) for name in names}
        return columns | {"t": np.broadcast_to(whole.t, whole.oli_curve.shape)}
    columns = {"status": whole.status, "reached": whole.reached, "steps": whole.stats.steps}
    if task == "section":
        columns |= {"events": whole.count, "event_t": whole.t}
        columns |= split_components("q", whole.q) | split_components("m", whole.m)
        return {f"event_{n}" if n[:2] in ("q_", "m_") else n: v for n, v in columns.items()}
    if "reduce" in words:
        for name, kinds in whole.items():
            for kind, values in kinds.items():
                columns |= split_components(name, values, f"_{kind}")
        return columns
    columns["t"] = np.broadcast_to(whole.t, (*tops.shape, whole.t.shape[-1]))
    lows = ("q_low", "m_low") if "digits" in words else ()
    for name in words.get("want", ("q", "m", *lows)):
        columns |= split_components(name, getattr(whole, name))
    if "events" in words:
        columns |= {"event_t": whole.events.t, "event_which": whole.events.which}
    return columns


def same_values(one, other):
    """Return True if two arrays are equal, bitwise if they are of doubles."""
    one, other = np.asarray(one), np.asarray(other)
    return same_bits(one, other) if one.dtype.kind == "f" else np.array_equal(one, other)


def check_sweep(sweep, tops, words):
    """Check that a sweep has the results of its tops, and that its tables have its columns."""
    expected = list_columns(tops, words)
    assert sweep.shape == tops.shape and sweep.missing == [] and set(expected) <= set(sweep.columns)
    for name in [name for name in expected if name.startswith("event_")] or [*expected][-2:]:
        assert same_values(sweep[name], expected[name]), name
    assert sweep["top"].ravel().tolist() == list(range(tops.size))
    grid, frame = sweep.to_xarray(), sweep.to_pandas()
    states = 1 if sweep.size == len(frame) else np.shape(expected["t"])[-1]
    assert len(frame) == sweep.size * states
    for name, values in expected.items():
        if name in grid and name != "t":
            assert same_values(grid[name], values), name
            repeats = len(frame) // max(np.size(values), 1)
            assert same_values(frame[name], np.repeat(np.ravel(values), repeats)), name
    for name, values in tops.coords.items():
        if np.shape(values) == tops.shape or np.ndim(values) == tops.ndim:
            given = f"{name}_given" if f"{name}_given" in sweep.columns else name
            assert same_values(sweep[given], np.broadcast_to(values, tops.shape))


@pytest.mark.parametrize("kind", TOPS)
def test_a_source_has_the_tops_of_the_ensemble(kind):
    source, tops = TOPS[kind]
    assert source[:] == tops.ravel() and source.shape == tops.shape and len(source) == tops.size
    assert source[tops.size - 1] == source[-1] == tops.ravel()[-1]
    assert source[2:5] == tops.ravel()[2:5] and source[2:1].size == 0
    again = pickle.loads(pickle.dumps(source))
    assert again[:] == source[:] and repr(source) == repr(again)


def run_in_threads(folder, words, source, threads, **more):
    """Run a sweep in some threads, or by the workers of an executor if `threads` is None."""
    if threads is not None:
        return run_sweep(folder, words, source, threads=threads, **more)
    with ThreadPoolExecutor(2) as executor:
        return run_sweep(folder, words, source, executor=executor, **more)


@EXAMPLES
@given(st.data(), st.sampled_from(list(TASKS)))
def test_a_sweep_has_the_results_of_its_tops(tmp_path_factory, data, task):
    """Check tops, tasks, parts, threads, orders and repairs that are drawn together."""
    folder = tmp_path_factory.mktemp("sweep")
    kind = data.draw(st.sampled_from(CHAOTIC if task in GROWTH else list(TOPS)))
    source, tops = TOPS[kind]
    size = data.draw(st.integers(-(-tops.size // 6), tops.size))
    count, threads = -(-tops.size // size), st.sampled_from([1, 2, None])
    for _ in range(data.draw(st.integers(0, 2))):
        begin = data.draw(st.integers(0, count))
        parts = range(begin, data.draw(st.integers(begin, count)))
        run_in_threads(folder, TASKS[task], source, data.draw(threads), part_size=size, parts=parts)
    for file in folder.glob("part-*"):
        if data.draw(st.booleans()):
            file.unlink()
    run_in_threads(folder, TASKS[task], source, data.draw(threads), part_size=size)
    sweep = kr.read_sweep(folder)
    check_sweep(sweep, tops, TASKS[task])
    assert ("deg" in "".join(sweep.units.values())) == ("degrees" in kind)


@pytest.mark.parametrize("task", TASKS)
def test_every_task_has_the_results_of_its_tops(tmp_path, task):
    sweep, tops = run_sweep(tmp_path, TASKS[task], part_size=8), TOPS["grid"][1]
    check_sweep(sweep, tops, TASKS[task])
    file = parquet.read_schema(tmp_path / "part-000000.parquet")
    assert {each.name: each.metadata[b"units"].decode() for each in file} == sweep.units
    assert all(UNITS[name] == unit for name, unit in sweep.units.items() if name in UNITS)
    assert (sweep.events is not None) == (task == "events")
    if "event_t" in sweep.columns:
        counts = sweep["events"].ravel().tolist()
        assert 0 < sum(counts) == len(sweep["event_t"])
        assert [len(times) for times in sweep.to_arrow()["event_t"].to_pylist()] == counts
    if task == "events":
        whole = kr.solve(tops, **TASKS[task]).events
        for name in ("top", "states", "which", "direction", "count"):
            assert np.array_equal(getattr(sweep.events, name), getattr(whole, name)), name


# Sources


def test_a_random_top_depends_only_on_the_seed_and_its_index():
    words = {"seed": 5, "momentum": None, "angles": [(0, 0, 0), (1, 2, 3)]}
    many, more = kr.Source.random(TOP, 1000, **words), kr.Source.random(TOP, 10**12, **words)
    assert many[:] == more[:1000] and many[700:] == more[700:1000] and many[3] == more[3]
    assert more[10**12 - 1] == more[-1]
    other = kr.Source.random(TOP, 1000, **words, gravity=(-1, 1))[:]
    assert np.array_equal(other.coords["angles"], many[:].coords["angles"])
    assert kr.Source.random(TOP, 9, **words | {"seed": 6})[:] != many[:9]
    down, angles = other.coords["gravity"], other.coords["angles"]
    assert -1 <= down.min() < -0.95 and 0.95 < down.max() <= 1 and abs(down.mean()) < 0.06
    assert np.allclose(angles.mean(axis=0), [0.5, 1, 1.5], atol=0.1)
    assert abs(np.corrcoef(down, angles[:, 0])[0, 1]) < 0.1


SPINS = {"spin": [20.0, 30.0], "tilt": [0.1, 0.2]}
ROWS, INERTIA = "spin,tilt\n20.0,0.1\n30.0,0.2\n", ",".join(f"inertia_{i}" for i in range(9))
STARTS = "momentum_x,momentum_y,momentum_z,damping_0\n1,2,3,0.1\n4,5,6,0.2\n"
FAST, DEGREES = {"steady": True, "fast": True}, {"degrees": True}
TABLES = [  # columns of a file, flags, and the same tops
    (ROWS, {}, SLEEPING.vary(**SPINS)),
    (ROWS, DEGREES, SLEEPING.vary(**SPINS, **DEGREES)),
    (ROWS, FAST, SLEEPING.vary(**SPINS, **FAST)),
    (f"spin [deg/T],tilt [deg]{ROWS[9:]}", {}, SLEEPING.vary(**SPINS, **DEGREES)),
    (STARTS, {}, SLEEPING.vary(momentum=[(1, 2, 3), (4, 5, 6)], damping=[[0.1], [0.2]])),
    (
        f"{INERTIA}\n2,0,0,0,2,0,0,0,1\n3,0,0,0,3,0,0,0,1\n",
        {},
        SLEEPING.vary(inertia=[np.diag([2, 2, 1]), np.diag([3, 3, 1])]),
    ),
]


@pytest.mark.parametrize("ending", ["CSV", "parquet"])
@pytest.mark.parametrize("table, flags, tops", TABLES)
def test_columns_of_files_are_parameters(tmp_path, table, flags, tops, ending):
    file = tmp_path / f"tops.{ending}"
    file.write_text(table)
    if ending == "parquet":
        parquet.write_table(text.read_csv(pa.BufferReader(table.encode())), file)
    source = kr.Source.columns(SLEEPING, file, **flags)
    assert source[:] == tops and source.shape == (2,)
    check_sweep(run_sweep(tmp_path / "runs", {"t": [1.0]}, source), tops, {"t": [1.0]})


def test_a_large_ensemble_has_a_file_beside_the_plan(tmp_path):
    momenta = np.random.default_rng(3).normal(size=(25000, 3))
    tops = kr.Scene(TOP.body, momentum=momenta, gravity=1)
    words = {"reduce": {"energy": "last"}, "method": "strang", "step": 0.1, "part_size": 10000}
    kr.sweep(tops, [0.1], folder=tmp_path, **words)
    (file,) = tmp_path.glob("starts-*.npy")
    assert (tmp_path / "plan.json").stat().st_size < 10000
    sweep = kr.read_sweep(tmp_path)
    whole = kr.reduce(tops, [0.1], {"energy": "last"}, "strang", step=0.1)
    assert np.array_equal(sweep["energy_last"], whole["energy"]["last"])
    assert np.array_equal(sweep["momentum_y"], momenta[:, 1])
    with pytest.raises(ValueError, match="is of another plan"):
        kr.sweep(tops[::-1], [0.1], folder=tmp_path, **words)
    np.save(file, np.zeros((25000, 3)))
    with pytest.raises(ValueError, match="damaged"):
        kr.read_sweep(tmp_path)


# Plans


HEAD, T = "scene = 'asymmetric'\n", "t = 1\n"
GRID = HEAD + T + "[grid]\nspin = [1, 2]\n"
SPUN = kr.Source.grid(TOP, spin=[1, 2])
PLANS = [  # text of a plan in a file, and the source and arguments of the same sweep
    (
        f"{HEAD}t = {{ from = 0, to = 2, n = 3 }}\ntol = 1e-9\n[grid]\nspin = [1, 2]\n"
        "gravity = { from = 0, to = 1, n = 5 }",
        kr.Source.grid(TOP, spin=[1, 2], gravity=np.linspace(0, 1, 5)),
        {"t": [0, 1, 2], "tol": 1e-9},
    ),
    (
        f"part_size = 2\n{HEAD}{T}[grid]\nmomentum = {{ from = [0, 0, 1], to = [1, 2, 3], n = 3 }}",
        kr.Source.grid(TOP, momentum=[(0, 0, 1), (0.5, 1, 2), (1, 2, 3)]),
        {"t": 1, "part_size": 2},
    ),
    (
        f"want = ['spin']\n{HEAD}{T}[random]\nn = 5\nspin = [0, 90]\ndegrees = true",
        kr.Source.random(TOP, 5, spin=(0, 90), degrees=True),
        {"t": 1, "want": ["spin"]},
    ),
    (
        "t = [1.0]\nmethod = 'taylor'\n[[events]]\nevent = 'crossing'\nfunction = { m_x = 2 }\n"
        "value = 0.1\n[scatter]\nn = 5\nseed = 2\ngravity = 0.1\n[scene]\n"
        + TOP.to_toml().replace("[body]", "[scene.body]"),
        kr.Source.scatter(TOP, 5, seed=2, gravity=0.1),
        {"t": [1.0], "method": "taylor", "events": kr.events.crossing({"m_x": 2}, 0.1)},
    ),
    (
        f"scene = 'top.toml'\n{T}[reduce]\nnutation = 'min'\n[columns]\nfile = 'tops.csv'",
        SPUN,
        {"t": 1, "reduce": {"nutation": "min"}},
    ),
    (
        "task = 'megno'\ndirection = [0, 0, 0, 1, 0, 0]\n" + GRID,
        SPUN,
        {"task": "megno", "t": 1, "direction": np.array(DIRECTION)},
    ),
    (
        "task = 'section'\nn = 3\nmax_wait = 5\n"
        "event = { event = 'plane', normal = [0, 0, 1], offset = 0.3 }\n" + GRID.replace(T, ""),
        SPUN,
        {"task": "section", "n": 3, "max_wait": 5, "event": PLANE},
    ),
]


@pytest.mark.parametrize("plan, source, words", PLANS)
def test_a_plan_in_a_file_gives_the_sweep_of_the_same_arguments(tmp_path, plan, source, words):
    (tmp_path / "plan.toml").write_text(plan)
    (tmp_path / "tops.csv").write_text("spin\n1\n2\n")
    TOP.to_toml(tmp_path / "top.toml")
    one = kr.sweep(tmp_path / "plan.toml", folder=tmp_path / "file")
    other = kr.sweep(source, folder=tmp_path / "call", **words)
    assert hash_rows(one.folder) == hash_rows(other.folder)
    assert (one.hash, one.plan) == (other.hash, other.plan) or "columns" in plan
    with pytest.raises(ValueError, match="whole plan"):
        kr.sweep(tmp_path / "plan.toml", folder=tmp_path / "file", part_size=3)


def test_a_plan_of_many_parts_lists_only_existing_files(tmp_path):
    source, n = kr.Source.random(TOP, 10**15, spin=(0.0, 20.0)), 10**15
    words = {"t": 1.0, "reduce": {"nutation": "max"}, "part_size": 1}
    sweep = run_sweep(tmp_path, words, source, parts=range(n - 2, n))
    assert sweep.parts == n and sweep.present == [n - 2, n - 1]
    assert kr.read_sweep(tmp_path, partial=True)["top"].tolist() == sweep.present
    (tmp_path / f"part-{n}.parquet").write_bytes(b"of no part")
    assert kr.read_sweep(tmp_path).present == sweep.present


# Other readers


def test_duckdb_and_polars_query_the_parts(tmp_path):
    import duckdb
    import polars

    sweep = run_sweep(tmp_path / "reduced")
    watched = run_sweep(tmp_path / "watched", TASKS["events"], part_size=7)
    is_complete = sweep["status"] == "OK"
    assert 0 < is_complete.sum() < sweep.size
    files = f"'{tmp_path}/reduced/*.parquet'"
    query = f"SELECT spin, max(nutation_max) FROM {files} WHERE status = 0 GROUP BY spin"
    for spin, largest in duckdb.sql(query).fetchall():
        is_selected = is_complete & (sweep.to_xarray()["spin"].values[:, None] == spin)
        assert largest == sweep["nutation_max"][is_selected].max()
    query = f"SELECT event_t FROM '{tmp_path}/watched/*.parquet' ORDER BY top"
    times = [t for (each,) in duckdb.sql(query).fetchall() for t in each]
    assert times == watched["event_t"].tolist()
    long = (
        polars.scan_parquet(tmp_path / "watched/*.parquet").select("t", "m_z").explode("t", "m_z")
    )
    assert np.array_equal(long.collect()["m_z"], watched["m_z"].ravel(), equal_nan=True)
