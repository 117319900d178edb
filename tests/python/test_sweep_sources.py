"""Tests of the sets of tops that a sweep can cover, such as grids and random tops."""

import kreisel as kr
import numpy as np
import pytest
from sweeps import TOP


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ("t must be a number or a list of times", {"t": [[1.0, 2.0]]}),
        (
            "max_wait must be a number, the same for all",
            {"t": None, "task": "section", "max_wait": [1.0]},
        ),
        ("solve has no argument 'max_wait': it has t, method, step, ", {"t": 1, "max_wait": 3.0}),
    ],
)
def test_arguments_apply_to_all_tops(tmp_path, message, words):
    source = kr.Source.grid(TOP, gravity=[0.5])
    with pytest.raises(ValueError, match=message):
        kr.sweep(source, folder=tmp_path, **words)


def test_default_arguments_give_the_same_plan_as_none(tmp_path):
    source = kr.Source.grid(TOP, gravity=[0.5, 1.0], steady=False, fast=False, degrees=False)
    plain = kr.Source.grid(TOP, gravity=[0.5, 1.0])
    one = kr.sweep(plain, 1, folder=tmp_path, parts=range(0))
    again = kr.sweep(source, 1.0, "auto", folder=tmp_path, max_steps=0, parts=range(0))
    assert one.hash == again.hash and one.plan["flags"] == {}
    kr.sweep(plain, 1, "auto", folder=tmp_path / "oli", task="oli", max_steps=0, parts=range(0))
    words = {"want": iter(["energy", "apex"]), "parts": range(1)}
    sweep = kr.sweep(plain, 1, folder=tmp_path / "want", **words)
    assert sweep["energy"].shape == (2, 2) and sweep.plan["solve"]["want"] == ["energy", "apex"]


def test_the_length_of_a_source_is_its_number_of_tops():
    source = kr.Source.grid(TOP, gravity=[0.5, 1.0, 1.5])
    assert source[-3] == source[0] and source[2].gravity == 1.5
    for i in (3, -4):
        with pytest.raises(IndexError, match=f"^index {i} is out of range for 3 tops$"):
            source[i]
    random = kr.Source.random(TOP, 3, gravity=(0, 1))
    assert source[2:1].size == 0 and random[2:1].size == 0 and random[3:].size == 0
    many = dict.fromkeys(["gravity", "tilt"], np.zeros(2**18))
    with pytest.raises(ValueError, match="more tops than can be counted"):
        kr.Source.grid(TOP, **many, spin=np.zeros(2**17))
    assert kr.Source.grid(TOP, **many, spin=np.zeros(2**17 - 1)).size == 2**53 - 2**36


@pytest.mark.parametrize("name", ["attitude", "attitude_xyzw", "inertia"])
def test_a_parameter_without_a_range_may_have_one_value(name):
    value = [1, 0, 0, 0] if name[0] == "a" else [2, 3, 4]
    assert kr.Source.random(TOP, 2, gravity=(0, 1), **{name: value})[:].size == 2
    with pytest.raises(ValueError, match=f"^{name} has no range: give one value, or make"):
        kr.Source.random(TOP, 2, **{name: [value, value]})


def test_columns_may_be_combined_with_flags(tmp_path):
    (tmp_path / "TOPS.CSV").write_text("spin,tilt\n20.0,0.1\n30.0,0.2\n")
    scene, (spin, tilt) = kr.scenes.sleeping, ([20.0, 30.0], [0.1, 0.2])
    for words in ({}, {"degrees": True}, {"steady": True}, {"steady": True, "fast": True}):
        source = kr.Source.columns(scene, tmp_path / "TOPS.CSV", **words)
        assert source[:] == scene.vary(spin=spin, tilt=tilt, **words)
    sweep = kr.sweep(
        kr.Source.columns(scene, tmp_path / "TOPS.CSV", degrees=True), 1, folder=tmp_path / "runs"
    )
    assert [sweep.units[name] for name in ("spin", "tilt")] == ["deg/T", "deg"]


def test_sweeps_of_ensembles_keep_the_unit_of_angles(tmp_path):
    for degrees, unit in ((False, "rad"), (True, "deg")):
        tops = kr.scenes.sleeping.vary(tilt=[1.0, 2.0], degrees=degrees)
        sweep = kr.sweep(tops, 1, folder=tmp_path / unit)
        assert sweep.units["tilt"] == unit and sweep["tilt"].tolist() == [1.0, 2.0]


def test_columns_of_components_are_joined(tmp_path):
    words = [f"inertia_{i}" for i in range(9)]
    matrix = np.diag([2.0, 2.5, 3.0]).ravel()
    rows = [",".join([*words, "damping_0"]), ",".join(map(str, [*matrix, 0.1]))]
    (tmp_path / "tops.csv").write_text("\n".join([*rows, rows[1]]))
    source = kr.Source.columns(TOP, tmp_path / "tops.csv")
    assert source[1].body.moments == pytest.approx((2.0, 2.5, 3.0))
    assert source[1].damping == (0.1, 0.1, 0.1) and source.shape == (2,)
    (tmp_path / "tops.csv").write_text("\n".join([rows[0].replace("ia_8", "ia_9"), rows[1]]))
    with pytest.raises(ValueError, match=r"'inertia_4' is .* of inertia, .* missing: inertia_8$"):
        kr.Source.columns(TOP, tmp_path / "tops.csv")


@pytest.mark.parametrize(
    ("message", "table"),
    [
        ("exactly one of the tables grid, random, scatter, columns, and there is none", ""),
        ("columns, not grid and random", "[grid]\nspin = [1]\n[random]\nn = 4\n"),
        ("spin has no n: give the first", "[grid]\nspin = { from = 1, to = 2 }\n"),
        ("spin has no from: give the first", "[grid]\nspin = { n = 3 }\n"),
        ("spin has no to: give the first", "[grid]\nspin = { n = 3, from = 1 }\n"),
        (r"unknown key in \[scatter\]: 'spin'", "[scatter]\nn = 3\nspin = 3\n"),
        ("events must be tables ", "[grid]\nspin = [1]\n[events]\nevent = 'loop'\n"),
    ],
)
def test_a_plan_has_one_table_of_tops(tmp_path, message, table):
    (tmp_path / "plan.toml").write_text("t = 1\nscene = 'thesis'\n" + table)
    with pytest.raises((ValueError, TypeError), match=message):
        kr.sweep(tmp_path / "plan.toml", folder=tmp_path / "runs")


def test_values_of_a_plan_may_be_spaced_between_vectors(tmp_path):
    (tmp_path / "plan.toml").write_text(
        "t = 1\nscene = 'thesis'\n[grid]\ngravity = { from = 0.5, to = 2, n = 1 }\n"
        "momentum = { from = [0, 0, 1], to = [1, 2, 3], n = 3 }\n"
    )
    sweep = kr.sweep(tmp_path / "plan.toml", folder=tmp_path / "runs")
    assert sweep["momentum_y"].tolist() == [[0, 1, 2]] and sweep["gravity"].tolist() == [[0.5] * 3]
    for words in ({"task": "oli"}, {"part_size": 3}, {"t": 1}):
        with pytest.raises(ValueError, match=r"plan\.toml is a whole plan"):
            kr.sweep(tmp_path / "plan.toml", folder=tmp_path / "runs", **words)
