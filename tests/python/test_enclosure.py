"""Tests of proved enclosures against exact rational arithmetic, other digits and closed forms.

The rational truth is a Taylor series with exact coefficients, whose last orders are far below the
radii to which it is compared. The inequalities of _proof/steps.py are checked again by fractions.
"""

import math
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
import truth
from kreisel.quaternion import conjugate, multiply

flint = pytest.importorskip("flint")
from kreisel._proof import steps  # noqa: E402, which needs flint
from kreisel._proof.equations import Equations  # noqa: E402

OBLIQUE = ((2.0, 0.25, 0.125), (0.25, 1.5, -0.25), (0.125, -0.25, 1.0))
MOVED = {"turning": (0.25, 0, 0.5), "damping": 0.5, "shaking": (0.5, 1, 0)}
CERTIFIED = (  # rows of the table of true states
    *("no axial momentum, t = 7", "kowalewski 4", "goryachev_chaplygin 5"),
    *("tensor, damping and shaking, t = 2.5", "gradient, tensor, turning, t = 1.5"),
)
UPWARDS = kr.events.plane((0, 1, 0), of="body_vertical", direction=1)
UPRIGHT = {"attitude": (1, 0, 0, 0), "momentum": (0, 0, 0)}
PARTS = {  # what a body and its scene have
    "heavy": ({}, {}),
    "free": ({"com": (0, 0, 0)}, {}),
    "slender": ({"inertia": (1, 1.001, 1 / 256), "com": (0, 1 / 256, 0.5)}, {}),
    "rotor": ({"rotor": (0.5, -1, 2)}, {"damping": (0.25, 0.5, 0.125)}),
    "shaking": ({"rotor": (0, 0, 1)}, {"shaking": (0.25, 2, 0)}),
    "upright": ({"inertia": (1, 1, 2), "com": (0, 0, 1.5)}, {"shaking": (0.375, 2, 0), **UPRIGHT}),
    "gradient": ({"inertia": OBLIQUE}, {"gradient": 0.75, "turning": (0, 0.5, 0)}),
    "all": ({"inertia": OBLIQUE, "rotor": (0.5, 0, 1)}, MOVED),
}


def make_scene(name):
    body, around = PARTS[name]
    words = {"inertia": (1, 1.5, 2), "com": (0.25, -0.5, 0.125), "unphysical": True, **body}
    start = {"momentum": (0.5, -0.25, 1), "attitude": (0.5, 0.5, -0.5, 0.5)}
    return kr.Scene(kr.Body(1.25, **words), **{**start, **around}, gravity=1.5)


def exact(values):
    return np.vectorize(Fraction, otypes=[object])(values)


def cross(a, b):
    return np.roll(a, -1) * np.roll(b, -2) - np.roll(a, -2) * np.roll(b, -1)


def turn(q, v):
    return np.array(multiply(multiply(tuple(q), (0, *v)), conjugate(q))[1:])


class Motion:
    """The equations of y = (W, q, P, O, c, s) in the frame of description, in fractions."""

    def __init__(self, scene):
        body, self.scene = scene.body, scene
        self.J, self.rotor = exact(body._tensors), exact(body.rotor)
        rows = np.array([cross(self.J[i - 2], self.J[i - 1]) for i in range(3)])
        self.inverse = rows / (self.J[0] @ rows[0])
        self.drag, self.lever = exact(scene.damping), exact(body.com) * Fraction(body.mass)
        self.gravity, self.gradient = Fraction(scene.gravity), Fraction(scene.gradient)
        amplitude, self.rate, phase = map(Fraction, scene.shaking)
        assert phase == 0 and (len({*scene.damping}) == 1 or body.axes == (1, 0, 0, 0))
        self.push = -amplitude * self.rate**2
        q = exact(scene.attitude)
        m, p, o = (turn(conjugate(q), exact(v)) for v in (scene.momentum, (0, 0, 1), scene.turning))
        self.start = np.array([*self.inverse @ (m - self.rotor), *q, *p, *o, *exact([1, 0])])

    def __call__(self, y):
        w, q, p, o, (c, s) = y[:3], y[3:7], y[7:10], y[10:13], y[13:]
        u = w - o
        pull = self.lever * (self.gravity + self.push * c) + self.gradient * (self.J @ p)
        torque = cross(self.J @ w + self.rotor, w) + cross(p, pull) - self.drag * u
        spin = np.array(multiply(q, (0, *u))) / 2
        parts = self.inverse @ torque, spin, cross(p, u), cross(o, w)
        return np.concatenate([*parts, [-self.rate * s, self.rate * c]])


