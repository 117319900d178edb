"""Tests that a new part of the report needs one file, a template and two lines in contents.py."""

import csv
import io
import re
import runpy
import shutil
import sys
from contextlib import redirect_stdout
from pathlib import Path

import kreisel as kr
import pytest
from toolbox import ROOT

from validation.report import page
from validation.report.contents import PARTS

FILE = '''"""How many methods there are."""

import kreisel as kr

from .budget import Task
from .part import Part, write_csv


def list_tasks(problems, budget, store):
    yield Task("headcount", lambda: list(kr.methods))


def rows_of(names):
    return [{"name": name} for name in names]


PART = Part(
    "headcount",
    "Heads counted",
    "How many heads?",
    list_tasks,
    lambda problems, store: store.known.get("headcount"),
    lambda names: {"names": names},
    lambda names: f"There are {len(names)} heads.",
    list_files=lambda names, about: [("heads.csv", write_csv(["name"], rows_of(names)))],
    terminal_lines=lambda names: [f"counted {len(names)} heads"],
)
'''
COPY = "validation_with_headcount"  # all modules import each other by relative names
TEMPLATE = """<ul>{% for name in names %}<li>{{ name }}</li>{% endfor %}</ul>
"""


def diff_trees(one, other):
    """Return the names of the files that differ between two source trees."""
    names = {
        file.relative_to(tree)
        for tree in (one, other)
        for file in tree.rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }

    def text(tree, name):
        return (tree / name).read_bytes() if (tree / name).exists() else None

    return {name.as_posix() for name in names if text(one, name) != text(other, name)}


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """Return a copy of the package `validation` with an additional part of the report."""
    copy = tmp_path_factory.mktemp("tree") / COPY
    shutil.copytree(ROOT / "validation", copy, ignore=shutil.ignore_patterns("__pycache__"))
    (copy / "parts/headcount.py").write_text(FILE)
    (copy / "parts/headcount.html").write_text(TEMPLATE)
    contents = copy / "report/contents.py"
    text = contents.read_text()
    text = text.replace("    ensembles,\n", "    ensembles,\n    headcount,\n")
    contents.write_text(
        text.replace("    omissions.PART,\n", "    headcount.PART,\n    omissions.PART,\n")
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(copy.parent)
        yield copy
    for name in [name for name in sys.modules if name.partition(".")[0] == COPY]:
        del sys.modules[name]


def report(copy, *words):
    """Run the report program in a copy of the package `validation`, and return its output.

    The report runs in the current process, which has already imported all other packages.
    """
    text_output = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(text_output):
        patch.chdir(copy.parent)
        patch.setenv("COLUMNS", "200")
        patch.setattr(sys, "argv", ["validation", *words])
        with pytest.raises(SystemExit) as program_exit:
            runpy.run_module(COPY, run_name="__main__")
    assert not program_exit.value.code, text_output.getvalue()
    return text_output.getvalue()


@pytest.fixture(scope="module")
def output(copy):
    text = report(copy, "--quick", "--only", "headcount", "--out", "made")
    return text, copy.with_name("made")


def test_a_new_part_touches_three_files(copy):
    assert diff_trees(ROOT / "validation", copy) == {
        "parts/headcount.py",
        "parts/headcount.html",
        "report/contents.py",
    }


def test_the_command_line_lists_a_new_part(copy):
    assert "published, fits, headcount, omissions" in report(copy, "--help")


def test_a_new_part_is_printed_written_and_shown(output):
    printed_text, out = output
    assert f"counted {len(kr.methods)} heads" in printed_text
    with (out / "heads.csv").open(newline="") as file:
        assert [row["name"] for row in csv.DictReader(file)] == list(kr.methods)
    text = re.sub(r"\s+", " ", (out / "index.html").read_text())
    navigation = re.search(r"<nav[^>]*>(.*?)</nav>", text)[1]
    assert '<a href="#headcount">Heads counted</a>' in navigation
    conclusion = f"There are {len(kr.methods)} heads."
    section = text.split('<h2 id="headcount">How many heads?</h2>')[1]
    assert section.startswith(f' <p class="conclusion">{conclusion}</p> <details class="part">')
    assert all(f"<li>{name}</li>" in section for name in kr.methods)


def test_parts_without_findings_are_not_shown(output):
    _, out = output
    page = (out / "index.html").read_text()
    others = [part for part in PARTS if f'id="{part.name}"' in page]
    assert others == [] and {file.name for file in out.iterdir()} == {
        "findings-quick.jsonl",
        "heads.csv",
        "index.html",
    }


def test_parts_that_are_not_requested_do_not_run(copy, output):
    _, out = output
    findings = copy.with_name("again") / "findings-quick.jsonl"
    shutil.copytree(out, findings.parent)
    text = findings.read_text()
    report(copy, "--quick", "--only", "headcount", "--out", "again")
    assert findings.read_text() == text, "nothing is found again"


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.name)
def test_every_part_has_a_template_beside_its_file(part):
    folder = ROOT / "validation/parts"
    assert (folder / f"{part.name}.py").is_file() and (folder / f"{part.name}.html").is_file()
    assert Path(page.load_template(f"{part.name}.html").filename).parent == folder


@pytest.mark.parametrize("file", ["main.py", "page.py", "templates/report.html"])
def test_general_files_name_no_part(file):
    """Check that the source files common to all report parts do not contain the name of a part."""
    text = (ROOT / "validation/report" / file).read_text()
    words = {word for part in PARTS for word in (part.name, part.title, part.heading)}
    names = {word for word in words if re.search(rf"[\"'#>]{re.escape(word)}[\"'<.]", text)}
    assert names <= {"Truth"}, "one of the words that the page explains"
