"""`kreisel solve` and `kreisel resume`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from textwrap import wrap
from typing import Unpack

import click
import numpy as np

from .._model.scene import Scene, list_scene_file_keys
from .._options.options import validate_recording_interval
from .._options.times import check_resolvable_horizon, check_states_fit_in_memory, time_array
from .._results.path import Path
from .._solve.run import Run, start
from .._solve.run import resume as resume_run
from .._solve.solve import solve as solve_scene
from .._utils.arguments import Array, as_int
from ..events import MAKERS
from .options import (
    A_METHOD,
    A_SCENE,
    FILE,
    HELP,
    METAVAR,
    QUANTITIES,
    TimeSequence,
    UsageError,
    convert_errors_to_usage_errors,
    get_binary_stdin,
    make_name_completer,
    method,
    parse_event_option,
    parse_name_list,
    parse_times,
)
from .options import find_or_read_scene as a_scene
from .outputs import (
    OutputFileOptions,
    RunOutputs,
    StopSignalHandler,
    add_output_options,
    write_path_pieces_to_outputs,
)

_LONGEST = 1 << 24  # bytes read at most from a checkpoint; checkpoints are much smaller


def _describe_scene_files() -> str:
    """Return the keys of scene files, for the end of a help text."""
    lines = ["\b", "Keys of SCENE files (TOML)"]
    for table, keys in list_scene_file_keys().items():
        text = f"{table or 'the file':<17} {', '.join(keys)}"
        lines += wrap(text, 78, initial_indent="  ", subsequent_indent=" " * 20)
    return "\n".join(lines)


class _SolveCommandOptions(OutputFileOptions):
    method: str
    step: float | None
    tol: float | None
    digits: int | None
    error: float | None
    every: int | None
    max_steps: int
    want: list[str] | None
    events: tuple[str, ...]


class _ResumeCommandOptions(OutputFileOptions):
    every: int | None
    max_steps: int | None


_OPTIONS = (
    "t",
    *(
        word
        for word in _SolveCommandOptions.__annotations__
        if word not in OutputFileOptions.__annotations__
    ),
)
_T = click.option(
    "--t",
    type=parse_times,
    required=True,
    metavar=METAVAR,
    help=HELP,
)
_EVERY = click.option(
    "--every", type=int, help="Record the state after every N steps, up to the time --t."
)


@click.command(epilog=_describe_scene_files())
@click.argument("scene", type=str, shell_complete=A_SCENE)
@_T
@click.option(
    "--method",
    type=method,
    default="auto",
    show_default=True,
    metavar="NAME",
    shell_complete=A_METHOD,
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
    type=parse_name_list,
    metavar="NAME[,...]",
    shell_complete=QUANTITIES,
    help="Quantities to record instead of states, such as nutation,energy (see `kreisel "
    "quantities`).",
)
@click.option(
    "--events",
    multiple=True,
    metavar="NAME[:ARGUMENT...][:WORD=VALUE...]",
    shell_complete=make_name_completer(MAKERS),
    help="An event to search for, as in kreisel.events; repeatable: nutation, "
    "plane:0,1,0:of=m, crossing:2*m_x+apex_z:0.5:direction=1, nutation:max_count=3:terminal.",
)
@add_output_options
def solve(scene: str, t: TimeSequence, **words: Unpack[_SolveCommandOptions]) -> None:
    """Compute the motion of a scene.

    If the computation fails or is interrupted, the output files contain all states up to the last
    valid one. Memory use is constant except with --json, --npz, --all-rows, --events, --error or
    the method geometric.
    """
    top, stops = a_scene(scene), StopSignalHandler(t.end)
    outputs = RunOutputs(words, scene, words["events"])
    with convert_errors_to_usage_errors(_OPTIONS):
        events = parse_event_option(top, words["events"])
        if words["method"] == "geometric" or words["error"] is not None:
            if "--save" in outputs.files:
                raise UsageError(
                    "--save needs a single method; geometric and --error cannot be saved"
                )
            if events:
                raise UsageError(
                    "--events need taylor, and cannot be combined with geometric or --error"
                )
            _run_and_write_outputs(
                _yield_path_as_one_piece(top, t, words, stops), None, outputs, stops
            )
            return
        begin: Callable[..., Run] = start  # start itself checks the types of the options
        run = begin(
            top,
            words["method"],
            step=words["step"],
            tol=words["tol"],
            digits=words["digits"],
            max_steps=words["max_steps"],
            want=words["want"],
            events=events,
            back=t.end < 0.0,
        )
        _run_and_write_outputs(
            _iterate_path_pieces(run, t, words["every"], outputs, stops), run, outputs, stops
        )


@click.command()
@click.argument("run", type=FILE)
@_T
@_EVERY
@click.option("--max-steps", type=int, help="A new limit on the number of steps.")
@add_output_options
def resume(run: str, t: TimeSequence, **words: Unpack[_ResumeCommandOptions]) -> None:
    """Continue a saved RUN; the results are bitwise identical to those of an uninterrupted run.

    RUN is a file written by --save. Times up to the saved state are ignored, so --t can be the same
    as for the whole run. --save can overwrite the file RUN. Two outputs differ from those of an
    uninterrupted run: --unwrap counts whole turns from the first state of this command, and events
    are called event 1, event 2 and so on, in the order of --events.
    """
    stops = StopSignalHandler(t.end)
    with convert_errors_to_usage_errors(_OPTIONS):
        if words["max_steps"] is not None:
            as_int("max_steps", words["max_steps"], 0)
        top = _read_run_checkpoint(run, words["max_steps"])
        event_names = tuple(f"event {i + 1}" for i in range(len(top.events or ())))
        outputs = RunOutputs(words, run, event_names, options_that_may_replace_file=("--save",))
        _run_and_write_outputs(
            _iterate_path_pieces(top, t, words["every"], outputs, stops), top, outputs, stops
        )


def _run_and_write_outputs(
    pieces: Iterator[Path], run: Run | None, outputs: RunOutputs, stops: StopSignalHandler
) -> None:
    """Compute a path, and write it to the outputs."""
    with stops.defer_signals():
        try:
            with stops.show_progress():
                end = write_path_pieces_to_outputs(
                    outputs.create_path_outputs(),
                    pieces,
                    run if "--save" in outputs.files else None,
                    stops,
                )
        except MemoryError:
            outputs.discard_output_files()
            raise click.ClickException("not enough memory") from None
        except BaseException:
            outputs.discard_output_files()
            raise
        outputs.finish_outputs(end)


def _yield_path_as_one_piece(
    scene: Scene,
    t: TimeSequence,
    words: _SolveCommandOptions,
    stops: StopSignalHandler,
) -> Iterator[Path]:
    """Yield the whole path at once, because method='geometric' cannot compute it in parts."""
    solve_all: Callable[..., Path] = solve_scene
    yield solve_all(
        scene,
        t.to_solve_argument(),
        words["method"],
        step=words["step"],
        tol=words["tol"],
        digits=words["digits"],
        every=words["every"],
        max_steps=words["max_steps"],
        error=words["error"],
        want=words["want"],
        progress=stops.update_progress_bar,
    )


def _iterate_path_pieces(
    run: Run,
    t: TimeSequence,
    every: int | None,
    outputs: RunOutputs,
    stops: StopSignalHandler,
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
    elif outputs.needs_whole_path:
        return run.stream(
            _select_remaining_grid_times(run, t.end, every, size),
            progress=stops.update_progress_bar,
        )
    else:
        times = t.end
    return run.stream(times, every=every, progress=stops.update_progress_bar)


def _select_remaining_grid_times(run: Run, end: float, every: int, size: int) -> Array:
    """Return those times of a grid that are later than the current time of the run.

    Raises MemoryError if the states would not fit in memory.
    """
    times = time_array(end, run.step, validate_recording_interval(run._options.method, every), size)
    return times if run._fresh else times[np.abs(times) > abs(run.t)]


def _read_run_checkpoint(file: str, max_steps: int | None) -> Run:
    """Read a saved run from a file, or from standard input if `file` is -."""
    try:
        if file == "-":
            data = get_binary_stdin().read(_LONGEST)
        else:
            with open(file, "rb") as stream:
                data = stream.read(_LONGEST)
        return resume_run(data, max_steps=max_steps)
    except (OSError, ValueError) as error:
        raise UsageError(str(error) if isinstance(error, OSError) else f"{file}: {error}") from None
