"""Generation of the HTML page of the report."""

from pathlib import Path

import jinja2
import kreisel as kr
import markupsafe

from ..competitors.single_runs import PEERS
from ..parts import advice, fastest, formatting

HERE = Path(__file__).parent
FOLDERS = [HERE / "templates", HERE.with_name("parts")]
BLOCKS = ("lead", "advice", "conclusion", "shown", "body")


def load_template(name, *folders):
    """Load a template from one of several folders."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([*folders, *FOLDERS]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= formatting.FILTERS | {"cite_peers": cite_peers}
    return environment.get_template(name)


def cite_peers(svg, metadata):
    """Return the versions of other integrators in a figure and the date, or "" if it shows none."""
    if not any(name in svg for name in (*(peer.name for peer in PEERS), "gsl_")):
        return ""
    return markupsafe.Markup("<small>{}</small>").format(metadata["peers"])


def render_section(part, findings, metadata):
    """Return one part of the report and the blocks of its template, by name."""
    template = load_template(f"{part.name}.html")
    context = template.new_context({"about": metadata} | part.build_context(findings))
    blocks = {name: "".join(block(context)) for name, block in template.blocks.items()}
    return {"part": part} | {name: blocks.get(name, "").strip() for name in BLOCKS}


def describe_methods(names):
    """Yield the name, the order, a description and a reference for each method."""
    for name, method in kr.methods.items():
        if name in names:
            yield name, method.order or "varies", method.text, method.reference
    for peer in PEERS:
        if peer.name in names:
            yield peer.name, peer.order, peer.text, "for comparison"


def render_page(findings, metadata):
    """Return the HTML code of the report."""
    names = {name for part, part_findings in findings for name in part.list_methods(part_findings)}
    return load_template("report.html").render(
        about=metadata,
        question=advice.QUESTION,
        answers=[
            answer
            for part, part_findings in findings
            for answer in part.list_answers(part_findings)
        ],
        references=list(fastest.list_references(names).values()),
        sections=[
            render_section(part, part_findings, metadata) for part, part_findings in findings
        ],
        methods=list(describe_methods(names)),
    )
