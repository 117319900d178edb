"""Tests of the folder of a sweep: damaged, foreign and missing parts, and what is refused."""

import hashlib
import os
import pickle
import random
import shutil
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
from ensembles import MIXED
from sweeps import LOW, PARTS, REDUCED, SOURCE, TOP, flip_bit, fork, run_sweep
from toolbox import python

GRAVITIES = np.linspace(-1, 1, 5).tolist()
SEAL = b"kreisel-sha256:"
WATCHED = {"t": [0.5, 4.0], "method": "taylor", "events": [LOW], "part_size": 7}


def part_file(folder, i):
    return folder / f"part-{i:06}.parquet"


def list_files(folder):
    return sorted(each.name for each in folder.iterdir())


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    """Return the contents of the files of a complete sweep."""
    folder = tmp_path_factory.mktemp("complete")
    run_sweep(folder)
    return {file.name: file.read_bytes() for file in folder.iterdir()}


@pytest.fixture
def folder(tmp_path, complete):
    """Return a folder with a copy of a complete sweep."""
    for name, data in complete.items():
        (tmp_path / name).write_bytes(data)
    return tmp_path


# Parts


def test_parts_up_to_the_last_can_be_requested(tmp_path):
    for parts in (range(0), range(4, 5), range(9, 7), range(1, 3)):
        run_sweep(tmp_path, parts=parts)
    sweep = kr.read_sweep(tmp_path)
    assert sweep.present == [1, 2, 4] and sweep.missing == [0, 3]
    assert repr(sweep) == "<kreisel.SweepResult of shape (6, 5): 3 of 5 parts>"
    assert sweep.part(1)["top"].tolist() == [*range(7, 14)]
    assert list(sweep.part(1)) == list(sweep.columns) and [len(p["top"]) for p in sweep] == [
        7,
        7,
        2,
    ]
    for call in (lambda: sweep["status"], sweep.to_pandas, sweep.to_arrow, sweep.to_xarray):
        with pytest.raises(ValueError, match="2 of 5 parts are missing: 0, 3"):
            call()


@pytest.mark.parametrize("words", [REDUCED, {"t": 5.0, "task": "lyapunov", "part_size": 7}])
def test_a_partial_sweep_has_the_rows_of_its_parts(tmp_path, words):
    whole = run_sweep(tmp_path / "whole", words).to_xarray()
    run_sweep(tmp_path / "half", words, parts=range(1, 3))
    sweep = kr.read_sweep(tmp_path / "half", partial=True)
    assert sweep["top"].tolist() == [*range(7, 21)]
    grid, is_present = sweep.to_xarray(), np.zeros(30, bool)
    is_present[7:21] = True
    assert len(sweep.to_pandas()) % 14 == 0 and grid["gravity"].values.tolist() == GRAVITIES
    for name in [name for name in ("status", *grid) if "time" not in grid[name].dims]:
        values, all_values = grid[name].values.ravel(), whole[name].values.ravel()
        assert values[is_present].tobytes() == all_values[is_present].tobytes(), name
        empties = {"f": np.isnan, "b": np.logical_not, "U": lambda v: v == ""}
        empty = empties.get(values.dtype.kind, lambda v: v == -1)
        assert empty(values[~is_present]).all(), name


def test_a_part_depends_only_on_the_plan_and_its_number(tmp_path, complete):
    run_sweep(tmp_path, parts=range(4, 5), threads=1)
    assert part_file(tmp_path, 4).read_bytes() == complete["part-000004.parquet"]


def test_sweeps_can_be_copied_and_are_read_only(folder):
    sweep = kr.read_sweep(folder)
    again = pickle.loads(pickle.dumps(sweep))
    assert again.present == sweep.present and again.hash == sweep.hash
    with pytest.raises(ValueError, match="read-only"):
        sweep["status"][0] = 3
    with pytest.raises(AttributeError, match="read-only"):
        sweep.folder = "x"
    with pytest.raises(AttributeError, match=r"new kreisel\.Source"):
        SOURCE.scene = TOP


