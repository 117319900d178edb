"""Code blocks that keyboard users can scroll: the Tab key reaches each one."""


def setup(app):
    app.connect("html-page-context", update_page)


def update_page(app, pagename, templatename, context, doctree):
    if "body" in context:
        context["body"] = make_focusable(context["body"])


def make_focusable(body):
    """Return HTML in which code blocks take part in the order of the Tab key."""
    return body.replace("<pre>", '<pre tabindex="0">')
