"""Tests that random calls of the public API either succeed or raise documented exceptions.

By default, 12 random calls of each function are generated, always with the same seed. If the
environment variable KREISEL_CALLS is 1000, 1000 random calls of each function are tried.
"""

import contextlib
import dataclasses
import functools
import inspect
import itertools
import os
import signal
import webbrowser
from types import GeneratorType

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np
import pytest
from argument_values import HOSTILE, MOST, WORDS, get_valid_values, write_files
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from kreisel import types
from public_api import FAILURES, NAMESPACES, RECORDS, SELVES, calls, of_class

ASKED = os.environ.get("KREISEL_CALLS")
EXAMPLES = settings(
    max_examples=int(ASKED or 12),
    derandomize=not ASKED,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)
SECONDS = 60  # seconds after which a call is considered endless
LETTERS = 1000  # largest length of an error message; some messages list all valid names
REFUSALS = TypeError, ValueError, MemoryError, kr.Error
IDIOMS = {"__getattr__": AttributeError, "__getitem__": LookupError, "scene_at": IndexError}
IDIOMS |= {"end": IndexError, "get_scene": KeyError, "message": IndexError, "part": IndexError}
IDIOMS |= {"from_mesh": ModuleNotFoundError}  # of trimesh
# parameters that name files
PLACES = {"file", "mesh", "source", "path", "checkpoint", "open", "to", "folder"}
# parameters with which a run may take hours if they are large
LIMITED = {"pieces": 3, "max_evaluations": 30, "repeats": 3, "n": 50, "fps": 10, "size": 64}
# more parameters with which a run may take hours
SLOW = {
    "enclose": {"t", "scene"},
    "compare": {"t", "steps", "tols", "truth"},
    "Path.animate": {"speed"},
}

CALLS = calls()
GROUPS = {}  # the functions of each class or namespace
for call_name in CALLS:
    GROUPS.setdefault(call_name.rpartition(".")[0] or "kreisel", []).append(call_name)
pytestmark = pytest.mark.filterwarnings(
    "ignore:no body has this inertia",
    "ignore:.*unphysical",
    "ignore:the fit did not converge",
    "ignore:No motion of this scene fits",
    "ignore:The residuals are",
)


class Endless(BaseException):
    """An exception raised when a call takes longer than `SECONDS`."""


@pytest.fixture(scope="module", autouse=True)
def place(tmp_path_factory):
    """Run the tests in a temporary folder, block browser windows, and raise Endless on SIGALRM."""

    def end(*_):
        raise Endless

    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("calls")
        patch.chdir(folder)
        patch.setenv("XDG_CACHE_HOME", str(folder))
        patch.setattr(webbrowser, "open", lambda *_, **__: True)
        write_files()
        before = signal.signal(signal.SIGALRM, end)
        yield
        signal.signal(signal.SIGALRM, before)


def is_inexpensive(name, word, value):
    limit = LIMITED.get(word, 10.0 if word in SLOW.get(name, ()) else None)
    if limit is None:
        return True
    try:
        sizes = np.abs(np.asarray(value).astype(float, casting="same_kind"))
    except (TypeError, ValueError, OverflowError, MemoryError):
        return word not in SLOW.get(name, ()) and not isinstance(value, int)
    sizes = sizes[np.isfinite(sizes)]
    return bool(((sizes <= limit) & ((sizes >= 0.01) | (sizes == 0.0))).all())


@st.composite
def draw_arguments(draw, name, parameters):
    """Draw random arguments for a call; those of at most two parameters may be invalid."""
    args, kwargs = [], {}
    names = [p.name for p in parameters]
    odd = draw(up_to_two(*names)) if names else ()
    for p in parameters:
        if p.kind is p.VAR_KEYWORD:
            words = draw(up_to_two(*WORDS[p.name]))
            kwargs |= {word: draw(value(name, word, p.name in odd)) for word in words}
        elif p.kind is p.VAR_POSITIONAL:
            args = draw(st.lists(value(name, p.name, p.name in odd), max_size=3))
        elif p.default is p.empty or p.name in odd or draw(st.booleans()):
            kwargs[p.name] = draw(value(name, p.name, p.name in odd))
    if "max_steps" in names:
        assume("max_steps" not in odd or len(odd) == 1)
        kwargs.setdefault("max_steps", MOST)
    return args, kwargs


