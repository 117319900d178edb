"""Reference solutions by heyoka in 128-bit arithmetic.

The solutions for the scenes of the report are stored in reference.jsonl by the command `python -m
validation.references.reference`.

Each solution is computed three times: from two forms of the equations in 128-bit arithmetic, and
from one of them in 80-bit arithmetic. The differences between these three solutions indicate the
accuracy of the reference solution. The conditioning is the change in attitude caused by perturbing
each parameter and initial value by one double-precision rounding error. In double precision, the
error of any method is expected to be at least as large as the effect of rounding its input.
"""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import heyoka as hy
import kreisel as kr
import mpmath as mp
import numpy as np

from . import equations, radau
from .problems import HORIZONS, SHORT, attitude_error, attitude_errors, load_problem
from .quadrature import Euler, Lagrange, rotate

FILE = Path(__file__).with_suffix(".jsonl")
DIGITS = 40
TOLERANCES = {hy.real128: "1e-33", np.longdouble: "1e-20", float: "1e-17"}
# The second precision, to check the reference solutions.
FINER = np.longdouble if np.finfo(np.longdouble).eps < 1e-18 else hy.real128
# Sizes of perturbations, in rounding errors. Each precision must resolve their effect.
NUDGES = {FINER: 8, float: 2**20}
ROUNDING = 2.0**-53
# Number of times at which the conditioning is evaluated. Errors made at any time may grow.
LOOKS = 16
FEW = 4  # number of times for the conditioning if each reference state is expensive
LONG = 600.0  # runs over larger angles take more than a second in 128-bit arithmetic [rad]


@cache
def build_integrator(fp, coefficients):
    """Compile a heyoka integrator that can be used for all tops."""
    return hy.taylor_adaptive(
        equations.build_general_system(fp, coefficients),
        np.zeros(7, dtype=fp),
        pars=np.zeros(coefficients, dtype=fp),
        tol=fp(TOLERANCES[fp]),
        fp_type=fp,
        compact_mode=True,
    )


def attitude_and_momentum(problem, form, t, q, s):
    """Convert the variables of the integrator to the attitude and the body-frame momentum."""
    if form == "velocity":
        return q + [x * mp.mpf(J) for x, J in zip(s, problem.inertia, strict=True)]
    if form == "momentum":
        return q + s
    equal, _, odd = (mp.mpf(x) for x in problem.inertia)
    angle = t * s[2] * equal * (1 / odd - 1 / equal)
    half, m = [mp.cos(angle / 2), 0, 0, mp.sin(angle / 2)], [x * equal for x in s]
    c, d = mp.cos(angle), mp.sin(angle)
    turned_m = [c * m[0] + d * m[1], c * m[1] - d * m[0], m[2]]
    return equations.product(q, half) + turned_m


def equivalent_sphere(problem):
    """Return the spherical top whose axis moves like the axis of a Lagrange top."""
    return replace(problem, inertia=problem.inertia[:1] * 3)


def integrate_states(problem, times, form="velocity", fp=hy.real128):
    """Return the attitude and the body momentum at `times` in multiprecision."""
    own, moment, rate = problem.scale_to_internal_units()
    model = equivalent_sphere(own) if form == "symmetric" else own
    variables = "velocity" if form == "symmetric" else form
    coefficients = equations.round_to(equations.compute_coefficients(model, variables), fp)
    top = build_integrator(fp, len(coefficients))
    top.pars[:] = coefficients
    top.state[:] = equations.round_to(equations.start_state(model, variables), fp)
    top.time, states = fp(0), []
    for t in times:
        outcome = top.propagate_until(fp(t) * fp(rate))[0]
        if outcome != hy.taylor_outcome.time_limit:
            raise ArithmeticError(f"heyoka stopped on {problem.name} before t = {t}: {outcome}")
        with mp.workdps(DIGITS):
            state = [mp.mpf(str(x)) for x in top.state]
            variables_at_t = attitude_and_momentum(
                own, form, mp.mpf(t) * rate, state[:4], state[4:]
            )
            q, m = variables_at_t[:4], variables_at_t[4:]
            norm = mp.sqrt(sum(x * x for x in q))
            states.append([x / norm for x in q] + [x * moment * rate for x in m])
    return states


