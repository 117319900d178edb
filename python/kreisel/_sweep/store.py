"""The folder of a sweep, and the run of its parts."""

from __future__ import annotations

import io
import json
import os
import re
import threading
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from .._core import Worker, version
from .._utils.arguments import Array, format_count
from .._utils.files import (
    atomic_write,
    check_file_is_writable,
    fill_in_checksum,
    has_correct_checksum,
    sync_folder,
)
from .._utils.processes import Progress, defer_signals, has_thread_workers, run_jobs
from .plan import (
    MAX_INLINE,
    PartResults,
    SweepPlan,
    build_plan_from_dict,
    hash_plan,
    make_file_name_from_array_hash,
    tabulate_sweep_part,
)

PLAN = "plan.json"
REPAIR = (
    "repeating the call of kreisel.sweep replaces it, and read_sweep(folder, partial=True) skips it"
)
_PROGRAM = "sweep"  # the value of the entry "kreisel" in a plan file
_MAX_BYTES = 1 << 30  # limit of bytes read, because the file could be an endless device
DONE, MISSING, DAMAGED, OLD = "done", "missing", "damaged", "of another version"
FOREIGN = "foreign"


class SweepStore:
    """The folder in which the files of a sweep are stored.

    Raises ImportError if pyarrow is not installed.
    """

    def __init__(self, folder: Path, plan: SweepPlan) -> None:
        from . import parquet

        self.folder, self.plan, self._format = folder, plan, parquet

    def part_file_path(self, i: int) -> Path:
        return self.folder / f"part-{i:06}.parquet"

    def write_part(self, i: int, part: PartResults) -> None:
        options, kernel = self.plan.options, ""  # the instruction set of Taylor series
        if not options.has_step_search:
            kernel = Worker(*options.core_arguments, []).kernel[0]
        words = {"plan": self.plan.hash, "part": i, "version": version, "kernel": kernel}
        data = fill_in_checksum(self._format.encode_part_as_parquet(part, words))
        atomic_write(self.part_file_path(i), bytes(data))

    def list_existing_parts(self) -> list[int]:
        """Return the numbers of all parts whose files exist, in ascending order."""
        numbers, parts = [], self.plan.parts
        for entry in os.scandir(self.folder):
            match = re.fullmatch(r"part-([0-9]{6,})\.parquet", entry.name)
            i = int(match[1]) if match else parts
            if i < parts and entry.name == f"part-{i:06}.parquet":
                numbers.append(i)
        return sorted(numbers)

    def read_part(self, i: int, names: Iterable[str] | None = None) -> PartResults:
        """Read part `i` or only its columns `names`; [] gives all columns without rows."""
        expected = {"plan": self.plan.hash, "part": i}
        try:
            return self._format.decode_part_from_parquet(
                str(self.part_file_path(i)), expected, names, self.plan.states
            )
        except ValueError as error:
            raise ValueError(f"{error}; {REPAIR}") from None

    def determine_part_status(self, i: int, refuses_foreign: bool = False) -> str:
        """Verify part i, and return its status.

        A folder, or a complete part of another plan, is foreign. Raises FileExistsError for it if
        `refuses_foreign` is True.
        """
        file = self.part_file_path(i)
        try:
            data = file.read_bytes()
        except FileNotFoundError:
            return MISSING
        except IsADirectoryError:
            found = "a folder"
        else:
            if not has_correct_checksum(data):
                return DAMAGED
            try:
                description = self._format.read_part_description(data)
            except ValueError:
                description = {}
            if description.get("plan") == self.plan.hash:
                if description.get("part") != i:
                    return DAMAGED
                return DONE if description.get("version") == version else OLD
            plan = str(description.get("plan"))[:16]
            found = f"part {description.get('part')} of the plan {plan}"
        if refuses_foreign:
            raise FileExistsError(
                f"{file} is {found}, in the place of part {i} of the plan {self.plan.hash[:16]}: "
                "it is not overwritten; move or delete it, and call again"
            )
        return FOREIGN

    def __reduce__(self) -> tuple[Any, ...]:
        return _open_cached_store, (str(self.folder), self.plan.hash)


