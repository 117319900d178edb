"""The folder of a sweep, which contains plan.json, long parameter arrays, and the parts.

Each file is written under a temporary name and then renamed, so a file with its final name is
always complete. An existing part is valid if it belongs to the plan, was written by the same
version of kreisel, and has a correct checksum.

The names of the part files are reserved; do not use them for other files in the folder of the
sweep. If a file has the name of a part but invalid contents, it is replaced, and a warning is
issued. Neither folders nor complete parts of a different plan are ever replaced, because they may
be the results of long computations. All other files in the folder are left unchanged.
"""

from __future__ import annotations

import io
import json
import os
import re
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from .._core import version
from .._utils.atomic_io import atomic_write, check_file_is_writable, sync_folder
from .._utils.validation import Array
from .checksum import fill_in_checksum, has_correct_checksum
from .part_table import PartResults
from .sweep_plan import SweepPlan, build_plan_from_dict, hash_plan, make_file_name_from_array_hash

PLAN = "plan.json"
REPAIR = (
    "repeating the call of kreisel.sweep replaces it, and read_sweep(folder, partial=True) skips it"
)
_MOVE = "it is not overwritten; move or delete it, and call again"
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
        """Return the file path of part i."""
        return self.folder / f"part-{i:06}.parquet"

    def write_part(self, i: int, part: PartResults) -> None:
        """Write part i to a file that includes a checksum."""
        description = {
            "plan": self.plan.hash,
            "part": i,
            "version": version,
            "kernel": self.plan.kernel,
        }
        atomic_write(
            self.part_file_path(i),
            bytes(fill_in_checksum(self._format.encode_part_as_parquet(part, description))),
        )

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
        """Read part `i` of the sweep from its file, or only the columns `names` of this part.

        If `names` is an empty list, the returned table has all columns but no rows. Raises
        ValueError if the file is damaged, or is not part i of this plan.
        """
        expected = {"plan": self.plan.hash, "part": i}
        try:
            return self._format.decode_part_from_parquet(
                str(self.part_file_path(i)), expected, names, self.plan.states
            )
        except ValueError as error:
            raise ValueError(f"{error}; {REPAIR}") from None

    def determine_part_status(self, i: int) -> str:
        """Verify part i, and return its status."""
        try:
            data = self.part_file_path(i).read_bytes()
        except FileNotFoundError:
            return MISSING
        except IsADirectoryError:
            return FOREIGN
        if not has_correct_checksum(data):
            return DAMAGED
        try:
            description = self._format.read_part_description(data)
        except ValueError:
            return FOREIGN
        if description.get("plan") != self.plan.hash:
            return FOREIGN
        if description.get("part") != i:
            return DAMAGED
        return DONE if description.get("version") == version else OLD

    def make_misplaced_file_error(self, i: int) -> FileExistsError:
        """Return the exception for a file or folder that wrongly has the name of part i."""
        file = self.part_file_path(i)
        if file.is_dir():
            return FileExistsError(f"{file} is a folder, in the place of part {i}: {_MOVE}")
        try:
            description = self._format.read_part_description(file.read_bytes())
        except ValueError:
            description = {}
        return FileExistsError(
            f"{file} is part {description.get('part')} of the plan "
            f"{str(description.get('plan'))[:16]}, in the place of part {i} of the plan "
            f"{self.plan.hash[:16]}: {_MOVE}"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return _open_cached_store, (str(self.folder), self.plan.hash)


def open_sweep_store(folder: str | os.PathLike[str], expected: str | None = None) -> SweepStore:
    """Open the folder of a sweep.

    Raises ValueError if `folder` contains no sweep, or if the hash of the plan differs from
    `expected`.
    """
    root = Path(os.path.abspath(folder))
    content = _read_plan_file(root)
    try:
        plan = build_plan_from_dict(
            content["plan"], lambda name: _read_parameter_array(root / name)
        )
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
    """Return the contents of the plan file in a folder.

    Raises FileNotFoundError if the folder does not exist, and ValueError if the plan file is
    missing or damaged.
    """
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


def _read_parameter_array(file: Path) -> Array:
    """Read a large array of parameter values from the file that contains it.

    Raises ValueError if the hash of the array does not match the hash in the file name.
    """
    values: Array = np.load(file, allow_pickle=False)
    if make_file_name_from_array_hash(values) != file.name:
        raise ValueError(f"{file} is damaged: its numbers do not match its name")
    return values


def create_or_open_sweep_store(folder: str | os.PathLike[str], plan: SweepPlan) -> SweepStore:
    """Create the folder of a plan, or open the folder if it already exists.

    Raises ValueError if the folder contains a sweep with a different plan. Raises FileExistsError
    if the folder is neither empty nor the folder of a sweep. Raises OSError if the folder cannot be
    written, and ImportError if pyarrow is not installed.
    """
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
    """Write the plan to a new or empty folder.

    Returns False if another process has written a plan to the folder in the meantime.
    """
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
    plan_lines, lines = (
        _format_json_one_entry_per_line(plan.as_json, 1),
        _format_json_one_entry_per_line(content, 0)[:-2],
    )
    return _write_file_if_missing(root / PLAN, f'{lines},\n"plan": {plan_lines}\n}}\n'.encode())


def _write_parameter_arrays(root: Path, plan: SweepPlan) -> None:
    """Write each array that is too long for the plan file to a separate file."""
    for values in plan.long_parameter_arrays:
        file = root / make_file_name_from_array_hash(values)
        if not file.exists():
            buffer = io.BytesIO()
            np.lib.format.write_array(buffer, np.ascontiguousarray(values), allow_pickle=False)
            atomic_write(file, buffer.getvalue())


def _format_json_one_entry_per_line(content: Mapping[str, Any], indent: int) -> str:
    """Return a JSON object as text, with one entry per line."""
    space = " " * indent
    lines = [f"{space}{json.dumps(name)}: {json.dumps(value)}" for name, value in content.items()]
    return "{\n" + ",\n".join(lines) + "\n}"


def _write_file_if_missing(file: Path, data: bytes) -> bool:
    """Write a file unless it already exists. Returns True if the file has been written."""
    new = file.with_name(f".{os.urandom(8).hex()}.plan.new")
    atomic_write(new, data)
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


def _describe_plan_mismatch(root: Path, content: dict[str, Any], plan: SweepPlan) -> str:
    """Return a message that describes how the plan in a folder differs from `plan`."""
    entries, plan_entries = content["plan"], plan.as_json
    names = [
        name
        for name in sorted({*entries, *plan_entries})
        if entries.get(name) != plan_entries.get(name)
    ]
    lines = [
        f"  {name}: {_shorten_json(entries.get(name))} there, "
        f"{_shorten_json(plan_entries.get(name))} here"
        for name in names
    ]
    return "\n".join(
        [
            f"{root} is of another plan: {content['hash'][:16]} there, {plan.hash[:16]} here; in",
            *lines,
            "use another folder, or the plan in this folder",
        ]
    )


def _shorten_json(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 120 else f"{text[:100]} ... {text[-16:]}"
