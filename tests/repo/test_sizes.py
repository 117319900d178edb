"""Tests of program sizes against the table in docs/sizes.md.

Run `python tests/repo/sizes.py > docs/sizes.md` to update the table.
"""

import pytest
from sizes import COLUMNS, ROWS, format_table, measure_column, read_table
from toolbox import ROOT, need

TABLE = (ROOT / "docs/sizes.md").read_text()
GROWTH = 1.1


@pytest.mark.parametrize("column", [("x86_64", "-Os"), ("x86_64", "-O2"), ("arm64", "-Os")])
def test_no_program_has_grown_by_a_tenth(column, tmp_path):
    need("cmake", "size")
    pairs = zip(ROWS, read_table(TABLE)[COLUMNS.index(column)], strict=True)
    pairs = [(row, size) for row, size in pairs if column == COLUMNS[0] or not row[2]]
    measured = measure_column(tmp_path, *column, rows=[row for row, _ in pairs])
    if measured[0] is None:
        pytest.skip(f"no compiler for {column[0]}")
    for ((label, *_), before), now in zip(pairs, measured, strict=True):
        assert now <= GROWTH * before, f"{label}: {now} kB, {before} kB in docs/sizes.md"


def test_small_programs_are_below_their_limits():
    sizes = read_table(TABLE)[COLUMNS.index(("x86_64", "-Os"))]
    limits = [limit for *_, limit in ROWS]
    assert sum(limit is not None for limit in limits) >= 4
    for (label, *_), size, limit in zip(ROWS, sizes, limits, strict=True):
        assert limit is None or size <= limit, f"{label}: {size} kB"


def test_the_table_has_the_rows_and_columns_that_are_measured():
    columns = read_table(TABLE)
    assert all(size is not None for column in columns for size in column)
    assert format_table(columns) == TABLE
