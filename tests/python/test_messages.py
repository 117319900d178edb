"""Messages name the argument at fault, stay short, and suggest the right name."""

import inspect
import pickle
import re

import kreisel as kr
import numpy as np
import pytest
from tops import GENERAL, LAGRANGE

BODY = LAGRANGE.body
MANY = np.linspace(0.0, 1.0, 50_001)
ONE_NAN = np.where(np.arange(50_001) == 777, np.nan, MANY)
LONG = "x" * 5000
ROWS = np.ones((300, 3))
HUGE = 10**5000  # too long for Python to convert to decimal digits
VALUES = [MANY, MANY.tolist(), ROWS, ROWS.tolist(), LONG, [LONG] * 5000, {1: LONG}, HUGE, object()]


class Quantity(np.ndarray):
    """An array with a unit, like an astropy Quantity."""

    unit = "min"


class QuantityWithUnit:
    """A value with a unit that NumPy would silently drop, like a pint Quantity."""

    units = "minute"

    def __init__(self, value):
        self.value = value

    def __array__(self, dtype=None, copy=None):
        return np.asarray(self.value, dtype=dtype)

    def __float__(self):
        return float(self.value)


CALLS = {
    "momentum": lambda x: kr.start(kr.Scene(BODY, momentum=x, gravity=1)),
    "velocity": lambda x: kr.start(kr.Scene(BODY, velocity=x, gravity=1)),
    "attitude": lambda x: kr.Scene(BODY, momentum=(1, 2, 3), attitude=x, gravity=1),
    "attitude_xyzw": lambda x: kr.Scene(BODY, momentum=(1, 2, 3), attitude_xyzw=x, gravity=1),
    "gravity": lambda x: kr.start(GENERAL.replace(gravity=x)),
    "step": lambda x: kr.solve(GENERAL, 1, "strang", step=x),
    "tol": lambda x: kr.solve(GENERAL, 1, tol=x),
    "method": lambda x: kr.solve(GENERAL, 1, x),
    "want": lambda x: kr.solve(GENERAL, 1, want=x),
    "events": lambda x: kr.solve(GENERAL, 1, events=x),
    "scene": lambda x: kr.solve(x, 1),
    "steps": lambda x: kr.compare(GENERAL, 1, ["rk4"], steps=[x]),
    "function": lambda x: kr.events.crossing(x),
    "value": lambda x: kr.events.crossing("spin", x),
    "normal": lambda x: kr.events.plane(x),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_messages_abbreviate_long_arguments(call):
    for value in VALUES:
        with pytest.raises((TypeError, ValueError)) as refusal:
            call(value)
        assert 0 < len(str(refusal.value)) < 600, type(value)


OF_TIMES = {
    "solve": lambda t: kr.solve(GENERAL, t),
    "to": lambda t: kr.start(GENERAL).to(t),
    "stream": lambda t: kr.stream(GENERAL, t),
    "plan": lambda t: kr.plan(GENERAL, t),
    "exact": lambda t: kr.exact(LAGRANGE)(t),
    "compare": lambda t: kr.compare(GENERAL, t, ["taylor"]),
}


@pytest.mark.parametrize("call", OF_TIMES.values(), ids=OF_TIMES)
@pytest.mark.parametrize("times", [ONE_NAN, ONE_NAN.tolist()], ids=["array", "list"])
def test_an_invalid_time_is_named_by_its_index(call, times):
    with pytest.raises(ValueError, match=r"must be finite, not .\[777\] = nan"):
        call(times)


WITH_UNITS = {  # {argument or function: a value, to which a unit is given}
    **dict.fromkeys(OF_TIMES, (1.0, 2.0)),
    **dict.fromkeys(["momentum", "velocity", "normal"], (1.0, 2.0, 3.0)),
    **dict.fromkeys(["attitude", "attitude_xyzw"], (0.0, 0.0, 0.0, 1.0)),
    **dict.fromkeys(["steps", "value", "step"], 1.0),
}


@pytest.mark.parametrize("name", WITH_UNITS)
def test_numbers_with_a_unit_are_refused(name):
    number, call = WITH_UNITS[name], (CALLS | OF_TIMES)[name]
    for value in (np.array(number).view(Quantity), QuantityWithUnit(number)):
        with pytest.raises(TypeError, match=r"without a unit|must be a number"):
            call(value)


@pytest.mark.parametrize(
    "method, words",
    [("taylor", {}), ("extrap", {}), ("implicit_midpoint", {"step": 0.1})],
)
def test_an_unreachable_tolerance_is_named(method, words):
    message = "at tol = 1e-40, which is below the rounding of doubles: "
    with pytest.raises(kr.Error, match=message + method):
        kr.solve(kr.scenes.asymmetric, 1, method, tol=1e-40, **words)


def test_the_plan_shows_the_rotation_per_step():
    plan = kr.plan(LAGRANGE, method="strang", step=20)
    speed = np.linalg.norm(kr.solve(LAGRANGE, [0.0]).velocity)
    assert plan.turn >= 20 * speed * (1 - 1e-15)
    assert f"{plan.turn:.2g} rad in each step" in str(plan) and kr.plan(GENERAL).turn is None
    still = kr.Scene(BODY, momentum=(0, 0, 0), gravity=0)
    assert kr.plan(still, method="strang", step=1).turn == 0.0


# Hints about keyword arguments and attributes

PATH = kr.solve(GENERAL, 1)
RUN = kr.start(GENERAL)
HINTS = [  # (a call or an attribute, words of the message)
    # keyword arguments
    (lambda: kr.solve(GENERAL, 10, rtol=1), "use tol"),
    (lambda: kr.solve(GENERAL, t_span=1), "t gives the times"),
    (lambda: kr.solve(GENERAL, 10, dt=1), "step"),
    (lambda: kr.solve(GENERAL, 10, degrees=1), "radians"),
    (lambda: kr.stream(GENERAL, [1.0], chunks=1), "'chunk'"),
    (lambda: kr.exact(kr.scenes.kowalewski)(1.0, tangnets="start"), "'tangents'"),
    (lambda: PATH(1.0, whant=1), "Path()"),
    (lambda: kr.fit(GENERAL, [], lose=1), "'loss'"),
    (lambda: kr.Scene(BODY, momentm=1), "'momentum'"),
    (lambda: kr.Scene.spinning(BODY, degree=1), "'degrees'"),
    (lambda: kr.Body(1.0, inertia_about_con=1), "'inertia_about_com'"),
    (lambda: kr.Body.cuboid(halves=1), "'half'"),
    (lambda: kr.Body.cuboid(size=1), "half, pivot"),
    (lambda: kr.Body.cuboid(masses=1), "'mass'"),
    (lambda: kr.Scene(BODY, gravty=1), "'gravity'"),
    (lambda: kr.Record([0.0], {}, sgma=1), "'sigma'"),
    (lambda: kr.Record.from_csv("none.csv", column=1), "'columns'"),
    (lambda: kr.events.nutation(directon=1), "'direction'"),
    (lambda: GENERAL.replace(gravty=1), "'gravity'"),
    (lambda: PATH.to_pandas(degree=1), "'degrees'"),
    (lambda: PATH.plot(time_units=1), "'time_unit'"),
    (lambda: RUN.change(gravty=1), "'gravity'"),
    # attributes
    (lambda: kr.simulate, "'solve'"),
    (lambda: kr.frequences, "'frequencies'"),
    (lambda: kr.scenes.kovalevskaya, "'kowalewski'"),
    (lambda: kr.events.max_nutation, "'nutation'"),
    (lambda: kr.Body.box, "'cuboid'"),
    (lambda: kr.Scene.spining, "'spinning'"),
    (lambda: PATH.quaternion, "'q'"),
    (lambda: PATH.to_dataframe, "'to_pandas'"),
    # names of quantities, methods and scenes
    (lambda: PATH.omega_y, "'velocity'"),
    (lambda: PATH.enregy, "'energy'"),
    (lambda: kr.solve(GENERAL, 1, want=["omega"]), "'velocity'"),
    (lambda: kr.solve(GENERAL, 1, want=["theta"]), "'nutation'"),
    (lambda: kr.solve(GENERAL, 1, want=["phi"]), "'precession_angle'"),
    (lambda: kr.solve(GENERAL, 1, "strng"), "'strang'"),
    (lambda: kr.methods["rk5"], "'rk4'"),
    (lambda: kr.scenes.get_scene("kowalevski"), "'kowalewski'"),
]


@pytest.mark.parametrize(("use", "hint"), HINTS, ids=[hint for _, hint in HINTS])
def test_unknown_names_are_answered_by_a_hint(use, hint):
    errors = AttributeError, KeyError, TypeError, ValueError
    with pytest.raises(errors, match=re.escape(hint)) as refusal:
        use()
    assert "__" not in str(refusal.value)


def test_known_names_are_listed_once():
    with pytest.raises(AttributeError) as refusal:
        PATH.qqqqqqqqqqqq  # noqa: B018
    names = str(refusal.value).partition("known are ")[2].split(", ")
    assert len(names) > 30 and len(set(names)) == len(names)
    for module in kr, kr.events, kr.quaternion:
        assert dir(module) == sorted(module.__all__)
    for thing in kr, kr.scenes, kr.events, kr.Body, PATH:
        assert not hasattr(thing, "_private") and not hasattr(thing, "__dunder__")


def test_missing_arguments_are_named_without_inner_classes():
    for call in kr.Scene, kr.Body, kr.Body.cuboid, kr.Record, kr.exact:
        with pytest.raises(TypeError, match=r"^(Body\.)?\w+\(\) missing"):
            call()
    for matrix in np.eye(3), np.eye(3).tolist():
        with pytest.raises(ValueError, match=r"Rotation\.from_matrix"):
            kr.Scene(BODY, (1, 2, 3), matrix, gravity=1.0)


def test_functions_with_hints_keep_signatures_and_can_be_pickled():
    for function in kr.solve, kr.exact, kr.chaos, kr.events.nutation, kr.Body.cuboid, kr.Scene:
        assert pickle.loads(pickle.dumps(function)) == function
    assert [*inspect.signature(kr.solve).parameters][:3] == ["scene", "t", "method"]
    assert inspect.signature(kr.solve).parameters["t"].default is inspect.Parameter.empty
    assert [*inspect.signature(kr.exact).parameters] == ["scene"]
    for function in kr.solve, kr.Scene, kr.Body, kr.exact, kr.Body.cuboid:
        kinds = {one.kind for one in inspect.signature(function).parameters.values()}
        assert inspect.Parameter.VAR_KEYWORD not in kinds
