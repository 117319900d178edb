"""Changes to the pages for users of keyboards and screen readers.

The Tab key reaches all elements that may be wider than the page, so that they can be scrolled.
Multi-line signatures are not marked up as definition lists, and line anchors are not links.
"""

import re

SCROLLED = ("<pre", '<div class="formula"', '<div class="table-wrapper')


def setup(app):
    app.connect("html-page-context", update_page)


def update_page(app, pagename, templatename, context, doctree):
    if "body" in context:
        body = make_focusable(context["body"])
        context["body"] = drop_empty_links(flatten_signatures(body))


def make_focusable(body):
    """Return HTML in which the Tab key reaches code blocks, formulas and tables."""
    for begin in SCROLLED:
        tag, space, more = begin.partition(" ")
        body = body.replace(begin, f'{tag} tabindex="0"{space}{more}')
    return body


def flatten_signatures(body):
    """Return HTML in which the parameters of a signature are plain lines, not definitions."""

    def flatten(found):
        lines = found[1].replace("<dd>", '<span class="sig-line">').replace("</dd>", "</span>")
        return f'<span class="sig-paren">(</span><span class="sig-lines">{lines}</span>'

    begin = re.escape('<span class="sig-paren">(</span>')
    return re.sub(rf"{begin}\s*<dl>(.*?)</dl>", flatten, body, flags=re.DOTALL)


def drop_empty_links(body):
    """Return HTML in which the anchors of lines of code are not links."""
    return re.sub(r'(<a id="(line-\d+)" name="\2") href="#\2"></a>', r"\1></a>", body)
