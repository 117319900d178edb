"""Errors of physics engines on cases of the spin suite, which examples/engines/run_all.py measured.

The engines are no dependencies of the report: their results are stored beside this program.
"""

import json
from pathlib import Path

from .part import write_csv
from .tasks import Task

RESULTS = Path(__file__).parents[2] / "examples/engines/results.jsonl"


def list_tasks(_, size, store):
    yield Task("engines/stored", lambda: True)


def load_findings(_, store):
    if not store.under("engines/"):
        return []
    return [json.loads(line) for line in RESULTS.read_text(encoding="utf-8").splitlines()]


def build_context(findings):
    head, *rows = findings
    engines = {}
    for row in rows:
        name = f"{row['engine']} {row['version']}"
        key = name, row["precision"], row["variant"]
        engines.setdefault(key, {})[row["case"], row["step"]] = row
    cases = list(dict.fromkeys((row["case"], row["step"]) for row in rows))
    tumble = [row["attitude"] for row in rows if (row["case"], row["step"]) == cases[1]]
    return {"head": head, "cases": cases, "engines": engines, "tumble": tumble}


def list_files(findings, metadata):
    yield "engines.csv", write_csv(findings[1:])
