"""Tests that valid calls pass, and that invalid arguments are refused by name.

Values that each parameter may and may not have are in argument_values.py. The tables below hold
what depends on several arguments, or on the body.
"""

import inspect
import re
import webbrowser

import kreisel as kr
import numpy as np
import pytest
from argument_values import VARIABLE, get_arguments, get_wrong_values, spread, write_files
from public_api import calls

CALLS = {name: call for name, call in calls().items() if call[1]}
SKIPPED = {  # no parameter by name, or no valid call
    *("methods.__getitem__", "Body.reshape", "Scene.reshape", "ExactTorus.__getitem__"),
    *(f"{name}.__getattr__" for name in ("Path", "Section")),
    *(name for name in CALLS if name.endswith("potential") and name != "Exact.potential"),
}
# The places of objects that have what a call needs: many tops, a symmetric body, tangents.
PLACES = {"Body.__getitem__": -3, "Body.shift": 1, "Body.with_rotor": 1, "Path.derivative": 7}
PLACES |= {"Chaos.__getitem__": 1, "Chaos.message": 1, "Exact.__getitem__": 2}
PLACES["Scene.__getitem__"] = 7
SAID = spread(  # words in messages other than the name of the parameter
    {
        "function where": "function|where|quantity|factor|callable",
        "i1 i3 inertia inertia_about_com": "i1|i3|inertia|moments",
        "methods truth": "method|truth",
        "x y": "component",
        "of": "vector",
        "which": "states",
        "i": "part|ind|integer",
        "what": "view",
        "reduce": "reduc",
    }
)
pytestmark = pytest.mark.filterwarnings("ignore:.*no body has this inertia", "ignore:.*unphysical")


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("refusals"))
        patch.setattr(webbrowser, "open", lambda *_, **__: True)
        write_files()
        yield


@pytest.mark.parametrize("name", [name for name in CALLS if name not in SKIPPED])
def test_valid_calls_pass_and_invalid_values_are_refused_by_name(name):
    factories, parameters = CALLS[name]
    make_call, valid = factories[PLACES.get(name, 0)], get_arguments(name, parameters)
    make_call()(**valid)
    for p in parameters:
        said = None if name.startswith("quaternion.") else SAID.get(p.name, re.escape(p.name))
        for value in get_wrong_values(name, p.name) if p.kind not in VARIABLE else ():
            if value is None and p.default is None:
                continue
            with pytest.raises((TypeError, ValueError), match=said) as error:
                result = make_call()(**{**valid, p.name: value})
                next(result) if inspect.isgenerator(result) else None
                pytest.fail(f"{p.name} = {value!r:.50} is accepted")
            assert len(str(error.value)) < 1000, p.name


