"""Changes to the pages for users of keyboards and screen readers.

The Tab key reaches all elements that may be wider than the page, so that they can be scrolled.
Multi-line signatures are not marked up as definition lists, and line anchors are not links.
"""

import re

SCROLLED = ("<pre", '<div class="formula"', '<div class="table-wrapper')
PAREN = '<span class="sig-paren">(</span>'


def setup(app):
    app.connect("html-page-context", update_page)


def update_page(app, pagename, templatename, context, doctree):
    if "body" in context:
        context["body"] = change_html(context["body"])


def change_html(body):
    for begin in SCROLLED:
        tag, space, more = begin.partition(" ")
        body = body.replace(begin, f'{tag} tabindex="0"{space}{more}')
    body = re.sub(rf"{re.escape(PAREN)}\s*<dl>(.*?)</dl>", flatten_signature, body, flags=re.DOTALL)
    return re.sub(r'(<a id="(line-\d+)" name="\2") href="#\2"></a>', r"\1></a>", body)


def flatten_signature(found):
    lines = found[1].replace("<dd>", '<span class="sig-line">').replace("</dd>", "</span>")
    return f'{PAREN}<span class="sig-lines">{lines}</span>'