# Damaged parts


def test_changed_bits_and_truncated_files_are_detected(tmp_path):
    sweep = run_sweep(tmp_path, WATCHED)
    file = part_file(tmp_path, 1)
    data, right = file.read_bytes(), sweep.part(1)
    chance = random.Random(1)
    seal = 8 * data.rindex(b"kreisel-sha256:")
    bits = [0, 31, 8 * len(data) - 1, *chance.sample(range(seal, seal + 8 * 79), 20)]
    changed = [flip_bit(data, i) for i in [*bits, *chance.sample(range(8 * len(data)), 60)]]
    changed += [data[:size] for size in (0, 4, len(data) - 1, *chance.sample(range(len(data)), 20))]
    changed += [data + b"x", data.replace(b"kreisel-sha256:", b"?" * 15), b"PAR1", b"PAR1PAR1"]
    for content in changed:
        file.write_bytes(content)
        assert sweep.verify() == {"done": [0, 2, 3, 4], "damaged": [1]}
        try:
            part = sweep.part(1)
        except ValueError as error:
            assert "part-000001" in str(error) and "repeating the call" in str(error)
        else:  # the damaged bit belongs to metadata
            for name in right.keys() & part.keys():
                has_nan = right[name].dtype.kind == "f"
                assert np.array_equal(part[name], right[name], equal_nan=has_nan)


def test_damaged_parts_are_computed_again_with_a_warning(folder, complete):
    part_file(folder, 0).write_bytes(complete["part-000000.parquet"][:1000])
    part_file(folder, 1).write_bytes(flip_bit(complete["part-000001.parquet"], 8000))
    part_file(folder, 3).unlink()
    sweep = kr.read_sweep(folder)
    assert sweep.verify() == {"done": [2, 4], "damaged": [0, 1], "missing": [3]}
    with pytest.raises(ValueError, match=r"part-000000.* is damaged"):
        sweep.check()
    partial = kr.read_sweep(folder, partial=True)
    assert partial.present == [2, 4] and partial.missing == [0, 1, 3]
    assert partial["top"].tolist() == [*range(14, 21), 28, 29]
    with pytest.warns(UserWarning, match="part 0 and 1 more computed again, damaged"):
        run_sweep(folder)
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == complete
    assert sweep.check() is sweep


def make_old(folder):
    """Let a part, with the right checksum, be of another version."""
    file, version = part_file(folder, 2), kr.__version__.encode()
    data = file.read_bytes().replace(b'"version": "' + version, b'"version": "x' + version[1:])
    write_sealed(file, data)


def swap_parts(folder):
    part_file(folder, 2).write_bytes(part_file(folder, 1).read_bytes())


@pytest.mark.parametrize(
    "change, status", [(make_old, "of another version"), (swap_parts, "damaged")]
)
def test_swapped_and_old_parts_are_computed_again(folder, complete, change, status):
    change(folder)
    sweep = kr.read_sweep(folder)
    assert sweep.verify() == {"done": [0, 1, 3, 4], status: [2]}
    if change == swap_parts:
        for load in (lambda: sweep["nutation_max"], sweep.check, sweep.to_xarray):
            with pytest.raises(ValueError, match="part-000002"):
                load()
    with pytest.warns(UserWarning, match=f"part 2 computed again, {status}"):
        run_sweep(folder)
    assert part_file(folder, 2).read_bytes() == complete["part-000002.parquet"]


# Files of something else


