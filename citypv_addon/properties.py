"""The user's settings: of a scene, of timeline and comparison, of the add-on (preferences), of a
material.
"""

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    IntVectorProperty,
    PointerProperty,
    StringProperty,
)

from ..operators.city.attributes import TITLES
from ..operators.city.declare_settings import build_properties
from ..operators.city.read_materials import MATERIALS
from ..operators.city.read_settings import ADDON, ASKED_BY_KEY, FILES_WORDS, use_cache_folder
from ..operators.run import choose_faces
from ..operators.run.plan_trace import DAYS
from ..operators.show import show_modules, show_result
from ..operators.show.timeline import TIMED, follow_timeline_show

LODS = [
    ("BEST", "Best of 2.x", "The highest 2.x of each building, else 3, else 1"),
    ("1", "1", "Blocks with flat roofs"),
    ("2", "2", "Roof shapes"),
    ("3", "3", "Windows and details"),
]
GROUNDS = [
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
]
SUNS = [
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
]
ALBEDOS = [
    ("one", "One value", "The same albedo for all surfaces"),
    (
        "materials",
        "Materials",
        "From the materials of the faces; faces without a material get the single value",
    ),
    ("file", "File", "CSV by surface id or kind: surface,albedo,material"),
]
WEATHERS = [
    (
        "climate",
        "Climate",
        "Built-in long-term means for every location on land, with synthetic days",
    ),
    *(
        (one.key, one.title, f"Asked for with online access: {one.words}")
        for one in ASKED_BY_KEY.values()
    ),
    ("clear-sky", "Clear sky", "A year without clouds: upper bound"),
    ("file", "File", FILES_WORDS),
]
MAPS = [
    ("viridis", "Viridis", "Violet to yellow"),
    ("cividis", "Cividis", "Blue to yellow, safe for colour-blind viewers"),
    ("inferno", "Inferno", "Black to yellow"),
]
ORDERS = [
    ("change", "Change", "Change of energy"),
    ("percent", "Percent", "Change in percent"),
    ("before", "Before", "Energy before"),
    ("after", "After", "Energy after"),
    ("name", "Id", "Id of the building"),
    ("roofs", "Roofs", "Change of energy of the roofs"),
    ("facades", "Facades", "Change of energy of the facades"),
]
ATTRIBUTES = [(name, title, f"Face attribute citypv_{name}") for name, title in TITLES.items()]
SHOWN = [(name, TITLES[name], f"{TITLES[name]}, of the frame") for name in TIMED]


WEATHER_FILE = StringProperty(  # of a scene, and of what new ones begin with
    name="File", description=FILES_WORDS, subtype="FILE_PATH"
)
REFLECTION = StringProperty(  # of a material
    name="Reflects as",
    description=(
        "A known material, mirror or glossy:ROUGHNESS; empty: from its name, else from its shader"
    ),
    search=lambda self, context, text: [word for word in MATERIALS if text.lower() in word],
    search_options={"SUGGESTION"},
)


