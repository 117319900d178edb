"""The tables of the core: quantities, their components, flags of methods."""

from __future__ import annotations

import kreisel._core as _core

from .._core import components, quantities, values

__all__ = ["components", "flags", "quantities", "values"]

flags = {
    name: getattr(_core, name) for name in dir(_core) if name.isupper() and name != "KIND_RTOL"
}
