"""Scenes: a body, its environment and its start."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from inspect import signature
from typing import TYPE_CHECKING, Any, Self, Unpack

import numpy as np
from numpy.typing import ArrayLike

from .._core import scene, scene_horizon
from .._utils.arguments import Array, Quaternion, Vector, make_frozen_class_decorator, validate_type
from .._utils.files import atomic_write
from .._utils.name_hints import (
    HintingType,
    NoKeywords,
    has_unknown_keywords,
    refuse_unknown_keywords,
)
from .body import Body
from .ensemble import Ensemble as Ensemble
from .ensemble import SceneConstructors, SceneKwargs, VaryKwargs
from .parameters import ENVIRONMENT
from .toml import (
    MAKERS,
    build_body_from_table,
    call_constructor_with_table,
    format_toml_entries,
    parse_toml_tables,
    parse_toml_text_or_file,
    require_toml_table,
)
from .vary import scatter, vary

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


@make_frozen_class_decorator("scene.replace({}=...) returns a new scene")
@dataclass(frozen=True, init=False)
class Scene(SceneConstructors, metaclass=HintingType):
    """A rigid body in its environment, and its state at t = 0.

    momentum  angular momentum about the fixed point, in space [M L^2 T^-1]. Alternatively, exactly
              one of: velocity (angular velocity in space [rad/T]), or body_momentum, body_velocity
              (components in the frame in which the body is described)
    attitude  unit quaternion (w, x, y, z), scalar first, from the frame of the body into space, or
              a single scipy Rotation. Alternatively, attitude_xyzw, scalar last
    gravity   acceleration along -e3, of either sign [L T^-2]; required unless the centre of mass is
              exactly at the fixed point
    damping   linear drag [M L^2 T^-1], one number for each principal axis or one for all: the
              torque about an axis is -damping times the angular velocity about it. kr.fit
              estimates one number or three, as given
    turning   constant angular velocity of the support, as of a turntable, along e1, e2, e3 [rad/T].
              The axes e1, e2, e3 turn with the support, and attitudes and velocities are relative
              to it. Momenta are those in the inertial frame, with components along these axes
    shaking   (amplitude [L], rate [rad/T], phase [rad]): the fixed point moves along e3 by
              amplitude * cos(rate * t + phase), and t = 0 is the start of the scene
    friction  dry friction [M L^2 T^-2]: a torque of this size about the apex, against the spin

    A scene always stores momentum and attitude, whichever parameters were passed to the
    constructor. For a needle-like body, rounding the momentum changes the axial angular velocity by
    a relative amount of about I1 / I3 times the unit roundoff.

    Raises TypeError for arguments that are not numbers. Raises ValueError for values that are not
    finite or have the wrong shape, and for attitudes that are not unit quaternions. The squared
    norm of a quaternion may differ from 1 by at most 1e-12. A single-precision quaternion is
    normalized in double precision.
    """

    body: Body
    momentum: Vector
    attitude: Quaternion
    gravity: float
    damping: Vector
    turning: Vector
    shaking: Vector
    friction: float
    _has_common_damping: bool = field(init=False, repr=False, compare=False)
    # bytes of a kr_scene: body, gravity, t, q, m, damping, turning, shaking, friction
    _block: bytes = field(init=False, repr=False, compare=False)

    @has_unknown_keywords("Scene")
    def __init__(
        self,
        body: Body,
        momentum: ArrayLike | None = None,
        attitude: ArrayLike | Rotation | None = None,
        gravity: float | None = None,
        *,
        velocity: ArrayLike | None = None,
        body_momentum: ArrayLike | None = None,
        body_velocity: ArrayLike | None = None,
        attitude_xyzw: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        turning: ArrayLike | None = None,
        shaking: ArrayLike | None = None,
        friction: float | None = None,
        **unknown: Unpack[NoKeywords],
    ) -> None:
        if unknown:
            refuse_unknown_keywords(Scene.__init__, unknown)
        if not isinstance(body, Body):
            validate_type("body", body, Body)
        numbers = None
        if attitude_xyzw is None and "_block" in body.__dict__:
            starts = momentum, velocity, body_momentum, body_velocity
            around = gravity, damping, turning, shaking, friction
            numbers = scene(body._block, starts, attitude, around)
        if numbers is None:
            numbers = Ensemble(
                body,
                momentum,
                attitude,
                gravity,
                velocity=velocity,
                body_momentum=body_momentum,
                body_velocity=body_velocity,
                attitude_xyzw=attitude_xyzw,
                damping=damping,
                turning=turning,
                shaking=shaking,
                friction=friction,
            )._get_numbers_of_one()
        self._store_numbers(body, numbers, damping)

    def _store_numbers(self, body: Body, numbers: tuple[Any, ...], damping: object) -> None:
        """Store the numbers of a scene, as scene() of the core returns them."""
        fields = self.__dict__
        fields["body"] = body
        m, q, g, d, u, s, f, block = numbers
        fields["momentum"], fields["attitude"], fields["gravity"], fields["damping"] = m, q, g, d
        fields["turning"], fields["shaking"], fields["friction"], fields["_block"] = u, s, f, block
        fields["_has_common_damping"] = damping is None or np.ndim(damping) == 0 or not any(d)  # type: ignore[arg-type]

    @classmethod
    def _from_numbers(cls, body: Body, numbers: tuple[Any, ...], damping: object) -> Self:
        made = cls.__new__(cls)
        made._store_numbers(body, numbers, damping)
        return made

    @classmethod
    def _from_tops(cls, tops: Ensemble, damping: object) -> Self:
        numbers = tops._get_numbers_of_one()
        return cls._from_numbers(tops.body, numbers, damping)

    def __repr__(self) -> str:
        """Return the constructor call as text, omitting a support at rest and zero friction."""
        words: dict[str, object] = dict(self._list_constructor_arguments())
        if self._optional_gravity is None:
            del words["gravity"]
        for name in ("turning", "shaking"):
            if not any(getattr(self, name)):
                del words[name]
        if not self.friction:
            del words["friction"]
        return f"Scene({', '.join([f'{name}={value!r}' for name, value in words.items()])})"

    def _list_constructor_arguments(self) -> SceneKwargs:
        """Return constructor arguments that reproduce the scene."""
        return {
            "body": self.body,
            "momentum": self.momentum,
            "attitude": self.attitude,
            "gravity": self._optional_gravity,
            "damping": self._damping_argument,
            "turning": self.turning,
            "shaking": self.shaking,
            "friction": self.friction,
        }

    @property
    def _damping_argument(self) -> float | Vector:
        """The damping as one number if it was given as one, which kr.fit keeps as one."""
        is_one = self._has_common_damping and self._has_damping
        return self.damping[0] if is_one else self.damping

    @property
    def _optional_gravity(self) -> float | None:
        """The gravity, or None if a top without weight need not have been given any."""
        return self.gravity if self.gravity or any(self.body.com) else None

    @property
    def _has_damping(self) -> bool:
        return any(self.damping)

    @property
    def _is_shaken(self) -> bool:
        return self.shaking[0] != 0.0

    @cached_property
    def _has_disturbances(self) -> bool:
        """True if the top has damping, friction, or a moving support."""
        return self._is_losing_energy or self._is_shaken or any(self.turning)

    @property
    def _has_only_gravity(self) -> bool:
        """True if the body has no rotor, and only gravity acts."""
        return not self._has_disturbances and not any(self.body.rotor)

    @property
    def _is_losing_energy(self) -> bool:
        return any(self.damping) or self.friction > 0.0

    @cached_property
    def _rotation_rate(self) -> float:
        """Estimated rate of motion [T^-1], from momentum, torque and the motion of the support."""
        largest, momentum = max(self.body.moments), math.hypot(*self.momentum)
        amplitude, rate, _ = self.shaking
        weight = self.body.mass * (abs(self.gravity) + abs(amplitude) * rate * rate)
        torque = weight * math.hypot(*self.body.com)
        moving = momentum + math.hypot(*self.body.rotor)
        bound = max(moving / largest, math.sqrt(torque / largest))
        return float(max(bound + math.hypot(*self.turning), rate if amplitude else 0.0))

    @cached_property
    def _resolvable_horizon(self) -> float:
        """The time [T] beyond which double precision cannot resolve the attitude."""
        return scene_horizon(self._block)

    @cached_property
    def _start_state(self) -> Array:
        """The state (t, q, m) at t = 0, as an array of shape (1, 8)."""
        return np.array([(0.0, *self.attitude, *self.momentum)])

    @property
    def attitude_xyzw(self) -> Quaternion:
        """The attitude as a quaternion (x, y, z, w), scalar last."""
        w, x, y, z = self.attitude
        return x, y, z, w

    def replace(self, **changes: Unpack[SceneKwargs]) -> Self:
        """Return a copy of the scene with some constructor parameters changed."""
        words: dict[str, object] = dict(self._list_constructor_arguments())
        if changes.keys() & {"velocity", "body_momentum", "body_velocity"}:
            del words["momentum"]
        if "attitude_xyzw" in changes:
            del words["attitude"]
        make: Callable[..., Self] = type(self)  # the constructor validates the parameters
        return make(**{**words, **changes})

    def vary(self, **words: Unpack[VaryKwargs]) -> Ensemble:
        """Return an ensemble of this scene in which the given parameters vary.

        Parameters are broadcast as in kr.Ensemble. They may be the parameters of

        - Scene: gravity, damping, turning, shaking, friction, body, attitude
          or attitude_xyzw, and one of momentum, velocity, body_momentum, body_velocity. If none of
          these four is given, the ensemble keeps the space-frame momentum of this scene.

        - Body: mass, inertia, com, rotor. Every top keeps the attitude and the space-frame momentum
          of this scene.

        - Scene.spinning: spin, tilt, precession, steady, fast. The body need not be symmetric
          unless steady=True. Omitted values are taken from the scene, as are the other Euler angles
          and rates; but steady=True sets the nutation rate to zero.

        - Scene.from_euler: angles, rates. An omitted argument is taken from the scene.

        With degrees=True, all given angles and rates are in degrees, also turning and the rate and
        phase of shaking. If the only parameter that varies along a dimension is a scalar and varies
        along no other dimension, the dimension is named after it; see tops.axes and tops.coords.

        >>> import kreisel as kr, numpy as np
        >>> top = kr.scenes.sleeping
        >>> tops = top.vary(spin=np.linspace(0, 20, 5)[:, None], tilt=np.linspace(0, 1, 3))
        >>> tops.shape, tops.axes
        ((5, 3), ('spin', 'tilt'))
        """
        return vary(self, words)

    def scatter(
        self,
        n: int,
        *,
        seed: int = 0,
        momentum: ArrayLike | None = None,
        attitude: ArrayLike | None = None,
        gravity: float | None = None,
    ) -> Ensemble:
        """Return an ensemble of `n` copies of this scene with normally distributed perturbations.

        momentum  standard deviation of the momentum in space [M L^2 T^-1]: one number for all
                  components, or 3
        attitude  standard deviation of a rotation vector in the frame of the body [rad]: one number
                  for all components, or 3. The body is rotated by this vector before the attitude
                  of the scene is applied; the momentum in space stays the same
        gravity   standard deviation of gravity [L T^-2]

        Member i depends only on `seed` and i, not on `n`. Changing the standard deviation of one
        parameter does not change the random perturbations of the others.

        >>> import kreisel as kr
        >>> tops = kr.scenes.thesis.scatter(1000, seed=7, attitude=0.01)
        >>> tops[3] == kr.scenes.thesis.scatter(10, seed=7, attitude=0.01)[3]
        True
        """
        return scatter(self, n, seed, momentum, attitude, gravity)

    @classmethod
    def from_toml(cls, source: str | os.PathLike[str]) -> Scene:
        r"""Read a scene from a TOML file, or from TOML text.

        A str of several lines is parsed as TOML text; any other argument is a file name. The
        top-level keys are the parameters of Scene, and the keys of the table [body] are those of
        Body. Instead of the momentum and the attitude, the text may contain a table [from_euler] or
        [spinning] with the parameters of the constructor of that name; those from gravity to
        friction may also be top-level keys. Instead of the keys of Body, a table such as
        [body.cuboid] may give the parameters of the constructor of that name. Raises ValueError for
        unknown keys.

        >>> import kreisel as kr
        >>> text = "momentum = [0, 0, 3]\ngravity = 9.81\n[body.cone]\nradius = 1\nheight = 2\n"
        >>> kr.Scene.from_toml(text + "pivot = [0, 0, 0]\nmass = 1").body.com
        (0.0, 0.0, 1.5)
        """
        return parse_toml_text_or_file(source, parse_scene_toml)

    def to_toml(self, path: str | os.PathLike[str] | None = None) -> str:
        """Return the scene as TOML text; if `path` is given, also write the text to this file.

        Passing this text to Scene.from_toml gives an equal scene.
        """
        body = self.body
        start: dict[str, object] = {"momentum": self.momentum, "attitude": self.attitude}
        start |= {} if self._optional_gravity is None else {"gravity": self.gravity}
        if self._has_damping:
            start["damping"] = self._damping_argument
        start |= {"turning": self.turning} if any(self.turning) else {}
        start |= {"shaking": self.shaking} if any(self.shaking) else {}
        start |= {"friction": self.friction} if self.friction else {}
        text = format_toml_entries(start) + "\n[body]\n"
        words: dict[str, object] = {"mass": body.mass, "inertia": body.inertia, "com": body.com}
        words |= {"inertia_rtol": body.inertia_rtol} if body.inertia_rtol else {}
        words |= {"rotor": body.rotor} if any(body.rotor) else {}
        text += format_toml_entries(words | ({"unphysical": True} if body.unphysical else {}))
        if path is not None:
            atomic_write(path, text.encode())
        return text


Ensemble._one = Scene

_WORDS = [word for word in signature(Scene).parameters if word != "body"]
_SCENE_MAKERS: dict[str, Callable[..., Scene]] = {
    "from_euler": Scene.from_euler,
    "spinning": Scene.spinning,
}
_ABOVE = {word: "above [body]" for word in [*_WORDS, *_SCENE_MAKERS]}
_BELOW = {word: "below [body]" for word in [*signature(Body).parameters, *MAKERS]}


def list_scene_file_keys() -> dict[str, list[str]]:
    """List the keys of each table of a scene file; those of the file itself are under ''."""
    makers: dict[str, Callable[..., object]] = {"": Scene}
    makers |= {f"[{name}]": make for name, make in _SCENE_MAKERS.items()} | {"[body]": Body}
    makers |= {f"[body.{name}]": make for name, make in MAKERS.items()}
    return {
        table: [key for key in signature(make).parameters if key != "body"]
        for table, make in makers.items()
    }


def parse_scene_toml(text: str) -> Scene:
    """Return the scene described by a TOML text."""
    return build_scene_from_table(parse_toml_tables(text))


def build_scene_from_table(table: dict[str, object]) -> Scene:
    """Build the scene described by a TOML table. The key "body" is removed from the table."""
    if "body" not in table:
        raise ValueError("the table [body] is missing")
    body = build_body_from_table(table.pop("body"), _ABOVE)
    names = [name for name in _SCENE_MAKERS if name in table]
    if not names:
        return call_constructor_with_table(
            partial(Scene, body), "a scene", table, _BELOW, _SCENE_MAKERS
        )
    name, *others = [*names, *(word for word in table if word not in names)]
    make = partial(_SCENE_MAKERS[name], body)
    words = dict(require_toml_table(name, table[name]))
    for word in others:
        if word in words:
            raise ValueError(f"{word} is given twice: above [body] and in [{name}]")
        if word in ENVIRONMENT:
            words[word] = table[word]
        elif word in signature(make).parameters:
            raise ValueError(f"{word} belongs in [{name}]")
        else:
            raise ValueError(f"a scene must be described in one way, not by {', '.join(table)}")
    return call_constructor_with_table(make, f"[{name}]", words, _BELOW)
