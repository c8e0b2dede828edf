"""A flat map as it is read: outlines in arrays, and the attributes of each feature."""

import re
from array import array
from collections import Counter
from dataclasses import dataclass, field
from itertools import chain

import numpy as np
import pyproj
import shapely

from ..settings.errors import InputError
from . import footprint_names as names
from .open_input import LARGEST_COORDINATE, clean_name

# words in names of layers of buildings
BUILDINGS = (
    r"build|b[aâ]ti|geb(ä|ae)ud|haus|house|edif|immob|pand|bygn|byggn|budyn|budov"
    r"|footprint|rakenn|stavb"
)
OPENSTREETMAP = "© OpenStreetMap contributors, Open Database License (ODbL)"


@dataclass
class FlatMap:
    """Outlines of one file with the attributes of their f features. Rings are closed."""

    points: np.ndarray  # (m, 2) float64, in the order and the units of the file
    ring_start: np.ndarray  # (r + 1,) int64 into points
    polygon_start: np.ndarray  # (p + 1,) int64 into ring_start
    owner: np.ndarray  # (p,) int64, the feature of each polygon
    ids: list  # (f,) str, "" where a feature has none
    # name of an attribute -> list of (f,) values, None where a feature has none
    columns: dict = field(default_factory=dict)
    rows: list = field(default_factory=list)  # (f,) dict, where a file has them one by one

    def __len__(self):
        return len(self.ids)

    def polygons(self):
        """All outlines: (p,) of shapely.Polygon."""
        return shapely.from_ragged_array(
            shapely.GeometryType.POLYGON, self.points, (self.ring_start, self.polygon_start)
        )


