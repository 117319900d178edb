"""Tests of the messages about parameter changes that leave the measurements unchanged."""

import kreisel as kr
import numpy as np
import pytest
from kreisel._fit import identifiability
from kreisel._fit.parameters import FreeParameters, convert_scene_to_fit_point, expand_free_names
from kreisel._fit.residuals import ResidualModel
from kreisel._fit.uncertainty import classify_fit_directions

HEADING = "the heading: a rotation of the start about the vertical"
TURN_HEADING = "the heading: a rotation of the start and of turning about the vertical"
ATTITUDE = "the attitude in space, which a body without torque does not show"
SPIN_ANGLE = "the spin angle: a rotation of the start about the axis"
SPIN = "the moment about the axis against the spin: only their product counts"
ROTOR_SPIN = "the rotor against the spin: only the momentum about the axis counts"
ROTOR_MOMENT = "the rotor against the moment about its axis: only the momentum counts"
ACROSS = "damping across the axis, one way against the other: only their mean counts"
DELAY = "the delay against the start: a shift in time"
AXES = "the principal axes against the start"
PRODUCT = "{} against {}: only mass * gravity * com counts"
FACTOR = "the scale of the moments: moments, {} have an unknown common factor"
RATIOS = "the scale of the moments: only their ratios, and {} over moments, matter"

START = np.array((0.9, 0.3, 0.1, 0.3)) / np.linalg.norm((0.9, 0.3, 0.1, 0.3))
TURNING, SHAKING = (0.3, -0.1, 0.5), (0.05, 7.0, 0.4)


def top(moments=(1.0, 1.3, 0.6), com=(0.05, 0.1, 0.4), velocity=(3.0, 2.0, 12.0), **words):
    body = kr.Body(1.0, moments, com, rotor=words.pop("rotor", (0, 0, 0)), unphysical=True)
    return kr.Scene(body, attitude=START, body_velocity=velocity, gravity=9.81, **words)


FREE_BODY = {"com": (0.0, 0.0, 0.0), "velocity": (1.0, 2.0, 5.0)}
SYMMETRIC = {"moments": (1.0, 1.0, 0.6), "com": (0.0, 0.0, 0.4)}
SIDEWAYS = {"moments": (0.6, 1.0, 1.0), "com": (-0.4, 0.0, 0.0)}  # symmetric about the x axis
SPHERE = {"moments": (1.0, 1.0, 1.0), "com": (0.0, 0.0, 0.0)}


def make_model(scene, quantity, free, instrument=()):
    t = np.linspace(0.0, 4.0, 40)
    values = getattr(kr.solve(scene, t), quantity)
    record = kr.Record(t, {quantity: values}, 0.01, free=instrument)
    parameters = FreeParameters(scene, expand_free_names(free.split()), [record])
    return ResidualModel(parameters, [record], [record.series[0].sigma])


def list_invisible_changes(model):
    """Return the descriptions of parameter changes that leave the residuals unchanged."""
    parameters, found = model.parameters, []
    jacobian = model.evaluate_residuals(parameters.start).jacobian
    natural = model.estimate_parameter_scales(parameters.start)
    for sentence, change in identifiability._yield_unobservable_changes(
        parameters, parameters.start
    ):
        size = np.linalg.norm(change / natural)
        if size > 0.0 and np.linalg.norm(jacobian @ change) < 1e-9 * size:
            found.append(sentence)
    return found


def describe(model):
    parameters = model.parameters
    jacobian = model.evaluate_residuals(parameters.start).jacobian
    natural = model.estimate_parameter_scales(parameters.start)
    blind = classify_fit_directions(jacobian, natural, 1.0, parameters.size).blind
    names = parameters.list_user_parameters_and_jacobian(parameters.start)[0]
    return identifiability.describe_undetermined_directions(
        parameters, parameters.start, natural, blind, names
    )