# Strategies are cached, because Hypothesis takes long to prepare one.


@functools.cache
def up_to_two(*words):
    return st.sets(st.sampled_from(words), max_size=2)


@functools.cache
def value(name, word, any_value):
    values = HOSTILE if any_value else st.sampled_from(get_valid_values(name, word))
    if word in LIMITED or word in SLOW.get(name, ()):
        return values.filter(lambda value: is_inexpensive(name, word, value))
    return values


def possible_exceptions(name, parameters):
    """Return the types of the exceptions that a call may raise."""
    member = name.rpartition(".")[2]
    # results without some arrays, because of `want` or without tangents, have no such attribute
    idioms = AttributeError, IDIOMS.get(member, AttributeError)
    files = bool(PLACES & {p.name for p in parameters}) or name.startswith("View.")
    return REFUSALS + idioms + (OSError,) * files


def check_call(name, call, args, kwargs):
    """Check that a call returns a result with a repr, or raises a short documented exception."""
    signal.alarm(SECONDS)
    try:
        result = call(*args, **kwargs)
        if isinstance(result, GeneratorType):
            result = list(itertools.islice(result, 3))
        assert isinstance(repr(result), str)
    except possible_exceptions(name, CALLS[name][1]) as error:
        # messages of OSError include the file name, which may be long
        assert len(str(error)) < LETTERS or isinstance(error, OSError)
        if isinstance(error, AttributeError) and not name.endswith("__getattr__"):
            assert "object has no attribute" not in str(error)
    finally:
        signal.alarm(0)
        plt.close("all")


def call_randomly(name):
    factories, parameters = CALLS[name]

    @EXAMPLES
    @given(st.sampled_from(factories), draw_arguments(name, parameters))
    def check(factory, arguments):
        check_call(name, factory(), *arguments)

    check()


@pytest.mark.parametrize("group", GROUPS)
def test_every_call_returns_or_raises_a_documented_exception(group):
    for name in GROUPS[group]:
        if CALLS[name][1]:
            call_randomly(name)
            continue
        for factory in CALLS[name][0]:
            check_call(name, factory(), [], {})


def test_every_public_name_is_tested():
    names = {name for name in kr.__all__ if inspect.isroutine(getattr(kr, name))}
    classes = {
        name
        for space in (kr, types)
        for name in space.__all__
        if inspect.isclass(getattr(space, name))
    }
    assert names | classes <= {name.partition(".")[0] for name in CALLS} | {"Nutation", "Stats"}
    assert {cls.__name__ for cls in (*SELVES, *FAILURES)} == classes
    for space in NAMESPACES:
        module = space is not types and space.__name__.partition(".")[2]
        for name in getattr(space, "__all__", ()):
            if module and inspect.isroutine(getattr(space, name)):
                assert f"{module}.{name}" in CALLS


@settings(EXAMPLES, max_examples=20 * EXAMPLES.max_examples)
@given(st.data())
def test_records_with_invalid_fields_do_not_crash(data):
    cls = data.draw(st.sampled_from(RECORDS))
    thing = data.draw(st.sampled_from(SELVES[cls]))()
    field = data.draw(st.sampled_from(dataclasses.fields(cls))).name
    name, (_, parameters) = data.draw(st.sampled_from(list(of_class(cls).items())))
    odd = data.draw(HOSTILE)
    names = [p.name for p in parameters if p.default is p.empty and p.kind is not p.VAR_KEYWORD]
    words = {word: get_valid_values(name, word)[0] for word in names}
    signal.alarm(SECONDS)
    with contextlib.suppress(Exception):
        attribute = getattr(dataclasses.replace(thing, **{field: odd}), name.partition(".")[2])
        repr(attribute(**words) if parameters else attribute)
    signal.alarm(0)
    plt.close("all")
