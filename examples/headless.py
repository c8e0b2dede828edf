"""The whole chain in Blender without a window: a city file becomes a coloured .blend and a picture.

    blender --background --python examples/headless.py -- CITY OUT [WEATHER]
    python examples/headless.py CITY OUT [WEATHER]          (with bpy and citypv installed)

CITY is a CityGML, CityJSON or OBJ file, OUT a folder; WEATHER a weather file, otherwise the
built-in climate is used.
"""

import sys
from pathlib import Path

import bpy


def main(arguments):
    """Run the steps of the panel with their operators."""
    if len(arguments) not in (2, 3):
        raise SystemExit(__doc__)
    city, folder = Path(arguments[0]).resolve(), Path(arguments[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    enable_addon()
    settings = bpy.context.scene.citypv
    if len(arguments) == 3:
        settings.weather, settings.weather_file = "file", str(Path(arguments[2]).resolve())
    bpy.ops.citypv.solar_city(filepath=str(city))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "city.blend"))
    bpy.ops.citypv.render(view="overview")
    bpy.data.images["Render Result"].save_render(
        str(folder / "city.png"), scene=bpy.data.scenes["CityPV picture"]
    )
    for row in next(item for item in bpy.context.scene.objects if "citypv_totals" in item)[
        "citypv_totals"
    ]:
        print("{}: {} kWp, {} MWh per year, {} h per year".format(*row.split("|")))


def enable_addon():
    """Enable CityPV: as an installed extension, else as a package of this Python."""
    if hasattr(bpy.types.Scene, "citypv"):
        return
    import citypv

    citypv.register()


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])
