"""Tests that each member of kreisel.Bodies equals a body made individually."""

import pickle

import kreisel as kr
import numpy as np
import pytest
from internals import core

TOP, THESIS, FREE = kr.scenes.asymmetric, kr.scenes.thesis, kr.scenes.dzhanibekov

RNG = np.random.default_rng(5)
# three values, because an array of length three could be mistaken for a vector
R, H = RNG.uniform(0.5, 2, (4, 1)), RNG.uniform(0.5, 2, 3)
HALF, SOME = RNG.uniform(0.5, 2, (4, 1, 3)), RNG.uniform(-1, 1, (3, 3))
# a body keeps its axes if the centre of mass lies on an axis
ON_AXIS = np.array([(0.0, 0.0, -1.0)] * 3)
MATRICES = np.array([kr.Body.cuboid((1, 2, 3), pivot).inertia for pivot in SOME])
MAKERS = {  # functions that return all bodies, and a function for the arguments of one
    "cuboid": lambda pivot: (
        kr.Bodies.cuboid(HALF, pivot),
        lambda i, j, point: (HALF[i, 0], point),
    ),
    "ellipsoid": lambda pivot: (
        kr.Bodies.ellipsoid(HALF, pivot, mass=H),
        lambda i, j, point: (HALF[i, 0], point, {"mass": H[j]}),
    ),
    "cylinder": lambda pivot: (
        kr.Bodies.cylinder(R, H, pivot, density=0.3),
        lambda i, j, point: (R[i, 0], H[j], point, {"density": 0.3}),
    ),
    "tube": lambda pivot: (
        kr.Bodies.tube(0.4, R, H, pivot, density=H),
        lambda i, j, point: (0.4, R[i, 0], H[j], point, {"density": H[j]}),
    ),
    "cone": lambda pivot: (
        kr.Bodies.cone(R, H, pivot, mass=2),
        lambda i, j, point: (R[i, 0], H[j], point, {"mass": 2}),
    ),
    "disk": lambda pivot: (
        kr.Bodies.disk(R + H, pivot, mass=2),
        lambda i, j, point: (R[i, 0] + H[j], point, {"mass": 2}),
    ),
    "sphere": lambda pivot: (
        kr.Bodies.sphere(R + H, pivot, mass=2, shell=True),
        lambda i, j, point: (R[i, 0] + H[j], point, {"mass": 2, "shell": True}),
    ),
    "from_com": lambda pivot: (
        kr.Bodies.from_com(R, (1, 2, 2.5), SOME, pivot),
        lambda i, j, point: (R[i, 0], (1, 2, 2.5), SOME[j], point),
    ),
    "symmetric": lambda pivot: (
        kr.Bodies.symmetric(0.1, R, 0.5 * H, -0.2, inertia_rtol=0.5, unphysical=True),
        lambda i, j, point: (
            0.1,
            R[i, 0],
            0.5 * H[j],
            -0.2,
            {"inertia_rtol": 0.5, "unphysical": True},
        ),
    ),
}


def assert_same(bodies, index, body):
    """Assert that a member of `bodies` is bitwise equal to `body`."""
    assert bodies[index] == body and bodies[index]._block == body._block
    assert tuple(bodies.moments[index]) == body.moments
    assert tuple(bodies.principal_com[index]) == body.principal_com
    assert tuple(bodies.axes[index]) == body.axes
    assert (bodies.mass[index], bodies.unphysical[index]) == (body.mass, body.unphysical)
    assert (tuple(bodies.com[index]), bodies.inertia_rtol[index]) == (body.com, body.inertia_rtol)


@pytest.mark.filterwarnings("ignore:.*no body has this inertia")
@pytest.mark.parametrize("pivots", [ON_AXIS, SOME], ids=["on the axis", "anywhere"])
@pytest.mark.parametrize("name", MAKERS)
def test_members_equal_single_bodies_bitwise(name, pivots):
    bodies, words = MAKERS[name](pivots)
    assert bodies.shape == (4, 3)
    for i, j in np.ndindex(4, 3):
        *args, last = words(i, j, pivots[j])
        kwargs = last if isinstance(last, dict) else {}
        args += [] if kwargs else [last]
        assert_same(bodies, (i, j), getattr(kr.Body, name)(*args, **kwargs))


