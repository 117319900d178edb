"""Tests of the mutants that validation/mutation generates."""

import pytest
from toolbox import need

from validation.mutation import mutate as front
from validation.mutation import mutate_c, mutate_python
from validation.mutation.mutant import Mutant, draw_sample
from validation.mutation.trial_log import TrialLog

HEADER = "int larger(int a, int b);\nint half(int a);\n"
SOURCE = """#include "sums.h"

int larger(int a, int b)
{
    return a > b ? a : b;
}
int half(int a)
{
    int out = 7; /* a > b */
    out = a / 2;
    return out;
}
"""
TEST = """#include "sums.h"
int main(void) { return larger(2, 3) != 3 || larger(3, 2) != 3 || half(0) != 0; }
"""
PACKAGE = '''"""Sums."""


def larger(a: int, b: int = 1) -> int:
    """Takes the larger of a > b."""
    if a > b:
        return a
    return b


def half(a: int) -> float:
    return a / 2
'''
PACKAGE_TEST = """from sums import half, larger


def test_sums():
    assert larger(2, 3) == larger(3, 2) == 3 and larger(0) == 1 and half(0) == 0
"""


def changes_of(mutants):
    return {(mutant.line, mutant.change) for mutant in mutants}


def test_c_mutants_change_computations():
    assert changes_of(mutate_c.list_mutants("sums.c", SOURCE)) == {
        (5, "> -> >="),
        (5, "> -> <"),
        (9, "7 -> 8"),
        (10, "/ -> *"),
        (10, "2 -> 3"),
        (10, "out = a / 2 -> nothing"),
    }


@pytest.mark.parametrize(
    ("line", "changes"),
    [
        ("    f(x, -y);", {"x, -y -> -y, x", "- -> nothing", "f(x, -y) -> nothing"}),
        ("    double x[3] = {0.5};", {"0.5 -> (0.5 + 1.0)"}),
        ("    i++;", {"++ -> --", "i++ -> nothing"}),
        ("    double *x = a * *b;", {"* -> /"}),
        ("    if (!a && b) return x;", {"! -> nothing", "&& -> ||", "(!a && b) -> (!(!a && b))"}),
        ("#if A > 2", set()),
        ('    const char *text = "a + 1";', set()),
        (
            "    x[1] = fmin(a, b) * 0x1p-3;",
            {
                "1 -> 2",
                "* -> /",
                "0x1p-3 -> (0x1p-3 + 1.0)",
                "x[1] = fmin(a, b) * 0x1p-3 -> nothing",
            },
        ),
    ],
)
def test_mutations_of_c(line, changes):
    text = f"void f(int a)\n{{\n{line}\n}}\n"
    mutations = {mutant.change for mutant in mutate_c.list_mutants("f.c", text)}
    assert mutations == changes


@pytest.mark.parametrize(
    ("line", "changes"),
    [
        ("x = a if b else -1", {"b -> (not (b))", "- -> nothing", "1 -> 2"}),
        ("x = f(a, b) is not None", {"a, b -> b, a", "is not -> is"}),
        ("x: tuple[1] = True", {"True -> False"}),
        ("x = min(a, 'b')", {"min -> max"}),
        ("x += 1.5", {"+ -> -", "1.5 -> (1.5 + 1.0)", "x += 1.5 -> pass"}),
        ("raise E('a' + b)", {"+ -> -", "raise E('a' + b) -> pass"}),
    ],
)
def test_mutations_of_python(line, changes):
    assert {mutant.change for mutant in mutate_python.list_mutants("f.py", line + "\n")} == changes


def test_larger_samples_begin_with_smaller_ones():
    mutants = mutate_c.list_mutants("sums.c", SOURCE)
    assert draw_sample(mutants, 1, 5)[:3] == draw_sample(mutants, 1, 3) and len({*mutants}) == 6
    assert draw_sample(mutants, 1, 100) != draw_sample(mutants, 2, 100)


def test_a_mutant_is_written_and_undone(tmp_path):
    file = tmp_path / "f.c"
    mutant = Mutant("f.c", "a + b", 2, 3, "-")
    mutant.write(tmp_path)
    assert file.read_text() == "a - b"
    mutant.undo(tmp_path)
    assert file.read_text() == "a + b"


def test_the_log_survives_a_truncated_line(tmp_path):
    mutant = Mutant("f.c", "a + b", 2, 3, "-")
    TrialLog(tmp_path / "l").add(mutant, "killed", "test", 1.0)
    with (tmp_path / "l").open("a") as file:
        file.write('{"name": "cu')
    other = Mutant("f.c", "a + b", 2, 3, "*")
    TrialLog(tmp_path / "l").add(other, "survived")
    ledger = TrialLog(tmp_path / "l")
    assert (ledger.get_outcome(mutant), ledger.get_outcome(other)) == ("killed", "survived")


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """Return a small source tree whose tests need no pytest plugins."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    texts = {
        "csrc/sums.h": HEADER,
        "csrc/sums.c": SOURCE,
        "tests/c/test_sums.c": TEST,
        "python/sums/__init__.py": PACKAGE,
        "tests/python/test_sums.py": PACKAGE_TEST,
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def table_of(side, tree, capsys, *words):
    assert front.main([side, "--root", str(tree), *words]) == 0
    return capsys.readouterr().out


def test_mutants_of_the_core_of_a_small_tree(tree, capsys):
    need("gcc")
    output = table_of("core", tree, capsys)
    assert "6 mutants, 6 to try" in output
    assert "1 same code, not counted" in output, "nothing reads the 7"
    survivors = {line.split("  ", 1)[1] for line in output.splitlines() if "survived: " in line}
    assert survivors == {"> -> >=", "/ -> *", "2 -> 3"}
    assert "40.0 % of 5" in output
    assert (tree / "csrc/sums.c").read_text() == SOURCE


def test_verdicts_are_reused_by_the_next_run(tree, capsys):
    need("gcc")
    table_of("core", tree, capsys, "--jobs", "2")
    output = table_of("core", tree, capsys)
    assert "6 mutants, 0 to try" in output and "40.0 % of 5" in output


def test_mutants_of_the_package_of_a_small_tree(tree, capsys):
    pytest.importorskip("coverage")
    output = table_of("package", tree, capsys)
    survivors = {line.split("  ", 1)[1] for line in output.splitlines() if "survived: " in line}
    assert survivors == {"> -> >=", "/ -> *", "2 -> 3"}
    assert "40.0 % of 5" in output and (tree / "python/sums/__init__.py").read_text() == PACKAGE


def test_a_tree_whose_tests_fail_is_refused(tree, capsys):
    need("gcc")
    (tree / "tests/c/test_sums.c").write_text("int main(void) { return 1; }\n")
    with pytest.raises(SystemExit, match="test_sums fails with nothing changed"):
        table_of("core", tree, capsys)
