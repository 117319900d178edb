"""Types of keyword arguments that are shared by several public functions."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Executor
from typing import TypedDict

from .._options.solve_options import Progress
from .._utils.quantity_attributes import QuantityName
from .run import EventSpec


class MethodKeywords(TypedDict, total=False):
    """Keyword arguments that control the integration method."""

    step: float | None
    tol: float | None
    digits: int | None
    every: int | None


class StreamKeywords(MethodKeywords, total=False):
    """Keyword arguments of kreisel.stream for a single scene."""

    max_steps: int
    want: Iterable[QuantityName] | None
    events: EventSpec | None
    progress: Progress | None


class SolveKeywords(StreamKeywords, total=False):
    """Keyword arguments of kreisel.solve that apply to both single scenes and ensembles."""

    error: float | None


class PoolKeywords(TypedDict, total=False):
    """Keyword arguments that select the threads or the executor used to run an ensemble."""

    threads: int | None
    executor: Executor | None
