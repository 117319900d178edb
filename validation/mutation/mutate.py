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
    asked = make_parser().parse_args(argv)
    side, root = SIDES[asked.side], asked.root.resolve()
    chosen = draw_sample(side.list_mutants(root, asked.only), asked.seed, asked.points)
    ledger = TrialLog(root / "build/mutate" / f"{asked.side}.jsonl")
    done = {"killed", "same", "unbuilt"} | (set() if asked.again else {"survived"})
    left = [m for m in chosen if ledger.get_outcome(m) not in done]
    print(f"{len(chosen)} mutants, {len(left)} to try", flush=True)
    if left:
        try:
            try_mutants(left, partial(side.Trial, root), asked, ledger)
        except TrialError as refused:
            raise SystemExit(f"kreisel: {refused}") from None
    print("\n".join(format_table(ledger, chosen)))
    return 0


def try_mutants(mutants, trial, asked, ledger):
    """Run the tests on all mutants in parallel, and print each verdict."""
    copies = SimpleQueue()
    folder = asked.root.resolve() / "build/mutate"
    for number in range(min(asked.jobs, len(mutants))):
        copies.put(trial(folder / f"{asked.side}-{number}"))
    begin = monotonic()

    def try_one(mutant):
        copy = copies.get()
        try:
            return mutant, copy.try_mutant(mutant)
        finally:
            copies.put(copy)

    with ThreadPoolExecutor(asked.jobs) as pool:
        for count, (mutant, verdict) in enumerate(pool.map(try_one, mutants), 1):
            ledger.add(mutant, verdict.word, verdict.by, verdict.seconds)
            took = f"{count}/{len(mutants)} {monotonic() - begin:6.0f} s"
            print(
                f"{took}  {verdict.word:9} {verdict.by:24} {mutant.file}:{mutant.line}  "
                f"{mutant.change}",
                flush=True,
            )


if __name__ == "__main__":
    raise SystemExit(main())
