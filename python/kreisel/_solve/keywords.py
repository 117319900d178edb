"""Types of keyword arguments that several public functions share."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Executor
from typing import TypedDict

from .._options.solve_options import Progress
from .._utils.quantity_attributes import QuantityName
from .run import EventSpec


class PlanKeywords(TypedDict, total=False):
    """Arguments that control a method."""

    step: float | None
    tol: float | None
    digits: int | None
    every: int | None


class StreamKeywords(PlanKeywords, total=False):
    """Arguments of kreisel.stream for one scene."""

    max_steps: int
    want: Iterable[QuantityName] | None
    events: EventSpec | None
    progress: Progress | None


class SolveKeywords(StreamKeywords, total=False):
    """Arguments of kreisel.solve that apply both to one scene and to an ensemble."""

    error: float | None


class PoolKeywords(TypedDict, total=False):
    """Arguments that select the threads or the executor that run an ensemble."""

    threads: int | None
    executor: Executor | None
