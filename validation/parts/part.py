"""What a part of the report is. The report makes its page, its tables and its command line from a
list of parts, and knows none of them by name.

To add one: its file here, which ends with its Part; its template NAME.html beside it; its line in
report/contents.py.
"""

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass


def nothing(found):
    return ()


@dataclass(frozen=True)
class Part:
    """One part of the report. What it found may be of any type; it is false where there is nothing,
    and is then neither shown nor written."""

    name: str  # in --only, in links within the page, and of its template
    title: str  # in the navigation
    heading: str  # of its section
    tasks: Callable  # (problems with their ends, budget, store) -> the findings to make, in order
    found: Callable  # (problems with their ends, store) -> what was found so far
    shown: Callable  # found -> what the template is given, by name
    concluded: Callable  # found -> what to conclude, a paragraph
    short: str = (
        ""  # what that paragraph begins with at the head of the page; empty: it is not there
    )
    files: Callable = nothing  # (found, about) -> (name of a file, its text) of each
    told: Callable = nothing  # found -> what the terminal shows, line by line
    methods: Callable = nothing  # found -> the names of the methods that ran
    takes_own_scenes: bool = False  # whether it runs where a user gave scenes of his own


def csv_text(columns, rows):
    """Writes rows, each a dict, as CSV; what a row does not know stays empty, what is no column is
    left out."""
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, columns, extrasaction="ignore")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
