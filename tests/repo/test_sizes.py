"""Tests of program sizes against the table in docs/sizes.md.

Run `python tests/repo/sizes.py > docs/sizes.md` to update the table. The tests compare only one
column of the table with measured program sizes. The library is compiled twice: with all parts, and
with the options that omit the most code.
"""

import pytest
from sizes import COLUMNS, ROWS, format_table, measure_column, read_table
from toolbox import ROOT, need

TABLE = (ROOT / "docs/sizes.md").read_text()
GROWTH = 1.1
COLUMN = ("x86_64", "-Os")  # the column with limits


@pytest.mark.parametrize("options", [(), max((row[2] for row in ROWS), key=len)])
def test_no_program_has_grown_by_a_tenth(options, tmp_path):
    """Compare the sizes of programs with docs/sizes.md, for a library built with `options`."""
    need("cmake", "size")
    pairs = zip(ROWS, read_table(TABLE)[COLUMNS.index(COLUMN)], strict=True)
    pairs = [(row, size) for row, size in pairs if row[2] == options]
    assert len(pairs) >= 2
    sizes = measure_column(tmp_path, *COLUMN, rows=[row for row, _ in pairs])
    if sizes[0] is None:
        pytest.skip(f"no compiler for {COLUMN[0]}")
    for ((label, *_), before), now in zip(pairs, sizes, strict=True):
        assert now <= GROWTH * before, f"{label}: {now} kB, {before} kB in docs/sizes.md"


def test_small_programs_are_below_their_limits():
    sizes = read_table(TABLE)[COLUMNS.index(COLUMN)]
    limits = [limit for *_, limit in ROWS]
    assert sum(limit is not None for limit in limits) >= 4
    for (label, *_), size, limit in zip(ROWS, sizes, limits, strict=True):
        assert limit is None or size <= limit, f"{label}: {size} kB"


def test_the_table_has_the_rows_and_columns_that_are_measured():
    columns = read_table(TABLE)
    assert all(size is not None for column in columns for size in column)
    assert format_table(columns) == TABLE
