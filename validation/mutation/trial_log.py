"""A log file of mutation tests, from which an interrupted run can be continued."""

import json
from collections import Counter

WORDS = {
    "killed": "killed",
    "survived": "survived",
    "same": "same code, not counted",
    "unbuilt": "did not build, not counted",
}


class TrialLog:
    def __init__(self, file):
        self.file = file
        file.parent.mkdir(parents=True, exist_ok=True)
        text = file.read_text() if file.exists() else ""
        if text and not text.endswith("\n"):
            file.write_text(text + "\n")  # ends a truncated last line
        self.rows = {row["name"]: row for row in map(parse_line, text.splitlines()) if row}

    def add(self, mutant, word, test="", seconds=0.0):
        row = {"name": mutant.name, "word": word, "by": test, "seconds": round(seconds, 1)}
        self.rows[mutant.name] = row
        with self.file.open("a") as file:
            file.write(json.dumps(row) + "\n")
        return row

    def get_outcome(self, mutant):
        return self.rows.get(mutant.name, {}).get("word")


def parse_line(line):
    """Parse a line of the log file, or return None if the line is incomplete."""
    try:
        return json.loads(line)
    except json.JSONDecodeError:
        return None


def format_table(ledger, mutants):
    """Format a table with the fraction of detected mutants, and list the undetected ones."""
    words = {m.name: ledger.get_outcome(m) for m in mutants}
    counts = Counter(words.values())
    lines = [f"{counts[word]:6} {text}" for word, text in WORDS.items()]
    if remaining := counts[None]:
        lines.append(f"{remaining:6} not tried yet")
    total = counts["killed"] + counts["survived"]
    score = 100.0 * counts["killed"] / total if total else 0.0
    lines.append(f"{score:6.1f} % of {total} are killed")
    seconds = sum(ledger.rows[m.name]["seconds"] for m in mutants if m.name in ledger.rows)
    lines.append(f"{seconds:6.0f} s it took, {seconds / max(1, len(mutants)):.1f} s each")
    survivors = sorted(
        (m for m in mutants if words[m.name] == "survived"), key=lambda m: (m.file, m.line)
    )
    return lines + [
        f"survived: {m.file}:{m.line}  {m.change}\n    {m.line_text}" for m in survivors
    ]
