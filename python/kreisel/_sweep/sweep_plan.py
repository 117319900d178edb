"""The plan of a sweep, which contains everything that determines the contents of its parts.

The plan is stored as canonical JSON together with a hash. The machine, the executor and the number
of threads do not affect the results, and are not part of the plan.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .._core import Worker
from .._model.broadcasting import BatchParameter
from .._model.scene import Ensemble, Scene
from .._options.ensemble_options import EnsembleOptions
from .._options.solve_options import Progress
from .._options.times import get_total_memory
from .._utils.validation import Array, as_int
from .source import Places, RandomSpec, Source
from .task import SweepTask, TaskResult, build_task_from_dict

FORMAT = 1  # version of the layout of plans and parts
_MAX_PART, _PART_BYTES = 1 << 17, 1 << 26  # default limits of tops and bytes in a part
_MAX_INLINE = 1 << 16  # numbers in an array; a longer array is stored in a separate file
_ROW_BYTES = 64  # estimated bytes per top for its index, parameters and status


@dataclass(frozen=True, eq=False)
class SweepPlan:
    """The plan of a sweep: a source of tops, a task, and the number of tops per part.

    `sample` contains the indices and the ensemble of the tops on which the plan was validated.
    """

    source: Source
    task: SweepTask
    part_size: int
    options: EnsembleOptions
    times: Array
    sample: tuple[Places, Ensemble]

    @cached_property
    def states(self) -> int:
        """The number of states per top."""
        return int(self.times.size)

    @cached_property
    def parts(self) -> int:
        """The number of parts."""
        return -(-self.source.size // self.part_size)

    def list_tops_of_part(self, i: int) -> range:
        """Return the indices of the tops of part `i`."""
        begin = i * self.part_size
        return range(begin, min(begin + self.part_size, self.source.size))

    def count_tops_in_parts(self, parts: Sequence[int]) -> int:
        """Return the total number of tops in the given parts."""
        shortage = self.parts * self.part_size - self.source.size if self.parts - 1 in parts else 0
        return len(parts) * self.part_size - shortage

    @cached_property
    def as_json(self) -> dict[str, Any]:
        """The plan as a JSON object."""
        source = self.source
        random = source._random
        plan: dict[str, Any] = {
            "format": FORMAT,
            "scene": source.scene.to_toml(),
            "shape": list(source.shape),
            "axes": list(source.axes),
            "parameters": _list_parameters_as_json(source._parameters.values()),
            "varied": _list_varying_names_as_json(source),
            "flags": dict(source._flags),
            "part_size": self.part_size,
        } | self.task.as_json
        if random is not None:
            plan["random"] = {
                "seed": random.seed,
                "ranges": _list_parameters_as_json(random.ranges.values()),
                "widths": dict(random.widths),
            }
        return plan

    @cached_property
    def hash(self) -> str:
        """The SHA-256 hash of the plan's canonical JSON."""
        return hash_plan(self.as_json)

    @property
    def long_parameter_arrays(self) -> list[Array]:
        """The arrays of parameter values that are too long to be stored in the plan file."""
        parameters = *self.source._parameters.values(), *self.source._varied.values()
        return [one.values for one in parameters if one.values.size > _MAX_INLINE]

    @cached_property
    def kernel(self) -> str:
        """The instruction set that is used to evaluate Taylor series on this machine.

        All instruction sets with fused multiply-add give bitwise identical results.
        """
        return (
            ""
            if self.options.has_step_search
            else Worker(*self.options.core_arguments, []).kernel[0]
        )

    def build_ensemble_of_tops(self, tops: range) -> Ensemble:
        """Return an ensemble of the tops with the given indices.

        The sample ensemble used to validate the plan is reused if it contains exactly the requested
        tops.
        """
        places, ensemble = self.sample
        if len(places) == len(tops) and (places[0], places[-1]) == (tops[0], tops[-1]):
            return ensemble
        return self.source[tops.start : tops.stop]

    def compute_results_of_tops(
        self, tops: range, threads: int, progress: Progress | None
    ) -> TaskResult:
        """Run the task of the sweep on the tops with the given indices, and return the results.

        Raises TypeError or ValueError for the first invalid top; the message states its index.
        """
        try:
            ensemble = self.build_ensemble_of_tops(tops)
            return self.task.compute_results_of_tops(
                ensemble, self.options, self.times, threads, progress
            )
        except (TypeError, ValueError) as error:
            places = np.arange(tops.start, tops.stop, dtype=np.int64)
            raise self.source._find_error_of_first_invalid_top(
                self.task.validate_options_and_times, places, error
            ) from None


def hash_plan(plan: Mapping[str, Any]) -> str:
    """Return the SHA-256 hash of a plan's canonical JSON."""
    return hashlib.sha256(dump_canonical_json(plan).encode()).hexdigest()


