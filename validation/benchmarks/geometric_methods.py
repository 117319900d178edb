"""Benchmarks of the geometric methods, with the required bound of each result.

    python -m validation.benchmarks.geometric_methods [section ...] [--full]

Without --full, the timing has fewer rounds, and the error guarantee of kr.solve(...,
method="geometric") is checked on only 20 scenes.
"""

import argparse
import json
from dataclasses import dataclass
from datetime import date
from functools import partial
from itertools import pairwise

import heyoka as hy
import kreisel as kr
import numpy as np

from ..competitors import compiled_core, timing
from ..parts.published import load_problems as literature
from ..references import equations, orders
from ..references.problems import PROBLEMS, attitude_error, load_problem, problem_of_scene
from . import error_contract

PUBLISHED = json.loads(PROBLEMS.read_text())["published"]
EPS = np.finfo(float).eps
failed = []


@dataclass(frozen=True)
class Extent:
    """The extent of a benchmark: the rounds of timing, and the scenes for the error guarantee."""

    rounds: int
    scenes: int


BRIEF, FULL = Extent(10, 20), Extent(40, 200)


def print_bound(what, value, must, stretch=None, most=True):
    def is_within(bound):
        return bound is not None and (value <= bound if most else value >= bound)

    side = "at most" if most else "at least"
    verdict = "PASS" if is_within(must) else "MISSED"
    verdict += ", stretch" if is_within(stretch) else ""
    beyond = "" if stretch is None else f" ({stretch:g})"
    print(f"  {what:68} {value:10.3g}   {side} {f'{must:g}{beyond}':10} {verdict}", flush=True)
    if not is_within(must):
        failed.append(what)


def load_literature_top(name):
    """Return a published top in its principal axes."""
    (top,) = (top for top in literature() if top.name == name)
    return problem_of_scene(name, top.scene)


def order(extent):
    """Compare the observed orders in q and m with the nominal order, for tops that start tilted."""
    for name, method in kr.methods.items():
        bodies = [
            body
            for body in ("lagrange", "kowalewski", "asymmetric")
            if method.applies_to(orders.BODIES[body])
        ]
        if method.adaptive or not bodies:
            continue
        slopes = [slope for body in bodies for slope in orders.measure_order(name, body).values()]
        off = max(np.inf if slope is None else abs(slope - method.order) for slope in slopes)
        print_bound(f"{name}, order {method.order}, on {', '.join(bodies)}", off, 0.2)


def integrals(extent):
    """Check the invariants of bobenko_suris4 over 1e6 steps, and its energy up to t = 1e6."""
    scene = kr.scenes.thesis.replace(attitude=orders.TILT)
    for step in (0.2, 0.1, 0.05):
        path = kr.solve(scene, 1e6 * step, method="bobenko_suris4", step=step, every=1000)
        constants = {
            "modified energy": path.modified_energy4(step),
            "<m,a>": path.axial_momentum,
            "<m,e3>": path.vertical_momentum,
        }
        for what, values in constants.items():
            print_bound(
                f"{what}, step {step}, 1e6 steps: range / largest",
                np.ptp(values) / np.abs(values).max(),
                1e-12,
            )
    path = kr.solve(scene, 1e6, method="bobenko_suris4", step=0.1, every=97)
    means = [part.mean() for part in np.array_split(path.energy - path.energy[0], 100)]
    (slope, _), covariance = np.polyfit(np.arange(100), means, 1, cov=True)
    print_bound(
        "energy to t = 1e6: |slope| / its standard error", abs(slope) / covariance[0, 0] ** 0.5, 3.0
    )


