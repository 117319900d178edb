"""Sweeps on the edge of what they take: the last part that may be asked for, the longest list of
what is missing, files that are hardly begun."""

import kreisel as kr
import numpy as np
import pytest
from kreisel._sweeping import folder as folder_of
from kreisel._sweeping import planned as planned_of
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
    monkeypatch.setattr(planned_of, "memory", lambda: 25 * (64 + 16))
    kr.sweep(source, **words, parts=range(0))
    for room, part, need in ((25 * 80 - 1, 25, "2e-06"), (3199, 10**9, "3.2e-06")):
        monkeypatch.setattr(planned_of, "memory", lambda room=room: room)
        said = f"^a part of {part} tops with 2 states each needs {need} GB, more"
        with pytest.raises(MemoryError, match=said):
            kr.sweep(source, **words | {"part": part})


def test_progress_ends_at_1(tmp_path):
    shares = []
    made(tmp_path, progress=shares.append)
    assert shares[-1] == 1.0 and all(0.0 <= share <= 1.0 for share in shares)
    assert shares == sorted(shares)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("t must be a number or a list of times", {"t": [[1.0, 2.0]]}),
        ("wait must be a number, which all", {"t": None, "verb": "section", "wait": [1.0]}),
        ("solve has no word 'wait': it has t, method, step, ", {"t": 1, "wait": 3.0}),
    ],
)
def test_words_are_for_all_tops(tmp_path, said, words):
    source = kr.Source.grid(TOP, gravity=[0.5])
    with pytest.raises(ValueError, match=said):
        kr.sweep(source, to=tmp_path, **words)


def test_words_left_out_are_those_given_as_they_are(tmp_path):
    source = kr.Source.grid(TOP, gravity=[0.5, 1.0], steady=False, fast=False, degrees=False)
    plain = kr.Source.grid(TOP, gravity=[0.5, 1.0])
    one = kr.sweep(plain, 1, to=tmp_path, parts=range(0))
    again = kr.sweep(source, 1.0, "auto", to=tmp_path, max_steps=0, parts=range(0))
    assert one.hash == again.hash and one.plan["flags"] == {}
    kr.sweep(plain, 1, "auto", to=tmp_path / "oli", verb="oli", max_steps=0, parts=range(0))
    words = {"want": iter(["energy", "apex"]), "parts": range(1)}
    wanted = kr.sweep(plain, 1, to=tmp_path / "want", **words)
    assert wanted["energy"].shape == (2, 2) and wanted.plan["solve"]["want"] == ["energy", "apex"]


def test_a_source_has_so_many_tops():
    source = kr.Source.grid(TOP, gravity=[0.5, 1.0, 1.5])
    assert source[-3] == source[0] and source[2].gravity == 1.5
    for i in (3, -4):
        with pytest.raises(IndexError, match=f"^there is no top {i} among 3$"):
            source[i]
    random = kr.Source.random(TOP, 3, gravity=(0, 1))
    assert source[2:1].size == 0 and random[2:1].size == 0 and random[3:].size == 0
    many = dict.fromkeys(["gravity", "tilt"], np.zeros(2**18))
    with pytest.raises(ValueError, match="more tops than can be counted"):
        kr.Source.grid(TOP, **many, spin=np.zeros(2**17))
    assert kr.Source.grid(TOP, **many, spin=np.zeros(2**17 - 1)).size == 2**53 - 2**36


@pytest.mark.parametrize("name", ["attitude", "attitude_xyzw", "inertia"])
def test_what_is_not_drawn_may_be_given(name):
    value = [1, 0, 0, 0] if name[0] == "a" else [2, 3, 4]
    assert kr.Source.random(TOP, 2, gravity=(0, 1), **{name: value})[:].size == 2
    with pytest.raises(ValueError, match=f"^{name} has no range: give one value, or make"):
        kr.Source.random(TOP, 2, **{name: [value, value]})


