"""Tests of the fit parameters: names, scales and bounds, and conversion from and to scenes."""

from dataclasses import replace

import kreisel as kr
import numpy as np
import pytest
from kreisel._fit import parameters as module
from kreisel._fit.parameters import FreeParameters, convert_scene_to_fit_point, expand_free_names

MOMENTS, COM = (1.0, 1.3, 0.7), (0.3, -0.4, 1.2)
ROTATION = np.array((0.8, -0.3, 0.4, 0.2)) / np.linalg.norm((0.8, -0.3, 0.4, 0.2))
SHAKING = (0.05, 7.0, 0.4)
TURNING = (0.3, -0.2, 0.5)


def make_scene(moments=MOMENTS, com=COM, turn=None, rotor=(0.0, 0.0, 0.0), **words):
    body = kr.Body(1.1, moments, com, rotor=rotor, unphysical=True)
    words = {"body_velocity": (1.0, 2.0, 2.0), "gravity": 1.3, "attitude": ROTATION} | words
    return kr.Scene(body if turn is None else body.turn(turn), **words)


def make_parameters(free, scene=None, records=()):
    return FreeParameters(scene or make_scene(), expand_free_names(free.split()), records)


def get_scales(free, scene=None, span=2.0, records=()):
    parameters = make_parameters(free, scene, records)
    scales = parameters.estimate_parameter_scales(parameters.start, span)
    return {name: scales[part] for (name, *_), part in parameters.slices.items()}


@pytest.mark.parametrize(
    "free, words, expected",
    [
        ("attitude axes", {}, {"attitude": 1.0, "axes": 1.0}),
        ("velocity", {}, {"velocity": 3.0}),
        ("velocity", {"body_velocity": (0.0, 0.0, 0.0)}, {"velocity": 0.5}),
        # The densities are (0.5, 0.2, 0.8), half the sum of the moments minus each of them.
        ("moments", {}, {"moments": 1.3}),
        # Here they are (0.4995, 0.0005, 0.5005) and (0.5, 0, 0.5).
        ("moments", {"moments": (0.501, 1.0, 0.5)}, {"moments": (1.0, 0.05, 1.0)}),
        ("moments", {"moments": (0.5, 1.0, 0.5)}, {"moments": (1.0, 5e-4)}),
        # (0.001, 0.001, 0.5), of which the first two stay equal.
        ("moments", {"moments": (0.501, 0.501, 0.002)}, {"moments": (0.1, 0.501)}),
        ("com", {}, {"com": 1.3}),
        ("lever", {}, {"lever": 1.3}),
        ("com", {"com": (0.0, 0.0, 0.0)}, {"com": 1.0}),
        ("gravity mass", {}, {"gravity": 1.3, "mass": 1.1}),
        ("gravity", {"gravity": -2.0}, {"gravity": 2.0}),
        ("gravity", {"gravity": 0.0}, {"gravity": 1.0}),
        ("damping", {}, {"damping": 0.0065}),
        ("damping", {"damping": (0.1, 0.0, 0.3)}, {"damping": 0.3}),
        ("friction", {}, {"friction": 0.0195}),
        ("friction", {"friction": 0.4}, {"friction": 0.4}),
        ("rotor", {}, {"rotor": 3.9}),
        ("rotor", {"rotor": (3.0, 4.0, 0.0)}, {"rotor": 5.0}),
        ("turning", {"body_velocity": (0.0, 0.0, 0.0), "turning": (3.0, 4.0, 0.0)}, {"turning": 5}),
        ("turning", {}, {"turning": 3.0}),
        ("shaking", {"shaking": SHAKING}, {"shaking": (0.05, 0.5, 1.0)}),
        ("shaking", {"shaking": (-0.05, 7.0, 0.4)}, {"shaking": (0.05, 0.5, 1.0)}),
        ("shaking", {"shaking": (0.0, 6.0, 0.4)}, {"shaking": (1.3 * 0.25, 0.5, 1.0)}),
    ],
)
def test_scales_are_the_sizes_of_the_parameters(free, words, expected):
    found = get_scales(free, make_scene(**words))
    assert found.keys() == expected.keys()
    for name, value in expected.items():
        assert found[name] == pytest.approx(np.broadcast_to(value, found[name].shape), rel=1e-9)


