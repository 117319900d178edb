"""Tests of tangents against finite differences of 30-digit solutions."""

import pickle

import kreisel as kr
import numpy as np
import pytest
from kreisel.quaternion import turn as rotate

ALL = ("start", "moments", "com", "gravity", "mass", "damping")
SCENES = [name for name in vars(kr.scenes) if isinstance(getattr(kr.scenes, name), kr.Scene)]
T = 10.0


def change(one, other):
    """Return the rotation vector and the momentum difference between the states of two paths."""
    q, dq = other.q[0], (one.q[0] - other.q[0]) + (one.q_low[0] - other.q_low[0])
    turn = q[0] * dq[1:] - dq[0] * q[1:] - np.cross(q[1:], dq[1:])
    return np.append(2.0 * turn, (one.m[0] - other.m[0]) + (one.m_low[0] - other.m_low[0]))


def neighbours(scene, word, value, axis):
    """Differentiate the state with respect to a parameter by 30-digit finite differences.

    Richardson extrapolation makes the finite differences more accurate.
    """
    step = 2.0 ** (np.ceil(np.log2(max(1.0, abs(value)))) - 26.0)

    def at(k):
        if axis is None:
            return kr.solve(scene.replace(**{word: value + k * step}), [T], digits=30)
        data = np.array(getattr(scene, word))
        data[axis] += k * step
        return kr.solve(scene.replace(**{word: data}), [T], digits=30)

    return (8.0 * change(at(1), at(-1)) - change(at(2), at(-2))) / (12.0 * step)


@pytest.mark.parametrize("name", SCENES)
def test_tangents_agree_with_differences_of_runs_with_30_digits(name):
    scene = getattr(kr.scenes, name)
    fine = kr.solve(scene, [0.0, T], digits=30, tangents=ALL).tangents[1]
    columns = [(3 + i, "momentum", m, i) for i, m in enumerate(scene.momentum)]
    for column, word, value, axis in [*columns, (12, "gravity", scene.gravity, None)]:
        expected = neighbours(scene, word, value, axis)
        assert np.abs(expected - fine[:, column]).max() <= 1e-14 * max(
            1.0, np.abs(fine[:, column]).max()
        )
    # The path in doubles is itself inexact. If its error grows fast, the tangents have a
    # relative error of the same size.
    plain = kr.solve(scene, [0.0, T], digits=16, tangents=ALL)
    size = np.abs(fine).max()
    tolerance = 1e-12 if name != "dzhanibekov" else 3.0 * plain.error * size
    assert np.abs(plain.tangents[1] - fine).max() <= tolerance * size
    assert plain.tangents_rest < 1e-12


def matrix(q):
    return np.array([rotate(q, axis) for axis in np.eye(3)]).T


def form(path, i):
    """Return the matrix of the symplectic form at state `i` of a path.

    The symplectic form acts on body-frame rotation vectors and space-frame momenta.
    """
    turn = matrix(path.q[i])
    x, y, z = turn.T @ path.m[i]
    return np.block(
        [[np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), turn.T], [-turn, np.zeros((3, 3))]]
    )


@pytest.mark.parametrize("name", SCENES)
def test_tangents_preserve_the_symplectic_form(name):
    path = kr.solve(getattr(kr.scenes, name), [0.0, T], digits=20, tangents="start")
    phi = path.tangents[1]
    size = np.abs(phi.T) @ np.abs(form(path, 1)) @ np.abs(phi)
    assert np.all(np.abs(phi.T @ form(path, 1) @ phi - form(path, 0)) <= 1e-13 * (1.0 + size))


def test_tangents_do_not_change_the_path():
    scene, t = kr.scenes.asymmetric, [-1.0, -2.0, -4.0]
    path = kr.solve(scene, t, tangents=["gravity", "start"])
    assert np.array_equal(path.states, kr.solve(scene, t, "taylor").states)
    assert path.tangents.shape == (3, 6, 7) == path.tangents_low.shape
    assert np.array_equal(path[::2].tangents, path.tangents[::2])
    assert np.array_equal(pickle.loads(pickle.dumps(path)).tangents, path.tangents)
    alone = kr.solve(scene, [-4.0], tangents="gravity")
    assert np.array_equal(alone.tangents[0, :, 0], path.tangents[2, :, 6])
    assert not path.tangents.flags.writeable
    for name in ("tangents", "tangents_low", "tangents_rest", "conditioning"):
        assert not hasattr(path.only(["q"]), name) and not hasattr(path([-3.0]), name)
    back = kr.solve(path.end, [4.0], tangents="start").tangents[0]
    assert np.abs(back @ path.tangents[2, :, :6] - np.eye(6)).max() < 1e-12


def test_conditioning_is_the_effect_of_rounding_errors_on_the_attitude():
    scene, t = kr.scenes.asymmetric, [10.0, 40.0]
    path = kr.solve(scene, t, tangents=ALL)
    up = np.nextafter(scene.momentum, np.inf).tolist()
    neighbour = kr.solve(scene.replace(momentum=up), t, digits=20)
    still = kr.solve(scene, t, digits=20)
    error = kr.attitude_error(neighbour.q, still.q)
    assert np.all(error <= 2.0 * path.conditioning) and np.all(error >= 0.005 * path.conditioning)
    undamped = kr.solve(scene, t, tangents=ALL[:-1])  # a damping of zero is not rounded
    assert undamped.conditioning == pytest.approx(path.conditioning, rel=1e-14)
    damped = kr.solve(scene.replace(damping=0.1), t, tangents=ALL[:-1])
    with pytest.raises(AttributeError, match="all parameters that are not 0"):
        _ = damped.conditioning
    start = kr.solve(scene, [0.0], tangents=ALL)  # one rounding in each of three half angles
    assert start.conditioning == pytest.approx([6.0 * 2.0**-53], rel=1e-12)


