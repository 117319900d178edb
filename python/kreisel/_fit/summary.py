"""Summaries of fits as text and as HTML."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import Protocol

from .._utils.html import format_html_table


class HasSigma(Protocol):
    """Interface of a measured quantity, with the attributes required to summarize a fit."""

    @property
    def sigma(self) -> object: ...


class RecordLike(Protocol):
    """Interface of a record, with the attributes required to summarize a fit."""

    @property
    def series(self) -> Sequence[HasSigma]: ...

    @property
    def size(self) -> int: ...
    @property
    def missing(self) -> int: ...


class FitLike(Protocol):
    """Interface of a fit, with the attributes required to format its summary."""

    @property
    def records(self) -> Sequence[RecordLike]: ...
    @property
    def names(self) -> Sequence[str]: ...
    @property
    def units(self) -> Sequence[str]: ...
    @property
    def values(self) -> dict[str, float]: ...
    @property
    def error(self) -> dict[str, float]: ...
    @property
    def moment_ratios(self) -> dict[str, tuple[float, float]]: ...
    @property
    def chi2(self) -> float: ...
    @property
    def dof(self) -> int: ...
    @property
    def residual_correlation(self) -> float: ...
    @property
    def inflation(self) -> float: ...
    @property
    def nonlinearity(self) -> float: ...
    @property
    def unidentified(self) -> Sequence[str]: ...
    @property
    def ambiguous(self) -> Sequence[str]: ...
    @property
    def misfit(self) -> float: ...
    @property
    def excess(self) -> float: ...
    @property
    def is_plausible(self) -> bool | None: ...
    @property
    def uncertain_sigma(self) -> Sequence[str]: ...
    @property
    def at_bound(self) -> Sequence[str]: ...
    @property
    def has_converged(self) -> bool: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def piece_starts(self) -> Sequence[float]: ...


_MISFIT = 100.0  # chi2 per degree of freedom from which the model is wrong
_AS_LARGE = 0.5  # residuals relative to the values that no motion explains
_CORRELATED = 0.2  # correlation of neighbouring residuals that is mentioned
_ENLARGED = 1.05  # inflation that is mentioned
_NONLINEAR = 0.3  # deviation of the rise of chi2 along one sigma that is mentioned


def format_fit_summary(fit: FitLike) -> str:
    """Return the summary: a row for each parameter, then sentences about the quality of the fit."""
    rows = _list_parameter_rows(fit)
    width = max(len(name) for name, *_ in rows)
    lines = [f"  {name:<{width}}  {value} {unit}".rstrip() for name, value, unit in rows]
    return "\n".join([_format_summary_head(fit), *lines, *_list_fit_quality_sentences(fit)])


def format_fit_summary_as_html(fit: FitLike) -> str:
    """Return the summary as HTML, with the parameters in a table."""
    head, *sentences = [
        f"<p>{escape(text)}</p>"
        for text in (_format_summary_head(fit), *_list_fit_quality_sentences(fit))
    ]
    table = format_html_table(_list_parameter_rows(fit), ("parameter", "value", "unit"))
    return "\n".join([head, table, *sentences])


def _format_summary_head(fit: FitLike) -> str:
    count = sum(record.size for record in fit.records)
    verdict = {True: " (plausible)", False: " (not plausible)", None: ""}[fit.is_plausible]
    return (
        f"Fit of {len(fit.names)} parameters to {count} numbers: "
        f"chi2 {fit.chi2 / fit.dof:.3g} per degree of freedom{verdict}, {fit.evaluations} paths"
    )


def _list_parameter_rows(fit: FitLike) -> list[tuple[str, str, str]]:
    """Return rows (name, value ± error, unit), also of moment ratios if an error is infinite."""
    ratios = {} if all(map(math.isfinite, fit.error.values())) else fit.moment_ratios
    rows = [
        (
            name,
            format_value_with_error(fit.values[name], fit.error[name]),
            f"[{unit}]" if unit else "",
        )
        for name, unit in zip(fit.names, fit.units, strict=True)
    ]
    return rows + [(name, format_value_with_error(*pair), "") for name, pair in ratios.items()]


def format_value_with_error(value: float, error: float) -> str:
    """Return a value and its error as text, with as many digits as are significant."""
    if not math.isfinite(error):
        return "not identified"
    if not error > 0.0:
        return f"{value:.12g} +- {error:.2g}"
    size = max(abs(value), error)
    digits = min(max(2 + math.floor(math.log10(size)) - math.floor(math.log10(error)), 2), 17)
    return f"{value:#.{digits}g} +- {error:.2g}"


def has_residuals_as_large_as_data(fit: FitLike) -> bool:
    """Return True if the residuals are of the order of the measured values and exceed the noise."""
    is_estimated = any(series.sigma is None for record in fit.records for series in record.series)
    return fit.misfit > _AS_LARGE and (is_estimated or fit.chi2 > _MISFIT * fit.dof)


def describe_misfit(fit: FitLike) -> str:
    return (
        "No motion of this scene fits the records: the residuals are "
        f"{100.0 * fit.misfit:.0f} % of the values, or of 1 rad for angles."
    )


def describe_residual_excess(fit: FitLike) -> str:
    return (
        f"The residuals are {fit.excess:.3g} times as large as sigma explains: the fit is a false "
        "minimum, the records are of another top, or sigma is too small."
    )


def _list_fit_quality_sentences(fit: FitLike) -> list[str]:
    sentences = []
    if not fit.has_converged:
        sentences.append("The search did not converge; this is the best so far.")
    if has_residuals_as_large_as_data(fit):
        sentences.append(describe_misfit(fit))
    elif fit.excess:
        sentences.append(describe_residual_excess(fit))
    if ties := [name for name in fit.names if " = " in name]:
        sentences.append(
            f"Kept equal, as in the given scene: {', '.join(ties)}. Give different numbers to "
            "estimate them apart."
        )
    sentences += _list_labelled_sentences(fit)
    if fit.residual_correlation > _CORRELATED and fit.inflation > _ENLARGED:
        sentences.append(
            f"Neighbouring residuals are correlated ({fit.residual_correlation:.2f}): the "
            "model does not include all forces on the top."
        )
    if fit.inflation > _ENLARGED:
        sentences.append(
            f"Errors were enlarged {fit.inflation:.3g} times, because residuals are large or "
            "correlated."
        )
    if fit.nonlinearity > _NONLINEAR:
        sentences.append(
            "Errors are not normally distributed: along the least certain direction, the change of "
            f"chi2 for one sigma differs from 1 by {fit.nonlinearity:.2g}."
        )
    if missing_count := sum(record.missing for record in fit.records):
        sentences.append(f"{missing_count} values are left out: not measured, or undefined angles.")
    if fit.piece_starts:
        sentences.append(
            f"The motion consists of {len(fit.piece_starts)} joined pieces, each with its own "
            "start."
        )
    return sentences


def _list_labelled_sentences(fit: FitLike) -> list[str]:
    labels = {
        "Not identified": fit.unidentified,
        "Ambiguous": fit.ambiguous,
        "Uncertain": fit.uncertain_sigma,
        "At a bound": fit.at_bound,
    }
    return [f"{label}: {text}." for label, texts in labels.items() for text in texts]