CASES = {
    "heading": (top(), "body_velocity", "start", [HEADING]),
    "heading on a turning support": (
        top(turning=TURNING),
        "inertial_velocity",
        "start turning",
        [TURN_HEADING],
    ),
    "attitude without torque": (
        top(**FREE_BODY),
        "body_velocity",
        "attitude",
        [HEADING, *[ATTITUDE] * 3, SPIN_ANGLE],
    ),
    "attitude without torque on a turning support": (
        top(**FREE_BODY, turning=TURNING),
        "inertial_velocity",
        "start",
        [ATTITUDE] * 3,
    ),
    "spin angle of a top without nutation": (
        top(**{**SYMMETRIC, "velocity": (0.0, 0.0, 9.0)}),
        "apex",
        "attitude",
        [SPIN_ANGLE],
    ),
    "spin angle": (top(**SYMMETRIC), "apex", "start", [SPIN_ANGLE]),
    "spin": (top(**SYMMETRIC), "apex", "start moments", [SPIN_ANGLE, SPIN]),
    "spin about the x axis": (top(**SIDEWAYS), "apex", "start moments", [SPIN_ANGLE, SPIN]),
    "spin with damping": (
        top(**SYMMETRIC, damping=(0.05, 0.05, 0.07)),
        "apex",
        "start moments damping",
        [SPIN_ANGLE, SPIN],
    ),
    "rotor against spin": (
        top(**SYMMETRIC, rotor=(0.0, 0.0, 2.0)),
        "apex",
        "start rotor",
        [SPIN_ANGLE, ROTOR_SPIN],
    ),
    "rotor against moment": (
        top(**SIDEWAYS, rotor=(2.0, 0.0, 0.0)),
        "apex",
        "moments rotor",
        [ROTOR_MOMENT],
    ),
    "delay": (top(), "apex", "start", [DELAY]),
    "delay while shaking": (top(shaking=SHAKING), "apex", "start shaking", [DELAY]),
    "axes about the spin": (
        top(**{**SPHERE, "velocity": (0.0, 0.0, 5.0)}),
        "q",
        "attitude axes",
        [AXES],
    ),
    "axes of a sphere": (top(**SPHERE), "q", "start axes", [AXES] * 3),
    "products with com": (
        top(),
        "apex",
        "gravity mass com",
        [PRODUCT.format(*pair) for pair in (("gravity", "com"), ("mass", "com"))]
        + [PRODUCT.format("gravity", "mass")],
    ),
    "products with lever": (
        top(),
        "apex",
        "gravity mass lever",
        [PRODUCT.format(*pair) for pair in (("gravity", "lever"), ("mass", "lever"))]
        + [PRODUCT.format("gravity", "mass")],
    ),
    "gravity with shaking": (
        top(shaking=SHAKING),
        "apex",
        "gravity mass shaking",
        [PRODUCT.format("gravity", "mass")],
    ),
    "factor of the moments": (
        top(friction=0.3, damping=(0.1, 0.2, 0.3)),
        "apex",
        "moments damping friction gravity",
        [FACTOR.format("damping, friction and gravity")],
    ),
    "factor of the moments with a rotor": (
        top(rotor=(0.3, 0.5, 1.0)),
        "apex",
        "moments rotor lever",
        [FACTOR.format("damping, rotor and lever")],
    ),
    "factor of tied moments": (
        top(**SYMMETRIC, damping=0.1),
        "body_velocity",
        "velocity moments damping com",
        [FACTOR.format("damping and com")],
    ),
    "ratios of the moments": (
        top(**FREE_BODY, damping=(0.1, 0.2, 0.3)),
        "body_velocity",
        "velocity moments damping",
        [RATIOS.format("damping")],
    ),
    "ratios of the moments with a rotor": (
        top(**FREE_BODY, rotor=(0.3, 0.5, 1.0)),
        "body_velocity",
        "moments rotor",
        [RATIOS.format("damping and rotor")],
    ),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_the_changes_of_a_sentence_are_invisible(case):
    scene, quantity, free, sentences = case
    model = make_model(scene, quantity, free, "delay" if DELAY in sentences else ())
    found = list_invisible_changes(model)
    assert sorted(found) == sorted(sentences)
    texts = describe(model)
    assert set(texts) <= set(sentences) and len(texts) == len(set(texts))
    assert bool(texts) == bool(sentences) and texts[:1] == tuple(sentences[:1])


@pytest.mark.parametrize(
    "damping, change",
    [((0.03, 0.05, 0.07), 0.07), ((0.03, 0.07, 0.07), 0.07), (0.07, 0.07)],
)
def test_the_momentum_of_a_sleeping_top_shows_a_product_of_moment_and_spin(damping, change):
    """Check the momentum L of a sleeping top, which obeys L' = -damping L / moment."""
    body = kr.Body(1.0, (1.0, 1.2, 0.6), (0.0, 0.0, 0.4), unphysical=True)
    scene = kr.Scene(body, body_velocity=(0.0, 0.0, 9.0), gravity=9.81, damping=damping)
    model = make_model(scene, "m", "velocity moments damping")
    assert SPIN in list_invisible_changes(model) and SPIN in describe(model)
    *_, last = (
        step
        for sentence, step in identifiability._yield_unobservable_changes(
            model.parameters, model.parameters.start
        )
        if sentence == SPIN
    )
    assert last[model.parameters.get_parameter_slice("damping")][-1] == change


@pytest.mark.parametrize("axis", range(3))
def test_only_the_mean_of_the_damping_across_the_axis_counts(axis):
    com = 0.4 * np.eye(3)[axis]
    scene = top(com=com, damping=(0.05, 0.06, 0.07))
    parameters = FreeParameters(scene, ("damping",), [])
    changes = dict(identifiability._yield_unobservable_axial_changes(parameters, parameters.start))
    expected = np.roll((0.0, 1.0, -1.0), axis)
    assert changes[ACROSS].tolist() == expected.tolist()
    tied = FreeParameters(top(com=com, damping=0.05), ("damping",), [])
    assert not dict(identifiability._yield_unobservable_axial_changes(tied, tied.start))[
        ACROSS
    ].any()


def test_a_delay_of_some_instruments_is_no_shift_in_time():
    records = [
        kr.Record([0.0, 1.0], {"spin": [1.0, 2.0]}, 0.1, free=free) for free in ("delay", ())
    ]
    for part, count in ((records[:1], 1), (records[:1] * 2, 1), (records, 0), (records[1:], 0)):
        parameters = FreeParameters(top(), ("attitude", "velocity"), part)
        changes = [
            step
            for sentence, step in identifiability._yield_unobservable_clock_changes(
                parameters, parameters.start
            )
            if sentence == DELAY
        ]
        assert len(changes) == count
        assert all((step[6:] == 1.0).all() and len(step) == 6 + len(part) for step in changes)


@pytest.mark.parametrize(
    "turning, is_heading",
    [((0, 0, 0), False), ((0, 0, 1), False), ((1e-4, 0, 1), False), ((2e-3, 0, 1), True)],
)
def test_a_vertical_turning_has_no_heading(turning, is_heading):
    scene = top(turning=turning)
    parameters = FreeParameters(scene, ("attitude", "turning"), [])
    changes = dict(identifiability._yield_unobservable_changes(parameters, parameters.start))
    assert (TURN_HEADING in changes) == is_heading
    if is_heading:
        assert changes[TURN_HEADING][3:].tolist() == [0.0, turning[0], 0.0]


@pytest.mark.parametrize(
    "words, has_torque",
    [
        ({}, True),
        ({"com": (0.0, 0.0, 0.0)}, False),
        ({"gravity": 0.0}, False),
        ({"gravity": 0.0, "shaking": SHAKING}, True),
        ({"gravity": 0.0, "shaking": (0.0, 7.0, 0.4)}, False),
        ({"gravity": -0.05 * 49.0, "shaking": SHAKING}, True),
        ({"gravity": 0.05 * 49.0, "shaking": (-0.05, 7.0, 0.4)}, True),
    ],
)
def test_a_torque_needs_a_lever_and_gravity_or_shaking(words, has_torque):
    scene = top(com=words.pop("com", (0.05, 0.1, 0.4))).replace(**words)
    point = convert_scene_to_fit_point(scene)
    assert identifiability._has_gravity_or_shaking_torque(point) == has_torque


def test_an_unknown_direction_is_described_by_its_four_largest_components():
    describe_direction = identifiability._describe_parameter_direction
    names = ["a", "b", "c", "d", "e", "f"]
    assert describe_direction(np.array((0.05, 0.99, 0.0, 0.1, 0.0, 0.0)), names) == "b"
    assert describe_direction(np.array((0.0, 0.6, -0.8, 0.0, 0.05, 0.0)), names) == (
        "a combination of parameters: -0.80 c +0.60 b, in natural units"
    )
    text = describe_direction(np.array((0.2, 0.3, -0.4, 0.5, -0.45, 0.15)), names)
    assert text == (
        "a combination of parameters: +0.50 d -0.45 e -0.40 c +0.30 b, in natural units"
    )


@pytest.mark.parametrize("angle, is_heading", [(0.04, True), (0.05, False)])
def test_a_direction_near_a_symmetry_has_its_sentence(angle, is_heading):
    """Check the threshold 0.999, which lies between the cosines of 0.04 rad and 0.05 rad."""
    parameters = FreeParameters(top(), ("attitude", "gravity"), [])
    vertical = kr.solve(top(), [0.0]).body_vertical[0]
    blind = np.append(np.cos(angle) * vertical, np.sin(angle))[:, None]
    names = ["attitude_x", "attitude_y", "attitude_z", "gravity"]
    [sentence] = identifiability.describe_undetermined_directions(
        parameters, parameters.start, np.ones(4), blind, names
    )
    assert (sentence == HEADING) == is_heading
    assert is_heading or sentence.startswith("a combination of parameters: +0.")


def test_the_symmetries_of_an_upright_top_are_the_same_direction():
    """Check that a second direction is not taken for the spin angle, which is the heading here."""
    scene = top(com=(0.0, 0.0, 0.4)).replace(attitude=(np.cos(5e-3), np.sin(5e-3), 0.0, 0.0))
    parameters = FreeParameters(scene, ("attitude", "gravity"), [])
    vertical = kr.solve(scene, [0.0]).body_vertical[0]
    other = np.array((0.0, 0.1, 0.0, 1.0))
    blind = np.linalg.qr(np.column_stack((np.append(vertical, 0.0), other)))[0]
    names = ["attitude_x", "attitude_y", "attitude_z", "gravity"]
    heading, sentence = identifiability.describe_undetermined_directions(
        parameters, parameters.start, np.ones(4), blind, names
    )
    assert heading == HEADING and "gravity" in sentence
    both = np.column_stack((np.eye(4)[:, :3], other / np.linalg.norm(other)))
    sentences = identifiability.describe_undetermined_directions(
        parameters, parameters.start, np.ones(4), np.linalg.qr(both)[0], names
    )
    assert sentences[:2] == (HEADING, SPIN_ANGLE)


def test_changes_of_moments_are_described_instead_of_second_moments_of_mass():
    """Check that a change of the density along axis 3 is one of the moments I1 and I2."""
    parameters = FreeParameters(top(), ("moments",), [])
    for direction, names in zip(np.eye(3), (("I2", "I3"), ("I1", "I3"), ("I1", "I2")), strict=True):
        [sentence] = identifiability.describe_undetermined_directions(
            parameters, parameters.start, np.ones(3), direction[:, None], ["I1", "I2", "I3"]
        )
        assert all(f"+0.71 {name}" in sentence for name in names) and sentence.count(" I") == 2


def test_directions_without_a_symmetry_are_described_after_the_symmetries():
    parameters = FreeParameters(top(), ("attitude", "gravity"), [])
    names = ["attitude_x", "attitude_y", "attitude_z", "gravity"]
    sentences = identifiability.describe_undetermined_directions(
        parameters, parameters.start, np.array((1.0, 1.0, 1.0, 2.0)), np.eye(4), names
    )
    assert sentences[:2] == (HEADING, SPIN_ANGLE) and len(sentences) == 4
    assert sum("gravity" in sentence for sentence in sentences) == 1


@pytest.mark.parametrize("size, is_heading", [(1e7, True), (1e9, False)])
def test_changes_without_effect_on_the_parameters_are_skipped(size, is_heading):
    """Check that rotations by 1e-7 of the natural size are described, but not those by 1e-9."""
    parameters = FreeParameters(top(), ("attitude",), [])
    sentences = identifiability.describe_undetermined_directions(
        parameters, parameters.start, np.full(3, size), np.eye(3), ["x", "y", "z"]
    )
    assert (sentences[:2] == (HEADING, SPIN_ANGLE)) == is_heading and len(sentences) == 3


def test_symmetries_after_one_without_effect_are_described():
    """Check that a symmetry that changes no parameter is skipped and the next is described."""
    scene = top(**{**SPHERE, "velocity": (0.0, 0.0, 5.0)}, damping=0.1)
    parameters = FreeParameters(scene, ("attitude", "damping", "axes"), [])
    blind = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])[:, None] / np.sqrt(2.0)
    assert identifiability.describe_undetermined_directions(
        parameters, parameters.start, np.ones(7), blind, list("abcdefg")
    ) == (AXES,)


