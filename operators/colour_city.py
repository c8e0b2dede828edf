"""Colour: show a face attribute with its legend, and render a picture."""

import bpy

from ..core.settings.errors import InputError
from .attributes import PREFIX
from .colour_faces import read_scale
from .run_step import redraw_panels
from .select_faces import leave_edit_mode
from .session import find_city
from .show_result import show_result
from .stage_picture import VIEWS, stage_picture


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
        try:
            scale = show_result(context, *find_city(context.scene), context.scene.citypv.attribute)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        redraw_panels(context, views=True)
        self.report({"INFO"}, f"Coloured by {scale.title[0].lower()}{scale.title[1:]}")
        return {"FINISHED"}


class RenderCity(bpy.types.Operator):
    """Render a picture of the coloured city with its legend, in the scene "CityPV picture"; yours is not changed"""

    bl_idname = "citypv.render"
    bl_label = "Render picture"
    bl_options = {"REGISTER", "UNDO"}

    view: bpy.props.EnumProperty(name="View", description="Where the picture is taken from", items=VIEWS)

    @classmethod
    def poll(cls, context):
        """The city is coloured."""
        cls.poll_message_set("Colour the faces first")
        city, _ = find_city(context.scene)
        return city is not None and read_scale(city) is not None

    def execute(self, context):
        """Set up the scene and render it."""
        leave_edit_mode(context)
        try:
            stage = stage_picture(context, self.view)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        # In a window the picture opens beside the city while it renders.
        bpy.ops.render.render("EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT", scene=stage.name)
        return {"FINISHED"}
