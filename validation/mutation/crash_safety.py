"""Tests that files survive when the process that writes them is killed.

    python -m validation.mutation.crash_safety [--times 400] [--seed S]

Processes that save repeatedly are killed with SIGKILL at a random moment. Each process overwrites a
file alternately with two contents. After the kill, the file must have its old content or one of
these two. A leftover temporary file must have a reserved name.
"""

import argparse
import os
import random
import re
import signal
import tempfile
import time
from collections import Counter
from itertools import cycle
from pathlib import Path

import kreisel as kr
from kreisel._sweep.store import open_store

JUNK = re.compile(r"\.[0-9a-f]{16}\.new")  # name of a temporary file
OLD, WHOLE, ON_ITS_WAY = "old", "whole", "on its way"
TORN, STRANGE, ENDED = "torn", "strange", "ended"  # failures
LONGEST = 3.0  # longest delay before the kill, in multiples of the duration of a write


def make_writers(folder):
    """Return {name: (file, two functions that write it)} for all writers."""
    top, other = kr.scenes.asymmetric, kr.scenes.kowalewski
    runs, paths, views = [], [], []
    for scene in (top, other):
        run = kr.start(scene, "strang", step=0.01)
        paths.append(run.to(20.0, every=1))
        runs.append(run)
        views.append(kr.view(scene, open=False))
    sweep = folder / "sweep"
    kr.sweep(top.vary(spin=[1.0, 2.0, 3.0, 4.0]), 1.0, folder=sweep, part_size=2, threads=1)
    parts = open_store(sweep)
    rows = [parts.read_part(i) for i in (0, 1)]
    return {
        "run": ("run", [run.save for run in runs]),
        "path": ("path", [path.save for path in paths]),
        "table": ("table.csv", [path.to_csv for path in paths]),
        "scene": ("top.toml", [top.to_toml, other.to_toml]),
        "page": ("page.html", [view.save for view in views]),
        "part": (parts.file(0), [lambda _, r=r: parts.write_part(0, r) for r in rows]),
    }


def write_contents(file, ways):
    """Return the contents that a writer's two functions produce, and the longest time [s]."""
    contents, longest = [], 0.0
    for write in ways:
        begin = time.perf_counter()
        write(file)
        longest = max(longest, time.perf_counter() - begin)
        contents.append(file.read_bytes())
    return contents, longest


def kill_writer(file, ways, seconds):
    """Run a writer in its own process and kill it after `seconds`.

    Return True if the writer was still running.
    """
    told, tell = os.pipe()
    child = os.fork()
    if not child:
        try:
            os.write(tell, b"begun")
            for write in cycle(ways):
                write(file)
        finally:
            os._exit(1)
    os.read(told, 5)
    time.sleep(seconds)
    os.kill(child, signal.SIGKILL)
    os.close(told)
    os.close(tell)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL


def inspect_file(file, contents):
    """Return the state of a file and the number of temporary files beside it, which are removed."""
    beside = {name for name in os.listdir(file.parent) if JUNK.fullmatch(name)}
    for name in beside:
        os.unlink(file.parent / name)
    found = file.read_bytes() if file.is_file() else None
    return (OLD if found == OLD.encode() else WHOLE if found in contents else TORN), len(beside)


def count_outcomes(file, ways, times, chance):
    """Kill a writer `times` times, and count the states of its file and the leftover files.

    Unexpected files, and writers that ended before they were killed, are counted too.
    """
    contents, longest = write_contents(file, ways)
    assert contents[0] != contents[1]
    found, before = Counter(), set(os.listdir(file.parent))
    for _ in range(times):
        file.write_bytes(OLD.encode())
        found[ENDED] += not kill_writer(file, ways, chance.uniform(0.0, LONGEST * longest))
        how, on_their_way = inspect_file(file, contents)
        found[how] += 1
        found[ON_ITS_WAY] += on_their_way
        found[STRANGE] += set(os.listdir(file.parent)) != before
    return found


def make_parser():
    parser = argparse.ArgumentParser(
        prog="python -m validation.mutation.crash_safety", description=__doc__
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--times", type=int, default=400, help="kills per writer")
    parser.add_argument("--seed", type=int, default=20261122, help="seed of the delays")
    parser.add_argument("--only", default="", help="prefix of the writers' names")
    return parser


def main(argv=None):
    asked = make_parser().parse_args(argv)
    chance, columns = random.Random(asked.seed), (OLD, WHOLE, ON_ITS_WAY, TORN, STRANGE, ENDED)
    print(f"killed {asked.times} times each, seed {asked.seed}; states of the files:")
    print(f"{'':8}" + "".join(f"{word:>12}" for word in columns))
    bad = 0
    with tempfile.TemporaryDirectory() as folder:
        for name, (file, ways) in make_writers(Path(folder)).items():
            if not name.startswith(asked.only):
                continue
            found = count_outcomes(Path(folder) / file, ways, asked.times, chance)
            print(f"{name:8}" + "".join(f"{found[word]:12}" for word in columns), flush=True)
            bad += found[TORN] + found[STRANGE] + found[ENDED]
    return int(bad > 0)


if __name__ == "__main__":
    raise SystemExit(main())