@pytest.mark.parametrize("word", ["inertia", "inertia_about_com"])
@pytest.mark.parametrize(
    "inertia", [MATRICES, MATRICES[0], (2.0, 2.5, 3.0), RNG.uniform(2, 3, (4, 1, 3))]
)
def test_bodies_accept_matrices_and_moments(word, inertia):
    bodies = kr.Bodies(H, com=0.1 * SOME, **{word: inertia})
    value = 2 if np.shape(inertia)[-2:] == (3, 3) else 1
    lead = np.shape(inertia)[:-value]
    every = np.broadcast_to(inertia, bodies.shape + np.shape(inertia)[len(lead) :])
    for index in np.ndindex(bodies.shape):
        one = kr.Body(H[index[-1]], com=0.1 * SOME[index[-1]], **{word: every[index]})
        assert_same(bodies, index, one)


def test_a_rod_is_a_body_only_off_its_own_line():
    bodies = kr.Bodies.rod([1, 2], [(1, 0, 0), (0, 2, 1)], mass=3)
    assert_same(bodies, 1, kr.Body.rod(2, (0, 2, 1), mass=3))
    with pytest.raises(ValueError, match=r"body\[1\]: a thin rod whose fixed point lies on its"):
        kr.Bodies.rod(1, [(1, 0, 0), (0, 0, 2)], mass=3)


def test_moments_of_three_bodies_are_not_taken_for_a_matrix():
    three = kr.Bodies.symmetric(1, i1=2, i3=[1, 2, 3], height=0.5)
    assert three.inertia.shape == (3, 3) and three[2].moments == (2, 2, 3)
    with pytest.raises(ValueError, match="three bodies by their moments, pass three matrices"):
        kr.Bodies(1, [(2, 2, 1), (2, 2, 2), (2, 3, 3)], (0, 0, 0))
    with pytest.raises(ValueError, match="not physical"):  # symmetric, but not physical
        kr.Bodies(1, [(1, 2, 2), (2, 1, 2), (2, 2, 1)], (0, 0, 0))


def test_shared_values_are_stored_once():
    n = 10**5
    bodies = kr.Bodies.symmetric(1.0, i1=np.linspace(2, 3, n), i3=1.0, height=0.5)
    assert bodies.mass.strides == (0,) and bodies.com.strides[0] == 0
    assert len(pickle.dumps(bodies)) < 60 * n
    assert not any(x.flags.writeable for x in (bodies.mass, bodies.inertia, bodies.unphysical))


def test_slices_are_bodies_and_compare_by_members():
    bodies = kr.Bodies.cylinder(R, H, SOME, mass=2)
    assert bodies[1:, 2][0] == bodies[1, 2] and bodies.ravel()[7] == bodies[2, 1]
    assert bodies[[3, 0]][1, 1] == bodies[0, 1] and pickle.loads(pickle.dumps(bodies)) == bodies
    assert bodies != bodies[::-1] and bodies != 3 and bodies[:2] != bodies
    assert repr(bodies).startswith("<Bodies of shape (4, 3): radius ") and len(bodies) == 4
    assert [*bodies.coords] == ["radius", "height", "pivot"]
    with pytest.raises(AttributeError, match="cannot assign"):
        bodies.shape = (12,)


def test_the_warning_names_the_first_and_counts_the_others():
    with pytest.warns(UserWarning, match=r"body\[1\] \(and 1 more\): no body has this inertia"):
        odd = kr.Bodies(1, (1, 1, 1), [(0, 0, 0.1), (0, 0, 3), (0, 3, 0)])
    assert odd.unphysical.tolist() == [False, True, True] and odd[2].unphysical
    unphysical = kr.Bodies(1, (1, 1, 1), [(0, 0, 0.1), (0, 0, 3)], unphysical=[False, True])
    assert unphysical[1].unphysical and not unphysical[0].unphysical


