"""Write city.city.json: the city as read, with full load hours of every surface, in
CityJSON 2.0.
"""

import json
from itertools import pairwise

import numpy as np
import pandas as pd
import pyproj

from ..city.city import free_name
from ..city.classify import find_footprints
from ..city.transform_crs import plane_of
from ..settings.progress import silent
from .cityjson_surroundings import list_objects, list_points
from .columns import TABLED
from .write_buildings import sum_buildings
from .write_summary import finite

PREFIX = "citypv_"
MONTHS = [f"full_load_hours_{number:02d}" for number in range(1, 13)]  # of buildings.csv
SEMANTICS = {
    "RoofSurface",
    "GroundSurface",
    "WallSurface",
    "ClosureSurface",
    "OuterCeilingSurface",
    "OuterFloorSurface",
    "Window",
    "Door",
}


def write_cityjson(path, run, progress=silent, *, further_decimals=6):
    """Write a city with its results.

    Every building, and every part of one, is a city object with a MultiSurface; each of its
    polygons has a semantic surface of its own. The surface's type is the polygon's thematic class;
    where it has none, its kind tells: WallSurface for facades, GroundSurface for ground and floors
    on it, OuterCeilingSurface for what else faces down, RoofSurface for the rest. Trees, and the
    terrain of the files, are objects of their own. Coordinates stand as in the files. The ``id`` of
    a semantic surface is the ``surface_id`` of faces.csv, its attributes bear the names of columns
    there behind ``citypv_``, and ``citypv_full_load_hours_by_month`` holds twelve values. What is
    unknown is left out.
    Buildings and parts keep the attributes and addresses of their files. A format that knows no
    levels of detail is written as level 2, the outer shell of level 4 as level 3.

    Parameters
    ----------
    path : path-like
    run : RunResults
    progress : callable, optional
        See `core.settings.progress`.
    """
    stage = "writing city.city.json"
    city, _, transfer, energy, weather = run
    # Coordinates stay as in the files: their system, their units, their order.
    points = city.grid.to_files(np.concatenate([city.points, list_points(city)]))
    # Vertices are whole steps from the lowest corner, `translate`: this is a whole number of a unit
    # or, where a unit is 111 km long, of a thousandth. A step has as few decimals as the span lets.
    coarse = np.array([1e3, 1e3, 1.0]) if _in_degrees(city.crs) else np.ones(3)
    translate = np.floor(points.min(axis=0) * coarse) / coarse
    local = points - translate
    # decimals that degrees need more
    # Coordinates in degrees have more decimals: a degree is 111 km.
    finer = [
        further_decimals * _in_degrees(city.crs),
        further_decimals * _in_degrees(city.crs),
        0,
    ]
    decimals = [
        _choose_decimals(span, more) for span, more in zip(local.max(axis=0), finer, strict=True)
    ]
    # In metres all axes have the step of the coarsest.
    if not any(finer):
        decimals = [min(decimals)] * 3
    # Places that are the same step are one vertex, to which boundaries refer by index.
    whole = np.round(local * 10.0 ** np.array(decimals)).astype(np.int64)
    scale = [round(10.0**-places, places) for places in decimals]
    vertices, index = np.unique(whole, axis=0, return_inverse=True)
    index = index.reshape(-1).tolist()
    boundaries, surfaces = _list_boundaries(city, index), _describe_surfaces(city, transfer, energy)
    members = _sort_polygons(city)
    # Energy of each building becomes its attributes.
    sums, objects = (
        sum_buildings(transfer, energy, weather, monthly=True).set_index("building_id"),
        {},
    )
    colours = list(city.colours)

    def tell(building, part, results):
        """Members of a city object with what the files tell of it, and attributes of results."""
        told = finite(city.attributes.get((building, part), {}))
        attributes = told.get("attributes", {}) | results
        return told | ({"attributes": attributes} if attributes else {})

    def draw(levels):
        """Geometries of some polygons, by their level of detail."""
        return [
            {
                "type": "MultiSurface",
                "lod": lod,
                "boundaries": [boundaries[k] for k in own],
                "semantics": {
                    "surfaces": [surfaces[k] for k in own],
                    "values": list(range(len(own))),
                },
                **_wear_materials(city, own, colours),
            }
            for lod, own in sorted(levels.items())
        ]

    # A city object for each building, with its parts as children.
    taken = dict.fromkeys(members, 1)
    for number, (building, parts) in enumerate(members.items()):
        progress(stage, number, len(members), "buildings")
        own = {}
        for part, levels in parts.items():
            if part:
                name = free_name(f"{building}_part_{len(own) + 1}", taken)
                own[name] = {
                    "type": "BuildingPart",
                    "parents": [building],
                    **tell(building, part, {}),
                    "geometry": draw(levels),
                }
        objects[building] = {
            "type": "Building",
            **tell(building, "", _describe_building(sums.loc[building])),
            "geometry": draw(parts.get("", {})),
        }
        objects[building] |= {"children": list(own)} if own else {}
        objects |= own
    # Trees and terrain follow, and what readers of the file need to place it on Earth.
    objects |= list_objects(city, index[len(city.points) :], objects)
    low, high = points.min(axis=0), points.max(axis=0)
    metadata = {
        "title": (
            "CityPV, full load hours [h per year] and irradiation [kWh/m² per year]; weather: "
            f"{weather.label}"
        ),
        "geographicalExtent": np.round([*low, *high], max(decimals)).tolist(),
    }
    system = name_system(city.crs)
    if system:
        metadata["referenceSystem"] = system
    elif city.crs:
        metadata["title"] += f"; coordinates in {city.crs}"
    document = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": scale, "translate": translate.tolist()},
        "metadata": metadata,
        **({"appearance": {"materials": _list_materials(city, colours)}} if colours else {}),
        "CityObjects": objects,
        "vertices": vertices.tolist(),
    }
    # Dates and decimals of other formats become texts; halves of signs stay as JSON spells them.
    text = json.dumps(document, ensure_ascii=False, separators=(",", ":"), default=str)
    path.write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
    progress(stage, len(members), len(members), "buildings")


