"""`kreisel solve` and `kreisel resume`."""

from __future__ import annotations

from collections.abc import Iterator
from textwrap import wrap
from typing import Any

import click
import numpy as np

from .._model.scene import Scene, list_scene_file_keys
from .._options.options import (
    RECORDABLE,
    check_resolvable_horizon,
    check_states_fit_in_memory,
    time_array,
    validate_recording_interval,
)
from .._results.path import Path
from .._solve.run import Run, start
from .._solve.run import resume as resume_run
from .._solve.solve import solve as solve_scene
from .._utils.arguments import Array, as_int
from ..events import MAKERS
from .options import (
    METHOD,
    SCENE,
    Command,
    InputFile,
    Name,
    T,
    TimeSequence,
    UsageError,
    get_binary_stdin,
    parse_event,
)
from .outputs import RunOutputs, add_output_options

_LONGEST = 1 << 24  # bytes read at most from a checkpoint; checkpoints are much smaller


def _describe_scene_files() -> str:
    """Return the keys of scene files, for the end of a help text."""
    lines = ["\b", "Keys of SCENE files (TOML)"]
    for table, keys in list_scene_file_keys().items():
        text = f"{table or 'the file':<17} {', '.join(keys)}"
        lines += wrap(text, 78, initial_indent="  ", subsequent_indent=" " * 20)
    return "\n".join(lines)


_EVERY = click.option(
    "--every", type=int, help="Record the state after every N steps, up to the time --t."
)


@click.command(cls=Command, epilog=_describe_scene_files())
@click.argument("scene", type=SCENE)
@T
@click.option(
    "--method",
    type=METHOD,
    default="auto",
    show_default=True,
    help="One of `kreisel methods`, auto, or geometric, which chooses a method that meets --error.",
)
@click.option("--step", type=float, help="The step of fixed-step methods.")
@click.option("--tol", type=float, help="The tolerance of adaptive methods.")
@click.option("--digits", type=int, help="The digits of taylor, instead of --tol: 16, 20 or 30.")
@click.option("--error", type=float, help="The largest attitude error for geometric [rad].")
@_EVERY
@click.option(
    "--max-steps", type=int, default=0, help="Fail after this number of steps; 0: no limit."
)
@click.option(
    "--want",
    type=Name(RECORDABLE, is_list=True),
    help="Quantities to record instead of states, such as nutation,energy (see `kreisel "
    "quantities`).",
)
@click.option(
    "--events",
    type=Name(MAKERS),
    multiple=True,
    metavar="NAME[:ARGUMENT...][:WORD=VALUE...]",
    help="An event to search for, as in kreisel.events; repeatable: nutation, "
    "plane:0,1,0:of=m, crossing:2*m_x+apex_z:0.5:direction=1, nutation:max_count=3:terminal.",
)
@add_output_options
def solve(scene: Scene, t: TimeSequence, events: tuple[str, ...], **words: Any) -> None:
    """Compute the motion of a scene.

    If the computation fails or is interrupted, the output files contain all states up to the last
    valid one. Memory use is constant except with --json, --npz, --all-rows, --events, --error or
    the method geometric.
    """
    outputs = RunOutputs(words, events, t.end)
    event_functions = [parse_event(scene, text) for text in events] or None
    if words["method"] != "geometric" and words["error"] is None:
        every = words.pop("every")
        del words["error"]
        run = start(scene, **words, events=event_functions, back=t.end < 0.0)
        outputs.write_path(_iterate_path_pieces(run, t, every, outputs), run)
        return
    if "save" in outputs.files:
        raise UsageError("--save needs a single method; geometric and --error cannot be saved")
    if events:
        raise UsageError("--events need taylor, and cannot be combined with geometric or --error")

    def yield_path_as_one_piece() -> Iterator[Path]:
        yield solve_scene(scene, t.to_solve_argument(), progress=outputs.report_progress, **words)

    outputs.write_path(yield_path_as_one_piece())


@click.command(cls=Command)
@click.argument("run", type=InputFile(allow_dash=True))
@T
@_EVERY
@click.option("--max-steps", type=int, help="A new limit on the number of steps.")
@add_output_options
def resume(
    run: str, t: TimeSequence, every: int | None, max_steps: int | None, **words: Any
) -> None:
    """Continue a saved RUN; the results are bitwise identical to those of an uninterrupted run.

    RUN is a file written by --save. Times up to the saved state are ignored, so --t can be the same
    as for the whole run. --save can overwrite the file RUN. Two outputs differ from those of an
    uninterrupted run: --unwrap counts whole turns from the first state of this command, and events
    are called event 1, event 2 and so on, in the order of --events.
    """
    if max_steps is not None:
        as_int("max_steps", max_steps, 0)
    try:
        if run == "-":
            data = get_binary_stdin().read(_LONGEST)
        else:
            with open(run, "rb") as stream:
                data = stream.read(_LONGEST)
        top = resume_run(data, max_steps=max_steps)
    except OSError as error:
        raise UsageError(str(error)) from None
    except ValueError as error:
        raise UsageError(f"{run}: {error}") from None
    event_names = tuple(f"event {i + 1}" for i in range(len(top.events or ())))
    outputs = RunOutputs(words, event_names, t.end)
    outputs.write_path(_iterate_path_pieces(top, t, every, outputs), top)


def _iterate_path_pieces(
    run: Run, t: TimeSequence, every: int | None, outputs: RunOutputs
) -> Iterator[Path]:
    """Return an iterator over the parts of a path, starting at the current time of the run."""
    check_resolvable_horizon(run.scene, t.end, run.step)
    if run.ended:
        raise UsageError(f"the run has ended at t = {run.t!r}, where a terminal event occurred")
    rest = t if run._fresh else t.select_later_times(run.t)
    if not rest.grids:
        raise UsageError(f"the run has already reached t = {run.t!r}: give a later --t")
    size = run._options.bytes_per_state + 8
    times: float | Array | Iterator[float] = iter(rest)
    if not t.one:
        if outputs.needs_whole_path:
            check_states_fit_in_memory(len(rest), size)
    elif every is None:
        times = np.array([0.0, t.end] if run._fresh else [t.end])
    elif outputs.needs_whole_path:  # refuse times that would not fit in memory
        number = validate_recording_interval(run._options.integrator, every)
        whole = time_array(t.end, run.step, number, size)
        times, every = whole if run._fresh else whole[np.abs(whole) > abs(run.t)], None
    else:
        times = t.end
    return run.stream(times, every=every, progress=outputs.report_progress)
