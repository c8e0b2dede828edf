"""Ask where on Earth a city stands whose data does not say so, before its steps begin."""

import bpy

from ..city.run_step import redraw_panels, refuse


class AskPlace(bpy.types.Operator):
    """Say where on Earth a city without a place of its own stands, and which axis points up"""

    bl_idname, bl_label = "citypv.ask_place", "Where does it stand?"
    bl_options = {"INTERNAL"}

    then: bpy.props.StringProperty(description="Step that begins with the answer")
    filepath: bpy.props.StringProperty(description="File of that step")
    upward: bpy.props.BoolProperty(description="Whether to ask for the upward axis")

    def invoke(self, context, event):
        """Open the dialog."""
        return context.window_manager.invoke_props_dialog(self, width=400)

    def draw(self, context):
        """Place, axis, and what they are for."""
        column, settings = self.layout.column(), context.scene.citypv
        column.use_property_split = True
        column.label(text="The sun depends on the place, which the model does not name.")
        for name in ("latitude", "longitude", *["up"] * self.upward):
            column.prop(settings, name)
        column.label(text="North is the y axis; a map service shows both numbers in degrees.")
        link = column.operator("wm.doc_view_manual", text="Guide", icon="HELP")
        link.doc_id = "citypv.take_meshes"

    def execute(self, context):
        """Keep the place as the scene's own, and begin."""
        settings = context.scene.citypv
        if settings.latitude == settings.longitude == 0:
            return refuse(self, "Give latitude and longitude of the city, in degrees")
        settings.own_place = True
        redraw_panels(context)
        given = {"filepath": self.filepath} if self.filepath else {}
        getattr(bpy.ops.citypv, self.then)("INVOKE_DEFAULT", **given)
        return {"FINISHED"}


def ask_place(context, then, *, filepath="", upward=False):
    """Open the dialog before a step where nobody has named the place: whether it did.

    Parameters
    ----------
    context : bpy.types.Context
    then : str
        Step that begins with the answer.
    filepath : str
        Its file.
    upward : bool
        Whether the upward axis may be another than z.
    """
    if bpy.app.background or context.window is None or context.scene.citypv.own_place:
        return False
    bpy.ops.citypv.ask_place("INVOKE_DEFAULT", then=then, filepath=filepath, upward=upward)
    return True