def test_scales_of_instruments():
    """Check that a bias is scaled by the spread of the readings, or their maximum if constant."""
    values = {"spin": [1.0, 3.0], "body_velocity": [[0.0, 0.6, 0.8]] * 2}
    record = kr.Record([0.0, 2.0], values, 0.1, free=("bias", "scale", "delay", "mounting"))
    parameters = make_parameters("attitude", records=[record])
    scales = parameters.estimate_parameter_scales(parameters.start, 2.0)
    found = {(name, label): scales[part] for (name, _, label), part in parameters.slices.items()}
    assert found["bias", "spin"] == pytest.approx([1.0])
    assert found["bias", "body_velocity"] == pytest.approx([0.8] * 3)
    assert found["scale", "spin"].tolist() == [1.0] and found["mounting", ""].tolist() == [1.0] * 3
    assert found["delay", ""] == pytest.approx([1.0 / 3.0])
    assert parameters.size == 3 + 4 + 4 + 3 + 1
    start = {
        (name, label): value.tolist()
        for (name, _, label), value in parameters.start.instruments.items()
    }
    assert start == {
        ("bias", "spin"): [0.0],
        ("bias", "body_velocity"): [0.0] * 3,
        ("scale", "spin"): [1.0],
        ("scale", "body_velocity"): [1.0] * 3,
        ("mounting", ""): [1.0, 0.0, 0.0, 0.0],
        ("delay", ""): [0.0],
    }


def test_steps_change_each_parameter_and_stop_at_its_bound():
    scene = make_scene(shaking=SHAKING, damping=(0.1, 0.2, 0.3), friction=0.2, turning=TURNING)
    parameters = make_parameters(
        "start moments com gravity mass damping friction rotor turning shaking", scene
    )
    point = parameters.start
    step = np.linspace(0.01, 0.29, parameters.size)
    part = {name: step[where] for (name, *_), where in parameters.slices.items()}
    there = parameters.add_step_within_bounds(point, step)
    for name, attribute in (
        *(("velocity", "rate"), ("com", "com"), ("rotor", "rotor"), ("turning", "turning")),
        *(("shaking", "shaking"), ("damping", "damping"), ("moments", "densities")),
    ):
        change = getattr(there, attribute) - getattr(point, attribute)
        assert change == pytest.approx(part[name])
    for name in ("gravity", "mass", "friction"):
        assert getattr(there, name) - getattr(point, name) == pytest.approx(part[name][0])
    turned = parameters.to_scene(there)
    assert turned.attitude != scene.attitude and there.attitude @ there.attitude == pytest.approx(1)
    low = parameters.add_step_within_bounds(point, np.full(parameters.size, -5.0))
    assert low.mass == pytest.approx(1e-3 * point.mass) and low.friction == 0.0
    assert not low.damping.any() and not low.densities.any() and low.gravity == 1.3 - 5.0
    assert low.shaking == pytest.approx((4.95, 2.0, 0.4 - 5.0 + np.pi))


@pytest.mark.parametrize(
    "start, step, expected",
    [
        (SHAKING, (-0.15, -1.0, 0.0), (0.1, 6.0, 0.4 - np.pi)),
        ((0.05, 7.0, -0.4), (-0.15, 0.0, 0.0), (0.1, 7.0, -0.4 + np.pi)),
        ((0.0, 7.0, 0.4), (-0.1, 0.0, 0.1), (0.1, 7.0, 0.5 - np.pi)),
        ((-0.05, 7.0, 0.4), (-0.15, 0.0, 0.1), (-0.2, 7.0, 0.5)),
        (SHAKING, (-0.05, -9.0, 0.0), (0.0, 0.007, 0.4)),
    ],
)
def test_the_shaking_rate_stays_positive_and_the_amplitude_keeps_its_sign(start, step, expected):
    parameters = make_parameters("shaking", make_scene(shaking=start))
    found = parameters.add_step_within_bounds(parameters.start, np.array(step)).shaking
    assert found == pytest.approx(expected, abs=1e-15)
    angle = np.array((0.0, 0.3))
    same = np.add(start, step) if step[1] > -9.0 else np.array(expected)
    motion = [a * np.cos(rate * angle + phase) for a, rate, phase in (found, same)]
    assert motion[0] == pytest.approx(motion[1], abs=1e-15)


def test_distances_to_bounds_are_means_of_equal_parameters():
    scene = make_scene((1.0, 1.0, 0.6), damping=(0.3, 0.3, 0.1), friction=0.2)
    parameters = make_parameters("velocity moments damping friction", scene)
    distances = parameters.compute_distances_to_lower_bounds(parameters.start)
    assert np.isinf(distances[:3]).all()
    assert distances[3:] == pytest.approx([0.3, 0.7, 0.3, 0.1, 0.2])


