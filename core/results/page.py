"""What a page is made of: paragraphs, tables, sections, pictures as HTML, and the page around them,
that may load nothing and run nothing but the scripts whose hashes its Content-Security-Policy
names.

Whatever the pieces of the page are given is escaped; what they return is not to be escaped again.
"""

import base64
import hashlib
from html import escape
from string import Template

from .charts import style_of_heat
from .words import WEB, spoken, words_as_data

SCRIPTS = ("viewer.js", "supply.js", "building.js", "report.js")
NONE = "'none'"


def fill_page(title, body, data=""):
    """A page that may load nothing, and run nothing but the 3D view, where there is `data` of
    `pack_city`: str.
    """
    codes = [_read_web("three.js"), "".join(map(_read_web, SCRIPTS))] if data else []
    packed = f'<script type="application/octet-stream" id="city-data">{data}</script>'
    scripts = [words_as_data(), packed] if data else []
    allowed = f"script-src {' '.join(map(_hash_source, codes)) or NONE}; img-src data:"
    return fill_template(
        title, body, [*scripts, *(f"<script>{code}</script>" for code in codes)], allowed
    )


def fill_template(title, body, scripts, allowed):
    """A page with scripts as HTML, whose Content-Security-Policy says what is `allowed`: str."""
    style = (
        _read_web("page.css")
        + style_of_heat()
        + _read_web("viewer.css")
        + _read_web("building.css")
    )
    return Template(_read_web("page.html")).substitute(
        policy=(
            f"default-src {NONE}; {allowed}; style-src {_hash_source(style)}; base-uri {NONE}; "
            f"form-action {NONE}"
        ),
        language=spoken()[0],
        title=escape(title),
        style=style,
        body=body,
        scripts="\n".join(scripts),
    )


def _read_web(name):
    """Text of a file in the folder web."""
    return (WEB / name).read_text(encoding="utf-8")


def _hash_source(text):
    """Source of a Content-Security-Policy that allows one inline script or style."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def table(head, rows, *, numbers=(), english=()):
    """A table of text.

    Parameters
    ----------
    head : sequence of str
        Headings of the columns; empty for a table of names and values.
    rows : iterable of sequence of str
    numbers : collection of int
        Columns that are set to the right.
    english : collection of int
        Columns whose cells are English in any language: what runs wrote, and names of settings.

    Returns
    -------
    str
    """
    columns = range(1000 if not head else len(head))
    side = [' class="number"' if column in numbers else "" for column in columns]
    tongue = [
        ' lang="en"' if column in english and spoken()[0] != "en" else "" for column in columns
    ]
    lines = ['<div class="wide" tabindex="0"><table>']
    if head:
        cells = "".join(
            f"<th{look}>{escape(text)}</th>" if text else "<td></td>"  # an empty heading is none
            for text, look in zip(head, side, strict=True)
        )
        lines.append(f"<thead><tr>{cells}</tr></thead>")
    lines.append("<tbody>")
    for row in rows:
        cells = "".join(
            f"<td{look}{own}>{escape(str(text))}</td>"
            for text, look, own in zip(row, side, tongue, strict=False)
        )
        lines.append(f"<tr>{cells}</tr>")
    return "\n".join([*lines, "</tbody></table></div>"])


def picture(uri, name, caption):
    """A picture with a caption."""
    return (
        f'<figure id="{escape(name)}"><img src="{uri}" alt="{escape(caption)}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def paragraph(text, style=""):
    """A paragraph, of a class of the style sheet where one is named."""
    look = f' class="{style}"' if style else ""
    return f"<p{look}>{escape(text)}</p>"


def section(title, *parts):
    """A heading and what stands below it; parts that are empty are left out."""
    return "\n".join([f"<section><h2>{escape(title)}</h2>", *filter(None, parts), "</section>"])


def fold(title, content):
    """Something that a reader unfolds; printed folded or not, as it stands."""
    return f"<details><summary>{escape(title)}</summary>\n{content}\n</details>"
