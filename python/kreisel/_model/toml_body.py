"""Construction of bodies from TOML tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from inspect import getmembers, ismethod
from typing import Any

from .body import Body
from .toml import call_constructor_with_table, require_toml_table

MAKERS: dict[str, Callable[..., Body]] = {
    name: make for name, make in getmembers(Body, ismethod) if not name.startswith("_")
}


def build_body_from_table(table: object, elsewhere: Mapping[str, str]) -> Body:
    """Build the body described by a TOML table.

    The table contains either the parameters of Body, or a table with the parameters of one
    constructor. The key `rotor` is allowed beside a table of constructor parameters. `elsewhere`
    maps keys that belong to another table to texts for error messages.
    """
    words = dict(require_toml_table("body", table))
    if not MAKERS.keys() & words.keys():
        return call_constructor_with_table(Body, "[body]", words, elsewhere, MAKERS)
    rotor = words.pop("rotor", None)
    misplaced = [word for word in words if word in elsewhere]
    if len(words) > 1 and not misplaced:
        raise ValueError(f"[body] must be described in one way, not by {', '.join(words)}")
    if misplaced:
        raise ValueError(f"{misplaced[0]} belongs {elsewhere[misplaced[0]]}")
    ((name, value),) = words.items()
    made: Body = call_constructor_with_table(
        MAKERS[name], f"[body] {name}", require_toml_table(name, value), elsewhere
    )
    given: Any = rotor  # validated by the body
    return made if rotor is None else replace(made, rotor=given)
