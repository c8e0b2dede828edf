"""Choose one level of detail per building."""

import re

from ..settings.errors import InputError


def rank_lod(lod):
    """Preference: the highest 2.x, then 3.x, 1.x, and the outer shell of 4; 0 is a footprint and never chosen.

    Returns
    -------
    tuple
        The largest is preferred.
    """
    whole, _, part = lod.partition(".")
    order = {"2": 4, "3": 3, "1": 2, "4": 1}.get(whole, 0)
    return order, int(part or 0)


def choose_lod(lods, wanted=None):
    """LoD to use for one building.

    Parameters
    ----------
    lods : collection of str
        LoDs of the building; "" is geometry of a format without LoDs, and matches every request.
    wanted : str, optional
        ``"2"`` takes the highest 2.x, ``"2.2"`` exactly that.

    Returns
    -------
    str or None
        None if the building has no matching LoD.
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
        It is not one of 0, 1, 2, 3, 4 or 0.0 … 4.9.
    """
    if lod is None:
        return None
    text = str(lod).strip()
    if not re.fullmatch(r"[0-4](\.\d)?", text):
        raise InputError("--lod", f"{text!r} is not a level of detail", "give 1, 2, 3, or for example 2.2")
    return text
