"""Configuration of the site: `make docs` calls Sphinx with this file and writes build/docs.

Neither the build nor the pages load anything from the network. The site uses no CDN and no external
fonts, renders formulas as MathML, and does not use indices of other projects.
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
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "making",
]
myst_enable_extensions = ["dollarmath", "deflist", "attrs_inline"]
myst_heading_anchors = 3
suppress_warnings = [
    # only parts of README.md and METHODS.md are included, without their first headings
    "myst.header",
]
default_role = "literal"
nitpicky = True
smartquotes = False  # quoted words are often input to be typed
exclude_patterns = ["examples/*", "making/*"]

html_theme = "furo"
html_title = f"kreisel {release}"
html_static_path = ["static", "../python/kreisel/viewer.html"]
html_css_files = ["kreisel.css"]
html_show_sphinx = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}

autodoc_typehints = "none"  # `making.docstrings` writes the names of types in the source code
maximum_signature_line_length = 80
autosummary_generate = False  # the pages in api/ describe all names
autodoc_member_order = "bysource"
autodoc_default_options = {
    "members": True,
    "inherited-members": "BaseException, tuple, dict, Mapping",
}
# Docstrings are plain text, which `making.docstrings` converts to reST.
nitpick_ignore_regex = [
    # Types in signatures, which api/index.md explains.
    (r"py:class", r"[A-Za-z]\w*|os\.PathLike|npt?\.\w+"),
    # The indices of other projects are not read, because the build uses no network.
    (r"py:.*", r"(numpy|scipy|matplotlib|pandas|xarray|pyarrow|concurrent|collections|typing)\..*"),
    # Built-in names that every Python programmer knows.
    (
        r"py:.*",
        r"(Runtime|Keyboard|Value|Type)Error|KeyboardInterrupt|NamedTuple|tuple|dict|object",
    ),
]

sphinx_gallery_conf = {
    "examples_dirs": ["examples"],
    "gallery_dirs": ["gallery"],
    "subsection_order": [
        f"examples/{part}" for part in ("tops", "free", "chaos", "practice", "fits", "numerics")
    ],
    "filename_pattern": "/",
    "run_stale_examples": True,  # each example runs at each build
    "within_subsection_order": "making.gallery.get_sort_key",
    "image_scrapers": ("matplotlib", "making.gallery.scraper"),
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

for tag, page in {"report": "index", "thesis": "thesis"}.items():
    if (ROOT / f"report/{page}.html").exists():
        tags.add(tag)  # noqa: F821, Sphinx gives it
