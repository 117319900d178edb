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


def build_body_from_table(table: object, locations: Mapping[str, str]) -> Body:
    """Build the body described by a TOML table.

    The table contains either the parameters of Body, or a table with the parameters of one
    constructor. Beside the table with the parameters of a constructor, only the key `rotor` is
    allowed. `locations` maps keys that belong in other tables to their correct places in the file,
    so that error messages can name these places.
    """
    words = dict(require_toml_table("body", table))
    if not MAKERS.keys() & words.keys():
        return call_constructor_with_table(Body, "[body]", words, locations, MAKERS)
    rotor = words.pop("rotor", None)
    keys = [word for word in words if word in locations]
    if len(words) > 1 and not keys:
        raise ValueError(f"[body] must be described in one way, not by {', '.join(words)}")
    if keys:
        raise ValueError(f"{keys[0]} belongs {locations[keys[0]]}")
    ((name, value),) = words.items()
    body: Body = call_constructor_with_table(
        MAKERS[name], f"[body] {name}", require_toml_table(name, value), locations
    )
    rotor_value: Any = rotor  # validated by the body
    return body if rotor is None else replace(body, rotor=rotor_value)
