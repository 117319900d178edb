"""Tests that invalid arguments are rejected before any computation starts."""

import dataclasses
import re

import kreisel as kr
import numpy as np
import pytest
from internals import core_calls
from kreisel._solve import solve

NAN, INF = float("nan"), float("inf")
BODY = {"mass": 1, "inertia": (2, 2, 1), "com": (0, 0, 1)}
CUBOID = {"half": (1, 1, 1), "pivot": (0, 0, -1)}
LAGRANGE = kr.Body(**BODY)
SCENE = {"body": LAGRANGE, "momentum": (0.1, 0.2, 0.3), "gravity": 1}
TOP = kr.Scene(**SCENE)
FIXED = {"method": "rk4", "step": 0.1}


def check_refusal(make, words, exception, message):
    with pytest.raises(exception, match=message) as error:
        make(**words)
    assert error.type is exception


@pytest.fixture(autouse=True)
def forbid_runs(monkeypatch):
    """Make calls fail that return a path; a failing run raises no TypeError or ValueError."""

    def forbid_result(original):
        def call(*words, **more):
            assert original(*words, **more) is None, "a run was begun"

        return call

    for module, name in ((core_calls, "record"), (solve, "try_to_solve_in_core")):
        monkeypatch.setattr(module, name, forbid_result(getattr(module, name)))


@pytest.mark.parametrize("words", [{}, {"every": 1}])
def test_the_beginning_of_a_run_is_noticed(words):
    with pytest.raises(AssertionError, match="a run was begun"):
        kr.solve(TOP, 1, **FIXED, **words)


@pytest.mark.parametrize(
    "change, exception, message",
    [
        ({"mass": 0}, ValueError, "mass must be positive, not 0"),
        ({"mass": -1.5}, ValueError, "mass must be positive, not -1.5"),
        ({"mass": NAN}, ValueError, "mass must be finite.* not nan"),
        ({"mass": 10**400}, ValueError, "mass must be finite in double precision"),
        ({"mass": "1"}, TypeError, "mass must be a number, not '1'"),
        ({"mass": True}, TypeError, "mass must be a number, not True"),
        ({"mass": 1j}, TypeError, "mass must be a number, not 1j"),
        ({"mass": None}, TypeError, "mass must be a number, not None"),
        ({"mass": np.array([1.0])}, TypeError, "mass must be a number"),
        (
            {"inertia": (1, 2)},
            ValueError,
            re.escape("inertia must be 3 moments or a symmetric 3x3 matrix, not (1, 2)"),
        ),
        ({"inertia": np.ones((3, 2))}, ValueError, "3 moments"),
        ({"inertia": ((1, 2), (3,))}, ValueError, "3 moments"),
        ({"inertia": (1, 2, "3")}, TypeError, "3 moments"),
        ({"inertia": (1, 2, 2 + 1j)}, TypeError, "3 moments"),
        ({"inertia": (1, 2, INF)}, ValueError, "inertia must be finite"),
        ({"inertia": (1, 2, 0)}, ValueError, "0.0 is not positive"),
        ({"inertia": (1, -2, 2)}, ValueError, r"-2.0 is not positive in \[1.0, -2.0, 2.0\]"),
        ({"inertia": (1, 2, 3.1)}, ValueError, re.escape("3.1 > 1.0 + 2.0")),
        (
            {"inertia": ((2, 1.9, 0), (1.9, 2, 0), (0, 0, 2))},
            ValueError,
            "none larger than the other two",
        ),
        ({"inertia": ((2, 2.1, 0), (2.1, 2, 0), (0, 0, 2))}, ValueError, "is not positive"),
        ({"inertia": ((2, 0.1, 0), (0.2, 2, 0), (0, 0, 2))}, ValueError, "symmetric"),
        ({"com": (0, 1)}, ValueError, re.escape("com must be 3 numbers, not (0, 1)")),
        ({"com": (0, 0, -INF)}, ValueError, "com must be finite"),
        ({"com": 1}, ValueError, "com must be 3 numbers, not 1"),
        ({"com": "abc"}, TypeError, "com must be 3 numbers"),
        ({"com": {1, 2, 3}}, TypeError, "com must be 3 numbers"),
    ],
)
def test_invalid_bodies_are_refused(change, exception, message):
    check_refusal(kr.Body, BODY | change, exception, message)


