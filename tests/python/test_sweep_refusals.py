"""Tests of the errors that invalid sweeps, sources, plans and folders raise."""

import json
import os
import pickle

import kreisel as kr
import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest
from ensembles import MIXED
from kreisel._sweep import checksum, store, sweep_plan
from sweeps import LOW, PARTS, REDUCED, SOURCE, TOP, run_sweep, start_python

GRID = "t = 1\nscene = 'thesis'\n[grid]\ngravity = [1, 2]\n"


def list_files(folder):
    return sorted(each.name for each in folder.iterdir())


def test_a_folder_of_something_else_stays_untouched(tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(FileExistsError, match=r"not a folder of a sweep.*contains 'thesis\.tex'"):
        run_sweep(tmp_path)
    with pytest.raises(FileExistsError, match=r"thesis\.tex is not a folder"):
        run_sweep(tmp_path / "thesis.tex")
    assert list_files(tmp_path) == ["thesis.tex"]


@pytest.mark.parametrize(
    "text", ["", "{}", "[1]", "no JSON", '{"kreisel": 1}', "\xff", '{"plan": ' * 99999]
)
def test_a_file_other_than_a_plan_stays_untouched(tmp_path, text):
    (tmp_path / "plan.json").write_text(text, encoding="latin-1")
    for call in (run_sweep, kr.read_sweep):
        with pytest.raises(ValueError, match=r"plan\.json is not a plan of a sweep"):
            call(tmp_path)
    assert (tmp_path / "plan.json").read_text(encoding="latin-1") == text


def test_a_changed_plan_is_refused(tmp_path):
    run_sweep(tmp_path, parts=range(0))
    file = tmp_path / "plan.json"
    text = file.read_text()
    file.write_text(text.replace('"part_size": 64', '"part_size": 32'))
    for call in (run_sweep, kr.read_sweep):
        with pytest.raises(ValueError, match="damaged: its hash does not match its plan"):
            call(tmp_path)


def test_a_plan_of_another_version_is_refused(tmp_path):
    run_sweep(tmp_path, parts=range(0))
    file = tmp_path / "plan.json"
    data = json.loads(file.read_text())
    data["plan"]["more"] = 1
    file.write_text(json.dumps(data | {"hash": sweep_plan.hash_plan(data["plan"])}))
    with pytest.raises(ValueError, match="in a format of another version"):
        kr.read_sweep(tmp_path)


def test_another_plan_is_refused_with_the_differences(tmp_path):
    sweep = run_sweep(tmp_path, parts=range(1))
    before = {name: (tmp_path / name).read_bytes() for name in list_files(tmp_path)}
    with pytest.raises(ValueError) as error:
        run_sweep(tmp_path, REDUCED | {"tol": 1e-9, "part_size": 32})
    lines = str(error.value).splitlines()
    assert sweep.hash[:16] in lines[0] and lines[0].count(" there") == 1
    assert lines[1:3] == [
        "  part_size: 64 there, 32 here",
        '  solve: {"max_steps": 14, "reduce": [["nutation", ["min", "max"]], ["apex", ["mean"]]]} '
        'there, {"tol": 1e-09, "max_steps": 14, "reduce": [["nutation", ["min", "max"]], '
        '["apex", ["mean"]]]} here',
    ]
    with pytest.raises(ValueError, match=r"parameters: .* there, .* here"):
        run_sweep(tmp_path, source=kr.Source.grid(TOP, spin=[0, 1], gravity=[1, 2]))
    assert before == {name: (tmp_path / name).read_bytes() for name in list_files(tmp_path)}


def test_a_folder_in_place_of_a_part_stays_untouched(tmp_path):
    run_sweep(tmp_path, parts=range(0))
    (tmp_path / "part-000003.parquet").mkdir()
    with pytest.raises(FileExistsError, match=r"part-000003\.parquet is a folder, in the place of"):
        run_sweep(tmp_path)
    assert list_files(tmp_path) == ["part-000003.parquet", "plan.json"]
    sweep = kr.read_sweep(tmp_path)
    assert sweep.verify() == {"done": [], "foreign": [3], "missing": [0, 1, 2, 4]}
    with pytest.raises(FileExistsError, match=r"is a folder"):
        sweep.check()
    with pytest.raises(ValueError, match=r"part-000003\.parquet is damaged, or not a part"):
        sweep.part(3)


def test_a_part_of_another_plan_stays_untouched(tmp_path):
    one, other = tmp_path / "one", tmp_path / "other"
    run_sweep(one, parts=range(2))
    run_sweep(other, REDUCED | {"tol": 1e-9}, parts=range(0))
    data = (one / "part-000000.parquet").read_bytes()
    (other / "part-000000.parquet").write_bytes(data)
    with pytest.raises(FileExistsError, match=r"part 0 of the plan .* place of part 0 of the plan"):
        run_sweep(other, REDUCED | {"tol": 1e-9})
    assert (other / "part-000000.parquet").read_bytes() == data
    sweep = kr.read_sweep(other)
    assert sweep.verify() == {"done": [], "foreign": [0], "missing": [1, 2, 3, 4]}
    with pytest.raises(FileExistsError, match="move or delete it"):
        sweep.check()
    with pytest.raises(
        ValueError, match="is not part 0 of this plan; repeating the call of kreisel"
    ):
        sweep.part(0)
    assert kr.read_sweep(other, partial=True).present == []


def make_parquet(about):
    """Return the bytes of a Parquet file in which `about` is the description of a sweep part."""
    table = pa.table({"top": [0]}).replace_schema_metadata(
        {"kreisel": about, "checksum": checksum.PLACEHOLDER}
    )
    out = pa.BufferOutputStream()
    parquet.write_table(table, out)
    return out.getvalue().to_pybytes()


@pytest.mark.parametrize(
    "data",
    [
        checksum.PLACEHOLDER.encode(),
        b"PAR1" + checksum.PLACEHOLDER.encode() + b"\xff" * 20 + b"\x14\x00\x00\x00PAR1",
        make_parquet("[1]"),
        make_parquet("no JSON"),
    ],
    ids=["no Parquet", "no metadata", "a list", "no JSON"],
)
def test_a_file_that_is_no_part_stays_untouched(tmp_path, data):
    run_sweep(tmp_path, parts=range(0))
    file, whole = (
        tmp_path / "part-000001.parquet",
        bytes(checksum.fill_in_checksum(bytearray(data))),
    )
    file.write_bytes(whole)
    found = kr.read_sweep(tmp_path)
    assert found.verify() == {"done": [], "foreign": [1], "missing": [0, 2, 3, 4]}
    with pytest.raises(FileExistsError, match="is part None of the plan None, in the place of"):
        run_sweep(tmp_path)
    with pytest.raises(ValueError, match=r"part-000001\.parquet is damaged, or not a part of this"):
        found.part(1)
    assert file.read_bytes() == whole


def test_a_column_that_a_part_lacks_is_named(tmp_path):
    found = run_sweep(tmp_path, parts=range(1))
    with pytest.raises(ValueError, match="it has no nothing, spinn"):
        found._store.read_part(0, ["top", "spinn", "nothing"])


def test_a_part_that_disappears_is_not_counted(tmp_path, monkeypatch):
    found = run_sweep(tmp_path, parts=range(2))
    monkeypatch.setattr(type(found._store), "list_existing_parts", lambda _: [0, 1, 2])
    assert found.verify() == {"done": [0, 1], "missing": [2, 3, 4]}


def test_a_folder_whose_plan_was_replaced_is_refused(tmp_path):
    found = run_sweep(tmp_path / "runs", parts=range(0))
    kept = pickle.dumps(found)
    (tmp_path / "runs").rename(tmp_path / "old")
    other = run_sweep(tmp_path / "runs", REDUCED | {"tol": 1e-9}, parts=range(0))
    store._open_cached_store.cache_clear()
    message = f"runs has the plan {other.hash[:16]} now, not {found.hash[:16]}"
    with pytest.raises(ValueError, match=message):
        pickle.loads(kept)


@pytest.mark.parametrize("name", ["part_size", "parameters", "t"])
def test_a_plan_without_a_field_is_refused(tmp_path, name):
    run_sweep(tmp_path, parts=range(0))
    content = json.loads((tmp_path / "plan.json").read_text())
    del content["plan"][name]
    content["hash"] = sweep_plan.hash_plan(content["plan"])
    (tmp_path / "plan.json").write_text(json.dumps(content))
    with pytest.raises(ValueError, match=f"it is not a plan of a sweep: '{name}'"):
        kr.read_sweep(tmp_path)


READ_ONLY = """
import os, sys
import kreisel as kr, pyarrow.parquet
from sweeps import run_sweep
run_sweep(sys.argv[1], parts=range(1))
os.chmod(sys.argv[1], 0o555)
if os.geteuid() == 0:
    os.setuid(65534)
for place in (sys.argv[1], sys.argv[1] + "/new"):
    try:
        run_sweep(place)
    except OSError as error:
        print(type(error).__name__, error)
"""


def test_a_read_only_folder_raises_permission_error(tmp_path):
    os.chmod(tmp_path, 0o755)
    place = tmp_path / "runs"
    for folder in (tmp_path, *tmp_path.parents[:2]):
        os.chmod(folder, os.stat(folder).st_mode | 0o055)
    with start_python(READ_ONLY, place) as run:
        output, errors = run.communicate()
    os.chmod(place, 0o755)
    assert output.count("PermissionError") == 2, output + errors
    assert list_files(place) == ["part-000000.parquet", "plan.json"]


def test_a_plan_can_be_stored_without_hard_links(tmp_path, monkeypatch):
    def none(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(store.os, "link", none)
    run_sweep(tmp_path / "runs", parts=range(1))
    assert list_files(tmp_path / "runs") == ["part-000000.parquet", "plan.json"]
    (tmp_path / "first").write_text("of another process")
    assert not store._write_file_if_missing(tmp_path / "first", b"late")
    assert (tmp_path / "first").read_text() == "of another process"
    assert list_files(tmp_path) == ["first", "runs"]


def test_the_parent_of_the_folder_must_exist(tmp_path):
    with pytest.raises(FileNotFoundError):
        run_sweep(tmp_path / "none" / "runs")
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        kr.read_sweep(tmp_path / "none")
    with pytest.raises(ValueError, match=r"not a folder of a sweep: it has no plan\.json"):
        kr.read_sweep(tmp_path)


@pytest.mark.parametrize(
    ("error", "message", "words"),
    [
        (TypeError, "tops must be a kreisel.Source", {"tops": TOP}),
        (TypeError, "t is missing", {"t": None}),
        (ValueError, "the same for all tops of a sweep", {"t": np.zeros((12, 25, 2))}),
        (ValueError, "t must be finite", {"t": [np.nan]}),
        (ValueError, "move away from 0", {"t": [2, 1]}),
        (TypeError, "method must be the name", {"method": 3}),
        (ValueError, "unknown method", {"method": "bobenko-suris"}),
        (ValueError, r"top\[0, 0\].*bobenko_suris", {"method": "bobenko_suris", "step": 0.1}),
        (ValueError, "fixed step", {"method": "strang"}),
        (ValueError, "unknown quantity", {"reduce": {"nutatoin": "min"}}),
        (ValueError, "either want", {"want": ["energy"]}),
        (ValueError, "leave out reduce", {"events": [LOW], "method": "taylor"}),
        (ValueError, "part_size must be at least 1", {"part_size": 0}),
        (TypeError, "part_size must be a whole number", {"part_size": 1.5}),
        (TypeError, "parts must be a range", {"parts": [1]}),
        (TypeError, "parts must be a range", {"parts": range(0, 4, 2)}),
        (ValueError, "parts must lie between 0 and 5", {"parts": range(4, 6)}),
        (ValueError, "threads must be at least 1", {"threads": 0}),
        (TypeError, "executor must be", {"executor": 3}),
        (ValueError, "either threads or an executor", {"executor": 3, "threads": 1}),
        (TypeError, "progress", {"progress": 3}),
        (MemoryError, "smaller parts", {"t": np.arange(10**6), "reduce": None, "part_size": 10**9}),
    ],
)
def test_invalid_arguments_raise_before_anything_runs(tmp_path, error, message, words):
    source = kr.Source.grid(TOP, spin=np.linspace(0, 9, 10**5), gravity=np.linspace(-1, 1, 10**4))
    arguments = {
        "tops": source if "part_size" in words and words["part_size"] == 10**9 else SOURCE,
        **REDUCED,
    }
    with pytest.raises(error, match=message):
        kr.sweep(**arguments | words, folder=tmp_path / "runs")
    assert list_files(tmp_path) == []


@pytest.mark.parametrize(
    ("message", "make"),
    [
        ("unknown parameter 'spinn'", lambda: kr.Source.grid(TOP, spinn=[1, 2])),
        ("unknown parameter 'body'", lambda: kr.Source.grid(TOP, body=TOP.body)),
        ("at least one parameter", lambda: kr.Source.grid(TOP, gravity=2.0)),
        ("at least one parameter", lambda: kr.Source.random(TOP, 5, gravity=2.0)),
        ("spin must be finite", lambda: kr.Source.grid(TOP, spin=[1, np.inf])),
        ("spin must be one value or a list", lambda: kr.Source.grid(TOP, spin=[[1, 2]])),
        ("spin must be one value or a list", lambda: kr.Source.grid(TOP, spin=[])),
        ("momentum must be 3 numbers", lambda: kr.Source.grid(TOP, momentum=[1, 2])),
        (
            "more tops than can",
            lambda: kr.Source.grid(
                TOP, **dict.fromkeys(["spin", "tilt", "gravity", "precession"], np.arange(2e4))
            ),
        ),
        (r"a range \(low, high\)", lambda: kr.Source.random(TOP, 5, spin=[2, 1])),
        (r"a range \(low, high\)", lambda: kr.Source.random(TOP, 5, spin=[1, 2, 3])),
        ("gravity must .* finite", lambda: kr.Source.random(TOP, 5, gravity=[-1e308, 1e308])),
        ("attitude has no range", lambda: kr.Source.random(TOP, 5, attitude=[(1, 0, 0, 0)] * 2)),
        ("at least 1", lambda: kr.Source.random(TOP, 0, spin=[1, 2])),
        ("seed must be at least 0", lambda: kr.Source.random(TOP, 1, seed=-1, spin=[1, 2])),
        ("width of at least one", lambda: kr.Source.scatter(TOP, 5)),
        ("width of its deviations", lambda: kr.Source.scatter(TOP, 5, momentum=-1)),
        ("an empty ensemble cannot be swept", lambda: kr.Source.of(MIXED[:0])),
        ("consecutive indices", lambda: SOURCE[::2]),
        ("ends in .parquet or .csv", lambda: kr.Source.columns(TOP, "tops.xlsx")),
    ],
)
def test_invalid_sources_raise(message, make):
    with pytest.raises(ValueError, match=message):
        make()


def test_an_invalid_scene_is_named_with_its_index(tmp_path):
    masses = np.ones(4000)
    masses[2501] = -1.0
    source = kr.Source.grid(TOP, mass=masses)
    with pytest.raises(ValueError, match=r"^top\[2501\]: body: mass must be positive, not -1"):
        run_sweep(tmp_path, REDUCED | {"part_size": 1000}, source)
    assert kr.read_sweep(tmp_path).present == [0, 1]
    masses[0] = -1.0
    with pytest.raises(ValueError, match=r"^top\[0\]: body: mass must be"):
        run_sweep(tmp_path / "none", source=kr.Source.grid(TOP, mass=masses))
    grid = kr.Source.grid(TOP, spin=np.arange(50.0), damping=[(0, 0, 0), (1, 1, 1)])
    for words in ({"method": "strang", "step": 0.1}, {"method": "exact"}):
        with pytest.raises(
            ValueError, match=r"^top\[0, [01]\]: the method '\w+' does not apply to"
        ):
            kr.sweep(grid, 1, **words, folder=tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_an_unsuitable_top_is_named_with_its_index(tmp_path):
    """Check the error message for an invalid top that is found only while the sweep is running."""
    damping = np.zeros((4000, 3))
    damping[2501] = 1.0
    source = kr.Source.grid(TOP, damping=damping)
    assert 2501 not in source._choose_validation_tops()
    with pytest.raises(ValueError, match=r"^top\[2501\]: the method 'strang' does not apply to"):
        kr.sweep(source, 1, "strang", step=0.1, folder=tmp_path, part_size=1000)
    assert kr.read_sweep(tmp_path).present == [0, 1]


def test_starts_beside_a_plan_must_be_finite(tmp_path):
    values = np.ones(100000)
    kr.sweep(kr.Source.grid(TOP, gravity=values), 1, folder=tmp_path, parts=range(0))
    (file,) = tmp_path.glob("starts-*.npy")
    values[7] = np.nan
    other_file = tmp_path / sweep_plan.make_file_name_from_array_hash(values)
    np.save(other_file, values)
    plan = json.loads((tmp_path / "plan.json").read_text().replace(file.name, other_file.name))
    plan["hash"] = sweep_plan.hash_plan(plan["plan"])
    (tmp_path / "plan.json").write_text(json.dumps(plan))
    with pytest.raises(ValueError, match=r"plan\.json: gravity must be finite"):
        kr.read_sweep(tmp_path)


@pytest.mark.parametrize(
    ("message", "text"),
    [
        ("unknown key in a plan: 'tt'", "tt = 1\n" + GRID),
        ("unknown key in a plan: 'threads'", "threads = 1\n" + GRID),
        ("t is missing", GRID.replace("t = 1\n", "")),
        ("needs a scene", GRID.replace("scene = 'thesis'\n", "")),
        ("exactly one of the tables", "t = 1\nscene = 'thesis'\n"),
        ("exactly one of the tables", GRID + "[random]\nn = 4\n"),
        ("unknown parameter 'graviti'", GRID.replace("gravity", "graviti")),
        ("grid must be a table", "t = 1\nscene = 'thesis'\ngrid = 3\n"),
        ("scene must be a table", GRID.replace("'thesis'", "3")),
        (
            r"plan\.toml: there is no file or named scene 'these'; did you mean 'thesis'",
            GRID.replace("thesis", "these"),
        ),
        (
            r"unknown key in \[gravity\]: \'too\'; did you mean \'to\'",
            GRID.replace("[1, 2]", "{ from = 1, too = 2, n = 3 }"),
        ),
        ("gravity has no n", GRID.replace("[1, 2]", "{ from = 1, to = 2 }")),
        ("n of gravity must be at least 1", GRID.replace("[1, 2]", "{ from = 1, to = 2, n = 0 }")),
        ("gravity must be", GRID.replace("[1, 2]", "'many'")),
        (r"\[random\] has no n", GRID.replace("[grid]", "[random]")),
        (r"unknown key in \[scatter\]", GRID.replace("[grid]", "[scatter]\nn = 3\nspin = 3")),
        (r"\[columns\] has no file", "t = 1\nscene = 'thesis'\n[columns]\n"),
        ("unknown event 'loops'", GRID + "[[events]]\nevent = 'loops'\n"),
        ("event loop: .* unexpected .* 'moost'", GRID + "[[events]]\nevent = 'loop'\nmoost = 3\n"),
        ("must be a table", "events = [3]\n" + GRID),
        ("event must be a table", "task = 'section'\nevent = 3\n" + GRID[6:]),
        ("section has no argument 't'", "task = 'section'\n" + GRID),
        ("unknown task 'oly'", "task = 'oly'\n" + GRID),
        ("reduce must be a table", "reduce = 3\n" + GRID),
        ("unknown quantity in reductions", GRID + "[reduce]\nnutatoin = 'min'\n"),
        ("unknown quantity in want", "want = ['nutatoin']\n" + GRID),
        ("Invalid initial character", GRID + "["),
    ],
)
def test_an_invalid_plan_is_named_with_its_file(tmp_path, message, text):
    file = tmp_path / "plan.toml"
    file.write_text(text)
    with pytest.raises((ValueError, TypeError), match=message) as error:
        kr.sweep(file, folder=tmp_path / "runs")
    assert "plan.toml" in str(error.value)
    assert list_files(tmp_path) == ["plan.toml"]


def test_a_plan_in_a_file_excludes_other_arguments(tmp_path):
    (tmp_path / "plan.toml").write_text(GRID)
    for words in (
        {"t": 1},
        {"method": "taylor"},
        {"part_size": 3},
        {"reduce": {"nutation": "min"}},
    ):
        with pytest.raises(
            ValueError, match=r"is a whole plan: give no other arguments than folder"
        ):
            kr.sweep(tmp_path / "plan.toml", **words, folder=tmp_path / "runs")


def test_missing_parts_raise(tmp_path):
    sweep = run_sweep(tmp_path, parts=range(3))
    for call in (lambda: sweep["status"], sweep.to_pandas, sweep.to_arrow, sweep.to_xarray):
        with pytest.raises(ValueError, match="2 of 5 parts are missing: 3, 4; repeating the call"):
            call()
    with pytest.raises(KeyError, match="did you mean 'nutation_max'"):
        sweep["nutation_maxx"]
    with pytest.raises(IndexError, match=r"^part 3 of 5 is missing$"):
        sweep.part(3)
    empty = run_sweep(tmp_path / "none", parts=range(0))
    with pytest.raises(ValueError, match="has no parts yet"):
        empty.units  # noqa: B018  reading the attribute raises
    assert empty.missing == [*range(PARTS)]


def test_a_source_of_tops_needs_an_ensemble():
    with pytest.raises(TypeError, match="tops must be a"):
        kr.Source.of(TOP)
