"""Tests that ensembles broadcast, follow NumPy's indexing, and have members equal to scenes."""

import copy
import dataclasses
import pickle

import kreisel as kr
import numpy as np
import pytest
from drawn_tops import assert_same_bits
from scipy.spatial.transform import Rotation
from tops import CORNER, FREE, GENERAL, LAGRANGE

RNG = np.random.default_rng(7)
M, G = RNG.normal(size=(4, 3, 3)), RNG.normal(size=(4, 1))
Q, D = RNG.normal(size=(3, 4)), RNG.uniform(size=(3, 3))
Q /= np.linalg.norm(Q, axis=-1)[:, None]
MANY = kr.Body.cuboid(RNG.uniform(0.5, 1, (3, 3)), (0.1, 0.2, -1))
CONES = kr.Body.cone(1, RNG.uniform(0.5, 1, 3), (0, 0, 0), mass=1)
SPIN, TILT, RATE = RNG.uniform(20, 40, (4, 1)), RNG.uniform(0, 3, 3), RNG.normal(size=3)
FULL = kr.Scene(MANY, M, Q, G, damping=D)


SUPPORT = {"damping": D, "turning": D, "shaking": D, "friction": D[:, 0]}
SPHERES = kr.Body.sphere([1, 2, 3], (0, 0, 0), mass=1)  # without a lever
ANGLES = {"angles": 120 * M, "rates": D, "degrees": True, "gravity": G}
STARTS = [  # arguments of spinning
    {"spin": SPIN, "tilt": TILT, "precession": RATE, "damping": D},
    {"spin": 50 * SPIN, "tilt": 50 * TILT, "precession": RATE, "degrees": True},
    {"spin": SPIN, "tilt": TILT, "steady": True},
    {"spin": SPIN, "tilt": TILT, "steady": True, "fast": True},
]
MOMENTA = ("momentum", "velocity", "body_momentum", "body_velocity")
CONSTRUCTIONS = [  # name of the constructor, body, arguments of shape (4, 3)
    *(
        ("", body, {name: M, "attitude": Q, "gravity": G, **SUPPORT})
        for name in MOMENTA
        for body in (CORNER, MANY)
    ),
    ("", CORNER, {"velocity": M, "attitude": Rotation.from_quat(Q), "gravity": 1.0}),
    ("", CORNER, {"velocity": M, "attitude_xyzw": Q, "gravity": 1.0}),
    *(("spinning", b, words | {"gravity": G}) for b in (LAGRANGE.body, CONES) for words in STARTS),
    ("spinning", SPHERES, {"spin": SPIN, "tilt": 1.0, "gravity": G}),
    *(("from_euler", body, ANGLES) for body in (LAGRANGE.body, MANY)),
]
SCALARS = "gravity", "friction", "spin", "tilt", "precession"


def pick(name, value, index):
    """Return the argument of one member of an ensemble of shape (4, 3)."""
    if isinstance(value, bool) or getattr(value, "shape", None) == ():
        return value
    if isinstance(value, (kr.Body, Rotation)):
        return value[index[1]]
    tail = () if name in SCALARS else (np.shape(value)[-1],)
    return np.broadcast_to(value, (4, 3, *tail))[index]


@pytest.mark.parametrize(("name", "body", "words"), CONSTRUCTIONS)
def test_members_equal_scenes_with_the_same_arguments(name, body, words):
    make = getattr(kr.Scene, name) if name else kr.Scene
    tops = make(body, **words)
    assert tops.shape == (4, 3) and tops.ndim == 2 and tops.size == 12 and len(tops) == 4
    for index in np.ndindex(4, 3):
        own = {name: pick(name, value, index) for name, value in words.items()}
        top = make(pick("body", body, index), **own)
        assert tops[index] == top
        for name in ("momentum", "attitude"):
            assert_same_bits(getattr(tops[index], name), getattr(top, name))


