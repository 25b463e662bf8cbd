"""The web book: the course as a static site that needs neither a kernel nor a network."""

import os
import sys
from pathlib import Path

BOOK = Path(__file__).parent
sys.path[:0] = [str(BOOK), str(BOOK.parent / "notebooks")]

import prepare  # noqa: E402

import stairlab  # noqa: E402

TEACHERS = bool(os.environ.get("STAIRLAB_TEACHERS"))
""" A build for teachers has the solutions, too """
prepare.main(teachers=TEACHERS)

project = "stairlab"
author = "the stairlab authors"
version = release = stairlab.__version__
language = "en"
exclude_patterns = ["_build", "study.ipynb", "README.md"]
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinxcontrib.bibtex",
]
nitpicky = True
nitpick_ignore_regex = [("py:.*", prepare.NOT_OURS)]

# notebooks come executed
nb_execution_mode = "off"
nb_merge_streams = True
nb_render_markdown_format = "myst"
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence", "attrs_inline"]
myst_heading_anchors = 3
suppress_warnings = ["mystnb.unknown_mime_type"]
nb_mime_priority_overrides = [("html", "application/vnd.jupyter.widget-view+json", None)]

numfig = True
numfig_secnum_depth = 1
math_number_all = False
bibtex_bibfiles = ["references.bib"]
bibtex_default_style = "unsrt"

autodoc_default_options = {"member-order": "bysource"}
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "sphinx_book_theme"
html_title = "stairlab"
html_static_path = ["_static", "made/static"]
html_css_files = ["stairlab.css"]
html_js_files = ["stairlab.js"]
html_favicon = "_static/favicon.svg"
html_show_sourcelink = False
html_copy_source = False
html_context = {"default_mode": "auto"}
html_theme_options = {
    "navbar_persistent": [],
    "show_navbar_depth": 1,
    "show_toc_level": 2,
    "use_download_button": False,
    "use_fullscreen_button": False,
    "home_page_in_toc": True,
    "show_prev_next": True,
    "article_header_end": ["theme-switcher.html", "search-button.html", "toggle-secondary-sidebar.html"],
}
mathjax_path = "mathjax/tex-svg.js"
mathjax3_config = {"options": {"enableMenu": False}, "svg": {"fontCache": "none"}}
