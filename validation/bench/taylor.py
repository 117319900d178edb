"""The Taylor method against heyoka in its best setting: python -m validation.bench.taylor [ratios long digits dense]

Everything runs in one process, in turn; times are medians, errors are of the attitude at the end, against the series of 30
digits (checked against heyoka in 128 bit first). `must` and `stretch` are what was promised. heyoka: seven equations, not
compact, its loosest tolerance from which on every tighter one keeps the error; ours by the same rule.
"""

import argparse
import functools
from statistics import median

import heyoka as hy
import kreisel as kr
import numpy as np
from kreisel import _core as core

from ..peers import measure
from ..truth import equations
from ..truth import reference as truth
from ..truth.problems import load

SCENES = ("thesis", "kowalewski", "asymmetric", "fast", "strong_gravity")
TARGETS = ((1e-3, 2, 3), (1e-6, 2.2, 4), (1e-9, 2.2, 4), (0, 4.5, 7))  # error; must, stretch
EPS = np.finfo(float).eps
TOLERANCES = 10.0 ** np.arange(-2, -15.6, -0.25)


def horizon(name, target):
    return 30.0 if name == "asymmetric" and target < 1e-7 else 100.0


@functools.cache
def reference(name, t):
    return kr.solve(load(name).scene(), t, digits=30)


def error(name, t, q):
    """Of an attitude in doubles, or doubles and what they leave out."""
    true = reference(name, t)
    high, low = (q, np.zeros(4)) if len(q) == 4 else (q[:4], q[4:])
    want, rest = true.q[-1], true.q_low[-1]
    sign = -1.0 if high @ want < 0.0 else 1.0
    d = (sign * want - high) + (sign * rest - low)
    vec = high[0] * d[1:] - d[0] * high[1:] - np.cross(high[1:], d[1:])
    return float(2 * np.arctan2(np.linalg.norm(vec), abs(high @ want)))


def ours(name, t, tol=0.0, digits=0, method="taylor"):
    """A call that solves, and what it returns: the attitude at the end and what that leaves out."""
    scene, times = (
        load(name).scene()._block,
        np.array([t]),
    )  # as the core takes it, made beforehand as heyoka's

    def run():
        status, states, low, *_ = core.record(scene, method, 0.0, tol, digits, 0, False, times)
        assert status == "OK", (name, method, tol, status)
        return states[-1, 1:5] if low is None else np.concatenate((states[-1, 1:5], low[-1, 1:5]))

    return run


def heyoka(name, t, tol):
    system, start = equations.system(load(name))
    top = hy.taylor_adaptive(system, start, tol=tol)

    def run():
        top.time = 0.0
        top.state[:] = start
        top.propagate_until(t)
        return top.state[:4]

    return run


def real128(name, t, tol):
    system, start = equations.system(load(name), hy.real128)
    top = hy.taylor_adaptive(system, start, tol=hy.real128(tol), fp_type=hy.real128)

    def run():
        top.time = hy.real128(0)
        top.state[:] = start
        top.propagate_until(hy.real128(t))
        with truth.mp.workdps(truth.DIGITS):
            q = [truth.mp.mpf(str(x)) for x in top.state[:4]]
            high = [float(x) for x in q]
            return np.array(high + [float(x - y) for x, y in zip(q, high)])

    return run


def medians(calls, rounds=41):
    """Median seconds of the first call, interleaved, and of each other by the median of its ratio to the first."""
    about = [min(measure.once(call) for _ in range(2)) for call in calls]
    (first, *others), _ = measure.interleaved(calls, about, rounds)
    return [
        median(first),
        *(median(first) * median(b / a for a, b in zip(first, other)) for other in others),
    ]


@functools.cache
def ladder(make, name, t, tightest, **how):
    """Runs from loose to tight, each with the largest error of it and all tighter ones."""
    runs = [make(name, t, tol, **how) for tol in (*TOLERANCES, tightest)]
    errors = [error(name, t, run()) for run in runs]
    return list(zip(runs, np.maximum.accumulate(errors[::-1])[::-1]))


def reaching(make, name, t, target, tightest, **how):
    """The loosest run that stays within the target, or the tightest."""
    steps = ladder(make, name, t, tightest, **how)
    return next((step for step in steps if step[1] <= target), steps[-1])


def line(what, value, must, stretch, rest=""):
    grade = "stretch" if value >= stretch else "must" if value >= must else "MISSED"
    print(
        f"{what:46} {value:9.3g}  must {must:g} stretch {stretch:g}: {grade:8} {rest}", flush=True
    )


def at_equal_error(name, t, target):
    """Ours and heyoka's run, and their errors. At the tightest: heyoka's best, and ours about as good."""
    peer, f = reaching(heyoka, name, t, target, EPS)
    own, e = reaching(ours, name, t, target or 1.5 * f, 2.0**-53)
    return own, peer, e, f