def accuracy(extent):
    """Compare the errors of bobenko_suris4 and bobenko_suris at t = 100, with the same step."""
    scene = kr.scenes.thesis
    truth = kr.solve(scene, 100, method="exact").q[-1]
    for step, bound in ((1 / 5, 140.0), (1 / 20, 1e3), (1 / 160, 1e5)):
        errors = [
            kr.attitude_error(kr.solve(scene, 100, method=name, step=step).q[-1], truth)
            for name in ("bobenko_suris", "bobenko_suris4")
        ]
        print_bound(
            f"error of bobenko_suris over bobenko_suris4, step {step:g}",
            errors[0] / errors[1],
            bound,
            most=False,
        )


class HeyokaCall:
    """A run of heyoka on a top at a given tolerance, which counts its steps."""

    def __init__(self, problem, end, tol=EPS):
        system, self.start = equations.build_system(problem)
        self.top, self.end = hy.taylor_adaptive(system, self.start, tol=tol), end

    def __call__(self):
        self.top.time = 0.0
        self.top.state[:] = self.start
        self.steps = self.top.propagate_until(self.end)[3]
        return self.top.state[:4]


def time_rounds(rounds, *calls):
    about = [min(timing.time_once(call) for _ in range(3)) for call in calls]
    return timing.time_in_turn(calls, about, rounds)[0]


def time_ratio(one, two):
    """Return the ratio of the shortest times. Other load on the machine can only add time."""
    return min(one) / min(two)


def cost(extent):
    """Compare the time of a step with the time of heyoka's step at tol = eps, on the same top."""
    bounds = {
        "bobenko_suris": (25, 35),
        "bobenko_suris2": (25, 35),
        "bobenko_suris4": (20, 27),
        "takahashi_imada4": (20, 27),
    }
    for name, wanted in (("thesis", bounds), ("asymmetric", {"strang": (12, 14)})):
        problem, steps = load_problem(name), 20000
        scene, peer = problem.to_scene(), HeyokaCall(problem, 100.0)
        runs = [partial(kr.solve, scene, 0.05 * steps, method, step=0.05) for method in wanted]
        times, *others = time_rounds(extent.rounds, peer, *runs)
        print(f"  heyoka's step on {name}: {1e9 * min(times) / peer.steps:.0f} ns")
        for (method, (bound, stretch)), own in zip(wanted.items(), others, strict=True):
            part = time_ratio([t / peer.steps for t in times], [t / steps for t in own])
            step = f"{1e9 * min(own) / steps:.1f} ns"
            print_bound(f"heyoka's step / {method}'s ({step})", part, bound, stretch, most=False)
        if name == "thesis":
            print_bound(
                "bobenko_suris4's step / bobenko_suris'", time_ratio(others[2], others[0]), 1.4
            )


def energy_drift(scene, end, method, step):
    path = kr.solve(scene, end, method=method, step=step, every=1)
    return np.abs(path.energy / path.energy[0] - 1.0).max()


def gni(extent):
    """Compare the energy errors of suzuki4 with a published table."""
    scene = load_literature_top("gni_asymmetric_heavy_top").to_scene()
    table = PUBLISHED["gni_asymmetric_heavy_top"]["table"]
    steps = [float(h) for h in table if h != "what"]
    for step in steps:
        error = energy_drift(scene, 1000, "suzuki4", step)
        off = abs(error / table[f"{step:g}"] - 1)
        print_bound(f"suzuki4, h = {step:g}: max|dH|/H {error:.4g}, relative difference", off, 0.03)
    errors = [energy_drift(scene, 1000, "kahan_li8", step) for step in steps]
    said = (f"{step:g}: {error:.2g}" for step, error in zip(steps, errors, strict=True))
    print("  kahan_li8:", ", ".join(said))
    rise = max(b / a for a, b in pairwise(errors))
    print_bound("kahan_li8: error over that of twice the step, the largest", rise, 1.0)


