"""Write a city with its results as a .blend file."""

from pathlib import Path

import bpy

from .quieten import quieten
from .stage_city import stage_city


def write_blend(path, scene, transfer, energy, note=""):
    """Write `city.blend`: every face with its attributes, coloured by full load hours, with camera and legend.

    Empties Blender's own file first (see `stage_city`).

    Parameters
    ----------
    path : str or path-like
        File to write.
    scene, transfer, energy
        What core found; see `stage_city`.
    note : str
        What has to be read beside the colours, such as the weather.
    """
    stage_city(scene, transfer, energy, note)
    bpy.context.preferences.filepaths.save_version = 0
    with quieten():
        bpy.ops.wm.save_as_mainfile(filepath=str(Path(path).resolve()), compress=True, check_existing=False)
