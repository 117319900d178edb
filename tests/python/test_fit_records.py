"""Tests of kreisel.Record."""

import kreisel as kr
import numpy as np
import pandas
import pytest
from fits import GUESS, HEAVY, SIGMA, gyroscope
from kreisel._fit.records import _PARTS, slice_record
from scipy.spatial.transform import Rotation

T = [0.0, 0.1, 0.2]
W = [[1.0, 2.0, 3.0]] * 3


@pytest.mark.parametrize(
    "t, values, message",
    [
        (T, {}, "values is empty"),
        (T, {"omega": W}, "did you mean 'velocity'"),
        (T, {"wobble": W}, "unknown quantity 'wobble'"),
        (T, {"kowalewski": T}, "kowalewski cannot be fitted"),
        (T, {"q_w": T}, "give all four components as attitude"),
        (T, {"apex": W[:2]}, r"apex must have the shape \(3, 3\), .* not \(2, 3\)"),
        (T, {"spin": W}, r"spin must have the shape \(3,\)"),
        (T, {"spin": [1.0, np.inf, 2.0]}, "spin must be finite, or NaN"),
        (T, {"spin": [np.nan] * 3}, "values has no measurement"),
        (T, {"q": [[2.0, 0, 0, 0]] * 3}, r"the norm of q\[0\] is 2"),
        (T, {"nutation": [10.0, 20.0, 30.0]}, "more than two turns: .* degrees=True"),
        ([], {"spin": []}, "t must be a list of times"),
        (
            [0.0, 0.2, 0.1],
            {"spin": T},
            r"t\[2\] = 0.1 follows t\[1\] = 0.2",
        ),
        ([0.0, np.nan, 0.1], {"spin": T}, r"t must be finite, not t\[1\]"),
        (T, {"spin": [1.0, 1e150, 2.0]}, r"spin is up to 1e\+150: choose units"),
        (T, {"spin": [0.0, 1e-150, 0.0]}, "spin is up to 1e-150: choose units"),
    ],
)
def test_invalid_measurements_are_refused(t, values, message):
    with pytest.raises(ValueError, match=message):
        kr.Record(t, values)


@pytest.mark.parametrize("sigma", [0.0, -1.0, np.nan, np.inf, [1.0, 0.0, 1.0], [[1.0]] * 2])
def test_invalid_standard_deviations_are_refused(sigma):
    with pytest.raises(ValueError, match="sigma of apex must be"):
        kr.Record(T, {"apex": W}, sigma)


def test_a_sigma_of_an_absent_quantity_is_refused():
    with pytest.raises(ValueError, match="unknown name in sigma: 'apexx'; did you mean 'apex'"):
        kr.Record(T, {"apex": W}, {"apexx": 1.0})


@pytest.mark.parametrize(
    "values, free, message",
    [
        ({"apex": W}, "drift", "unknown name in free: 'drift'; known are bias"),
        ({"apex": W}, "mounting", "mounting needs attitudes or a whole vector seen from the body"),
        ({"q": [[1.0, 0, 0, 0]] * 3}, "bias", "attitudes have no bias"),
    ],
)
def test_missing_instrument_properties_are_refused(values, free, message):
    with pytest.raises(ValueError, match=message):
        kr.Record(T, values, free=free)


@pytest.mark.parametrize("wrong", [3, None, "apex", [1, 2]])
def test_wrong_types_are_refused(wrong):
    with pytest.raises(TypeError):
        kr.Record(T, wrong)
    with pytest.raises((TypeError, ValueError)):
        kr.Record(T, {"spin": T}, free=wrong)
    with pytest.raises((TypeError, ValueError)):
        kr.Record(T, {"spin": wrong})
    with pytest.raises((TypeError, ValueError)):
        kr.Record([1j, 2j, 3j], {"spin": T})


@pytest.mark.parametrize("name", [3, None, ("apex", 0)])
def test_names_of_quantities_are_strings(name):
    with pytest.raises(TypeError, match="the names in values must be strings, not"):
        kr.Record(T, {name: T})


