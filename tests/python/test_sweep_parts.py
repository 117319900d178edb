"""Parts of a sweep: requests for some of them, their files, and what they hold."""

import kreisel as kr
import numpy as np
import pytest
from kreisel._sweep import store as folder_of
from kreisel._sweep import sweep_plan as planned_of
from sweeps import TOP, rows_hash

WORDS = {"t": 0.1, "method": "strang", "step": 0.1}


def made(to, n=4, **more):
    source = kr.Source.grid(TOP, gravity=np.linspace(0.0, 1.0, n))
    return kr.sweep(source, to=to, **{**WORDS, "part": 1, **more})


@pytest.mark.parametrize(
    ("parts", "done"),
    [(range(0), 0), (range(4), 4), (range(3, 4), 1), (range(9, 7), 0), (range(-3, -5), 0)],
)
def test_parts_up_to_the_last_may_be_asked_for(tmp_path, parts, done):
    assert len(made(tmp_path, parts=parts).done) == done


@pytest.mark.parametrize(
    ("parts", "said"),
    [(range(-1, 2), "-1 to 2"), (range(3, 5), "3 to 5"), (range(5, 9), "5 to 9")],
)
def test_other_parts_are_refused(tmp_path, parts, said):
    with pytest.raises(ValueError, match=f"^parts must be among 0 to 4, not {said}$"):
        made(tmp_path, parts=parts)
    with pytest.raises(TypeError, match="parts must be a range of numbers"):
        made(tmp_path, parts=range(3, 0, -1))


@pytest.mark.parametrize(
    ("n", "said"),
    [
        (9, r"^8 of 9 parts are missing: 1, 2, 3, 4, 5, 6, 7, 8; the same call"),
        (10, r"^9 of 10 parts are missing: 1, 2, 3, 4, 5, 6, 7, 8, \.\.\.; the same call"),
    ],
)
def test_of_parts_that_are_missing_the_first_eight_are_told(tmp_path, n, said):
    with pytest.raises(ValueError, match=said):
        made(tmp_path, n, parts=range(1))["status"]


def test_a_part_has_a_number_that_is_there(tmp_path):
    found = made(tmp_path, parts=range(1, 2))
    assert found.part(1)["top"].tolist() == [1] and list(found.part(1)) == list(found.columns)
    for i in (0, 2, 4):
        with pytest.raises(IndexError, match=f"^part {i} is not there: there are 1 parts$"):
            found.part(i)
    with pytest.raises(ValueError, match="the number of a part must be at least 0"):
        found.part(-1)
    assert found.look() == {"done": [1], "missing": [0, 2, 3]} and found.check() is found


def test_columns_are_not_written_to(tmp_path):
    with pytest.raises(ValueError, match="read-only"):
        made(tmp_path)["status"][0] = 3


def test_tops_that_are_missing_have_nothing_in_a_grid(tmp_path):
    made(tmp_path, parts=range(1, 3))
    grid = kr.read_sweep(tmp_path, partial=True).to_xarray()
    assert grid["steps"].values.tolist() == [-1, 1, 1, -1]
    assert grid["status"].values.tolist() == [-1, 0, 0, -1]
    assert np.isnan(grid["m_x"].values[:, 0]).tolist() == [True, False, False, True]
    assert grid["gravity"].values.tolist() == np.linspace(0, 1, 4).tolist()
    assert grid["time"].units == "T" and "top" not in grid and "t" not in grid


@pytest.mark.parametrize("form", ["parquet", "npy"])
@pytest.mark.parametrize("size", [0, 2, None, -1])
def test_of_a_part_that_is_hardly_begun_one_made_anew_is_told(tmp_path, monkeypatch, form, size):
    monkeypatch.setattr(folder_of, "_best_form", lambda: form)
    made(tmp_path)
    before = rows_hash(tmp_path)
    file = tmp_path / f"part-000002.{form}"
    data = file.read_bytes()
    magic = {"parquet": b"PAR1", "npy": b"\x93NUMPY"}[form]
    file.write_bytes(magic if size is None else data[:size])
    found = kr.read_sweep(tmp_path)
    assert found.look() == {"done": [0, 1, 3], "damaged": [2]}
    with pytest.raises(ValueError, match=f"part-000002.{form} is damaged; the same call"):
        found.check()
    with pytest.warns(UserWarning, match=r": part 2 made anew, damaged$"):
        made(tmp_path)
    assert file.read_bytes() == data and rows_hash(tmp_path) == before


def test_a_part_may_need_all_of_the_memory_and_not_more(tmp_path, monkeypatch):
    source = kr.Source.grid(TOP, gravity=np.linspace(0.0, 1.0, 40))
    words = {"to": tmp_path, "part": 25, "reduce": {"nutation": ("min", "max")}, "t": [1.0, 2.0]}
    monkeypatch.setattr(planned_of, "total_memory", lambda: 25 * (64 + 16))
    kr.sweep(source, **words, parts=range(0))
    for room, part, need in ((25 * 80 - 1, 25, "2e-06"), (3199, 10**9, "3.2e-06")):
        monkeypatch.setattr(planned_of, "total_memory", lambda room=room: room)
        said = f"^a part of {part} tops with 2 states each needs {need} GB, more"
        with pytest.raises(MemoryError, match=said):
            kr.sweep(source, **words | {"part": part})


def test_progress_ends_at_1(tmp_path):
    shares = []
    made(tmp_path, progress=shares.append)
    assert shares[-1] == 1.0 and all(0.0 <= share <= 1.0 for share in shares)
    assert shares == sorted(shares)
