"""Tests of the division of sweeps into parts."""

import kreisel as kr
import numpy as np
import pytest
from kreisel._sweep import sweep_plan as planned_of
from sweeps import TOP, hash_rows

WORDS = {"t": 0.1, "method": "strang", "step": 0.1}


def sweep_small(folder, n=4, **more):
    source = kr.Source.grid(TOP, gravity=np.linspace(0.0, 1.0, n))
    return kr.sweep(source, folder=folder, **{**WORDS, "part_size": 1, **more})


@pytest.mark.parametrize(
    ("parts", "count"),
    [(range(0), 0), (range(4), 4), (range(3, 4), 1), (range(9, 7), 0), (range(-3, -5), 0)],
)
def test_parts_up_to_the_last_can_be_requested(tmp_path, parts, count):
    assert len(sweep_small(tmp_path, parts=parts).present) == count


@pytest.mark.parametrize(
    ("parts", "message"),
    [(range(-1, 2), "-1 to 2"), (range(3, 5), "3 to 5"), (range(5, 9), "5 to 9")],
)
def test_parts_outside_the_plan_raise(tmp_path, parts, message):
    with pytest.raises(ValueError, match=f"^parts must lie between 0 and 4, not {message}$"):
        sweep_small(tmp_path, parts=parts)
    with pytest.raises(TypeError, match="parts must be a range of numbers"):
        sweep_small(tmp_path, parts=range(3, 0, -1))


@pytest.mark.parametrize(
    ("n", "message"),
    [
        (9, r"^8 of 9 parts are missing: 1, 2, 3, 4, 5, 6, 7, 8; repeating the call"),
        (10, r"^9 of 10 parts are missing: 1, 2, 3, 4, 5, 6, 7, 8, \.\.\.; repeating the call"),
    ],
)
def test_the_error_lists_the_first_eight_missing_parts(tmp_path, n, message):
    with pytest.raises(ValueError, match=message):
        sweep_small(tmp_path, n, parts=range(1))["status"]


def test_a_part_is_read_by_its_number(tmp_path):
    sweep = sweep_small(tmp_path, parts=range(1, 2))
    assert sweep.part(1)["top"].tolist() == [1] and list(sweep.part(1)) == list(sweep.columns)
    for i in (0, 2):
        with pytest.raises(IndexError, match=f"^part {i} of 4 is missing$"):
            sweep.part(i)
    with pytest.raises(IndexError, match=r"^there is no part 4: the sweep has 4 parts$"):
        sweep.part(4)
    with pytest.raises(ValueError, match="the number of a part must be at least 0"):
        sweep.part(-1)
    assert sweep.verify() == {"done": [1], "missing": [0, 2, 3]} and sweep.check() is sweep


def test_columns_are_read_only(tmp_path):
    with pytest.raises(ValueError, match="read-only"):
        sweep_small(tmp_path)["status"][0] = 3


def test_missing_tops_are_empty_in_a_dataset(tmp_path):
    sweep_small(tmp_path, parts=range(1, 3))
    grid = kr.read_sweep(tmp_path, partial=True).to_xarray()
    assert grid["steps"].values.tolist() == [-1, 1, 1, -1]
    assert grid["status"].values.tolist() == [-1, 0, 0, -1]
    assert np.isnan(grid["m_x"].values[:, 0]).tolist() == [True, False, False, True]
    assert grid["gravity"].values.tolist() == np.linspace(0, 1, 4).tolist()
    assert grid["time"].units == "T" and "top" not in grid and "t" not in grid


def test_missing_tops_are_not_chaotic_in_a_dataset(tmp_path):
    tops = kr.Source.grid(TOP, spin=np.linspace(0.0, 3.0, 4))
    kr.sweep(tops, 5.0, folder=tmp_path, task="lyapunov", part_size=1, parts=range(1, 3))
    grid = kr.read_sweep(tmp_path, partial=True).to_xarray()
    assert grid["status"].values.tolist() == [-1, 0, 0, -1]
    assert np.isnan(grid["lyapunov"].values).tolist() == [True, False, False, True]
    for name in "is_chaotic", "is_doubtful":
        assert grid[name].dtype == bool and not grid[name].values[[0, 3]].any()


@pytest.mark.parametrize("size", [0, 2, None, -1])
def test_a_truncated_part_is_computed_again_with_a_warning(tmp_path, size):
    sweep_small(tmp_path)
    before = hash_rows(tmp_path)
    file = tmp_path / "part-000002.parquet"
    data = file.read_bytes()
    file.write_bytes(b"PAR1" if size is None else data[:size])
    sweep = kr.read_sweep(tmp_path)
    assert sweep.verify() == {"done": [0, 1, 3], "damaged": [2]}
    with pytest.raises(ValueError, match=r"part-000002\.parquet is damaged; repeating the call"):
        sweep.check()
    with pytest.warns(UserWarning, match=r": part 2 computed again, damaged$"):
        sweep_small(tmp_path)
    assert file.read_bytes() == data and hash_rows(tmp_path) == before


def test_a_part_that_exceeds_the_memory_is_refused(tmp_path, monkeypatch):
    source = kr.Source.grid(TOP, gravity=np.linspace(0.0, 1.0, 40))
    words = {
        "folder": tmp_path,
        "part_size": 25,
        "reduce": {"nutation": ("min", "max")},
        "t": [1.0, 2.0],
    }
    monkeypatch.setattr(planned_of, "get_total_memory", lambda: 25 * (64 + 16))
    kr.sweep(source, **words, parts=range(0))
    for room, part, need in ((25 * 80 - 1, 25, "2e-06"), (3199, 10**9, "3.2e-06")):
        monkeypatch.setattr(planned_of, "get_total_memory", lambda room=room: room)
        message = f"^a part of {part} tops with 2 states each needs {need} GB, more"
        with pytest.raises(MemoryError, match=message):
            kr.sweep(source, **words | {"part_size": part})


def test_progress_ends_with_one(tmp_path):
    shares = []
    sweep_small(tmp_path, progress=shares.append)
    assert shares[-1] == 1.0 and all(0.0 <= share <= 1.0 for share in shares)
    assert shares == sorted(shares)
