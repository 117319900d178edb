"""Tests that random calls of the public API either succeed or raise documented exceptions.

By default, 40 random calls of each function are generated, always with the same seed. If the
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
from argument_values import HOSTILE, MOST, PARTICULAR, RIGHT, SOURCES, TABLE, WORDS
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from public_api import FAILURES, NAMESPACES, RECORDS, SELVES, calls, of_class

ASKED = os.environ.get("KREISEL_CALLS")
EXAMPLES = settings(
    max_examples=int(ASKED or 40),
    derandomize=not ASKED,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)
SECONDS = 60  # seconds after which a call is considered endless
LETTERS = 1000  # largest length of an error message; some messages list all valid names
REFUSALS = TypeError, ValueError, MemoryError, kr.Error
LEFT_OUT = "it has only the quantities of want="  # in messages on arrays omitted by want=
NO_TANGENTS = "solve with tangents="
IDIOMS = {"__getattr__": AttributeError, "__getitem__": LookupError, "scene_at": IndexError}
IDIOMS |= dict.fromkeys(
    ("conditioning", "tangents", "tangents_low", "tangents_rest"), AttributeError
)
IDIOMS |= {"end": IndexError, "get_scene": KeyError, "message": IndexError, "part": IndexError}
# parameters that name files
PLACES = {"file", "source", "path", "checkpoint", "open", "to", "folder"}
# parameters with which a run may take hours if they are large
LIMITED = {"pieces": 3, "max_evaluations": 30, "repeats": 3, "n": 50, "fps": 10, "size": 64}
# more parameters with which a run may take hours
SLOW = {"compare": {"t", "steps", "tols", "truth"}, "Path.animate": {"speed"}}

CALLS = calls()
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
        kr.solve(kr.scenes.asymmetric, [1, 2]).save("top.npz")
        TABLE.to_csv("record.csv", index=False)
        kr.scenes.thesis.to_toml("top.toml")
        kr.start(kr.scenes.asymmetric).save("top.run")
        for name, parts in {"swept": None, "half": range(1)}.items():
            kr.sweep(
                SOURCES[0], [1.0], folder=name, part_size=3, parts=parts, reduce={"nutation": "min"}
            )
        kr.read_sweep("swept").to_pandas()[["spin", "tilt"]].to_parquet("tops.parquet")
        before = signal.signal(signal.SIGALRM, end)
        yield
        signal.signal(signal.SIGALRM, before)


def get_valid_values(name, word):
    return PARTICULAR.get(f"{name}.{word}") or RIGHT[word]


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
    odd = draw(up_to_two(*names))
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
    idiom = (IDIOMS[member],) if member in IDIOMS else ()
    files = bool(PLACES & {p.name for p in parameters}) or name.startswith("View.")
    return REFUSALS + idiom + (OSError,) * files


def use_result(result):
    """Check the repr of a result, or of the first items if it is a generator."""
    if isinstance(result, GeneratorType):
        result = list(itertools.islice(result, 3))
    assert isinstance(repr(result), str)
    plt.close("all")


@pytest.mark.parametrize("name", CALLS)
def test_every_call_returns_or_raises_a_documented_exception(name):
    callable_factories, parameters = CALLS[name]
    callables = st.sampled_from(callable_factories)
    arguments = draw_arguments(name, parameters) if parameters else st.just(([], {}))

    @EXAMPLES
    @given(st.data())
    def check_call(data):
        call, (args, kwargs) = data.draw(callables)(), data.draw(arguments)
        signal.alarm(SECONDS)
        try:
            use_result(call(*args, **kwargs))
        except possible_exceptions(name, parameters) as error:
            # messages of OSError include the file name, which may be long
            assert len(str(error)) < LETTERS or isinstance(error, OSError)
        except AttributeError as error:
            assert LEFT_OUT in str(error) or NO_TANGENTS in str(error)
        finally:
            signal.alarm(0)

    check_call()


def test_every_public_name_is_tested():
    names = {name for name in kr.__all__ if inspect.isroutine(getattr(kr, name))}
    classes = {name for name in kr.__all__ if inspect.isclass(getattr(kr, name))}
    assert names | classes <= {name.partition(".")[0] for name in CALLS} | {"Nutation", "Stats"}
    assert {cls.__name__ for cls in (*SELVES, *FAILURES)} == classes
    for space in NAMESPACES:
        module = space.__name__.partition(".")[2]
        for name in getattr(space, "__all__", ()):
            if module and inspect.isroutine(getattr(space, name)):
                assert f"{module}.{name}" in CALLS


def list_keywords(parameters):
    """Return the names of parameters, with the keywords in place of their `**` parameter."""
    return [
        word
        for p in parameters
        for word in (WORDS[p.name] if p.kind is p.VAR_KEYWORD else [p.name])
    ]


@pytest.mark.parametrize("name", CALLS)
def test_every_parameter_has_valid_values(name):
    assert all(get_valid_values(name, word) for word in list_keywords(CALLS[name][1]))


def test_all_valid_values_are_used():
    words = {f"{name}.{word}": word for name in CALLS for word in list_keywords(CALLS[name][1])}
    assert PARTICULAR.keys() <= words.keys()
    assert RIGHT.keys() <= {word for key, word in words.items() if key not in PARTICULAR}


@pytest.mark.parametrize("cls", RECORDS, ids=lambda cls: cls.__name__)
def test_records_with_invalid_fields_do_not_crash(cls):
    @EXAMPLES
    @given(st.data())
    def check_call(data):
        thing = data.draw(st.sampled_from(SELVES[cls]))()
        field = data.draw(st.sampled_from(dataclasses.fields(cls))).name
        name, (_, parameters) = data.draw(st.sampled_from(list(of_class(cls).items())))
        odd = data.draw(HOSTILE)
        names = [p.name for p in parameters if p.default is p.empty and p.kind is not p.VAR_KEYWORD]
        words = {word: get_valid_values(name, word)[0] for word in names}
        signal.alarm(SECONDS)
        with contextlib.suppress(Exception):
            changed_thing = dataclasses.replace(thing, **{field: odd})
            member = name.partition(".")[2]
            use_result(
                getattr(changed_thing, member)(**words)
                if parameters
                else getattr(changed_thing, member)
            )
        signal.alarm(0)

    check_call()