NAN = np.array([1.0, np.nan])
REFUSED = {
    r"radius\[1\] = nan: radius must be finite": lambda: kr.Bodies.sphere(NAN, (0, 0, 0), mass=1),
    r"height\[0\] = -1.0: height must be pos": lambda: kr.Bodies.cone(1, [-1], (0, 0, 0), mass=1),
    r"radius\[1\] = 0.0: radius must be pos": lambda: kr.Bodies.disk([1, 0], (0, 0, 0), mass=1),
    r"half\[1\] = \(1.0, 0.0, 1.0\): half must be positive": lambda: kr.Bodies.cuboid(
        [(1, 1, 1), (1, 0, 1)], (0, 0, 0)
    ),
    r"\[1\] = \(3.0, 2.0\): inner must lie between 0 and outer": lambda: kr.Bodies.tube(
        [1, 3], 2, 1, (0, 0, 0), mass=1
    ),
    r"body\[1\]: the body is not physical.* 3.0 > 1.0 \+ 1.0": lambda: kr.Bodies(
        1, [(1, 1, 1), (1, 1, 3)], (0, 0, 0)
    ),
    r"inertia_rtol\[1\] = 1.0: inertia_rtol must be": lambda: kr.Bodies(
        1, (1, 1, 1), (0, 0, 0), inertia_rtol=[0, 1]
    ),
    r"mass of the sphere\[1\] = inf": lambda: kr.Bodies.sphere([1, 1e200], (0, 0, 0), density=1),
    "give exactly one of mass and density of the cone": lambda: kr.Bodies.cone(1, 1, (0, 0, 0)),
    "mass or density of the cuboid, not both": lambda: kr.Bodies.cuboid(
        (1, 1, 1), (0, 0, 0), density=1, mass=1
    ),
    "the shell is thin and has no volume": lambda: kr.Bodies.sphere(
        1, (0, 0, 0), density=1, shell=True
    ),
    r"cannot be broadcast together: radius \(2,\), height \(3,\)": lambda: kr.Bodies.cylinder(
        [1, 2], [1, 2, 3], (0, 0, 0), mass=1
    ),
    r"cannot be broadcast together: mass \(2,\), com \(3,\)": lambda: kr.Bodies(
        [1, 2], (1, 1, 1), SOME
    ),
    "exactly one of inertia and inertia_about_com, not none": lambda: kr.Bodies(1, com=(0, 0, 1)),
}


@pytest.mark.parametrize("message", REFUSED)
def test_the_first_invalid_body_is_named(message):
    with pytest.raises(ValueError, match=message):
        REFUSED[message]()


def test_other_types_are_refused():
    with pytest.raises(TypeError, match="com is missing"):
        kr.Bodies(1, (1, 1, 1))
    with pytest.raises(TypeError, match="unphysical must be True or False, or an array of them"):
        kr.Bodies(1, (1, 1, 1), (0, 0, 0), unphysical=[1, 0])


def test_the_core_accepts_only_columns_of_matching_shape():
    numbers = [np.ones(2), np.ones((2, 3)), np.ones((2, 3)), np.zeros(2), np.zeros((2, 3))]
    assert core.bodies((2,), numbers, False)[0] == "OK"
    for k, odd in enumerate([np.ones(3), np.ones((2, 4)), np.ones((2, 3), np.float32), 1j]):
        with pytest.raises((ValueError, TypeError)):
            core.bodies((2,), [*numbers[:k], odd, *numbers[k + 1 :]], False)
    with pytest.raises(ValueError, match="other columns"):
        core.bodies((2,), numbers[:3], False)


# Boundary values


def test_a_row_of_bodies_is_broadcast_over_a_grid():
    bodies = kr.Ensemble.of([[TOP, FREE, THESIS]]).body
    grid = bodies._broadcast_to((2, 3))
    assert bodies._broadcast_to((1, 3)) is bodies
    assert grid.shape == (2, 3) and np.array_equal(grid.com[0], grid.com[1])
    assert np.array_equal(grid.com[:1], bodies.com)


def test_a_zero_tensor_is_refused():
    zeros = np.zeros((2, 3, 3))
    with pytest.raises(ValueError, match=r"0\.0 is not positive"):
        kr.Body(mass=1.0, inertia=zeros[0], com=(0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"0\.0 is not positive"):
        kr.Bodies(mass=1.0, inertia=zeros, com=(0.0, 0.0, 0.0))


def test_a_tensor_that_is_not_finite_is_named():
    tensors = np.array([np.eye(3), np.full((3, 3), np.nan)])
    with pytest.raises(ValueError, match=r"inertia\[1\] = .* inertia must be finite, not inertia"):
        kr.Bodies(1.0, tensors, com=(0, 0, 0))
