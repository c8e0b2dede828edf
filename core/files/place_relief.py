"""Bring the relief of files to the coordinate reference system of their city."""

import numpy as np

from ..city.bring_places import bring_places, plane_of
from ..city.convert_to_metres import UNITS, east_first
from ..city.name_crs import name_crs
from ..ground.terrain import Layer, Terrain
from ..settings.errors import InputError
from .collect_relief import relief_layers


def place_relief(contents, city, unit):
    """Terrain of a city from the reliefs of its files, tiles of one level of detail joined.

    A relief stands in the system that it names, else in that of its file, else in that of the other files.

    Parameters
    ----------
    contents : list of FileContent
        Each with its system, as `join_contents` leaves them.
    city : City
        What cannot be used goes into its report.
    unit : {'m', 'ft', 'us-ft'}
        Where no file names a coordinate reference system.

    Returns
    -------
    Terrain or None
        In the city's system [m]; None where no file holds a usable triangle.
    """
    common = max((content.crs for content in contents if content.crs), key=len, default=None)
    of_lod, sources = {}, []
    for content in contents:
        if not content.relief.count():
            continue
        sources.append(str(content.path))
        try:
            crs = crs_of_relief(content.relief, content.path) or content.crs or common
            for lod, layer in zip(_lods(content.relief), relief_layers(content.relief), strict=True):
                of_lod.setdefault(lod, []).append(place_layer(layer, crs, city.crs, UNITS[unit], content.path))
        except InputError as error:  # the city can do without
            city.report.notes.append(f"Terrain of {error.source} left out: {error.problem}.")
    layers = [join_layers(of_lod[lod]) for lod in sorted(of_lod, reverse=True)]
    return Terrain(", ".join(sources), layers) if layers else None


def _lods(relief):
    return [lod for lod in sorted(relief.corners, reverse=True) if relief.corners[lod]]


def join_layers(layers):
    """One layer of the triangles of several."""
    starts = np.cumsum([0, *(len(layer.points) for layer in layers)])
    triangles = [layer.triangles + start for layer, start in zip(layers, starts[:-1], strict=True)]
    return Layer(np.concatenate([layer.points for layer in layers]), np.concatenate(triangles))


def crs_of_relief(relief, path):
    """The one system that a relief itself names, or None.

    Raises
    ------
    InputError
        It names two.
    """
    easting = next((numbers[0] for numbers in relief.corners.values() if numbers), None)
    named = {name_crs(text, easting) for text in relief.srs_names} - {None}
    if len({crs.split("+")[0] for crs in named}) > 1:
        raise InputError(
            path, f"uses two coordinate reference systems: {' and '.join(sorted(named))}", "convert it to one"
        )
    return max(named, key=len, default=None)


def place_layer(layer, crs, city_crs, unit, path):
    """A layer whose points stand as in the file, brought to the city's system.

    Parameters
    ----------
    layer : Layer
    crs, city_crs : str or None
        Without one of them the points stand in the city's system already, but for their unit.
    unit : float
        [m] The unit of such points.
    path : path-like
        Named in errors.

    Returns
    -------
    Layer

    Raises
    ------
    InputError
        A place has no counterpart in the city's system.
    """
    if crs is None or city_crs is None:
        return Layer(layer.points * unit, layer.triangles)
    plane, factor = plane_of(crs)
    points, _ = east_first(layer.points, plane)
    places = bring_places(points[:, :2], plane, city_crs, path)
    return Layer(np.column_stack([places, points[:, 2] * factor]), layer.triangles)