def rotation_angle(p, q):
    """Return the angle [rad] between two attitudes in multiprecision."""
    with mp.workdps(DIGITS):
        turn = equations.product([p[0]] + [-x for x in p[1:4]], list(q[:4]))
        return float(2 * mp.atan2(mp.sqrt(sum(x * x for x in turn[1:])), abs(turn[0])))


def compute_energy(problem, state):
    w, x, y, z = state[:4]
    up = [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]
    kinetic = sum(m * m / mp.mpf(J) for m, J in zip(state[4:], problem.inertia, strict=True)) / 2
    return kinetic + sum(u * mp.mpf(c) for u, c in zip(up, problem.lever, strict=True))


def energy_error(problem, state):
    with mp.workdps(DIGITS):
        start = equations.start_state(problem, "momentum")
        return abs(float(1 - compute_energy(problem, state) / compute_energy(problem, start)))


def perturb_data(problem, nudge):
    """Yield copies of a top, each with one number changed by `nudge` roundings of a double."""
    with mp.workdps(DIGITS):
        more = 1 + mp.mpf(nudge * ROUNDING)
        for word in ("momentum", "inertia", "lever"):
            numbers = getattr(problem, word)
            for i in range(3):
                both = word == "inertia" and problem.symmetric and i < 2
                values = tuple(
                    x * more if j == i or (both and j < 2) else x for j, x in enumerate(numbers)
                )
                if numbers[i] and not (both and i):
                    yield replace(problem, **{word: values})
        attitude = [mp.mpf(x) for x in problem.attitude]
        for i in range(3):
            little = [mp.mpf(1)] + [mp.mpf(nudge * ROUNDING / 2 * (j == i)) for j in range(3)]
            yield replace(problem, attitude=tuple(equations.product(attitude, little)))


def conditioning_by_tangents(problem, times):
    """Return the attitude change [rad] due to rounding the input, computed from derivatives."""
    scene = problem.to_scene()
    path = kr.solve(scene, times, tangents=("start", "moments", "com"))
    turns = path.tangents[:, :3]
    body = scene.body
    data = np.concatenate([np.ones(3), scene.momentum, body.moments, body.principal_com])
    changes = turns * data
    if problem.symmetric:  # keeps the moments equal
        changes[:, :, 6] += changes[:, :, 7]
        changes[:, :, 7] = 0.0
    return (np.linalg.norm(changes, axis=1).sum(axis=1) * ROUNDING).tolist()


def compute_truth(problem, end):
    """Return the reference solution of a scene of any kind, in 80 bits if the run is long."""
    if problem.is_damped:
        return truth_of_damped(problem, end)
    form = "symmetric" if problem.symmetric else "velocity"
    fast = equivalent_sphere(problem).rate if problem.symmetric else problem.rate
    brief = fast * end < LONG
    (finer,) = integrate_states(problem, [end], form, FINER)
    state = integrate_states(problem, [end], form)[0] if brief else finer
    again = finer if brief else integrate_states(problem, [end], form, float)[0]
    conditioning = conditioning_by_tangents(problem, np.linspace(0, end, LOOKS + 1)[1:])
    attitude, bits = [mp.nstr(x, 34) for x in state[:4]], 128 if brief else 80
    return describe_truth(attitude, rotation_angle(state, again), bits, conditioning)


def truth_of_damped(problem, end):
    """Return the reference solution of a damped top, computed by collocation."""
    (q,), _ = radau.integrate(problem, [end])
    (again,), _ = radau.integrate(problem, [end], radau.FINER_TOL)
    conditioning = conditioning_by_differences(problem, np.linspace(0, end, FEW + 1)[1:])
    attitude = [np.format_float_scientific(x, precision=21, unique=False) for x in q]
    return describe_truth(attitude, attitude_error(q, again), 64, conditioning)


def conditioning_by_differences(problem, times):
    """Return the attitude change [rad] due to rounding the input, by finite differences."""
    original = replace(problem, user=None)
    nudge = NUDGES[float]

    def attitudes(top):
        data = {"inertia", "lever", "attitude", "momentum"}
        doubles = {word: tuple(map(float, getattr(top, word))) for word in data}
        path = kr.solve(replace(top, **doubles).to_scene(), times, digits=20)
        return np.array(path.q, np.longdouble) + path.q_low

    truth = attitudes(original)
    errors = [
        attitude_errors(attitudes(neighbour), truth) for neighbour in perturb_data(original, nudge)
    ]
    return (np.sum(errors, axis=0) / nudge).tolist()


