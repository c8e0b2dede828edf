"""The settings of the panel, kept with each Blender scene as `scene.citypv`."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..operators.attributes import TITLES
from ..operators.build_properties import build_properties
from ..operators.read_materials import MATERIALS

LODS = [
    ("BEST", "Best of 2.x", "The best level 2.x of each building, else 3, else 1"),
    ("1", "1", "Blocks with flat roofs"),
    ("2", "2", "Roof shapes"),
    ("3", "3", "Windows and details"),
]
GROUNDS = [
    ("auto", "Through the feet", "A surface through the buildings' feet"),
    ("terrain", "Terrain file", "Measured ground: TIN relief (CityGML), OBJ, GeoTIFF or ASC grid"),
    ("none", "None", "Exactly the surfaces that were read"),
]
SUNS = [
    ("days", "Days", "Days spread over the year, with cubic interpolation between them"),
    ("typical-days", "Typical days", "Days that stand for the year, found by k-means (the paper's way)"),
    ("hourly", "Every hour", "Every hour of the year: the reference, slow"),
    ("sky-grid", "Sky grid", "Directions all over the sky: good for every latitude and year"),
]
ALBEDOS = [
    ("one", "One value", "All surfaces reflect the same share"),
    ("materials", "Materials", "From the materials of the faces; faces without one have the albedo below"),
    ("file", "File", "csv by surface id or kind: surface,albedo,material"),
]
WEATHERS = [
    ("climate", "Climate", "Built-in long-term means of every place on land, with synthetic days"),
    ("pvgis", "PVGIS", "Typical year of the place, downloaded from PVGIS"),
    ("clear-sky", "Clear sky", "A year without clouds: an upper bound"),
    ("file", "File", "ERA5 (NetCDF), EPW, TMY3, PVGIS or a csv"),
]
MAPS = [
    ("viridis", "Viridis", "Violet to yellow"),
    ("cividis", "Cividis", "Blue to yellow, the same to colour-blind eyes"),
    ("inferno", "Inferno", "Black to yellow"),
]
ATTRIBUTES = [(name, title, f"Face attribute citypv_{name}") for name, title in TITLES.items()]


def build_material_property():
    """Build the property of a material that says what it reflects as."""
    return StringProperty(
        name="Reflects as",
        description="A named material, mirror or glossy:ROUGHNESS; empty: by its name, else by its shader",
        search=lambda self, context, text: [word for word in MATERIALS if text.lower() in word],
        search_options={"SUGGESTION"},
    )


class Settings(bpy.types.PropertyGroup):
    """What the user can set: the settings that core declares, and those that take another shape in the panel."""

    # Import
    city_path: StringProperty(
        name="City", description="File of buildings (CityGML, CityJSON, OBJ), or a folder", subtype="FILE_PATH"
    )
    lod: EnumProperty(name="Detail", description="Level of detail that is read", items=LODS)
    collection: PointerProperty(
        name="Collection",
        description="Its meshes are taken as buildings, with those of collections in it; empty: the selected meshes",
        type=bpy.types.Collection,
    )
    # Classify
    own_place: BoolProperty(
        name="Own place", description="Give latitude and longitude by hand instead of the reference system's"
    )
    latitude: FloatProperty(name="Latitude", description="Degrees, north is positive", min=-90, max=90, precision=4)
    longitude: FloatProperty(name="Longitude", description="Degrees, east is positive", min=-180, max=180, precision=4)
    ground: EnumProperty(name="Ground", description="What the city stands on", items=GROUNDS)
    terrain: StringProperty(
        name="File", description="TIN relief (CityGML), OBJ, GeoTIFF or ASC grid; gzip too", subtype="FILE_PATH"
    )
    split: BoolProperty(name="Split large surfaces", description="Split large surfaces into cells with own results")
    grid_size: FloatProperty(name="Cell", description="Side of the cells", default=5, min=0.1, subtype="DISTANCE")
    # Trace
    suns: EnumProperty(name="Suns", description="Which positions of the sun are traced", items=SUNS)
    days: IntProperty(name="Days", description="Number of days, spread over the year", default=24, min=1, max=365)
    typical_days: IntProperty(name="Days", description="Number of typical days", default=12, min=1, max=365)
    sky_grid: IntProperty(name="Directions", description="Number of directions", default=1654, min=10)
    albedo_source: EnumProperty(name="Albedo from", description="What the surfaces reflect", items=ALBEDOS)
    albedo_file: StringProperty(
        name="File", description="csv with the columns surface,albedo or surface,albedo,material", subtype="FILE_PATH"
    )
    threads: IntProperty(name="Threads", description="0 takes all processors", min=0)
    # Energy
    weather: EnumProperty(
        name="Weather", description="Where irradiance, temperature and wind come from", items=WEATHERS
    )
    weather_file: StringProperty(
        name="File", description="ERA5 (NetCDF), EPW, TMY3, PVGIS or a csv with tz-aware times", subtype="FILE_PATH"
    )
    # Colour
    attribute: EnumProperty(name="Show", description="What the colours mean", items=ATTRIBUTES, default="kind")
    colour_map: EnumProperty(name="Colours", description="Colours from low to high", items=MAPS)
    auto_range: BoolProperty(
        name="Automatic range", description="Round values that hold 96 % of the area", default=True
    )
    low: FloatProperty(name="Low", description="Value of the first colour, in the unit of the legend")
    high: FloatProperty(name="High", description="Value of the last colour, in the unit of the legend", default=1)
    show_legend: BoolProperty(name="Legend", description="Draw the legend into the 3D view", default=True)


Settings.__annotations__.update(build_properties())
