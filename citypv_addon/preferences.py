"""Preferences of the add-on."""

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty

from ..operators.city.read_settings import ADDON, use_cache_folder
from .properties import WEATHERS


def _follow_folder(preferences, context):
    use_cache_folder(preferences)


class Preferences(bpy.types.AddonPreferences):
    """What new scenes begin with, and what holds for all."""

    bl_idname = ADDON

    weather: EnumProperty(name="Weather", description="Source of weather that new scenes begin with", items=WEATHERS)
    weather_file: StringProperty(
        name="File", description="ERA5 (NetCDF), EPW, TMY3, PVGIS, or CSV with time zones", subtype="FILE_PATH"
    )
    threads: IntProperty(
        name="Threads", description="Number of threads where a scene gives none; 0: all processors", min=0
    )
    cache_folder: StringProperty(
        name="Cache",
        description="Folder that keeps the loops compiled for this computer; empty: beside the add-on. "
        "A change has effect when Blender starts again",
        subtype="DIR_PATH",
        update=_follow_folder,
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
