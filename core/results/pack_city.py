"""What report.html shows in 3D, packed for the page: shapes and numbers of every surface as base64
text.

The text holds no sign of any name, so that no id can change the page. Unpacked by web/viewer.js.
"""

import base64
import json
import zlib

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from ..city.classify import ORIENTATIONS
from ..city.polygons import triangulate
from ..energy.counted_area import REASONS
from ..energy.pv_system import KINDS
from .colour_map import DIVERGING, GROUND, MAPS, MISSING, choose_range
from .columns import COLUMNS
from .read_results import MONTHS, WORDS, in_order, select_mounted

COLOUR_MAP = "viridis"
GROUND_STEPS = 40  # of the ground's heights along each side
MARGIN = 0.04  # of the city's size, by which the ground is larger
BELOW = 0.2  # [m] of the ground below the feet of buildings
FOOT = 1.0  # [m] above the lowest corner of a building that its feet may lie
NEAREST = 12  # feet that a height of the ground follows, the nearer the more
FLAT = "modules lie flat; not among the totals of the city"


def pack_city(results, change=None):
    """The data of the 3D view as base64 of a raw deflate stream.

    The stream holds the length of a JSON header (uint32), the header, and its `arrays` one after
    the other: of 4-byte numbers, all first bytes, then all second ones and so on; whole numbers as
    differences. All little-endian.

    Parameters
    ----------
    results : Results
    change : pandas.DataFrame, optional
        Surfaces of a `Comparison` whose later state this is, to be shown as a colour and as sums of
        buildings too.

    Returns
    -------
    str
    """
    faces = results.faces
    mounted, values = measure_faces(faces, results.months)
    if change is not None:
        own = change.iloc[: len(faces)]  # behind them are those that are gone
        values["change"] = own["full_load_hours_change"].to_numpy(float)
        values["change_error"] = own["full_load_hours_change_standard_error"].to_numpy(float)
    buildings, building = np.unique(
        faces["building_id"].to_numpy(dtype=object).astype(str), return_inverse=True
    )
    kinds, sides = in_order(faces["kind"], KINDS), in_order(faces["orientation"], ORIENTATIONS)
    arrays = {
        "building": building,
        "kind": faces["kind"].map(kinds.index).to_numpy(),
        "side": faces["orientation"].map(sides.index).to_numpy(),
    } | values
    if change is not None:
        sums = change.groupby("building_id")["mwh_change"].sum().reindex(buildings)
        square = (
            (change["mwh_change_standard_error"] ** 2)
            .groupby(change["building_id"])
            .sum()
            .reindex(buildings)
        )
        arrays |= {
            "building_change": sums.to_numpy(float),
            "building_change_error": np.sqrt(square.to_numpy(float)),
        }
    shapes = {} if results.outlines is None else pack_shapes(results.outlines, building)
    packed = [_pack_array(name, array) for name, array in (arrays | shapes).items()]
    header = {
        "buildings": buildings.tolist(),
        "surfaces": faces["surface_id"].tolist(),
        **describe_view(kinds, sides, list_layers(values, mounted)),
        "arrays": [entry for entry, _ in packed],
    }
    text = json.dumps(header, separators=(",", ":")).encode("ascii")
    stream = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    parts = [len(text).to_bytes(4, "little"), text, *(data for _, data in packed)]
    return base64.b64encode(stream.compress(b"".join(parts)) + stream.flush()).decode("ascii")


def describe_view(kinds, sides, layers):
    """What the page must know to show any surface: dict."""
    return {
        "kinds": [
            {"name": name, "single": WORDS[name][0], "many": WORDS[name][1]} for name in kinds
        ],
        "sides": sides,
        "reasons": ["", FLAT, *REASONS.values()],
        "months": MONTHS,
        "layers": layers,
        "missing": f"#{MISSING}",
        "ground": f"#{GROUND}",
    }


def _pack_array(name, array):
    """Entry of the header, and bytes: of whole numbers the differences, of each number the first
    bytes first.
    """
    whole = array.dtype.kind in "iu"
    numbers = (
        np.diff(array.ravel(), prepend=0).astype("<i4") if whole else array.ravel().astype("<f4")
    )
    data = numbers.view(np.uint8).reshape(-1, 4).T.tobytes()
    return {"name": name, "whole": whole, "count": int(numbers.size)}, data


