"""Generation of the HTML page of the report."""

from pathlib import Path

import jinja2
import kreisel as kr
import markupsafe

from ..competitors.single_runs import PEERS
from ..parts import fastest, formatting

HERE = Path(__file__).parent
FOLD = "<!-- fold -->"  # in the template of a part, what comes before this line is not folded
FOLDERS = [HERE / "templates", HERE.with_name("parts")]


def load_template(name, *folders):
    """Load a template from one of several folders."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([*folders, *FOLDERS]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "digits": formatting.format_digits,
        "milliseconds": formatting.format_milliseconds,
        "cite_peers": cite_peers,
    }
    return environment.get_template(name)


def cite_peers(svg, metadata):
    """Return the versions of other integrators in a figure and the date, or "" if it shows none."""
    if not any(name in svg for name in (*(peer.name for peer in PEERS), "gsl_")):
        return ""
    return markupsafe.Markup("<small>{}</small>").format(metadata["peers"])


def render_section(part, findings, metadata):
    """Return the conclusion of one part of the report and its HTML fragments, by name."""
    text = load_template(f"{part.name}.html").render(about=metadata, **part.build_context(findings))
    summary, mark, details = text.partition(FOLD)
    lead = ""
    if part.build_lead:
        lead = load_template(f"{part.name}_lead.html").render(
            about=metadata, **part.build_lead(findings)
        )
    bodies = {"shown": summary, "body": details} if mark else {"shown": "", "body": text}
    return {"part": part, "conclusion": part.conclude(findings), "lead": lead, **bodies}


def describe_methods(names):
    """Yield the name, the order, a description and a reference for each method."""
    for name, method in kr.methods.items():
        if name in names:
            yield {
                "name": name,
                "order": method.order or "varies",
                "text": method.text,
                "reference": method.reference,
            }
    for peer in PEERS:
        if peer.name in names:
            yield {
                "name": peer.name,
                "order": peer.order,
                "text": peer.text,
                "reference": "for comparison",
            }


def render_page(findings, metadata):
    """Return the HTML code of the report."""
    names = {name for part, part_findings in findings for name in part.list_methods(part_findings)}
    return load_template("report.html").render(
        about=metadata,
        references=list(fastest.list_references(names).values()),
        sections=[
            render_section(part, part_findings, metadata) for part, part_findings in findings
        ],
        methods=list(describe_methods(names)),
    )
