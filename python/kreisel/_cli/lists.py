"""kreisel methods, scenes and quantities: commands that list names."""

from __future__ import annotations

from collections.abc import Iterable

import click
from rich import box
from rich.console import Console
from rich.table import Table as Grid

from .._analysis.method_table import format_methods_page
from .._options.methods import Method, unknown_method_message
from .._options.methods import methods as known
from .._options.quantities import RECORDABLE, TIME
from .._utils.errors import suggest_name
from ..scenes import about, get_scene
from .parsers import UsageError, make_name_completer
from .text_grid import print_text_grid


def _print_text_table(columns: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> None:
    grid = Grid(box=box.SIMPLE_HEAD)
    for i, column in enumerate(columns):
        grid.add_column(column, no_wrap=i == 0)
    for row in rows:
        grid.add_row(*row)
    print_text_grid(grid)


@click.command()
@click.argument("name", required=False, shell_complete=make_name_completer(known))
@click.option(
    "--markdown",
    is_flag=True,
    help="Print a Markdown table with measured costs of a step (METHODS.md).",
)
def methods(name: str | None, markdown: bool) -> None:
    """List the methods available in this build, or describe a single method."""
    if markdown:
        click.echo(format_methods_page(known), nl=False)
    elif name is None:
        rows = [
            (m.name, _format_method_order(m), _format_method_properties(m), m.text)
            for m in known.values()
        ]
        _print_text_table(("method", "order", "kind", "description"), rows)
    elif name not in known:
        raise UsageError(unknown_method_message(name))
    else:
        _print_method_description(known[name])


def _print_method_description(method: Method) -> None:
    console = Console(markup=False, highlight=False)
    for word, value in {
        "name": method.name,
        "text": method.text,
        "order": _format_method_order(method),
        "kind": _format_method_properties(method),
        "conserves": method.conserves,
        "for": method.tops,
        "with": _format_disturbances(method),
        "reference": method.reference,
    }.items():
        console.print(f"{word:<10} {value}")


def _format_disturbances(method: Method) -> str:
    disturbances = {
        "rotors": method.rotors,
        "damping": method.damped,
        "friction": method.friction,
        "turning supports": method.turning,
        "shaken supports": method.shaking,
    }
    return ", ".join(name for name, is_known in disturbances.items() if is_known)


def _format_method_order(method: Method) -> str:
    return str(method.order) if method.order else "varies"


def _format_method_properties(method: Method) -> str:
    if method.exact:
        return "closed form"
    kinds = ("adaptive", "symplectic", "reversible", "implicit", "algebraic")
    return ", ".join(kind for kind in kinds if getattr(method, kind))


@click.command()
@click.argument("name", required=False, shell_complete=make_name_completer(about))
def scenes(name: str | None) -> None:
    """List all named scenes, or print the one called NAME in TOML format."""
    if name is None:
        _print_text_table(("scene", "description"), list(about.items()))
    elif name not in about:
        raise UsageError(f"unknown scene {name!r}; {suggest_name(name, about)}")
    else:
        click.echo(f"# {about[name]}\n{get_scene(name).to_toml()}", nl=False)


@click.command()
def quantities() -> None:
    """List the quantities accepted by --want."""
    rows = [(q.name, q.dimension, q.text) for q in (TIME, *RECORDABLE.values())]
    _print_text_table(("quantity", "unit", "description"), rows)
