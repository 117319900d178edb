"""The folder of a sweep, the Parquet files of its parts, and their computation.

A file has one row per top. If a column has several values or events per top, each cell contains a
list. To improve compression, the eight bytes of each double are stored in separate streams.
"""

from __future__ import annotations

import io
import json
import os
import re
import threading
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._core import Worker, version
from .._results.tables import TableColumn
from .._utils import files
from .._utils.arguments import Array, format_count, optional_dependency, warn_user
from .._utils.processes import Progress, defer_signals, has_thread_workers, run_jobs
from . import plan as plans
from .plan import DAMAGED, DONE, EVENT, OLD, REPAIR, TIMES, TOP, SweepPlan
from .source import PARQUET

with optional_dependency(PARQUET):
    import pyarrow as pa
    import pyarrow.parquet as parquet

if TYPE_CHECKING:
    from pyarrow import Table

PLAN = "plan.json"
_PROGRAM = "sweep"  # the value of the entry "kreisel" in a plan file
_MAX_BYTES = 1 << 30  # limit of bytes read, because the file could be an endless device
_GROUP = 1 << 16  # number of rows that a reader decodes together: a row group of Parquet
_ABOUT, _CHECKSUM = "kreisel", "kreisel seal"  # keys in the metadata of a file
_DIMS = {dims[-1].encode(): dims for dims in (TOP, TIMES, EVENT)}
# Maximal number of unfinished parts submitted to an executor. It exceeds the number of workers of
# most executors, so no worker waits. It is small, because an exception must cancel these parts.
_IN_FLIGHT = 256
_PROGRESS_SECONDS = 0.1  # minimal time between two calls of progress


def make_arrow_table(columns: Sequence[TableColumn]) -> Table:
    """Return a table with one row per top; the metadata of columns have `units` and `per`."""
    arrays, fields = [], []
    for name, dims, values, unit, *_ in columns:
        array = pa.array(values.reshape(-1))
        if dims == TIMES:
            offsets = np.arange(len(values) + 1) * values.shape[1]
        elif dims == EVENT:
            [counts] = (column.values for column in columns if column.name == plans.COUNT)
            offsets = np.concatenate([[0], np.cumsum(counts)])
        if dims != TOP:
            array = pa.LargeListArray.from_arrays(pa.array(offsets.astype(np.int64)), array)
        arrays.append(array)
        metadata = {"units": unit, "per": dims[-1]}
        fields.append(pa.field(name, array.type, metadata=metadata))
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def _parse_description(metadata: Mapping[bytes, bytes] | None) -> dict[str, Any]:
    try:
        return dict(json.loads((metadata or {})[_ABOUT.encode()]))
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"it is not a part of a sweep: {error}") from None


class SweepStore:
    """The folder in which the files of a sweep are stored."""

    def __init__(self, folder: Path, plan: SweepPlan) -> None:
        self.folder, self.plan = folder, plan

    def part_file_path(self, i: int) -> Path:
        return self.folder / f"part-{i:06}.parquet"

    def write_part(self, i: int, columns: Sequence[TableColumn]) -> None:
        """Write the file of part i, with a description and a checksum."""
        options, kernel = self.plan.options, ""  # the instruction set of Taylor series
        if options.error is None:
            kernel = Worker(*options.core_arguments, []).kernel[0]
        words = {"plan": self.plan.hash, "part": i, "version": version, "kernel": kernel}
        table, stream = make_arrow_table(columns), pa.BufferOutputStream()
        doubles = [
            name if dims == TOP else f"{name}.list.element"
            for name, dims, values, *_ in columns
            if values.dtype == np.float64
        ]
        with parquet.ParquetWriter(
            stream,
            table.schema,
            compression="zstd",
            compression_level=1,
            use_dictionary=False,
            use_byte_stream_split=doubles,
            write_page_checksum=True,
        ) as writer:
            writer.write_table(table, row_group_size=_GROUP)
            writer.add_key_value_metadata({_ABOUT: json.dumps(words), _CHECKSUM: files.PLACEHOLDER})
        data = files.fill_in_checksum(bytearray(stream.getvalue()))
        files.atomic_write(self.part_file_path(i), bytes(data))

    def list_existing_parts(self) -> list[int]:
        """Return the numbers of all parts whose files exist, in ascending order."""
        names = os.listdir(self.folder)
        matches = (re.fullmatch(r"part-([0-9]{6}|[1-9][0-9]{6,})\.parquet", one) for one in names)
        numbers = (int(match[1]) for match in matches if match)
        return sorted(i for i in numbers if i < self.plan.parts)

    def read_part(self, i: int, names: list[str] | None = None) -> dict[str, TableColumn]:
        """Read part `i` or only its columns `names`; [] gives all columns without rows."""
        file, expected = self.part_file_path(i), {"plan": self.plan.hash, "part": i}
        try:
            with (
                pa.OSFile(os.fsencode(file)) as stream,  # pyarrow refuses a str that is not UTF-8
                parquet.ParquetFile(stream, page_checksum_verification=True) as source,
            ):
                description = _parse_description(source.metadata.metadata)
                if any(description.get(name) != value for name, value in expected.items()):
                    raise ValueError(f"it is not part {i} of this plan")
                table = source.schema_arrow.empty_table() if names == [] else source.read(names)
            missing = {*(names or ())} - {*table.column_names}
            if missing:
                raise ValueError(f"it has no {', '.join(sorted(missing))}")
            columns = {}
            for field, column in zip(table.schema, table.columns, strict=True):
                array, metadata = column.combine_chunks(), field.metadata or {}
                dims = _DIMS.get(metadata.get(b"per", b""))
                if dims is None or pa.types.is_primitive(field.type) != (dims == TOP):
                    raise ValueError(f"its schema does not specify the shape of {field.name!r}")
                flat = array if dims == TOP else array.flatten()
                values = flat.to_numpy(zero_copy_only=False)
                if dims != EVENT:
                    values = values.reshape(len(array), *[self.plan.states] * (dims == TIMES))
                unit = metadata.get(b"units", b"").decode()
                columns[field.name] = TableColumn(field.name, dims, values, unit)
        except (pa.ArrowException, OSError, AttributeError, TypeError, ValueError) as error:
            # Parquet has no checksum of the schema, so a damaged one can cause any of these errors.
            raise ValueError(
                f"{file} is damaged, or not a part of this sweep: {error}; {REPAIR}"
            ) from None
        return columns

    def determine_part_status(self, i: int, refuses_foreign: bool = False) -> str:
        """Verify part i, and return its status, or raise FileExistsError for a foreign file."""
        file = self.part_file_path(i)
        try:
            data = file.read_bytes()
        except FileNotFoundError:
            return plans.MISSING
        except IsADirectoryError:
            found = "a folder"
        else:
            if not files.has_correct_checksum(data):
                return DAMAGED
            try:
                metadata = parquet.read_metadata(pa.BufferReader(data)).metadata
                description = _parse_description(metadata)
            except (pa.ArrowException, OSError, ValueError):
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
        return plans.FOREIGN

    def __reduce__(self) -> tuple[Any, ...]:
        return _open_cached_store, (str(self.folder), self.plan.hash)


