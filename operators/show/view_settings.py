"""Settings of colours and timeline, with what follows when one changes."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntVectorProperty, PointerProperty

from .colour_faces import TITLES
from .show_modules import follow_modules
from .show_result import follow_choice, follow_side_by_side, follow_switch
from .timeline import TIMED, follow_timeline_show


class ViewSettings:
    """Mixin of a scene's settings: the step Colour."""

    attribute: EnumProperty(
        name="Show",
        description="Result to show as colours",
        items=[(name, title, f"Face attribute citypv_{name}") for name, title in TITLES.items()],
        default="kind",
        update=follow_choice,
    )
    colour_map: EnumProperty(
        name="Colour map",
        description="From low to high",
        items=[
            ("viridis", "Viridis", "Violet to yellow"),
            ("cividis", "Cividis", "Blue to yellow, safe for colour-blind viewers"),
            ("inferno", "Inferno", "Black to yellow"),
        ],
        update=follow_choice,
    )
    auto_range: BoolProperty(
        name="Automatic range",
        description="Covers 96 % of the area",
        default=True,
        update=follow_choice,
    )
    low: FloatProperty(
        name="Low",
        description="Lowest colour [unit of the legend]",
        update=follow_choice,
    )
    high: FloatProperty(
        name="High",
        description="Highest colour [unit of the legend]",
        default=1,
        update=follow_choice,
    )
    show_colours: BoolProperty(
        name="Colours",
        description=(
            "Show the result as colours; off: the materials and the shading that you had before"
        ),
        default=True,
        update=follow_switch,
    )
    show_modules: BoolProperty(
        name="Modules",
        description="Draw each module where it lies on roofs and facades",
        update=follow_modules,
    )
    show_legend: BoolProperty(
        name="Legend", description="Draw the legend in the 3D view", default=True
    )
    show_charts: BoolProperty(
        name="Charts", description="Draw charts of what was probed in the view", default=True
    )


class TimelineSettings:
    """Mixin of a scene's state: the timeline, and what it shows beside the city."""

    timeline: BoolProperty(name="Timeline", description="Frames are hours of the months")
    timeline_show: EnumProperty(
        name="Show",
        description="What the faces show in the timeline",
        items=[(name, TITLES[name], f"{TITLES[name]}, of the frame") for name in TIMED],
        update=follow_timeline_show,
    )
    frames_before: IntVectorProperty(
        name="Frames before", description="Start, end and current frame", size=3
    )
    world_before: PointerProperty(
        name="World before", description="World of the scene", type=bpy.types.World
    )
    side_by_side: BoolProperty(
        name="Side by side",
        description="Show the result kept as before to the west of the city",
        update=follow_side_by_side,
    )
