"""Tests of ensembles with varied, scattered or random parameters."""

import math

import kreisel as kr
import numpy as np
import pytest
from internals import core
from kreisel._model import variation
from tops import CORNER, FREE, GENERAL, LAGRANGE

BODY = kr.Body.cone(1, 2, (0, 0, 0), mass=1)
TOP = kr.Scene.spinning(BODY, spin=10, tilt=0.3, gravity=1)
MOVING = kr.Scene.from_euler(BODY, (1, 0.7, 2), (0.3, 0.4, 5), gravity=2)
SPIN, TILT = np.linspace(0, 20, 5)[:, None], np.linspace(0, 1, 3)
EACH = np.ones((4, 3))


@pytest.mark.parametrize(
    ("tops", "axes"),
    [
        (TOP.vary(spin=SPIN, tilt=TILT), ("spin", "tilt")),
        (TOP.vary(spin=SPIN[:, 0]), ("spin",)),
        (TOP.vary(momentum=EACH), ("top",)),
        (TOP.vary(momentum=EACH, gravity=[[1], [2]]), ("gravity", "dim_1")),
        (TOP.vary(spin=SPIN, tilt=0.1 * SPIN, gravity=TILT), ("dim_0", "gravity")),
        (TOP.vary(spin=SPIN * TILT), ("dim_0", "dim_1")),
        (TOP.vary(mass=[1, 0.9], gravity=[[1.0]]), ("gravity", "mass")),
        (TOP.vary(gravity=3.0), ()),
        (
            kr.Ensemble(
                kr.Bodies.cone([1, 2], 2, (0, 0, 0), mass=1), momentum=(0, 0, 1), gravity=1
            ),
            ("radius",),
        ),
        (TOP.vary(spin=SPIN, tilt=TILT)[1:, 2], ("spin",)),
        (TOP.vary(spin=SPIN, tilt=TILT)[2], ("tilt",)),
        (TOP.vary(spin=SPIN, tilt=TILT)[:, [2, 0]], ("spin", "tilt")),
        (TOP.vary(spin=SPIN, tilt=TILT)[[0, 1], [1, 2]], ("top",)),
        (TOP.vary(spin=SPIN, tilt=TILT)[..., None], ("spin", "tilt", "dim_2")),
        (TOP.vary(spin=SPIN, tilt=TILT).ravel(), ("top",)),
    ],
)
def test_a_parameter_that_varies_alone_names_its_axis(tops, axes):
    assert tops.axes == axes


def test_varied_parameters_are_stored_as_given():
    tops = TOP.vary(spin=SPIN, tilt=TILT)
    assert [*tops.coords] == ["spin", "tilt"] and np.array_equal(tops.coords["spin"], SPIN)
    assert np.array_equal(np.ravel(tops.coords["tilt"]), TILT)
    few = tops[[3, 1], 1:]
    assert np.array_equal(few.coords["spin"], SPIN[[3, 1]])
    assert np.array_equal(np.ravel(few.coords["tilt"]), TILT[1:])
    assert np.array_equal(TOP.vary(momentum=EACH).coords["momentum"], EACH)
    assert repr(tops) == "<Ensemble of shape (5, 3): spin 0 .. 20, tilt 0 .. 1>"
    assert repr(TOP.vary(spin=3)) == "<Ensemble of shape (): all equal>"
    with pytest.raises(TypeError):
        tops.coords["spin"] = TILT


def test_varied_spin_and_tilt_equal_scene_spinning():
    tops = TOP.vary(spin=SPIN, tilt=TILT)
    steady = TOP.vary(spin=30 + SPIN, tilt=TILT, steady=True)
    degrees = TOP.vary(spin=20, tilt=[10, 20], precession=3, degrees=True)
    for i, j in np.ndindex(5, 3):
        spin, tilt = SPIN[i, 0], TILT[j]
        assert tops[i, j]._block == kr.Scene.spinning(BODY, spin, tilt, gravity=1)._block
        one = kr.Scene.spinning(BODY, 30 + spin, tilt, steady=True, gravity=1)
        assert steady[i, j]._block == one._block
    assert degrees[1] == kr.Scene.spinning(BODY, 20, 20, 3, degrees=True, gravity=1)
    tilt_tops = TOP.vary(spin=TILT)
    assert all(
        kr.solve(top, [0.0]).nutation[0] == pytest.approx(0.3, abs=1e-15) for top in tilt_tops
    )