def open_sweep_store(folder: str | os.PathLike[str], expected: str | None = None) -> SweepStore:
    """Open the folder of a sweep, whose plan must have the hash `expected`, if given."""
    root = Path(os.path.abspath(folder))
    content = _read_plan_file(root)

    def read_parameter_array(name: str) -> Array:
        values: Array = np.load(root / name, allow_pickle=False)
        if plans.name_array_file(values) != name:
            raise ValueError(f"{root / name} is damaged: its numbers do not match its name")
        return values

    try:
        plan = plans.build_plan_from_dict(content["plan"], read_parameter_array)
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
    if content.get("hash") != plans.hash_plan(content.get("plan", {})):
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
    files.check_file_is_writable(root / PLAN)
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
        files.sync_folder(root.parent)
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
    files.atomic_write(new, f'{{\n{head},\n"plan": {{\n{body}\n}}\n}}\n'.encode())
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
        if one.values.size > plans.MAX_INLINE:
            file, buffer = root / plans.name_array_file(one.values), io.BytesIO()
            if not file.exists():
                values = np.ascontiguousarray(one.values)
                np.lib.format.write_array(buffer, values, allow_pickle=False)
                files.atomic_write(file, buffer.getvalue())


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


def compute_and_store_part(store: SweepStore, i: int, progress: Progress | None = None) -> int:
    """Compute part i in a single thread and write its file; return the number of tops."""
    tops = store.plan.list_tops_of_part(i)
    store.write_part(i, store.plan.compute_part(tops, 1, progress))
    return len(tops)


def compute_parts(
    store: SweepStore,
    part_range: range,
    threads: int,
    executor: Executor | None,
    progress: Progress | None,
) -> None:
    """Compute the parts that are missing, damaged or outdated, and write their files.

    Without an executor, a second thread writes a part while the next part is being computed. Parts
    that an executor failed to complete are submitted a second time. Raises RuntimeError if the
    executor fails, or if some parts are still missing after the second attempt. Warns about damaged
    and outdated files.
    """
    plan, last_call, done = store.plan, 0.0, 0
    states = {i: store.determine_part_status(i, refuses_foreign=True) for i in part_range}
    parts = [i for i, status in states.items() if status != DONE]
    for status in (DAMAGED, OLD):
        if numbers := [i for i in parts if states[i] == status]:
            more = f" and {len(numbers) - 1} more" if numbers[1:] else ""
            warn_user(f"{store.folder}: part {numbers[0]}{more} computed again, {status}")
    total = sum(len(plan.list_tops_of_part(i)) for i in parts)

    def report(tops: float, is_last: bool = False) -> None:
        """Report the number of tops computed so far, at most about ten times per second."""
        nonlocal last_call
        now = time.monotonic()
        if progress is not None and (is_last or now - last_call >= _PROGRESS_SECONDS):
            last_call = now
            progress(tops / total)

    if executor is not None:
        _compute_parts_on_executor(store, parts, executor, report)
    else:
        with ThreadPoolExecutor(1) as writer:
            future: Future[None] | None = None
            for i in parts:
                tops = plan.list_tops_of_part(i)

                def report_share(share: float, before: int = done, size: int = len(tops)) -> None:
                    report(before + share * size)

                columns = plan.compute_part(tops, threads, progress and report_share)
                with defer_signals():
                    if future is not None:
                        future.result()
                    future = writer.submit(store.write_part, i, columns)
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
    failure: BrokenExecutor | None = None
    for _ in range(2):
        jobs = ((i, (compute_and_store_part, (store, i, *check))) for i in tuple(left))
        try:
            run_jobs(
                executor, jobs, _IN_FLIGHT, mark_part_as_done, lambda: report(done), stopped.set
            )
        except BrokenExecutor as error:
            failure = error
            break
        finally:
            stopped.clear()
        if not left:
            return
    count = format_count(len(left), "part")
    finding = f"failed with {count} left ({failure})" if failure else f"lost {count}"
    raise RuntimeError(
        f"the executor {finding}, the first of them part {left[0]}; all others are stored, and "
        "repeating the call computes the missing parts"
    )
