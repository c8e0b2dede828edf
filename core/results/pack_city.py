"""What report.html shows in 3D, packed for the page: shapes and numbers of every surface as base64
text.

The text holds no sign of any name, so that no id can change the page. Unpacked by web/viewer.js.
"""

import base64
import json
import zlib

import numpy as np
from scipy.spatial import cKDTree

from ..city.building_facts import FACTS
from ..city.classify import ORIENTATIONS
from ..city.polygons import triangulate
from ..energy.pv_system import KINDS
from .describe_buildings import describe_buildings
from .read_results import in_order, town_of
from .viewer_columns import describe_view, list_layers, measure_faces, sum_counting

BELOW = 0.2  # [m] of the ground below the feet of buildings


def pack_city(results, change=None, *, with_modules=True):
    """The data of the 3D view as base64 of a raw deflate stream.

    The stream holds the length of a JSON header (uint32), the header, and its `arrays` one after
    the other: of 4-byte numbers, all first bytes, then all second ones and so on; whole numbers as
    differences. All little-endian.

    Parameters
    ----------
    results : Results
    change : pandas.DataFrame, optional
        Surfaces of a `Comparison` whose later state this is, to be shown as a colour and as sums of
        buildings too. Surfaces that are gone stand last in it: they have no colour of their own,
        but count in the sums of their building.
    with_modules : bool
        Whether the shapes of modules are packed, where they are known.

    Returns
    -------
    str
    """
    # Values of each surface, and with a comparison their change.
    faces = results.faces
    mounted, values = measure_faces(faces, results.months)
    if change is not None:
        own = change.iloc[: len(faces)]  # behind them are those that are gone
        values["change"] = own["full_load_hours_change"].to_numpy(float)
        values["change_error"] = own["full_load_hours_change_standard_error"].to_numpy(float)
    # Texts become numbers of a list: building, kind, direction.
    buildings, building = np.unique(
        faces["building_id"].to_numpy(dtype=object).astype(str), return_inverse=True
    )
    kinds, sides = in_order(faces["kind"], KINDS), in_order(faces["orientation"], ORIENTATIONS)
    arrays = {
        "building": building,
        "kind": faces["kind"].map(kinds.index).to_numpy(),
        "orientation": faces["orientation"].map(sides.index).to_numpy(),
    } | values
    # Change of each building; its error from independent surfaces, by the root of the squares.
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
    # Texts and sums as in buildings.csv; without these sums the page adds up its surfaces.
    texts, sums = _take_buildings(results.buildings, buildings)
    arrays |= sums
    supply = sum_counting(faces["kind"].to_numpy(str), values)
    # Shapes of the surfaces, then the header that says what each array is, then all in one stream.
    shapes = {} if results.outlines is None else pack_shapes(results.outlines, building)
    if results.layout is not None and with_modules:
        shapes |= _pack_modules(results.layout)
    packed = [_pack_array(name, array) for name, array in (arrays | shapes).items()]
    header = {
        "buildings": buildings.tolist(),
        "texts": texts,
        "town": town_of(texts.get("address", ())),
        "surface_id": faces["surface_id"].tolist(),
        **describe_view(
            kinds, sides, list_layers(values, mounted), supply, results.summary["totals"]
        ),
        "arrays": [entry for entry, _ in packed],
    }
    # What the page of a building says beside these sums, where the run's folder tells any.
    if results.folder is not None:
        told = dict(describe_buildings(results.folder))
        header["places"] = [told.get(name) for name in buildings.tolist()] if told else None
    text = json.dumps(header, separators=(",", ":")).encode("ascii")
    stream = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    parts = [len(text).to_bytes(4, "little"), text, *(data for _, data in packed)]
    return base64.b64encode(stream.compress(b"".join(parts)) + stream.flush()).decode("ascii")


def _take_buildings(table, names):
    """Texts of the buildings by column, of columns that have any; and their sums as buildings.csv
    has them, so that page and table agree to the last digit: dict of list of str, dict of arrays.
    """
    if table is None:
        return {}, {}
    table = table.set_index("building").reindex(names)
    texts = {name: table[name].tolist() for name in FACTS if table[name].any()}
    if table["kwp"].isna().any():  # of a folder without them the page adds up its surfaces
        return texts, {}
    own = {"kwp": "kwp", "mwh": "mwh_per_year", "mwh_error": "mwh_standard_error"}
    return texts, {f"building_{name}": table[own[name]].to_numpy(float) for name in own}


def _pack_modules(layout):
    """Surface of each module, and its lower left corner and edges [mm], all x, all y, all z: dict
    of arrays.
    """
    corners = layout.corners()
    shapes = {
        "corner": corners[:, 0],
        "along": corners[:, 1] - corners[:, 0],
        "up": corners[:, 3] - corners[:, 0],
    }
    return {"module_surface": layout.surface} | {
        f"module_{name}": np.round(1000.0 * points.T).astype(np.int64)
        for name, points in shapes.items()
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


def pack_shapes(outlines, building):
    """Corners, rings and triangles of the surfaces, and heights of the ground through the feet of
    the buildings.

    Returns
    -------
    dict of arrays
        The ground's are plate_bounds (4,), x and y, each from and to [m], and plate (GROUND_STEPS
        ** 2,) [m], rows from south to north.
    """
    # triangulate knows no surface without rings
    rows = np.flatnonzero(np.diff(outlines.surface_start) > 0)
    ring_start, start = (
        outlines.ring_start.astype(np.int64),
        outlines.surface_start.astype(np.int64),
    )
    triangles, _ = triangulate(
        outlines.points.astype(float), ring_start, np.append(start[rows], start[-1])
    )
    points, corner_building = outlines.points, np.repeat(building, np.diff(ring_start[start]))
    low, high = points[:, :2].min(axis=0).astype(float), points[:, :2].max(axis=0).astype(float)
    # The ground is larger than the city by 4 % of its size on each side.
    margin = 0.04 * max(high - low)
    # The ground has 40 heights along each side.
    x, y = (np.linspace(low[axis] - margin, high[axis] + margin, 40) for axis in (0, 1))
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
    # The feet of a building lie within 1 m of its lowest corner.
    return corners[corners[:, 2] < lowest[building] + 1.0]


def heights_at(places, feet):
    """Height [m] of the ground at places, (n, 2), from the nearest feet."""
    # A height of the ground follows twelve feet, the nearer the more.
    distance, near = cKDTree(feet[:, :2]).query(places, k=np.arange(1, min(12, len(feet)) + 1))
    return np.average(feet[near, 2], axis=1, weights=1 / (distance + 1) ** 2)
