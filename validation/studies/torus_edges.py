"""Errors of closed forms for Kowalewski and Goryachev-Chaplygin tops near degenerate motions.

    python -m validation.studies.torus_edges [kowalewski|goryachev_chaplygin] [--random 3]

Each family of motions depends on a parameter eps, and the motion for eps = 0 is degenerate. For
each eps, the largest error at five times up to 1000 / max(1, rate) is printed, where rate bounds
the initial angular velocity. The reference solutions are computed by the Taylor method in 30-digit
arithmetic. The letter c precedes the error estimate of the closed form (its certificate). If the
error exceeds 3e-14, the effect of one rounding error in the initial state is also printed. An
exclamation mark is printed if this effect of rounding is less than a tenth of the observed error.
If the closed form is rejected, the reason is printed.
"""

import argparse
from collections.abc import Callable
from typing import NamedTuple

import kreisel as kr
import numpy as np

from .torus_accuracy import condition, differ, solve_with_30_digits

DISTANCES = (1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13, 1e-15, 1e-17, 0.0)
TIMES = np.array([0.5, 7.7, 50.0, 300.0, 1000.0])
MOMENTS = {"kowalewski": (2.0, 2.0, 1.0), "goryachev_chaplygin": (1.0, 1.0, 0.25)}
SIDES = {"kowalewski": -1.0, "goryachev_chaplygin": 1.0}  # direction of the centre of mass


class Family(NamedTuple):
    """A family of tops that depends on eps and six random numbers."""

    name: str
    make: Callable


def turn_upwards(up):
    """Return an attitude in which the direction `up`, given in the body frame, is vertical."""
    x, y, z = up
    q = np.array([1.0 + z, y, -x, 0.0] if z > -0.9 else [y, 1.0 - z, 0.0, x])
    return q / np.linalg.norm(q)


def make_scene(kind, velocity, up):
    """Return a scene with the given angular velocity and vertical in the body frame."""
    up = np.array(up, float) / np.linalg.norm(up)
    moments, velocity = np.array(MOMENTS[kind]), np.array(velocity, float)
    momentum = moments * velocity
    if kind == "goryachev_chaplygin":
        momentum -= (momentum @ up) * up
    body = kr.Body(1.0, tuple(moments), (SIDES[kind], 0.0, 0.0), unphysical=True)
    attitude = turn_upwards(up)
    start = kr.Scene(body, attitude=tuple(attitude), body_momentum=tuple(momentum), gravity=1.0)
    if kind == "goryachev_chaplygin":
        x, y, _ = start.momentum
        start = start.replace(momentum=(x, y, 0.0))
    return start


def see_from_body(scene):
    """Return the angular momentum and the vertical in the body frame."""
    w, x, y, z = scene.attitude
    up = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    rows = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            up,
        ]
    )
    return np.array(scene.momentum) @ rows, up


def constants(scene):
    """Return the values of Kowalewski's constants h, l and k for a scene."""
    momentum, (g1, g2, _) = see_from_body(scene)
    p, q, r = momentum / np.array(MOMENTS["kowalewski"])
    h = p * p + q * q + r * r / 2 - g1
    return h, scene.momentum[2], abs((p + 1j * q) ** 2 + g1 + 1j * g2)


def discriminant(h, vertical, c):
    """Return the discriminant of (w + h)(w^2 + c) - vertical^2 / 2."""
    b, d, e = h, c, h * c - vertical * vertical / 2
    return 18 * b * d * e - 4 * b**3 * e + b * b * d * d - 4 * d**3 - 27 * e * e


def find_size(value, velocity, up, kind):
    """Return a factor for `velocity` at which `value` is zero, or None if none is found."""
    sizes = np.linspace(0.1, 2.5, 25)
    values = [value(make_scene(kind, x * velocity, up)) for x in sizes]
    for i in range(len(sizes) - 1):
        if values[i] * values[i + 1] < 0.0:
            low, high = sizes[i], sizes[i + 1]
            for _ in range(60):
                middle = 0.5 * (low + high)
                if value(make_scene(kind, middle * velocity, up)) * values[i] > 0.0:
                    low = middle
                else:
                    high = middle
            return low
    return None


def scale_to(kind, value, name):
    """Return a family of random initial states for which the function `value` vanishes at eps = 0.

    For nonzero eps, the velocity at which `value` vanishes is multiplied by 1 + eps.
    """

    def make(eps, numbers):
        rng = np.random.default_rng(abs(int(1e9 * numbers[0])))
        for _ in range(1000):
            velocity, up = rng.normal(size=3), rng.normal(size=3)
            size = find_size(value, velocity, up, kind)
            if size is not None:
                return make_scene(kind, size * (1.0 + eps) * velocity, up)
        raise ArithmeticError(f"no start with {name}")

    return Family(name, make)


def value_at_minus_k(scene):
    """Return phi(-k) / 2, where phi is Kowalewski's cubic polynomial."""
    h, vertical, k = constants(scene)
    return h - k - vertical * vertical / 2


def discriminant_of_phi(scene):
    """Return the discriminant of Kowalewski's cubic polynomial phi."""
    h, vertical, k = constants(scene)
    return discriminant(h, vertical, 1 - k * k)


