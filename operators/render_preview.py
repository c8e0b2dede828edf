"""Render a picture of a city with its results."""

from pathlib import Path

import bpy

from .quieten import quieten
from .stage_city import stage_city

SAMPLES = 16  # rays per pixel; only the ground's ambient occlusion is noisy


def render_preview(path, scene, transfer, energy, note=""):
    """Render `preview.png`: the city from above the south-east, coloured by full load hours, with a legend.

    Empties Blender's own file first (see `stage_city`).

    Parameters
    ----------
    path : str or path-like
        PNG file to write.
    scene, transfer, energy
        What core found; see `stage_city`.
    note : str
        What has to be read beside the colours, such as the weather.
    """
    stage_city(scene, transfer, energy, note)
    stage = bpy.context.scene
    prepare_render(stage)
    stage.render.use_file_extension = False
    stage.render.filepath = str(Path(path).resolve())
    with quieten():
        bpy.ops.render.render(write_still=True, scene=stage.name)


def prepare_render(stage):
    """Set a Blender scene up for Cycles on the processor; colours come out exactly as in the legend."""
    render, cycles = stage.render, stage.cycles
    render.engine = "CYCLES"
    cycles.device, cycles.samples, cycles.seed = "CPU", SAMPLES, 0
    cycles.use_adaptive_sampling, cycles.use_denoising, cycles.max_bounces = False, False, 0
    render.film_transparent, render.dither_intensity = False, 0.0
    render.image_settings.file_format, render.image_settings.color_mode = "PNG", "RGB"