@pytest.mark.parametrize(
    "values, is_equal",
    [
        ((1.0, 1.3, 1.0), True),
        ((1.0, 1.3, 1.0 + 1.2e-12), True),
        ((1.0, 1.3, 1.0 + 1.4e-12), False),
        ((0.0, 1.0, 1e-12), True),
        ((0.0, -1.0, 1e-12), True),
    ],
)
def test_equal_moments_stay_equal(values, is_equal):
    """Check that moments are equal if they differ by at most 1e-12 of the largest of them."""
    groups = module._build_equal_group_matrix(np.array(values))
    assert groups.T.tolist() == ([[1, 0, 1], [0, 1, 0]] if is_equal else np.eye(3).tolist())
    assert module._build_equal_group_matrix(np.full(3, 2.0)).tolist() == [[1.0]] * 3
    assert module._build_equal_group_matrix(np.array((2.0, 1.0, 1.0))).T.tolist() == [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 1.0],
    ]


def test_names_are_expanded_in_a_fixed_order():
    assert expand_free_names("start") == ("attitude", "velocity")
    assert expand_free_names(["mass", "moments", "start"]) == (
        *("attitude", "velocity", "moments", "mass"),
    )
    with pytest.raises(TypeError, match="free must be names such as"):
        expand_free_names(3)


@pytest.mark.parametrize(
    "words, is_refused",
    [
        ({"free": "axes", "rotor": (0.0, 0.0, 1.0)}, True),
        ({"free": "axes rotor"}, True),
        ({"free": "axes"}, False),
        ({"free": "moments", "rotor": (0.0, 0.0, 1.0)}, False),
        ({"free": "com", "com": (0, 0, 0), "friction": 0.1}, True),
        ({"free": "com friction", "com": (0, 0, 0)}, True),
        ({"free": "com", "com": (0, 0, 0)}, False),
        ({"free": "com", "friction": 0.1}, False),
        ({"free": "moments", "com": (0, 0, 0), "friction": 0.1}, False),
        ({"free": "moments", "com": (0, 0, 0), "friction": 0.1, "turn": ROTATION}, True),
        ({"free": "shaking"}, True),
        ({"free": "shaking", "shaking": (0.0, 1.0, 0.0)}, False),
        ({"free": "lever", "com": (0, 0, 0)}, True),
    ],
)
def test_parameters_need_derivatives(words, is_refused):
    words = dict(words)
    free = words.pop("free")
    scene = make_scene(**words)
    if is_refused:
        with pytest.raises(ValueError, match=f"{free.split()[0]} (is|cannot be) free"):
            make_parameters(free, scene)
    else:
        assert make_parameters(free, scene).size


def test_the_point_of_a_scene_has_its_numbers():
    scene = make_scene(
        rotor=(0.1, 0.2, 0.3), turning=TURNING, shaking=SHAKING, friction=0.2, turn=ROTATION
    )
    point = convert_scene_to_fit_point(scene)
    assert sorted(point.moments) == pytest.approx(sorted(MOMENTS), abs=1e-15)
    assert point.densities.sum() - point.densities == pytest.approx(point.moments)
    assert point.gravity_force == pytest.approx(1.1 * 1.3)
    path = kr.solve(scene, [0.0])
    rotation = module.rotation_matrix(point.axes)
    assert rotation @ point.rate == pytest.approx(path.body_velocity[0])
    assert rotation @ point.inertial_velocity == pytest.approx(path.inertial_velocity[0])
    again = module.rotation_matrix(point.attitude) @ point.momentum
    assert again == pytest.approx(np.array(scene.momentum))
    q, m = np.array(point.attitude), np.array(scene.momentum)
    assert point.relative_angular_velocity(q, m) == pytest.approx(point.rate)
    assert point.is_support_turning
    assert not replace(point, turning=np.zeros(3)).is_support_turning
    assert replace(point, turning=np.array((0.0, 0.5, 0.0))).is_support_turning
    assert replace(point, shaking=np.array((0.05, 7.0, 0.0))).shift_shaking_phase(0.0)


def test_moments_are_at_least_tiny():
    point = convert_scene_to_fit_point(make_scene())
    rod = replace(point, densities=np.array((0.0, 0.0, 2.0)))
    assert rod.moments.tolist() == [2.0, 2.0, 2e-12]


def test_the_effective_gravity_is_that_of_a_shaken_support():
    """Check that a support at the height a cos(w t + phase) adds its acceleration to gravity."""
    t, h = np.array((0.0, 0.1, 0.7)), 1e-4
    point = convert_scene_to_fit_point(make_scene(shaking=SHAKING))
    a, w, phase = SHAKING
    height = [a * np.cos(w * (t + k * h) + phase) for k in (-1, 0, 1)]
    acceleration = (height[0] - 2.0 * height[1] + height[2]) / h**2
    assert point.compute_effective_gravity(t) == pytest.approx(1.3 + acceleration, abs=1e-5)
    assert point.shift_shaking_phase(0.0) == pytest.approx(SHAKING)
    shifted = point.shift_shaking_phase(0.3)
    assert np.cos(shifted[2]) == pytest.approx(np.cos(0.4 + 2.1))
    assert replace(point, shaking=np.zeros(3)).shift_shaking_phase(0.3) is None


