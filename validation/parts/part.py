"""The interface that all parts of the report implement.

A part is a module of this folder and a template with the same name. The module has a few of the
functions below; those that it lacks return nothing. The template has the blocks `lead` and `advice`
(paragraphs and rows of a table above all parts), `conclusion`, `shown` and `body` (folded), of
which only `body` is required.

list_tasks(problems, size, store)  the computations of the part, in order
load_findings(problems, store)     their results; a part without results is omitted
build_context(findings)            values for the template
list_files(findings, metadata)     the name and the text of each file
terminal_lines(findings)           lines for the terminal
list_methods(findings)             names of the methods that ran
list_answers(findings)             dictionaries, each the fastest run of one program for one choice
                                   of top, error, count and motion, which the page asks for
"""

import csv
import io
from dataclasses import dataclass
from types import ModuleType


@dataclass(frozen=True)
class Part:
    module: ModuleType
    title: str  # title in the navigation of the page
    heading: str  # heading of its section
    accepts_user_scenes: bool = False  # True if it can run on the scenes of a user

    @property
    def name(self):
        return self.module.__name__.rpartition(".")[2]

    def __getattr__(self, function):
        return getattr(self.module, function, lambda *_: ())


def write_csv(rows):
    """Format dictionaries as CSV, with empty fields for missing values."""
    rows, text = list(rows), io.StringIO(newline="")
    writer = csv.DictWriter(text, list(dict.fromkeys(key for row in rows for key in row)))
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
