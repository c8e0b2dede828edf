"""The user's settings of a scene, and the state of its timeline and comparison."""

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..operators.city.build_meshes import suggest_buildings
from ..operators.city.declare_settings import build_properties
from ..operators.city.preferences import WeatherSettings
from ..operators.run.choose_faces import follow_least_hours
from ..operators.show.view_settings import TimelineSettings, ViewSettings


class Settings(WeatherSettings, ViewSettings, bpy.types.PropertyGroup):
    """User settings: those declared by core, and those with another type in the panel."""

    # Import
    city_path: StringProperty(
        name="City",
        description="CityGML, CityJSON, OBJ, outlines (GeoJSON, GeoPackage) or a folder",
        subtype="FILE_PATH",
    )
    lod: EnumProperty(
        name="LoD",
        description="Level of detail to read",
        items=[
            ("BEST", "Best of 2.x", "The highest 2.x of each building, else 3, else 1"),
            ("1", "1", "Blocks with flat roofs"),
            ("2", "2", "Roof shapes"),
            ("3", "3", "Windows and details"),
        ],
    )
    collection: PointerProperty(
        name="Collection",
        description=(
            "Its meshes, and those of its child collections, are the buildings; empty: the "
            "selected meshes"
        ),
        type=bpy.types.Collection,
    )
    # Classify
    own_place: BoolProperty(
        name="Own location", description="Give latitude and longitude, not those of the files"
    )
    latitude: FloatProperty(
        name="Latitude", description="Degrees, north is positive", min=-90, max=90, precision=4
    )
    longitude: FloatProperty(
        name="Longitude", description="Degrees, east is positive", min=-180, max=180, precision=4
    )
    ground: EnumProperty(
        name="Ground",
        description="Ground below the city",
        items=[
            # identifier, name, description, icon, number (as stored in .blend files)
            (
                "auto",
                "Automatic",
                "Terrain of the city's own files if they have any, otherwise generated",
                "NONE",
                0,
            ),
            ("feet", "Generated", "Surface through the base edges of the buildings", "NONE", 3),
            (
                "terrain",
                "Terrain file",
                "Measured terrain: TIN relief (CityGML), OBJ, GeoTIFF or ASC grid",
                "NONE",
                1,
            ),
            ("none", "None", "No ground: only the surfaces of the files", "NONE", 2),
        ],
    )
    terrain: StringProperty(
        name="File",
        description="TIN relief (CityGML), OBJ, GeoTIFF or ASC grid, also gzip-compressed",
        subtype="FILE_PATH",
    )
    split: BoolProperty(
        name="Split large surfaces", description="Into grid cells with results of their own"
    )
    grid_size: FloatProperty(
        name="Cell size", description="Side of a cell", default=5, min=0.1, subtype="DISTANCE"
    )
    # Trace
    suns: EnumProperty(
        name="Suns",
        description="Sun positions to trace",
        items=[
            ("days", "Days", "Days spread over the year, with cubic interpolation between them"),
            (
                "typical-days",
                "Typical days",
                "Representative days of the year, found by k-means (method of the paper)",
            ),
            ("hourly", "Every hour", "All hours of the year: reference, slow"),
            (
                "sky-grid",
                "Sky grid",
                "Directions over the whole sky: can be reused for every latitude and year",
            ),
        ],
    )
    typical_days: IntProperty(
        name="Days", description="Number of typical days", default=12, min=1, max=365
    )
    sky_grid: IntProperty(
        name="Directions", description="Number of sky directions", default=1654, min=10
    )
    albedo_source: EnumProperty(
        name="Albedo from",
        description="Source of the albedo of the surfaces",
        items=[
            ("one", "One value", "The same albedo for all surfaces"),
            (
                "materials",
                "Materials",
                "From the materials of the faces; faces without a material get the single value",
            ),
            ("file", "File", "CSV by surface id or kind: surface,albedo,material"),
        ],
    )
    albedo_file: StringProperty(
        name="File",
        description="CSV with the columns surface,albedo or surface,albedo,material",
        subtype="FILE_PATH",
    )
    horizon: StringProperty(
        name="Horizon",
        description="Distant terrain: GeoTIFF or ASC grid of heights up to 50 km around, or a CSV "
        "of angles (azimuth, "
        "elevation; PVGIS); empty: level",
        subtype="FILE_PATH",
    )
    threads: IntProperty(name="Threads", description="Number of threads; 0: all processors", min=0)
    # Energy
    weather_years: StringProperty(
        name="Years",
        description=(
            "Years to ask for, such as 2019 or 2015-2023; empty: the typical year, of PVGIS only"
        ),
    )
    weather_place: StringProperty(
        name="Measured at",
        description=(
            "Latitude and longitude of the weather, such as 52.38 13.06, where its file does not "
            "say them"
        ),
    )
    leave_out: StringProperty(
        name="Leave out",
        description="CSV with the columns id,words: faces or buildings without modules",
        subtype="FILE_PATH",
    )


Settings.__annotations__.update(build_properties({"least_hours": follow_least_hours}))


class Seeing(TimelineSettings, bpy.types.PropertyGroup):
    """State of timeline and comparison, stored with each Blender scene as `scene.citypv_seeing`."""

    refine: BoolProperty(
        name="Refine", description="Trace further rounds up to a target or a time, and show each"
    )
    target_error: FloatProperty(
        name="Target error",
        description=(
            "Error of full load hours on 95 % of the area with modules at which to stop [%]; 0: "
            "none"
        ),
        default=2.0,
        min=0,
        subtype="PERCENTAGE",
    )
    time_budget: FloatProperty(
        name="Time [s]",
        description="Time in which the last round has to end [s]; 0: no limit",
        default=60.0,
        min=0,
    )
    live: BoolProperty(
        name="Live",
        description="Compute an edit as soon as it is finished; a newer one cancels an older",
        default=True,
    )
    find: StringProperty(
        name="Find building",
        description="Address, name or id of a building",
        search=suggest_buildings,
        search_options={"SUGGESTION"},
    )
    sort_by: EnumProperty(
        name="Sort by",
        description="Order of the buildings",
        items=[
            ("change", "Change", "Change of energy"),
            ("percent", "Percent", "Change in percent"),
            ("before", "Before", "Energy before"),
            ("after", "After", "Energy after"),
            ("name", "Id", "Id of the building"),
            ("roofs", "Roofs", "Change of energy of the roofs"),
            ("facades", "Facades", "Change of energy of the facades"),
        ],
        default="change",
    )
    sort_down: BoolProperty(
        name="Largest first", description="Show the largest first, not the smallest"
    )
    page: IntProperty(name="Page", description="Page of the table of buildings", default=1, min=1)