@pytest.mark.filterwarnings("error")
def test_scenes_in_lists_are_an_ensemble():
    again = kr.Scene.stack([[FULL[i, j] for j in range(3)] for i in range(4)])
    assert again == FULL and again.coords == {}
    odd = kr.Body(1, (1, 1, 1), (0, 0, 3), unphysical=True)
    mixed = [LAGRANGE, GENERAL, FREE, kr.scenes.kowalewski, LAGRANGE.replace(body=odd)]
    tops = kr.Scene.stack(mixed)
    assert list(tops) == mixed
    assert [tops[i].body.unphysical for i in (1, 4)] == [False, True]
    twin = LAGRANGE.replace(body=copy.copy(LAGRANGE.body))
    assert kr.Scene.stack([LAGRANGE, twin]).body is LAGRANGE.body
    nested = GENERAL
    for _ in range(32):
        nested = [nested]
    assert kr.Scene.stack(nested).shape == (1,) * 32


def test_ensembles_and_their_copies_are_equal_and_immutable():
    momentum = M.copy()
    tops = kr.Scene(CORNER, momentum=momentum, gravity=1)
    momentum[:] = np.nan
    assert np.array_equal(tops.momentum, M)
    for field in (tops.momentum, tops.attitude, tops.gravity, tops.damping, FULL[[0]].momentum):
        with pytest.raises(ValueError, match="read-only"):
            field[...] = 0
    with pytest.raises(dataclasses.FrozenInstanceError):
        tops.momentum = M
    with pytest.raises(TypeError):
        hash(tops)
    for other in (copy.copy(FULL), copy.deepcopy(FULL), pickle.loads(pickle.dumps(FULL))):
        assert other == FULL and other.axes == FULL.axes and [*other.coords] == [*FULL.coords]
    assert FULL[::-1] != FULL and FULL[:3] != FULL and FULL != LAGRANGE != tops


def test_many_tops_do_what_one_does():
    tops = LAGRANGE.vary(spin=[[1.0], [2.0]], tilt=[0.0, 0.5, 1.0])
    changed, turned = tops.replace(gravity=2.0), tops.vary(precession=0.5)
    rough = tops.vary(friction=np.reshape([0.0, 0.1], (2, 1, 1)))
    assert changed.axes == tops.axes and rough.axes == ("friction", "spin", "tilt")
    for i in np.ndindex(2, 3):
        assert changed[i] == tops[i].replace(gravity=2.0)
        assert rough[(1, *i)] == tops[i].replace(friction=0.1)
        assert turned[i] == tops[i].vary(precession=0.5)
        assert tops[i].attitude_xyzw == tuple(tops.attitude_xyzw[i])
    both, masses = kr.Scene.stack([tops, changed]), LAGRANGE.vary(mass=[1.0, 2.0, 3.0])
    assert both.shape == (2, 2, 3) and both[1] == changed
    for many in (tops, FULL, rough, both, masses):
        assert kr.Scene.from_toml(many.to_toml()) == many
    cloud = tops.scatter(500, seed=3, momentum=0.1)
    assert cloud.shape == (500, 2, 3) and cloud[:9] == tops.scatter(9, seed=3, momentum=0.1)
    assert np.std(cloud.momentum - tops.momentum) == pytest.approx(0.1, rel=0.05)


@pytest.mark.parametrize("call", [len, list, lambda top: top[0], lambda top: top[1:]])
def test_one_top_is_no_array(call):
    assert LAGRANGE.shape == () and LAGRANGE.ravel()[0] == LAGRANGE == LAGRANGE.reshape(())
    for one in (LAGRANGE, LAGRANGE.body):
        with pytest.raises(TypeError, match=r"shape \(\)"):
            call(one)


# Indices

KEYS = [
    *(0, -1, np.int64(1), slice(1, 3), slice(None, None, -1), ..., None, ()),
    *((1, 2), (-1, -1), (slice(None), 1), (..., 1), (0, ...), (slice(None), None, slice(1, None))),
    *([0, 2], ([0, 2], [1, 1]), (slice(None), [2, 0]), ([3, 0], slice(1)), (0, [1, 2])),
    *(np.array([[0, 1], [2, 3]]), np.arange(12).reshape(4, 3) % 3 == 0, [True, False, True, True]),
    *((np.array([True, False, True, True]), 1), np.zeros((4, 3), bool), slice(2, 2), [], True),
    (np.array(1), np.array(2)),
]


