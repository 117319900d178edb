"""What the tests use of the package's private rooms: each name is imported here alone."""

from kreisel import _core as core
from kreisel._analysis.costs import page as page_of_methods
from kreisel._recording import rows, states
from kreisel._request.quantities import QUANTITIES, TURNING, WANTED
from kreisel._request.times import PIECE
from kreisel._showing import cli, view

__all__ = [
    "PIECE",
    "QUANTITIES",
    "TURNING",
    "WANTED",
    "cli",
    "core",
    "page_of_methods",
    "rows",
    "states",
    "view",
]
