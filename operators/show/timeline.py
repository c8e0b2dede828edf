"""Timeline: Blender's frames are the hours of the months' average days, with a sun lamp and a sky
to match.

The user's own lamps and world stay as they are.
"""

import bpy
from bpy.app.handlers import persistent
from mathutils import Vector

from ..city import attributes
from ..city.build_meshes import remove_objects, show_objects
from ..city.keep_transfer import OfTransfer
from ..city.keys import Key
from ..city.panel import ResultPanel
from ..city.run_step import Action, Step
from ..city.session import Session, find_city
from ..city.source_objects import is_in_place
from .colour_faces import read_scale, start_nodes, write_colours
from .colour_user_meshes import colour_user_meshes
from .show_result import has_result, show_result

FRAMES = 288
TIMED = ("direct_irradiance", "month_hours")  # attributes that change with the frame
SUN, SKY = "CityPV sun", "CityPV timeline sky"


class StartTimeline(OfTransfer, Step, bpy.types.Operator):
    """Let frames run through the hours of twelve months: direct light, with sun and sky"""

    bl_idname, bl_label = "citypv.timeline", "Timeline"

    stages = {"reading weather": 1, "electricity": 2, "hours of the months": 2}

    @staticmethod
    def work(task, progress):
        """Compute light and yield of all frames, and the energy where it is not known."""
        from ...core.energy.timeline import Timeline
        from ...core.results.colour_map import choose_range

        session, kept, request = task
        weighed = session.with_energy(kept, request, progress)
        progress("hours of the months", 0, 1, "months")
        timeline = Timeline.build(weighed.transfer, weighed.weather, weighed.energy)
        # The scales of all moments together end where the brightest hour's and the best month's do.
        light = timeline.relative * timeline.dni[:, None].astype("float32")
        best = timeline.hours_by_month[:, timeline.energy_by_month.argmax()]
        area = weighed.transfer.surfaces.area
        ends = [
            choose_range(values, area)[1] for values in (light[light.mean(axis=1).argmax()], best)
        ]
        return session, weighed, timeline, ends

    def finish(self, context, result):
        """Set the range of frames, keeping the user's frames and world, and show the first
        moment.
        """
        session, weighed, timeline, ends = result
        city, ground = session.find_city(context.scene)
        session.take_energy(weighed)
        attributes.Faces(city, ground).write_results(session.transfer, session.energy)
        session.timeline = session.energy, timeline
        for name, end in zip(TIMED, ends, strict=True):
            city[Key.RANGE + name] = 0.0, end
        stage, seeing = context.scene, context.scene.citypv_seeing
        if not seeing.timeline:
            seeing.frames_before = stage.frame_start, stage.frame_end, stage.frame_current
            seeing.world_before = stage.world
        stage.frame_start, stage.frame_end = 1, FRAMES
        if not 1 < stage.frame_current <= FRAMES:
            # In June, 12 to 13 h.
            stage.frame_set(5 * 24 + 13)
        seeing.timeline = True
        _show_moment(stage)
        show_result(context, city, ground, seeing.timeline_show)
        return city[Key.MOMENT]


class StopTimeline(Action, bpy.types.Operator):
    """Give back the frames, the world and the colours that were there before the timeline"""

    bl_idname, bl_label = "citypv.stop_timeline", "End timeline"

    @classmethod
    def poll(cls, context):
        """The timeline is on."""
        return context.scene.citypv_seeing.timeline

    def act(self, context, city, ground):
        """Take everything back."""
        stage, seeing = context.scene, context.scene.citypv_seeing
        seeing.timeline = False
        stage.world, seeing.world_before = seeing.world_before, None
        remove_objects(bpy.data.objects.get(SUN))
        if SKY in bpy.data.worlds:
            bpy.data.worlds.remove(bpy.data.worlds[SKY])
        stage.frame_start, stage.frame_end, now = seeing.frames_before
        stage.frame_set(now)
        if city is not None:
            if stage.citypv.attribute in TIMED:
                show_result(
                    context,
                    city,
                    ground,
                    "full_load_hours" if has_result(city, "full_load_hours") else "kind",
                )
            attributes.Faces(city, ground).remove(*TIMED)


def timeline_of(city):
    """Timeline of a city, or None if there is none of its present energy."""
    session = Session.of(city)
    kept = session.timeline if session is not None else None
    return kept[1] if kept is not None and kept[0] is session.energy else None


def follow_timeline_show(seeing, context):
    """Show light or yield, as chosen (`update` of the property)."""
    city, ground = find_city(context.scene)
    if seeing.timeline and city is not None and timeline_of(city) is not None:
        show_result(context, city, ground, seeing.timeline_show)


