"""Pieces of a page as text. Whatever is given is escaped; what these functions return is not to be escaped again."""

from html import escape


def table(head, rows, *, numbers=()):
    """A table of text.

    Parameters
    ----------
    head : sequence of str
        Headings of the columns; empty for a table of names and values.
    rows : iterable of sequence of str
    numbers : collection of int
        Columns that are set to the right.

    Returns
    -------
    str
    """
    side = [' class="number"' if column in numbers else "" for column in range(1000 if not head else len(head))]
    lines = ["<table>"]
    if head:
        cells = "".join(f"<th{look}>{escape(text)}</th>" for text, look in zip(head, side, strict=True))
        lines.append(f"<thead><tr>{cells}</tr></thead>")
    lines.append("<tbody>")
    for row in rows:
        cells = "".join(f"<td{look}>{escape(str(text))}</td>" for text, look in zip(row, side, strict=False))
        lines.append(f"<tr>{cells}</tr>")
    return "\n".join([*lines, "</tbody></table>"])


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