NAN, INF = float("nan"), float("inf")
THESIS, ASYMMETRIC, FREE = kr.scenes.thesis, kr.scenes.asymmetric, kr.scenes.dzhanibekov
SYMMETRIC, GENERAL = kr.Body(1, (2, 2, 1), (0, 0, 1)), ASYMMETRIC.body
TOP = kr.Scene(SYMMETRIC, (0.1, 0.2, 0.3), gravity=1)
CONE = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1.5)
LINE = kr.Body.rod(0.12, (0, 0, -0.06), mass=0.02)
SLOW = kr.Body(1.0, (1.0, 1.0, 0.5), (0, 0, 0))
SLENDER = kr.Body(1.0, (1.0, 1.0, 1e-6), (0, 0, 0))  # spins a million times as fast as it turns
GYROSTAT = kr.Body(1, (2, 2, 1), (0, 0, 1), rotor=(0, 0, 0.5))
HEAVY = kr.Body(1, (20, 20, 10), (0, 0, 1))
KOWALEWSKI = kr.Scene(kr.scenes.kowalewski.body, (0.3, 1.1, 0.8), gravity=1)
PATH = kr.solve(ASYMMETRIC, np.linspace(0, 10, 101))
UPRIGHT = THESIS.replace(attitude=(1, 1e-14, 0, 0), momentum=(0, 0, 0))
BODY = {"mass": 1, "inertia": (2, 2, 1), "com": (0, 0, 1)}
SCENE = {"body": SYMMETRIC, "momentum": (0.1, 0.2, 0.3), "gravity": 1}
AT = {"pivot": (0, 0, 0)}
WHEELED = GENERAL.with_wheel(inertia=0.1, axis=(0, 0, 1), rate=5)
WITH_WHEEL = kr.Scene(WHEELED, (0.1, 0.2, 0.3), gravity=1)
BARE_WHEEL = kr.Scene(
    SYMMETRIC.with_wheel(inertia=1, axis=(0, 0, 1), rate=5), (0.1, 0.2, 0.3), gravity=1
)
RUN = {"t": [0, 1], "q": [[1, 0, 0, 0]] * 2}
SCORE = {"results": RUN, "case": "tumble"}
OBLIQUE = CONE.with_rotor(spin=3, inertia=0.1, axis=(1, 0, 0))
INTEGRALS = {"body": CONE, "energy": 12.0, "vertical": 1.5, "axial": 2.0, "gravity": 1}
WANTED = {"body": CONE, "tilt": 0.3, "precession": 0.2, "steady": True, "gravity": 1}
SPINNING = {"body": CONE, "spin": 3.0, "tilt": 0.3, "gravity": 1}
STARTS = {"body": GENERAL, "energy": 2.0, "vertical": 0.1, "gravity": 1}
SOLVE = {"scene": TOP, "t": 10}
FIXED = {"method": "rk4", "step": 0.1}
MANY = [(1, 1, 1), (1, 1, 3)]
PAIR = TOP.vary(gravity=[1.0, 2.0])
TWO = {"scene": PAIR, "t": [0.0, 1.0]}
UP = (1, 0, 0, 0)
TURNED = {"profile": [(0, 0), (1, 1), (0, 2)], "mass": 1, **AT}
MESH = {"mesh": [np.eye(3)], "mass": 1, **AT}
LOOP = []
LOOP.append(LOOP)
# A function, its valid arguments, invalid changes, and a word of the message.
VALUE_ERRORS = [
    (kr.Body, BODY, {"inertia": (1, 2, 3 + 1e-11), "com": (0, 0, 0)}, "3.00000000001 > 1.0 + 2.0"),
    (kr.Body, BODY, {"inertia_about_com": (2, 2, 1)}, "not both"),
    (kr.Body, BODY, {"inertia": None}, "not none"),
    (kr.Body.cuboid, AT, {"half": (1e200, 1e200, 1e200)}, "mass of the cuboid"),
    (kr.Body.cuboid, {"half": (1, 1, 1)}, {"pivot": (0, 1e200, 0)}, "inertia must be finite"),
    (kr.Body.cuboid, {"half": (1, 1, 1)}, {"pivot": (3e7, -4e7, 5e7)}, "smallest principal moment"),
    (kr.Body.cone, {"radius": 1, "height": 2, **AT}, {}, "not none"),
    (kr.Body.cone, {"radius": 1, "height": 2, **AT}, {"mass": 1, "density": 1}, "not both"),
    (kr.Body.sphere, {"radius": 1, **AT}, {"density": 1, "shell": True}, "thin"),
    (kr.Body.from_profile, TURNED, {"profile": [(0, 0), (1, 1), (1, 0), (0, 1)]}, "crosses itself"),
    (kr.Body.from_profile, TURNED, {"profile": [(0, 0), (1, 1), (2, 2)]}, "no volume"),
    (kr.Body.from_profile, TURNED, {"profile": [(0, 0), (-1, 1), (0, 2)]}, "negative radii"),
    (kr.Body.from_profile, TURNED, {"profile": [(0, 0), (1, 1)]}, "at least 3 pairs"),
    (kr.Body.from_mesh, MESH, {"mesh": [np.eye(3)]}, "closed surface"),
    (kr.Body.from_mesh, MESH, {"mesh": [np.eye(3), np.eye(3)[::-1]]}, "no volume"),
    (kr.Body.from_mesh, MESH, {"scale": -1}, "scale must be positive"),
    (kr.Body.from_mesh, MESH, {"mesh": [np.eye(3) * NAN]}, "finite"),
    (kr.Body.from_mesh, MESH, {"mesh": []}, "(n, 3, 3)"),
    (kr.Body.tube, {"inner": 1, "outer": 1, "height": 1, **AT}, {"density": 1}, "thin"),
    (kr.Body.tube, {"inner": 2, "outer": 1, "height": 1, **AT}, {"mass": 1}, "inner"),
    (kr.Body.sphere, {"radius": [1, NAN], **AT}, {"mass": 1}, "radius[1] = nan"),
    (kr.Body.cuboid, {"half": [(1, 1, 1), (1, 0, 1)], **AT}, {}, "half[1]"),
    (kr.Body.sphere, {"radius": [1, 1e200], **AT}, {"density": 1}, "sphere[1] = inf"),
    (kr.Body, {"mass": 1, "com": (0, 0, 0)}, {"inertia": MANY}, "body[1]: the body is not phys"),
    (kr.Body, {"mass": 1, "com": (0, 0, 0)}, {"inertia": [(2, 2, 1)] * 3}, "three matrices"),
    (
        kr.Body,
        {"mass": 1, "com": (0, 0, 0)},
        {"inertia": [np.eye(3), np.full((3, 3), NAN)]},
        "inertia[",
    ),
    (kr.Body, BODY, {"mass": [1, 2], "com": np.ones((3, 3))}, "broadcast"),
    (kr.Scene, SCENE, {"momentum": None}, "exactly one of momentum"),
    (kr.Scene, SCENE, {"velocity": (1, 0, 0)}, "not momentum and velocity"),
    (kr.Scene, {"body": HEAVY, "gravity": 1}, {"body_velocity": (1, 2, 1e308)}, "not finite"),
    (kr.Scene, SCENE, {"attitude": (1 + 2e-12, 0, 0, 0)}, "divide by it"),
    (kr.Scene, SCENE, {"attitude": (1, 0, 0, 0), "attitude_xyzw": (0, 0, 0, 1)}, "not both"),
    (kr.Scene, SCENE, {"body": LINE}, "thin rod"),
    (kr.Scene.spinning, SPINNING, {"body": GENERAL}, "symmetric body"),
    (kr.Scene.spinning, SPINNING, {"body": kr.Body(1, (1, 2, 2), (0, 0, 0))}, "third axis"),
    (kr.Scene.spinning, SPINNING, {"body": kr.Body(1, (2, 2, 1), (0.5, 0, 0))}, "symmetric body"),
    (kr.Scene.spinning, SPINNING, {"tilt": -5e-324}, "between 0 and pi"),
    (kr.Scene.spinning, SPINNING, {"tilt": np.nextafter(np.pi, 4)}, "between 0 and pi"),
    (kr.Scene.spinning, SPINNING, {"tilt": 181, "degrees": True}, "between 0 and 180"),
    (kr.Scene.spinning, SPINNING, {"fast": True}, "steady=True"),
    (kr.Scene.spinning, SPINNING, {"steady": True, "precession": 1}, "precession"),
    (kr.Scene.spinning, SPINNING, {"steady": True, "damping": (0, 0, 1)}, "damping"),
    (kr.Scene.spinning, SPINNING, {"steady": True, "spin": 0.0, "tilt": np.pi / 2}, "falls"),
    (kr.Scene.spinning, SPINNING, {"steady": True, "tilt": np.pi / 2, "fast": True}, "only one"),
    (kr.Scene.spinning, SPINNING, {"steady": True, "body": GYROSTAT}, "rotor"),
    (kr.Scene.spinning, WANTED, {"precession": [0.2, 0.0]}, "precession[1] = 0.0"),
    (kr.Scene.spinning, WANTED, {"tilt": np.pi}, "tilt must not be vertical"),
    (kr.Scene.spinning, WANTED, {"fast": True}, "instead of fast"),
    (kr.Scene.from_integrals, INTEGRALS, {"energy": [12, 1.0]}, "top[1]: no motion"),
    (kr.Scene.from_integrals, INTEGRALS, {"energy": 1e308}, "no motion"),
    (kr.Scene.from_integrals, INTEGRALS, {"body": GENERAL}, "symmetric body"),
    (kr.Scene.from_integrals, INTEGRALS, {"body": OBLIQUE}, "along its apex"),
    (TOP.vary, {}, {"lower": True}, "lower"),
    (kr.steady, {"body": GENERAL, "gravity": 1}, {"rate": [1.0, NAN]}, "rate must be finite"),
    (kr.steady, {"body": GENERAL, "gravity": 1}, {"turning": (1, 0, 0)}, "away from the fixed"),
    (kr.steady, {"body": GYROSTAT, "gravity": 1}, {"turning": (1, 0, 0)}, "does not support"),
    (kr.steady, {"body": GENERAL, "gravity": 1, "rate": 1}, {"body": WHEELED}, "scene.body"),
    (kr.steady, {"body": FREE.body}, {"turning": (0, 0, 1)}, "horizontal"),
    (kr.steady, {"body": GENERAL, "gravity": 1}, {"rate": 1e80}, "too large"),
    (kr.steady, {"body": GENERAL, "gravity": 1}, {"rate": [[1.0]]}, "a number or a sequence"),
    (kr.citation, {}, {"result": "strng"}, "did you mean 'strang'"),
    (TOP.replace(turning=(0, 0, 1)).vary, {}, {"energy": 12}, "with turning"),
    (kr.Scene.from_integrals, INTEGRALS, {"body": WHEELED}, "with wheels"),
    (kr.Scene.stack, {}, {"scenes": [TOP, PAIR]}, "same shape"),
    (PAIR[:0].to_toml, {}, {}, "a scene of no tops"),
    (kr.solve, SOLVE, {"want": ["t"]}, "no quantity besides t"),
    (kr.section, {"scene": PAIR}, {"max_wait": [1, 2, 3]}, "an array of shape (2,)"),
    (kr.view, {}, {"what": PAIR}, "select it by its index"),
    (kr.starts, STARTS, {"n": 1, "energy": 1e308}, "energy = 1e+308 is too large"),
    (kr.starts, STARTS, {"grid": (1,)}, "2 or 3 whole numbers"),
    (GENERAL.with_wheel, {"axis": (0, 0, 1), "rate": 1}, {"inertia": 0}, "must be positive"),
    (kr.Scene.spinning, SPINNING, {"steady": True, "spin": [90.0, 0.01]}, "top[1]: there is no"),
    (kr.starts, STARTS, {}, "not none"),
    (kr.starts, STARTS, {"n": 1, "body": GYROSTAT}, "rotor"),
    (kr.starts, STARTS, {"n": 3, "grid": (1, 1, 1)}, "not both"),
    (kr.starts, STARTS, {"grid": (1, 1, 1), "energy": -3.9}, "finer grid"),
    (kr.starts, STARTS, {"n": 3, "vertical": 1e200}, "too large"),
    (kr.starts, STARTS, {"grid": (2, 2), "gravity": 1e200}, "too large"),
    (kr.citation, {"result": "strang"}, {"result": "strng"}, "did you mean 'strang'"),
    (kr.score, SCORE, {"results": {**RUN, "time": [0, 1]}}, "several columns are t"),
    (kr.score, SCORE, {"results": {"t": [0, 1]}}, "no column qw"),
    (kr.score, SCORE, {"results": {**RUN, "t": [0, 1, 2]}}, "equal length"),
    (kr.score, SCORE, {"results": {**RUN, "q": [[NAN] * 4] * 2}}, "finite"),
    (kr.score, SCORE, {"results": {**RUN, "t": [1, 0]}}, "ascend"),
    (kr.score, SCORE, {"results": {**RUN, "q": [[9, 0, 0, 0]] * 2}}, "norm"),
    (kr.events.crossing, {"function": "m_x"}, {"where": {"m_x": 0}}, "where is zero"),
    (kr.events.wheel_rate, {"scene": WITH_WHEEL}, {"index": 1}, "has 1 wheel"),
    (kr.events.wheel_rate, {"scene": WITH_WHEEL}, {"scene": TOP}, "has 0 wheels"),
    (kr.events.wheel_rate, {"scene": WITH_WHEEL}, {"scene": BARE_WHEEL}, "is constant"),
    (lambda scene, t: [*kr.stream(scene, iter(t))], SOLVE, {"t": [(1, 2)]}, "iterator"),
    (kr.start(THESIS).push, {"impulse": (0, 0, 1)}, {"impulse": (0, 0, 1.7e308)}, "range"),
    (kr.solve, SOLVE, {"t": [1, -1]}, "t[0] = 1.0 goes back from the start"),
    (kr.solve, SOLVE, {"t": [*range(777), NAN]}, "t[777] = nan"),
    (kr.solve, SOLVE, {"t": 1e300}, "cannot resolve"),
    (kr.solve, SOLVE, {"t": 1e300, **FIXED}, "more steps of 0.1"),
    (kr.solve, SOLVE, {"method": "RK4"}, "did you mean 'rk4'"),
    (kr.solve, SOLVE, {"method": "rk4"}, "fixed step"),
    (kr.solve, SOLVE, {**FIXED, "tol": 1e-6}, "no tolerance"),
    (kr.solve, SOLVE, {"method": "taylor", "tol": 2}, "below 1"),
    (kr.solve, SOLVE, {"every": 2}, "every needs a method of fixed step"),
    (kr.solve, SOLVE, {**FIXED, "every": 2, "t": [1, 2]}, "t as a number"),
    (kr.solve, SOLVE, {"scene": ASYMMETRIC, "method": "exact"}, "kind 'general'"),
    (kr.solve, SOLVE, {"scene": ASYMMETRIC, **FIXED, "method": "bobenko_suris"}, "strang"),
    (kr.start, {"scene": TOP}, {"method": "geometric"}, "kreisel.solve"),
    (kr.stream, SOLVE, {"t": [1.0], "method": "geometric"}, "kreisel.solve"),
    (kr.solve, TWO, {**FIXED, "t": [[1], [2]], "every": 2}, "every needs t as a number"),
    (kr.solve, TWO, {"out": np.empty((2, 2, 8)), "want": ("q",)}, "leave out want"),
    (kr.reduce, {"scene": PAIR, "t": 1}, {"reductions": {}}, "no quantity"),
    (kr.reduce, {"scene": PAIR, "t": 1}, {"reductions": {"nutation": ()}}, "is empty"),
    (kr.Scene.stack, {"scenes": LOOP}, {}, "contain themselves"),
    (kr.Scene, SCENE, {"attitude": UP, "attitude_xyzw": UP}, "not both"),
    (kr.Scene.spinning, SPINNING, {"body": THESIS.body, "spin": [1.0, 1e308]}, "top[1]: "),
    (kr.compare, SOLVE, {"methods": ["rk4"]}, "give steps"),
    (kr.compare, SOLVE, {"methods": ["extrap"], "truth": "rk4"}, "fixed step"),
    (kr.exact, {"scene": ASYMMETRIC}, {}, "two equal moments"),
    (kr.exact, {"scene": ASYMMETRIC.replace(turning=(0, 0, 1))}, {}, "two equal moments"),
    (kr.exact, {"scene": THESIS.replace(friction=0.1)}, {}, "friction"),
    (kr.enclose, SOLVE, {"scene": TOP.replace(friction=0.1)}, "dry friction"),
    (kr.enclose, {"scene": ASYMMETRIC, "t": 200.0}, {"digits": 15}, "try digits="),
    (kr.enclose, SOLVE, {"t": 1e300}, "cannot resolve"),
    (kr.enclose(TOP, [0.0, 1.0]).compare, {"path": kr.solve(TOP, 1.0)}, {"path": PATH}, "times"),
    (kr.solve(PAIR, 1.0).verify, {}, {}, "one top"),
    (kr.exact, {"scene": THESIS.replace(damping=0.1)}, {}, "damping"),
    (kr.exact, {"scene": THESIS.replace(turning=(0, 1, 0))}, {}, "turn"),
    (kr.exact, {"scene": THESIS.replace(turning=(0, 0, 1))}, {}, "method='exact'"),
    (kr.exact([THESIS, THESIS]), {}, {"t": np.ones((3, 2))}, "array of shape"),
    (kr.exact, {"scene": []}, {}, "empty"),
    (kr.exact, {"scene": [THESIS, ASYMMETRIC]}, {}, "scene[1]: no closed form"),
    (kr.exact, {"scene": [THESIS, ASYMMETRIC, ASYMMETRIC]}, {}, "scene[1], the first of 2 such"),
    (kr.exact([THESIS, THESIS]), {}, {"t": [[1.0], [1e17]]}, "scene[1]: by t = 1e+17"),
    (kr.exact(THESIS), {}, {"t": 1e300}, "cannot resolve"),
    (kr.exact(KOWALEWSKI), {}, {"t": 1e300}, "cannot resolve"),
    (kr.exact(KOWALEWSKI), {"tangents": "start"}, {"t": 1e12}, "for the tangents"),
    (kr.exact(KOWALEWSKI), {"t": 1.0}, {"tangents": ("start", "com")}, "with respect to 'com'"),
    (
        kr.solve,
        {"scene": KOWALEWSKI, "t": 1, "method": "exact"},
        {"tangents": "moments"},
        "moments",
    ),
    (kr.exact(KOWALEWSKI).find_quasi_periods, {}, {"n": 0}, "n must be"),
    (kr.frequencies, {"path": PATH}, {"n": 2000}, "number of states, 101"),
    (kr.frequencies, {"path": PATH[:63]}, {}, "at least 64 states, not 63"),
    (kr.frequencies, {"path": kr.solve(TOP, np.linspace(1, 3, 80) ** 2)}, {}, "equally spaced"),
    (kr.rod, {"path": PATH}, {}, "centre of mass"),
    (kr.rod, {"path": kr.solve(THESIS.replace(damping=0.1), [0, 1])}, {}, "damped"),
    (kr.rod, {"path": kr.solve(THESIS.replace(body=GYROSTAT), [0, 1])}, {}, "rotor"),
    (kr.rod(kr.solve(THESIS, [0.0])).plot, {}, {}, "1 state cannot be drawn"),
    (kr.apex(PATH).nutation, {}, {}, "Lagrange tops"),
    (kr.apex(kr.solve(THESIS, [])).nutation, {}, {}, "without states"),
    (kr.apex(kr.solve(THESIS, np.linspace(0, 8, 81))).nutation, {}, {}, "1 lowest points"),
    (kr.view, {"what": TOP.replace(damping=(1, 2, 3)), "open": False}, {}, "damping"),
]
OTHER_ERRORS = [
    (kr.Body, BODY, {"com": None}, TypeError, "com is missing"),
    (kr.Body.disk, {"radius": 1, **AT}, {"density": 1}, TypeError, "density"),
    (kr.Scene, SCENE, {"gravity": (0, 0, -1)}, TypeError, "positive is down"),
    (kr.Scene, SCENE, {"gravty": 1}, TypeError, "gravty"),
    (kr.Scene.from_toml, {}, {"source": "body = [1]\nmomentum = [1, 2]"}, TypeError, "body"),
    (kr.events.crossing, {"function": abs}, {}, TypeError, "cannot be computed"),
    (kr.plan, {"scene": TOP}, {"mismatch": 1e-3}, TypeError, "mismatch"),
    (kr.solve, TWO, {"out": [1.0]}, TypeError, "NumPy array"),
    (kr.enclose, SOLVE, {"scene": PAIR}, TypeError, "one top"),
    (
        kr.reduce,
        {"scene": PAIR, "t": 1},
        {"reductions": {"nutation": 3}},
        TypeError,
        "one or several",
    ),
    (kr.exact, {"scene": [THESIS, 3]}, {}, TypeError, "scenes[1]"),
    (kr.exact, {"scene": [THESIS]}, {"step": 0.1}, TypeError, "scene"),
    (kr.solve, SOLVE, {**FIXED, "t": 1e14, "every": 1}, MemoryError, "larger every"),
    (kr.scenes.get_scene, {}, {"name": "tesis"}, KeyError, "did you mean 'thesis'"),
    (kr.scenes.get_scene, {}, {"name": 3}, TypeError, "string"),
    (kr.load, {}, {"file": b"path"}, TypeError, "name of a file"),
    (np.asarray, {}, {"a": kr.section(PAIR, n=1)}, TypeError, "not an array"),
    (kr.Scene.spinning, {"body": CONE, "gravity": 1}, {}, TypeError, "spin is missing"),
    (kr.steady, {"body": GENERAL, "gravity": 1}, {}, TypeError, "rate is missing"),
    (kr.steady, {"body": FREE.body, "rate": 1}, {"turning": (1, 0, 0)}, TypeError, "not both"),
    (
        kr.steady,
        {"body": kr.Body([1, 2], (9, 9, 9), (0, 0, 0)), "gravity": 1},
        {"rate": 1},
        TypeError,
        "one body",
    ),
    (PATH.scene_at, {}, {"i": 2**63}, IndexError, "101 states"),
]


