"""Limits on the content of input files: size of coordinates, length of names."""

LARGEST_COORDINATE = 1e8  # [m, ft or °] larger than any coordinate on Earth in any system
LONGEST_NAME = 200  # characters


def clean_name(text):
    """A name that fits into one line of a table: no control characters or lone surrogates, limited in length."""
    text = text[:LONGEST_NAME]
    return text if text.isprintable() else "".join(sign if sign.isprintable() else "\ufffd" for sign in text)
