"""The folder of a sweep: plan.json, what its tops start from where that is long, and the parts.

A name stands for a file that is whole and on the disk: it is written beside its place and renamed.
What is there already counts where it is a part of this plan, made by this version, with each bit as
it was sealed.

Files in the place of a part: the folder belongs to the plan in plan.json, and the names of parts in
it belong to the sweep. A file under such a name is replaced, with a warning, unless it is a whole
part of this plan and this number. Two things are never replaced: a folder, and a whole part of
another plan, which somebody may have computed for a long time. Files of other names are not
touched.
"""

from __future__ import annotations

import importlib
import io
import json
import os
import re
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np

from .._core import version
from .._utils.atomic_io import atomic_write, check_writable, sync_folder
from .._utils.validation import Array
from .checksum import add_checksum, is_whole
from .part_table import PartTable
from .sweep_plan import SweepPlan, hash_of, name_of, read

PLAN = "plan.json"
REPAIR = (
    "the same call of kreisel.sweep replaces it, read_sweep(folder, partial=True) leaves it out"
)
_MOVE = "it is not overwritten; move it away, or delete it, and call again"
_OURS = "sweep"
_LONGEST = 1 << 30  # bytes of a plan: none comes near
DONE, MISSING, DAMAGED, OLD = "done", "missing", "damaged", "of another version"
FOREIGN = "foreign"


class PartFormat(Protocol):
    """A file format of parts, implemented by the modules npy and parquet."""

    def encode(self, rows: PartTable, about: dict[str, Any]) -> bytearray: ...
    def about(self, file: str) -> dict[str, Any]: ...
    def decode(self, file: str, names: Iterable[str] | None, states: int) -> PartTable: ...