def separatrix(scene):
    """Return a number that vanishes on the separatrix of a Goryachev-Chaplygin top."""
    L, up = see_from_body(scene)
    transverse = L[0] ** 2 + L[1] ** 2
    H = (transverse + 4 * L[2] ** 2) / 2 + up[0]
    G = abs(L[2] * transverse - L[0] * up[2])
    return H - 1 - 6 * (G / 8) ** (2 / 3)


def near(kind, velocity, up):
    """Return a family of initial states with random deviations of size eps from a given one."""

    def make(eps, v):
        return make_scene(
            kind, np.array(velocity) + eps * v[:3], np.array(up) + eps * np.array([0.0, *v[3:5]])
        )

    return make


def across_momentum(eps, v):
    """Return a Kowalewski top whose vertical momentum is eps."""
    up = v[3:] / np.linalg.norm(v[3:])
    momentum = np.array(MOMENTS["kowalewski"]) * v[:3]
    momentum += (eps - momentum @ up) * up
    scene = make_scene("kowalewski", momentum / np.array(MOMENTS["kowalewski"]), up)
    x, y, _ = scene.momentum
    return scene.replace(momentum=(x, y, eps))


def level_momentum(eps, v):
    """Return a Goryachev-Chaplygin top whose integral G is of order eps."""
    return make_scene("goryachev_chaplygin", [eps * v[0], 1.2, eps * v[1]], [0.3, eps * v[2], 0.9])


def families_of_both(kind):
    one, other = np.cos(1.0), np.sin(1.0)
    up = SIDES[kind]
    return [
        Family("rest upright", near(kind, [0, 0, 0], [up, 0, 0])),
        Family("rest hanging", near(kind, [0, 0, 0], [-up, 0, 0])),
        Family("swinging about axis 3", near(kind, [0, 0, 1.1], [one, other, 0])),
        Family("circling about axis 3", near(kind, [0, 0, 4.1], [one, other, 0])),
        Family("swinging about axis 2", near(kind, [0, 0.7, 0], [one, 0, other])),
        Family("circling about axis 2", near(kind, [0, 2.6, 0], [one, 0, other])),
        Family("let go across axis 2", near(kind, [0, 0, 0], [one, 0, other])),
        Family("fast, rate 1/eps", lambda e, v: make_scene(kind, v[:3] / max(e, 1e-19), v[3:])),
    ]


def families_of_kowalewski():
    kind = "kowalewski"
    lean = np.array([-0.7, 0, np.sqrt(1 - 0.7**2)])
    delone = [0.4, 0.5, 0.8]  # angular velocity of a motion with k = 0

    def near_delone(e, _):
        g1, g2 = 0.09 + e, -0.4
        return make_scene(kind, delone, [g1, g2, np.sqrt(1 - g1 * g1 - g2 * g2)])

    return [
        Family("turning about the com, upright", near(kind, [-1.3, 0, 0], [-1, 0, 0])),
        Family("turning about the com, fast", near(kind, [-2.6, 0, 0], [-1, 0, 0])),
        Family("turning about the com, hanging", near(kind, [1.3, 0, 0], [1, 0, 0])),
        Family("permanent rotation", near(kind, lean / np.sqrt(0.7), lean)),
        Family("k = eps", near_delone),
        Family("l = eps", across_momentum),
        scale_to(kind, value_at_minus_k, "phi(-k) = 0"),
        scale_to(kind, discriminant_of_phi, "double root of phi"),
    ]


def families(kind):
    """Return all families of degenerate motions for one kind of top."""
    if kind == "kowalewski":
        return [*families_of_both(kind), *families_of_kowalewski()]
    return [
        *families_of_both(kind),
        Family("G = eps", level_momentum),
        scale_to(kind, separatrix, "separatrix"),
    ]


def entry_of(scene, rng):
    """Format the results for one scene."""
    try:
        top = kr.exact(scene)
    except ValueError as error:
        words = str(error).split(": ")
        return words[1][:24] if len(words) > 1 else words[0][-24:]
    m, moments = np.linalg.norm(scene.momentum), np.array(scene.body.inertia)
    times = TIMES / max(1.0, m / moments.min())
    scale = float(np.sqrt(2.0 * moments.max() * (m * m / (2 * moments.min()) + 2.0)))
    error = differ(top(times), solve_with_30_digits(scene, times), scale)
    text = f"{error:.0e}"
    if error > 3e-14:
        worst = max(condition(scene, t, rng, scale, solve_with_30_digits) for t in times)
        text += f" ({worst:.0e})" if error <= 10 * worst else f" !{worst:.0e}"
    return f"{text} c{top.certificate:.0e}"


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.studies.torus_edges", description=__doc__.split("\n")[0]
    )
    parser.add_argument("kind", nargs="?", choices=list(MOMENTS))
    parser.add_argument("--random", type=int, default=1)
    parser.add_argument("--seed", type=int, default=8)
    options = parser.parse_args(argv)
    rng = np.random.default_rng(options.seed)
    for kind in [options.kind] if options.kind else MOMENTS:
        print(kind)
        for family in families(kind):
            for _ in range(options.random):
                numbers = rng.normal(size=6)
                print(f"  {family.name}")
                for eps in DISTANCES:
                    print(f"    {eps:7.0e} {entry_of(family.make(eps, numbers), rng)}", flush=True)


if __name__ == "__main__":
    main()
