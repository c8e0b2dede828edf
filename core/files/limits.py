"""What no file may exceed: coordinates beyond every place on Earth, names longer than a line."""

LARGEST_COORDINATE = 1e8  # [m, ft or °] beyond it lies no place on Earth in any system
LONGEST_NAME = 200  # characters


def clean_name(text):
    """A name that fits into one line of any table: no control characters, no halves of characters, no novel."""
    text = text[:LONGEST_NAME]
    return text if text.isprintable() else "".join(sign if sign.isprintable() else "\ufffd" for sign in text)