@persistent
def follow_frame(stage, *_):
    """Show the moment of a frame; after a file was opened or the city was weighed anew, compute the
    timeline first.
    """
    seeing, (city, _) = getattr(stage, "citypv_seeing", None), find_city(stage)
    if seeing is None or not seeing.timeline or city is None:
        return
    if timeline_of(city) is not None:
        _show_moment(stage)
    elif bpy.app.background:
        bpy.ops.citypv.timeline()
    elif not bpy.app.timers.is_registered(
        _compute_again
    ):  # not from within a handler: it runs in the background
        bpy.app.timers.register(_compute_again, first_interval=0.1)


def _compute_again():
    """Compute the timeline anew, once no other step runs: seconds to wait for that, or None."""
    if Step.current is not None:
        return 0.5
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        if bpy.ops.citypv.timeline.poll():
            bpy.ops.citypv.timeline("INVOKE_DEFAULT")
    return None


def _show_moment(stage):
    """Write light and yield of the scene's frame on the faces, and set sun and sky; return the
    moment as text.
    """

    city, ground = find_city(stage)
    timeline = timeline_of(city)
    moment = min(max(stage.frame_current - 1, 0), FRAMES - 1)
    values = timeline.irradiance(moment), timeline.hours_by_month[:, moment // 24]
    for name, of_surfaces in zip(TIMED, values, strict=True):
        attributes.Faces(city, ground).write_values(name, of_surfaces)
    shown = city.get(Key.COLOUR_ATTRIBUTE)
    if shown in TIMED:
        write_colours(
            city.data,
            read_scale(city).colours(attributes.read_face_attribute(city.data, shown)),
        )
        if is_in_place(city) and city.get(Key.WORN):
            colour_user_meshes(city)
    _light_scene(
        stage, timeline.direction[moment].tolist(), timeline.dni[moment], timeline.dhi[moment]
    )
    city[Key.MOMENT] = timeline.describe(moment)
    return city[Key.MOMENT]


def _light_scene(stage, direction, dni, dhi):
    """Set lamp and sky.

    Parameters
    ----------
    stage : bpy.types.Scene
    direction : list of 3 float
        Towards the sun.
    dni, dhi : float [Wm⁻²]
    """
    up = direction[2] > 0
    if SUN not in bpy.data.objects:
        lamp = bpy.data.objects.new(SUN, bpy.data.lights.new(SUN, "SUN"))
        # The sun's disc is 0.0093 rad wide.
        lamp.data.angle, lamp[Key.PART] = 0.0093, "sun"
        show_objects(stage, lamp)
    lamp = bpy.data.objects[SUN]
    lamp.rotation_euler = Vector(direction).to_track_quat("Z", "Y").to_euler()
    # 5 at full sun suits Blender's view transforms.
    lamp.data.energy = 0.005 * dni if up else 0.0
    if SKY not in bpy.data.worlds:
        nodes, links, output = start_nodes(bpy.data.worlds.new(SKY), "ShaderNodeOutputWorld")
        texture, background = nodes.new("ShaderNodeTexSky"), nodes.new("ShaderNodeBackground")
        texture.name, background.name = "Sky Texture", "Background"
        texture.sky_type = "HOSEK_WILKIE"  # the same in all versions of Blender
        links.new(texture.outputs["Color"], background.inputs["Color"])
        links.new(background.outputs["Background"], output.inputs["Surface"])
    world = bpy.data.worlds[SKY]
    texture, background = (world.node_tree.nodes[name] for name in ("Sky Texture", "Background"))
    texture.sun_direction = [*direction[:2], max(direction[2], 0.0)]
    background.inputs["Strength"].default_value = 0.004 * dhi if up else 0.0
    stage.world = world


class TimelinePanel(ResultPanel, bpy.types.Panel):
    """Timeline."""

    bl_idname, bl_label, bl_order, bl_options = (
        "CITYPV_PT_timeline",
        "Timeline",
        3,
        {"DEFAULT_CLOSED"},
    )

    def draw(self, context):
        """Show the button, and the moment of the frame."""
        column, _, city = self.start(context)
        seeing = context.scene.citypv_seeing
        column.prop(seeing, "timeline_show")
        self.draw_step(column, "citypv.timeline", "TIME")
        if not seeing.timeline:
            return
        column.prop(context.scene, "frame_current", text=f"Hour of {FRAMES}", slider=False)
        self.draw_told(column, city.get(Key.MOMENT))
        column.operator("citypv.stop_timeline", icon="X")
