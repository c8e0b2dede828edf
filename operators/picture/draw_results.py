"""Blender's part of the command line: `city.blend` and `preview.png` of `citypv simulate`."""

import ctypes
import io
import os
import sys
from contextlib import contextmanager, redirect_stdout, suppress

import bpy
import numpy as np

from ..attributes import write_classes, write_results
from ..city.build_meshes import build_meshes, read_vertices, show_objects
from .build_legend import build_legend
from .colour_faces import colour_faces, show_exact_colours
from .show_city import place_camera, set_background, show_city

SAMPLES = 16  # rays per pixel; only the ground's ambient occlusion is noisy


def draw_results(folder, scene, transfer, energy, note, *, pictures):
    """Let Blender write pictures into a folder, of the city from above the south-east with camera and legend.

    In `city.blend` every face has its attributes and is coloured by full load hours, as it is in `preview.png`.
    Everything that was open in Blender is lost: this is for a Blender that runs without a window.

    Parameters
    ----------
    folder : pathlib.Path
    scene : Scene
    transfer : Transfer
    energy : Energy
    note : str
        What has to be read beside the colours, such as the weather.
    pictures : list of {'blend', 'preview'}
    """
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    stage, folder = bpy.context.scene, folder.resolve()
    city, ground = build_meshes(scene)
    show_objects(stage, city, ground)
    write_classes(city, ground, scene.surfaces)
    write_results(city, ground, transfer, energy)
    # A scene without full load hours (only ground) still gets a picture.
    known = np.isfinite(energy.full_load_hours).any()
    scale = colour_faces(city, ground, "full_load_hours" if known else "diffuse_relative")
    show_exact_colours(stage)
    set_background(stage)
    points = read_vertices(city)
    build_legend(stage, place_camera(stage, points), scale, note)
    views = [area for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D"]
    show_city(bpy.context, points, areas=views)
    with quieten():
        if "blend" in pictures:
            bpy.context.preferences.filepaths.save_version = 0
            bpy.ops.wm.save_as_mainfile(filepath=str(folder / "city.blend"), compress=True, check_existing=False)
        if "preview" in pictures:
            prepare_render(stage)
            stage.render.filepath, stage.render.use_file_extension = str(folder / "preview.png"), False
            bpy.ops.render.render(write_still=True, scene=stage.name)


def prepare_render(stage):
    """Set a Blender scene up for Cycles on the processor; colours come out exactly as in the legend."""
    render, cycles = stage.render, stage.cycles
    render.engine = "CYCLES"
    cycles.device, cycles.samples, cycles.seed = "CPU", SAMPLES, 0
    cycles.use_adaptive_sampling, cycles.use_denoising, cycles.max_bounces = False, False, 0
    render.film_transparent, render.dither_intensity = False, 0.0
    render.image_settings.file_format, render.image_settings.color_mode = "PNG", "RGB"


@contextmanager
def quieten():
    """Discard what Blender prints to standard output; standard error is not affected."""
    _flush()
    kept, sink = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 1)
        # Operator reports are printed by Python, render progress by C.
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        _flush()
        os.dup2(kept, 1)
        os.close(kept)
        os.close(sink)


def _flush():
    # Blender writes to C's stdio buffers, which Python does not flush.
    sys.stdout.flush()
    with suppress(OSError, AttributeError):
        ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fflush(None)