@pytest.mark.parametrize(
    "change, exception, message",
    [
        ({"half": (1, 0, 1)}, ValueError, "half must be positive, not 0.0"),
        ({"half": (1, 1)}, ValueError, "half must be 3 numbers"),
        ({"half": (1e-200, 1e-200, 1e-200)}, ValueError, "mass of the cuboid must be positive"),
        ({"half": (1e200, 1e200, 1e200)}, ValueError, "mass of the cuboid must be finite"),
        ({"density": -1}, ValueError, "density must be positive, not -1"),
        ({"pivot": (0, NAN, 0)}, ValueError, "pivot must be finite"),
        ({"pivot": (0, 1e200, 0)}, ValueError, "inertia must be finite"),
    ],
)
def test_invalid_cuboids_are_refused(change, exception, message):
    check_refusal(kr.Body.cuboid, CUBOID | change, exception, message)


def test_plates_and_rods_are_valid_bodies():
    assert kr.Body(mass=1, inertia=(1, 2, 3), com=(0, 0, 0)).moments == (1, 2, 3)
    assert kr.Body(mass=1, inertia=(1, 1, 1e-30), com=(0, 0, 1)).kind == "lagrange"
    with pytest.raises(ValueError, match=re.escape("3.00000000001 > 1.0 + 2.0")):
        kr.Body(mass=1, inertia=(1, 2, 3 + 1e-11), com=(0, 0, 0))


@pytest.mark.parametrize(
    "change, exception, message",
    [
        ({"body": BODY}, TypeError, "body must be a kreisel.Body"),
        (
            {"momentum": None},
            ValueError,
            "exactly one of momentum, velocity, body_momentum, body_velocity, not none",
        ),
        ({"velocity": (1, 0, 0)}, ValueError, "exactly one of .*, not momentum and velocity"),
        ({"momentum": (1, 2)}, ValueError, re.escape("momentum must be 3 numbers, not (1, 2)")),
        ({"momentum": (1, 2, NAN)}, ValueError, "momentum must be finite"),
        ({"momentum": None, "body_velocity": (1, 2, 1e308)}, ValueError, None),
        (
            {"attitude": (1, 0, 0)},
            ValueError,
            re.escape("attitude must be 4 numbers (w, x, y, z), not (1, 0, 0)"),
        ),
        (
            {"attitude": (1, 1, 0, 0)},
            ValueError,
            r"the norm of .* is 1.4142135623730951: divide by it",
        ),
        ({"attitude": (0, 0, 0, 0)}, ValueError, r"norm of .* is 0.0: upright is \(1, 0, 0, 0\)$"),
        (
            {"attitude": (0.7071, 0, 0, 0.7071)},
            ValueError,
            "unit quaternion; the norm of .* is 0.99999",
        ),
        ({"attitude": (1, 0, 0, NAN)}, ValueError, "attitude must be finite"),
        (
            {"attitude_xyzw": (0, 0, 1)},
            ValueError,
            re.escape("attitude_xyzw must be 4 numbers (x, y, z, w)"),
        ),
        ({"attitude": (1, 0, 0, 0), "attitude_xyzw": (0, 0, 0, 1)}, ValueError, "not both"),
        ({"gravity": INF}, ValueError, "gravity must be finite"),
        (
            {"gravity": (0, 0, -1)},
            TypeError,
            r"be a number, not \(0, 0, -1\): it is the acceleration along -e3, positive is down",
        ),
        ({"gravty": 1}, TypeError, "gravty"),
    ],
)
def test_invalid_scenes_are_refused(change, exception, message):
    if message is None:
        change = change | {"body": kr.Body(mass=1, inertia=(20, 20, 10), com=(0, 0, 1))}
        message = "not finite"
    check_refusal(kr.Scene, SCENE | change, exception, message)


def test_an_attitude_may_be_off_by_rounding():
    q = np.array([0.8, 0.4, -0.2, 0.4])
    assert kr.Scene(LAGRANGE, (0, 0, 1), tuple(q * (1 + 4e-13)), gravity=1).attitude[0] > 0.8
    with pytest.raises(ValueError, match="divide by it"):
        kr.Scene(LAGRANGE, (0, 0, 1), tuple(q * (1 + 1e-12)), gravity=1)


