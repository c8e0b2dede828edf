"""Buttons of before and after: keep the present result, show it beside the city, forget it."""

import bpy

from .attributes import CHANGE, PREFIX
from .colour_faces import read_scale
from .compare_results import compare_with_before, find_before, forget_before, keep_before, show_before
from .keep_transfer import find_kept, read_kept, reopen_session
from .run_step import redraw_panels
from .session import find_city
from .show_result import has_result, show_result


class KeepBefore(bpy.types.Operator):
    """Keep the present result as "before": every later result is shown as the difference from it"""

    bl_idname = "citypv.keep_before"
    bl_label = "Keep as before"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There are full load hours."""
        cls.poll_message_set("Compute the energy first")
        city, _ = find_city(context.scene)
        return city is not None and PREFIX + "full_load_hours" in city.data.attributes

    def execute(self, context):
        """Keep a copy."""
        city, _ = find_city(context.scene)
        read_kept(reopen_session(city), find_kept(city))
        keep_before(context.scene, city)
        context.scene.citypv_seeing.side_by_side = False
        self.report({"INFO"}, "Kept as before: change what you like, then trace and compute the energy")
        return {"FINISHED"}


class CompareBefore(bpy.types.Operator):
    """Show the present result less the one kept as before"""

    bl_idname = "citypv.compare"
    bl_label = "Show difference"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There are two results."""
        cls.poll_message_set("Keep a result as before, then compute another")
        return find_before(context.scene) is not None and KeepBefore.poll(context)

    def execute(self, context):
        """Write and show the difference."""
        city, ground = find_city(context.scene)
        read_kept(reopen_session(city), find_kept(city))
        if not compare_with_before(context.scene, city, ground):
            self.report({"ERROR"}, "The result kept as before is of another city: no surface has the same id")
            return {"CANCELLED"}
        show_result(context, city, ground, CHANGE + "full_load_hours")
        redraw_panels(context, views=True)
        return {"FINISHED"}


class ForgetBefore(bpy.types.Operator):
    """Remove the result kept as before, and the differences from it"""

    bl_idname = "citypv.forget_before"
    bl_label = "Forget before"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There is one."""
        return find_before(context.scene) is not None

    def execute(self, context):
        """Remove it."""
        forget_before(context.scene)
        city, ground = find_city(context.scene)
        if city is not None:
            shown = context.scene.citypv.attribute
            if shown.startswith(CHANGE) and has_result(city, shown.removeprefix(CHANGE)):
                show_result(context, city, ground, shown.removeprefix(CHANGE))
            compare_with_before(context.scene, city, ground)
        redraw_panels(context, views=True)
        return {"FINISHED"}


def follow_side_by_side(seeing, context):
    """Show or hide the earlier result (`update` of the property)."""
    before, (city, _) = find_before(context.scene), find_city(context.scene)
    if before is not None:
        show_before(before, visible=seeing.side_by_side, scale=read_scale(city) if city is not None else None)
