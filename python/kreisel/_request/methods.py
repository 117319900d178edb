"""The methods of this build, read from the core's table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, cast

from .._core import flags as FLAGS
from .._core import kowalewski_plan, method_applies, method_suits
from .._core import methods as core_methods
from .._ground.arguments import instance, shown
from .._ground.names import MethodName
from .._ground.refusals import unknown as unknown_name
from .._model.body import Body
from .._model.scene import Scene

# for some bodies only
_SOME = FLAGS["lagrange_only"] | FLAGS["integrable"] | FLAGS["symmetric_only"] | FLAGS["euler_only"]
# What 'auto' takes: the first where it suits.
EXACT: Final = "exact"
ELSE: Final = "taylor"


@dataclass(frozen=True)
class Method:
    """A way to step from one state to the next.

    order      of the error of a path in the step; 0: chosen on the way
    conserves  what it keeps to rounding
    adaptive   chooses its steps by a tolerance; else it needs a step
    algebraic  uses + - * / and square roots only: the same bits from every compiler and machine
    digits     can be asked for more digits than a double has
    """

    name: MethodName
    text: str
    order: int
    conserves: str
    reference: str
    flags: int

    @property
    def symplectic(self) -> bool:
        return bool(self.flags & FLAGS["symplectic"])

    @property
    def reversible(self) -> bool:
        return bool(self.flags & FLAGS["reversible"])

    @property
    def adaptive(self) -> bool:
        return bool(self.flags & FLAGS["adaptive"])

    @property
    def implicit(self) -> bool:
        return bool(self.flags & FLAGS["implicit"])

    @property
    def algebraic(self) -> bool:
        return bool(self.flags & FLAGS["algebraic"])

    @property
    def digits(self) -> bool:
        """Can be asked for more digits than a double has."""
        return bool(self.flags & FLAGS["digits"])

    @property
    def splitting(self) -> bool:
        """Kicks and drifts in turn; a drift is exact where two moments are equal."""
        return bool(self.flags & FLAGS["splitting"])

    @property
    def headless(self) -> bool:
        """Can leave out the heading of the top, its turn about the vertical."""
        return bool(self.flags & FLAGS["headless"])

    @property
    def exact(self) -> bool:
        """The closed form: it has neither step nor tolerance, and is for integrable scenes only."""
        return bool(self.flags & FLAGS["integrable"])

    @property
    def damped(self) -> bool:
        """Moves tops that are damped, too."""
        return bool(self.flags & FLAGS["damped"])

    @property
    def tangents(self) -> bool:
        """Carries derivatives of the state along."""
        return bool(self.flags & FLAGS["tangents"])

    @property
    def tops(self) -> str:
        """Those that it is for, in words."""
        lagrange = "two equal moments and the centre of mass on the third axis"
        kinds = {
            FLAGS["lagrange_only"]: lagrange,
            FLAGS["integrable"]: lagrange
            + ", for Kowalewski tops, and for any body without torque",
            FLAGS["symmetric_only"]: "two equal moments",
            FLAGS["euler_only"]: "the centre of mass at the fixed point",
        }
        return next((words for flag, words in kinds.items() if self.flags & flag), "any body")

    def applies_to(self, body: Body) -> bool:
        """Whether it can move this body under any gravity; `tops` says in words which it can."""
        return method_applies(self.name, instance("body", body, Body)._block)

    def suits(self, scene: Scene) -> bool:
        """Whether it can move this scene: without gravity more bodies have a closed form, and few
        methods move what is damped."""
        damped = instance("scene", scene, Scene)._is_damped
        any_body = not self.flags & _SOME and not damped
        return any_body or method_suits(self.name, scene._block)


class Methods(dict[MethodName, Method]):
    """Methods by name; a KeyError suggests the nearest. Printed, they are a table."""

    def __repr__(self) -> str:
        """A line for each: its name, its order and what it is."""
        rows = [(name, str(method.order or "-"), method.text) for name, method in self.items()]
        wide = max((len(name) for name, _, _ in rows), default=0)
        return "\n".join(f"{name:<{wide}} {order:>2}  {text}" for name, order, text in rows)

    if TYPE_CHECKING:  # any text may be looked up

        def __getitem__(self, name: str, /) -> Method: ...

    def __missing__(self, name: str) -> Method:
        raise KeyError(unknown(name))


def unknown(name: str) -> str:
    """What to say of a method that is not there."""
    if name == "geometric":
        return "method='geometric' makes whole runs to choose by: it is for kreisel.solve alone"
    if name in ("gsl_rk8pd", "gsl_bsimp"):
        return (
            f"the method {name!r} is not in this build: it needs the GNU Scientific Library (GPL); "
            "in the source tree, with that library installed: "
            "pip install -C cmake.define.KREISEL_GSL=ON ."
        )
    return unknown_name("method", str(name), ["auto", *methods])


methods = Methods({row["name"]: Method(**row) for row in core_methods})


def told(scene: Scene) -> str:
    """The body of a scene by its kind, in words."""
    damped, near = "damped " if scene._is_damped else "", scene.body._nearly
    which = f", which is {near}" if near else ""
    return f"this {damped}body of kind {scene.body.kind!r}{which}"


def is_kowalewski(scene: Scene) -> bool:
    """Return whether gravity acts on a Kowalewski top. Its closed form is for who asks for it: it
    takes as long to set up as some hundred units of time by a series."""
    return scene.gravity != 0.0 and scene.body.kind == "kowalewski"


def no_closed_form(scene: Scene) -> str:
    """Why there is none, in words."""
    if scene._is_damped:
        return f"no closed form is known for {told(scene)} with damping"
    if not methods[EXACT].applies_to(scene.body):
        return f"no closed form is known for {told(scene)} under gravity"
    if is_kowalewski(scene):
        status, refusal = kowalewski_plan(scene._block, 0.0)[:2]
        if status == "OK":
            return "the closed forms of Kowalewski tops are made one by one"
        return f"this motion of a Kowalewski top has no closed form: {refusal}"
    return (
        "no closed form tells when a top will fall whose axis leans or moves by less than 1e-70 at "
        "the start, and yet does not stand"
    )


def named(name: object) -> Method:
    """The method of this name; TypeError or ValueError if there is none."""
    if not isinstance(name, str):
        raise TypeError(f"method must be a name in kreisel.methods, not {shown(name)}")
    method = methods.get(cast(MethodName, name))
    if method is None:
        raise ValueError(unknown(name))
    return method


def fitting(name: object, scene: Scene) -> Method:
    """The method of this name or 'auto'; ValueError if there is none, or if it does not apply to
    the scene."""
    if isinstance(name, str) and name == "auto":
        closed = methods[EXACT].suits(scene) and not is_kowalewski(scene)
        return methods[EXACT if closed else ELSE]
    method = named(name)
    if not method.suits(scene):
        if method.applies_to(scene.body) and not scene._is_damped:
            raise ValueError(f"the method {name!r} does not apply: {no_closed_form(scene)}")
        others = ", ".join(other.name for other in methods.values() if other.suits(scene))
        tops = method.tops if method.damped or not scene._is_damped else "tops without damping"
        raise ValueError(
            f"the method {name!r} does not apply to {told(scene)}: "
            f"it is for {tops}; these apply: {others}"
        )
    return method
