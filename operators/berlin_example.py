"""The Berlin example: a square kilometre with a year of measured weather, bundled with the add-on."""

from pathlib import Path

import bpy

FOLDER = Path(__file__).parents[1] / "examples" / "berlin"
CITY, WEATHER = "berlin_3910_5817.gml", "era5_berlin_2017.nc"


class BerlinExample(bpy.types.Operator):
    """Run Solar city on the bundled square kilometre of Berlin with its weather of 2017 (ERA5)"""

    bl_idname = "citypv.berlin_example"
    bl_label = "Berlin example"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """The example is there."""
        cls.poll_message_set("The example is not part of this installation: it is the folder examples/berlin")
        return (FOLDER / CITY).is_file()

    def execute(self, context):
        """Choose its files, and run *Solar city*."""
        settings = context.scene.citypv
        settings.city_path, settings.own_place = str(FOLDER / CITY), False
        settings.weather, settings.weather_file = "file", str(FOLDER / WEATHER)
        return bpy.ops.citypv.solar_city("EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT")