def test_missing_values_are_left_out_and_counted():
    record = gyroscope(n=200, end=2.0)
    values = record.series[0].values.copy()
    values[::7] = np.nan
    values[3, 1] = np.nan
    holes = kr.Record(record.t, {"body_velocity": values}, SIGMA)
    is_complete = ~np.isnan(values).any(axis=1)
    assert holes.missing == 3 * 29 + 1 and holes.size == 600 - holes.missing
    assert "88 left out" in repr(holes)
    whole = kr.Record(record.t[is_complete], {"body_velocity": values[is_complete]}, SIGMA)
    fit, other = kr.fit(HEAVY, holes), kr.fit(HEAVY, whole)
    assert "88 values are left out: not measured" in str(fit) and fit.dof == other.dof + 2
    assert np.isnan(fit.residuals[0]["body_velocity"][7]).all()
    assert abs(fit.values["I1"] / other.values["I1"] - 1.0) < 1e-3


def test_degrees_are_converted():
    t = np.linspace(0.0, 2.0, 100)
    path = kr.solve(HEAVY, t)
    sigma = {"nutation": 0.01, "body_velocity": 0.02}
    radians = {name: getattr(path, name) for name in sigma}
    degrees = {name: np.degrees(value) for name, value in radians.items()}
    in_degrees = {name: np.degrees(value) for name, value in sigma.items()}
    one = kr.fit(HEAVY, kr.Record(t, radians, sigma))
    other = kr.fit(HEAVY, kr.Record(t, degrees, in_degrees, degrees=True))
    assert np.isclose(other.error["I1"], one.error["I1"], rtol=1e-6)
    assert np.isclose(other.sigma[0]["nutation"], np.degrees(0.01))


def test_single_components_can_be_compared():
    t = np.linspace(0.0, 2.0, 100)
    path = kr.solve(HEAVY, t)
    values = {"apex_x": path.apex[:, 0], "body_velocity_z": path.body_velocity[:, 2]}
    record = kr.Record(t, values, 0.1)
    fit = kr.fit(HEAVY, record)
    assert fit.chi2 < 1e-12 and fit.residuals[0]["apex_x"].shape == (100,)


def test_attitudes_have_the_names_and_forms_of_a_scene(tmp_path):
    rotations = Rotation.random(5, random_state=0)
    q = np.roll(rotations.as_quat(), 1, axis=1)
    table = np.column_stack((np.arange(5.0), rotations.as_quat()))
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="t,x,y,z,w", comments="")
    last, first = rotations.as_quat(), q
    records = [
        kr.Record(np.arange(5.0), {name: values})
        for name, values in (
            *(("q", first), ("q_xyzw", last), ("attitude", first), ("attitude_xyzw", last)),
            *((name, rotations) for name in ("q", "q_xyzw", "attitude", "attitude_xyzw")),
        )
    ]
    records.append(kr.Record.from_csv(tmp_path / "a.csv", {"attitude_xyzw": ("x", "y", "z", "w")}))
    for record in records:
        assert record.size == 15 and np.allclose(record.series[0].values, q, rtol=0, atol=1e-15)
    with pytest.raises(ValueError, match="the attitude twice, as q and attitude_xyzw"):
        kr.Record(np.arange(5.0), {"q": q, "attitude_xyzw": last})


@pytest.mark.parametrize("name, right", [("q", "q_xyzw"), ("attitude_xyzw", "attitude")])
def test_quaternions_of_the_other_order_are_named(name, right):
    body = kr.Body(1.0, (1.0, 1.3, 0.6), com=(0.05, 0.1, 0.4), unphysical=True)
    scene = kr.Scene(body, body_velocity=(1, 2, 3), attitude=(0.6, 0.48, 0.64, 0), gravity=9.81)
    t = np.linspace(0.0, 2.0, 60)
    q = kr.solve(scene, t).q
    wrong = np.roll(q, -1, axis=1) if name == "q" else q
    with pytest.warns(UserWarning, match=f"name them {right}"):
        kr.fit(scene, kr.Record(t, {name: wrong}, 1e-3), max_evaluations=200)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_csv_file_is_a_record(tmp_path, separator):
    record = gyroscope(n=20)
    rows = np.column_stack((record.t, record.series[0].values)).tolist()
    head = ["t", *(f"body_velocity_{axis}" for axis in "xyz")]
    file = tmp_path / "gyro.csv"
    file.write_text("\n".join(separator.join(map(str, row)) for row in [head, *rows]) + "\n\n")
    for again in (
        kr.Record.from_csv(file),
        kr.Record.from_csv(file, {"body_velocity": head[1:]}),
        kr.Record.from_pandas(pandas.read_csv(file, sep=separator)),
        kr.Record.from_pandas(pandas.read_csv(file, sep=separator).set_index("t")),
    ):
        assert (again.series[0].values == record.series[0].values).all()
        assert (again.t == record.t).all() and again.series[0].name == "body_velocity"


