"""Settings of the city: which shapes are read, and on what ground they stand."""

from dataclasses import dataclass

from .setting import setting


@dataclass
class CitySettings:
    """Settings of the city, the first part of `core.settings.request.Request`."""

    lod: str | None = setting(None, "city", "level of detail; default: the best 2.x of each building", metavar="L")
    unit: str = setting(
        "m",
        "city",
        "unit of length of files that name no reference system",
        title="Unit",
        panel="import",
        choices={"m": "Metres", "ft": "International feet", "us-ft": "US survey feet"},
    )
    up: str = setting(
        "z",
        "city",
        "upward axis of files that do not state it (OBJ)",
        title="Up axis",
        panel="import",
        choices={"z": "The file's z axis points up", "y": "The file's y axis points up"},
    )
    orient: str = setting(
        "auto",
        "city",
        "flip polygons that face into their building, or keep all as drawn",
        title="Orientation",
        panel="import",
        choices={
            "auto": "Flip polygons that face into their building, where rays from both sides agree",
            "as-drawn": "Keep every polygon as drawn",
        },
    )
    latitude: float | None = setting(
        None, "city", "of the city; default: as in its files", kind="number", unit="°", metavar="D", least=-90, most=90
    )
    longitude: float | None = setting(
        None,
        "city",
        "of the city; default: as in its files",
        kind="number",
        unit="°",
        metavar="D",
        least=-180,
        most=180,
    )
    site_of: str | None = setting(
        None,
        "city",
        "result folder of another state of this city, whose place and grid are kept: then only what differs changes",
        metavar="DIR",
    )
    grid_size: float | None = setting(
        None,
        "city",
        "size of the cells, id#k, into which large polygons are split",
        kind="number",
        unit="m",
        metavar="M",
        above=0,
    )
    terrain: str | None = setting(
        None, "city", "measured terrain: TIN relief, OBJ, GeoTIFF or ASC grid", metavar="FILE"
    )
    ground: str = setting(
        "auto",
        "city",
        "auto: terrain of the city's files, else as feet; feet: generated through the bases of the buildings; none",
        choices={
            "auto": "Terrain of the city's files if they have any, else a surface through the bases of the buildings",
            "feet": "A surface through the bases of the buildings",
            "none": "Exactly the surfaces that were read",
        },
    )
    racks: str = setting(
        "none",
        "city",
        "rows of modules on flat roofs: east-west and KEY=VALUE, joined by commas, with keys tilt, azimuth, spacing or "
        "gcr, depth, rim, height, area, back-albedo",
        title="Racks",
        panel="classify",
        metavar="SPEC",
    )
