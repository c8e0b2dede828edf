"""Districts of a city: polygons with a name, from the formats of flat maps."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import shapely

from ..city.name_crs import choose_crs
from ..city.transform_crs import plane_of
from ..settings.errors import InputError
from .footprint_names import find_names
from .formats import format_of
from .open_input import clean_name
from .read_gdal import read_geoparquet, read_vector
from .read_geojson import read_geojson
from .read_geopackage import read_geopackage

OUTSIDE = "outside"  # name of the row of what lies in no district

# What producers call the name of a district, the first that a file has.
NAMES = (
    *("name", "name_de", "name_en", "bezeichnung", "bez", "gen", "label", "title"),
    *("district", "district_name", "neighbourhood", "neighborhood", "borough", "ward", "quarter"),
    *("stadtteil", "stadtteilname", "ortsteil", "ortsteilname", "oteil", "bezirk", "bezirksname"),
    *("bezname", "stadtbezirk", "quartier", "kreis", "gemarkung", "gemeinde", "gemeindename"),
    *("statistischer_bezirk", "plr_name", "bzr_name", "pgr_name", "namgem", "spatial_alias"),
    *("nom", "libelle", "l_qu", "nom_com", "nom_iris", "naam", "buurtnaam", "wijknaam"),
    *("gemeentenaam", "statnaam", "nombre", "nome", "denominazione", "nazwa", "nazev", "navn"),
    *("namn", "nimi", "ntaname", "boroname", "boro_name", "nhood", "community"),
)


@dataclass
class Districts:
    """Districts that a city reaches, in the plan of its scene."""

    names: list  # (d,) str, different
    shapes: np.ndarray  # (d,) of shapely polygons, one or several parts each [m]

    @property
    def rows(self):
        """Names of the districts and, last, of what lies in none: list of str."""
        return [*self.names, OUTSIDE]


def read_districts(text, site, points):
    """Read the districts that a city reaches.

    Polygons of one name are one district.

    Parameters
    ----------
    text : str
        FILE or FILE:COLUMN, whose column holds the names; without one, the first of the usual
        names that the file has.
    site : Site
    points : (m, 2 or 3) float [m]
        Of the city, in the scene's frame: districts that their bounding box meets are read.

    Returns
    -------
    Districts

    Raises
    ------
    InputError
        The file cannot be read, has no such column, leaves a district without a name, tells no
        place on Earth, has no district at the city, or two that overlap.
    """
    # Polygons of the file, and the name of the district that each belongs to.
    path, column = _split_column(text)
    content = _read_map(path, column)
    flat_map = content.flat_map
    names = _list_names(path, flat_map, column)
    # The one coordinate reference system that the file names; without a known one it is refused.
    crs, unknown = choose_crs(content.srs_names, float(flat_map.points.max()), path)
    if crs is None:
        named = [f"a coordinate reference system that is not known, {name!r}" for name in unknown]
        raise InputError(
            path,
            f"names {(named or ['no coordinate reference system'])[0]}",
            "save it with one, such as GeoJSON in degrees",
        )
    # Polygons in the city's plane; None for those that miss the city's bounding box. Refused where
    # all of them miss it. Formats of maps have longitude or easting first, whatever the registry
    # says.
    shapes = _shapes_at_city(flat_map.polygons(), crs, site, points)
    near = [row for row, shape in enumerate(shapes) if shape is not None]
    if not near:
        x, y = 0.5 * (flat_map.points.min(axis=0) + flat_map.points.max(axis=0))
        raise InputError(
            path,
            f"has no district at the city (latitude {site.latitude:.4f}°, longitude "
            f"{site.longitude:.4f}°): its polygons lie around {x:.6g} east, {y:.6g} north of {crs}",
            "give districts of this city, with their reference system and easting first",
        )
    # One shape for each name, the union of its polygons.
    named = {}
    for row in near:
        named.setdefault(names[flat_map.owner[row]], []).append(shapes[row])
    districts = Districts(
        list(named), np.array([shapely.union_all(parts) for parts in named.values()], object)
    )
    # Refused where two districts share more than 1 % of the smaller one's area.
    _check_overlaps(path, districts)
    return districts


def _split_column(text):
    """File, and the name of a column behind a colon or None, of FILE or FILE:COLUMN."""
    before, colon, after = text.rpartition(":")
    if colon and after and not Path(text).exists() and Path(before).exists():
        return Path(before), after
    return Path(text), None


def _read_map(path, column):
    """Polygons and attributes of a file: FileContent."""
    row = format_of(path)
    choose = partial(_choose_layer, column=column)
    readers = {
        "geojson": read_geojson,
        "geopackage": partial(read_geopackage, choose=choose),
        "vector": partial(read_vector, choose=choose),
        "geoparquet": read_geoparquet,
    }
    if row.reader not in readers:
        raise InputError(
            path,
            f"is {row.name}, not a map of districts",
            "give polygons with a name: GeoJSON, GeoPackage, shapefile, FlatGeobuf or GeoParquet",
        )
    return readers[row.reader](path)


def _choose_layer(layers, content, column):
    """The layer that has names of districts, as `flat_map.choose_layer`."""
    named = [name for name in layers if _find_column(layers[name], column)]
    chosen = named or list(layers)
    if len(chosen) != 1:
        told = ", ".join(map(clean_name, chosen[:10])) or "none"
        raise InputError(
            content.path,
            f"has not one layer that may be districts, but {told}",
            "save the one with districts as a file of its own",
        )
    return chosen[0]


def _find_column(columns, column):
    """The column of names: the one that is asked for, or the first usual one; None without it."""
    if column is not None:
        return column if column in columns else None
    return next((name for name, _ in find_names(columns, NAMES)), None)


def _list_names(path, flat_map, asked):
    """Name of each feature: list of str."""
    column = _find_column(flat_map.columns, asked)
    if column is None:
        told = ", ".join(clean_name(str(name)) for name in list(flat_map.columns)[:20]) or "none"
        missing = "such as name, district or ortsteil" if asked is None else repr(asked)
        raise InputError(
            path,
            f"has no column {missing} (its columns: {told})",
            "name the one that holds the names of districts, as FILE:COLUMN",
        )
    names = []
    for row, value in enumerate(flat_map.columns[column]):
        whole = isinstance(value, float) and value.is_integer()
        name = "" if value is None else clean_name(str(int(value) if whole else value).strip())
        if not name or name.lower() in ("nan", OUTSIDE):
            problem = f"feature {row + 1} has {name or 'nothing'!r} in column {column}"
            raise InputError(path, problem, "give each district a name of its own")
        names.append(name)
    return names


def _shapes_at_city(polygons, crs, site, points):
    """Valid polygons in plan that meet the bounding box of a city: list, None for those elsewhere.

    Parameters
    ----------
    polygons : (p,) of shapely.Polygon
        East or longitude first, in the units of their system.
    crs : str
        Their system.
    site : Site
    points : (k, 2 or 3) float [m]
        Of the city.
    """
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    box = shapely.box(*low, *high)
    # Edges are straight in their own system: pieces of 1 km bend by centimetres in the city's.
    system, _ = plane_of(crs)
    longest = np.radians(0.01) if system.is_geographic else 1000.0
    pieces = shapely.segmentize(polygons, longest / system.axis_info[0].unit_conversion_factor)
    shapes = shapely.transform(pieces, lambda places: site.from_system(places, crs))
    # What has no place in the city's plane lies far away.
    west, south, east, north = bounds = shapely.bounds(shapes).T
    meets = (west <= high[0]) & (east >= low[0]) & (south <= high[1]) & (north >= low[1])
    known = np.isfinite(bounds).all(axis=0) & np.isfinite(shapely.area(shapes))
    there = [None] * len(shapes)
    for row in np.flatnonzero(meets & known):
        valid = shapes[row] if shapes[row].is_valid else shapely.make_valid(shapes[row])
        there[row] = valid if valid.intersects(box) else None
    return there


def _check_overlaps(path, districts, share=0.01):
    """Refuse districts where one has more than a share of its area in another.

    Raises
    ------
    InputError
    """
    shapes = districts.shapes
    first, second = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    first, second = first[first < second], second[first < second]
    common = shapely.area(shapely.intersection(shapes[first], shapes[second]))
    smaller = np.minimum(shapely.area(shapes[first]), shapely.area(shapes[second]))
    for row in np.flatnonzero(common > share * smaller)[:1]:
        names = districts.names[first[row]], districts.names[second[row]]
        raise InputError(
            path,
            f"districts {names[0]!r} and {names[1]!r} overlap by {common[row]:,.0f} m²",
            "give districts of one level, that do not overlap",
        )