@pytest.mark.parametrize(
    "text, message",
    [
        ("t,spin\n", "a line of names and at least one line of numbers"),
        ("time,spin\n0,1\n", "unknown column of times 't'; known are time, spin"),
        ("t,rpm\n0,1\n", "unknown quantity in the name of a column: 'rpm'.*or pass columns"),
        ("t,spin\n0,one\n", "row 1 has 'one', which is not a number"),
        ("t;spin\n0;0,5\n", "row 1 has '0,5', .*; write decimal points"),
        ("t,spin\n0,1,2\n", "row 1 has 3 fields instead of 2"),
        ("t,spin,spin\n0,1,2\n", "two columns have the same name"),
        ("t,spin\n0,\n", "no measurement"),
    ],
)
def test_invalid_files_are_refused(tmp_path, text, message):
    file = tmp_path / "record.csv"
    file.write_text(text)
    with pytest.raises(ValueError, match=message):
        kr.Record.from_csv(file)


def test_a_binary_file_is_refused(tmp_path):
    (tmp_path / "record.csv").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ValueError, match="is not a CSV file in UTF-8"):
        kr.Record.from_csv(tmp_path / "record.csv")


def test_missing_values_need_no_sigma():
    values, sigma = [1.0, np.nan, 2.0], [0.1, np.nan, 0.2]
    [series] = kr.Record(T, {"spin": values}, sigma).series
    assert series.sigma[:, 0].tolist() == [0.1, 1.0, 0.2]


def test_unknown_columns_are_refused(tmp_path):
    file = tmp_path / "record.csv"
    file.write_text("t,rpm\n0,1\n1,2\n")
    with pytest.raises(ValueError, match="unknown column 'rmp'; did you mean 'rpm'"):
        kr.Record.from_csv(file, {"spin": "rmp"})
    assert kr.Record.from_csv(file, {"spin": "rpm"}).size == 2
    with pytest.raises(TypeError, match=r"pandas\.DataFrame"):
        kr.Record.from_pandas([1, 2])


@pytest.mark.parametrize(
    "records, free, words, message",
    [
        ("", "start", {}, "records is empty"),
        ("gyro", (), {}, "free is empty"),
        ("late", "start", {}, "begin at t = 1000, long after the start .* subtract the first time"),
        ("gyro", "mass_", {}, "unknown name in free: 'mass_'; did you mean 'mass'"),
        ("gyro", ("com", "lever"), {}, "free has both com and lever"),
        ("gyro", "start", {"loss": "soft_l1"}, "unknown loss 'soft_l1'; did you mean 'soft'"),
        ("gyro", "start", {"pieces": 0}, "pieces must be at least 1"),
        ("gyro", "start", {"pieces": 11}, "pieces must be at most 10, one for two times"),
        ("gyro", "start", {"max_evaluations": 0}, "max_evaluations must be at least 1"),
        ("few", ("start", "moments"), {}, "3 numbers, fewer than the 9 free parameters"),
        ("saturated", "velocity", {}, "3 numbers, as many as free parameters, so that sigma"),
        ("heading", "start", {}, "the sigma of velocity_x cannot be estimated, because"),
        ("momentum", "gravity", {}, "vertical_momentum does not depend on the free parameters"),
    ],
)
def test_invalid_fits_are_refused(records, free, words, message):
    records_by_name = {
        "gyro": gyroscope(n=20),
        "few": kr.Record([0.0], {"apex": [[0.0, 0.0, 1.0]]}, 0.1),
        "saturated": kr.Record([0.5], {"body_velocity": [[0.1, 0.2, 9.0]]}),
        "heading": [gyroscope(n=20), kr.Record([0.5], {"velocity_x": [0.5]})],
        "late": kr.Record([1000.0, 1000.5], {"apex": [[0.0, 0.0, 1.0]] * 2}, 0.1),
        "momentum": kr.Record(T, {"vertical_momentum": [1.0] * 3}, 0.1),
    }
    data = records_by_name[records] if records else []
    with pytest.raises(ValueError, match=message):
        kr.fit(GUESS, data, free, **words)


def test_an_ensemble_without_members_is_refused():
    with pytest.raises(ValueError, match="scene is an ensemble without members"):
        kr.fit(GUESS.vary(gravity=[]), gyroscope(n=20))