def test_indexing_follows_numpy():
    order, members = np.arange(12).reshape(4, 3), [FULL[i] for i in np.ndindex(4, 3)]
    paths = kr.solve(FULL, [0.0, 0.5])
    states = paths.states.reshape(12, 2, 8)
    for key in KEYS:
        expected, selection = order[key], FULL[key]
        if not isinstance(expected, np.ndarray):
            assert isinstance(selection, kr.Scene) and selection == members[int(expected)]
            assert np.array_equal(paths[key].states, states[expected])
            continue
        has_gap = isinstance(key, tuple) and any(part is ... for part in key)
        chosen = paths[(*key, slice(None)) if has_gap else key]  # beside the index of the states
        assert selection.shape == chosen.shape == expected.shape
        assert np.array_equal(chosen.states, states[expected])
        assert [selection[i] for i in np.ndindex(selection.shape)] == [
            members[i] for i in expected.ravel()
        ]
        assert len(selection.axes) == selection.ndim
        assert pickle.loads(pickle.dumps(selection)) == selection
    for key in (4, -5, (0, 3), (0, 0, 0), "x", 1.5, [7], [[0.5]], 10**30, {}):
        with pytest.raises(IndexError):
            FULL[key]
        with pytest.raises(IndexError):
            paths[(0, 0, 2) if key == (0, 0, 0) else key]


# Varied and random parameters

BODY = kr.Body.cone(1, 2, (0, 0, 0), mass=1)
TOP = kr.Scene.spinning(BODY, spin=10, tilt=0.3, gravity=1)
MOVING = kr.Scene.from_euler(BODY, (1, 0.7, 2), (0.3, 0.4, 5), gravity=2)
SPINS, TILTS = np.linspace(0, 20, 5)[:, None], np.linspace(0, 1, 3)
EACH = np.ones((4, 3))
VARIED = TOP.vary(spin=SPINS, tilt=TILTS)


def test_a_parameter_that_varies_alone_names_its_axis():
    for tops, axes in [
        (VARIED, ("spin", "tilt")),
        (TOP.vary(momentum=EACH, gravity=[[1], [2]]), ("gravity", "dim_1")),
        (TOP.vary(spin=SPINS, tilt=0.1 * SPINS, gravity=TILTS), ("dim_0", "gravity")),
        (TOP.vary(gravity=3.0), ()),
        (kr.Scene(CONES, momentum=(0, 0, 1), gravity=1), ("height",)),
        (VARIED[:, [2, 0]], ("spin", "tilt")),
        (VARIED[..., None], ("spin", "tilt", "dim_2")),
        (VARIED.ravel(), ("top",)),
    ]:
        assert tops.axes == axes
    few = VARIED[[3, 1], 1:]
    assert np.array_equal(few.coords["spin"], SPINS[[3, 1]])
    assert np.array_equal(np.ravel(few.coords["tilt"]), TILTS[1:])
    assert repr(VARIED) == "<Scene of shape (5, 3): spin 0 .. 20, tilt 0 .. 1>"


def test_varied_scenes_equal_the_constructors():
    steady = TOP.vary(spin=30 + SPINS, tilt=TILTS, steady=True)
    for i, j in np.ndindex(5, 3):
        spin, tilt = SPINS[i, 0], TILTS[j]
        assert VARIED[i, j] == kr.Scene.spinning(BODY, spin, tilt, gravity=1)
        assert steady[i, j] == kr.Scene.spinning(BODY, 30 + spin, tilt, steady=True, gravity=1)
    degrees = TOP.vary(spin=20, tilt=[10, 20], precession=3, degrees=True)
    assert degrees[1] == kr.Scene.spinning(BODY, 20, 20, 3, degrees=True, gravity=1)
    tops = TOP.vary(mass=[1, 0.5], gravity=[[1], [2], [3]])
    assert tops[2, 1] == TOP.replace(body=kr.Body(0.5, BODY.inertia, BODY.com), gravity=3.0)
    assert TOP.vary(body=CONES)[1] == TOP.replace(body=CONES[1])
    cones = TOP.vary(body=CONES, spin=3.0, tilt=0.5)
    assert cones[1] == kr.Scene.spinning(CONES[1], 3.0, 0.5, gravity=1)
    assert LAGRANGE.replace(damping=0.1).vary(spin=[1, 2])[0].damping == (0.1, 0.1, 0.1)


