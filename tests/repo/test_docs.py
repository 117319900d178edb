"""Tests of the documentation that do not require the built site."""

import re
import sys
import warnings

import kreisel as kr
import numpy as np
import pytest
from toolbox import CSRC, ROOT, run

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


def test_the_gallery_example_of_waves_shows_waves():
    """Check that the nutation is visible and that several nutations occur per revolution."""
    source = (DOCS / "examples/tops/loops_cusps_waves.py").read_text()
    names = {}
    exec(source.partition("\nt = ")[0], names)
    waves = kr.exact(names["start_top"](3))
    assert waves.motion_type == "waves" and "(-12, 0, 3)" in source
    assert 5 < 2 * np.pi / waves.precession_rate / waves.period < 8
    assert np.degrees(waves.greatest_nutation - waves.least_nutation) > 3


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


def test_the_page_of_events_lists_every_event():
    rows = read_table_rows("theory/events.md", "kr.events.")
    names = {name for first, *_ in rows for name in re.findall(r"kr\.events\.(\w+)\(", first)}
    assert names == set(kr.events.__all__) - {"Event", "Events", "components"}


def test_the_page_of_closed_forms_quotes_their_refusals():
    header = (CSRC / "kreisel.h").read_text().replace("G is near", "$G$ is near")
    quotes = [
        quote
        for row in read_table_rows("theory/closed_form.md", '"')
        for cell in row
        for quote in re.findall(r'"(.+?)"', cell)
    ]
    assert len(quotes) > 10 and [quote for quote in quotes if quote not in header] == []


def test_the_recommended_symplectic_methods_are_symplectic():
    ((_, names),) = read_table_rows("choosing.md", "a symplectic, reversible, fixed-step map")
    methods = [kr.methods[name] for name in re.findall(r"`(\w+)`", names)]
    assert len(methods) > 2
    for method in methods:
        assert method.symplectic and method.reversible and not method.adaptive
        assert method.tops == "any body"


def test_the_table_of_conventions_names_arguments_and_attributes():
    ((_, text),) = read_table_rows("start.md", "unit quaternion")
    path = kr.solve(
        kr.Scene(kr.scenes.thesis.body, momentum=(0, 0, 1), attitude_xyzw=(0, 0, 0, 1), gravity=1),
        [1.0],
    )
    assert "the argument `attitude_xyzw` and the attribute `path.q_xyzw`" in text
    assert path.q_xyzw.shape == (1, 4)


@pytest.mark.parametrize("options", [{}, {"unphysical": True}])
def test_the_table_of_limits_names_the_options_that_lift_them(options):
    def build(inertia, com=(0.0, 0.0, 0.1), **more):
        return kr.Body(1.0, inertia, com, **options | more)

    ((_, triangle),) = read_table_rows("scope.md", "the triangle inequality")
    with pytest.raises(ValueError, match="none larger than the other two"):
        build((1.0, 1.0, 2.001))
    assert build((1.0, 1.0, 2.001), com=(0, 0, 0), inertia_rtol=0.01).inertia[2] == 2.001
    assert "`inertia_rtol`" in triangle and "`unphysical" not in triangle
    ((_, mass),) = read_table_rows("scope.md", "no mass distribution")
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        build((1.0, 1.0, 0.5), com=(0.0, 0.0, 1.0))
    assert [one.category for one in warned] == ([] if options else [UserWarning])
    assert mass == "UserWarning, unless `unphysical=True`"


PROGRAMS = {"start": 6, "coming_from": 4, "scope": 1}  # numbers of programs of the pages


@pytest.mark.parametrize("page", PROGRAMS)
def test_the_programs_of_a_page_run(page, tmp_path):
    text = (DOCS / f"{page}.md").read_text()
    blocks = re.findall(r"^```\{run\}\n(?::alt: [^\n]*\n\n)?(.*?)^```", text, re.M | re.S)
    program = tmp_path / "program.py"
    program.write_text("\n".join(blocks))
    assert len(blocks) == PROGRAMS[page]
    run(sys.executable, "-W", "error", program, cwd=tmp_path)


def test_the_index_of_the_package_has_a_line_for_each_name():
    index = (DOCS / "api/index.md").read_text()
    names = re.findall(r"^   (\w+)$", index, re.M)
    assert sorted(names) == sorted(set(kr.__all__) - {"__version__", "MethodName", "QuantityName"})
