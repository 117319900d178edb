"""The callables of the public API with their parameters."""

import dataclasses
import inspect

import argument_values
import kreisel as kr
from argument_values import DAMPED, FREE, LAGRANGE, LOW, MOST, PATHS, RIGHT, TOP
from kreisel import quaternion, types

DUNDERS = "__call__", "__getitem__", "__getattr__", "__len__", "__iter__", "__repr__"
FAILURES = kr.Error, kr.Interrupted
NAMES = "MethodName", "QuantityName"  # types of strings, which are never called
NAMESPACES = kr, types, kr.events, quaternion, kr.scenes


def always(thing):
    return lambda: thing


def table():
    return kr.compare(TOP, 0.5, ["rk4"], [0.1], repeats=1)


def sweep_reader(folder):
    return lambda: kr.read_sweep(folder, partial=folder == "half")


def run(scene, method="auto", **more):
    """Return a function that calls kr.start with the given arguments."""
    return lambda: kr.start(scene, method, max_steps=MOST, **more)


SELVES = {  # factories of an instance for each class with methods
    kr.Apex: [always(kr.apex(PATHS[0])), always(kr.apex(PATHS[4]))],
    kr.Body: [always(body) for body in (*RIGHT["body"], *argument_values.BODIES)],
    types.StepChoice: [always(kr.solve(LAGRANGE, 1, "geometric", error=1e-3).plan.choice)],
    kr.Enclosure: [always(kr.enclose(TOP, PATHS[0].t, digits=20))],
    kr.Event: [always(LOW), always(kr.events.loop(max_count=2, terminal=True))],
    kr.Events: [always(PATHS[2].events), always(argument_values.MANY[2].events)],
    kr.Fit: [always(fit) for fit in argument_values.FITS],
    kr.Frequencies: [always(kr.frequencies(argument_values.SWAY))],
    kr.Exact: [always(kr.exact(tops)) for tops in (LAGRANGE, FREE, [LAGRANGE, FREE])],
    kr.ExactTorus: [
        always(kr.exact(scene)) for scene in (kr.scenes.kowalewski, kr.scenes.goryachev_chaplygin)
    ],
    kr.Chaos: [always(kr.chaos(TOP, 2.0)), always(kr.chaos(argument_values.ENSEMBLES[0], [1.0]))],
    kr.Method: [always(method) for method in kr.methods.values()],
    types.Nutation: [always(types.Nutation(0.1, 0.2, 3.0, 4.0))],
    kr.Path: [always(path) for path in [*PATHS, *argument_values.MANY]],
    kr.Plan: [always(path.plan) for path in PATHS]
    + [always(kr.plan(argument_values.ENSEMBLES[0], 1))],
    kr.Record: [always(record) for record in argument_values.RECORDS],
    kr.Reductions: [always(reduced) for reduced in argument_values.REDUCED],
    types.Rod: [always(kr.rod(kr.exact(LAGRANGE)([0, 1, 2])))],
    types.Row: [always(table()[0])],
    kr.Run: [
        run(TOP),
        run(DAMPED),
        run(LAGRANGE, "strang", step=0.125, back=True),
        run(TOP, digits=20, events=[LOW], want=["q"]),
    ],
    kr.Scene: [always(scene) for scene in (*argument_values.SCENES, *argument_values.ENSEMBLES)],
    kr.Score: [
        always(kr.score(one, TOP)) for one in (argument_values.MOTIONS[0], argument_values.MOTIONS)
    ],
    kr.Section: [always(section) for section in argument_values.SECTIONS],
    kr.Source: [always(source) for source in argument_values.SOURCES],
    kr.SweepResult: [sweep_reader("swept"), sweep_reader("half")],
    types.Steady: [always(kr.steady(LAGRANGE.body, [1.0, 2.0], gravity=1))],
    types.Stats: [always(PATHS[0].stats)],
    types.Table: [always(table())],
    kr.Verification: [always(PATHS[0].verify(20))],
    types.View: [always(kr.view(TOP, open=False))],
}

# classes that users instantiate; objects of all other classes come from kreisel
USERS = kr.Body, kr.Record, kr.Scene
RECORDS = [cls for cls in SELVES if dataclasses.is_dataclass(cls) and cls not in USERS]


def calls():
    """Return all public callables and their parameters by name."""
    callables = {
        "methods.__getitem__": ([always(kr.methods.__getitem__)], parameters(lambda key: key))
    }
    for space in NAMESPACES:
        prefix = "" if space in (kr, types) else space.__name__.removeprefix("kreisel.") + "."
        for name, thing in functions(space):
            if thing not in SELVES or thing in USERS:
                callables[prefix + name] = [always(thing)], parameters(thing)
            if thing in SELVES:
                callables |= of_class(thing)
    return callables


def functions(space):
    """Yield the public functions and classes defined in the module `space`."""
    for name in getattr(space, "__all__", None) or vars(space):
        thing = getattr(space, name)
        own = space in (kr, types) or getattr(thing, "__module__", "") == space.__name__
        is_callable = inspect.isclass(thing) or inspect.isroutine(thing)
        if name[0] != "_" and own and name not in NAMES and is_callable:
            yield name, thing


def of_class(cls):
    return {
        f"{cls.__name__}.{name}": member(cls, name, attribute) for name, attribute in members(cls)
    }


def members(cls):
    """Yield the public members of the class `cls` that are defined in kreisel."""
    for name in dir(cls):
        attribute = inspect.getattr_static(cls, name)
        inner = getattr(
            attribute, "__func__", getattr(attribute, "fget", getattr(attribute, "func", attribute))
        )
        ours = (getattr(inner, "__module__", None) or "").startswith("kreisel")
        if ours and (name[0] != "_" or name in DUNDERS):
            yield name, attribute


def member(cls, name, attribute):
    if isinstance(attribute, classmethod):
        return [always(getattr(cls, name))], parameters(getattr(cls, name))
    takes = parameters(attribute)[1:] if inspect.isfunction(attribute) else []
    is_read = not inspect.isfunction(attribute)

    def get_from(make_self):
        return lambda: (
            (lambda: getattr(make_self(), name)) if is_read else getattr(make_self(), name)
        )

    return [get_from(make_self) for make_self in SELVES[cls]], takes


def parameters(thing):
    return list(inspect.signature(thing).parameters.values())