def open_sweep_store(folder: str | os.PathLike[str], expected: str | None = None) -> SweepStore:
    """Open the folder of a sweep, whose plan must have the hash `expected`, if given."""
    root = Path(os.path.abspath(folder))
    content = _read_plan_file(root)

    def read_parameter_array(name: str) -> Array:
        values: Array = np.load(root / name, allow_pickle=False)
        if make_file_name_from_array_hash(values) != name:
            raise ValueError(f"{root / name} is damaged: its numbers do not match its name")
        return values

    try:
        plan = build_plan_from_dict(content["plan"], read_parameter_array)
    except ValueError as error:
        raise ValueError(f"{root / PLAN}: {error}") from None
    if expected is not None and plan.hash != expected:
        raise ValueError(f"{root} has the plan {plan.hash[:16]} now, not {expected[:16]}")
    return SweepStore(root, plan)


@lru_cache(maxsize=4)
def _open_cached_store(folder: str, expected: str) -> SweepStore:
    """Open the folder of a sweep, and cache the result for other tasks of the worker process."""
    return open_sweep_store(folder, expected)


def _read_plan_file(root: Path) -> dict[str, Any]:
    """Return the contents of the plan file in a folder."""
    file = root / PLAN
    if not root.is_dir():
        raise FileNotFoundError(f"there is no folder {root}")
    if not file.is_file():
        raise ValueError(f"{root} is not a folder of a sweep: it has no {PLAN}")
    try:
        with open(file, "rb") as plan:
            content = json.loads(plan.read(_MAX_BYTES))
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict) or content.get("kreisel") != _PROGRAM:
        raise ValueError(f"{file} is not a plan of a sweep")
    if content.get("hash") != hash_plan(content.get("plan", {})):
        raise ValueError(f"{file} is damaged: its hash does not match its plan")
    return content


def create_or_open_sweep_store(folder: str | os.PathLike[str], plan: SweepPlan) -> SweepStore:
    """Create the folder of a plan, or open the folder of the same plan."""
    root = Path(os.path.abspath(folder))
    store = SweepStore(root, plan)
    if root.exists() and not root.is_dir():
        raise FileExistsError(f"{root} is not a folder")
    if not (root / PLAN).exists() and _write_plan_to_new_folder(root, plan):
        return store
    content = _read_plan_file(root)
    if content["hash"] != plan.hash:
        raise ValueError(_describe_plan_mismatch(root, content, plan))
    check_file_is_writable(root / PLAN)
    _write_parameter_arrays(root, plan)
    return store


def _write_plan_to_new_folder(root: Path, plan: SweepPlan) -> bool:
    """Write a plan to a new or empty folder, unless another process has written one."""
    if root.is_dir():
        for name in sorted(os.listdir(root)):
            if not name.startswith((".", "starts-")) and name != PLAN:
                raise FileExistsError(
                    f"{root} is not a folder of a sweep, and not empty: it contains {name!r}"
                )
    else:
        root.mkdir()
        sync_folder(root.parent)
    _write_parameter_arrays(root, plan)
    content = {
        "kreisel": _PROGRAM,
        "version": version,
        "hash": plan.hash,
        "tops": plan.source.size,
        "parts": plan.parts,
    }
    head, body = (
        ",\n".join(
            f"{space}{json.dumps(name)}: {json.dumps(value)}" for name, value in rows.items()
        )
        for space, rows in [("", content), (" ", plan.as_json)]
    )
    file, new = root / PLAN, root / f".{os.urandom(8).hex()}.plan.new"
    atomic_write(new, f'{{\n{head},\n"plan": {{\n{body}\n}}\n}}\n'.encode())
    try:
        os.link(new, file)
    except FileExistsError:
        return False
    except OSError:  # the file system does not support hard links
        if file.exists():
            return False
        os.replace(new, file)
    finally:
        new.unlink(missing_ok=True)
    return True


def _write_parameter_arrays(root: Path, plan: SweepPlan) -> None:
    """Write each array that is too long for the plan file to a separate file."""
    for one in (*plan.source._parameters.values(), *plan.source._varied.values()):
        if one.values.size > MAX_INLINE:
            file, buffer = root / make_file_name_from_array_hash(one.values), io.BytesIO()
            if not file.exists():
                values = np.ascontiguousarray(one.values)
                np.lib.format.write_array(buffer, values, allow_pickle=False)
                atomic_write(file, buffer.getvalue())