class SweepStore:
    """The folder of a plan."""

    def __init__(self, place: Path, plan: SweepPlan, form: str) -> None:
        self.place, self.plan, self.ending = place, plan, form
        self.form = cast(PartFormat, importlib.import_module(f"{__package__}.{form}"))

    def file(self, i: int) -> Path:
        """The name of a part."""
        return self.place / f"part-{i:06}.{self.ending}"

    def put(self, i: int, rows: PartTable) -> None:
        """Writes a part."""
        about = {
            "plan": self.plan.hash,
            "part": i,
            "version": version,
            "kernel": self.plan.kernel,
        }
        atomic_write(self.file(i), bytes(add_checksum(self.form.encode(rows, about))))

    def found(self) -> list[int]:
        """Return the numbers of the parts that have a file, in ascending order."""
        names = {entry.name for entry in os.scandir(self.place)}
        of_a_part = re.compile(rf"part-([0-9]{{6,}})\.{self.ending}")
        numbers = {int(match[1]) for match in map(of_a_part.fullmatch, names) if match}
        return sorted(i for i in numbers if i < self.plan.parts and self.file(i).name in names)

    def get(self, i: int, names: Iterable[str] | None = None) -> PartTable:
        """Return the rows of a part, or some of its columns. Raises ValueError if the part is
        damaged, or is not this part of this plan."""
        try:
            about = self.form.about(str(self.file(i)))
            if (about.get("plan"), about.get("part")) != (self.plan.hash, i):
                raise ValueError(f"{self.file(i)} is not part {i} of this plan")
            return self.form.decode(str(self.file(i)), names, self.plan.states)
        except ValueError as error:
            raise ValueError(f"{error}; {REPAIR}") from None

    def look(self, i: int) -> str:
        """Verify each bit of a part, and return DONE, MISSING, DAMAGED, OLD or FOREIGN."""
        file = self.file(i)
        try:
            data = file.read_bytes()
        except FileNotFoundError:
            return MISSING
        except IsADirectoryError:
            return FOREIGN
        if not is_whole(data):
            return DAMAGED
        try:
            about = self.form.about(str(file))
        except ValueError:
            return FOREIGN
        if about.get("plan") != self.plan.hash:
            return FOREIGN
        if about.get("part") != i:
            return DAMAGED
        return DONE if about.get("version") == version else OLD

    def refusal(self, i: int) -> FileExistsError:
        """Return the error for a part in whose place something foreign is."""
        file = self.file(i)
        if file.is_dir():
            return FileExistsError(f"{file} is a folder, in the place of part {i}: {_MOVE}")
        try:
            about = self.form.about(str(file))
        except ValueError:
            about = {}
        return FileExistsError(
            f"{file} is part {about.get('part')} of the plan {str(about.get('plan'))[:16]}, in the "
            f"place of part {i} of the plan {self.plan.hash[:16]}: {_MOVE}"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return _open_cached, (str(self.place), self.plan.hash)


def open_store(place: str | os.PathLike[str], expected: str | None = None) -> SweepStore:
    """The folder of a sweep as it stands there; ValueError where it is none, or of another plan
    than expected."""
    where = Path(os.path.abspath(place))
    told = _describe_file(where)
    plan = _prefix_name(where, told)
    if expected is not None and plan.hash != expected:
        raise ValueError(f"{where} has the plan {plan.hash[:16]} now, not {expected[:16]}")
    return SweepStore(where, plan, told["form"])


@lru_cache(maxsize=4)
def _open_cached(place: str, expected: str) -> SweepStore:
    """Open the store once for all tasks of a worker process."""
    return open_store(place, expected)


def _describe_file(where: Path) -> dict[str, Any]:
    """plan.json; ValueError for what is none."""
    file = where / PLAN
    if not where.is_dir():
        raise FileNotFoundError(f"there is no folder {where}")
    if not file.is_file():
        raise ValueError(f"{where} is no folder of a sweep: it has no {PLAN}")
    try:
        with open(file, "rb") as plan:
            told = json.loads(plan.read(_LONGEST))
    except (ValueError, RecursionError):
        told = None
    if not isinstance(told, dict) or told.get("kreisel") != _OURS:
        raise ValueError(f"{file} is no plan of a sweep")
    if told.get("hash") != hash_of(told.get("plan", {})):
        raise ValueError(f"{file} is damaged: its plan has not the hash that it says")
    if told.get("form") not in ("parquet", "npy"):
        raise ValueError(f"{file}: parts are written as parquet or npy, not {told.get('form')!r}")
    return told


def _prefix_name(where: Path, told: dict[str, Any]) -> SweepPlan:
    try:
        return read(told["plan"], lambda name: _starts(where / name))
    except ValueError as error:
        raise ValueError(f"{where / PLAN}: {error}") from None


def _starts(file: Path) -> Array:
    """Numbers that are too many for the plan itself; they are what their name says."""
    values: Array = np.load(file, allow_pickle=False)
    if name_of(values) != file.name:
        raise ValueError(f"{file} is damaged: its numbers are not those of its name")
    return values


def create_or_open(place: str | os.PathLike[str], plan: SweepPlan) -> SweepStore:
    """The folder for this plan: made where there is none, or as it stands there from before.
    ValueError where it is of another plan, FileExistsError where it is of something else, OSError
    where nothing can be written."""
    where = Path(os.path.abspath(place))
    if where.exists() and not where.is_dir():
        raise FileExistsError(f"{where} is no folder")
    if not (where / PLAN).exists():
        _begin(where, plan)
    told = _describe_file(where)
    if told["hash"] != plan.hash:
        raise ValueError(_plan_mismatch(where, told, plan))
    check_writable(where / PLAN)
    _put_starts(where, plan)
    return SweepStore(where, plan, told["form"])


def _begin(where: Path, plan: SweepPlan) -> None:
    """Puts the plan into an empty folder, or a new one."""
    if where.is_dir():
        names = sorted(each.name for each in where.iterdir() if not each.name.startswith("."))
        strange = [name for name in names if name != PLAN and not name.startswith("starts-")]
        if strange:
            raise FileExistsError(
                f"{where} is no folder of a sweep, and it is not empty: it has {strange[0]!r}"
            )
    else:
        where.mkdir()
        sync_folder(where.parent)
    _put_starts(where, plan)
    told = {
        "kreisel": _OURS,
        "version": version,
        "hash": plan.hash,
        "form": _best_form(),
        "tops": plan.source.size,
        "parts": plan.parts,
    }
    plan_lines = _in_lines(plan.told, 1)
    told_lines = _in_lines(told, 0)[:-2]
    _put_first(where / PLAN, f'{told_lines},\n"plan": {plan_lines}\n}}\n'.encode())


def _put_starts(where: Path, plan: SweepPlan) -> None:
    """Writes what is too long for the plan itself, and is not there."""
    for values in plan.arrays:
        file = where / name_of(values)
        if not file.exists():
            out = io.BytesIO()
            np.lib.format.write_array(out, np.ascontiguousarray(values), allow_pickle=False)
            atomic_write(file, out.getvalue())


def _in_lines(told: Mapping[str, Any], deep: int) -> str:
    """JSON with a line for each name."""
    space = " " * deep
    lines = (f"{space}{json.dumps(name)}: {json.dumps(value)}" for name, value in told.items())
    return "{\n" + ",\n".join(lines) + "\n}"


def _best_form() -> str:
    try:
        import pyarrow  # noqa: F401  whether it is there is all that counts
    except ModuleNotFoundError:
        return "npy"
    return "parquet"


def _put_first(file: Path, data: bytes) -> None:
    """Writes a file unless another was quicker, whose file then stands."""
    new = file.with_name(f".{os.urandom(8).hex()}.plan.new")
    atomic_write(new, data)
    try:
        os.link(new, file)
    except FileExistsError:
        pass
    except OSError:  # a disk that has no links
        if not file.exists():
            os.replace(new, file)
    finally:
        new.unlink(missing_ok=True)


def _plan_mismatch(where: Path, told: dict[str, Any], plan: SweepPlan) -> str:
    """Describe the differences between two plans."""
    there, here = told["plan"], plan.told
    names = [name for name in sorted({*there, *here}) if there.get(name) != here.get(name)]
    lines = [
        f"  {name}: {_short(there.get(name))} there, {_short(here.get(name))} here"
        for name in names
    ]
    return "\n".join(
        [
            f"{where} is of another plan: {told['hash'][:16]} there, {plan.hash[:16]} here; in",
            *lines,
            "give another folder, or the plan that is there",
        ]
    )


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 120 else f"{text[:100]} ... {text[-16:]}"