def simo_wong(extent):
    """Compare energy errors with those published by Simo and Wong, at the same step."""
    scene = load_literature_top("simo_wong_fast_top").to_scene()
    step = np.radians(26) / 50.0
    errors = {
        name: energy_drift(scene, 10, name, step)
        for name, method in kr.methods.items()
        if not method.adaptive and method.order > 1 and method.applies_to(scene.body)
    }
    print("  all:", ", ".join(f"{name} {error:.2g}" for name, error in errors.items()))
    for order, bound in ((2, 1e-9), (4, 1e-13), (6, 1e-13), (8, 1e-13)):
        names = sorted((name for name in errors if kr.methods[name].order == order), key=errors.get)
        within = ", ".join(name for name in names if errors[name] <= bound)
        print_bound(
            f"order {order} at 26 degrees a step, max|dH|/H, {names[0]}", errors[names[0]], bound
        )
        print(f"    within: {within}")


def bruels(extent):
    """Compare the cheapest geometric run with heyoka, for an attitude error of 1e-13 at t = 2."""
    problem = load_literature_top("bruels_cardona_heavy_top")
    scene, truth = problem.to_scene(), PUBLISHED[problem.name]["reference"]["2"]["q"]
    runs = []
    for name in ("takahashi_imada4", "blanes_moan6", "kahan_li6", "kahan_li8"):
        for n in np.unique(np.round(2.0 ** np.arange(6, 13, 0.0625))):
            error = attitude_error(kr.solve(scene, 2.0, name, step=2 / n).q[-1], truth)
            if error <= 1e-13:
                runs.append((n, name, error))
                break
    peers = [
        tol
        for tol in 10.0 ** np.arange(-16, -11, 0.25)
        if attitude_error(HeyokaCall(problem, 2.0, tol)(), truth) <= 1e-13
    ]
    peer = HeyokaCall(problem, 2.0, max(peers, default=EPS))
    print(f"  heyoka at tol {peer.top.tol:.2g}: error {attitude_error(peer(), truth):.2g}")
    end = np.array([2.0])  # no Python overhead is included, as for heyoka
    calls = [
        compiled_core.make_recording_call(compiled_core.scene_bytes(scene), name, end, step=2 / n)
        for n, name, _ in runs
    ]
    times, *own = time_rounds(extent.rounds, peer, *calls)
    for (n, name, error), seconds in zip(runs, own, strict=True):
        speed = f"{1e6 * min(seconds):.0f} us, {time_ratio(times, seconds):.2f} of heyoka's speed"
        print(f"  {name}, {n:.0f} steps: error {error:.1g}, {speed}")
    best = max(time_ratio(times, seconds) for seconds in own)
    print_bound("heyoka's time / the best's at an error of 1e-13", best, 3.5, most=False)


def contract(extent):
    """Check `error=` on random scenes, with the current date as seed."""
    scenes = extent.scenes
    kept, needless, price = error_contract.judge_scenes(
        scenes, seed=int(date.today().strftime("%y%m%d"))
    )
    print_bound(
        f"{scenes} scenes: per cent with an error of at most the target",
        100 * kept,
        100,
        most=False,
    )
    print_bound(f"{scenes} scenes: per cent refused needlessly", 100 * needless, 3)
    print_bound(f"{scenes} scenes: price of the run, median, in cheapest runs", price, 3)


SECTIONS = {
    f.__name__: f for f in (order, accuracy, integrals, cost, gni, simo_wong, bruels, contract)
}


def main(argv=None):
    failed.clear()
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.geometric_methods",
        description=__doc__.splitlines()[0],
    )
    parser.add_argument(
        "sections",
        nargs="*",
        metavar="section",
        help=", ".join(SECTIONS) + " (default: all)",
    )
    parser.add_argument("--full", action="store_true", help="40 rounds of timing, 200 scenes")
    options = parser.parse_args(argv)
    for name in options.sections or SECTIONS:
        print(f"{name}: {' '.join(SECTIONS[name].__doc__.split())}")
        SECTIONS[name](FULL if options.full else BRIEF)
    print(f"{len(failed)} missed" + "".join(f"; {what}" for what in failed))
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