class Settings(bpy.types.PropertyGroup):
    """User settings: those declared by core, and those with another type in the panel."""

    # Import
    city_path: StringProperty(
        name="City",
        description="CityGML, CityJSON, OBJ, outlines (GeoJSON, GeoPackage) or a folder",
        subtype="FILE_PATH",
    )
    lod: EnumProperty(name="LoD", description="Level of detail to read", items=LODS)
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
    ground: EnumProperty(name="Ground", description="Ground below the city", items=GROUNDS)
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
    suns: EnumProperty(name="Suns", description="Sun positions to trace", items=SUNS)
    days: IntProperty(
        name="Days",
        description="Number of days, spread over the year",
        default=DAYS,
        min=1,
        max=365,
    )
    typical_days: IntProperty(
        name="Days", description="Number of typical days", default=12, min=1, max=365
    )
    sky_grid: IntProperty(
        name="Directions", description="Number of sky directions", default=1654, min=10
    )
    albedo_source: EnumProperty(
        name="Albedo from", description="Source of the albedo of the surfaces", items=ALBEDOS
    )
    albedo_file: StringProperty(
        name="File",
        description="CSV with the columns surface,albedo or surface,albedo,material",
        subtype="FILE_PATH",
    )
    horizon: StringProperty(
        name="Horizon",
        description="Distant terrain: GeoTIFF or ASC grid of heights up to 50 km around, or a CSV of angles (azimuth, "
        "elevation; PVGIS); empty: level",
        subtype="FILE_PATH",
    )
    threads: IntProperty(name="Threads", description="Number of threads; 0: all processors", min=0)
    # Energy
    weather: EnumProperty(
        name="Weather", description="Source of irradiance, temperature and wind", items=WEATHERS
    )
    weather_file: WEATHER_FILE
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
    # Colour
    attribute: EnumProperty(
        name="Show",
        description="Result to show as colours",
        items=ATTRIBUTES,
        default="kind",
        update=show_result.follow_choice,
    )
    colour_map: EnumProperty(
        name="Colour map",
        description="From low to high",
        items=MAPS,
        update=show_result.follow_choice,
    )
    auto_range: BoolProperty(
        name="Automatic range",
        description="Covers 96 % of the area",
        default=True,
        update=show_result.follow_choice,
    )
    low: FloatProperty(
        name="Low",
        description="Lowest colour [unit of the legend]",
        update=show_result.follow_choice,
    )
    high: FloatProperty(
        name="High",
        description="Highest colour [unit of the legend]",
        default=1,
        update=show_result.follow_choice,
    )
    show_colours: BoolProperty(
        name="Colours",
        description=(
            "Show the result as colours; off: the materials and the shading that you had before"
        ),
        default=True,
        update=show_result.follow_switch,
    )
    show_modules: BoolProperty(
        name="Modules",
        description="Draw each module where it lies on roofs and facades",
        update=show_modules.follow_modules,
    )
    show_legend: BoolProperty(
        name="Legend", description="Draw the legend in the 3D view", default=True
    )
    show_charts: BoolProperty(
        name="Charts", description="Draw charts of what was probed in the view", default=True
    )


Settings.__annotations__.update(build_properties({"least_hours": choose_faces.follow_least_hours}))


class Seeing(bpy.types.PropertyGroup):
    """State of timeline and comparison, stored with each Blender scene as `scene.citypv_seeing`."""

    timeline: BoolProperty(name="Timeline", description="Frames are hours of the months")
    timeline_show: EnumProperty(
        name="Show",
        description="What the faces show in the timeline",
        items=SHOWN,
        update=follow_timeline_show,
    )
    refine: BoolProperty(
        name="Refine", description="Trace further rounds up to a target or a time, and show each"
    )
    target_error: FloatProperty(
        name="Target error",
        description=(
            "Error of full load hours on 95 % of the area with modules at which to stop [%]; 0: none"
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
    sort_by: EnumProperty(
        name="Sort by", description="Order of the buildings", items=ORDERS, default="change"
    )
    sort_down: BoolProperty(
        name="Largest first", description="Show the largest first, not the smallest"
    )
    page: IntProperty(name="Page", description="Page of the table of buildings", default=1, min=1)
    frames_before: IntVectorProperty(
        name="Frames before", description="Start, end and current frame", size=3
    )
    world_before: PointerProperty(
        name="World before", description="World of the scene", type=bpy.types.World
    )
    side_by_side: BoolProperty(
        name="Side by side",
        description="Show the result kept as before to the west of the city",
        update=show_result.follow_side_by_side,
    )


class Preferences(bpy.types.AddonPreferences):
    """What new scenes begin with, and what holds for all."""

    bl_idname = ADDON

    weather: EnumProperty(
        name="Weather", description="Source of weather that new scenes begin with", items=WEATHERS
    )
    weather_file: WEATHER_FILE
    threads: IntProperty(
        name="Threads", description="Where a scene gives none; 0: all processors", min=0
    )
    cache_folder: StringProperty(
        name="Cache",
        description="Folder that keeps the loops compiled for this computer; empty: beside the add-on. "
        "A change has effect when Blender starts again",
        subtype="DIR_PATH",
        update=use_cache_folder,
    )

    def draw(self, context):
        """Show them."""
        self.layout.use_property_split = True
        column = self.layout.column()
        column.prop(self, "weather")
        if self.weather == "file":
            column.prop(self, "weather_file")
        column.prop(self, "threads")
        column.prop(self, "cache_folder")
