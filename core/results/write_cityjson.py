"""Write city.city.json: the city as read, with full load hours of every surface, in CityJSON 2.0."""

import json
from itertools import pairwise

import numpy as np
import pandas as pd
import pyproj

from ..city.classify import find_footprints
from ..settings.progress import silent
from .columns import TABLED, column_values
from .write_buildings import sum_buildings

STAGE = "writing city.city.json"
FINEST, COARSEST = 6, 3  # decimals of a metre in vertices
LARGEST = 2**31 - 1  # many readers store vertex integers in 32 bits
PREFIX = "citypv_"
MONTHS = [f"full_load_hours_{number:02d}" for number in range(1, 13)]  # of buildings.csv
SEMANTICS = {
    "RoofSurface", "GroundSurface", "WallSurface", "ClosureSurface", "OuterCeilingSurface", "OuterFloorSurface",
    "Window", "Door",
}  # fmt: skip
BY_KIND = {"facade": "WallSurface", "ground": "GroundSurface", "downward": "OuterCeilingSurface"}
HIGHEST_LOD = "3"  # CityJSON has no LoD 4, whose outer shell corresponds to LoD 3


def write_cityjson(path, city, transfer, energy, *, system, weather, progress=silent):
    """Write a city with its results.

    Every building is a city object with one MultiSurface; each of its polygons has a semantic surface of its own. The
    type of that is the polygon's thematic class; where it has none, its kind tells: WallSurface for facades,
    GroundSurface for ground and floors on it, OuterCeilingSurface for what else faces down, RoofSurface for the rest.
    Its ``id`` is the ``surface_id`` of faces.csv, its attributes bear the names of that table behind ``citypv_``, and
    ``citypv_full_load_hours_by_month`` holds twelve values. What is unknown is left out. A format that knows no levels
    of detail is written as level 2, the outer shell of level 4 as level 3.

    Parameters
    ----------
    path : path-like
    city : City
        Its polygons are the surfaces of the Transfer, in their order.
    transfer : Transfer
    energy : Energy
    system : PvSystem
    weather : Weather
        Of the energy.
    progress : callable, optional
        See `core.progress`.
    """
    translate = np.floor(city.points.min(axis=0))
    local = city.points - translate  # [m]
    decimals = int(np.clip(np.floor(np.log10(LARGEST / max(local.max(), 1.0))), COARSEST, FINEST))
    whole, scale = np.round(local * 10**decimals).astype(np.int64), round(10.0**-decimals, decimals)
    vertices, index = np.unique(whole, axis=0, return_inverse=True)
    boundaries, surfaces = list_boundaries(city, index.reshape(-1).tolist()), describe_surfaces(city, transfer, energy)
    members = {}
    for polygon, building in enumerate(city.building_id):
        lod = (city.lod[polygon] if city.lod else "") or "2"
        lod = HIGHEST_LOD if lod.startswith("4") else lod
        members.setdefault(building, {}).setdefault(lod, []).append(polygon)
    sums, objects = sum_buildings(transfer, energy, system, weather, monthly=True).set_index("building_id"), {}
    for number, (building, levels) in enumerate(members.items()):
        progress(STAGE, number, len(members), "buildings")
        geometry = [
            {
                "type": "MultiSurface",
                "lod": lod,
                "boundaries": [boundaries[k] for k in own],
                "semantics": {"surfaces": [surfaces[k] for k in own], "values": list(range(len(own)))},
            }
            for lod, own in sorted(levels.items())
        ]
        attributes = describe_building(sums.loc[building])
        objects[building] = {"type": "Building", "attributes": attributes, "geometry": geometry}
    low, high = city.points.min(axis=0), city.points.max(axis=0)
    metadata = {
        "title": f"CityPV, full load hours [h per year] and irradiation [kWh/m² per year]; weather: {weather.label}",
        "geographicalExtent": np.round([*low, *high], 3).tolist(),
    }
    system = name_system(city.crs)
    if system:
        metadata["referenceSystem"] = system
    elif city.crs:
        metadata["title"] += f"; coordinates in {city.crs}"
    document = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [scale] * 3, "translate": translate.tolist()},
        "metadata": metadata,
        "CityObjects": objects,
        "vertices": vertices.tolist(),
    }
    path.write_text(json.dumps(document, ensure_ascii=False, separators=(",", ":")) + "\n", encoding="utf-8")
    progress(STAGE, len(members), len(members), "buildings")


def name_system(crs):
    """Coordinate reference system as CityJSON requires it, None if it has no EPSG code."""
    if not crs:
        return None
    system = pyproj.CRS.from_user_input(crs)
    parts = [system, *(system.sub_crs_list if system.is_compound else [])]
    number = next((code for part in parts if (code := part.to_epsg(100)) is not None), None)
    return None if number is None else f"https://www.opengis.net/def/crs/EPSG/0/{number}"


def list_boundaries(city, index):
    """Rings of each polygon, of the vertices that `index` names for its corners: list of list of list of int."""
    rings = []
    for first, last in pairwise(city.ring_start):
        ring = index[first:last]
        # Vertices that coincide with the one before after rounding are left out.
        kept = [corner for corner, before in zip(ring, ring[-1:] + ring[:-1], strict=True) if corner != before]
        rings.append(kept if len(set(kept)) > 2 else ring)
    return [rings[first:last] for first, last in pairwise(city.polygon_start)]


def describe_surfaces(city, transfer, energy):
    """Semantic surface of each polygon: list of dict."""
    floors = find_footprints(transfer.surfaces, city, city.points)
    types = [
        own if own in SEMANTICS else "GroundSurface" if floor else BY_KIND.get(kind, "RoofSurface")
        for own, kind, floor in zip(transfer.surfaces.thematic, transfer.surfaces.kind, floors, strict=True)
    ]
    table = pd.DataFrame({"type": types, "id": transfer.surfaces.surface_id})
    for column in TABLED:
        if column.name not in ("surface_id", "building_id"):
            table[PREFIX + column.name] = column_values(column, transfer, energy)
    found = [
        {name: short(value) if isinstance(value, float) else value for name, value in row.items() if value is not None}
        for row in table.astype(object).where(table.notna(), None).to_dict("records")
    ]
    for one, by_month in zip(found, energy.full_load_hours_by_month, strict=True):
        if np.isfinite(by_month).all():
            one[PREFIX + "full_load_hours_by_month"] = [short(value) for value in by_month]
    return found


def describe_building(sums):
    """Attributes of a building from its row of buildings.csv."""
    names = ("full_load_hours", "full_load_hours_dc", "kwp", "mwh_per_year", "mwh_dc_per_year")
    names = ("eligible_area", *names) if sums["kwp"] > 0 else ("eligible_area",)
    attributes = {PREFIX + name: short(sums[name]) for name in names}
    if len(names) > 1:
        by_month = [short(value) for name, value in sums.items() if name in MONTHS]
        attributes[PREFIX + "full_load_hours_by_month"] = by_month
    return attributes


def short(value):
    """Round to six significant digits, as in faces.csv."""
    return float(f"{value:.6g}")
