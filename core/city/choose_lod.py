"""One level of detail per building, never two."""

import re

from ..errors import InputError


def rank_lod(lod):
    """Order of preference: the best of 2.x, then 3.x, then 1.x, then the shell of 4; 0 is a footprint, no building.

    Returns
    -------
    tuple
        Larger is better.
    """
    whole, _, part = lod.partition(".")
    order = {"2": 4, "3": 3, "1": 2, "4": 1}.get(whole, 0)
    return order, int(part or 0)


def choose_lod(lods, wanted=None):
    """LoD to keep of one building.

    Parameters
    ----------
    lods : collection of str
        What the building has; "" is a shape of a format that knows no levels, and suits every wish.
    wanted : str, optional
        ``"2"`` takes the best of 2.x, ``"2.2"`` exactly that.

    Returns
    -------
    str or None
        None where the building has nothing to offer.
    """
    if wanted is None:
        candidates = [lod for lod in lods if lod == "" or rank_lod(lod)[0] > 0]
    else:
        candidates = [lod for lod in lods if lod in ("", wanted) or lod.split(".")[0] == wanted]
    return max(candidates, key=rank_lod, default=None)


def check_lod(lod):
    """LoD as text, or None.

    Raises
    ------
    InputError
        It is none of 0, 1, 2, 3, 4 or 0.0 … 4.9.
    """
    if lod is None:
        return None
    text = str(lod).strip()
    if not re.fullmatch(r"[0-4](\.\d)?", text):
        raise InputError("--lod", f"{text!r} is no level of detail", "give 1, 2, 3 or one such as 2.2")
    return text
