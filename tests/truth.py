"""The table of true states in tests/truths.json, and the errors of paths relative to its rows.

`python -m validation.references.truths` computes the table.
"""

import json
from decimal import Decimal
from pathlib import Path

import kreisel as kr

ROWS = json.loads(Path(__file__).with_name("truths.json").read_text())
EFFECTS = {"damping", "turning", "shaking", "friction", "gradient"}


def select_rows(family, *effects, exactly=False):
    """Return the rows of a family that have the given effects, of which one is "rotor"."""
    rows = []
    for row in ROWS:
        present = EFFECTS & row["scene"].keys()
        present |= {"rotor"} & {name for name, x in row["scene"]["body"].items() if x != [0] * 3}
        if row["family"] == family and {*effects} <= present:
            rows += [row] if not exactly or present == {*effects} else []
    return rows


def make_scene(row):
    words = {name: value for name, value in row["scene"].items() if name != "body"}
    return kr.Scene(kr.Body(**row["scene"]["body"]), **words)


def find_gap(high, low, true):
    """Return the largest difference between the sums of two words and the true numbers."""
    pairs = zip(high.tolist(), low.tolist(), map(Decimal, true), strict=True)
    return float(max(abs(Decimal(a) - c + Decimal(b)) for a, b, c in pairs))


def find_error(path, row, index=-1):
    """Return the largest error of q, or of m relative to the size of m. The sign of q counts."""
    size = max(1e-300, *(abs(float(x)) for x in (*row["m"], *row["scene"]["momentum"])))
    gap = find_gap(path.m[index], path.m_low[index], row["m"])
    return max(find_gap(path.q[index], path.q_low[index], row["q"]), gap / size)