@pytest.mark.parametrize(
    "words",
    [
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


def test_any_body_has_a_spin_and_a_tilt():
    for scene in (GENERAL, FREE, LAGRANGE):
        paths = kr.solve(scene.vary(spin=[1.0, -2.0], tilt=[[0.5], [2.5]]), [0.0])
        assert np.abs(paths.spin[..., 0] - [1.0, -2.0]).max() < 1e-13
        assert np.abs(paths.nutation[..., 0] - [[0.5], [2.5]]).max() < 1e-13


@pytest.mark.parametrize(
    "widths",
    [
        *({"momentum": 0.1}, {"attitude": (0.1, 0, 0.2)}, {"gravity": 0.3}),
        {"momentum": (0, 0, 0.1), "attitude": 0.2, "gravity": 0.4},
    ],
    ids=str,
)
def test_a_random_start_depends_only_on_seed_and_index(widths):
    few, many = TOP.scatter(10, seed=3, **widths), TOP.scatter(9000, seed=3, **widths)
    assert few == many[:10] and few[5:] == many[5:10] and few[0] != few[1]
    assert few != TOP.scatter(10, seed=4, **widths) and few.axes == ("top",)
    assert len(TOP.scatter(0, **widths)) == 0


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


# Refusals: callable, valid arguments, argument, bad value, exception, word

NAN = np.ones((4, 20, 3))
NAN[3, 17] = np.nan, 0, 1
LONG_Q = np.array([[1.0, 0, 0, 0], [1, 1, 0, 0]])
DEEP = [[GENERAL]]
for _ in range(32):
    DEEP = [DEEP]
SOME = {"body": CORNER, "momentum": EACH, "gravity": 1}
LEAN = {"body": BODY, "spin": 40.0, "tilt": 1.0, "gravity": 1}
UNLIKE = kr.Body(1, [(1, 1, 1), (1, 1.2, 1.4)], (0, 0.1, 0.1))
REFUSALS = [
    (kr.Scene, SOME, "momentum", NAN, ValueError, r"momentum\[3, 17\]"),
    (kr.Scene, SOME, "attitude", LONG_Q, ValueError, r"attitude\[1\]"),
    (kr.Scene, SOME, "gravity", [1, np.inf], ValueError, r"gravity\[1\]"),
    (kr.Scene, SOME, "gravity", [1, 2, 3], ValueError, "broadcast"),
    (kr.Scene, SOME, "damping", [[1.0], [-1.0]], ValueError, r"damping\[1\]"),
    (kr.Scene.spinning, LEAN, "body", UNLIKE, ValueError, r"body\[1\]"),
    (kr.Scene.spinning, LEAN | {"steady": True}, "spin", [40, 1], ValueError, "smallest"),
    (kr.Scene.stack, {}, "scenes", [[TOP], [TOP, TOP]], ValueError, "length"),
    (kr.Scene.stack, {}, "scenes", [[TOP], [3]], TypeError, r"\[1\]\[0\]"),
    (kr.Scene.stack, {}, "scenes", DEEP, ValueError, "contain"),
    (TOP.vary, {}, "tilt", [0, 4], ValueError, r"tilt\[1\]"),
    (TOP.vary, {"spin": [0, 40], "tilt": 0.5}, "steady", True, ValueError, r"top\[0\]"),
    (TOP.vary, {"momentum": EACH}, "spin", 1, ValueError, "momentum"),
    (TOP.vary, {"body": BODY}, "mass", 1, ValueError, "mass"),
    (TOP.vary, {}, "mass", [1, -1], ValueError, r"mass\[1\] = -1"),
    (TOP.vary, {}, "spn", 3, TypeError, "spin"),
    (TOP.scatter, {}, "n", 3, ValueError, "width"),
    (TOP.scatter, {"gravity": 1}, "n", -1, ValueError, "n must"),
]


@pytest.mark.parametrize(("call", "valid", "name", "bad", "error", "word"), REFUSALS)
def test_bad_arguments_are_refused(call, valid, name, bad, error, word):
    with pytest.raises(error, match=word):
        call(**valid | {name: bad})
