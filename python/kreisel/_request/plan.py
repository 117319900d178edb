"""kreisel.plan: what a run of a scene uses, and what it leaves out, and why."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from .._core import start, values
from .._ground.arguments import Numbers
from .._ground.names import MethodName, QuantityName
from .._model.scene import Scene
from .methods import ELSE, EXACT, no_closed_form, told
from .quantities import TURNING, doubles
from .request import Request, checked_every, request
from .times import PIECE, listed

BY_TRIAL: str = "geometric"  # which is no name of a method, and asked for all the same
Reasons = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Choice:
    """What method='geometric' chose so that the attitude error stays below a target on [0, t], and
    what that cost.

    step          [T]
    target        the error asked for [rad]
    error         what it is, by a reference: the closed form or the Taylor series with 20 digits
                  [rad]
    conditioning  about how far one rounding of the state moves the attitude [rad]
    run, trials   evaluations of the torque: of the run that was kept, and of all others, a term of
                  the reference's series being one
    budget        the steps that all runs together were allowed
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
    """What is used; print it.

    method, why   its name, and why it is this one; step and order: None and 0 where it has none, or
                  chooses them
    form          the equations that are integrated
    kernel        the instruction set of taylor's series, else empty
    columns       what is recorded of a state, `bytes` so many a state
    left_out      (what, why) of all that the scene or the request does not need
    kept          (what, why) of what is not needed and yet computed
    choice        of method="geometric": its target, error, conditioning and cost; else None
    turn          about how far the top turns in a step: as fast as at the start, or as a pendulum
                  would; None where the steps are chosen on the way [rad]
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
    choice: Choice | None = None
    turn: float | None = None

    def __str__(self) -> str:
        order = (
            f"order {self.order}"
            if self.order
            else "no order: closed form, or as the tolerance needs"
        )
        parts = {
            "method": [f"{self.method}: {self.why}"],
            "equations": [self.form],
            "step": []
            if self.turn is None
            else [f"{self.step:g}: in each the top turns by about {self.turn:.2g} rad"],
            "order": [f"{order}, kernel {self.kernel}" if self.kernel else order],
            "recorded": [f"{', '.join(self.columns)}: {self.bytes} bytes a state"],
            "left out": [f"{what}: {why}" for what, why in self.left_out],
            "kept": [f"{what}: {why}" for what, why in self.kept],
            "chosen": [str(self.choice)] if self.choice else [],
        }
        rows = [
            (name if i == 0 else "", text)
            for name, texts in parts.items()
            for i, text in enumerate(texts)
        ]
        return "\n".join(f"{name:<11}{text}" for name, text in rows)


def plan(
    scene: Scene,
    t: Numbers | None = None,
    want: Iterable[QuantityName] | None = None,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
) -> Plan:
    """What kreisel.solve would use in these words, and what it would leave out; nothing is run.

    t  may be left out; with it the plan says which states are wanted

        >>> import kreisel as kr
        >>> plan = kr.plan(kr.scenes.asymmetric, want=("nutation", "energy"))
        >>> print(str(plan).splitlines()[0])
        method     taylor: no closed form is known for this body of kind 'general' under gravity

    Raises what kreisel.solve raises before anything runs; ValueError for 'geometric', whose choice
    takes trial runs: see path.plan.
    """
    if method == BY_TRIAL:
        raise ValueError("method='geometric' chooses by trial runs: solve, and see path.plan")
    asked = request(scene, method, step, tol, digits, 0, want)
    number = checked_every(asked.method, every)
    states = None if t is None else listed(t, asked.step, number, asked.size).size
    return plan_of(scene, asked, states)


def plan_of(
    scene: Scene, done: Request, states: int | None = None, choice: Choice | None = None
) -> Plan:
    """The plan of a request for this scene, for so many states."""
    kernel, order = "", done.method.order
    if done.method.suits(scene):
        _, top = start(scene._block, *done.core)
        kernel, order = top.kernel if top else (kernel, order)
    columns = ("t", "q", "m") if done.want is None else ("t", *done.want)
    if done.want is None and done.low:
        columns += "q_low", "m_low"
    return Plan(
        method=done.method.name,
        why=_why(scene, done, choice),
        step=done.step,
        order=order,
        form=_form(done),
        kernel=kernel,
        columns=columns,
        bytes=8 * sum(map(doubles, columns)),
        left_out=_left_out(scene, done, states),
        kept=_kept(scene, done),
        choice=choice,
        turn=_turn(scene, done),
    )


def _turn(scene: Scene, done: Request) -> float | None:
    """How far the top turns in a fixed step; from a radian on few methods can follow it."""
    if done.step is None or done.method.adaptive:
        return None
    velocity = float(np.linalg.norm(values("velocity", scene._block, scene._start)))
    return done.step * max(velocity, scene._fastest)


def _why(scene: Scene, done: Request, choice: Choice | None) -> str:
    if choice:
        return "the cheapest that keeps the error allowed"
    if done.asked != "auto":
        return "asked for by name"
    if done.digits is not None:
        return f"asked for {done.digits} digits"
    if not done.method.exact:
        return no_closed_form(scene)
    return f"{told(scene)} has a closed form" + ("" if scene.gravity else " without gravity")


def _form(done: Request) -> str:
    if done.leave_heading:
        return "(W, P): the angular velocity and the vertical, both seen from the body"
    if done.method.name == ELSE:
        return "(q, W, P): attitude, and angular velocity and vertical seen from the body"
    return done.method.text


def _no_torque(scene: Scene) -> bool:
    return scene.gravity == 0.0 or not any(scene.body.com)


def _left_out(scene: Scene, done: Request, states: int | None) -> Reasons:
    want, name = done.want, done.method.name
    rows = []
    if done.leave_heading:
        rows.append(
            ("attitude", "nothing that is wanted changes when the top is turned about the vertical")
        )
        rows.append(("momentum", "nor does it need m in space"))
    if name == EXACT:
        rows.append(("steps", "any state at once, by the closed form"))
        if _no_torque(scene):
            rows.append(("gravity", "no torque acts: the free body's closed form"))
    if done.method.splitting and scene.body.is_symmetric:
        rows.append(("two of a drift's four turns", "two moments are equal: the rest is exact"))
    if states == 2 and want is None:
        rows.append(("states on the way", "only the start and the end are asked for"))
    if want is None:
        rows.append(("all quantities but t, q, m", "each is computed when it is first asked for"))
    else:
        rows.append(("all other quantities", "not wanted: neither computed nor recorded"))
        rows.append(
            (
                "the states themselves",
                f"at most {PIECE} at a time, dropped when what is wanted is computed",
            )
        )
    rows.append(("the error's estimate", "a second run, made when path.error is asked for"))
    return tuple(rows)


def _kept(scene: Scene, done: Request) -> Reasons:
    rows = []
    if done.method.name == ELSE:
        if done.want is not None and not done.leave_heading and TURNING.isdisjoint(done.want):
            why = "the series with more digits than doubles has no form without it"
            rows.append(("attitude", "events may need it" if done.watched else why))
        if _no_torque(scene):
            rows.append(
                ("torque", "zero, and cheap: two products beside the sums of a whole order")
            )
        if scene.body.is_symmetric:
            rows.append(
                (
                    "general form",
                    "what two equal moments make zero shares its vectors with what stays",
                )
            )
    elif done.want is not None and TURNING.isdisjoint(done.want) and done.method.name != EXACT:
        rows.append(
            ("attitude", f"{done.method.name} computes it on the way; only taylor can do without")
        )
    return tuple(rows)