def _sort_polygons(city):
    """Polygons of a city by building, part of it, and level of detail: dict of dict of dict of list
    of int; a part that has attributes and no shape has none.
    """
    members = {}
    for polygon, building in enumerate(city.building_id):
        lod = (city.lod[polygon] if city.lod else "") or "2"
        # CityJSON has no level 4; its outer shell corresponds to level 3.
        lod = "3" if lod.startswith("4") else lod
        part = city.part[polygon] if city.part else ""
        members.setdefault(building, {}).setdefault(part, {}).setdefault(lod, []).append(polygon)
    # Parts without a polygon that was kept still have what the file tells of them.
    for building, part in city.attributes:
        if building in members:
            members[building].setdefault(part, {})
    return members


def _wear_materials(city, own, colours):
    """Materials of some polygons, as a member of a geometry: dict, empty where none has one."""
    names = [city.material[k] if city.material else "" for k in own]
    values = [colours.index(name) if name in colours else None for name in names]
    return (
        {"material": {"file": {"values": values}}}
        if any(value is not None for value in values)
        else {}
    )


def _list_materials(city, colours):
    """Materials of the files, with their diffuse colours where they are known."""
    known = ((name, city.colours[name]) for name in colours)
    return [
        {"name": name, **({"diffuseColor": list(one)} if one is not None else {})}
        for name, one in known
    ]


def _choose_decimals(span, more):
    """Decimals of coordinates that reach so far: as many as integers of 32 bits hold, between two
    bounds.
    """
    # Many readers store vertex integers in 32 bits.
    most = np.floor(np.log10((2**31 - 1) / max(span, 10.0**-more)))
    # Vertices have 3 to 6 decimals of a metre.
    return int(np.clip(most, 3 + more, 6 + more))