def test_a_folder_of_something_else_stays_untouched(tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    for place in (tmp_path, tmp_path / "thesis.tex"):
        with pytest.raises(FileExistsError, match="thesis"):
            run_sweep(place)
    assert list_files(tmp_path) == ["thesis.tex"]


@pytest.mark.parametrize(
    "text", ["", "{}", "[1]", "no JSON", '{"kreisel": 1}', "\xff", '{"plan": ' * 99999, None]
)
def test_a_file_other_than_a_plan_stays_untouched(tmp_path, text):
    file = tmp_path / "plan.json"
    if text is None:  # a plan that was changed
        run_sweep(tmp_path, parts=range(0))
        text = file.read_text().replace('"part_size": 7', '"part_size": 32')
    file.write_text(text, encoding="latin-1")
    for call in (run_sweep, kr.read_sweep):
        with pytest.raises(ValueError, match=r"plan\.json is (not a plan|damaged)"):
            call(tmp_path)
    assert file.read_text(encoding="latin-1") == text


def test_a_pickled_result_refuses_a_folder_that_has_another_plan_now(tmp_path):
    tops = kr.scenes.thesis.vary(gravity=[1.0, 2.0])
    data = pickle.dumps(kr.sweep(tops, 1.0, folder=tmp_path))
    shutil.rmtree(tmp_path)
    kr.sweep(tops, 2.0, folder=tmp_path)
    with pytest.raises(ValueError, match=r"has the plan \w+ now, not"):
        pickle.loads(data)["status"]


def test_another_plan_is_refused_with_the_differences(tmp_path):
    run_sweep(tmp_path, parts=range(1))
    before = {name: (tmp_path / name).read_bytes() for name in list_files(tmp_path)}
    with pytest.raises(ValueError, match="another plan") as error:
        run_sweep(tmp_path, tol=1e-9, part_size=32)
    assert "part_size: 7 there, 32 here" in str(error.value) and "1e-09" in str(error.value)
    for source in (kr.Source.grid(TOP, spin=[0, 1], gravity=[1, 2]), kr.Source.of(SOURCE[:])):
        with pytest.raises(ValueError, match="another plan"):
            run_sweep(tmp_path, source=source)
    assert before == {name: (tmp_path / name).read_bytes() for name in list_files(tmp_path)}


def write_sealed(file, data):
    """Write a file with the checksum that a part has: of the file with zeros in its place."""
    begin = data.rindex(SEAL) + len(SEAL)
    blank = data[:begin] + b"0" * 64 + data[begin + 64 :]
    digest = hashlib.sha256(blank).hexdigest().encode()
    file.write_bytes(data[:begin] + digest + data[begin + 64 :])


def put_part_of_another_plan(file):
    run_sweep(file.parent.with_name("other"), tol=1e-9, parts=range(1))
    shutil.copy(part_file(file.parent.with_name("other"), 0), file)


PRECIOUS = {
    "a folder": Path.mkdir,
    "a part of another plan": put_part_of_another_plan,
    "no Parquet, but sealed": lambda file: write_sealed(file, SEAL + b"0" * 64),
}


@pytest.mark.parametrize("put", PRECIOUS.values(), ids=PRECIOUS)
def test_what_has_the_name_of_a_part_but_is_precious_stays_untouched(tmp_path, put):
    folder = tmp_path / "runs"
    run_sweep(folder, parts=range(0))
    put(part_file(folder, 0))
    data = None if part_file(folder, 0).is_dir() else part_file(folder, 0).read_bytes()
    sweep = kr.read_sweep(folder)
    assert sweep.verify() == {"done": [], "foreign": [0], "missing": [1, 2, 3, 4]}
    for call in (lambda: run_sweep(folder), sweep.check):
        with pytest.raises(FileExistsError, match=r"part-000000.*move or delete it"):
            call()
    with pytest.raises(ValueError, match="part-000000"):
        sweep.part(0)
    assert kr.read_sweep(folder, partial=True).present == []
    assert list_files(folder) == ["part-000000.parquet", "plan.json"]
    assert data is None or part_file(folder, 0).read_bytes() == data


def test_a_read_only_folder_raises_permission_error(tmp_path):
    place = tmp_path / "runs"
    run_sweep(place, parts=range(1))

    def sweep_as_nobody(folder):
        if os.geteuid() == 0:
            os.setuid(65534)
        with pytest.raises(PermissionError):
            run_sweep(folder)

    for folder in (tmp_path, *tmp_path.parents[:2]):
        os.chmod(folder, os.stat(folder).st_mode | 0o055)
    place.chmod(0o555)
    for folder in (place, place / "new"):
        assert fork(lambda folder=folder: sweep_as_nobody(folder)) == 0
    place.chmod(0o755)
    assert list_files(place) == ["part-000000.parquet", "plan.json"]


def test_a_plan_can_be_stored_without_hard_links(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", refuse)
    monkeypatch.delattr(os, "O_TMPFILE", raising=False)  # such file systems lack both
    run_sweep(tmp_path / "runs", parts=range(1))
    assert list_files(tmp_path / "runs") == ["part-000000.parquet", "plan.json"]


# Refusals


CHAOS, SECTION = {"task": "oli", "t": 1}, {"task": "section"}
GRID = "t = 1\nscene = 'thesis'\n[grid]\ngravity = [1, 2]\n"
PLANS = [  # invalid plans in a file
    ("'tt'", "tt = 1\n" + GRID),
    ("t is missing", GRID.replace("t = 1\n", "")),
    ("scene", GRID.replace("scene = 'thesis'\n", "")),
    ("did you mean 'thesis'", GRID.replace("thesis", "these")),
    ("exactly one", "t = 1\nscene = 'thesis'\n"),
    ("grid and random", GRID + "[random]\nn = 4\n"),
    ("did you mean 'to'", GRID.replace("[1, 2]", "{ from = 1, too = 2, n = 3 }")),
    ("has no n", GRID.replace("[1, 2]", "{ from = 1, to = 2 }")),
    ("'spin'", GRID.replace("[grid]", "[scatter]\nn = 3\nspin = 3")),
    ("has no file", "t = 1\nscene = 'thesis'\n[columns]\n"),
    ("'loops'", GRID + "[[events]]\nevent = 'loops'\n"),
    ("'moost'", GRID + "[[events]]\nevent = 'loop'\nmoost = 3\n"),
    ("tables", GRID + "[events]\nevent = 'loop'\n"),
    ("table", "task = 'section'\nevent = 3\n" + GRID[6:]),
    ("reduce", "reduce = 3\n" + GRID),
    ("character", GRID + "["),
]


@pytest.mark.parametrize(("word", "text"), PLANS)
def test_an_invalid_plan_is_named_with_its_file(tmp_path, word, text):
    (tmp_path / "plan.toml").write_text(text)
    with pytest.raises((ValueError, TypeError), match=word) as error:
        kr.sweep(tmp_path / "plan.toml", folder=tmp_path / "runs")
    assert "plan.toml" in str(error.value) and list_files(tmp_path) == ["plan.toml"]


def test_an_invalid_top_is_named_with_its_index(tmp_path):
    masses, damping = np.ones(4000), np.zeros((4000, 3))
    masses[2501], damping[2501] = -1.0, 1.0
    words = {"t": 1, "method": "strang", "step": 0.1, "part_size": 1000}
    for name, values, word in (("mass", masses, "mass"), ("damping", damping, "'strang'")):
        with pytest.raises(ValueError, match=rf"^top\[2501\]: .*{word}"):
            run_sweep(tmp_path / name, words, kr.Source.grid(TOP, **{name: values}))
        assert kr.read_sweep(tmp_path / name).present == [0, 1]
    grid = kr.Source.grid(TOP, spin=np.arange(50.0), damping=[(0, 0, 0), (1, 1, 1)])
    for more, word in (({"method": "exact"}, r"top\[0, [01]\]: .*'exact'"), (CHAOS, "damped")):
        with pytest.raises(ValueError, match=word):
            run_sweep(tmp_path / "none", {"t": 1, **more}, grid)
    assert not (tmp_path / "none").exists()


COLUMNS = [  # the text of a file of columns, and a word of the error
    ("gravty\n1\n", "did you mean 'gravity'"),
    ("momentum_x,gravity\n1,1\n", "missing: momentum_y, momentum_z"),
    (
        ",".join(f"inertia_{i}" for i in range(10) if i != 8) + "\n1" + 8 * ",1",
        "missing: inertia_8",
    ),
    ("gravity,spin\n1,\n2,3\n", "missing values"),
    ("gravity\n1\ninf\n", "finite"),
    ("gravity\n", "numbers"),
    ("spin [deg]\n1\n", "must be in rad/T"),
    ("spin,tilt,spin\n1,2,3\n", "several"),
    ("", "cannot be read"),
]


@pytest.mark.parametrize("text, word", COLUMNS)
def test_invalid_columns_are_refused(tmp_path, text, word):
    (tmp_path / "tops.csv").write_text(text)
    with pytest.raises((ValueError, TypeError), match=word):
        kr.Source.columns(TOP, tmp_path / "tops.csv")


def test_missing_folders_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError):
        run_sweep(tmp_path / "none" / "runs")
    with pytest.raises(FileNotFoundError, match="no folder"):
        kr.read_sweep(tmp_path / "none")
    with pytest.raises(ValueError, match=r"no plan\.json"):
        kr.read_sweep(tmp_path)


def test_without_pyarrow_the_error_names_the_extra_and_nothing_is_written(tmp_path):
    code = """
import sys
sys.modules["pyarrow"] = None
import kreisel as kr
tops = kr.Source.grid(kr.scenes.thesis, gravity=[1.0, 2.0])
for call in (
    lambda: kr.sweep(tops, 1.0, folder=sys.argv[1] + "/new"),
    lambda: kr.read_sweep(sys.argv[1]),
    lambda: kr.Source.columns(kr.scenes.thesis, "tops.parquet"),
):
    try:
        call()
    except ModuleNotFoundError as error:
        print(error)
"""
    run_sweep(tmp_path, parts=range(0))
    result = python(code, str(tmp_path))
    assert result.stdout.count("pip install 'kreisel[sweep]'") == 3, result.stderr
    assert not (tmp_path / "new").exists()


MANY = kr.Source.grid(TOP, spin=np.linspace(0, 9, 10**5), gravity=np.linspace(-1, 1, 10**4))
RANDOM = {"scene": TOP, "n": 5, "spin": (1, 2)}
GRAVITY = {"scene": TOP, "gravity": [1, 2]}
LONG = dict.fromkeys(["spin", "tilt", "gravity", "precession"], np.arange(2e4))


def sweep(**words):
    """Sweep in a folder that must not be created."""
    folder = Path("new")
    try:
        return kr.sweep(words.pop("scene", SOURCE), folder=folder, **words)
    finally:
        assert not folder.exists()


REFUSALS = [  # function, valid arguments, name, bad value, exception, word
    (sweep, {"t": 1}, "scene", TOP.body, TypeError, "scene"),
    (sweep, REDUCED, "t", None, TypeError, "t is missing"),
    (sweep, REDUCED, "t", np.zeros((6, 5, 2)), ValueError, "the same for all tops"),
    (sweep, REDUCED, "t", [2, 1], ValueError, "away from 0"),
    (sweep, REDUCED, "method", 3, TypeError, "method"),
    (sweep, REDUCED, "method", "strang", ValueError, "fixed step"),
    (sweep, REDUCED | {"step": 0.1}, "method", "bobenko_suris", ValueError, r"top\[0, 0\]"),
    (sweep, REDUCED, "reduce", {"nutatoin": "min"}, ValueError, "unknown quantity"),
    (sweep, REDUCED, "want", ["energy"], ValueError, "either want"),
    (sweep, REDUCED | {"method": "taylor"}, "events", [LOW], ValueError, "reduce"),
    (sweep, REDUCED, "part_size", 0, ValueError, "part_size"),
    (sweep, {"t": [1.0] * 10**6, "scene": MANY}, "part_size", 10**9, MemoryError, "smaller parts"),
    (sweep, REDUCED, "parts", range(0, 4, 2), TypeError, "range"),
    (sweep, REDUCED, "parts", range(4, 6), ValueError, "between 0 and 5"),
    (sweep, REDUCED, "executor", 3, TypeError, "executor"),
    (sweep, REDUCED, "progress", 3, TypeError, "progress"),
    (sweep, {"t": 1}, "max_wait", 3.0, ValueError, "max_wait"),
    (sweep, {"t": 1}, "task", "lyapunow", ValueError, "did you mean 'lyapunov'"),
    (sweep, CHAOS, "t", 0, ValueError, "0"),
    (sweep, CHAOS, "reduce", {"spin": "min"}, ValueError, "reduce"),
    (sweep, CHAOS, "direction", [1, 2], ValueError, "six"),
    (sweep, SECTION, "t", 1, ValueError, "'t'"),
    (sweep, SECTION, "n", 0, ValueError, "n must"),
    (sweep, SECTION, "n", 10**12, MemoryError, "smaller parts"),
    (sweep, SECTION, "max_wait", [1.0], ValueError, "max_wait"),
    (sweep, SECTION, "max_wait", 0, ValueError, "zero"),
    (sweep, SECTION, "event", 3, TypeError, "event"),
    (sweep, SECTION, "event", kr.events.loop(max_count=3), ValueError, "max_count"),
    (kr.Source.grid, GRAVITY, "spinn", [1, 2], ValueError, "'spinn'"),
    (kr.Source.grid, GRAVITY, "gravity", 2.0, ValueError, "at least one parameter"),
    (kr.Source.grid, GRAVITY, "spin", [[1, 2]], ValueError, "spin"),
    (kr.Source.grid, GRAVITY, "momentum", [1, 2], ValueError, "3 numbers"),
    (kr.Source.grid, LONG, "scene", TOP, ValueError, "more tops"),
    (kr.Source.random, RANDOM, "spin", 2.0, ValueError, "at least one parameter"),
    (kr.Source.random, RANDOM, "spin", [2, 1], ValueError, "range"),
    (kr.Source.random, RANDOM, "gravity", [-1e308, 1e308], ValueError, "finite"),
    (kr.Source.random, RANDOM, "attitude", [(1, 0, 0, 0)] * 2, ValueError, "no range"),
    (kr.Source.random, RANDOM, "n", 0, ValueError, "n must"),
    (kr.Source.scatter, {"scene": TOP, "n": 5}, "momentum", None, ValueError, "at least one"),
    (kr.Source.scatter, {"scene": TOP, "n": 5}, "momentum", -1, ValueError, "width"),
    (kr.Source.of, {}, "scene", MIXED[:0], ValueError, "empty"),
    (kr.Source.columns, {"scene": TOP}, "file", "tops.xlsx", ValueError, "csv"),
    (SOURCE.__getitem__, {}, "key", slice(None, None, 2), ValueError, "consecutive"),
    (SOURCE.__getitem__, {}, "key", 30, IndexError, "30"),
]


@pytest.mark.parametrize(("call", "words", "name", "value", "error", "word"), REFUSALS)
def test_bad_arguments_are_refused(tmp_path, monkeypatch, call, words, name, value, error, word):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(error, match=word):
        call(**words | {name: value})


def test_what_a_sweep_does_not_have_is_refused(tmp_path):
    found = run_sweep(tmp_path / "runs", parts=range(2))
    for i, error, word in ((3, IndexError, "missing"), (5, IndexError, "5"), (-1, ValueError, "0")):
        with pytest.raises(error, match=word):
            found.part(i)
    with pytest.raises(KeyError, match="did you mean 'nutation_max'"):
        found["nutation_maxx"]
    empty = run_sweep(tmp_path / "none", parts=range(0))
    assert empty.missing == [*range(PARTS)]
    with pytest.raises(ValueError, match="no parts yet"):
        empty.columns  # noqa: B018
