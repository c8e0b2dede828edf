"""Choose the ground of a city: terrain given by the user, terrain of its own files, or none of them."""

import numpy as np

from .terrain import NEAR, measure_heights, nearest_heights


def choose_terrain(city, ground, given=None):
    """Choose the terrain of a city, and say what happened to that of its own files.

    Parameters
    ----------
    city : City
    ground : {'auto', 'feet', 'none'}
    given : Terrain, optional
        Takes precedence.

    Returns
    -------
    Terrain or None
    list of str
        Sentences for the report.
    """
    own = city.terrain
    if own is None:
        return given, []
    words = f"errain of the file: {count_triangles(own):,} triangles"
    if given is not None:
        return given, [f"T{words}, not used: {given.source} takes its place."]
    if ground != "auto":
        return None, [f"T{words}, left out (--ground {ground})."]
    return own, [f"Ground: t{words}."]


def count_triangles(terrain):
    """Number of triangles of all layers."""
    return sum(len(layer.triangles) for layer in terrain.layers)


def reaches_feet(terrain, feet):
    """Whether a terrain has a height under any foot, or close beside it.

    Parameters
    ----------
    terrain : Terrain
        In the frame of the feet.
    feet : Feet
    """
    places = feet.start[:, :2]
    if not np.isnan(measure_heights(terrain, places)).all():
        return True
    return not np.isnan(nearest_heights(terrain, places, NEAR)).all()
