"""kreisel.stream: the states of a scene or of an ensemble, computed in constant memory."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import Executor
from typing import Unpack, overload

from .._model.scene import Ensemble, Scene
from .._options.solve_options import Progress, validate_progress_callback
from .._options.times import CHUNK_SIZE, find_time_direction_and_chunks
from .._results.ensemble_paths import Paths
from .._results.path import Path
from .._utils.quantity_attributes import MethodName, QuantityName
from .._utils.validation import Numbers, as_int
from .keywords import PoolKeywords, StreamKeywords
from .run import EventSpec, Run, validate_run_options
from .solve_ensemble import SolveArguments, refuse_ensemble_arguments, stream_ensemble


class _EnsembleKeywords(StreamKeywords, PoolKeywords, total=False):
    pass


@overload
def stream(
    scene: Scene,
    t: Numbers | Iterator[float],
    method: MethodName = "auto",
    *,
    chunk: int | None = None,
    **controls: Unpack[StreamKeywords],
) -> Iterator[Path]: ...
@overload
def stream(
    scene: Ensemble,
    t: Numbers,
    method: MethodName = "auto",
    *,
    chunk: int | None = None,
    **controls: Unpack[_EnsembleKeywords],
) -> Iterator[Paths]: ...
def stream(
    scene: Scene | Ensemble,
    t: Numbers | Iterator[float],
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    want: Iterable[QuantityName] | None = None,
    events: EventSpec | None = None,
    chunk: int | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> Iterator[Path] | Iterator[Paths]:
    """Yield the states of kreisel.solve as paths of at most `chunk` states, in constant memory.

    The yielded states are bitwise identical to those of kreisel.solve with the same method. The
    default of `chunk` is 2**14.

    t      a list; an iterator of times, which can be infinite; or with `every` a number, which can
           be math.inf [T]

        for path in kr.stream(scene, math.inf, "strang", step=0.01, every=10): ...
        for path in kr.stream(scene, (0.01 * k for k in itertools.count())): ...

        >>> import kreisel as kr
        >>> words = {"method": "strang", "step": 0.01, "every": 10, "want": ["nutation"]}
        >>> [len(path) for path in kr.stream(kr.scenes.asymmetric, 1000, chunk=4000, **words)]
        [4000, 4000, 2001]

    For an ensemble, yield a kreisel.Paths for each group of consecutive tops in C order. Each
    kreisel.Paths has at most `chunk` states in total (default 2**20), but at least one top. t must
    not be an iterator. threads, executor and progress are as in kreisel.solve.

    The statistics of each path refer to the entire run up to the last state of the path. Each path
    contains the events that occurred after the end of the previous path. For a single scene, the
    path that contains a terminal event is the last one.

    Raises the same exceptions as kreisel.solve. Exceptions for invalid arguments are raised
    immediately. Exceptions for failed runs and for invalid times from an iterator are raised only
    while the paths are iterated over. The attribute `path` of kreisel.Error and kreisel.Interrupted
    contains the valid states of the last path.
    """
    most = None if chunk is None else as_int("chunk", chunk, 1)
    if isinstance(scene, Ensemble):
        if isinstance(t, Iterator):
            raise TypeError(
                "times of an ensemble must be a number, a list or an array, not an iterator"
            )
        arguments = SolveArguments(step, tol, digits, every, max_steps, None, want, events)
        size = most or 1 << 20
        return stream_ensemble(scene, t, method, arguments, size, progress, threads, executor)
    if threads is not None or executor is not None:
        refuse_ensemble_arguments(scene, threads=threads, executor=executor)
    options = validate_run_options(scene, method, step, tol, digits, max_steps, want, events, every)
    is_back, chunks = find_time_direction_and_chunks(
        t, options.step, options.every, most or CHUNK_SIZE
    )
    return Run(scene, options, is_back)._yield_path_per_chunk(
        chunks, validate_progress_callback(progress)
    )