@pytest.mark.parametrize(
    "words",
    [
        {"spin": float(kr.solve(MOVING, [0.0]).spin[0])},
        *({"tilt": 0.7}, {"precession": 0.3}, {"angles": (1, 0.7, 2)}, {"rates": (0.3, 0.4, 5)}),
        *({"gravity": 2}, {"com": BODY.com}, {"attitude": MOVING.attitude}, {}),
    ],
    ids=str,
)
def test_unvaried_parameters_equal_those_of_the_scene(words):
    top = MOVING.vary(**words)[()]
    np.testing.assert_allclose(top.momentum, MOVING.momentum, rtol=0, atol=1e-14)
    assert kr.attitude_error(top.attitude, MOVING.attitude) < 1e-15
    assert (top.gravity, top.body, top.damping) == (2.0, BODY, (0.0, 0.0, 0.0))


@pytest.mark.parametrize("scene", [GENERAL, FREE, LAGRANGE], ids=["general", "free", "lagrange"])
def test_any_body_has_a_spin_and_a_tilt(scene):
    tops = scene.vary(spin=[1.0, -2.0], tilt=[[0.5], [2.5]])
    before = kr.solve(scene, [0.0])
    for i, j in np.ndindex(2, 2):
        path = kr.solve(tops[i, j], [0.0])
        assert path.spin[0] == pytest.approx([1.0, -2.0][j], abs=1e-13)
        assert path.nutation[0] == pytest.approx([0.5, 2.5][i], abs=1e-13)
        assert path.precession_angle[0] == pytest.approx(before.precession_angle[0], abs=1e-13)
        assert path.spin_angle[0] == pytest.approx(before.spin_angle[0], abs=1e-13)


def test_bodies_vary_and_the_start_stays():
    tops = TOP.vary(mass=[1, 0.5], gravity=[[1], [2], [3]])
    assert tops[2, 1] == TOP.replace(body=kr.Body(0.5, BODY.inertia, BODY.com), gravity=3.0)
    cones = kr.Bodies.cone([1, 2], 2, (0, 0, 0), mass=1)
    assert TOP.vary(body=cones)[1] == TOP.replace(body=cones[1])
    spinning_tops = TOP.vary(body=cones, spin=3.0, tilt=0.5)
    assert spinning_tops[1]._block == kr.Scene.spinning(cones[1], 3.0, 0.5, gravity=1)._block
    damped = LAGRANGE.replace(damping=0.1).vary(spin=[1, 2])
    assert damped[0].damping == (0.1, 0.1, 0.1)


WIDTHS = [
    {"momentum": 0.1},
    {"attitude": (0.1, 0, 0.2)},
    {"gravity": 0.3},
    {"momentum": (0, 0, 0.1), "attitude": 0.2, "gravity": 0.4},
]


@pytest.mark.parametrize("widths", WIDTHS, ids=str)
def test_a_random_start_depends_only_on_seed_and_index(widths):
    few, many = TOP.scatter(10, seed=3, **widths), TOP.scatter(9000, seed=3, **widths)
    assert few[3]._block == many[3]._block and few == many[:10] and few[5:] == many[5:10]
    assert few != TOP.scatter(10, seed=4, **widths) and few.axes == ("top",)
    assert few[0] != few[1] and len(TOP.scatter(0, **widths)) == 0


