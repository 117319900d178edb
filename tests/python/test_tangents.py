"""Tests of paths with tangents. tests/python/test_laws.py compares them with differences."""

import kreisel as kr
import numpy as np
import pytest

TOP, THESIS = kr.scenes.asymmetric, kr.scenes.thesis
ALL = ("start", "moments", "com", "gravity", "mass", "damping")


def test_tangents_belong_to_their_states():
    t = [-1.0, -2.0, -4.0]
    path = kr.solve(TOP, t, tangents=["gravity", "start"])
    assert path.tangents.shape == (3, 6, 7) == path.tangents_low.shape
    assert np.array_equal(path[::2].tangents, path.tangents[::2])
    alone = kr.solve(TOP, [-4.0], tangents="gravity")
    assert np.array_equal(alone.tangents[0, :, 0], path.tangents[2, :, 6])
    assert not path.tangents.flags.writeable
    for name in ("tangents", "tangents_low", "tangents_rest", "conditioning"):
        assert not hasattr(path.only(["q"]), name) and not hasattr(path([-3.0]), name)
    back = kr.solve(path.end, [4.0], tangents="start").tangents[0]
    assert np.abs(back @ path.tangents[2, :, :6] - np.eye(6)).max() < 1e-12
    assert kr.solve(TOP, [], tangents="start").tangents.shape == (0, 6, 6)
    many = kr.solve(TOP.vary(gravity=[1.0, 2.0]), t, tangents="damping")
    assert many.tangents.shape == (2, 3, 6, 3)


def test_conditioning_is_the_effect_of_rounding_errors_on_the_attitude():
    t = [10.0, 40.0]
    path = kr.solve(TOP, t, tangents=ALL)
    up = np.nextafter(TOP.momentum, np.inf).tolist()
    neighbour, still = (kr.solve(s, t, digits=20) for s in (TOP.replace(momentum=up), TOP))
    error = kr.attitude_error(neighbour.q, still.q)
    assert np.all(error <= 2.0 * path.conditioning) and np.all(error >= 0.005 * path.conditioning)
    undamped = kr.solve(TOP, t, tangents=ALL[:-1])  # a damping of zero is not rounded
    assert undamped.conditioning == pytest.approx(path.conditioning, rel=1e-14)
    start = kr.solve(TOP, [0.0], tangents=ALL)  # one rounding in each of three half angles
    assert start.conditioning == pytest.approx([6.0 * 2.0**-53], rel=1e-12)
    for one in (kr.solve(TOP.replace(damping=0.1), t, tangents=ALL[:-1]), kr.solve(TOP, t)):
        with pytest.raises(AttributeError):
            _ = one.conditioning


def test_an_overflowing_tangent_ends_the_run_with_its_path():
    top = kr.scenes.sleeping.replace(momentum=(0.0, 0.0, 0.0))
    with pytest.raises(kr.Error, match="tangent") as error:
        kr.solve(top, np.arange(0.0, 4000.0, 10.0), tangents="start")
    assert error.value.status == "ERR_TANGENT"
    path = error.value.path
    assert len(path) > 10 and np.isfinite(path.tangents).all() and len(path.tangents) == len(path)


# Refusals: callable, valid arguments, argument, bad value, exception, word

VALID = {"scene": THESIS, "t": 1.0, "tangents": "start"}
REFUSALS = [
    (kr.solve, VALID, "tangents", "moment", ValueError, "moments"),
    (kr.solve, VALID, "tangents", "friction", ValueError, "friction"),
    (kr.solve, VALID, "threads", 2, ValueError, "threads"),
    (kr.start, {"scene": THESIS}, "tangents", "start", TypeError, "tangents"),
    (kr.exact, {"scene": THESIS}, "tangents", "start", TypeError, "tangents"),
]


@pytest.mark.parametrize(("call", "valid", "name", "bad", "error", "word"), REFUSALS)
def test_bad_arguments_are_refused(call, valid, name, bad, error, word):
    with pytest.raises(error, match=word):
        call(**valid | {name: bad})