def truth_by_quadrature(problem, end):
    """Return the reference solution of a Lagrange top or a free rigid body at any time."""

    def state(top, t):
        start = equations.start_state(top, "momentum")
        with mp.workdps(DIGITS):
            q, m = start[:4], rotate(start[:4], start[4:])
        if top.symmetric:
            return Lagrange(top.inertia[0], top.inertia[2], top.lever[2], q, m)(t)[0]
        return Euler(top.inertia, q, m)(t)[0]

    own, _, rate = problem.scale_to_internal_units()
    times = [rate * end * (i + 1) / FEW for i in range(FEW)]
    attitudes = [state(own, t) for t in times]
    neighbours = [
        [state(neighbour, t) for t in times] for neighbour in perturb_data(own, NUDGES[FINER])
    ]
    angles = [
        sum(rotation_angle(q, neighbour[i]) for neighbour in neighbours) / NUDGES[FINER]
        for i, q in enumerate(attitudes)
    ]
    attitude = [mp.nstr(x, 34) for x in attitudes[-1]]
    return describe_truth(attitude, None, int(DIGITS * 3.32), angles)


def describe_truth(attitude, agreement, bits, conditioning):
    angles = {"conditioning": conditioning[-1], "worst": max(conditioning)}
    return {"attitude": attitude, "agreement": agreement, "bits": bits} | angles


def compare_computations(problem, end, entry):
    """Yield the name of each independent computation and its deviation [rad] from the reference."""
    with mp.workdps(DIGITS):
        true = [mp.mpf(x) for x in entry["attitude"]]
    forms = {
        "128 bit, momentum": ("momentum", hy.real128),
        **({"128 bit, spin apart": ("symmetric", hy.real128)} if problem.symmetric else {}),
        "80 bit": ("velocity", FINER),
    }
    for name, form in forms.items():
        (state,) = integrate_states(problem, [end], *form)
        yield f"heyoka, {name}", rotation_angle(true, state)
    scene = problem.to_scene()
    for name, method in kr.methods.items():
        many = method.digits
        if (many or method.exact) and method.suits(scene):
            path = kr.solve(scene, [end], name, **({"digits": 30} if many else {}))
            q = problem.to_principal_axes(path.q[-1])
            low = problem.to_principal_axes(path.q_low[-1]) if many else np.zeros(4)
            with mp.workdps(DIGITS):
                sums = [mp.mpf(x) + mp.mpf(y) for x, y in zip(q, low, strict=True)]
                yield f"{name}, 30 digits" if many else name, rotation_angle(true, sums)


def compute_entries(problem, times):
    """Yield reference solutions at several times, together with estimates of their accuracy."""
    states, again = integrate_states(problem, times), integrate_states(problem, times, "momentum")
    conditioning = conditioning_by_tangents(problem, times)
    for t, state, other, condition in zip(times, states, again, conditioning, strict=True):
        yield {
            "scene": problem.name,
            "t": t,
            "attitude": [mp.nstr(x, 34) for x in state[:4]],
            "body_momentum": [mp.nstr(x, 34) for x in state[4:]],
            "agreement": rotation_angle(state, other),
            "energy_error": energy_error(problem, state),
            "conditioning": condition,
        }


@cache
def load_truths():
    """Load the stored reference solutions, by scene and time."""
    _, *rows = map(json.loads, FILE.read_text().splitlines())
    return {(row["scene"], row["t"]): row for row in rows}


def truth_of(problem, end):
    """Load the reference solution of a scene of the report, or compute that of another one."""
    stored = None if problem.user else load_truths().get((problem.name, end))
    return stored or compute_truth(problem, end)


def main():
    """Compute and store the reference solutions of the scenes of the report."""
    header = {
        "command": "python -m validation.references.reference",
        "by": f"heyoka {hy.__version__}, real128, tolerance {TOLERANCES[hy.real128]}",
        "attitude": "principal axes -> space, scalar first",
        "body_momentum": "along the principal axes",
        "agreement": "angle [rad] to the same run on equations for the momentum",
        "energy_error": "relative, at this time",
        "conditioning": "angle [rad] by which roundings (2^-53) of all the data move it",
    }
    rows = [
        row
        for name, end in HORIZONS.items()
        for row in compute_entries(load_problem(name), [SHORT, end])
    ]
    FILE.write_text("".join(json.dumps(row) + "\n" for row in (header, *rows)))


if __name__ == "__main__":
    main()