def _in_degrees(crs):
    """Whether the coordinates of a system are in degrees."""
    return crs is not None and plane_of(crs)[0].is_geographic


def name_system(crs):
    """Coordinate reference system as CityJSON requires it, None if it has no EPSG code and is not
    CRS84.

    Of a compound one without a code of its own the horizontal part is named alone where its heights
    are read the same way without their system, else both parts.
    """
    if not crs:
        return None
    system, url = pyproj.CRS.from_user_input(crs), "https://www.opengis.net/def/crs"
    parts = [
        part.to_epsg(100) for part in (system, *(system.sub_crs_list if system.is_compound else []))
    ]
    if (
        parts[0] is None
        and len(parts) > 2
        and None not in parts[1:3]
        and plane_of(crs)[1] != plane_of(parts[1])[1]
    ):
        return f"{url}-compound?1={url}/EPSG/0/{parts[1]}&2={url}/EPSG/0/{parts[2]}"
    if system.to_authority() == ("OGC", "CRS84"):  # of GeoJSON, which EPSG has north first only
        return f"{url}/OGC/1.3/CRS84"
    number = next((code for code in parts if code is not None), None)
    return None if number is None else f"{url}/EPSG/0/{number}"


def _list_boundaries(city, index):
    """Rings of each polygon, of the vertices that `index` names for its corners: list of list of
    list of int.
    """
    rings = []
    for first, last in pairwise(city.ring_start):
        ring = index[first:last]
        # Vertices that coincide with the one before after rounding are left out.
        kept = [
            corner
            for corner, before in zip(ring, ring[-1:] + ring[:-1], strict=True)
            if corner != before
        ]
        rings.append(kept if len(set(kept)) > 2 else ring)
    return [rings[first:last] for first, last in pairwise(city.polygon_start)]


def _describe_surfaces(city, transfer, energy):
    """Semantic surface of each polygon, with its class, id and results: list of dict."""
    # Class of each: the file's own, else ground for a footprint, else by its kind.
    floors = find_footprints(transfer.surfaces, city, city.points)
    by_kind = {
        "facade": "WallSurface",
        "ground": "GroundSurface",
        "downward": "OuterCeilingSurface",
    }
    types = [
        own if own in SEMANTICS else "GroundSurface" if floor else by_kind.get(kind, "RoofSurface")
        for own, kind, floor in zip(
            transfer.surfaces.thematic, transfer.surfaces.kind, floors, strict=True
        )
    ]
    # Columns of faces.csv as attributes; what is empty or unknown is left out.
    table = pd.DataFrame({"type": types, "id": transfer.surfaces.surface_id})
    for column in TABLED:
        if column.name not in ("surface_id", "building_id"):
            table[PREFIX + column.name] = column.values_of(transfer, energy)
    semantic_surfaces = [
        {
            name: _short(value) if isinstance(value, float) else value
            for name, value in row.items()
            if value not in (None, "")
        }
        for row in table.astype(object).where(table.notna(), None).to_dict("records")
    ]
    # Months as lists, where they are known.
    for semantic_surface, by_month in zip(
        semantic_surfaces, energy.full_load_hours_by_month, strict=True
    ):
        if np.isfinite(by_month).all():
            semantic_surface[PREFIX + "full_load_hours_by_month"] = [
                _short(value) for value in by_month
            ]
    return semantic_surfaces


def _describe_building(sums):
    """Attributes of a building from its row of buildings.csv."""
    names = ("full_load_hours", "full_load_hours_dc", "kwp", "mwh_per_year", "mwh_dc_per_year")
    names = ("eligible_area", *names) if sums["kwp"] > 0 else ("eligible_area",)
    attributes = {PREFIX + name: _short(sums[name]) for name in names}
    if len(names) > 1:
        by_month = [_short(value) for name, value in sums.items() if name in MONTHS]
        attributes[PREFIX + "full_load_hours_by_month"] = by_month
    return attributes


def _short(value):
    """Round to six significant digits, as in faces.csv."""
    return float(f"{value:.6g}")
