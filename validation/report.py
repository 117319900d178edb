"""The report: error against run time of every method, beside heyoka, as a table, a CSV file and a page.

    kreisel report [--out report] [--quick | --thesis]        or        python -m validation.report
"""
import argparse
import statistics
import time
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from . import contenders, machine, page, tables, truth, workprecision
from .scenes import HORIZONS, SHORT, load

BUDGET, QUICK_BUDGET = 50.0, 2.0        # of the timing [s]
BUSY = .25                              # from this spread of the times on they are not to be quoted
OUTPUT = ("workprecision.csv", "index.html", "readme_table.md")


def arguments(argv):
    parser = argparse.ArgumentParser(prog="kreisel report", description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("report"), help="the folder to write to (default: report)")
    parser.add_argument("--quick", action="store_true",
                        help=f"few settings, to t = {SHORT:g}: shows that all works, no figures to quote")
    parser.add_argument("--thesis", action="store_true",
                        help="the chapter on the thesis alone, thesis.html: its figures, sentences and errata")
    return parser.parse_args(argv)


def progress_bar(console):
    return Progress(TextColumn("{task.description:28}"), BarColumn(bar_width=40),
                    TextColumn("{task.percentage:3.0f} %"), TimeElapsedColumn(), console=console)


def find_errors(ends, quick, bar):
    """The runs of all scenes with their errors; those so far if interrupted."""
    problems = {name: load(name) for name in ends}
    count = sum(len(workprecision.settings(who, quick)) for name in ends
                for who in (*contenders.ours(problems[name]), *contenders.PEERS))
    task = bar.add_task("errors against the truth", total=count)
    rows = []
    for name, end in ends.items():
        rows += workprecision.explore(problems[name], end, quick, lambda: bar.advance(task))
    bar.update(task, completed=count)
    return rows


def find_times(rows, quick, bar):
    task = bar.add_task("run times, in turn", total=None)
    return workprecision.time_all(rows, QUICK_BUDGET if quick else BUDGET, tick=lambda: bar.advance(task),
                                  plan=lambda runs: bar.update(task, total=runs))


def timing(rows):
    """How often the runs were timed, and how far that scattered."""
    counts = sorted({len(row.samples) for row in rows if not row.failure})
    spreads = [row.spread for row in rows if row.samples]
    middle = statistics.median(spreads)
    note = " (the machine was busy: do not quote these times)" if middle > BUSY else ""
    return {"rounds": " .. ".join(map(str, counts)), "spread": f"{middle:.1%}{note}"}


def heyoka_check(rows, ends):
    """heyoka's double precision at its tightest, beside its 128 bit."""
    for scene, end in ends.items():
        tightest = min((row for row in rows if row.scene == scene and row.method == "heyoka" and not row.failure),
                       key=lambda row: row.tol)
        kept = truth.stored(scene, end)
        yield {"scene": scene, "end": end, "double": tightest.attitude_error, "energy": tightest.energy_error,
               **{key: kept[key] for key in ("agreement", "energy_error", "conditioning")}}


def setup_times(rows):
    """What heyoka takes to compile its integrator, at loose and tight tolerances [s]."""
    known = [row.setup_seconds for row in rows if row.setup_seconds is not None]
    return {"least": min(known), "middle": statistics.median(known), "most": max(known)}


def write(out, rows, about, ends, checks):
    out.mkdir(parents=True, exist_ok=True)
    tables.write_csv(out / OUTPUT[0], rows, about)
    (out / OUTPUT[1]).write_text(page.render(rows, about, ends, checks, setup_times(rows)))
    (out / OUTPUT[2]).write_text(tables.markdown(rows, ends))


def show(console, rows, ends, checks):
    for scene, end in ends.items():
        console.print(tables.terminal(rows, scene, end))
    for check in checks:
        console.print(f"{check['scene']}: heyoka in double precision is {check['double']:.0e} rad from heyoka in 128 bit; "
                      f"two runs in 128 bit agree to {check['agreement']:.0e}; "
                      f"one rounding of the data moves it by {check['conditioning']:.0e}")
    setup = setup_times(rows)
    console.print("not in these times: heyoka compiles each integrator first, "
                  f"{setup['least']:.2f} .. {setup['most']:.2f} s")
    if not machine.has_gsl():
        console.print(f"GSL is {machine.GSL_MISSING}")
    for row in rows:
        if row.failure:
            console.print(f"failed: {row.method} on {row.scene} at {tables.setting(row)}: {row.failure}")


def main(argv=None):
    args = arguments(argv)
    if args.thesis:
        from .thesis import chapter

        return chapter.main(args.out)
    console, begin = Console(), time.perf_counter()
    ends = dict.fromkeys(HORIZONS, SHORT) if args.quick else HORIZONS
    plan = "a quick look, not to be quoted" if args.quick else "all steps and tolerances"
    with progress_bar(console) as bar:
        rows = find_errors(ends, args.quick, bar)
        interrupted = find_times(rows, args.quick, bar)
    if interrupted:
        plan += "; interrupted: fewer rounds than planned"
    about = machine.described() | {"plan": plan} | timing(rows)
    checks = list(heyoka_check(rows, ends))
    write(args.out, rows, about, ends, checks)
    show(console, rows, ends, checks)
    console.print(f"quartiles of the times apart by {about['spread']}, median over the runs")
    written = ", ".join(str(args.out / name) for name in OUTPUT)
    console.print(f"{written}; {len(rows)} runs in {time.perf_counter() - begin:.0f} s")
    return 130 if interrupted else 0


if __name__ == "__main__":
    raise SystemExit(main())
