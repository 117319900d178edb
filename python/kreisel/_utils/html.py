"""HTML representations of results for display in notebooks."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterable, Sequence
from html import escape
from io import BytesIO
from typing import Any, Protocol

_LEFT = ' style="text-align: left"'


def format_html_table(rows: Iterable[Sequence[str]], head: Sequence[str] = ()) -> str:
    """Return an HTML table of the given strings; markup in the strings is escaped."""
    lines = [_format_html_row("th", head)] if head else []
    lines += [_format_html_row("td", row) for row in rows]
    return "<table>\n" + "\n".join(lines) + "\n</table>"


def _format_html_row(tag: str, cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<{tag}{_LEFT}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"


class FigureLike(Protocol):
    """A figure of matplotlib."""

    def savefig(self, fname: Any, *, format: str, dpi: float) -> None: ...


class AxesLike(Protocol):
    """A matplotlib Axes that belongs to a figure."""

    def get_figure(self) -> Any: ...


def render_figure_as_png(figure: FigureLike) -> bytes:
    """Render a figure as PNG, and return the bytes."""
    file = BytesIO()
    figure.savefig(file, format="png", dpi=120)
    return file.getvalue()


def format_picture_as_html(draw: Callable[[], AxesLike], text: str) -> str | None:
    """Return HTML that shows a description of a result, and a figure drawn by `draw`.

    Returns None if matplotlib is not installed; notebooks then display only the description.
    """
    try:
        figure = draw().get_figure()
    except ModuleNotFoundError:
        return None
    data = b64encode(render_figure_as_png(figure)).decode()
    return (
        f"<p><code>{escape(text)}</code></p>\n"
        f'<img alt="{escape(text)}" src="data:image/png;base64,{data}">'
    )
