"""Sums by district: which district each building lies in, districts.csv, and the same with shapes
for a map, districts.geojson.
"""

import json

import numpy as np
import pandas as pd
import shapely

from ..read.read_districts import read_districts
from ..settings.errors import InputError
from .columns import write_table
from .write_buildings import sum_surfaces
from .write_summary import finite


def write_districts(path, transfer, energy, weather, text):
    """Write sums over the surfaces of the buildings in each district, and in none.

    Parameters
    ----------
    path : pathlib.Path
        Of the table; beside it, a file of the same name that ends in .geojson has the shapes.
    transfer : Transfer
    energy : Energy
    weather : Weather
        Of the energy.
    text : str
        FILE or FILE:COLUMN, of `read_districts`.

    Raises
    ------
    InputError
        The districts cannot be used, or the Transfer has no shapes of surfaces.
    """
    if transfer.outlines is None:
        raise InputError(
            "--districts", "the light of this file has no shapes of surfaces", "simulate again"
        )
    districts = read_districts(text, transfer.site, transfer.outlines.points)
    buildings, building = np.unique(
        np.array(transfer.surfaces.building_id, dtype=object).astype(str), return_inverse=True
    )
    place, divided = place_buildings(transfer.outlines, building, len(buildings), districts.shapes)
    # The last row has what lies in no district, so that all rows together are the city.
    count = len(districts.rows)
    table = {
        "district": districts.rows,
        "buildings": np.bincount(place, minlength=count),
        "border_buildings": np.bincount(place[divided], minlength=count),
    }
    table = pd.DataFrame(table | sum_surfaces(transfer, energy, weather, place[building], count))
    write_table(path, table)
    _write_shapes(path.with_suffix(".geojson"), table, districts.shapes, transfer.site)


def place_buildings(outlines, building, count, shapes):
    """The district of each building: that with the largest share of its area in plan, none if more
    of it lies outside than in any.

    Parameters
    ----------
    outlines : Outlines
    building : (n,) int
        Of each surface.
    count : int
        Number of buildings.
    shapes : (d,) of shapely polygons [m]

    Returns
    -------
    place : (count,) int
        d for none.
    divided : (count,) bool
        Whether it lies in several districts, or partly outside: on a border.
    """
    # All surfaces from above. Walls have no area there; roofs and floors both show the footprint.
    points = outlines.points[:, :2].astype(float)
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    owner = np.repeat(building, np.diff(outlines.ring_start[outlines.surface_start]))
    np.minimum.at(low, owner, points)
    np.maximum.at(high, owner, points)
    boxes = np.full(count, shapely.Polygon())
    drawn = np.isfinite(low).all(axis=1)
    boxes[drawn] = shapely.box(*low[drawn].T, *high[drawn].T)
    # A building whose bounding box lies within one district is settled.
    place, divided = np.full(count, len(shapes)), np.zeros(count, bool)
    shapely.prepare(shapes)
    tree = shapely.STRtree(boxes)
    district, settled = tree.query(shapes, predicate="covers")
    np.minimum.at(place, settled, district)
    # Of the others the plan is cut with the districts around; what is left of it lies outside.
    district, near = tree.query(shapes, predicate="intersects")
    for own in np.setdiff1d(near, settled):
        around = district[near == own]
        plan = _plan_of(outlines, points, np.flatnonzero(building == own))
        inside = shapely.area(shapely.intersection(plan, shapes[around]))
        shares = np.append(inside, max(plan.area - inside.sum(), 0.0))
        place[own] = np.append(around, len(shapes))[np.argmax(shares)]
        # A thousandth is how far maps of the same border differ.
        divided[own] = np.sort(shares)[-2] > 1e-3 * shares.sum()
    return place, divided


def _plan_of(outlines, points, surfaces):
    """What surfaces cover in plan, a strip of 1 cm where they are walls alone: shapely geometry."""
    rings = [
        [points[outlines.ring_start[k] : outlines.ring_start[k + 1]] for k in range(first, last)]
        for first, last in zip(
            outlines.surface_start[surfaces], outlines.surface_start[surfaces + 1], strict=True
        )
        if last > first
    ]
    drawn = shapely.make_valid([shapely.Polygon(own[0], own[1:]) for own in rings])
    parts = shapely.get_parts(drawn)
    plan = shapely.union_all(parts[shapely.get_type_id(parts) == shapely.GeometryType.POLYGON])
    return plan if plan.area > 0 else shapely.union_all(shapely.buffer(parts, 0.005))


def _write_shapes(path, table, shapes, site):
    """Write the rows of a table with the shapes of districts, in degrees; the last has none."""
    features = []
    for row, shape in zip(table.to_dict("records"), [*shapes, None], strict=True):
        geometry = None
        if shape is not None:
            geometry = shapely.geometry.mapping(on_earth(shape, site))
        features.append({"type": "Feature", "properties": finite(row), "geometry": geometry})
    collection = {"type": "FeatureCollection", "features": features}
    path.write_text(json.dumps(collection, ensure_ascii=False) + "\n", encoding="utf-8")


def on_earth(shape, site):
    """A shape in plan, in longitude and latitude [°] to about a centimetre: shapely geometry."""

    def turn(points):
        places = site.find_on_earth(np.column_stack([points, np.zeros(len(points))]))
        return np.column_stack(places[::-1])

    return shapely.set_precision(shapely.transform(shape, turn), 1e-7)