def test_parameters_are_scattered_independently_and_normally():
    n = 100_000
    all_three = TOP.scatter(n, seed=1, momentum=(0.1, 0.2, 0.0), attitude=0.05, gravity=0.3)
    assert np.array_equal(all_three.gravity, TOP.scatter(n, seed=1, gravity=0.3).gravity)
    offsets = (all_three.momentum - TOP.momentum)[:, :2] / (0.1, 0.2)
    normal = np.column_stack([offsets, (all_three.gravity - 1) / 0.3])
    assert np.all(all_three.momentum[:, 2] == TOP.momentum[2])
    # The tolerances are five standard errors of estimates from n normally distributed numbers.
    np.testing.assert_allclose(normal.mean(axis=0), 0, atol=5 / n**0.5)
    np.testing.assert_allclose(np.cov(normal.T), np.eye(3), atol=5 * (2 / n) ** 0.5)
    np.testing.assert_allclose((normal**4).mean(axis=0), 3, atol=5 * (96 / n) ** 0.5)
    turns = kr.attitude_error(all_three.attitude, TOP.attitude)
    assert (turns**2).mean() / 3 == pytest.approx(0.05**2, rel=5 * (2 / 3 / n) ** 0.5)


def test_random_starts_are_the_same_on_every_machine():
    start = TOP.scatter(1, seed=7, momentum=1.0).momentum[0] - TOP.momentum
    raw = np.random.Philox(key=7).random_raw(8)
    x, y = (float(int(word) >> 11) * 2.0**-53 for word in (raw[0], raw[4]))
    expected = np.sqrt(-2 * np.log(x + 2.0**-53)) * np.cos(2 * np.pi * y)
    assert start[0] == pytest.approx(expected, abs=1e-14)


def test_initial_quantities_of_tops_are_available():
    tops = TOP.vary(spin=SPIN, tilt=TILT)
    energies = tops._core_scenes.values("energy").reshape(tops.shape)
    assert energies[2, 1] == kr.solve(tops[2, 1], [0.0]).energy[0]
    angles = np.linspace(-10, 10, 7)
    assert core.cosine(angles).tolist() == [core.cosine(angle) for angle in angles]


NAN = np.ones((4, 20, 3))
NAN[3, 17] = np.nan, 0, 1
LONG_Q = np.array([[1.0, 0, 0, 0], [1, 1, 0, 0]])
REFUSED = {
    r"^momentum\[3, 17\] = \(nan, 0.0, 1.0\): momentum must be finite": {"momentum": NAN},
    r"^attitude\[1\] = .*: the attitude must be a unit quat.* 1.414.*divide": {"attitude": LONG_Q},
    r"^attitude_xyzw\[1\] = .* must be a unit quaternion": {"attitude_xyzw": LONG_Q},
    r"^gravity\[1\] = inf: gravity must be finite": {"gravity": [1, np.inf]},
    r"^gravity must be finite .* not nan": {"gravity": np.nan},
    r"^damping\[1\] = \(-1.0,\): damping must not be negative, not -1.0: it": {
        "damping": [[1.0], [-1.0]]
    },
    r"^damping\[1, 0\] = \(-1.0,\): damping must not be negative, not -1.0: it": {
        "damping": [[[1.0]], [[-1.0]]]
    },
    r"^damping must not be negative, not -0.5: it": {"damping": [-0.5]},
    r"^damping must not be negative, not -0.25: it": {"damping": -0.25},
    r"^damping\[1\] = \(0.0, -1.0, 0.0\): damping must not be neg": {
        "damping": [(0, 0, 0), (0, -1, 0)]
    },
    r"^the shapes .* cannot be broadcast together: momentum \(4,\), gravity \(3,\)": {
        "gravity": [1, 2, 3]
    },
    r"damping must be 3 numbers, or 1, or an array whose last": {"damping": [1, 2]},
    r"momentum must be 3 numbers, or an array whose last dimension": {"momentum": [1, 2]},
    r"exactly one of momentum.*, not momentum and velocity": {"velocity": EACH},
    r"exactly one of momentum.*, not none": {"momentum": None},
    r"either attitude or attitude_xyzw": {"attitude": LONG_Q, "attitude_xyzw": LONG_Q},
    r"^top\[1\]: an argument is missing, not finite": {
        "momentum": None,
        "velocity": [(0, 0, 1), (1e308, 1e308, 1e308)],
    },
}


