"""Settings of the manual's pages: `make docs` builds them with Sphinx."""

from pathlib import Path

import citypv
from citypv.core.commands.command_line import COMMANDS
from citypv.core.results.columns import TABLED

project = "CityPV"
author = "The CityPV developers"
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
html_search_scorer = str(Path(__file__).with_name("scorer.js"))

OPTIONS = """\
citypv {name}
{line}

{words}.

.. argparse::
   :module: citypv.core.commands.command_line
   :func: build_parser
   :prog: citypv
   :path: {name}
   :nodescription:
"""


def write_options(app):
    """A page for the options of each command, beside `options.rst`."""
    folder = Path(app.srcdir, "options")
    folder.mkdir(exist_ok=True)
    for name, (_, words) in COMMANDS.items():
        line = "=" * len(f"citypv {name}")
        text = OPTIONS.format(name=name, line=line, words=words[0].upper() + words[1:])
        (folder / f"{name}.rst").write_text(text, "utf-8")


def write_columns(app):
    """The columns of `Result.faces`, as the program's own table has them."""
    rows = [
        f'   "``{one.name}``", "{"" if one.unit == "1" else one.unit}", "{one.meaning}"\n'
        for one in TABLED
    ]
    head = '.. csv-table::\n   :header: "column", "unit", "meaning"\n\n'
    Path(app.srcdir, "columns.inc").write_text(head + "".join(rows), "utf-8")


def find_results(app, name, source):
    """Tables of measurements stand beside the pages here, and beside `docs` in the repository."""
    source[0] = source[0].replace("](../../benchmarks/results/", "](../results/")


def setup(app):
    """Called by Sphinx."""
    app.connect("builder-inited", write_options)
    app.connect("builder-inited", write_columns)
    app.connect("source-read", find_results)