def measure_faces(faces, months):
    """Numbers of each surface.

    Parameters
    ----------
    faces : pandas.DataFrame
        Of `count_faces`.
    months : (n, 12) float [h]

    Returns
    -------
    mounted : pandas.DataFrame
        Of `select_mounted`.
    values : dict of (n,) arrays
        `reason` (int): place in the header's reasons of what is to be said of the surface, 0 if it
        counts, 1 if it does beside the totals. All others are float; hours of surfaces that carry
        modules hold for the area that counts.
    """
    mounted = select_mounted(faces)
    area, hours = faces["area"].to_numpy(float), faces["full_load_hours"].to_numpy(float)
    counted = faces["counted_area"].to_numpy(float)
    carries = counted > 0
    # Hours of faces.csv are means over the whole polygon, covered parts with zero.
    spread = np.where(carries, area / np.where(carries, counted, 1.0), 1.0)
    values = {
        "reason": np.where(
            carries,
            faces["eligible"] != "true",
            pd.Index(REASONS).get_indexer(faces["reason"]) + 2,
        ),
        "area": area,
        "counted": counted,
        "kwp": faces["kwp"].to_numpy(float),
        "tilt": faces["surface_tilt"].to_numpy(float),
        "azimuth": faces["surface_azimuth"].to_numpy(float),
        "sky": faces["sky_view_factor"].to_numpy(float),
        "hours": hours * spread,
        "error": faces["full_load_hours_standard_error"].to_numpy(float) * spread,
    }
    months = np.where(carries, months.T * spread, np.nan)
    return mounted, values | {f"month_{number:02d}": own for number, own in enumerate(months, 1)}


def list_layers(values, mounted):
    """What the city can be coloured by: list of dict.

    Each has the name of its values, title, unit, colours, their lowest and highest value and, if a
    month, the lowest and highest of all months.
    """
    titles = {column.name: (column.title, column.legend_unit) for column in COLUMNS if column.title}
    rows = mounted.index.to_numpy()
    area = values["counted"][rows]
    ranges = {name: choose_range(array[rows], area) for name, array in values.items()}
    ranges["energy"] = choose_range((values["kwp"] * values["hours"])[rows], np.ones(len(rows)))
    months = [name for name in values if name.startswith("month_")]
    words = {
        "hours": titles["full_load_hours"],
        "error": titles["full_load_hours_standard_error"],
        "energy": ("Energy of the surface", "kWh per year"),
        "sky": titles["sky_view_factor"],
    }
    words |= {name: (f"Full load hours in {MONTHS[int(name[-2:]) - 1]}", "h") for name in months}
    every = np.concatenate([values[name][rows] for name in months])
    shared = dict.fromkeys(months, choose_range(every, np.tile(area, len(months))))
    if "change" in values:
        words = {"change": ("Change of the full load hours", "h per year")} | words
        known = rows[np.abs(values["change"][rows]) > 2 * values["change_error"][rows]]
        most = max(map(abs, choose_range(values["change"][known], values["counted"][known])))
        ranges["change"] = -most, most
    stops = {
        name: [f"#{stop}" for stop in text.split()]
        for name, text in (MAPS | {"change": DIVERGING}).items()
    }
    return [
        {
            "name": name,
            "title": title,
            "unit": unit,
            "range": ranges[name],
            "shared": shared.get(name),
            "stops": stops["change" if name == "change" else COLOUR_MAP],
        }
        for name, (title, unit) in words.items()
    ]


def pack_shapes(outlines, building):
    """Corners, rings and triangles of the surfaces, and heights of the ground through the feet of
    the buildings.

    Returns
    -------
    dict of arrays
        The ground's are plate_bounds (4,), x and y, each from and to [m], and plate (GROUND_STEPS
        ** 2,) [m], rows from south to north.
    """
    rows = np.flatnonzero(
        np.diff(outlines.surface_start) > 0
    )  # triangulate knows no surface without rings
    ring_start, start = (
        outlines.ring_start.astype(np.int64),
        outlines.surface_start.astype(np.int64),
    )
    triangles, _ = triangulate(
        outlines.points.astype(float), ring_start, np.append(start[rows], start[-1])
    )
    points, corner_building = outlines.points, np.repeat(building, np.diff(ring_start[start]))
    low, high = points[:, :2].min(axis=0).astype(float), points[:, :2].max(axis=0).astype(float)
    margin = MARGIN * max(high - low)
    x, y = (np.linspace(low[axis] - margin, high[axis] + margin, GROUND_STEPS) for axis in (0, 1))
    nodes = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return {
        "corners": np.round(1000.0 * outlines.points.T).astype(
            np.int64
        ),  # [mm] all x, all y, all z
        "ring_start": ring_start,
        "surface_start": start,
        "triangles": triangles,
        "plate_bounds": np.array([x[0], x[-1], y[0], y[-1]]),
        "plate": heights_at(nodes, find_feet(points, corner_building).astype(float)) - BELOW,
    }


def find_feet(corners, building):
    """Corners within a metre of the lowest of their building, (k, 3) [m]."""
    _, building = np.unique(building, return_inverse=True)
    lowest = np.full(building.max() + 1, np.inf)
    np.minimum.at(lowest, building, corners[:, 2])
    return corners[corners[:, 2] < lowest[building] + FOOT]


def heights_at(places, feet):
    """Height [m] of the ground at places, (n, 2), from the nearest feet."""
    distance, near = cKDTree(feet[:, :2]).query(places, k=np.arange(1, min(NEAREST, len(feet)) + 1))
    return np.average(feet[near, 2], axis=1, weights=1 / (distance + 1) ** 2)