def ratios():
    for name in SCENES:
        for target, must, stretch in TARGETS:
            t = horizon(name, target)
            if name == "asymmetric" and target == 1e-6:
                must, stretch = 5, 7
            own, peer, e, f = at_equal_error(name, t, target)
            a, b = medians([own, peer])
            at = f"{target:.0e}" if target else "tightest"
            line(
                f"{name} {at} heyoka/ours",
                b / a,
                must,
                stretch,
                f"{b * 1e6:.1f} / {a * 1e6:.1f} us, errors {f:.0e} / {e:.0e}",
            )
    if "gsl_rk8pd" in kr.methods:
        against_gsl()


def gsl(name, t, tol):
    return ours(name, t, tol, method="gsl_rk8pd")


def against_gsl():
    for name in SCENES:
        for target in (1e-3, 1e-6, 1e-9):
            t = horizon(name, target)
            (own, _), (peer, f) = (
                reaching(ours, name, t, target, 2.0**-53),
                reaching(gsl, name, t, target, 1e-15),
            )
            a, b = medians([own, peer], 9)
            line(
                f"{name} {target:.0e} gsl_rk8pd/ours",
                b / a,
                3,
                5,
                f"{b * 1e6:.0f} / {a * 1e6:.1f} us, its error {f:.0e}",
            )


def long():
    for name in ("thesis", "asymmetric_regular"):
        own, peer = ours(name, 1e5, digits=20), heyoka(name, 1e5, EPS)
        e, f = error(name, 1e5, own()), error(name, 1e5, peer())
        a, b = medians([own, peer], 3)
        line(f"{name} to 1e5, 20 digits: error heyoka/ours", f / e, 1e3, 1e3, f"{f:.1e} / {e:.1e}")
        line(
            f"{name} to 1e5, 20 digits: time heyoka/ours",
            b / a,
            1,
            1,
            f"{b * 1e3:.0f} / {a * 1e3:.0f} ms",
        )


def digits():
    for name in ("thesis", "kowalewski", "asymmetric"):
        t = 30.0 if name == "asymmetric" else 100.0
        own, best = ours(name, t, digits=30), real128(name, t, "1e-33")
        e = error(name, t, best())
        tries = [
            (tol, real128(name, t, tol)) for tol in ("1e-28", "1e-29", "1e-30", "1e-31", "1e-32")
        ]
        parts = [(tol, peer, truth_error(best(), peer())) for tol, peer in tries]
        tol, peer, f = next((p for p in parts if p[2] <= e), parts[-1])
        a, b, c = medians([own, peer, best], 3)
        line(
            f"{name} 30 digits: real128/ours, equal error",
            b / a,
            100,
            200,
            f"{b * 1e3:.0f} / {a * 1e3:.2f} ms, errors {f:.0e} (tol {tol}) / {e:.0e} against real128 at 1e-33, {c * 1e3:.0f} ms",
        )


def truth_error(want, q):
    """The angle between two attitudes of doubles and what they leave out, of any size."""
    with truth.mp.workdps(truth.DIGITS):
        return truth.angle(
            *(
                [truth.mp.mpf(x) + truth.mp.mpf(y) for x, y in zip(a[:4].tolist(), a[4:].tolist())]
                for a in (want, q)
            )
        )


def dense():
    for name in ("thesis", "asymmetric"):
        times = np.linspace(0.0, 100.0, 20001)
        block = load(name).scene()._block
        system, start = equations.system(load(name))
        top = hy.taylor_adaptive(system, start, tol=EPS)

        def grid(of):
            top.time = 0.0
            top.state[:] = start
            top.propagate_grid(of)

        few = times[[0, -1]]
        a, b, c, d = medians(
            [
                lambda: core.record(block, "taylor", 0.0, 0.0, 0, 0, False, few),
                lambda: grid(few),
                lambda: core.record(block, "taylor", 0.0, 0.0, 0, 0, False, times),
                lambda: grid(times),
            ],
            9,
        )
        own, peer = (c - a) / len(times), (d - b) / len(times)
        line(
            f"{name} dense output, per state: heyoka/ours",
            peer / own,
            1,
            3,
            f"{peer * 1e9:.0f} / {own * 1e9:.0f} ns",
        )


def main():
    known = {f.__name__: f for f in (ratios, long, digits, dense)}
    parser = argparse.ArgumentParser(prog="python -m validation.bench.taylor", description=__doc__)
    parser.add_argument("what", nargs="*", choices=[*known, []], help="which figures; else all")
    for name in parser.parse_args().what or known:
        known[name]()


if __name__ == "__main__":
    main()
