"""A part of a Transfer: some of its surfaces."""

from dataclasses import fields, replace

import numpy as np


def take_rows(transfer, rows):
    """Transfer of some surfaces only; outlines are left out.

    Parameters
    ----------
    transfer : Transfer
    rows : (k,) int

    Returns
    -------
    Transfer
    """
    taken = {name: take_fields(getattr(transfer, name), rows) for name in ("surfaces", "error_parts")}
    taken["sources"] = {name: take_fields(light, rows) for name, light in transfer.sources.items()}
    own = {name: value for name, value in vars(transfer).items() if isinstance(value, np.ndarray)}
    taken |= {name: np.asarray(value[rows]) for name, value in own.items()}
    material = transfer.material and [transfer.material[k] for k in rows]
    bare = transfer.bare and take_rows(transfer.bare, rows)
    return replace(transfer, **taken, material=material, bare=bare, outlines=None)


def take_fields(part, rows):
    """Some rows of each field of a dataclass whose fields are arrays or lists with as many; None of None."""
    if part is None:
        return None
    values = {one.name: getattr(part, one.name) for one in fields(part)}
    return replace(part, **{name: _take(value, rows) for name, value in values.items()})


def _take(value, rows):
    if value is None:
        return None
    return value[rows] if isinstance(value, np.ndarray) else [value[k] for k in rows]
