"""Tests that error messages name the argument and suggest a fix."""

import inspect
import pickle
import re
from types import SimpleNamespace

import kreisel as kr
import numpy as np
import pytest
from kreisel import events
from kreisel._model.broadcasting import BatchParameter
from kreisel._model.ensemble_data import make_invalid_member_error
from kreisel._options import methods
from kreisel._results.path import ROUNDING, make_stop_exception
from tops import GENERAL, LAGRANGE

TOP = kr.scenes.asymmetric

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


def body():
    return LAGRANGE.body


CALLS = {
    "momentum": lambda x: kr.Scene(body(), momentum=x, gravity=1),
    "velocity": lambda x: kr.Scene(body(), velocity=x, gravity=1),
    "attitude": lambda x: kr.Scene(body(), momentum=(1, 2, 3), attitude=x, gravity=1),
    "attitude_xyzw": lambda x: kr.Scene(body(), momentum=(1, 2, 3), attitude_xyzw=x, gravity=1),
    "gravity": lambda x: GENERAL.replace(gravity=x),
    "step": lambda x: kr.solve(GENERAL, 1, "strang", step=x),
    "tol": lambda x: kr.solve(GENERAL, 1, tol=x),
    "digits": lambda x: kr.solve(GENERAL, 1, digits=x),
    "every": lambda x: kr.solve(GENERAL, 1, "strang", step=0.1, every=x),
    "max_steps": lambda x: kr.solve(GENERAL, 1, max_steps=x),
    "error": lambda x: kr.solve(GENERAL, 1, "geometric", error=x),
    "progress": lambda x: kr.solve(GENERAL, 1, progress=x),
    "method": lambda x: kr.solve(GENERAL, 1, x),
    "want": lambda x: kr.solve(GENERAL, 1, want=x),
    "events": lambda x: kr.solve(GENERAL, 1, events=x),
    "scene": lambda x: kr.solve(x, 1),
    "back": lambda x: kr.start(GENERAL, back=x),
    "chunk": lambda x: kr.stream(GENERAL, [1.0], chunk=x),
    "steps": lambda x: kr.compare(GENERAL, 1, ["rk4"], steps=[x]),
    "methods": lambda x: kr.compare(GENERAL, 1, methods=[x]),
    "repeats": lambda x: kr.compare(GENERAL, 1, ["taylor"], repeats=x),
    "map": lambda x: kr.exact(LAGRANGE, map=x, step=0.1),
    "function": lambda x: events.crossing(x),
    "value": lambda x: events.crossing("spin", x),
    "factor": lambda x: events.crossing({"spin": x}),
    "direction": lambda x: events.nutation(direction=x),
    "terminal": lambda x: events.nutation(terminal=x),
    "max_count": lambda x: events.nutation(max_count=x),
    "normal": lambda x: events.plane(x),
    "of": lambda x: events.plane((0, 1, 0), of=x),
    "within": lambda x: events.cusp(within=x),
    "what": lambda x: kr.view(x, open=False),
    "path": lambda x: kr.plot(x),
    "tops": lambda x: kr.lyapunov(x, 1.0),
    "change": lambda x: kr.lyapunov(GENERAL, 1.0, direction=x),
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
    "all": lambda t: kr.exact([LAGRANGE])(t),
    "map": lambda t: kr.exact(LAGRANGE, map="bobenko_suris", step=0.1)(t),
    "path": lambda t: kr.solve(GENERAL, 1)(t),
    "compare": lambda t: kr.compare(GENERAL, t, ["taylor"]),
}


@pytest.mark.parametrize("call", OF_TIMES.values(), ids=OF_TIMES)
@pytest.mark.parametrize("times", [ONE_NAN, ONE_NAN.tolist()], ids=["array", "list"])
def test_an_invalid_time_is_named_by_its_index(call, times):
    with pytest.raises(ValueError, match=r"must be finite, not .\[777\] = nan"):
        call(times)


@pytest.mark.parametrize("call", OF_TIMES.values(), ids=OF_TIMES)
def test_times_with_a_unit_are_refused(call):
    for times in (
        np.array([1.0, 2.0]).view(Quantity),
        np.array(1.0).view(Quantity),
        QuantityWithUnit([1.0, 2.0]),
        [QuantityWithUnit(1.0), QuantityWithUnit(2.0)],
        QuantityWithUnit(1.0),
    ):
        if np.ndim(times) or call is not OF_TIMES["stream"]:  # stream does not accept a number
            with pytest.raises(TypeError, match=r"without a unit|must be a number"):
                call(times)


