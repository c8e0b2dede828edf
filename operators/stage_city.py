"""Set up a Blender scene of a city with results: objects, attributes, colours, camera, legend, sky, view."""

import bpy
import numpy as np

from .build_legend import build_legend
from .build_meshes import build_meshes, read_vertices, show_objects
from .colour_faces import colour_faces, show_exact_colours
from .place_camera import place_camera, set_background
from .show_city import show_city
from .write_attributes import write_classes, write_results

QUANTITY = "full_load_hours"


def stage_city(scene, transfer, energy, note=""):
    """Clear Blender's file and build a city with its results in it.

    Everything that was open in Blender is lost: this is for a Blender that runs without a window.

    Parameters
    ----------
    scene : core.scene.scene.Scene
    transfer : core.light.transfer.Transfer
    energy : core.energy.energy.Energy
    note : str
        What has to be read beside the colours, such as the weather.

    Returns
    -------
    bpy.types.Object
        The city, coloured by its full load hours.
    """
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    stage = bpy.context.scene
    city, ground = build_meshes(scene)
    show_objects(stage, city, ground)
    write_classes(city, ground, scene.surfaces)
    write_results(city, ground, transfer, energy)
    # A scene without full load hours (only ground) still gets a picture.
    known = np.isfinite(energy.full_load_hours).any()
    scale = colour_faces(city, ground, QUANTITY if known else "diffuse_relative")
    show_exact_colours(stage)
    set_background(stage)
    points = read_vertices(city)
    build_legend(stage, place_camera(stage, points), scale, note)
    show_city(points, screens=bpy.data.screens)
    return city
