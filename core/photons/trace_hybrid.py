"""Gather for every scene: with a specular pass where a material does not reflect by Lambert's law."""

from functools import partial

from ..light.prepare_scene import prepare_scene
from ..light.trace_gather import trace_gather
from .specular_light import trace_specular


def trace_hybrid(scene, suns, request, progress, folder=None, *, prepared=None):
    """Trace a scene by gather, and by photons what its mirrors, glossy faces and glass add.

    Parameters, result and errors as of `trace_gather`.
    """
    prepared = prepared or prepare_scene(scene, request, suns=suns)
    specular = partial(trace_specular, prepared) if prepared.plan["specular"].on else None
    return trace_gather(scene, suns, request, progress, folder, prepared=prepared, specular=specular)