def expand(f, rows):
    """Return the last order of f(y), a polynomial of degree two, for the coefficients of y."""
    k = len(rows) - 1

    def even(y):
        return (f(y) + f(-y)) / 2

    total = (f(rows[k]) - f(-rows[k])) / 2
    for j in range((k + 1) // 2):
        total = total + even(rows[j] + rows[k - j]) - even(rows[j]) - even(rows[k - j])
    return total if k % 2 else total + even(rows[k // 2])


def flow(f, y, h, order):
    """Return the state after the time h, from Taylor coefficients rounded to 200 bits."""
    rows = [y]
    for k in range(order):
        scaled = expand(f, rows) * (h * 2**200) / (k + 1)
        rows.append(exact([Fraction(round(x), 2**200) for x in scaled]))
    return sum(rows)


def as_fraction(x):
    mantissa, power = map(int, x.man_exp())
    return mantissa * Fraction(2) ** power


def contains(balls, values):
    pairs = zip(balls, values, strict=True)
    return all(abs(as_fraction(b.mid()) - x) <= as_fraction(b.rad()) for b, x in pairs)


@pytest.mark.parametrize("name", PARTS)
def test_balls_contain_the_rational_motion(name):
    scene = make_scene(name)
    f, end = Motion(scene), {"slender": 4e-4, "all": -0.05, "shaking": -0.05}.get(name, 0.05)
    found = kr.enclose(scene, end, digits=25)
    for k, y in enumerate((f.start, flow(f, f.start, Fraction(end), 24))):
        assert contains(found.attitude[k], y[3:7])
        assert contains(found.momentum[k], turn(y[3:7], f.J @ y[:3] + f.rotor))
    assert found.radius.max() < 1e-23


def test_digits_give_nested_balls():
    """Digits beyond 160 need care, because the squares of the radii underflow."""
    scene = kr.Scene(kr.Body(1, (1, 2, 2), (0, 0.5, 0.25)), (0.5, -0.25, 1), gravity=1.5)
    found = [kr.enclose(scene, [0.1, 0.2], digits=digits) for digits in (15, 45, 200, 230)]
    for wide, narrow in pairwise(found):
        pairs = zip(wide.attitude + wide.momentum, narrow.attitude + narrow.momentum, strict=True)
        assert all(all(a.contains(b) for a, b in zip(*rows, strict=True)) for rows in pairs)
        assert (narrow.radius < 1e-25 * wide.radius).all()
    assert (found[0].q_radius >= abs(found[0].q - found[2].q)).all()
    assert (found[0].m_radius >= abs(found[0].m - found[2].m)).all()


TRUTHS = [row for row in truth.ROWS if row["name"] in CERTIFIED]


@pytest.mark.parametrize("row", TRUTHS, ids=lambda row: row["name"])
def test_balls_certify_the_table_of_true_states(row):
    found = kr.enclose(truth.make_scene(row), [row["t"]])
    pairs = zip(found.attitude[0] + found.momentum[0], row["q"] + row["m"], strict=True)
    for ball, text in pairs:
        last = Fraction(10) ** Decimal(text).as_tuple().exponent
        assert abs(as_fraction(ball.mid()) - Fraction(text)) <= as_fraction(ball.rad()) + last


TURN = 0.5, 0.1, 0.7, 0.5  # turns (0, 0, 1) to (0.8, 0.6, 0)
GYROSCOPE = kr.Body(1, (1, 2, 2.5), (0.1, 0, 0.3))
FAMILIES = {name: make_scene(name) for name in ("free", "rotor", "shaking", "all")} | {
    "needle": kr.Scene(
        kr.Body(1, (1, 1 + 1e-7, 1e-6), (0, 0, 0.1)).turn(TURN), (0.6, -0.8, 1), gravity=1
    ),
    "alike": kr.Scene(
        kr.Body(1, (1, 1 + 1e-13, 1), (0.1, 0.2, 0.3)).turn(TURN), (1, 0, 1), gravity=1
    ),
    "wheel": kr.Scene(
        GYROSCOPE.with_wheel(inertia=0.25, axis=(0, 0, 1), rate=9), (0, 0, 1), gravity=1
    ),
    "satellite": kr.scenes.satellite,
    "units": kr.Scene(
        kr.Body(1e30, (1e30, 2e30, 2e30), (0.25, 0, 0.5)), (3e29, 0, 1e29), gravity=1
    ),
}


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("name", FAMILIES)
def test_paths_of_thirty_digits_are_contained(name, sign):
    scene = FAMILIES[name]
    path = kr.solve(scene, sign * np.array([0.0, 2.0, 6.0]) / scene._rotation_rate, digits=30)
    proof = path.verify(20)
    assert proof.is_contained.all() and (proof.distance < 1.0).all()
    assert path.verify().error < path.error


@pytest.mark.parametrize("name", ["kowalewski", "thesis", "dzhanibekov"])
def test_errors_of_closed_forms_are_proved(name):
    path = kr.solve(kr.scenes.get_scene(name), [1.0, 5.0], "exact")
    proof = path.verify(30)
    assert proof.error == pytest.approx(path.error, rel=1e-3)
    assert proof.least.max() == pytest.approx(path.error, rel=1e-3)
    assert not proof.is_contained.any()


# The inequalities (1) to (5) of a step


def length(values):  # a fraction just below the Euclidean length
    return Fraction(math.isqrt(int(sum(x * x for x in np.ravel(values)) * 4**300)), 2**300)


@pytest.mark.parametrize(
    ("name", "size", "step"), [("free", 1e-6, Fraction(5, 16)), ("upright", 0.0, Fraction(5, 4))]
)
def test_a_step_satisfies_its_inequalities(name, size, step, monkeypatch):
    """Check a set, and a point with few orders of V whose motion becomes less stable."""
    monkeypatch.setattr(steps, "ORDER_OF_DERIVATIVE", 16 if size else 10)
    orthogonalize = np.linalg.qr
    monkeypatch.setattr(np.linalg, "qr", lambda x: (orthogonalize(x)[0] * (1 + 1e-12),))
    scene = make_scene(name)
    motion = Motion(scene)
    with flint.ctx.workprec(60):
        equations = Equations(scene)
        moving = steps.MovingSet(equations, equations.start, 50)
        moving.r[:] = size
        proof = moving.prove_step(moving.compute_series(), step)
    n, d = len(proof.p.values) - 1, len(moving.mid)
    keep = [*range(min(d, 10)), *((13, 14) if name == "upright" else ())]
    rate = Fraction(2) ** equations.time
    unit = exact([*(rate * Fraction(x) for x in equations.units), *[1] * (d - 3)])

    def f(y):
        whole = exact(np.zeros(15))
        whole[keep] = y * unit
        return motion(whole)[keep] * (step / rate) / unit

    def differentiate(y):
        return np.array([(f(y + e) - f(y - e)) / 2 for e in exact(np.eye(d))]).T

    orders = [[int(x[k]) for x in proof.p.coefficients] for k in range(n + 1)]
    p, mid = exact(orders) / 2**moving.scale, exact(proof.mid) / Fraction(2) ** moving.scale
    end = sum(p)
    growth, rest, error = map(Fraction, (proof.growth, proof.rest, proof.error))
    g = sum(growth**k / math.factorial(k) for k in range(30))  # just below e^growth
    r, rng = exact(moving.r), np.random.default_rng(1)
    assert contains(equations.start, motion.start[keep] / unit)

    # (1) and (3)
    total = 0
    for k in range(2 * n + 1):
        change = p[k + 1] * (k + 1) if k < n else 0
        defect = length(change - expand(f, [*p, *[0 * end] * n][: k + 1]))
        assert defect <= Fraction(proof.p.defect[k])
        total += defect / (k + 1)
    assert rest >= g * total and g * length(r) + rest < steps.TUBE

    # (2), at points of the tube about the end
    for signs in rng.choice([-1.0, 1.0], size=(4, d)):
        A = differentiate(end + exact(signs) * Fraction(steps.TUBE) / 4)
        assert np.linalg.eigvalsh((A + A.T).astype(float) / 2)[-1] < proof.growth

    # (2), by elements
    constant = differentiate(0 * end)
    B = np.array([differentiate(e) - constant for e in exact(np.eye(d))])
    reach = sum(abs(x) for x in p[1:]) + Fraction(steps.TUBE)
    spread = np.tensordot(reach, abs(B), 1)
    N, change = differentiate(p[0]), (spread + spread.T) / 2
    N = np.where(np.eye(d) > 0, N, abs(N + N.T) / 2) + change
    assert np.linalg.eigvalsh(N.astype(float))[-1] < proof.growth * (1 + 1e-9)

    # (4), for the first order of the remainder, and for the motion from a corner
    V, Q = exact(proof.V.sum(axis=0)), exact(proof.Q)
    orders = [exact(x) for x in proof.V]
    A = [
        differentiate(p[0]),
        *(differentiate(x) - differentiate(0 * x) for x in p[1 : len(orders)]),
    ]
    first = sum(A[j] @ V_k for j, V_k in enumerate(orders[::-1]))
    sup = length(sum(abs(x) for x in orders))
    assert error >= g * (length(first) / len(orders) + length(B) * (g * length(r) + rest) * sup)
    s = exact(rng.choice([-1.0, 1.0], size=d)) * r
    image = flow(f, p[0] + s, Fraction(1), 26) if size else end
    assert length(image - end - V @ s) <= error * length(s) + rest

    # (5)
    assert (mid == end).all()
    bound = abs(Q.T @ V) @ r + error * length(r) + rest
    drift = length(Q.T @ Q - exact(np.eye(d)))
    assert (exact(proof.r) >= bound + 2 * drift * length(bound)).all()


def test_a_set_that_may_leave_the_tube_is_refused():
    with flint.ctx.workprec(60):
        equations = Equations(make_scene("heavy"))
        moving = steps.MovingSet(equations, equations.start, 50)
        moving.r[:] = 1e-3
        assert moving.prove_step(moving.compute_series(), Fraction(1, 8)) is None


def test_the_map_of_the_proof_of_chaos_is_that_of_sections():
    file = Path(__file__).parents[2] / "docs/examples/chaos/horseshoe.py"
    own = {}
    with flint.ctx.workprec(53):
        exec(file.read_text().partition("\norbit, times")[0], own)
        p, d, period = own["p"], 1e-10, own["period"]
        box = [x + flint.arb(0, d) for x in p]
        z, slope, side = own["pass_surface"](box, 1, period)
        assert side == 1 and all(a.contains(b) for a, b in zip(z, p, strict=True))

        def find_passage(change):
            scene = own["make_scene"](own["find_states"](p + np.array(change), 1))
            states = kr.section(scene, UPWARDS, n=1, tol=1e-15)
            return np.array([states.body_vertical[0, 0], states.body_velocity[0, 1]])

        for k, change in enumerate(1e-5 * np.eye(2)):
            column = (find_passage(change) - find_passage(-change)) / 2e-5
            for i in range(2):
                assert abs(float(slope[i, k].mid()) - column[i]) < float(slope[i, k].rad()) + 1e-7
                assert float(slope[i, k].rad()) < 1e-2
