"""Calls for one top in Python, compared with heyoka's integrator.

    python -m validation.benchmarks.call_speed [SCENE ...]

kreisel is called in two ways: kr.solve with a scene, and run.reset and run.to with a kr.Run that is
used again. heyoka's integrator is compiled once and used again, as its fastest form. All calls
alternate in one process. Times are those of the processor, which other programs hardly disturb. A
ratio is the time of heyoka divided by the time of kreisel: the median of the rounds, and the ratio
of the least times. Both programs have their loosest tolerance at
which, and below which, all runs meet the error. A target of 0 means heyoka's smallest error.

The compilation is paid after the number of runs in which heyoka gains the time of its compilation.
The share of the peak that the kernels reach is printed by validation.studies.taylor_kernel_study.
"""

import argparse
import time
from statistics import median

import heyoka as hy
import kreisel as kr

from ..competitors import machine, timing
from ..references import equations
from ..references.problems import load_problem
from . import taylor_speed

ENDS = {  # scene: end of the run [T]
    "thesis": 100.0,
    "kowalewski": 100.0,
    "goryachev_chaplygin": 30.0,
    "asymmetric": 30.0,
    "fast": 10.0,
}
TARGETS = (1e-3, 1e-6, 1e-9, 0.0)  # attitude errors at the end [rad]
ROUNDS = 61
SAMPLE = 2e-3  # duration of the calls of one round [s]
LATEST = 1e4  # a run begins anew at this time, so that its times have enough digits [T]


def tolerance_reaching(make, name, end, target, tightest):
    """Return the loosest tolerance with which all tighter runs meet the target, and the error."""
    steps = taylor_speed.make_ladder(make, name, end, tightest)
    tolerances = (*taylor_speed.TOLERANCES, tightest)
    errors = [error for _, error in steps]
    return next(
        ((tol, e) for tol, e in zip(tolerances, errors, strict=True) if e <= target),
        (tightest, errors[-1]),
    )


def make_reused_call(scene, end, tol):
    """Return a call that sets a run to the start of the scene and advances it by `end`."""
    run = kr.start(scene, "taylor", tol=tol)
    momentum, attitude = scene.momentum, scene.attitude

    def call():
        nonlocal run
        if run.t > LATEST:
            run = kr.start(scene, "taylor", tol=tol)
        run.reset(momentum, attitude)
        return run.to([run.t + end])

    return call


def sample_in_turn(calls):
    """Return the processor times of each call in all rounds [s]."""
    samples = [[] for _ in calls]
    with timing.pause_gc():
        numbers = [
            max(1, round(SAMPLE / min(time_of_thread(call, 3) for _ in range(3)))) for call in calls
        ]
        for _ in range(ROUNDS):
            for call, number, got in zip(calls, numbers, samples, strict=True):
                got.append(time_of_thread(call, number))
    return samples


def time_of_thread(call, number):
    """Return the processor time of a call, the mean of `number` calls [s]."""
    begin = time.thread_time()
    for _ in range(number):
        call()
    return (time.thread_time() - begin) / number


def compile_heyoka(name, tol):
    """Return the duration of making heyoka's integrator, without a cache of earlier code [s]."""
    hy.llvm_state.set_diskcache_enabled(False)
    hy.llvm_state.clear_memcache()
    begin = time.perf_counter()
    system, start = equations.build_system(load_problem(name))
    hy.taylor_adaptive(system, start, tol=tol)
    return time.perf_counter() - begin


def describe_payment(seconds, own, peer):
    """Return text about the number of runs after which heyoka's compilation is paid."""
    if own <= peer:
        return "never paid, since its runs take longer"
    return f"paid after {seconds / (own - peer):.1e} runs"


def compare(name, target):
    """Print the times of one scene at one error."""
    end = ENDS[name]
    peer_tol, peer_error = tolerance_reaching(
        taylor_speed.make_heyoka_run, name, end, target, taylor_speed.EPS
    )
    tol, error = tolerance_reaching(
        taylor_speed.make_kreisel_run, name, end, target or 1.5 * peer_error, 2.0**-53
    )
    scene = load_problem(name).to_scene()
    calls = [
        taylor_speed.make_heyoka_run(name, end, peer_tol),
        lambda: kr.solve(scene, [end], "taylor", tol=tol),
        make_reused_call(scene, end, tol),
    ]
    peer, *ours = sample_in_turn(calls)
    ratios = [
        f"{median(b / a for a, b in zip(own, peer, strict=True)):.2f} (least {ratio:.2f})"
        for own in ours
        for ratio in [min(peer) / min(own)]
    ]
    least = [1e6 * min(samples) for samples in (*ours, peer)]
    print(
        f"{name} to {end:g}, {target or 'tightest'}: heyoka/solve {ratios[0]}, heyoka/run "
        f"{ratios[1]};  {least[0]:.1f}, {least[1]:.1f}, heyoka {least[2]:.1f} us;  errors "
        f"{error:.0e}, heyoka {peer_error:.0e}"
    )
    seconds = compile_heyoka(name, peer_tol)
    paid = describe_payment(seconds, min(ours[0]), min(peer))
    print(f"    heyoka compiles for {seconds:.2f} s: {paid}", flush=True)


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.call_speed", description=__doc__.splitlines()[0]
    )
    parser.add_argument("scenes", nargs="*", choices=[*ENDS, []], help="default: all")
    names = parser.parse_args(argv).scenes or ENDS
    print(f"on {machine.processor_name()}, {machine.describe_cores()}")
    for name in names:
        for target in TARGETS:
            compare(name, target)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
