"""Configuration of the site: `make docs` calls Sphinx with this file and writes build/docs.

Nothing is fetched, neither now nor by who reads: no CDN, no fonts from elsewhere, formulas as
MathML, and no index of other projects' pages.
"""

import sys
from pathlib import Path

import kreisel as kr

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path.insert(0, str(HERE))

project = "kreisel"
author = "the kreisel authors"
copyright = author
version = release = kr.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "myst_parser",
    "sphinx_gallery.gen_gallery",
    "making",
]
myst_enable_extensions = ["dollarmath", "deflist", "attrs_inline"]
myst_heading_anchors = 3
suppress_warnings = [
    # README.md and METHODS.md are shown in parts, which begin below their first heading
    "myst.header",
]
default_role = "literal"
nitpicky = True
smartquotes = False  # words in quotes are often to be typed
exclude_patterns = ["examples/*", "making/*", "sizes.md"]  # embedding.md includes sizes.md

html_theme = "furo"
html_title = f"kreisel {release}"
html_static_path = ["static", "../python/kreisel/viewer.html"]
html_css_files = ["kreisel.css"]
html_show_sphinx = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}

autodoc_typehints = "none"  # `making.docstrings` writes the types as the sources name them
maximum_signature_line_length = 80
autosummary_generate = False  # the pages in api/ describe all names
autodoc_member_order = "bysource"
autodoc_default_options = {
    "members": True,
    "inherited-members": "BaseException, tuple, dict, Mapping",
}
# Formulas, plain words and code stand in the docstrings; `making.docstrings` makes reST of them.
nitpick_ignore_regex = [
    # Types in signatures, which api/index.md explains.
    (r"py:class", r"[A-Za-z]\w*|os\.PathLike|npt?\.\w+"),
    # The indices of other projects are not read: the site is made without a network.
    (r"py:.*", r"(numpy|scipy|matplotlib|pandas|xarray|pyarrow|concurrent|collections|typing)\..*"),
    # What every reader of Python knows.
    (
        r"py:.*",
        r"(Runtime|Keyboard|Value|Type)Error|KeyboardInterrupt|NamedTuple|tuple|dict|object",
    ),
]

sphinx_gallery_conf = {
    "examples_dirs": ["examples"],
    "gallery_dirs": ["gallery"],
    "subsection_order": [
        f"examples/{part}" for part in ("chaos", "free", "tops", "practice", "fits", "numerics")
    ],
    "filename_pattern": "/",
    "run_stale_examples": True,  # each example runs at each build
    "within_subsection_order": "FileNameSortKey",
    "image_scrapers": ("making.thumbnails.scraper", "matplotlib", "making.gallery.scraper"),
    "reset_modules": ("matplotlib", "making.gallery.style"),
    "capture_repr": ("_repr_html_",),
    "write_computation_times": False,
    "show_memory": False,
    "remove_config_comments": True,
    "plot_gallery": True,
    "download_all_examples": False,
    "show_signature": False,
    "min_reported_time": 1,
    "thumbnail_size": (400, 280),
    "doc_module": ("kreisel",),
}

if (ROOT / "report/index.html").exists():
    tags.add("report")  # noqa: F821, Sphinx gives it
