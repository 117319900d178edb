"""Description of a computation: what is computed, what is omitted, and why."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from .._core import Worker, start, unsuited, values
from .._model.body import Body
from .._model.scene import Scene
from .._utils.arguments import Array
from .._utils.html import format_html_table
from .methods import (
    EXACT,
    FALLBACK,
    describe_kind_of_top,
    explain_no_closed_form,
    explain_taylor_choice,
    has_torus_closed_form,
)
from .options import (
    CHUNK_SIZE,
    GEOMETRIC,
    HEADING_DEPENDENT,
    CoreArguments,
    Options,
    count_quantity_components,
)

Reasons = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class StepChoice:
    """The method and step size chosen by method='geometric', and the cost of choosing them.

    step          [T]
    target        the largest error allowed [rad]
    error         the largest attitude error on [0, t], compared with a reference: the closed form
                  or the Taylor series with 20 digits [rad]
    conditioning  approximate change of the attitude caused by one rounding of the state [rad]
    run           number of evaluations of the torque in the final run
    trials        number of evaluations of the torque in all other runs; each term of the Taylor
                  series of the reference counts as one evaluation
    budget        the largest number of steps allowed for all runs together
    """

    method: str
    step: float
    order: int
    target: float
    error: float
    conditioning: float
    run: int
    trials: int
    budget: int

    def __str__(self) -> str:
        return (
            f"{self.method} (order {self.order}) with step {self.step:g}: "
            f"attitude error about {self.error:.1e} rad of {self.target:g} allowed, "
            f"for {self.run} evaluations of the torque and {self.trials} in trial runs, "
            f"of {self.budget} steps at most; "
            f"one rounding of the state moves the attitude by about {self.conditioning:.1e} rad"
        )


@dataclass(frozen=True)
class Plan:
    """A printable description of a computation: what is computed, what is omitted, and why.

    For many tops, the fields up to `turn` describe the first one.

    method    the name of the method
    why       the reason for this method
    step      [T], or None if the method has none or chooses it
    order     the order of the method, or 0 if it has none or chooses it
    form      the equations that are integrated
    kernel    the instruction set of the Taylor series; empty for other methods
    columns   the quantities that are recorded for each state
    bytes     the size of these quantities, or of the reductions of a top
    left_out  pairs (what, why): computations that are left out because nothing needs their results
    kept      pairs (what, why): computations that are done although nothing needs their results
    choice    the choice that method='geometric' made; None for other methods
    turn      approximate angle by which the top turns in a step, at its initial rate or, if faster,
              that of a pendulum [rad]; None if the method chooses its steps
    shape     the shape of the scene; () for one top
    closed_form  the number of tops computed in closed form
    lanes     the number of tops integrated several at a time, in the lanes of vectors; those of
              them with strong damping or with damping backward in time are integrated one by one
    alone     the number of tops integrated one by one in each thread
    threads   the number of threads; 0 in the plan of a path
    states    the number of states of each top; None without times
    size      the size of the result [bytes]; None without times
    seconds   for many tops with times, an estimate of the run time [s]; otherwise None
    measured  the number of tops that were run to estimate `seconds`, spread evenly
    """

    method: str
    why: str
    step: float | None
    order: int
    form: str
    kernel: str
    columns: tuple[str, ...]
    bytes: int
    left_out: Reasons
    kept: Reasons
    choice: StepChoice | None = None
    turn: float | None = None
    shape: tuple[int, ...] = ()
    closed_form: int = 0
    lanes: int = 0
    alone: int = 0
    threads: int = 1
    states: int | None = None
    size: int | None = None
    seconds: float | None = None
    measured: int = 0

    def _list_description_rows(self) -> list[tuple[str, str]]:
        """Return pairs (heading, text) that describe the computation."""
        counts = (
            (self.closed_form, "by closed form"),
            (self.lanes, "in lanes"),
            (self.alone, "one by one"),
        )
        ways = ", ".join(f"{n} {way}" for n, way in counts if n) or "none"
        by = f"; by {self.threads} threads" if self.threads else ""
        rows = [("tops", f"{self.shape}: {ways}{by}")] if self.shape else []
        if not self.method:  # there is no first top
            return rows
        if self.shape and self.size:
            memory = f"{self.states} states each: {1e-6 * self.size:.3g} MB in all"
            rows.append(("result", memory))
        if self.seconds is not None:
            clock = f"about {self.seconds:.2g} s, measured on {self.measured} of the tops"
            rows.append(("time", clock))
        if self.shape:
            rows.append(("first top", ""))
        rows += [("method", f"{self.method}: {self.why}"), ("equations", self.form)]
        if self.turn is not None:
            turn = f"{self.step:g}: the top turns by about {self.turn:.2g} rad in each step"
            rows.append(("step", turn))
        order = "no fixed order: a closed form, or an order chosen by the tolerance"
        order = f"order {self.order}" if self.order else order
        rows.append(("order", f"{order}, kernel {self.kernel}" if self.kernel else order))
        unit = "state" if "t" in self.columns else "top"
        rows.append(("recorded", f"{', '.join(self.columns)}: {self.bytes} bytes a {unit}"))
        for heading, items in (("left out", self.left_out), ("kept", self.kept)):
            for item, reason in items:
                rows.append((heading, f"{item}: {reason}"))
                heading = ""
        if self.choice:
            rows.append(("chosen", str(self.choice)))
        return rows

    def __str__(self) -> str:
        return "\n".join(f"{name:<11}{text}" for name, text in self._list_description_rows())

    def _repr_html_(self) -> str:
        return format_html_table(self._list_description_rows())


def make_solve_plan(
    scene: Scene,
    options: Options,
    states: int | None = None,
    choice: StepChoice | None = None,
    times: Array | None = None,
) -> Plan:
    """Return a description of how the motion of a scene is computed.

    `times` are the requested times, which can affect the method chosen by 'auto'.
    """
    if options.method == GEOMETRIC:
        raise ValueError("method='geometric' did not choose a method for this path")
    want, method, turn = options.want, options.integrator, None
    is_series, skips_heading = options.method == FALLBACK, options.can_skip_heading_angle
    columns = ("t", "q", "m") if want is None else ("t", *want)
    if want is None and options.has_extended_precision:
        columns += "q_low", "m_low"
    size = 8 * sum(map(count_quantity_components, columns))
    kernel, order = _find_kernel_and_order(options.core_arguments) if is_series else ("", 0)
    form = "(q, W, P): attitude, and angular velocity and vertical seen from the body"
    if skips_heading:
        form = "(W, P): the angular velocity and the vertical, both seen from the body"
    if options.step is not None and not method.adaptive:
        velocity = float(np.linalg.norm(values("velocity", scene._block, scene._start_state)))
        turn = options.step * max(velocity, scene._rotation_rate)
    left_out, kept = _list_unneeded_computations(scene, options, states)
    return Plan(
        method=options.method,
        why=_explain_method_choice(scene, options, times, choice),
        step=options.step,
        order=order if is_series else method.order,
        form=form if is_series or skips_heading else method.text,
        kernel=kernel,
        columns=columns,
        bytes=size,
        left_out=left_out,
        kept=kept,
        choice=choice,
        turn=turn,
        closed_form=int(method.exact),
        alone=int(not method.exact),
        states=states,
        size=None if states is None else states * size,
    )


_ROW = 49  # bytes per top for status, number of states, step counts and time reached


def make_plan_of_tops(
    tops: Scene, options: Options, first: Plan | None, states: int | None, threads: int = 0
) -> Plan:
    """Return the plan of many tops, given that of the first, or None if there are no tops."""
    plan = first or Plan("", "", None, 0, "", "", (), 0, (), ())
    exact_count, lanes = _count_exact_and_lane_tops(tops, options)
    is_in_lanes = lanes and not _find_tops_outside_lanes(tops).flat[0]
    if plan.method == FALLBACK and is_in_lanes:
        kernel, order = Worker(*options.core_arguments, []).kernel
        form = "(P, W): vertical and angular velocity seen from the body"
        level = options.can_skip_heading_angle
        form += "; without the heading" if level else ", and from these the heading"
        if kernel:
            plan = replace(plan, order=order, kernel=f"{kernel}, in lanes", form=form)
    reductions = len(options.reductions)
    row = 8 * reductions or (states or 0) * options.bytes_per_state
    return replace(
        plan,
        bytes=8 * reductions or plan.bytes,
        columns=tuple(options.reduce) or plan.columns,
        shape=tops.shape,
        closed_form=exact_count,
        lanes=lanes,
        alone=tops.size - exact_count - lanes,
        threads=threads,
        states=states,
        size=None if states is None else tops.size * (_ROW + row),
    )


def _count_exact_and_lane_tops(tops: Scene, options: Options) -> tuple[int, int]:
    """Return the numbers of tops evaluated in closed form and of tops integrated in SIMD lanes."""
    if options.error is not None or options.uses_one_run_per_top:
        return 0, 0
    if options.integrator.exact:
        return tops.size, 0
    if options.integrator.name != FALLBACK:
        return 0, 0
    inexact_count = unsuited(tops._core_scenes, "auto")[1] if options.is_auto else tops.size
    alone_count = int(np.count_nonzero(_find_tops_outside_lanes(tops)))
    return tops.size - inexact_count, inexact_count - alone_count


def _find_tops_outside_lanes(tops: Scene) -> npt.NDArray[np.bool_]:
    """Return True for the tops that neither the closed form nor the lanes can compute."""
    is_turning = tops.turning != 0.0
    is_outside = is_turning[..., :2].any(axis=-1) | (is_turning[..., 2] & tops.damping.any(axis=-1))
    is_outside |= (tops.shaking[..., 0] != 0.0) | (tops.gradient != 0.0)
    return np.asarray(is_outside | (tops.friction > 0.0))


@lru_cache
def _find_kernel_and_order(core: CoreArguments) -> tuple[str, int]:
    """Return the instruction set and the order of the Taylor series, the same for all scenes."""
    scene = Scene(Body(1.0, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)), (0.0, 0.0, 1.0))
    _, top = start(scene._block, *core)
    return top.kernel if top else ("", 0)


def _explain_method_choice(
    scene: Scene, options: Options, times: Array | None, choice: StepChoice | None
) -> str:
    is_exact, is_torus = options.integrator.exact, has_torus_closed_form(scene)
    if choice:
        return "the cheapest method that meets the allowed error"
    if options.requested_method != "auto":
        return "requested by name"
    if options.digits is not None:
        return f"{options.digits} digits requested"
    if is_exact:
        reason = f"{describe_kind_of_top(scene)} has a closed form"
        if is_torus:
            return f"{reason}, which takes no more time than the series up to the last time"
        return reason if scene.gravity else f"{reason} without gravity"
    if not is_torus:
        return explain_no_closed_form(scene)
    if options.step is not None or options.tol is not None:
        return "the closed form has neither step nor tol"
    # A path can have times for which kreisel.solve would use the closed form.
    return explain_taylor_choice(scene, times) or explain_taylor_choice(scene, None)


def _list_unneeded_computations(
    scene: Scene, options: Options, states: int | None
) -> tuple[Reasons, Reasons]:
    """Return pairs (what, why) for computations that are left out, and for those that are not."""
    is_exact, is_series = options.method == EXACT, options.method == FALLBACK
    is_free = scene.gravity == 0.0 or not any(scene.body.com)
    is_symmetric, skips_heading = scene.body.is_symmetric, options.can_skip_heading_angle
    has_all = options.want is None
    is_level = options.want is not None and HEADING_DEPENDENT.isdisjoint(options.want)
    is_split = options.integrator.splitting and is_symmetric
    is_kept = is_level and not (skips_heading or is_exact)
    if not is_series:
        reason = f"{options.method} always computes it; only taylor can omit it"
    elif options.events is not None:
        reason = "events may need it"
    elif options.has_extended_precision:
        reason = "the series with 20 or 30 digits always computes it"
    else:
        reason = "the support turned at the start of the run"
        is_kept = is_kept and not any(scene.turning)  # otherwise the motion depends on it
    left_out = (
        (
            skips_heading,
            "attitude",
            "no requested quantity depends on turns about the vertical",
        ),
        (skips_heading, "momentum", "no requested quantity needs m in space"),
        (is_exact, "steps", "any state at once, by the closed form"),
        (is_exact and is_free, "gravity", "no torque acts: the free body's closed form"),
        (is_split, "two of the four rotations of a drift", "two moments are equal"),
        (has_all and states == 2, "states in between", "only start and end are requested"),
        (has_all, "all quantities but t, q, m", "each is computed on first access"),
        (not has_all, "all other quantities", "not requested: neither computed nor recorded"),
        (not has_all, "the states themselves", f"only {CHUNK_SIZE} at a time are held in memory"),
        (True, "the error estimate", "a second run, made on first access of path.error"),
    )
    kept = (
        (is_kept, "attitude", reason),
        (is_series and is_free, "torque", "zero, but cheap beside the sums of a whole order"),
        (is_series and is_symmetric, "general form", "its zero terms share vectors with others"),
    )
    lists = (tuple((what, why) for holds, what, why in rows if holds) for rows in (left_out, kept))
    return next(lists), next(lists)