@pytest.mark.parametrize(
    "name",
    ["momentum", "attitude", "velocity", "attitude_xyzw", "steps", "value", "step", "normal"],
)
def test_numbers_with_a_unit_are_refused(name):
    row = {"attitude": (1.0, 0, 0, 0), "attitude_xyzw": (0.0, 0, 0, 1)}.get(name, (1.0, 2.0, 3.0))
    if name in ("steps", "value", "step"):
        row = 1.0
    for value in (np.array(row).view(Quantity), QuantityWithUnit(row)):
        with pytest.raises(TypeError, match=r"without a unit|must be a number"):
            CALLS[name](value)


def test_messages_show_shapes_instead_of_arrays():
    with pytest.raises(ValueError, match=r"3 numbers, not an array of shape \(300, 3\)$"):
        kr.Scene(body(), momentum=ROWS, gravity=1)
    with pytest.raises(ValueError, match=r"4 numbers .* not an array of shape \(101, 4\)$"):
        CALLS["attitude_xyzw"](np.ones((101, 4)))


# Names


@pytest.mark.parametrize(
    "word, name", [("omega_y", "velocity"), ("omega", "velocity"), ("theta", "nutation"),
                    ("phi", "precession_angle"), ("psi", "spin_angle"), ("enregy", "energy")]
)  # fmt: skip
def test_textbook_names_of_quantities_get_a_hint(word, name):
    with pytest.raises(ValueError, match=f"did you mean '{name}'"):
        kr.solve(GENERAL, 1, want=[word])
    with pytest.raises(AttributeError, match=f"a path has no '{word}'; did you mean '{name}'"):
        getattr(kr.solve(GENERAL, 1), word)


def test_known_names_are_listed_once():
    with pytest.raises(AttributeError) as refusal:
        kr.solve(GENERAL, 1).qqqqqqqqqqqq  # noqa: B018
    names = str(refusal.value).partition("known are ")[2].split(", ")
    assert len(names) > 30 and len(set(names)) == len(names)


# Messages about a tolerance or a step


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
    assert f"step       20: the top turns by about {plan.turn:.2g} rad in each step" in str(plan)
    assert kr.plan(GENERAL).turn is None and "in each" not in str(kr.plan(GENERAL, step=1))
    still = kr.Scene(body(), momentum=(0, 0, 0), gravity=0)
    assert kr.plan(still, method="strang", step=1).turn == 0.0


# Boundary values


def test_a_tolerance_below_rounding_is_reported():
    with pytest.raises(kr.Error) as error:
        kr.solve(TOP, [10.0], "extrap", tol=ROUNDING / 64, max_steps=1000)
    assert "which is below the rounding of doubles" in str(error.value)


def test_a_tolerance_equal_to_rounding_is_not_below_rounding():
    for tol, is_below in ((ROUNDING, False), (0.5 * ROUNDING, True)):
        path = SimpleNamespace(tol=tol)
        error = make_stop_exception("ERR_STEP", path, "it reached t = 1")
        assert ("below the rounding" in str(error)) == is_below and f"tol = {tol!r}" in str(error)


@pytest.mark.parametrize("name", ["gsl_rk8pd", "gsl_bsimp"])
def test_a_build_without_gsl_explains_its_missing_methods(name):
    with pytest.raises(KeyError, match="is not in this build: it needs the GNU Scientific Library"):
        methods.Methods()[name]


def raise_for_several(tops):
    if tops.size > 1:
        raise ValueError("not together")


def test_errors_without_a_cause_name_the_member():
    """Test the messages for an ensemble that is refused although each of its tops is valid."""
    words = [BatchParameter("gravity", np.array([1.0, 2.0]), ())]
    errors = [
        words[0].make_error_for_value_at((1,), lambda name, value: value),
        make_invalid_member_error(GENERAL.body, words, lambda body, gravity: body, (2,), (1,)),
        kr.Bodies([1.0, 2.0], np.eye(3), com=(0, 0, 0))._make_invalid_body_error(
            lambda gravity: SimpleNamespace(_block=gravity), words, (1,)
        ),
    ]
    assert [str(error) for error in errors] == [
        "gravity[1] = 2.0 is invalid",
        "top[1]: not a top",
        "body[1]: not a body",
    ]
    assert {type(error) for error in errors} == {ValueError}
    source, common = kr.Source.grid(GENERAL, gravity=[1.0, 2.0, 3.0]), ValueError("not together")
    error = source._find_error_of_first_invalid_top(raise_for_several, np.arange(3), common)
    assert error is common


# Hints about keyword arguments and attributes

