"""A chart of the spectral lines of a motion."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from .._utils.optional import optional_dependency
from .._utils.validation import Array
from .panels import apply_chart_style, create_axes_in_new_figure, format_axis_label
from .solids import BLUE, ORANGE, validate_axes_type

with optional_dependency("'kreisel[plot]'"):
    from matplotlib.axes import Axes

_NEAR = 1e-3  # largest difference of a line from a multiple, relative to the frequency of nutation
_DECADES = 0.5  # empty part of the scale below the weakest and above the strongest line


class SpectralLines(Protocol):
    """The fundamental frequencies of a motion, and its spectral lines."""

    @property
    def precession_rate(self) -> float: ...
    @property
    def nutation(self) -> float: ...
    @property
    def lines(self) -> Array: ...
    @property
    def amplitudes(self) -> npt.NDArray[np.complex128]: ...
    @property
    def rest(self) -> float: ...


def draw_spectral_lines(spectrum: SpectralLines, axes: Axes | None, unit: str) -> Axes:
    """Plot the amplitude of each spectral line against its frequency, and return the axes."""
    chart = create_axes_in_new_figure(6.4, 3.4) if axes is None else validate_axes_type(axes)
    strengths = np.abs(spectrum.amplitudes)
    is_present = strengths > 0.0
    lines, strengths = spectrum.lines[is_present], strengths[is_present]
    chart.set(
        xlabel=format_axis_label("angular frequency", "T^-1", unit),
        ylabel="amplitude of the apex",
        yscale="log",
    )
    if len(lines):
        floor = 10.0 ** (math.floor(np.log10(strengths.min()) - _DECADES))
        chart.vlines(lines, floor, strengths, color=BLUE, linewidth=1.4)
        chart.plot(lines, strengths, "o", color=BLUE, markersize=4)
        chart.set_ylim(floor, strengths.max() * 10.0**_DECADES)
    if math.isfinite(spectrum.precession_rate):
        chart.axvline(
            spectrum.precession_rate, color=ORANGE, linewidth=1.0, linestyle="--", zorder=1
        )
        _label_spectral_lines(chart, spectrum, lines, strengths)
    title = f"{len(lines)} lines, rest {spectrum.rest:.0e}"
    if math.isfinite(spectrum.precession_rate):
        title += "; dashed: mean precession"
    chart.set_title(title, fontsize=9)
    apply_chart_style(chart)
    chart.margins(x=0.06)
    return chart


def _label_spectral_lines(
    chart: Axes, spectrum: SpectralLines, lines: Array, strengths: Array
) -> None:
    """Label each line near the precession plus k times the nutation frequency by the integer k."""
    style: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "fontsize": 7.5}
    if spectrum.nutation > 0.0:
        multiples = (lines - spectrum.precession_rate) / spectrum.nutation
        for line, strength, k in zip(lines, strengths, multiples, strict=True):
            if abs(k - round(k)) < _NEAR:
                chart.annotate(f"{round(k):+d}" if round(k) else "0", (line, strength),
                               xytext=(0, 4), **style)  # fmt: skip