@pytest.mark.parametrize(
    "words",
    [
        {"damping": (0.0, 0.1, 0.0)},
        {"friction": 0.3},
        {"rotor": (0.0, 0.5, 0.0)},
        {"rotor": (0.0, 0.5, 0.0), "gravity": 0.0},
    ],
)
def test_moments_have_a_scale_beside_a_fixed_torque_or_rotor(words):
    gravity = words.pop("gravity", 9.81)
    for scene, count in ((top(), 1 + bool(gravity)), (top(**words), 0)):
        parameters = FreeParameters(
            scene.replace(gravity=gravity), ("moments", "com", "gravity"), []
        )
        sentences = dict(identifiability._yield_unobservable_changes(parameters, parameters.start))
        assert sum("the scale of the moments" in one for one in sentences) == count


@pytest.mark.parametrize("com, axis", [((0.3, -0.4, 1.2), (3, -4, 12)), ((0, 0, 0), (0, 0, 13))])
def test_the_axis_is_the_unit_vector_to_the_centre_of_mass(com, axis):
    parameters = FreeParameters(top(com=com), ("attitude", "velocity"), [])
    first, second = (
        change
        for sentence, change in identifiability._yield_unobservable_axial_changes(
            parameters, parameters.start
        )
        if sentence == SPIN_ANGLE
    )
    unit = np.array(axis) / 13.0
    assert first == pytest.approx([*unit, 0.0, 0.0, 0.0])
    assert second == pytest.approx([*unit, *np.cross((3.0, 2.0, 12.0), unit)])
