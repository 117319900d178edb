"""Mutation testing: a program is changed at random, and at least one test should then fail.

    python -m validation.mutation.mutate core|package

An interrupted run is continued by repeating the command. With --again, mutants that survived an
earlier run are tested again.
"""

import argparse
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from time import monotonic

from . import core_trials, package_trials
from .mutant import draw_sample
from .sandbox import TrialError
from .trial_log import TrialLog, format_table

ROOT = Path(__file__).parents[2]
SIDES = {"core": core_trials, "package": package_trials}


def make_parser():
    parser = argparse.ArgumentParser(
        prog="python -m validation.mutation.mutate", description=__doc__.splitlines()[0]
    )
    parser.add_argument("side", choices=SIDES)
    parser.add_argument("--points", type=int, default=150, help="number of mutants")
    parser.add_argument("--seed", type=int, default=20261122)
    parser.add_argument("--only", default="", metavar="PATH", help="prefix of the files' names")
    parser.add_argument("--jobs", type=int, default=1, help="number of parallel jobs")
    parser.add_argument("--again", action="store_true", help="try survivors again")
    parser.add_argument("--root", type=Path, default=ROOT, help="root of the tree")
    return parser


def main(argv=None):
    options = make_parser().parse_args(argv)
    side, root = SIDES[options.side], options.root.resolve()
    sample = draw_sample(side.list_mutants(root, options.only), options.seed, options.points)
    ledger = TrialLog(root / "build/mutate" / f"{options.side}.jsonl")
    final_outcomes = {"killed", "same", "unbuilt"} | (set() if options.again else {"survived"})
    remaining = [m for m in sample if ledger.get_outcome(m) not in final_outcomes]
    print(f"{len(sample)} mutants, {len(remaining)} to try", flush=True)
    if remaining:
        try:
            try_mutants(remaining, partial(side.Trial, root), options, ledger)
        except TrialError as error:
            raise SystemExit(f"kreisel: {error}") from None
    print("\n".join(format_table(ledger, sample)))
    return 0


def try_mutants(mutants, trial, options, ledger):
    """Run the tests on all mutants in parallel, and print each verdict."""
    copies = SimpleQueue()
    folder = options.root.resolve() / "build/mutate"
    for number in range(min(options.jobs, len(mutants))):
        copies.put(trial(folder / f"{options.side}-{number}"))
    begin = monotonic()

    def try_one(mutant):
        copy = copies.get()
        try:
            return mutant, copy.try_mutant(mutant)
        finally:
            copies.put(copy)

    with ThreadPoolExecutor(options.jobs) as pool:
        for count, (mutant, verdict) in enumerate(pool.map(try_one, mutants), 1):
            ledger.add(mutant, verdict.word, verdict.by, verdict.seconds)
            progress = f"{count}/{len(mutants)} {monotonic() - begin:6.0f} s"
            print(
                f"{progress}  {verdict.word:9} {verdict.by:24} {mutant.file}:{mutant.line}  "
                f"{mutant.change}",
                flush=True,
            )


if __name__ == "__main__":
    raise SystemExit(main())
