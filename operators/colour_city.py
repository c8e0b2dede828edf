"""Colour: show a face attribute with its legend, and render a picture."""

import bpy

from ..core.errors import InputError
from .attributes import PREFIX
from .build_legend import build_legend
from .build_meshes import read_vertices
from .colour_faces import colour_faces, read_scale, show_exact_colours
from .place_camera import place_camera, set_background
from .render_preview import prepare_render
from .run_step import redraw_panels
from .select_faces import leave_edit_mode
from .session import find_city
from .show_city import show_city


class ColourCity(bpy.types.Operator):
    """Colour the faces by the chosen result"""

    bl_idname = "citypv.colour"
    bl_label = "Colour faces"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There are faces with results."""
        cls.poll_message_set("Classify the city first")
        city, _ = find_city(context.scene)
        return city is not None and PREFIX + "kind" in city.data.attributes

    def execute(self, context):
        """Colour the faces, and store the range used."""
        leave_edit_mode(context)
        settings, (city, ground) = context.scene.citypv, find_city(context.scene)
        ends = {} if settings.auto_range else {"low": settings.low, "high": settings.high}
        try:
            scale = colour_faces(city, ground, settings.attribute, **ends, colour_map=settings.colour_map)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if settings.auto_range and not scale.classes:
            settings.low, settings.high = scale.low, scale.high
        show_exact_colours(context.scene)
        show_city()
        redraw_panels(context)
        self.report({"INFO"}, f"Coloured by {scale.title.lower()}")
        return {"FINISHED"}


class RenderCity(bpy.types.Operator):
    """Set up camera and legend for a picture of the coloured city, and render it"""

    bl_idname = "citypv.render"
    bl_label = "Render picture"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """The city is coloured."""
        cls.poll_message_set("Colour the faces first")
        city, _ = find_city(context.scene)
        return city is not None and read_scale(city) is not None

    def execute(self, context):
        """Set up the scene and render it."""
        leave_edit_mode(context)
        city, _ = find_city(context.scene)
        camera = place_camera(context.scene, read_vertices(city))
        build_legend(context.scene, camera, read_scale(city), city.get(PREFIX + "weather", ""))
        set_background(context.scene)
        show_exact_colours(context.scene)
        prepare_render(context.scene)
        # In a window the picture opens beside the city while it renders.
        bpy.ops.render.render("EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT", scene=context.scene.name)
        return {"FINISHED"}