def test_friction_that_replaces_zero_is_tiny_against_the_energy():
    """Compare with 1e-12 of the energy scale 1.3 |w|^2 + m g |com| = 11.7 + 1.859 of the top."""
    parameters = make_parameters("friction")
    scene = parameters.build_differentiable_scene(parameters.start)
    assert scene.friction == pytest.approx(1e-12 * (11.7 + 1.1 * 1.3 * 1.3), rel=1e-9, abs=0.0)
    rest = make_scene(body_velocity=(0.0, 0.0, 0.0), gravity=0.0)
    parameters = make_parameters("friction", rest)
    friction = parameters.build_differentiable_scene(parameters.start).friction
    assert friction == pytest.approx(1.3e-12, rel=1e-9, abs=0.0)
    for free, friction in (("mass", 0.0), ("friction", 0.25)):
        parameters = make_parameters(free, make_scene(friction=friction))
        assert parameters.build_differentiable_scene(parameters.start).friction == friction


@pytest.mark.parametrize("com, is_physical", [(0.5, True), (0.7, True), (0.8, False)])
def test_a_body_is_physical_if_its_second_moments_exceed_those_of_its_centre(com, is_physical):
    """Check that a body is unphysical if mass * com_z^2 exceeds its second moment along z, 0.8."""
    point = convert_scene_to_fit_point(make_scene(com=(0.0, 0.0, com)))
    assert module._is_physical(replace(point, mass=1.5)) == is_physical
    line = replace(point, com=np.array((0.0, 0.0, 1.0)), densities=np.array((0.0, 0.0, 1.5)))
    assert module._is_physical(replace(line, mass=1.5))


@pytest.mark.parametrize("turn", [None, ROTATION])
@pytest.mark.parametrize(
    "free", ["start", "moments", "com", "lever", "axes", "rotor", "moments damping axes com"]
)
def test_a_point_without_a_step_is_its_scene(free, turn):
    rotor = (0.1, 0.2, 0.3) if free in ("start", "rotor", "moments") else (0.0, 0.0, 0.0)
    scene = make_scene(turn=turn, rotor=rotor, damping=(0.1, 0.2, 0.3), turning=TURNING)
    parameters = make_parameters(free, scene)
    again = parameters.to_scene(parameters.start)
    t = np.linspace(0.0, 1.0, 3)
    paths = [kr.solve(one, t) for one in (scene, again)]
    for name in ("q", "m", "body_velocity", "energy"):
        values = [getattr(path, name) for path in paths]
        assert np.allclose(*values, rtol=1e-9, atol=1e-9)
    assert np.allclose(again.body.inertia, scene.body.inertia, atol=1e-14)
    assert np.allclose(again.body.com, scene.body.com, atol=1e-14)
    if free == "start":
        assert again.body == scene.body


def test_names_and_units_of_parameters():
    record = kr.Record([0.0], {"body_velocity_x": [1.0], "frame": [np.eye(3)]}, 0.1, free="bias")
    scene = make_scene((1.0, 1.0, 0.6), damping=(0.1, 0.1, 0.3), shaking=SHAKING)
    parameters = make_parameters("velocity moments lever damping shaking", scene, [record])
    names, units, values, _ = parameters.list_user_parameters_and_jacobian(parameters.start)
    rows = [
        *((f"body_velocity_{x}", "rad/T", w) for x, w in zip("xyz", (1.0, 2.0, 2.0), strict=True)),
        *(("I1 = I2", "M L^2", 1.0), ("I3", "M L^2", 0.6), ("lever", "L", 1.3)),
        *(("damping_1 = damping_2", "M L^2 T^-1", 0.1), ("damping_3", "M L^2 T^-1", 0.3)),
        *(("shaking_amplitude", "L", 0.05), ("shaking_rate", "rad/T", 7.0)),
        *(("shaking_phase", "rad", 0.4), ("bias[0].body_velocity_x", "rad/T", 0.0)),
        *((f"bias[0].frame_{k}", "", 0.0) for k in range(9)),
    ]
    assert names == [row[0] for row in rows] and units == [row[1] for row in rows]
    assert values == pytest.approx([row[2] for row in rows])


def test_the_lever_is_along_the_centre_of_mass():
    parameters = make_parameters("lever", make_scene(com=(0.03, -0.04, 0.12)))
    assert parameters.lever == pytest.approx(np.array((3.0, -4.0, 12.0)) / 13.0)
    there = parameters.add_step_within_bounds(parameters.start, np.array([0.13]))
    assert there.com == pytest.approx((0.06, -0.08, 0.24))
    assert not make_parameters("mass", make_scene(com=(0.0, 0.0, 0.0))).lever.any()
