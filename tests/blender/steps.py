"""What a user of the panel does, from a script."""

import bpy
import numpy as np

from citypv.operators.session import find_city, find_session


def run(*steps, **settings):
    """Change settings of the panel and run steps, which must succeed; return the city."""
    for name, value in settings.items():
        setattr(bpy.context.scene.citypv, name, value)
    for step in steps:
        assert getattr(bpy.ops.citypv, step)() == {"FINISHED"}
    return here()


def here():
    """The city that the panel works on."""
    return find_city(bpy.context.scene)[0]


def session_here():
    """What was read, traced and weighed of it."""
    return find_session(here())


def colours_of(mesh):
    """Colours of the corners of a mesh: (l, 3) sRGB in 0–1."""
    values = np.empty(4 * len(mesh.loops), np.float32)
    mesh.color_attributes["citypv_colour"].data.foreach_get("color_srgb", values)
    return values.reshape(-1, 4)[:, :3]


def add_box(name, location):
    """A box of 10 m × 8 m × 6 m around a place."""
    bpy.ops.mesh.primitive_cube_add(size=2, location=location, scale=(5, 4, 3))
    bpy.context.object.name = name
    return bpy.context.object
