"""Validated options for kreisel.solve: the method, its parameters, and the recorded quantities."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

from .._core import tangents as TANGENTS
from .._model.scene import Scene
from .._utils.errors import unknown_name_message
from .._utils.quantity_attributes import QuantityName
from .._utils.validation import as_int, as_positive, short_repr, validate_type
from .closed_form_choice import prefers_closed_form
from .methods import EXACT, FALLBACK, Method, has_torus_closed_form, methods, resolve_method
from .quantities import HEADING_DEPENDENT, RECORDABLE, count_quantity_components
from .times import CHUNK_SIZE, COUNTABLE

Progress = Callable[[float], object]
# The arguments of the core: name, step, tol, digits, max_steps and leave_heading.
CoreArguments = tuple[str, float, float, int, int, bool]


@dataclass(frozen=True)
class SolveOptions:
    """The validated arguments of kreisel.solve, except the scene and the times.

    An argument is None if the method has no such parameter, or if its default is used. If `error`
    is given, the cheapest suitable method is found by a search and replaces `method`. `events`
    contains kreisel.events.Event objects. `tangents` contains the names of the parameters with
    respect to which the state is differentiated. `keeps_heading` prevents the method from skipping
    the heading, on which the motion depends if the support turns.
    """

    method: Method
    step: float | None = None
    tol: float | None = None
    digits: int | None = None
    max_steps: int = 0
    want: tuple[QuantityName, ...] | None = None
    requested_method: str = ""
    every: int | None = None
    error: float | None = None
    events: tuple[Any, ...] | None = None
    tangents: tuple[str, ...] = ()
    keeps_heading: bool = False

    @property
    def requests_events(self) -> bool:
        """True if events are to be found along the path."""
        return self.events is not None

    @property
    def tangent_bit_mask(self) -> int:
        """The bit flags of the requested tangents."""
        return sum(TANGENTS[name][0] for name in self.tangents)

    @property
    def tangent_column_count(self) -> int:
        """The number of columns in the matrix of tangents."""
        return sum(TANGENTS[name][1] for name in self.tangents)

    @cached_property
    def core_arguments(self) -> CoreArguments:
        """The method and its parameters, as passed to the C library."""
        level = self.want is not None and HEADING_DEPENDENT.isdisjoint(self.want)
        precise = self.has_extended_precision or self.requests_events
        can_leave = self.method.skips_heading and not self.keeps_heading
        leave_heading = level and can_leave and not precise
        accuracy = self.step or 0.0, self.tol or 0.0, self.digits or 0
        return self.method.name, *accuracy, self.max_steps, leave_heading

    @cached_property
    def copy_with_default_run_settings(self) -> SolveOptions:
        """A copy of the options without the settings that are specific to a single run."""
        events = () if self.requests_events else None
        options = replace(self, max_steps=0, every=None, want=None, events=events, tangents=())
        return self if options == self else options

    @property
    def can_skip_heading_angle(self) -> bool:
        """True if the heading is not computed, because no requested quantity depends on it."""
        return self.core_arguments[-1]

    def copy_options_with_heading(self) -> SolveOptions:
        """Return a copy of the options with which the heading of the top is always computed.

        This also holds for copies of the copy that record other quantities.
        """
        return self if self.keeps_heading else replace(self, keeps_heading=True)

    def copy_for_scene(self, scene: Scene) -> SolveOptions:
        """Return a copy of the options with which the method computes all that the motion needs."""
        return self.copy_options_with_heading() if any(scene.turning) else self

    def check_heading_is_computed(self, action: str) -> None:
        """Raise ValueError if the heading, which `action` needs, is not computed."""
        if self.can_skip_heading_angle:
            raise ValueError(
                "the heading of this run is not computed, because no quantity in want depends on "
                f"it: {action} needs it, so add 'q' to want"
            )

    @cached_property
    def max_time_with_exact_step_count(self) -> float:
        """A time [T] before which the number of steps is exactly representable as a double."""
        return math.inf if self.step is None else 0.5 * COUNTABLE * self.step

    @cached_property
    def chunk_size(self) -> int:
        """The largest number of states that are held in memory at a time."""
        return sys.maxsize if self.want is None else CHUNK_SIZE

    @property
    def bytes_per_state(self) -> int:
        """The number of bytes stored for each state, excluding the array of requested times."""
        return 64 if self.want is None else 8 * sum(map(count_quantity_components, self.want))

    @property
    def has_extended_precision(self) -> bool:
        """True if the states are recorded with more digits than double precision."""
        return (self.digits or 0) > 16

    def get_signed_step(self, is_back: bool) -> float | None:
        """Return the step size, which is negative if `is_back` is True."""
        return -self.step if is_back and self.step is not None else self.step


def validate_solve_options(
    scene: object,
    method: object,
    step: object = None,
    tol: object = None,
    digits: object = None,
    max_steps: object = 0,
    want: object = None,
    every: object = None,
    requested_method: object = None,
    t: object = None,
) -> SolveOptions:
    """Return the validated options for solving `scene`.

    `requested_method` is the name of the method given by the user. `t` contains the requested
    times, or is None if they are unknown. Raises TypeError or ValueError for an invalid argument.
    """
    top = scene if type(scene) is Scene else validate_type("scene", scene, Scene)
    resolved_method = resolve_method(
        FALLBACK if method == "auto" and digits is not None else method, top
    )
    is_open = (
        resolved_method.name == FALLBACK and method == "auto" and step is tol is digits is None
    )
    if is_open and t is not None and has_torus_closed_form(top) and prefers_closed_form(top, t):
        resolved_method = methods[EXACT]
    name = method if requested_method is None else requested_method
    options = make_solve_options(resolved_method, step, tol, digits, max_steps, name, want, every)
    return options.copy_for_scene(top)


def validate_options_for_method(
    method: Method,
    step: object,
    tol: object,
    digits: object,
    max_steps: object,
    requested_method: object,
    want: object,
    every: object = None,
) -> SolveOptions:
    """Return the validated options for a method, without any checks that depend on the scene.

    Raises TypeError or ValueError for an invalid argument.
    """
    return SolveOptions(
        method,
        validate_step(method, step),
        validate_tol(method, tol),
        validate_digits(method, digits, tol),
        as_int("max_steps", max_steps, 0),
        validate_requested_quantities(want),
        str(requested_method),
        validate_recording_interval(method, every),
    )


_find_options = lru_cache(maxsize=256, typed=True)(validate_options_for_method)


def make_solve_options(
    method: Method,
    step: object,
    tol: object,
    digits: object,
    max_steps: object,
    requested_method: object,
    want: object,
    every: object = None,
) -> SolveOptions:
    """Return the validated options for a method, from a cache if possible."""
    if want is None or type(want) is tuple:
        try:
            return _find_options(
                method, step, tol, digits, max_steps, requested_method, want, every
            )
        except TypeError:  # an argument is not hashable, or invalid
            pass
    return validate_options_for_method(
        method, step, tol, digits, max_steps, requested_method, want, every
    )


def validate_requested_quantities(want: object) -> tuple[QuantityName, ...] | None:
    """Return the names of the quantities to record, without duplicates.

    Raises TypeError or ValueError for invalid names.
    """
    if want is None:
        return None
    if isinstance(want, str) or not isinstance(want, Iterable):
        raise TypeError(
            f"want must be names of quantities, as want=('apex', 'energy'), not {short_repr(want)}"
        )
    names = list(want)
    for name in names:
        if not isinstance(name, str) or (name not in RECORDABLE and name != "t"):
            raise ValueError(
                unknown_name_message("quantity in want:", str(name), ["t", *RECORDABLE])
            )
    quantities = tuple(name for name in dict.fromkeys(names) if name != "t")
    if not quantities:
        raise ValueError("want contains no quantity besides t; leave it out to record all")
    return quantities


def validate_step(method: Method, step: object) -> float | None:
    """Return the step size, or None if the method takes no steps or chooses its first step.

    Raises ValueError if `step` is None but the method has a fixed step.
    """
    if step is not None:
        h = as_positive("step", step)
        return None if method.exact else h
    if not method.adaptive:
        raise ValueError(f"the method {method.name!r} has a fixed step: give step, as in step=0.01")
    return None


def validate_tol(method: Method, tol: object) -> float | None:
    """Validate the tolerance, and return it as a float, or None to use the default tolerance.

    Raises ValueError if the method has no tolerance, or if `tol` is not between 0 and 1.
    """
    if tol is None:
        return None
    if not (method.adaptive or method.implicit):
        raise ValueError(f"the method {method.name!r} has no tolerance: leave out tol")
    accuracy = as_positive("tol", tol)
    if accuracy >= 1.0:
        raise ValueError(
            f"tol must be below 1, since it is the relative error of a step; not {tol!r}"
        )
    return None if method.exact else accuracy


def validate_digits(method: Method, digits: object, tol: object) -> int | None:
    """Return the number of digits, rounded up to 16, 20 or 30.

    Raises ValueError if the method has a fixed precision, or if both `digits` and `tol` are given.
    """
    if digits is None:
        return None
    if not method.digits:
        raise ValueError(
            f"the method {method.name!r} has a fixed precision: digits need method='taylor'"
        )
    if tol is not None:
        raise ValueError("give either digits or tol, not both")
    count = as_int("digits", digits, 1)
    if count > 30:
        raise ValueError(f"digits must be at most 30, not {digits!r}")
    return 16 if count <= 16 else 20 if count <= 20 else 30


def validate_recording_interval(method: Method, every: object) -> int | None:
    """Return the number of steps between two recorded states.

    Raises ValueError for an adaptive method.
    """
    if every is None:
        return None
    if method.adaptive:
        steps = "has none" if method.exact else "chooses its steps"
        raise ValueError(
            f"every needs a method of fixed step; {method.name} {steps}: give t as a list"
        )
    return as_int("every", every, 1)


def validate_progress_callback(progress: Progress | None) -> Progress | None:
    """Return `progress`; raise TypeError if it is neither callable nor None."""
    if progress is not None and not callable(progress):
        raise TypeError(
            f"progress must be a function that takes the time reached, not {short_repr(progress)}"
        )
    return progress
