"""Tables of paths and ensembles in pandas, xarray and CSV, and rotations for scipy."""

import copy
import pickle
from typing import get_args

import kreisel as kr
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from kreisel.types import QuantityName
from scipy.spatial.transform import Rotation
from tops import GENERAL

TOP = kr.scenes.asymmetric
MANY = kr.scenes.thesis.vary(spin=[1.0, 2.0, 3.0], tilt=[[0.2], [0.4]])
TIMES = np.linspace(0.0, 20.0, 201)
QUANTITIES = get_args(QuantityName)[1:]
ENDINGS = {  # {size of a quantity: endings of the names of its components}
    1: [""],
    3: ["_x", "_y", "_z"],
    4: ["_w", "_x", "_y", "_z"],
    9: [f"_{axis}{component}" for axis in "NBT" for component in "xyz"],
}


def list_components(path, name):
    size = getattr(path, name)[0].size
    return [name + ending for ending in ENDINGS[size]]


@pytest.fixture(scope="module")
def path():
    return kr.solve(TOP, TIMES)


def test_states_in_a_pandas_table(path):
    table = path.to_pandas()
    state = [*list_components(path, "q"), *list_components(path, "m")]
    assert np.array_equal(table.reset_index().to_numpy(), path.states)
    units = {"t": "T"} | dict.fromkeys(state[:4], "") | dict.fromkeys(state[4:], "M L^2 T^-1")
    assert table.attrs == {"method": "taylor", "scene": TOP.to_toml(), "units": units}


@pytest.mark.parametrize("words", [{}, {"digits": 20}])
def test_every_quantity_has_a_column_per_component(words):
    """Check all quantities in all formats, with angles in degrees."""
    path = kr.solve(TOP, TIMES[::20], **words)
    for name in QUANTITIES:
        table, data = path.to_pandas(name, degrees=True), path.to_xarray(name, degrees=True)
        plain, [column] = path.to_pandas(name), {*data.data_vars}
        values = getattr(path, name)
        unit = plain.attrs["units"][next(iter(plain))]
        values = np.degrees(values) if "rad" in unit else values
        assert list(table) == list(plain) == list_components(path, name) and column == name
        assert np.array_equal(table.to_numpy().reshape(values.shape), values, equal_nan=True)
        assert np.array_equal(data[name].values, values, equal_nan=True)
        assert data[name].dims[0] == "time" and data[name].attrs["long_name"]
        assert data[name].attrs["units"] == unit.replace("rad", "deg")
        assert set(table.attrs["units"].values()) == {"T", unit.replace("rad", "deg")}


def test_tables_have_each_quantity_once_and_named_dimensions(path):
    assert list(path.to_pandas("energy", "t", "spin", "energy")) == ["energy", "spin"]
    data = path.to_xarray("frame", "apex", "q", "nutation")
    assert data["frame"].dims == ("time", "principal_axis", "axis")
    assert np.array_equal(data["frame"].sel(principal_axis="T", axis="z"), path.frame[:, 2, 2])
    assert np.array_equal(data["q"].sel(quaternion="w"), path.q[:, 0])
    assert np.array_equal(data["apex"].sel(axis="z", time=20.0), path.apex[-1, 2])
    assert data["time"].attrs["units"] == "T"
    assert xr.Dataset.from_dict(data.to_dict()).identical(data)


@pytest.mark.parametrize("times", [[], [1.0], [-1.0, -2.0]])
def test_a_table_contains_the_recorded_quantities(times):
    for words, names in [
        ({"want": ("frame", "energy")}, ["frame", "energy"]),
        ({"digits": 20}, ["q", "m", "q_low", "m_low"]),
        ({"digits": 30, "want": ("m_low", "nutation")}, ["m_low", "nutation"]),
        ({"tol": 1e-6}, ["q", "m"]),
    ]:
        path = kr.solve(TOP, times, **words)
        data, table = path.to_xarray(), path.to_pandas()
        assert list(data.data_vars) == names and data.sizes["time"] == len(table) == len(times)
        options = [data.attrs.get(word) for word in ("method", "digits", "tol", "step")]
        assert options == ["taylor", words.get("digits"), words.get("tol"), None]


def test_csv_is_read_back_bit_for_bit(path, tmp_path):
    names = ("nutation", "frame", "kowalewski")
    path.to_csv(str(tmp_path / "table.csv"), *names, degrees=True)
    again = pd.read_csv(tmp_path / "table.csv", index_col="t [T]")
    table = path.to_pandas(*names, degrees=True)
    assert np.array_equal(again.index, table.index)
    assert np.array_equal(again.to_numpy(), table.to_numpy(), equal_nan=True)
    assert again["kowalewski [T^-4]"].isna().all()
    path.to_csv(tmp_path / "t.csv", "t")
    assert (tmp_path / "t.csv").read_text().splitlines() == ["t [T]", *map(repr, path.t.tolist())]


# Angles


def test_euler_angles_reproduce_the_attitude():
    body = kr.Body(1.0, (2.0, 3.0, 4.0), (0.0, 0.0, 0.5))  # a body whose apex is its third axis
    path = kr.solve(
        kr.Scene(body, momentum=(1.0, -2.0, 3.0), attitude=GENERAL.attitude, gravity=1), TIMES
    )
    matrices = Rotation.from_euler("ZXZ", path.euler()).as_matrix()
    np.testing.assert_allclose(
        matrices, Rotation.from_quat(path.q_xyzw).as_matrix(), rtol=0, atol=1e-13
    )
    assert np.array_equal(path.euler()[:, 1], path.nutation)
    assert np.array_equal(path.euler(degrees=True), np.degrees(path.euler()))


