"""HTML representations of results for display in notebooks."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterable, Sequence
from html import escape
from io import BytesIO
from typing import Any


def format_html_table(rows: Iterable[Sequence[str]], head: Sequence[str] = ()) -> str:
    """Return an HTML table of the given strings; markup in the strings is escaped."""
    lines = [("th", head)] if head else []
    text = "<table>\n"
    for tag, cells in [*lines, *(("td", row) for row in rows)]:
        texts = (f'<{tag} style="text-align: left">{escape(cell)}</{tag}>' for cell in cells)
        text += f"<tr>{''.join(texts)}</tr>\n"
    return text + "</table>"


def render_figure_as_png(figure: Any) -> bytes:
    file = BytesIO()
    figure.savefig(file, format="png", dpi=120)
    return file.getvalue()


def format_picture_as_html(draw: Callable[[], Any], text: str) -> str | None:
    """Return HTML with a text and the axes that `draw` draws, or None without matplotlib."""
    try:
        figure = draw().get_figure()
    except ModuleNotFoundError:
        return None
    data = b64encode(render_figure_as_png(figure)).decode()
    return (
        f"<p><code>{escape(text)}</code></p>\n"
        f'<img alt="{escape(text)}" src="data:image/png;base64,{data}">'
    )
