"""The methods, and the closed forms that apply to a top."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Final, NamedTuple, cast

import numpy as np

from .._core import flags as FLAGS
from .._core import method_applies, method_suits, plan_exact, scene_kind, values
from .._core import methods as core_methods
from .._model.body import Body
from .._model.parameters import list_disturbances
from .._model.scene import Scene, validate_one_top
from .._utils.arguments import Array, as_finite_array, short_repr, spell, validate_type
from .._utils.arguments import unknown_name_message as unknown_name
from .._utils.quantity_attributes import MethodName

_LAGRANGE = "bodies with two equal moments and the centre of mass on the third axis"
_BODIES = {  # {flag of methods that apply to some bodies only: these bodies}
    FLAGS["lagrange_only"]: _LAGRANGE,
    FLAGS["integrable"]: f"{_LAGRANGE}, Kowalewski tops, Goryachev-Chaplygin tops without vertical "
    "momentum, and any body without torque",
    FLAGS["symmetric_only"]: "bodies with two equal moments",
    FLAGS["euler_only"]: "bodies with the centre of mass at the fixed point",
}
_SOME = sum(_BODIES)
# The method AUTO selects EXACT if the closed form suits the scene, else FALLBACK. For motions on
# a torus see `explain_taylor_choice`.
AUTO: Final = "auto"
TIMES_FORM = "a number or a list of times"
EXACT: Final = "exact"
FALLBACK: Final = "taylor"


@dataclass(frozen=True)
class Method:
    """A method for computing motions: a numerical integrator, or the closed-form solution.

    order      p if the error of a path is proportional to step^p; 0 if the method chooses p or
               takes no steps
    conserves  the invariants that the method conserves up to rounding
    adaptive   True if the method needs no step: a tolerance controls the steps, or the method is a
               closed form
    algebraic  True if only + - * / and square roots are used, so that results are equal to the last
               bit for all compilers and machines
    exact      True if the method evaluates the closed-form solution, without steps or a tolerance.
               Closed-form solutions exist only for integrable tops
    digits     True if the method can compute more digits than a double has
    tangents   True if the method can compute derivatives of the state
    splitting  True if the steps consist of kicks and drifts. The drift (free motion) is computed
               exactly if two principal moments are equal

    symplectic, reversible and implicit are properties of the map of a step. skips_heading is True
    if the heading of the top (its rotation about the vertical) can be omitted. damped, rotors,
    turning, shaking, friction and gradient are True if the method also applies to damped tops,
    bodies with rotors, supports that turn about other axes than e3 or are shaken, tops with dry
    friction, and bodies in a gravity gradient.
    """

    name: MethodName
    text: str
    order: int
    conserves: str
    reference: str
    flags: int
    symplectic: bool = field(repr=False)
    reversible: bool = field(repr=False)
    adaptive: bool = field(repr=False)
    implicit: bool = field(repr=False)
    algebraic: bool = field(repr=False)
    digits: bool = field(repr=False)
    splitting: bool = field(repr=False)
    skips_heading: bool = field(repr=False)
    exact: bool = field(repr=False)
    damped: bool = field(repr=False)
    rotors: bool = field(repr=False)
    turning: bool = field(repr=False)
    shaking: bool = field(repr=False)
    friction: bool = field(repr=False)
    gradient: bool = field(repr=False)
    tangents: bool = field(repr=False)

    @property
    def tops(self) -> str:
        """A description of the bodies to which the method can be applied."""
        return next((text for flag, text in _BODIES.items() if self.flags & flag), "any body")

    def applies_to(self, body: Body) -> bool:
        """Return True if the method applies to `body`, as described by `tops`, for any gravity."""
        return method_applies(self.name, validate_type("body", body, Body)._block)

    def suits(self, scene: Scene) -> bool:
        """Return True if the method applies to `scene`.

        In the absence of gravity, the motion of any body without a rotor has a closed-form
        solution. Only taylor applies to tops with damping or friction, and to supports that are
        shaken or turn about another axis than e3.
        """
        validate_one_top("scene", scene)
        is_plain = not (scene._has_disturbances or any(scene.body.rotor) or self.flags & _SOME)
        return is_plain or method_suits(self.name, scene._block)


class Methods(dict[MethodName, Method]):
    """The methods by name. Printing the dictionary shows a table of the methods.

    The KeyError for an unknown name suggests the nearest known name.
    """

    def __repr__(self) -> str:
        """Return one line for each method, with its name, order and description."""
        rows = [(name, str(method.order or "-"), method.text) for name, method in self.items()]
        wide = max((len(name) for name, _, _ in rows), default=0)
        return "\n".join(f"{name:<{wide}} {order:>2}  {text}" for name, order, text in rows)

    if TYPE_CHECKING:  # any str may be looked up

        def __getitem__(self, name: str, /) -> Method: ...

    def __missing__(self, name: str) -> Method:
        raise KeyError(unknown_method_message(name))


def unknown_method_message(name: str) -> str:
    """Return the error message for a method that does not exist."""
    if name == "geometric":
        return f"{spell('method', name)} needs trial runs: only kreisel.solve accepts it"
    if name in ("gsl_rk8pd", "gsl_bsimp"):
        return (
            f"the method {name!r} is not in this build: it needs the GNU Scientific Library (GPL); "
            "in the source tree, with that library installed: "
            "pip install -C cmake.define.KREISEL_GSL=ON ."
        )
    return unknown_name("method", str(name), ["auto", *methods])


_FLAGS = [field.name for field in fields(Method) if field.type == "bool"]
methods = Methods(
    {
        row["name"]: Method(
            **row,
            **{
                name: bool(row["flags"] & FLAGS["integrable" if name == "exact" else name])
                for name in _FLAGS
            },
        )
        for row in core_methods
    }
)


class _TorusForm(NamedTuple):
    """A closed form on a torus, and its cost in steps of the Taylor series.

    With these parameters, the Taylor series was slower for all random tops for which the
    closed-form solution is chosen (docs/theory/closed_form.md).

    top     the name of one of its tops
    ratio   the ratio of each equal moment to the third one
    set_up  the time of the set-up [steps]
    state   the time of a state [steps]
    """

    top: str
    ratio: float
    set_up: float
    state: float


_TORUS_FORMS: Final = {
    "kowalewski": _TorusForm("Kowalewski top", ratio=2.0, set_up=1e3, state=0.5),
    "goryachev_chaplygin": _TorusForm("Goryachev-Chaplygin top", ratio=4.0, set_up=4e3, state=1.0),
    "gyrostat": _TorusForm("free gyrostat", ratio=2.0, set_up=4e2, state=0.3),
}
_ROUNDING: Final = 2.0**-53
_LARGEST_CERTIFICATE: Final = 1e-11  # the core refuses closed forms with a larger one
_ERROR_PER_CERTIFICATE: Final = 10.0  # see kreisel.ExactTorus


def has_torus_closed_form(scene: Scene) -> bool:
    """Return True for a Kowalewski or Goryachev-Chaplygin top under gravity, or a free gyrostat."""
    # This check is part of every solve, so it calls the core directly.
    return scene_kind(scene._block) in _TORUS_FORMS


def _get_torus_form(scene: Scene) -> _TorusForm:
    return _TORUS_FORMS[scene_kind(scene._block)]


def compute_closed_form_error_limit(scene: Scene, t: object) -> float:
    """Return the largest certificate for which method='auto' accepts a closed form on a torus.

    Returns 0.0 if method='auto' uses the Taylor series regardless of the certificate. Raises
    TypeError or ValueError if the times `t` are invalid.
    """
    last, form = t, _get_torus_form(scene)
    if (isinstance(t, list) or (isinstance(t, np.ndarray) and t.ndim == 1)) and len(t) > 0:
        last = t[-1]
    # The last time alone often shows that the series is faster, before all times are validated.
    # The angular velocity is at most `ratio` times the rate.
    most_steps = (0.5 * form.ratio + 1.0) * scene._rotation_rate
    if isinstance(last, (int, float)) and most_steps * abs(last) < form.set_up:
        return 0.0
    return _decide_on_closed_form(scene, as_finite_array("t", t, TIMES_FORM))[1]


def explain_taylor_choice(scene: Scene, times: Array | None) -> str:
    """Return the reason why method='auto' does not use a closed form on a torus, or "" if it does.

    The closed-form solution is used if it is neither slower nor less accurate than the Taylor
    series. The choice of method depends only on the arguments, not on the speed of the machine.
    `times` is None if the requested times are unknown.

    The costs of the two methods are compared only for single scenes. In an ensemble, the method
    chosen for each top depends only on its scene. See "Ensembles" in docs/theory/closed_form.md.
    """
    reason, error_limit = _decide_on_closed_form(scene, times)
    if reason:
        return reason
    status, refusal = plan_exact(scene._block, error_limit)[:2]
    top = _get_torus_form(scene).top
    return "" if status == "OK" else f"the closed form of a {top} does not apply: {refusal}"


def _decide_on_closed_form(scene: Scene, times: Array | None) -> tuple[str, float]:
    """Return the reason for rejecting the closed form or "", and the largest certificate."""
    body, form = scene.body, _get_torus_form(scene)
    if not methods[EXACT].suits(scene):
        return explain_no_closed_form(scene), 0.0
    if scene._has_disturbances or times is None:  # a support that turns about e3
        where = "in runs, streams, ensembles and without times"
        if scene._has_disturbances:
            where = "on turning supports"
        hint = "the method 'exact' takes the closed form"
        return f"'auto' integrates {form.top}s {where}; {hint}", 0.0
    # The series takes 0.8 to 4 times as many steps for random tops as the last time multiplied by
    # half the angular velocity plus the frequency of the pendulum.
    end = float(np.abs(times).max(initial=0.0))
    velocity = math.hypot(*values("velocity", scene._block, scene._start_state).ravel())
    torque = body.mass * abs(scene.gravity) * math.hypot(*body.com)
    steps = end * (0.5 * velocity + math.sqrt(torque / max(body.moments)))
    cost = form.set_up + form.state * times.size
    if not steps >= cost:  # NaN if the rates of the top exceed the range of doubles
        reason = (
            f"the closed form of a {form.top} takes as long as {cost:.2g} steps of the series, "
            f"and about {steps:.2g} suffice"
        )
        return reason, 0.0
    return "", min(_ROUNDING * steps / _ERROR_PER_CERTIFICATE, _LARGEST_CERTIFICATE)


def describe_kind_of_top(scene: Scene) -> str:
    """Return a short description of a scene: its body, damping, friction and support."""
    neighbour = scene.body._nearby_integrable_case_message
    clause = f", which is {neighbour}" if neighbour else ""
    rotor = " with a rotor" if any(scene.body.rotor) else ""
    more = list_disturbances(scene) if scene._has_disturbances else []
    extras = f" {'and' if rotor else 'with'} {' and '.join(more)}" if more else ""
    return f"this body of kind {scene.body.kind!r}{rotor}{extras}{clause}"


def _view_from_inertial_frame(scene: Scene) -> Scene:
    """Return the scene without the turns of its support about e3, which rule out no closed form."""
    x, y, z = scene.turning
    return scene.replace(turning=None) if z and not x and not y else scene


def explain_no_closed_form(scene: Scene) -> str:
    """Return the reason why the motion of a scene has no closed-form solution."""
    scene = _view_from_inertial_frame(scene)
    reason = f"no closed form is known for {describe_kind_of_top(scene)}"
    if scene._has_disturbances and not methods[EXACT].suits(scene):
        return reason
    if has_torus_closed_form(scene):
        return (
            f"this motion of a {_get_torus_form(scene).top} has no closed form: "
            f"{plan_exact(scene._block, 0.0)[1]}; kr.solve integrates it with the method 'taylor'"
        )
    if any(scene.body.rotor):
        return f"{reason}: the rotor must be along the axis of a Lagrange top, or the body be free"
    if not methods[EXACT].applies_to(scene.body):
        return f"{reason} under gravity"
    return (
        "no closed form can resolve the fall of a top whose initial tilt and velocity are below "
        "1e-70"
    )


def get_method(name: object) -> Method:
    """Return the method named `name`; raise TypeError or ValueError if there is none."""
    if not isinstance(name, str):
        raise TypeError(f"{spell('method')} must be one of kreisel.methods, not {short_repr(name)}")
    method = methods.get(cast(MethodName, name))
    if method is None:
        raise ValueError(unknown_method_message(name))
    return method


def resolve_method(name: object, scene: Scene) -> Method:
    """Return the method named `name` or, for 'auto', the most suitable method for the scene.

    For motions on a torus, 'auto' is replaced by the Taylor series.

    Raises ValueError if no method has this name, or if the method does not apply to the scene.
    """
    if isinstance(name, str) and name == AUTO:
        has_closed_form = not has_torus_closed_form(scene) and methods[EXACT].suits(scene)
        return methods[EXACT if has_closed_form else FALLBACK]
    method = get_method(name)
    if method.suits(scene):
        return method
    scene, has_rotor = _view_from_inertial_frame(scene), any(scene.body.rotor)
    has_form = method.applies_to(scene.body) or (method.exact and has_rotor)
    if has_form and not scene._has_disturbances:
        raise ValueError(f"the method {name!r} does not apply: {explain_no_closed_form(scene)}")
    tops = method.tops
    if has_rotor:
        tops += ", and rotors along the axis of symmetry or in free bodies"
        tops = tops if method.rotors else "bodies without rotors"
    for is_there, flag, others in (
        (scene._has_damping, method.damped, "tops without damping"),
        (scene.friction, method.friction, "tops without friction"),
        (scene.gradient, method.gradient, "tops without a gravity gradient"),
        (scene._is_shaken, method.shaking, "tops whose support is not shaken"),
        (any(scene.turning), method.turning, "tops whose support does not turn, or turns about e3"),
    ):
        if is_there and not flag:
            tops = others
            break
    suited = ", ".join(other.name for other in methods.values() if other.suits(scene))
    raise ValueError(
        f"the method {name!r} does not apply to {describe_kind_of_top(scene)}: "
        f"it is for {tops}; these apply: {suited}"
    )
