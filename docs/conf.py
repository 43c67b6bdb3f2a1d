"""The site: sphinx-build -W -b html docs build/site (pip install "grainlaw[docs]")."""

import re
import sys
from pathlib import Path

import grainlaw

sys.path.insert(0, str(Path(__file__).parent / "site"))

project = "grainlaw"
author = "The grainlaw developers"
project_copyright = "The grainlaw developers, BSD 3-Clause"
version = release = grainlaw.__version__

extensions = ["sphinx.ext.autodoc", "myst_parser", "sphinx_gallery.gen_gallery", "equations", "public_names"]
exclude_patterns = ["examples", "gallery", "site", "**/*.ipynb", "**/README.txt", "**/GALLERY_HEADER.rst"]
nitpicky = True
#: types that signatures name and nobody makes
INNER = "|".join(
    "AnyLaws Chunk Claim Compiled Figure Imposed L Listing Model "
    "Part Parts Progress RockFile Shared Shown Split ThreadCount Whole".split()
)
nitpick_ignore_regex = [
    ("py:.*", "(?!grainlaw).*"),
    ("py:.*", rf"grainlaw\..*\.({INNER})"),
]  # others are in the network

# The pages are written for GitHub: its anchors, its ```math, its <img>.
myst_enable_extensions = ["dollarmath", "html_image"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
suppress_warnings = ["config.cache"]  # nothing is unpicklable by mistake

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 100

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "auto_gallery",
    "filename_pattern": ".*",
    "within_subsection_order": "gallery_figures.Order",
    "image_scrapers": ("gallery_figures",),
    "reset_modules": (),
    "capture_repr": ("_repr_html_", "__repr__"),
    "ignore_repr_types": r"Figure|Axes",
    "first_notebook_cell": "%matplotlib inline",  # for figures of matplotlib itself; those of grainlaw show anyway
    "show_memory": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "show_signature": False,
    "download_all_examples": False,
    "abort_on_example_error": True,
}


#: pages of the site that stand above docs/
ABOVE = {"contributing": "CONTRIBUTING.md", "changelog": "CHANGELOG.md"}


def to_built_pages(app, name, source):
    """The pages link to what GitHub shows: an example leads to its script there, and to its page here."""
    text = source[0]
    if name in ABOVE:
        text = (Path(__file__).parents[1] / ABOVE[name]).read_text("utf-8").replace("](docs/", "](")
    for page, file in ABOVE.items():
        text = re.sub(rf"\]\((?:\.\./)?{file}", f"]({page}.md", text)
    text = text.replace("](reference/)", "](reference/index.rst)")
    if name == "validation":  # GitHub would show the block; the list above it leads to the same pages
        text += "\n```{toctree}\n:hidden:\n:glob:\n\ntables/*\n```\n"
    source[0] = re.sub(r"\]\(gallery/(\w*)(?:\.py)?\)", lambda it: f"](auto_gallery/{it[1] or 'index'}.rst)", text)


def setup(app):
    app.connect("source-read", to_built_pages)


html_theme = "furo"
html_title = f"grainlaw {release}"
html_show_sphinx = False
html_show_search_summary = False  # a browser reads no other page by itself where pages are files
html_static_path = ["site/static"]
html_css_files = ["pages.css"]
html_theme_options = {"navigation_with_keys": True}
