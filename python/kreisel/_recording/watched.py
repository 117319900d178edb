"""A path that was asked for events, as type checkers know it: then it has them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .path import Events, Path

if TYPE_CHECKING:

    class WatchedPath(Path):
        events: Events
else:
    WatchedPath = Path
