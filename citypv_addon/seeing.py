"""Properties and panels of what is seen over time and beside an earlier result."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntVectorProperty, PointerProperty

from ..operators.attributes import VIEWS
from ..operators.picture.build_legend import MOMENT
from ..operators.picture.timeline import (
    FRAMES,
    TIMED,
    StartTimeline,
    StopTimeline,
    follow_timeline_show,
    start_following_frames,
    stop_following_frames,
)
from ..operators.result.compare_results import (
    CHANGES,
    FOUND,
    CompareBefore,
    ForgetBefore,
    KeepBefore,
    find_before,
    follow_side_by_side,
)
from ..operators.session import find_city
from .draw_results import draw_table
from .draw_steps import draw_lines, draw_step
from .panels import _Panel
from .report import draw_sentence

SHOWN = [(one.name, one.title, one.meaning) for one in VIEWS if one.name in TIMED]


class Seeing(bpy.types.PropertyGroup):
    """State of timeline and comparison, stored with each Blender scene as `scene.citypv_seeing`."""

    timeline: BoolProperty(name="Timeline", description="Frames are hours of the months")
    timeline_show: EnumProperty(
        name="Show", description="What the faces show in the timeline", items=SHOWN, update=follow_timeline_show
    )
    refine: BoolProperty(
        name="Refine", description="Trace further rounds up to a target or a time; the view shows each of them"
    )
    target_error: FloatProperty(
        name="Target error",
        description="Error of full load hours on 95 % of the eligible area at which to stop [%]; 0: none",
        default=2.0,
        min=0,
        subtype="PERCENTAGE",
    )
    time_budget: FloatProperty(
        name="Time [s]", description="Time in which the last round has to end [s]; 0: no limit", default=60.0, min=0
    )
    frames_before: IntVectorProperty(name="Frames before", description="Start, end and current frame", size=3)
    world_before: PointerProperty(name="World before", description="World of the scene", type=bpy.types.World)
    side_by_side: BoolProperty(
        name="Side by side",
        description="Show the result kept as before to the west of the city",
        update=follow_side_by_side,
    )


class TimelinePanel(_Panel, bpy.types.Panel):
    """Timeline."""

    bl_parent_id = "CITYPV_PT_main"
    bl_idname, bl_label, bl_order = "CITYPV_PT_timeline", "Timeline", 7

    def draw(self, context):
        """Show the button, and the moment of the frame."""
        column, _ = self.start(context)
        seeing, (city, _) = context.scene.citypv_seeing, find_city(context.scene)
        column.prop(seeing, "timeline_show")
        draw_step(self.layout, column, "citypv.timeline", "TIME")
        if not seeing.timeline:
            return
        column.prop(context.scene, "frame_current", text=f"Hour of {FRAMES}", slider=False)
        if city is not None and city.get(MOMENT):
            draw_sentence(column.box().column(align=True), city[MOMENT])
        column.operator("citypv.stop_timeline", icon="X")


class ComparePanel(_Panel, bpy.types.Panel):
    """Before and after."""

    bl_parent_id = "CITYPV_PT_main"
    bl_idname, bl_label, bl_order = "CITYPV_PT_compare", "Before and after", 8

    def draw(self, context):
        """Show the buttons, and the totals of both results."""
        column, _ = self.start(context)
        column.operator("citypv.keep_before", icon="DUPLICATE")
        if find_before(context.scene) is None:
            return
        column.operator("citypv.compare", icon="ARROW_LEFTRIGHT")
        column.prop(context.scene.citypv_seeing, "side_by_side")
        draw_table(self.layout, context, CHANGES, ("MWh per year", "before", "after", "change"))
        draw_lines(self.layout, context, FOUND)
        self.layout.operator("citypv.forget_before", icon="X")


CLASSES = (Seeing, StartTimeline, StopTimeline, TimelinePanel, KeepBefore, CompareBefore, ForgetBefore, ComparePanel)


def start_seeing():
    """Install properties and handler; `citypv_addon` registers the classes."""
    bpy.types.Scene.citypv_seeing = PointerProperty(type=Seeing)
    start_following_frames()


def stop_seeing():
    """Remove them."""
    stop_following_frames()
    del bpy.types.Scene.citypv_seeing
