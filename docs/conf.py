"""Settings of the manual's pages: `make docs` builds them with Sphinx."""

import citypv

project = "CityPV"
author = "CityPV"
release = version = citypv.__version__
extensions = ["myst_parser", "numpydoc", "sphinx.ext.autodoc", "sphinxarg.ext"]
exclude_patterns = []
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
myst_ref_domains = ["std", "py"]
numpydoc_show_class_members = False
autodoc_member_order = "bysource"
add_module_names = False
html_theme = "pydata_sphinx_theme"
html_title = "CityPV"
html_theme_options = {"navbar_align": "left", "show_prev_next": False, "navigation_depth": 2}
html_show_sourcelink = False


def find_results(app, name, source):
    """Tables of measurements stand beside the pages here, and beside `docs` in the repository."""
    source[0] = source[0].replace("](../../benchmarks/results/", "](../results/")


def setup(app):
    """Called by Sphinx."""
    app.connect("source-read", find_results)