@pytest.mark.parametrize(
    "words, exception, message",
    [
        ({"scene": LAGRANGE}, TypeError, "scene must be a kreisel.Scene, not Body"),
        ({"t": NAN}, ValueError, "t must be finite, not nan"),
        ({"t": [1, INF]}, ValueError, "t must be finite"),
        ({"t": "10"}, TypeError, "t must be a number or a list of times, not '10'"),
        ({"t": None}, TypeError, "t must be a number or a list of times"),
        ({"t": True}, TypeError, "t must be a number or a list of times"),
        ({"t": [1, 2j]}, TypeError, "t must be a number"),
        (
            {"t": [[1, 2]]},
            ValueError,
            r"t must be a number or a list of times, not an array of shape \(1, 2\)",
        ),
        ({"t": [[1, 2], 3]}, ValueError, "t must be a number"),
        ({"t": [1, 3, 2]}, ValueError, re.escape("t[2] = 2.0 goes back from t[1] = 3.0")),
        ({"t": [1, -1]}, ValueError, re.escape("t[0] = 1.0 goes back from the start at 0")),
        ({"t": [-1, -0.5]}, ValueError, re.escape("t[1] = -0.5 goes back from t[0] = -1.0")),
        (
            {"t": 1e300},
            ValueError,
            r"t = 1e\+300 this top turns by .* double precision cannot resolve",
        ),
        ({"t": 1e300, **FIXED}, ValueError, "more steps of 0.1 than double precision can count"),
        ({"step": 1e-300, "method": "rk4"}, ValueError, "more steps of 1e-300"),
        ({"step": 1e-300, "method": "rk4", "every": 1}, ValueError, "more steps of 1e-300"),
        (
            {"t": 1e14, **FIXED, "every": 1},
            MemoryError,
            "1000000000000001 states need .* larger every",
        ),
        (
            {"method": "bobenko-suris"},
            ValueError,
            "unknown method 'bobenko-suris'; did you mean 'bobenko_suris'?",
        ),
        ({"method": "RK4"}, ValueError, "unknown method 'RK4'; did you mean 'rk4'?"),
        (
            {"method": "qqq"},
            ValueError,
            "unknown method 'qqq'; known are auto, exact, bobenko_suris",
        ),
        ({"method": 4}, TypeError, "method must be a name in kreisel.methods, not 4"),
        ({"method": "rk4"}, ValueError, "method 'rk4' has a fixed step: give step"),
        ({"method": "rk4", "step": 0}, ValueError, "step must be positive, not 0"),
        ({"method": "rk4", "step": -0.1}, ValueError, "step must be positive, not -0.1"),
        ({"method": "rk4", "step": NAN}, ValueError, "step must be finite"),
        ({"method": "rk4", "step": "0.1"}, TypeError, "step must be a number, not '0.1'"),
        ({"method": "rk4", "step": [0.1]}, TypeError, "step must be a number"),
        ({**FIXED, "tol": 1e-6}, ValueError, "method 'rk4' has no tolerance"),
        ({"tol": 0}, ValueError, "tol must be positive, not 0"),
        ({"tol": INF}, ValueError, "tol must be finite"),
        ({"method": "taylor", "tol": 2}, ValueError, "tol must be below 1, .* not 2"),
        (
            {"method": "veselov4", "step": 0.1, "tol": 2},
            ValueError,
            "tol must be below 1, .* not 2",
        ),
        ({"step": -1}, ValueError, "step must be positive"),
        ({"every": 2}, ValueError, "every needs a method of fixed step; exact has none"),
        ({**FIXED, "every": 0}, ValueError, "every must be at least 1"),
        ({**FIXED, "every": 1.0}, TypeError, "every must be a whole number, not 1.0"),
        ({**FIXED, "every": True}, TypeError, "every must be a whole number"),
        ({**FIXED, "every": 2, "t": [1, 2]}, ValueError, "every needs t as a number"),
        ({**FIXED, "max_steps": -1}, ValueError, "max_steps must be at least 0"),
        ({**FIXED, "max_steps": 2**63}, ValueError, "max_steps must be at least 0 and less than"),
        ({"eps": 1e-3}, TypeError, "eps"),
    ],
)
def test_invalid_arguments_of_solve_are_refused(words, exception, message):
    check_refusal(kr.solve, {"scene": TOP, "t": 10, **words}, exception, message)


@pytest.mark.parametrize("reader", [kr.rod, kr.apex])
def test_functions_of_a_path_refuse_scenes(reader):
    with pytest.raises(TypeError, match=r"path must be a kreisel.Path, not Scene\("):
        reader(TOP)


def test_a_method_that_does_not_apply_is_refused():
    asymmetric = kr.scenes.asymmetric
    with pytest.raises(
        ValueError,
        match=r"'bobenko_suris' does not apply to this body of kind 'general'.*strang, .*rk4",
    ):
        kr.solve(asymmetric, 1, "bobenko_suris", step=0.1)


@pytest.mark.parametrize("name", sorted({"gsl_rk8pd", "gsl_bsimp"} - set(kr.methods)))
def test_methods_of_gsl_explain_how_to_build_them(name):
    with pytest.raises(ValueError, match=r"GNU Scientific Library .*KREISEL_GSL=ON"):
        kr.solve(TOP, 1, name)


