"""Keyboard access: the Tab key reaches all that may be wider than the page, to scroll it."""

SCROLLED = ("<pre", '<div class="formula"', '<div class="table-wrapper')


def setup(app):
    app.connect("html-page-context", update_page)


def update_page(app, pagename, templatename, context, doctree):
    if "body" in context:
        context["body"] = make_focusable(context["body"])


def make_focusable(body):
    """Return HTML in which the Tab key reaches code blocks, formulas and tables."""
    for begin in SCROLLED:
        tag, space, more = begin.partition(" ")
        body = body.replace(begin, f'{tag} tabindex="0"{space}{more}')
    return body
