"""A Transfer of a part of a city, completed to one of the whole city."""

from dataclasses import replace

import numpy as np

from ..light.transfer import SourceLight

FILLED = ("diffuse_relative", "sky_view_factor", "far_ground_view_factor")


def fill_untraced(transfer, names):
    """Let surfaces without light of the sky have the mean light of those traced of their kind and orientation.

    What single suns do is put in relation to all light, so that surfaces without the light of the sky would show too
    large errors.

    Parameters
    ----------
    transfer : Transfer
        Of a part of a city.
    names : (n,) str
        Kind and orientation of each surface.

    Returns
    -------
    Transfer
        For estimates only.
    """
    traced, area = transfer.diffuse_relative > 0, np.asarray(transfer.surfaces.area, float)
    if traced.all() or not traced.any():
        return transfer

    def fill(values):
        return fill_means(np.asarray(values), traced, names, area)

    sources = {
        name: SourceLight(**{field: fill(values) for field, values in vars(light).items()})
        for name, light in transfer.sources.items()
    }
    return replace(transfer, sources=sources, **{name: fill(getattr(transfer, name)) for name in FILLED})


def fill_means(values, traced, names, area):
    """Values (n, …) of untraced surfaces replaced by the mean over traced ones of the same name, or of all."""
    filled = values.copy()
    for name in np.unique(names[~traced]):
        alike = traced & (names == name)
        alike = alike if alike.any() else traced
        filled[~traced & (names == name)] = np.average(values[alike], axis=0, weights=area[alike])
    return filled