def test_unsupported_requests_for_tangents_are_refused():
    scene, every = kr.scenes.thesis, {"tangents": "start"}
    with pytest.raises(ValueError, match="'strang' computes no tangents"):
        kr.solve(scene, 1.0, "strang", step=0.1, **every)
    with pytest.raises(ValueError, match="'exact' computes no tangents"):
        kr.solve(scene, 1.0, "exact", **every)
    with pytest.raises(ValueError, match="did you mean 'moments'"):
        kr.solve(scene, 1.0, tangents="moment")
    with pytest.raises(ValueError, match="leave out want"):
        kr.solve(scene, 1.0, want=["q"], **every)
    with pytest.raises(ValueError, match="leave out events"):
        kr.solve(scene, 1.0, events=[kr.events.nutation()], **every)
    with pytest.raises(TypeError, match="tangents must be names"):
        kr.solve(scene, 1.0, tangents=3)
    with pytest.raises(ValueError, match="tangents is empty"):
        kr.solve(scene, 1.0, tangents=[])
    with pytest.raises(AttributeError, match="solve with tangents='start'"):
        _ = kr.solve(scene, 1.0).tangents
    with pytest.raises(AttributeError, match="conditioning"):
        _ = kr.solve(scene, 1.0, **every).conditioning
    assert kr.methods["taylor"].tangents and not kr.methods["exact"].tangents


DAMPED = kr.scenes.asymmetric.replace(damping=(0.01, 0.02, 0.03))
START = {"tangents": "start"}
# Functions and options with tangents: the shape of the tangents, or a part of the error message.
PAIRS = {
    "times": (lambda: kr.solve(kr.scenes.asymmetric, [-1.0, -2.0], **START), (2, 6, 6)),
    "damping": (lambda: kr.solve(DAMPED, [1.0], **START), (1, 6, 6)),
    "damping, back": (lambda: kr.solve(DAMPED, [-1.0], **START), (1, 6, 6)),
    "by damping": (lambda: kr.solve(DAMPED, [1.0], tangents="damping"), (1, 6, 3)),
    "no times": (lambda: kr.solve(kr.scenes.asymmetric, [], **START), (0, 6, 6)),
    "tol": (lambda: kr.solve(kr.scenes.asymmetric, [1.0], "taylor", tol=1e-6, **START), (1, 6, 6)),
    "digits": (lambda: kr.solve(kr.scenes.asymmetric, [1.0], digits=30, **START), (1, 6, 6)),
    "a symmetric top": (lambda: kr.solve(kr.scenes.thesis, [1.0], **START), (1, 6, 6)),
    "every": (lambda: kr.solve(kr.scenes.thesis, 1.0, every=2, **START), "every"),
    "want": (lambda: kr.solve(kr.scenes.thesis, 1.0, want=["q"], **START), "want"),
    "error": (lambda: kr.solve(kr.scenes.thesis, 1.0, error=1e-6, **START), "error"),
    "geometric": (lambda: kr.solve(kr.scenes.thesis, 1.0, "geometric", **START), "geometric"),
    "events": (lambda: kr.solve(kr.scenes.thesis, 1.0, events=[], **START), "events"),
    "threads": (lambda: kr.solve(kr.scenes.thesis, 1.0, threads=2, **START), "threads"),
    "ensemble": (
        lambda: kr.solve(kr.scenes.thesis.vary(gravity=[1.0, 2.0]), [1.0], **START),
        (2, 1, 6, 6),
    ),
    "stream": (lambda: kr.stream(kr.scenes.thesis, 1.0, **START), "tangents"),
    "start": (lambda: kr.start(kr.scenes.thesis, **START), "tangents"),
    "plan": (lambda: kr.plan(kr.scenes.thesis, **START), "tangents"),
    "exact": (lambda: kr.exact(kr.scenes.thesis, **START), "tangents"),
}


@pytest.mark.parametrize("pair", PAIRS)
def test_tangents_accept_or_refuse_every_other_argument(pair):
    call, outcome = PAIRS[pair]
    if isinstance(outcome, tuple):
        assert call().tangents.shape == outcome
        return
    with pytest.raises((TypeError, ValueError), match=outcome):
        call()


def test_a_saved_path_keeps_its_tangents(tmp_path):
    path = kr.solve(kr.scenes.asymmetric, [1.0, 4.0], digits=20, tangents=("start", "com"))
    path.save(tmp_path / "path")
    again = kr.load(tmp_path / "path")
    for name in ("tangents", "tangents_low", "tangents_rest", "q", "m_low"):
        assert np.array_equal(getattr(again, name), getattr(path, name))
    assert not again.tangents.flags.writeable
    again.only(["q"]).save(tmp_path / "path")
    assert not hasattr(kr.load(tmp_path / "path"), "tangents")
    path[:1].save(tmp_path / "path")
    assert np.array_equal(kr.load(tmp_path / "path").tangents, path.tangents[:1])


def test_an_overflowing_tangent_ends_the_run_with_its_path():
    top = kr.scenes.sleeping.replace(momentum=(0.0, 0.0, 0.0))
    with pytest.raises(kr.Error, match="a tangent exceeded") as error:
        kr.solve(top, np.arange(0.0, 4000.0, 10.0), tangents="start")
    assert error.value.status == "ERR_TANGENT"
    path = error.value.path
    assert len(path) > 10 and np.isfinite(path.tangents).all() and len(path.tangents) == len(path)