@pytest.mark.parametrize(
    "arguments, words",
    [
        ((None, []), {}),
        ((GUESS, "record"), {}),
        ((GUESS, 3), {}),
        ((GUESS, [GUESS]), {}),
        ((GUESS, gyroscope(n=20), 3), {}),
        ((GUESS, gyroscope(n=20)), {"progress": 3}),
        ((GUESS, gyroscope(n=20)), {"pieces": 2.5}),
    ],
)
def test_wrong_types_of_fits_are_refused(arguments, words):
    with pytest.raises(TypeError):
        kr.fit(*arguments, **words)


def test_a_lever_needs_a_centre_of_mass():
    free = kr.scenes.dzhanibekov
    with pytest.raises(ValueError, match="com is the fixed point: use com instead"):
        kr.fit(free, gyroscope(free, n=20), "lever")


@pytest.mark.parametrize(
    "quantity, values, scale, size",
    [
        ("spin", [1.0, 3.0, np.nan], 1.0, np.sqrt(5.0)),
        ("spin", [2.0, 2.0, 2.0], 2.0, 2.0),
        ("spin", [-2.0, -2.0, np.nan], 2.0, 2.0),
        ("spin", [np.nan, -5.0, np.nan], 5.0, 5.0),
        ("spin", [0.0, 0.0, 0.0], 1.0, 1.0),
        # the variances of the components are 1, 0 and 4, of two rows
        ("apex", [[1.0, 5.0, 1.0], [3.0, 5.0, 5.0], [np.nan] * 3], np.sqrt(5 / 3), np.sqrt(86 / 6)),
        ("nutation", [0.1, 0.2, 0.3], 1.0, 1.0),
        ("q", [[1.0, 0.0, 0.0, 0.0]] * 3, 1.0, 1.0),
    ],
)
def test_the_scale_of_a_series_is_its_deviation_and_its_size_the_root_mean_square(
    quantity, values, scale, size
):
    [series] = kr.Record(T, {quantity: values}).series
    assert series.typical_value_scale == pytest.approx(scale)
    assert series.size == pytest.approx(size)
    assert series.residuals_per_row == (3 if quantity in ("q", "apex") else 1)


