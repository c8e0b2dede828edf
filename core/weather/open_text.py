"""Open a text file that may be gz-compressed."""

import gzip


def open_text(path):
    """Text file for reading, unpacked where it is gz-compressed, without a byte-order mark.

    Parameters
    ----------
    path : pathlib.Path
        The file.

    Returns
    -------
    file object
    """
    with path.open("rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
    if packed:
        return gzip.open(path, "rt", encoding="utf-8-sig", errors="replace")
    return path.open(encoding="utf-8-sig", errors="replace")