def _describe_plan_mismatch(root: Path, content: dict[str, Any], plan: SweepPlan) -> str:
    """Return a message that describes how the plan in a folder differs from `plan`."""
    there, here = content["plan"], plan.as_json
    lines = [f"{root} is of another plan: {content['hash'][:16]} there, {plan.hash[:16]} here; in"]
    for name in sorted({*there, *here}):
        if there.get(name) != here.get(name):
            texts = [json.dumps(entries.get(name)) for entries in (there, here)]
            old, new = (t if len(t) <= 120 else f"{t[:100]} ... {t[-16:]}" for t in texts)
            lines.append(f"  {name}: {old} there, {new} here")
    return "\n".join([*lines, "use another folder, or the plan in this folder"])


# Maximal number of unfinished parts submitted to an executor. It exceeds the number of workers of
# most executors, so no worker waits. It is small, because an exception must cancel these parts.
_IN_FLIGHT = 256
_PROGRESS_SECONDS = 0.1  # minimal time between two calls of progress


def compute_and_store_part(store: SweepStore, i: int, progress: Progress | None = None) -> int:
    """Compute part i in a single thread and write its file; return the number of tops."""
    tops = store.plan.list_tops_of_part(i)
    outcome = store.plan.compute_results_of_tops(tops, 1, progress)
    store.write_part(i, tabulate_sweep_part(store.plan, tops, outcome))
    return len(tops)


class PartsLostError(RuntimeError):
    """Error raised if an executor fails, or loses parts of a sweep in two attempts."""


def compute_parts(
    store: SweepStore,
    parts: Sequence[int],
    threads: int,
    executor: Executor | None,
    progress: Progress | None,
) -> None:
    """Compute parts of a sweep, and write their files.

    Without an executor, a second thread writes a part while the next part is being computed. Parts
    that an executor failed to complete are submitted a second time. Raises PartsLostError if the
    executor fails, or if some parts are still missing after the second attempt.
    """
    plan, reported = store.plan, 0.0
    total = sum(len(plan.list_tops_of_part(i)) for i in parts)

    def report(tops: float, is_last: bool = False) -> None:
        """Report the number of tops computed so far, at most about ten times per second."""
        nonlocal reported
        now = time.monotonic()
        if progress is not None and (is_last or now - reported >= _PROGRESS_SECONDS):
            reported = now
            progress(tops / total)

    def report_part(done: int, tops: int, share: float) -> None:
        report(done + share * tops)

    if executor is not None:
        _compute_parts_on_executor(store, parts, executor, report)
    else:
        done = 0
        with ThreadPoolExecutor(1) as writer:
            future: Future[None] | None = None
            for i in parts:
                tops = plan.list_tops_of_part(i)
                report_share = progress and partial(report_part, done, len(tops))
                outcome = plan.compute_results_of_tops(tops, threads, report_share)
                part = tabulate_sweep_part(plan, tops, outcome)
                with defer_signals():
                    if future is not None:
                        future.result()
                    future = writer.submit(store.write_part, i, part)
                done += len(tops)
        if future is not None:
            future.result()
    if parts:
        report(total, is_last=True)


def _compute_parts_on_executor(
    store: SweepStore, parts: Sequence[int], executor: Executor, report: Progress
) -> None:
    left, done, stopped = list(parts), 0, threading.Event()

    def raise_if_stopped(_: float) -> None:
        if stopped.is_set():
            raise KeyboardInterrupt

    def mark_part_as_done(i: int, future: Future[int]) -> None:
        nonlocal done
        tops = len(store.plan.list_tops_of_part(i))
        if not future.cancelled() and future.result() == tops and store.part_file_path(i).exists():
            left.remove(i)
            done += tops

    check = (raise_if_stopped,) if has_thread_workers(executor) else ()
    for _ in range(2):
        jobs = ((i, (compute_and_store_part, (store, i, *check))) for i in tuple(left))
        try:
            run_jobs(
                executor, jobs, _IN_FLIGHT, mark_part_as_done, lambda: report(done), stopped.set
            )
        except BrokenExecutor as error:
            raise PartsLostError(
                f"the executor failed with {format_count(len(left), 'part')} left, the first of "
                f"them part {left[0]}: {error}; the stored parts are kept, and repeating the call "
                "computes the others"
            ) from None
        finally:
            stopped.clear()
        if not left:
            return
    raise PartsLostError(
        f"the executor lost {format_count(len(left), 'part')}, the first of them part {left[0]}; "
        "all others are stored, and repeating the call computes the missing parts"
    )