PATH = kr.solve(GENERAL, 1)
RUN = kr.start(GENERAL)
KEYWORDS = [
    (kr.solve, (GENERAL, 10), "rtol", "use tol"),
    (kr.solve, (GENERAL,), "t_span", "t gives the times"),
    (kr.solve, (GENERAL, 10), "dt", "step"),
    (kr.solve, (GENERAL, 10), "degrees", "radians"),
    (kr.stream, (GENERAL, [1.0]), "chunks", "'chunk'"),
    (kr.exact, (LAGRANGE,), "steps", "'step'"),
    (kr.start, (GENERAL,), "event", "'events'"),
    (kr.fit, (GENERAL, []), "lose", "'loss'"),
    (kr.megno, (GENERAL, 1), "thread", "'threads'"),
    (kr.Scene, (LAGRANGE.body,), "momentm", "'momentum'"),
    (kr.Scene.spinning, (LAGRANGE.body,), "degree", "'degrees'"),
    (kr.Body, (1.0,), "inertia_about_con", "'inertia_about_com'"),
    (kr.Body.cuboid, (), "halves", "'half'"),
    (kr.Body.cuboid, (), "size", "half, pivot"),
    (kr.Bodies.cuboid, (), "masses", "'mass'"),
    (kr.Ensemble, (LAGRANGE.body,), "gravty", "'gravity'"),
    (kr.Record, ([0.0], {}), "sgma", "'sigma'"),
    (kr.Record.from_csv, ("none.csv",), "column", "'columns'"),
    (kr.events.nutation, (), "directon", "'direction'"),
    (GENERAL.replace, (), "gravty", "'gravity'"),
    (GENERAL.vary, (), "gravty", "'gravity'"),
    (PATH.to_pandas, (), "degree", "'degrees'"),
    (PATH.plot, (), "time_units", "'time_unit'"),
    (RUN.change, (), "gravty", "'gravity'"),
]


@pytest.mark.parametrize("function, arguments, word, hint", KEYWORDS)
def test_unknown_keywords_are_answered_by_a_hint(function, arguments, word, hint):
    with pytest.raises(TypeError, match=re.escape(hint)) as refusal:
        function(*arguments, **{word: 1})
    assert word in str(refusal.value) and "__" not in str(refusal.value)


@pytest.mark.parametrize(
    "thing, name, hint",
    [
        (kr, "simulate", "'solve'"),
        (kr, "frequences", "'frequencies'"),
        (kr.scenes, "kovalevskaya", "'kowalewski'"),
        (kr.events, "max_nutation", "'nutation'"),
        (kr.quaternion, "multipy", "'multiply'"),
        (kr.Body, "box", "'cuboid'"),
        (kr.Bodies, "cilinder", "'cylinder'"),
        (kr.Scene, "spining", "'spinning'"),
        (PATH, "quaternion", "'q'"),
        (PATH, "position", "'apex'"),
        (PATH, "times", "'t'"),
        (PATH, "to_dataframe", "'to_pandas'"),
    ],
)
def test_unknown_attributes_are_answered_by_a_hint(thing, name, hint):
    with pytest.raises(AttributeError, match=f"{name}.*{hint}"):
        getattr(thing, name)
    assert not hasattr(thing, "_private") and not hasattr(thing, "__dunder__")


def test_missing_arguments_are_named_without_inner_classes():
    for call in kr.Scene, kr.Body, kr.Body.cuboid, kr.Bodies.cuboid, kr.Record, kr.exact:
        with pytest.raises(TypeError, match=r"^(Body\.|Bodies\.)?\w+\(\) missing"):
            call()
    for matrix in np.eye(3), np.eye(3).tolist():
        with pytest.raises(ValueError, match=r"Rotation\.from_matrix"):
            kr.Scene(LAGRANGE.body, (1, 2, 3), matrix, gravity=1.0)


def test_functions_with_hints_keep_signatures_and_can_be_pickled():
    for function in kr.solve, kr.exact, kr.megno, kr.events.nutation, kr.Body.cuboid, kr.Scene:
        assert pickle.loads(pickle.dumps(function)) == function
    assert [*inspect.signature(kr.solve).parameters][:3] == ["scene", "t", "method"]
    assert inspect.signature(kr.solve).parameters["t"].default is inspect.Parameter.empty
    assert [*inspect.signature(kr.exact).parameters] == ["scene", "map", "step"]
    for function in kr.solve, kr.Scene, kr.Body, kr.exact, kr.Body.cuboid:
        kinds = {one.kind for one in inspect.signature(function).parameters.values()}
        assert inspect.Parameter.VAR_KEYWORD not in kinds