def test_unwrapped_angles_have_no_jumps(path):
    jumping, smooth = path.euler(), path.euler(unwrap=True)
    assert np.abs(np.diff(jumping, axis=0)).max() > np.pi
    assert np.abs(np.diff(smooth, axis=0)).max() < np.pi
    turns = (smooth - jumping) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.rint(turns), rtol=0, atol=1e-12)
    table = path.to_pandas("precession_angle", "spin_angle", unwrap=True, degrees=True)
    assert np.array_equal(table, np.degrees(smooth[:, [0, 2]]))
    unchanged = path.to_pandas("nutation", "spin", "m", unwrap=True)
    assert unchanged.equals(path.to_pandas("nutation", "spin", "m"))
    assert kr.solve(TOP, []).euler(unwrap=True, degrees=True).shape == (0, 3)


# Rotations and copies


def test_rotations_accept_the_read_only_arrays_of_a_path(path):
    turns, plain = path.rotation, Rotation.from_quat(path.q_xyzw)
    assert isinstance(turns, Rotation)
    for vectors in (path.apex, path.frame[:, 0], [[1, 0, 0]] * len(path)):
        expected = plain.apply(np.array(vectors, float))
        for rotation in turns, copy.deepcopy(turns), pickle.loads(pickle.dumps(turns)):
            assert np.array_equal(rotation.apply(vectors), expected)
        assert np.array_equal(turns.inv().apply(vectors), plain.inv().apply(np.array(vectors)))
    np.testing.assert_allclose(
        (turns.inv() * turns).apply(path.apex), path.apex, rtol=0, atol=4e-15
    )
    assert np.array_equal(turns[2:5].apply(path.apex[2:5]), turns.apply(path.apex)[2:5])
    each = [turn.apply(apex) for turn, apex in zip(turns, path.apex, strict=True)]
    np.testing.assert_allclose(each, turns.apply(path.apex), rtol=0, atol=4e-15)


@pytest.mark.parametrize("words", [{}, {"want": ("q", "apex")}, {"digits": 20}])
def test_arrays_stay_read_only_in_copies(words):
    path = kr.solve(TOP, TIMES, **words, events=[kr.events.nutation()])
    assert path.apex.shape == (len(path), 3)
    for again in copy.copy(path), copy.deepcopy(path), pickle.loads(pickle.dumps(path)):
        arrays = [again.t, again.q, again.apex, again.events.which, again.events.direction]
        arrays += [again.events.path.states, again[3:].q, again(1.0).q, again.events.t]
        arrays += [] if path.want else [again.states, again.m, again.q_low, again.m_low]
        assert not any(array.flags.writeable for array in arrays)


# Ensembles


def test_tables_of_ensembles_name_their_dimensions():
    reductions = kr.reduce(MANY, 1.0, {"apex": "mean", "energy": "max"}).to_xarray()
    [name] = [name for name in reductions.data_vars if reductions[name].ndim == 3]
    assert reductions[reductions[name].dims[-1]].values.tolist() == ["x", "y", "z"]
    tops = kr.scenes.thesis.vary(spin=[1.0, 2.0, 3.0])
    own = np.arange(6.0).reshape(3, 2)
    data = kr.solve(tops, own).to_xarray("energy")
    assert data["t"].dims == ("spin", "time") and np.array_equal(data["t"], own)
    assert kr.solve(tops, [1.0, 2.0]).to_xarray("energy")["time"].values.tolist() == [1.0, 2.0]


# Refusals


@pytest.mark.parametrize("way", ["to_pandas", "to_xarray", "to_csv"])
def test_bad_arguments_are_refused(way, path, tmp_path):
    file = [tmp_path / "table.csv"] if way == "to_csv" else []
    for names, words, kind, word in [
        (["nutaton"], {}, ValueError, "did you mean 'nutation'"),
        (["energy_error"], {}, ValueError, "unknown quantity"),
        ([["nutation"]], {}, TypeError, "names"),
        ([3], {}, TypeError, "names"),
        ([], {"degrees": "yes"}, TypeError, "degrees"),
        ([], {"unwrap": 1}, TypeError, "unwrap"),
    ]:
        with pytest.raises(kind, match=word):
            getattr(path, way)(*file, *names, **words)
    with pytest.raises(AttributeError, match="add 'nutation' to want"):
        getattr(kr.solve(TOP, 1.0, want=("energy",)), way)(*file, "nutation")
    assert not any(tmp_path.iterdir())
    with pytest.raises(FileNotFoundError):
        path.to_csv(tmp_path / "none" / "table.csv")


def test_tables_of_many_tops_hold_the_tables_of_each(tmp_path):
    tops = kr.scenes.cusps.vary(gravity=[0.5, 1.0])
    many = kr.solve(tops, [0.0, 1.0, 2.0])
    frame = many.to_pandas("nutation", "m", degrees=True)
    assert frame.index.names == ["gravity", "t"] and frame.attrs["units"]["nutation"] == "deg"
    many.to_csv(tmp_path / "tops.csv", "nutation", "m")
    read = pd.read_csv(tmp_path / "tops.csv")
    for path, gravity in zip(many, [0.5, 1.0], strict=True):
        names = ["nutation", "m_x", "m_y", "m_z"]
        expected = path.to_pandas("nutation", "m", degrees=True)
        assert frame.loc[gravity][names].equals(expected[names])
        rows = read[read["gravity [L T^-2]"] == gravity]
        assert rows["t [T]"].tolist() == [0.0, 1.0, 2.0]
        assert np.allclose(rows["nutation [rad]"], path.nutation, rtol=1e-15)
    assert many.euler(unwrap=True).shape == (2, 3, 3)
