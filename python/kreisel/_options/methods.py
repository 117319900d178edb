"""The methods of this build, as listed by the C library."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, cast

from .._core import KIND_RTOL, body_kind, method_applies, method_suits, torus_plan
from .._core import flags as FLAGS
from .._core import methods as core_methods
from .._model.body import Body
from .._model.environment import list_disturbances
from .._model.scene import Scene
from .._utils.errors import unknown_name_message as unknown_name
from .._utils.quantity_attributes import MethodName
from .._utils.validation import short_repr, validate_type

# flags of methods that apply to some bodies only
_SOME = FLAGS["lagrange_only"] | FLAGS["integrable"] | FLAGS["symmetric_only"] | FLAGS["euler_only"]
# The method 'auto' selects EXACT if the closed form suits the scene, else FALLBACK. For Kowalewski
# and Goryachev-Chaplygin tops see closed_form_choice.py.
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
    digits     True if the method can compute more digits than a double has
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
        """True if the method can compute in more than double precision."""
        return bool(self.flags & FLAGS["digits"])

    @property
    def splitting(self) -> bool:
        """True if the method is a splitting method, whose steps consist of kicks and drifts.

        The drift (free motion) is computed exactly if two principal moments are equal.
        """
        return bool(self.flags & FLAGS["splitting"])

    @property
    def skips_heading(self) -> bool:
        """True if the heading of the top (its rotation about the vertical) can be omitted."""
        return bool(self.flags & FLAGS["skips_heading"])

    @property
    def exact(self) -> bool:
        """True if the method evaluates the closed-form solution, without steps or a tolerance.

        Closed-form solutions exist only for integrable tops.
        """
        return bool(self.flags & FLAGS["integrable"])

    @property
    def damped(self) -> bool:
        """True if the method also applies to damped tops."""
        return bool(self.flags & FLAGS["damped"])

    @property
    def rotors(self) -> bool:
        """True if the method also applies to bodies with rotors."""
        return bool(self.flags & FLAGS["rotors"])

    @property
    def turning(self) -> bool:
        """True if the method also applies to supports that turn about axes other than e3."""
        return bool(self.flags & FLAGS["turning"])

    @property
    def shaking(self) -> bool:
        """True if the method also applies to shaken supports."""
        return bool(self.flags & FLAGS["shaking"])

    @property
    def friction(self) -> bool:
        """True if the method also applies to tops with dry friction."""
        return bool(self.flags & FLAGS["friction"])

    @property
    def tangents(self) -> bool:
        """True if the method can compute derivatives of the state."""
        return bool(self.flags & FLAGS["tangents"])

    @property
    def tops(self) -> str:
        """A description of the bodies to which the method can be applied."""
        lagrange = "bodies with two equal moments and the centre of mass on the third axis"
        kinds = {
            FLAGS["lagrange_only"]: lagrange,
            FLAGS["integrable"]: lagrange
            + ", Kowalewski tops, Goryachev-Chaplygin tops without vertical momentum, and any body "
            "without torque",
            FLAGS["symmetric_only"]: "bodies with two equal moments",
            FLAGS["euler_only"]: "bodies with the centre of mass at the fixed point",
        }
        return next((text for flag, text in kinds.items() if self.flags & flag), "any body")

    def applies_to(self, body: Body) -> bool:
        """Return True if the method applies to `body` for any value of gravity.

        The attribute `tops` describes the bodies to which this integration method applies.
        """
        return method_applies(self.name, validate_type("body", body, Body)._block)

    def suits(self, scene: Scene) -> bool:
        """Return True if the method applies to `scene`.

        In the absence of gravity, the motion of any body without a rotor has a closed-form
        solution. Only taylor applies to tops with damping or friction, and to supports that are
        shaken or turn about another axis than e3.
        """
        plain = validate_type("scene", scene, Scene)._has_only_gravity
        return (plain and not self.flags & _SOME) or method_suits(self.name, scene._block)


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
        return "method='geometric' needs trial runs: only kreisel.solve accepts it"
    if name in ("gsl_rk8pd", "gsl_bsimp"):
        return (
            f"the method {name!r} is not in this build: it needs the GNU Scientific Library (GPL); "
            "in the source tree, with that library installed: "
            "pip install -C cmake.define.KREISEL_GSL=ON ."
        )
    return unknown_name("method", str(name), ["auto", *methods])


methods = Methods({row["name"]: Method(**row) for row in core_methods})


TORUS_KINDS = {"kowalewski": "Kowalewski", "goryachev_chaplygin": "Goryachev-Chaplygin"}


def describe_kind_of_top(scene: Scene) -> str:
    """Return a short description of a scene: its body, damping, friction and support."""
    neighbour = scene.body._nearby_integrable_case_message
    clause = f", which is {neighbour}" if neighbour else ""
    rotor = " with a rotor" if any(scene.body.rotor) else ""
    more = list_disturbances(scene) if scene._has_disturbances else []
    extras = f" {'and' if rotor else 'with'} {' and '.join(more)}" if more else ""
    return f"this body of kind {scene.body.kind!r}{rotor}{extras}{clause}"


def has_torus_closed_form(scene: Scene) -> bool:
    """Return True for a Kowalewski or Goryachev-Chaplygin top under gravity.

    Setting up the closed-form solution of such a top takes as long as a thousand or more steps of
    the Taylor series.
    """
    # This check is part of every solve, so it calls the core directly.
    return scene.gravity != 0.0 and body_kind(scene.body._block, KIND_RTOL) in TORUS_KINDS


def _view_from_inertial_frame(scene: Scene) -> Scene:
    """Return the scene with a support at rest if its support turns about e3.

    Such a support never rules out a method or a closed form.
    """
    x, y, z = scene.turning
    return scene.replace(turning=None) if z and not x and not y else scene


def explain_no_closed_form(scene: Scene) -> str:
    """Return the reason why the motion of a scene has no closed-form solution."""
    scene = _view_from_inertial_frame(scene)
    if scene._has_disturbances and not methods[EXACT].suits(scene):
        return f"no closed form is known for {describe_kind_of_top(scene)}"
    if any(scene.body.rotor):
        return (
            f"no closed form is known for {describe_kind_of_top(scene)}: the rotor must be along "
            "the axis of a Lagrange top or of a free symmetric body"
        )
    if not methods[EXACT].applies_to(scene.body):
        return f"no closed form is known for {describe_kind_of_top(scene)} under gravity"
    if has_torus_closed_form(scene):
        top = TORUS_KINDS[body_kind(scene.body._block, KIND_RTOL)]
        refusal = torus_plan(scene._block, 0.0)[1]
        return (
            f"this motion of a {top} top has no closed form: {refusal}; "
            "kr.solve integrates it with the method 'taylor'"
        )
    return (
        "no closed form can resolve the fall of a top whose initial tilt and velocity are below "
        "1e-70"
    )


def get_method(name: object) -> Method:
    """Return the method named `name`; raise TypeError or ValueError if there is none."""
    if not isinstance(name, str):
        raise TypeError(f"method must be a name in kreisel.methods, not {short_repr(name)}")
    method = methods.get(cast(MethodName, name))
    if method is None:
        raise ValueError(unknown_method_message(name))
    return method


def _describe_applicable_tops(method: Method, scene: Scene) -> str:
    """Describe the tops to which a method applies, for use in an error message."""
    if scene._has_damping and not method.damped:
        return "tops without damping"
    if scene.friction and not method.friction:
        return "tops without friction"
    if scene._is_shaken and not method.shaking:
        return "tops whose support is not shaken"
    if any(scene.turning) and not method.turning:
        return "tops whose support does not turn, or turns about e3"
    if not any(scene.body.rotor):
        return method.tops
    if not method.rotors:
        return "bodies without rotors"
    return f"{method.tops}, and rotors along the axis of symmetry"


def resolve_method(name: object, scene: Scene) -> Method:
    """Return the method named `name` or, for 'auto', the most suitable method for the scene.

    For Kowalewski and Goryachev-Chaplygin tops, 'auto' is replaced by the Taylor series.

    Raises ValueError if no method has this name, or if the method does not apply to the scene.
    """
    if isinstance(name, str) and name == "auto":
        has_closed_form = not has_torus_closed_form(scene) and methods[EXACT].suits(scene)
        return methods[EXACT if has_closed_form else FALLBACK]
    method = get_method(name)
    if not method.suits(scene):
        scene = _view_from_inertial_frame(scene)
        has_form = method.applies_to(scene.body) or (method.exact and any(scene.body.rotor))
        if has_form and not scene._has_disturbances:
            raise ValueError(f"the method {name!r} does not apply: {explain_no_closed_form(scene)}")
        others = ", ".join(other.name for other in methods.values() if other.suits(scene))
        tops = _describe_applicable_tops(method, scene)
        raise ValueError(
            f"the method {name!r} does not apply to {describe_kind_of_top(scene)}: "
            f"it is for {tops}; these apply: {others}"
        )
    return method
