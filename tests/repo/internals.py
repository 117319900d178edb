"""The private names of the package that several test modules use.

Test modules import further private names directly.
"""

from kreisel import _cli as cli
from kreisel import _core as core
from kreisel import _view as view
from kreisel._analysis import method_table as table_of_costs
from kreisel._analysis.method_table import format_methods_page as page_of_methods
from kreisel._options.quantities import HEADING_DEPENDENT, QUANTITIES, RECORDABLE
from kreisel._options.times import CHUNK_SIZE
from kreisel._results import core_calls, state_quantities

__all__ = [
    "CHUNK_SIZE",
    "HEADING_DEPENDENT",
    "QUANTITIES",
    "RECORDABLE",
    "cli",
    "core",
    "core_calls",
    "page_of_methods",
    "state_quantities",
    "table_of_costs",
    "view",
]