def test_columns_have_the_flags_that_are_given(tmp_path):
    np.savez(tmp_path / "tops.npz", spin=[20.0, 30.0], tilt=[0.1, 0.2])
    scene, (spin, tilt) = kr.scenes.sleeping, ([20.0, 30.0], [0.1, 0.2])
    (tmp_path / "tops.npz").rename(tmp_path / "TOPS.NPZ")
    for words in ({}, {"degrees": True}, {"steady": True}, {"steady": True, "fast": True}):
        source = kr.Source.columns(scene, tmp_path / "TOPS.NPZ", **words)
        assert source[:] == scene.vary(spin=spin, tilt=tilt, **words)
    found = kr.sweep(
        kr.Source.columns(scene, tmp_path / "TOPS.NPZ", degrees=True), 1, to=tmp_path / "runs"
    )
    assert [found.units[name] for name in ("spin", "tilt")] == ["deg T^-1", "deg"]


def test_columns_of_matrices_and_dampings_are_put_together(tmp_path):
    words = [f"inertia_{i}" for i in range(9)]
    matrix = np.diag([2.0, 2.5, 3.0]).ravel()
    rows = [",".join([*words, "damping_0"]), ",".join(map(str, [*matrix, 0.1]))]
    (tmp_path / "tops.csv").write_text("\n".join([*rows, rows[1]]))
    source = kr.Source.columns(TOP, tmp_path / "tops.csv")
    assert source[1].body.moments == pytest.approx((2.0, 2.5, 3.0))
    assert source[1].damping == (0.1, 0.1, 0.1) and source.shape == (2,)
    (tmp_path / "tops.csv").write_text("\n".join([rows[0].replace("ia_8", "ia_9"), rows[1]]))
    with pytest.raises(ValueError, match=r"tops\.csv: unknown column 'inertia_4'"):
        kr.Source.columns(TOP, tmp_path / "tops.csv")


@pytest.mark.parametrize(
    ("said", "table"),
    [
        ("exactly one of the tables grid, random, scatter, columns, and there is none", ""),
        ("columns, not grid and random", "[grid]\nspin = [1]\n[random]\nn = 4\n"),
        ("spin has no n: it goes", "[grid]\nspin = { from = 1, to = 2 }\n"),
        ("spin has no from: it goes", "[grid]\nspin = { n = 3 }\n"),
        ("spin has no to: it goes", "[grid]\nspin = { n = 3, from = 1 }\n"),
        (r"unknown key in \[scatter\]: 'spin'", "[scatter]\nn = 3\nspin = 3\n"),
        ("events are tables ", "[grid]\nspin = [1]\n[events]\nevent = 'loop'\n"),
    ],
)
def test_tables_of_a_plan_are_told_apart(tmp_path, said, table):
    (tmp_path / "plan.toml").write_text("t = 1\nscene = 'thesis'\n" + table)
    with pytest.raises((ValueError, TypeError), match=said):
        kr.sweep(tmp_path / "plan.toml", to=tmp_path / "runs")


def test_a_plan_may_go_from_a_vector_to_a_vector_and_have_one_value(tmp_path):
    (tmp_path / "plan.toml").write_text(
        "t = 1\nscene = 'thesis'\n[grid]\ngravity = { from = 0.5, to = 2, n = 1 }\n"
        "momentum = { from = [0, 0, 1], to = [1, 2, 3], n = 3 }\n"
    )
    found = kr.sweep(tmp_path / "plan.toml", to=tmp_path / "runs")
    assert found["momentum_y"].tolist() == [[0, 1, 2]] and found["gravity"].tolist() == [[0.5] * 3]
    for words in ({"verb": "oli"}, {"part": 3}, {"t": 1}):
        with pytest.raises(ValueError, match=r"plan\.toml is a whole plan"):
            kr.sweep(tmp_path / "plan.toml", to=tmp_path / "runs", **words)
