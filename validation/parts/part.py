"""The interface of a part of the report.

The report builds its page, its tables and its command line from a list of parts, and refers to no
part by name. To add a part, add its file here, which ends with its `Part`, its template NAME.html
beside the file, and its line in report/contents.py.
"""

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass


def list_nothing(findings, *_):
    return ()


@dataclass(frozen=True)
class Part:
    """One part of the report.

    Findings may be of any type. A part whose findings are false is neither shown nor written.
    """

    name: str  # used in --only, in links within the page, and as name of the template
    title: str  # in the navigation
    heading: str  # of its section
    list_tasks: Callable  # (problems with their ends, budget, store) -> tasks, in order
    load_findings: Callable  # (problems with their ends, store) -> findings
    build_context: Callable  # findings -> values for the template, by name
    conclude: Callable  # findings -> a paragraph
    label: str = ""  # of that paragraph at the head of the page; empty: not shown there
    list_files: Callable = list_nothing  # (findings, about) -> (name, text) of each file
    terminal_lines: Callable = list_nothing  # findings -> lines for the terminal
    list_methods: Callable = list_nothing  # findings -> names of the methods that ran
    accepts_user_scenes: bool = False  # whether it runs on the scenes of a user


def write_csv(columns, rows):
    """Return rows, each a dict, as CSV.

    Missing values stay empty, and keys that are no column are left out.
    """
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, columns, extrasaction="ignore")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
