"""Keyboard access to code blocks: the Tab key reaches each one, so that it can be scrolled."""


def setup(app):
    app.connect("html-page-context", update_page)


def update_page(app, pagename, templatename, context, doctree):
    if "body" in context:
        context["body"] = make_focusable(context["body"])


def make_focusable(body):
    """Return HTML in which the Tab key reaches the code blocks."""
    return body.replace("<pre>", '<pre tabindex="0">')