class FeatureList:
    """Features of one file, one after the other, as they become a FlatMap.

    Parameters
    ----------
    content : FileContent
        What is left out is added to it.
    """

    def __init__(self, content):
        self._content, self._numbers = content, array("d")
        self._ring_ends, self._polygon_ends, self._owner = array("q"), array("q"), array("q")
        self._ids, self._rows, self._others = [], [], Counter()

    def add(self, geometry, attributes, name, where):
        """Add one feature.

        Parameters
        ----------
        geometry : object
            A GeoJSON geometry.
        attributes : dict
        name : str
            Its id, "" if it has none.
        where : str
            Its place in the file, for messages.
        """
        polygons, problem = _list_polygons(geometry)
        if problem in self._others or problem.isidentifier():
            self._others[problem] += 1
        elif problem:
            self._content.skip(problem, name or where)
        drawn = [polygon for polygon in polygons if self._add_polygon(polygon, name or where)]
        if drawn:
            self._owner.extend([len(self._ids)] * len(drawn))
            self._ids.append(name)
            self._rows.append(attributes)

    def _add_polygon(self, rings, where):
        """Add the rings of one polygon: True. Where they cannot be used nothing is added, the
        report says why, and it is False.
        """
        before, ends, problem = len(self._numbers), len(self._ring_ends), ""
        try:
            for number, ring in enumerate(rings):
                size = len(self._numbers)
                # All numbers go into one array; a third number, the height, is dropped.
                if len(ring) and len(ring[0]) == 2:
                    self._numbers.extend(chain.from_iterable(ring))
                else:
                    self._numbers.extend(chain.from_iterable(place[:2] for place in ring))
                # Of each place two numbers, the first place again at the end.
                if len(self._numbers) - size != 2 * len(ring):
                    raise TypeError
                if self._numbers[size : size + 2] != self._numbers[-2:]:
                    self._numbers.extend(self._numbers[size : size + 2])
                # Three corners at least: an outline without them is refused, a hole left out.
                if len(self._numbers) - size >= 8:
                    self._ring_ends.append(len(self._numbers) // 2)
                elif number == 0:
                    problem = "fewer than three points"
                    break
                else:
                    del self._numbers[size:]
        except (TypeError, KeyError):
            problem = "coordinates that are not lists of two or three numbers"
        # What was added is taken back where the polygon cannot be used.
        if problem or len(self._ring_ends) == ends:
            del self._numbers[before:], self._ring_ends[ends:]
            self._content.skip(problem or "outline without a ring", where)
            return False
        self._polygon_ends.append(len(self._ring_ends))
        return True

    def finish(self):
        """All features: FlatMap.

        Raises
        ------
        InputError
            There is no outline, or a coordinate is not finite or too large.
        """
        points = np.array(self._numbers).reshape(-1, 2)
        owner = np.array(self._owner, np.int64)
        path = self._content.path
        # Without a polygon the error tells what the file has instead; else other geometries are
        # noted.
        if not len(owner):
            kinds = ", ".join(f"{count:,} {kind}" for kind, count in self._others.most_common(5))
            problem = "contains no outlines" + (f" (but {kinds})" if kinds else "")
            raise InputError(path, problem, "give a file with polygons")
        for kind, count in self._others.most_common():
            self._content.notes.append(f"{count:,} {kind} of {path} left out: no outline.")
        starts = [
            np.concatenate([[0], ends]).astype(np.int64)
            for ends in (self._ring_ends, self._polygon_ends)
        ]
        # The first outline with a coordinate that cannot be used is named.
        wrong = ~(np.abs(points) <= LARGEST_COORDINATE).all(axis=1)  # also true for NaN
        if wrong.any():
            ring = np.searchsorted(starts[0], wrong.argmax(), "right") - 1
            feature = owner[np.searchsorted(starts[1], ring, "right") - 1]
            problem = (
                f"outline {feature + 1}: a coordinate is not finite or beyond "
                f"{LARGEST_COORDINATE:g}"
            )
            raise InputError(path, problem, "correct or remove it")
        # Attributes as columns.
        names = dict.fromkeys(chain.from_iterable(self._rows))
        columns = {name: [row.get(name) for row in self._rows] for name in names}
        return FlatMap(points, *starts, owner, self._ids, columns, self._rows)


def _list_polygons(geometry, depth=3):
    """Polygons of a GeoJSON geometry, each a list of rings, and what else it is, or is wrong, ""
    if nothing.
    """
    if not isinstance(geometry, dict):
        return [], "feature without a geometry"
    kind, places = geometry.get("type"), geometry.get("coordinates")
    if kind == "GeometryCollection" and depth:
        members = geometry.get("geometries")
        found = [
            _list_polygons(member, depth - 1)
            for member in members or []
            if isinstance(members, list)
        ]
        polygons = [polygon for own, _ in found for polygon in own]
        return polygons, "" if polygons else "GeometryCollection"
    if kind not in ("Polygon", "MultiPolygon"):
        return [], re.sub(r"\W", "", clean_name(str(kind))[:30]) or "feature"
    polygons = [places] if kind == "Polygon" else places
    if not isinstance(polygons, list) or not all(
        isinstance(rings, list) and all(isinstance(ring, list) for ring in rings)
        for rings in polygons
    ):
        return [], "coordinates that are not lists of rings"
    return polygons, ""


def map_of_wkb(geometries, ids, columns, content):
    """Flat map of features whose geometries are well-known binary.

    Parameters
    ----------
    geometries : list of (bytes or None)
    ids : list of str
    columns : dict
        As of FlatMap.
    content : FileContent
        What is left out is added to it.

    Returns
    -------
    FlatMap

    Raises
    ------
    InputError
        There is no outline, or a coordinate is not finite or too large.
    """
    # Heights of corners are dropped; features without a readable geometry are left out and told.
    shapes = shapely.from_wkb(np.array(geometries, object), on_invalid="ignore")
    shapes = shapely.force_2d(shapes)
    broken = shapely.is_missing(shapes) | shapely.is_empty(shapes)
    content.skipped |= (
        {
            "feature without a geometry": [
                ids[row] or f"feature {row + 1}" for row in np.flatnonzero(broken)
            ]
        }
        if broken.any()
        else {}
    )
    # Single polygons of all features, each with the row of its feature; lines and points are
    # counted and left out.
    parts, owner = shapely.get_parts(shapes[~broken], return_index=True)
    owner = np.flatnonzero(~broken)[owner]
    flat = shapely.get_type_id(parts) == shapely.GeometryType.POLYGON
    others = Counter(
        shapely.GeometryType(kind).name.title() for kind in shapely.get_type_id(parts[~flat])
    )
    for kind, count in others.most_common():
        content.notes.append(f"{count:,} {kind} of {content.path} left out: no outline.")
    # There must be polygons, with coordinates that are numbers.
    if not flat.any():
        kinds = ", ".join(f"{count:,} {kind}" for kind, count in others.most_common(5))
        problem = "contains no outlines" + (f" (but {kinds})" if kinds else "")
        raise InputError(content.path, problem, "give a file with polygons")
    _, points, (ring_start, polygon_start) = shapely.to_ragged_array(parts[flat])
    if not (np.abs(points) <= LARGEST_COORDINATE).all():
        problem = f"a coordinate is not finite or beyond {LARGEST_COORDINATE:g}"
        raise InputError(content.path, problem, "correct or remove it")
    # Features without a polygon go: the others are numbered anew, with their ids and attributes.
    rows, owner = np.unique(owner[flat], return_inverse=True)
    taken = {name: [values[row] for row in rows] for name, values in columns.items()}
    starts = ring_start.astype(np.int64), polygon_start.astype(np.int64)
    return FlatMap(points, *starts, owner.astype(np.int64), [ids[row] for row in rows], taken)


def name_of_definition(definition):
    """Name of a reference system from its definition: an EPSG code where PROJ knows it by heart,
    else the definition itself; "" where PROJ does not know it.
    """
    try:
        system = pyproj.CRS.from_user_input(definition)
    except (pyproj.exceptions.CRSError, TypeError):
        return ""
    code = system.to_epsg(70)
    return f"EPSG:{code}" if code else system.to_wkt()


def choose_layer(layers, content):
    """The layer of a file that has buildings: by its name, else by its attributes.

    Parameters
    ----------
    layers : dict
        Name of a layer -> names of its attributes.
    content : FileContent
        A note tells the layers that are passed over.

    Raises
    ------
    InputError
        There is none, or nothing tells which of several it is.
    """
    if not layers:
        raise InputError(content.path, "has no layer with geometries", "give a file with polygons")
    named = [name for name in layers if re.search(BUILDINGS, name.lower())]
    high = [
        name
        for name in named or layers
        if names.find_names(layers[name], (*names.HEIGHTS, *names.TOPS, *names.FLOORS))
    ]
    chosen = high or named or list(layers)
    if len(chosen) > 1:
        exact = [
            name for name in chosen if name.lower().rpartition(".")[2] in ("building", "buildings")
        ]
        chosen = exact if len(exact) == 1 else chosen
    if len(chosen) > 1:
        raise InputError(
            content.path,
            f"has several layers that may be buildings ({', '.join(map(clean_name, chosen[:10]))})",
            "save the one with buildings as a file of its own",
        )
    if len(layers) > 1:
        others = ", ".join(clean_name(name) for name in layers if name != chosen[0])
        content.notes.append(f"{content.path}: layer {chosen[0]} was read, not {others}.")
    return chosen[0]