@pytest.mark.parametrize(
    "words, exception, message",
    [
        ({"scene": LAGRANGE}, TypeError, "scene must be a kreisel.Scene"),
        ({"methods": "rk4"}, TypeError, "methods must be a list of names, not 'rk4'"),
        ({"methods": ["rk5"]}, ValueError, "unknown method 'rk5'; did you mean 'rk4'?"),
        ({"methods": ["rk4"]}, ValueError, r"give steps, as in steps=\[0.1, 0.01\]"),
        ({"methods": ["extrap"], "tols": [0]}, ValueError, "tols must be positive"),
        ({"methods": ["extrap"], "tols": 1e-3}, TypeError, r"tols must be a list, .* not 0.001"),
        ({"methods": ["rk4"], "steps": 0.1}, TypeError, r"steps must be a list, .* not 0.1"),
        ({"methods": ["geometric"]}, ValueError, "only kreisel.solve accepts it"),
        ({"methods": ["rk4"], "steps": ["a"]}, TypeError, "steps must be a number"),
        (
            {"methods": ["rk4"], "steps": [0.1], "repeats": 0},
            ValueError,
            "repeats must be at least 1",
        ),
        (
            {"methods": ["extrap"], "truth": "rk4"},
            ValueError,
            "method 'rk4' of truth has a fixed step",
        ),
        ({"methods": ["extrap"], "truth": "rk44"}, ValueError, "unknown method 'rk44'"),
    ],
)
def test_invalid_arguments_of_compare_are_refused(words, exception, message):
    check_refusal(kr.compare, {"scene": TOP, "t": 10, **words}, exception, message)


@pytest.mark.parametrize(
    "make",
    [
        lambda: kr.Body(list(range(10**5)), (1, 1, 1), (0, 0, 0)),
        lambda: kr.Body(1, np.full((400, 3), 0.123456789), (0, 0, 0)),
        lambda: kr.Body(1, (1, 1, 1), ["x" * 10**6] * 3),
        lambda: kr.Body(1, (1, 1, 1), (0, 0, 0), unphysical=list(range(10**5))),
        lambda: kr.Body.disk(10**5000, (0, 0, 0), mass=1),
        lambda: kr.Body.sphere("x" * 10**6, (0, 0, 0), mass=1),
        lambda: kr.Scene("x" * 10**6, (1, 2, 3), gravity=1),
        lambda: kr.Scene(LAGRANGE, np.full((300, 3), 0.123456789), gravity=1),
        lambda: kr.Scene(LAGRANGE, (1, 2, 3), np.full((300, 4), 0.123456789), gravity=1),
        lambda: kr.Scene(LAGRANGE, (1, 2, 3), gravity=np.full((300, 3), 0.123456789)),
        lambda: kr.Scene(LAGRANGE, (1, 2, 3), gravity=-(10**5000)),
        lambda: kr.Scene.from_toml(f"momentum = {list(range(10**4))}\n[body]\nmass = 1"),
        lambda: kr.Scene.from_toml(f"{'x' * 10**6} = 1\n" + TOP.to_toml()),
        lambda: kr.Scene.from_toml(f"body = {list(range(10**4))}\nmomentum = [1, 2, 3]"),
        lambda: kr.starts(LAGRANGE, energy=1, vertical=1, grid=list(range(10**5)), gravity=1),
    ],
)
def test_long_arguments_are_abbreviated(make):
    with pytest.raises((TypeError, ValueError)) as error:
        make()
    assert len(str(error.value)) < 400 and "\n" not in str(error.value)


@pytest.mark.parametrize("field", ["gravity", "momentum", "gravty"])
def test_assignment_to_a_scene_suggests_replace(field):
    with pytest.raises(dataclasses.FrozenInstanceError, match=rf"scene\.replace\({field}=\.\.\.\)"):
        setattr(TOP, field, 9.81)
    with pytest.raises(AttributeError, match=r"dataclasses\.replace\(body, mass=\.\.\.\)"):
        LAGRANGE.mass = 2


@pytest.mark.parametrize("call", [kr.start, lambda s, m: kr.stream(s, [1.0], m)])
def test_streams_and_runs_refuse_geometric(call):
    with pytest.raises(ValueError, match=r"method='geometric' needs trial runs: .* kreisel\.solve"):
        call(TOP, "geometric")


def test_an_unknown_scene_gets_a_hint():
    with pytest.raises(KeyError, match="unknown scene 'tesis'; did you mean 'thesis'"):
        kr.scenes.get_scene("tesis")
