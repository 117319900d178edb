"""Description of a computation: what is computed, what is omitted, and why."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .._core import start, values
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

    For an ensemble, the fields up to `turn` describe the first top.

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
    shape     the shape of the ensemble; () for a single scene
    closed_form  the number of tops computed in closed form
    lanes     the number of tops integrated several at a time, in the lanes of vectors
    alone     the number of tops integrated one by one in each thread
    threads   the number of threads
    states    the number of states of each top; None without times
    size      the size of the result [bytes]; None without times
    seconds   for an ensemble with times: an estimate of the run time [s]; otherwise None
    measured  the number of tops that were run to estimate `seconds`; they are spread evenly over
              the ensemble
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
        order = (
            f"order {self.order}"
            if self.order
            else "no fixed order: a closed form, or an order chosen by the tolerance"
        )
        counts = {
            "by closed form": self.closed_form,
            "in lanes": self.lanes,
            "one by one": self.alone,
        }
        ways = ", ".join(f"{n} {way}" for way, n in counts.items() if n) or "none"
        tops = f"{self.shape}: {ways}; by {self.threads} threads"
        memory = self.size and f"{self.states} states each: {1e-6 * self.size:.3g} MB in all"
        clock = f"about {self.seconds or 0.0:.2g} s, measured on {self.measured} of the tops"
        parts = {
            "tops": [tops] if self.shape else [],
            "result": [memory] if self.shape and memory else [],
            "time": [clock] if self.seconds is not None else [],
            "first top": [""] if self.shape and self.method else [],
            "method": [f"{self.method}: {self.why}"],
            "equations": [self.form],
            "step": []
            if self.turn is None
            else [f"{self.step:g}: the top turns by about {self.turn:.2g} rad in each step"],
            "order": [f"{order}, kernel {self.kernel}" if self.kernel else order],
            "recorded": [
                f"{', '.join(self.columns)}: {self.bytes} bytes a "
                f"{'state' if 't' in self.columns else 'top'}"
            ],
            "left out": [f"{item}: {reason}" for item, reason in self.left_out],
            "kept": [f"{item}: {reason}" for item, reason in self.kept],
            "chosen": [str(self.choice)] if self.choice else [],
        }
        if not self.method:  # there is no first top
            parts = {"tops": parts["tops"]}
        return [
            (name if i == 0 else "", text)
            for name, texts in parts.items()
            for i, text in enumerate(texts)
        ]

    def __str__(self) -> str:
        return "\n".join(f"{name:<11}{text}" for name, text in self._list_description_rows())

    def _repr_html_(self) -> str:
        """Return the description of the computation as an HTML table for display in notebooks."""
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
    is_series = options.method == FALLBACK
    kernel, order = (
        _find_instruction_set_and_series_order(options.core_arguments)
        if is_series
        else ("", options.integrator.order)
    )
    columns = ("t", "q", "m") if options.want is None else ("t", *options.want)
    if options.want is None and options.has_extended_precision:
        columns += "q_low", "m_low"
    size = 8 * sum(map(count_quantity_components, columns))
    is_exact = options.integrator.exact
    return Plan(
        method=options.method,
        why=_explain_method_choice(scene, options, times, choice),
        step=options.step,
        order=order,
        form=_describe_integrated_equations(options),
        kernel=kernel,
        columns=columns,
        bytes=size,
        left_out=_list_omitted_computations(scene, options, states),
        kept=_explain_unneeded_computations(scene, options),
        choice=choice,
        turn=_estimate_turn_per_step(scene, options),
        closed_form=int(is_exact),
        alone=int(not is_exact),
        states=states,
        size=None if states is None else states * size,
    )


@lru_cache
def _find_instruction_set_and_series_order(core: CoreArguments) -> tuple[str, int]:
    """Return the instruction set and the order of the Taylor series.

    The instruction set and the order of the Taylor series depend only on the options, not on the
    scene.
    """
    scene = Scene(Body(1.0, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)), (0.0, 0.0, 1.0))
    _, top = start(scene._block, *core)
    return top.kernel if top else ("", 0)


def _estimate_turn_per_step(scene: Scene, options: Options) -> float | None:
    """Return the approximate angle of rotation per step, or None if the step size varies.

    Few methods are accurate if the top turns by one radian or more per step.
    """
    if options.step is None or options.integrator.adaptive:
        return None
    velocity = float(np.linalg.norm(values("velocity", scene._block, scene._start_state)))
    return options.step * max(velocity, scene._rotation_rate)


def _explain_method_choice(
    scene: Scene, options: Options, times: Array | None, choice: StepChoice | None
) -> str:
    if choice:
        return "the cheapest method that meets the allowed error"
    if options.requested_method != "auto":
        return "requested by name"
    if options.digits is not None:
        return f"{options.digits} digits requested"
    if not options.integrator.exact and has_torus_closed_form(scene):
        if options.step is not None or options.tol is not None:
            return "the closed form has neither step nor tol"
        # A path can have times for which kreisel.solve would use the closed form.
        return explain_taylor_choice(scene, times) or explain_taylor_choice(scene, None) or ""
    if not options.integrator.exact:
        return explain_no_closed_form(scene)
    reason = f"{describe_kind_of_top(scene)} has a closed form"
    if has_torus_closed_form(scene):
        return f"{reason}, which takes no more time than the series up to the last time"
    return reason if scene.gravity else f"{reason} without gravity"


def _describe_integrated_equations(options: Options) -> str:
    if options.can_skip_heading_angle:
        return "(W, P): the angular velocity and the vertical, both seen from the body"
    if options.method == FALLBACK:
        return "(q, W, P): attitude, and angular velocity and vertical seen from the body"
    return options.integrator.text


def _is_torque_free(scene: Scene) -> bool:
    return scene.gravity == 0.0 or not any(scene.body.com)


def _list_omitted_computations(scene: Scene, options: Options, states: int | None) -> Reasons:
    want, name = options.want, options.method
    rows = []
    if options.can_skip_heading_angle:
        rows.append(
            ("attitude", "no requested quantity changes if the top is rotated about the vertical")
        )
        rows.append(("momentum", "no requested quantity needs m in space"))
    if name == EXACT:
        rows.append(("steps", "any state at once, by the closed form"))
        if _is_torque_free(scene):
            rows.append(("gravity", "no torque acts: the free body's closed form"))
    if options.integrator.splitting and scene.body.is_symmetric:
        rows.append(
            (
                "two of the four rotations of a drift",
                "two moments are equal, and the other two rotations are exact",
            )
        )
    if states == 2 and want is None:
        rows.append(("states in between", "only the start and the end are requested"))
    if want is None:
        rows.append(("all quantities but t, q, m", "each is computed on first access"))
    else:
        rows.append(("all other quantities", "not requested: neither computed nor recorded"))
        rows.append(
            (
                "the states themselves",
                f"at most {CHUNK_SIZE} at a time, discarded after the requested quantities are "
                "computed",
            )
        )
    rows.append(("the error estimate", "a second run, made on first access of path.error"))
    return tuple(rows)


def _explain_unneeded_attitude(options: Options) -> str:
    if options.requests_events:
        return "events may need it"
    if options.has_extended_precision:
        return "the series with 20 or 30 digits always computes it"
    return "the support turned at the start of the run"


def _explain_unneeded_computations(scene: Scene, options: Options) -> Reasons:
    rows = []
    if options.method == FALLBACK:
        if (
            options.want is not None
            and not options.can_skip_heading_angle
            and not any(scene.turning)  # otherwise the motion depends on the attitude
            and HEADING_DEPENDENT.isdisjoint(options.want)
        ):
            rows.append(("attitude", _explain_unneeded_attitude(options)))
        if _is_torque_free(scene):
            rows.append(
                ("torque", "zero, but cheap: two products next to the sums of a whole order")
            )
        if scene.body.is_symmetric:
            rows.append(
                (
                    "general form",
                    "the terms that vanish for two equal moments share vectors with the others",
                )
            )
    elif (
        options.want is not None
        and HEADING_DEPENDENT.isdisjoint(options.want)
        and options.method != EXACT
    ):
        rows.append(
            (
                "attitude",
                f"{options.method} always computes it; only taylor can omit it",
            )
        )
    return tuple(rows)
