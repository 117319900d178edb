"""Enclosures of the motion of one top, and comparisons of paths with them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from threading import Lock
from typing import Any

import numpy as np
import numpy.typing as npt

from .._model.scene import Scene, validate_one_top
from .._options.options import check_resolvable_horizon, time_array
from .._utils.arguments import (
    Array,
    Numbers,
    ReadOnlyArrays,
    as_int,
    freeze_arrays,
    optional_dependency,
    short_repr,
)
from ..quaternion import conjugate, multiply

Rows = list[list[Any]]  # of balls, flint.arb
FEWEST_DIGITS, MOST_DIGITS = 15, 250
_lock = Lock()  # the precision of FLINT is common to all threads


@dataclass(frozen=True, eq=False, repr=False)
class Enclosure(ReadOnlyArrays):
    """The result of kreisel.enclose: balls that contain the exact state at n times.

    scene     the scene
    t         (n,) times [T]
    digits    decimal digits of the arithmetic
    attitude  n lists of four balls, flint.arb of python-flint, of the components (w, x, y, z)
    momentum  n lists of three balls, of the components in space [M L^2 T^-1]
    q         (n, 4) doubles nearest to the midpoints of `attitude`
    m         (n, 3) doubles nearest to the midpoints of `momentum`
    q_radius  (n, 4) bounds of the distances of `q` from the exact components
    m_radius  (n, 3) bounds of the distances of `m` from the exact components
    radius    (n,) the largest radius of the four balls of the attitude

    Arrays are read-only. The opposite of the exact unit quaternion is the same rotation.
    """

    scene: Scene
    t: Array
    digits: int
    attitude: Rows
    momentum: Rows
    q: Array
    m: Array
    q_radius: Array
    m_radius: Array
    radius: Array

    def __post_init__(self) -> None:
        freeze_arrays(tuple(vars(self).values()))

    def __repr__(self) -> str:
        radius = float(self.radius.max(initial=0.0))
        return (
            f"<kreisel.Enclosure: {len(self.t)} states, radius {radius:.1e}, {self.digits} digits>"
        )

    def compare(self, path: Any) -> Verification:
        """Compare a kreisel.Path of the same scene with the balls.

        path  the path of one top with the times of the enclosure. Digits beyond doubles count

        Raises ValueError for other times, and AttributeError if the path does not store q and m.
        """
        if not hasattr(type(path), "verify") or path.shape:
            raise TypeError(f"path must be the path of one top, not {short_repr(path)}")
        if path.scene != self.scene or not np.array_equal(path.t, self.t):
            raise ValueError("path must have the scene and the times of the enclosure")
        from flint import ctx

        words = path.q, path.q_low, path.m, path.m_low, self.attitude, self.momentum
        with _lock, ctx.workprec(_count_bits(self.digits) + 200):
            rows = [_compare_state(*state) for state in zip(*words, strict=True)]
        columns = np.array(rows, dtype=float).reshape(-1, 5).T
        return Verification(self, *columns[:4].copy(), columns[4].astype(bool))  # type: ignore[call-arg]


@dataclass(frozen=True, eq=False, repr=False)
class Verification(ReadOnlyArrays):
    """The proved errors of a path of n states, from Path.verify or Enclosure.compare, as arrays.

    enclosure        the kreisel.Enclosure of the motion
    errors           (n,) upper bounds of the angles between attitude and exact attitude [rad]
    least            (n,) lower bounds of these angles [rad]
    momentum_errors  (n,) upper bounds of the distances of the momentum from the exact one
                     [M L^2 T^-1]
    distance         (n,) distance of the attitude from the middle of the balls, in their radii
    is_contained     (n,) True if the balls contain the state, which may then be the exact one
    """

    enclosure: Enclosure
    errors: Array
    least: Array
    momentum_errors: Array
    distance: Array
    is_contained: npt.NDArray[np.bool_]

    def __post_init__(self) -> None:
        freeze_arrays(tuple(vars(self).values()))

    def __repr__(self) -> str:
        return f"<kreisel.Verification: proved to {self.error:.2g} rad>"

    @property
    def error(self) -> float:
        """The largest of `errors`: a proved bound of what path.error estimates [rad]."""
        return float(self.errors.max(initial=0.0))


def enclose(scene: Scene, t: Numbers, *, digits: int = 45) -> Enclosure:
    """Compute balls that provably contain the exact motion of one top.

    t       as in kreisel.solve: a list of times on one side of 0, or a number, which stands for 0
            and this time [T]
    digits  decimal digits of the arithmetic, 15 to 250. The radius of the balls is 10^-digits times
            a factor that grows with the time, as the motion amplifies deviations

    The exact motion is that of the numbers that the scene stores: mass, inertia, com and rotor in
    the frame of description, momentum, the attitude divided by its length, and the surroundings.
    The principal axes are exact; those of kreisel.solve have as many digits as its path. A scene
    that was given velocities has rounded their momentum. Wheels on free axles count as in
    scene.body: their moments about the axles are subtracted from the inertia, in doubles.

    The proof is in docs/theory/enclosures.md. It assumes that FLINT is correct.

    >>> import kreisel as kr
    >>> bool(kr.enclose(kr.scenes.asymmetric, [5.0, 10.0]).radius.max() < 1e-35)
    True

    Raises TypeError for many tops. Raises ValueError for dry friction, for different damping about
    axes that are not unique, and if there is no proof with so many digits. Raises ImportError if
    python-flint is not installed.
    """
    validate_one_top("scene", scene)
    times = time_array(t, None, None)
    if as_int("digits", digits, FEWEST_DIGITS) > MOST_DIGITS:
        raise ValueError(f"digits must be at most {MOST_DIGITS}, not {digits!r}")
    if scene.friction:
        raise ValueError("enclose does not support dry friction: its torque is not analytic")
    end = float(times[-1]) if times.size else 0.0
    check_resolvable_horizon(scene, end, None)
    with optional_dependency("'kreisel[proof]'"):
        from flint import ctx

        from .equations import Equations
        from .steps import GUARD, MovingSet

    bits, rows = _count_bits(digits), []
    with _lock, ctx.workprec(bits + GUARD):
        equations = Equations(scene)
        motion, unit = MovingSet(equations, equations.start, bits), Fraction(2) ** equations.time
        for time in times.tolist():
            if not motion.advance(Fraction(time) * unit):
                reached = float(motion.t / unit)
                # deviations grow exponentially at most: lost digits are proportional to the time
                more = math.ceil(1.1 * digits * end / reached) + 5 if reached else digits + 30
                advice = f"try digits={more}" if more <= MOST_DIGITS else "use shorter times"
                text = f"with digits={digits} there is no proof beyond t = {reached:.6g}"
                raise ValueError(f"{text}: {advice}")
            rows.append(equations.find_state(motion.find_box()))
        q, m = ([list(row[k]) for row in rows] for k in (0, 1))
    (q_mid, q_radius), (m_mid, m_radius) = _round_rows(q, 4), _round_rows(m, 3)
    radius = np.array([max(_round_up(x.rad()) for x in row) for row in q])
    return Enclosure(scene, times.copy(), digits, q, m, q_mid, m_mid, q_radius, m_radius, radius)


def _count_bits(digits: int) -> int:
    return math.ceil(digits * math.log2(10.0))


def _round_rows(rows: Rows, width: int) -> tuple[Array, Array]:
    """Return the doubles nearest to the midpoints of balls, and radii about them."""
    balls = [x for row in rows for x in row]
    middle = [float(x.mid()) for x in balls]
    radii = [_round_up((x - y).abs_upper()) for x, y in zip(balls, middle, strict=True)]
    return np.array(middle).reshape(-1, width), np.array(radii).reshape(-1, width)


def _round_up(x: Any) -> float:
    """Return a double that is not less than the number x >= 0."""
    return math.nextafter(float(x), math.inf) if x > 0 else 0.0


def _find_angle(p: Any, q: Any) -> Any:
    """Return a ball of the angle between the attitudes in balls of two unit quaternions."""
    from .equations import compute_length, make_vector

    sine = compute_length(make_vector(multiply(conjugate(p), q)[1:]))
    if sine < 1:
        return 2 * sine.asin()
    return 2 * sine.lower().asin().union(sine.pi() / 2) if sine.lower() < 1 else sine.pi()


def _compare_state(
    q: Array, q_low: Array, m: Array, m_low: Array, exact_q: list[Any], exact_m: list[Any]
) -> tuple[float, float, float, float, bool]:
    """Return the numbers of a Verification for one state."""
    from .equations import compute_length, make_balls, make_vector, normalize

    own, own_m = normalize(make_balls(q) + make_balls(q_low)), make_balls(m) + make_balls(m_low)
    middle = normalize(make_vector(x.mid() for x in exact_q))
    angle, width = _find_angle(own, exact_q), _find_angle(middle, exact_q).abs_upper()
    error = compute_length(own_m - make_vector(exact_m)).abs_upper()
    off = _find_angle(own, middle)
    distance = float((off / width).mid()) if width > 0 else math.inf if off > 0 else 0.0

    def is_inside(balls: list[Any], values: Any) -> bool:
        return all(ball.contains(x) for ball, x in zip(balls, values, strict=True))

    is_contained = is_inside(exact_m, own_m) and any(is_inside(exact_q, x) for x in (own, -own))
    least = max(math.nextafter(float(angle.lower()), -math.inf), 0.0)
    return _round_up(angle.abs_upper()), least, _round_up(error), distance, is_contained
