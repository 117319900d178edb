"""Tests that invalid input raises an exception of a suitable type, with a short message."""

import kreisel as kr
import numpy as np
import pytest

TOP = kr.scenes.asymmetric


class Metres(np.ndarray):
    """An array subclass with a unit that NumPy silently drops."""

    unit = "m"


MASKED = np.ma.array([1.0, 2.0, 3.0], mask=[False, True, False])
WITH_UNIT = np.array([1.0, 2.0, 3.0]).view(Metres)


@pytest.mark.parametrize(
    "call",
    [
        lambda: kr.view(TOP, step=np.float16(3.1e-5), open=False),
        lambda: kr.quaternion.turn((1, 0, 0), (1, 2, 3)),
        lambda: kr.quaternion.turn((1, 0, 0, 0), (1, 2)),
        lambda: kr.quaternion.turn((1, 0, 0, 0), {"x": 1.0, "y": 2.0, "z": 3.0}),
        lambda: kr.quaternion.turn_back((1, 0, 0, 0), ()),
        lambda: kr.quaternion.from_rotation(np.eye(3)),
        lambda: kr.events.nutation().value(TOP),
        lambda: kr.methods["rk4"].applies_to(TOP),
        lambda: kr.methods["rk4"].suits(TOP.body),
        lambda: kr.scenes.get_scene(None),
        lambda: kr.Scene.from_toml(0),
        lambda: kr.Body.rod(1e160, (0, 0, 1), mass=1),
        lambda: kr.Body.disk(1e160, (0, 0, 1), mass=1),
        lambda: kr.Body.sphere(1e160, (0, 0, 1), density=1),
        lambda: kr.exact(kr.scenes.thesis).potential(np.array([], complex)),
        lambda: kr.plot(kr.solve(TOP, [1, 2]), axes=[1, 2, 3]),
        lambda: kr.rod(kr.exact(kr.scenes.thesis)([0, 1, 2])).plot(axes=True),
        lambda: kr.rod(kr.exact(kr.scenes.thesis)([0, 1, 2])).plot(thickness=0),
        lambda: kr.rod(kr.exact(kr.scenes.thesis)([0, 1, 2])).plot(elevation="high"),
        lambda: kr.solve(TOP, MASKED),
        lambda: kr.solve(TOP, WITH_UNIT),
        lambda: TOP.replace(momentum=MASKED),
        lambda: TOP.replace(momentum=WITH_UNIT),
        lambda: kr.attitude_error(np.ma.array(np.eye(4), mask=np.eye(4)), TOP.attitude),
    ],
)
def test_invalid_input_raises_type_or_value_error(call):
    with pytest.raises((TypeError, ValueError)):
        call()


def test_a_half_precision_step_is_valid():
    assert kr.view(TOP, step=np.float16(2), open=False)


def test_messages_name_the_index_instead_of_the_whole_array():
    times = np.arange(100_000.0)
    times[777] = np.nan
    with pytest.raises(ValueError, match=r"not t\[777\] = nan") as error:
        kr.solve(TOP, times)
    assert len(str(error.value)) < 200
    with pytest.raises(TypeError) as error:
        kr.solve(TOP, ["soon"] * 100_000)
    assert len(str(error.value)) < 400


@pytest.mark.parametrize("i", [3, -4, 2**63])
def test_scene_at_a_missing_state_raises_index_error(i):
    path = kr.solve(TOP, [0, 1, 2])
    assert path.scene_at(np.int8(-1)) == path.end
    with pytest.raises(IndexError, match="a path of 3 states has no state of index"):
        path.scene_at(i)


def test_unknown_names_are_abbreviated_in_messages():
    with pytest.raises(AttributeError, match="a path has no 'xxx") as error:
        getattr(kr.solve(TOP, []), "x" * 10_000)
    assert len(str(error.value)) < 1000
    with pytest.raises(KeyError, match="did you mean 'thesis'"):
        kr.scenes.get_scene("thesi")