@pytest.mark.parametrize("message", REFUSED)
def test_the_first_invalid_top_is_named(message):
    with pytest.raises(ValueError, match=message):
        kr.Ensemble(CORNER, **({"momentum": EACH, "gravity": 1} | REFUSED[message]))


OTHERS = {
    "tilt[1] = 4.0: tilt must lie between 0 and pi": lambda: TOP.vary(tilt=[0, 4]),
    "tilt[0] = 190.0: tilt must lie between 0 and 180": lambda: TOP.vary(tilt=[190], degrees=True),
    "top[0]: there is no steady precession": lambda: TOP.vary(spin=[0, 40], tilt=0.5, steady=True),
    "the smallest spin with one is": lambda: kr.Ensemble.spinning(
        BODY, [40, 1], 1.0, steady=True, gravity=1
    ),
    "spinning needs a symmetric body": lambda: kr.Ensemble.spinning(CORNER, 1.0, gravity=1),
    "body[1]: spinning needs a symmetric": lambda: kr.Ensemble.spinning(
        kr.Bodies(1, [(1, 1, 1), (1, 1.2, 1.4)], (0, 0.1, 0.1)), 1.0, gravity=1
    ),
    "steady=True cannot be combined with": lambda: TOP.vary(spin=1, precession=1, steady=True),
    "steady=True requires spin and tilt": lambda: TOP.vary(momentum=EACH, steady=True),
    "fast chooses between two": lambda: TOP.vary(spin=[1, 2], fast=True),
    "momentum and spin both describe the start": lambda: TOP.vary(momentum=EACH, spin=1),
    "give either body or mass": lambda: TOP.vary(body=BODY, mass=1),
    "body[1]: mass must be positive, not -1.0": lambda: TOP.vary(mass=[1, -1]),
    "must not be empty; an empty ensemble": lambda: kr.Ensemble.of([]),
    "must not be empty": lambda: kr.Ensemble.of([[], []]),
    "must all have the same length": lambda: kr.Ensemble.of([[TOP], [TOP, TOP]]),
    "give the width of at least one": lambda: TOP.scatter(3),
    "momentum must be the width": lambda: TOP.scatter(3, momentum=[(1, 2, 3)]),
    "gravity must be the width": lambda: TOP.scatter(3, gravity=-1),
    "n must be at least 0": lambda: TOP.scatter(-1, gravity=1),
}


@pytest.mark.parametrize("message", OTHERS)
def test_invalid_arguments_are_refused_as_for_one_scene(message):
    with pytest.raises(ValueError) as error:
        OTHERS[message]()
    assert message in str(error.value)


def test_other_types_are_refused():
    with pytest.raises(TypeError, match="unknown parameter 'spn'; did you mean 'spin'"):
        TOP.vary(spn=3)
    with pytest.raises(TypeError, match=r"body must be a kreisel.Body or kreisel.Bodies, not 3"):
        kr.Ensemble(3, momentum=EACH, gravity=1)
    with pytest.raises(TypeError, match=r"scenes\[1\]\[0\] must be a kreisel.Scene, not 3"):
        kr.Ensemble.of([[TOP], [3]])
    with pytest.raises(TypeError, match="momentum must be 3 numbers, not 'x'"):
        kr.Ensemble(BODY, momentum="x", gravity=1)


# Boundary values


def test_a_rotation_by_zero_changes_nothing():
    q = tuple(np.array([x, x]) for x in (0.8, 0.0, 0.6, 0.0))
    with np.errstate(all="ignore"):
        attitude = variation._compose_with_rotation_vectors(
            q, tuple(np.array([0.0, r]) for r in (0.0, 0.25, 0.0))
        )
    assert [float(x[0]) for x in attitude] == [0.8, 0.0, 0.6, 0.0]
    angle = 2.0 * math.atan2(0.6, 0.8) + 0.25
    assert float(attitude[2][1]) == pytest.approx(math.sin(0.5 * angle))