@pytest.mark.parametrize(
    "function, valid, change, exception, word",
    [(*row[:3], ValueError, row[3]) for row in VALUE_ERRORS] + OTHER_ERRORS,
)
def test_bad_arguments_are_refused(function, valid, change, exception, word):
    with pytest.raises(exception, match=re.escape(word)) as error:
        function(**{**valid, **change})
    assert error.type is exception and len(str(error.value)) < 1000


def test_assignment_suggests_replace():
    for thing, hint in ((TOP, r"scene\.replace"), (SYMMETRIC, r"dataclasses\.replace")):
        with pytest.raises(AttributeError, match=hint):
            thing.mass = 2.0


@pytest.mark.parametrize("part, is_resolved", [(0.994, True), (1.006, False)])
@pytest.mark.parametrize(
    "body, momentum, late", [(SLOW, (0, 0, 0.25), 2.0**54), (SLENDER, (1e-3, 0, 1), 9.05e9)]
)
def test_times_are_refused_only_if_doubles_cannot_resolve_them(
    body, momentum, late, part, is_resolved
):
    scene, t = kr.Scene(body, momentum), part * late
    for call in (
        lambda: kr.solve(scene, [-t]),
        lambda: kr.exact(scene)(t),
        lambda: kr.exact([scene])(t),
        lambda: kr.solve(scene.vary(gravity=[1.0, 2.0]), [t]).check(),
    ):
        if is_resolved:
            call()
            continue
        with pytest.raises((ValueError, kr.Error), match=r"can(not)? resolve"):
            call()
