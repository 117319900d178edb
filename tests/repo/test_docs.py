"""Tests of the documentation that do not require the built site."""

import re
import sys

import kreisel as kr
from toolbox import CSRC, ROOT, run_programs

sys.path.insert(0, str(ROOT / "docs"))
from making.header import functions

DOCS = ROOT / "docs"
EXAMPLES = sorted((DOCS / "examples").rglob("*.py"))
TEXTS = sorted(
    file
    for file in DOCS.rglob("*")
    if file.suffix in {".md", ".rst", ".py", ".css"} and (DOCS / "gallery") not in file.parents
)


def test_every_public_name_is_documented():
    text = "".join(file.read_text() for file in (DOCS / "api").glob("*.rst"))
    names = re.findall(r"^\.\. auto(?:module:: kreisel\.|\w+:: )(\w+)$", text, re.MULTILINE)
    assert sorted(names) == sorted(set(kr.__all__) - {"__version__"})


def test_examples_begin_with_a_question():
    assert len(EXAMPLES) >= 20
    for file in EXAMPLES:
        title, line = re.match(r'r?"""\n(.+)\n(=+)\n', file.read_text()).groups()
        assert title.endswith("?") and len(title) == len(line), file


def test_the_site_loads_nothing_from_other_servers():
    for file in TEXTS:
        assert re.findall(r"(?:https?:)?//[\w-]+\.[\w.-]+", file.read_text()) == [], file


def test_links_to_examples_are_valid():
    names = {f"{file.parent.name}/{file.stem}" for file in EXAMPLES}
    for file in TEXTS:
        for name in re.findall(r"gallery/(\w+/\w+)[`>]", file.read_text()):
            assert name in names, (file, name)


def test_the_index_of_the_header_has_every_function():
    header = (CSRC / "kreisel.h").read_text()
    public = set(re.findall(r"\b(kr_\w+)\(", re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL)))
    names = list(functions(header))
    assert {name for _, name, _ in names} == public
    lines = header.splitlines()
    assert all(f"{name}(" in lines[number - 1] for _, name, number in names)


def read_table_rows(page, word):
    """Return the table rows of `page` that contain `word`, each as a list of cells."""
    lines = (DOCS / page).read_text().splitlines()
    return [line.strip("| ").split(" | ") for line in lines if line[:1] == "|" and word in line]


def test_the_page_of_closed_forms_quotes_their_refusals():
    header = (CSRC / "kreisel.h").read_text().replace("G is near", "$G$ is near")
    quotes = [
        quote
        for row in read_table_rows("theory/closed_form.md", '"')
        for cell in row
        for quote in re.findall(r'"(.+?)"', cell)
    ]
    assert len(quotes) > 10 and [quote for quote in quotes if quote not in header] == []


PROGRAMS = {"start": 6, "recipes": 11, "coming_from": 4, "scope": 1}  # programs of each page


def test_the_programs_of_the_pages_run(tmp_path):
    for page, number in PROGRAMS.items():
        text = (DOCS / f"{page}.md").read_text()
        blocks = re.findall(r"^```\{run\}\n(?::alt: [^\n]*\n\n)?(.*?)^```", text, re.M | re.S)
        assert len(blocks) == number
        (tmp_path / f"{page}.py").write_text("\n".join(blocks))
    run_programs(*(f"{page}.py" for page in PROGRAMS), cwd=tmp_path)


def test_the_index_of_the_package_has_a_line_for_each_name():
    index = (DOCS / "api/index.md").read_text()
    names = re.findall(r"^   (\w+)$", index, re.M)
    assert sorted(names) == sorted(set(kr.__all__) - {"__version__"})
