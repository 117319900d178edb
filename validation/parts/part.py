"""The interface that all parts of the report implement.

A single list of parts determines the page, the tables and the command line of the report. A new
part needs a Python file, a template with the same name, and two lines in report/contents.py. The
Python file must end with the definition of a `Part` object.
"""

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass


def list_nothing(findings, *_):
    return ()


@dataclass(frozen=True)
class Part:
    """A part of the report, with its computations, texts and files.

    A part is omitted from the report if its results are empty.
    """

    name: str  # used for --only, for links within the page, and as the name of the template
    title: str  # title in the navigation of the page
    heading: str  # heading of its section
    list_tasks: Callable  # (problems with their ends, size, store) -> tasks, in order
    load_findings: Callable  # (problems with their ends, store) -> findings
    build_context: Callable  # findings -> values for the template, by name
    conclude: Callable  # findings -> a paragraph
    list_files: Callable = list_nothing  # (findings, metadata) -> (name, text) of each file
    terminal_lines: Callable = list_nothing  # findings -> lines for the terminal
    list_methods: Callable = list_nothing  # findings -> names of the methods that ran
    # findings -> values for the template NAME_lead.html, which is shown above all parts
    build_lead: Callable | None = None
    is_lead_row: bool = False  # True if NAME_lead.html is a row of the list of advice
    accepts_user_scenes: bool = False  # True if it can run on the scenes of a user


def write_csv(columns, rows):
    """Format a list of dictionaries as CSV.

    Missing values are written as empty fields, and dictionary keys that are not in `columns` are
    ignored.
    """
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, columns, extrasaction="ignore")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