@pytest.mark.parametrize(
    "values",
    [
        {"spin": [1e100, 0.0, 1.0]},
        {"spin": [1e-100, 0.0, 0.0]},
        {"nutation": [4.0 * np.pi, 0.0, 1.0]},
        {"spin": [500.0, 1.0, 2.0]},
        {"q": [[1.0009, 0.0, 0.0, 0.0]] * 3},
        {"q": [[np.nan, 9.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [np.nan] * 4]},
    ],
)
def test_values_at_a_limit_are_accepted(values):
    [series] = kr.Record(T, values).series
    if series.is_attitude:
        norms = np.linalg.norm(series.values[series.measured.all(axis=1)], axis=1)
        assert norms == pytest.approx(1.0, abs=1e-15)
        assert (series.measured == series.measured[:, :1]).all()


@pytest.mark.parametrize(
    "values, message",
    [
        ({"spin": [1.1e100, 0.0, 1.0]}, "choose units"),
        ({"spin": [0.9e-100, 0.0, 0.0]}, "choose units"),
        ({"nutation": [-12.6, 0.0, 1.0]}, r"nutation is up to 12\.6, which is more than two turns"),
        (
            {"q": [[1.0, 0.0, 0.0, 0.0], [0.0, 0.9989, 0.0, 0.0], [2.0, 0, 0, 0]]},
            r"q\[1\] is 0\.99",
        ),
    ],
)
def test_values_beyond_a_limit_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        kr.Record(T, values)


def test_times_may_repeat_and_the_first_decrease_is_named():
    assert kr.Record([0.0, 0.0, 1.0], {"spin": T}).size == 3
    with pytest.raises(ValueError, match=r"but t\[2\] = 1\.0 follows t\[1\] = 2\.0"):
        kr.Record([0.0, 2.0, 1.0, 0.0], {"spin": [0.0] * 4})
    with pytest.raises(ValueError, match=r"not an array of shape \(1, 3\)"):
        kr.Record([T], {"spin": T})


@pytest.mark.parametrize(
    "quantity, factor",
    [("nutation", 1.0), ("spin", 1.0), ("body_acceleration", 1.0), ("apex", 0.0), ("q", -1.0)],
)
def test_degrees_convert_angles_and_their_rates(quantity, factor):
    """An attitude quaternion is dimensionless, but its standard deviation `sigma` is an angle."""
    values = {"q": [[0.0, 1.0, 0.0, 0.0]] * 3, "nutation": T, "spin": T}.get(quantity, W)
    radian = np.pi / 180.0 if factor else 1.0
    [series] = kr.Record(T, {quantity: values}, 0.5, degrees=True).series
    unit = radian if factor >= 0.0 else 1.0
    assert series.values == pytest.approx(np.reshape(values, (3, -1)) * unit)
    assert series.sigma == pytest.approx(np.full((3, series.residuals_per_row), 0.5 * radian))
    assert series.unit == pytest.approx(radian)
    [plain] = kr.Record(T, {quantity: values}, 0.5).series
    assert plain.unit == 1.0 and (plain.sigma == 0.5).all()
    many = kr.Record([0.0], {"nutation": [720.0 * 5.0]}, degrees=True)
    assert many.series[0].values == pytest.approx(20.0 * np.pi)


def test_sigma_is_broadcast_to_the_values():
    rows = [[1.0, 2.0, 3.0]] * 2
    for sigma, expected in (
        (0.1, np.full((2, 3), 0.1)),
        ([0.1, 0.2], [[0.1] * 3, [0.2] * 3]),
        ([0.1, 0.2, 0.3], [[0.1, 0.2, 0.3]] * 2),
        ({"apex": [[0.1], [0.2]]}, [[0.1] * 3, [0.2] * 3]),
    ):
        [series] = kr.Record(T[:2], {"apex": rows}, sigma).series
        assert series.sigma.tolist() == np.array(expected).tolist()
    [square] = kr.Record(T, {"apex": W}, [0.1, 0.2, 0.3]).series
    assert square.sigma.tolist() == [[0.1, 0.2, 0.3]] * 3  # of the components, as in numpy
    [one] = kr.Record(T[:1], {"spin": [2.0]}, [0.1]).series
    assert one.sigma.tolist() == [[0.1]]
    [first, second] = kr.Record(T, {"apex": W, "spin": T}, {"spin": 0.2}).series
    assert first.sigma is None and (second.sigma == 0.2).all()


def test_sizes_and_descriptions_count_measured_numbers():
    q = [[1.0, 0.0, 0.0, 0.0], [np.nan] * 4, [0.0, 1.0, 0.0, 0.0]]
    apex = np.where(np.eye(3) > 0.0, np.nan, W)
    record = kr.Record([0.5, 1.0, 2.5], {"q": q, "apex": apex}, 0.1, free=("delay", "bias"))
    assert record.size == 6 + 6 and record.missing == 3 + 3
    assert repr(record) == (
        "<kreisel.Record: 3 times, t = 0.5 .. 2.5; q, apex; 12 numbers, 6 left out; "
        "free bias, delay>"
    )


@pytest.mark.parametrize(
    "values, free, is_valid",
    [
        ({"body_velocity": W}, "mounting", True),
        ({"q": [[1.0, 0, 0, 0]] * 3}, ("mounting", "delay"), True),
        ({"body_velocity_x": T}, "mounting", False),
        ({"q": [[1.0, 0, 0, 0]] * 3}, "scale", False),
        ({"q": [[1.0, 0, 0, 0]] * 3, "spin": T}, ("scale", "bias"), True),
        ({"body_velocity_x": T, "body_vertical": W}, "mounting", True),
    ],
)
def test_properties_need_a_quantity_that_shows_them(values, free, is_valid):
    if is_valid:
        assert set(kr.Record(T, values, free=free).free) == set(np.atleast_1d(free))
    else:
        with pytest.raises(ValueError, match="mounting"):
            kr.Record(T, values, free=free)


def test_a_slice_of_a_record_has_its_rows_and_its_clock():
    record = kr.Record(
        [1.0, 2.0, 3.0, 4.0],
        {"spin": [5.0, 6.0, np.nan, 8.0], "nutation": [0.1] * 4},
        {"spin": [0.1, 0.2, 0.3, 0.4]},
        free="delay",
    )
    part = slice_record(record, 1, 3, 0.5)
    assert part.t.tolist() == [1.5, 2.5] and part.free == ("delay",) and part.point is None
    spin, nutation = part.series
    assert spin.values[:, 0].tolist() == [6.0, 0.0] and nutation.sigma is None
    assert spin.measured[:, 0].tolist() == [True, False] and spin.sigma[:, 0].tolist() == [0.2, 1.0]
    assert slice_record(record, 0, 2).t.tolist() == [1.0, 2.0]


def test_columns_of_components_are_joined_if_all_are_present(tmp_path):
    file = tmp_path / "record.csv"
    head = "t, apex_y ,apex_x,apex_z,velocity_x,spin,frame_Tx,q_w,q_x,q_y,q_z"
    file.write_text(f"\n{head}\n\n0,2,1,3,4,5,0.5,1,0,0,0\n , , \n0.5,,1,3,4,5,0.5,0,0,0,1\n")
    record = kr.Record.from_csv(file)
    series = {one.name: one for one in record.series}
    assert list(series) == ["apex", "velocity_x", "spin", "frame_Tx", "q"]
    assert record.t.tolist() == [0.0, 0.5]
    assert series["apex"].values.tolist() == [[1.0, 2.0, 3.0], [1.0, 0.0, 3.0]]
    assert series["apex"].measured.tolist() == [[True] * 3, [True, False, True]]
    assert series["velocity_x"].part == 0 and series["q"].values[1].tolist() == [0, 0, 0, 1]


def test_elements_of_the_frame_stay_single(tmp_path):
    parts = [name for name, (quantity, _) in _PARTS.items() if quantity == "frame"]
    file = tmp_path / "record.csv"
    file.write_text(",".join(["t", *parts]) + "\n" + ",".join(["0", *"123456789"]) + "\n")
    record = kr.Record.from_csv(file)
    assert [one.name for one in record.series] == parts
    assert [one.values[0, 0] for one in record.series] == list(range(1, 10))


@pytest.mark.parametrize(
    "columns, error, message",
    [
        (3, TypeError, "columns must map quantities to names of columns"),
        ({"apex": ("x", 3, "z")}, TypeError, "a column must have a name, not 3"),
        ({"apex": ("x", "y", "w")}, ValueError, "unknown column 'w'"),
    ],
)
def test_columns_are_names_in_the_table(columns, error, message):
    frame = pandas.DataFrame({"t": T, "x": T, "y": T, "z": T})
    with pytest.raises(error, match=message):
        kr.Record.from_pandas(frame, columns)
    with pytest.raises(TypeError, match="a column of times must have a name, not None"):
        kr.Record.from_pandas(frame, None, None)


def test_the_column_of_times_has_any_name():
    frame = pandas.DataFrame({"time": [1.0, 2.0], "t": [5.0, 6.0], "x": [0.1, 0.2]})
    for table in (frame, frame.set_index("time"), frame.set_index("t").assign(time=[1.0, 2.0])):
        record = kr.Record.from_pandas(table, {"spin": "x"}, t="time")
        assert record.t.tolist() == [1.0, 2.0] and record.series[0].values[:, 0].tolist() == [
            0.1,
            0.2,
        ]


def test_invalid_rows_of_a_file_are_numbered(tmp_path):
    file = tmp_path / "record.csv"
    for text, message in (
        ("t,spin\n0,1\n1,two\n", "row 2 has 'two', which is not a number$"),
        ("t,spin\n0,1\n1\n", "row 2 has 1 fields instead of 2"),
        ('t,spin\n0,"1,5"\n', "row 1 has '1,5', which is not a number; write decimal points"),
    ):
        file.write_text(text)
        with pytest.raises(ValueError, match=message):
            kr.Record.from_csv(file)


def test_records_are_read_only():
    record = kr.Record(T, {"specific_force": W}, 0.1, point=(1.0, 2.0, 3.0))
    [series] = record.series
    for array in (record.t, series.values, series.measured, series.sigma, record.point):
        assert not array.flags.writeable


def test_free_properties_are_names():
    with pytest.raises(TypeError, match="free must be names such as 'bias', not 3"):
        kr.Record(T, {"spin": T}, free=3)


def test_the_known_quantities_of_a_record_can_be_fitted():
    with pytest.raises(ValueError, match="unknown quantity 'height'; known are ") as refusal:
        kr.Record([0.0, 1.0], {"height": [1.0, 2.0]})
    known = str(refusal.value).partition("known are ")[2].split(", ")
    assert len(known) == len(set(known)) > 60
    assert not {"kowalewski", "goryachev_chaplygin"} & set(known)