def dump_canonical_json(plan: Mapping[str, Any]) -> str:
    """Return a plan as JSON with sorted keys and without spaces; equal plans give equal text."""
    return json.dumps(plan, sort_keys=True, separators=(",", ":"), allow_nan=False)


def make_file_name_from_array_hash(values: Array) -> str:
    """Return the file name of an array, which is derived from a hash of its shape and values."""
    digest = hashlib.sha256(str(values.shape).encode())
    digest.update(np.ascontiguousarray(values, dtype="<f8").data)
    return f"starts-{digest.hexdigest()}.npy"


def _list_parameters_as_json(parameters: Iterable[BatchParameter]) -> list[list[Any]]:
    """Return the name, the shape and the values of each parameter, and True if it is in degrees.

    If an array is too long for the plan file, it is replaced by the name of the file that contains
    it.
    """
    return [
        [
            one.name,
            list(one.value),
            make_file_name_from_array_hash(one.values)
            if one.values.size > _MAX_INLINE
            else one.values.tolist(),
            *[True] * one.degrees,
        ]
        for one in parameters
    ]


def _list_varying_names_as_json(source: Source) -> list[str | list[Any]]:
    """Return the names of the varying parameters as JSON data.

    The values of a parameter are stored with its name unless the plan already contains them.
    """
    return [
        name if source._parameters.get(name) is one else _list_parameters_as_json([one])[0]
        for name, one in source._varied.items()
    ]


def make_sweep_plan(source: Source, task: SweepTask, part_size: int | None = None) -> SweepPlan:
    """Return the plan for a sweep, after validating it on a sample of the tops.

    Raises TypeError or ValueError if the task or a top is invalid. Raises MemoryError if a part
    does not fit in memory.
    """
    sample = source._choose_validation_tops()
    try:
        ensemble = source._build_tops(sample)
        options, times = task.validate_options_and_times(ensemble)
    except (TypeError, ValueError) as error:
        raise source._find_error_of_first_invalid_top(
            task.validate_options_and_times, sample, error
        ) from None
    states = times.shape[-1]
    results = 8 * len(options.reductions) or states * (8 + options.bytes_per_state)
    row = _ROW_BYTES + results
    if part_size is None:
        size = max(1, min(_MAX_PART, _PART_BYTES // row))
    else:
        size = as_int("part_size", part_size, 1)
    byte_count = min(size, source.size) * row
    if byte_count > get_total_memory():
        raise MemoryError(
            f"a part of {size} tops with {states} states each needs {1e-9 * byte_count:.3g} GB, "
            "more than this machine has: use smaller parts, fewer times or fewer quantities"
        )
    return SweepPlan(
        source, task.normalize_arguments(options), size, options, times, (sample, ensemble)
    )


def build_plan_from_dict(plan: Mapping[str, Any], load: Callable[[str], Array]) -> SweepPlan:
    """Return the plan stored in a JSON object.

    `load` reads an array, given the name of its file. Raises ValueError if the object is not a
    plan, or has the format of a different version of kreisel.
    """
    try:
        source, task = _build_sweep_source_from_dict(plan, load), build_task_from_dict(plan)
        result = make_sweep_plan(source, task, plan["part_size"])
    except (KeyError, TypeError) as error:
        raise ValueError(f"it is not a plan of a sweep: {error}") from None
    if result.hash != hash_plan(plan):
        raise ValueError("it is a plan in a format of another version")
    return result


def _build_sweep_source_from_dict(plan: Mapping[str, Any], load: Callable[[str], Array]) -> Source:
    def build_batch_parameters(rows: list[list[Any]]) -> dict[str, BatchParameter]:
        parameters = {}
        for name, value, numbers, *degrees in rows:
            is_file = isinstance(numbers, str)
            values = load(numbers) if is_file else np.asarray(numbers, np.float64)
            if not np.isfinite(values).all():
                raise ValueError(f"{name} must be finite")
            parameters[name] = BatchParameter(name, values, tuple(value), bool(degrees))
        return parameters

    random = None
    if "random" in plan:
        spec = plan["random"]
        random = RandomSpec(spec["seed"], build_batch_parameters(spec["ranges"]), spec["widths"])
    parameters = build_batch_parameters(plan["parameters"])
    varied: dict[str, BatchParameter] = {}
    for row in plan["varied"]:
        varied |= {row: parameters[row]} if isinstance(row, str) else build_batch_parameters([row])
    scene, shape, axes = Scene.from_toml(plan["scene"]), tuple(plan["shape"]), tuple(plan["axes"])
    return Source(scene, shape, axes, parameters, varied, plan["flags"], random)
