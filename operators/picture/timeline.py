"""Timeline: Blender's frames are the hours of the months' average days."""

import bpy
import numpy as np
from bpy.app.handlers import persistent
from mathutils import Vector

from ..attributes import PREFIX, read_face_attribute, remove_face_attribute, write_face_attribute, write_results
from ..city.build_meshes import show_objects
from ..light.keep_transfer import OfTransfer, read_kept
from ..run_step import Step, redraw_panels
from ..session import find_city, find_own_city, find_session
from .build_legend import MOMENT
from .colour_faces import RANGE, colours_of_values, read_scale, write_colours
from .colour_user_meshes import wear_colours, wears_colours
from .show_result import has_result, show_result

NOON = 5 * 24 + 13  # June, 12 to 13 h


class StartTimeline(OfTransfer, Step, bpy.types.Operator):
    """Let the frames run through the hours of the twelve months: direct light on the faces, sun and sky to match"""

    bl_idname = "citypv.timeline"
    bl_label = "Timeline"
    bl_options = {"REGISTER", "UNDO"}

    stages = {"reading weather": 1, "electricity": 2, "hours of the months": 2}

    @staticmethod
    def work(task, progress):
        """Compute light and yield of all frames, and the energy where it is not known."""
        from ...core.energy.pv_system import build_system
        from ...core.study import check_settings, compute_energy, read_year
        from ...core.timeline.timeline import build_timeline

        session, kept, request = task
        check_settings(request)
        read_kept(session, kept)
        weather, energy = session.weather, session.energy
        if energy is None:
            progress("reading weather", 0, 1, "years")
            weather = read_year(session.transfer.site, request, session.transfer.suns)
            energy = compute_energy(session.transfer, weather, request, progress)
        progress("hours of the months", 0, 1, "months")
        system = build_system(session.request or request)
        timeline = build_timeline(session.transfer, weather, energy, system)
        return session, weather, energy, (timeline, find_ranges(timeline, session.transfer.surfaces.area))

    def finish(self, context, result):
        """Set the range of frames, and show the first moment."""
        session, weather, energy, (timeline, ranges) = result
        city, ground = find_own_city(context.scene, session)
        if session.energy is None:
            session.weather, session.energy = weather, energy
            write_results(city, ground, session.transfer, energy)
        session.timeline = energy, timeline
        for name, ends in ranges.items():
            city[RANGE + name] = ends
        keep_scene(context.scene)
        context.scene.citypv_seeing.timeline = True
        show_moment(context.scene)
        show_result(context, city, ground, context.scene.citypv_seeing.timeline_show)
        return show_moment(context.scene)


class StopTimeline(bpy.types.Operator):
    """Give back the range of frames, the world and the colours that were there before the timeline"""

    bl_idname = "citypv.stop_timeline"
    bl_label = "End timeline"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """The timeline is on."""
        return context.scene.citypv_seeing.timeline

    def execute(self, context):
        """Take everything back."""
        stage = context.scene
        stage.citypv_seeing.timeline = False
        give_back_scene(stage)
        city, ground = find_city(stage)
        if city is not None:
            if context.scene.citypv.attribute in TIMED:
                show_result(context, city, ground, "full_load_hours" if has_result(city, "full_load_hours") else "kind")
            for name in TIMED:
                remove_face_attribute(city, name)
                remove_face_attribute(ground, name)
        redraw_panels(context, views=True)
        return {"FINISHED"}


def find_ranges(timeline, area):
    """Ends of the scales of all moments together, from 0, by attribute: dict of (low, high)."""
    from ...core.results.colour_map import choose_range

    light = timeline.relative * timeline.dni[:, None].astype("float32")
    brightest = light[light.mean(axis=1).argmax()]
    best = timeline.hours_by_month[:, timeline.energy_by_month.argmax()]
    return dict(zip(TIMED, ((0.0, choose_range(values, area)[1]) for values in (brightest, best)), strict=True))


def keep_scene(stage):
    """Remember the frames and the world of the user, and give the scene those of the timeline."""
    seeing = stage.citypv_seeing
    if not seeing.timeline:
        seeing.frames_before = stage.frame_start, stage.frame_end, stage.frame_current
        seeing.world_before = stage.world
    stage.frame_start, stage.frame_end = 1, FRAMES
    if not 1 <= stage.frame_current <= FRAMES or stage.frame_current == 1:
        stage.frame_set(NOON)


def give_back_scene(stage):
    """Give back frames and world."""
    seeing = stage.citypv_seeing
    stage.world = seeing.world_before
    seeing.world_before = None
    remove_light()
    stage.frame_start, stage.frame_end, now = seeing.frames_before
    stage.frame_set(now)


def follow_timeline_show(seeing, context):
    """Show light or yield, as chosen (`update` of the property)."""
    city, ground = find_city(context.scene)
    if seeing.timeline and city is not None and timeline_of(city) is not None:
        show_moment(context.scene)
        show_result(context, city, ground, seeing.timeline_show)


FRAMES, HOURS = 288, 24
TIMED = ("direct_irradiance", "month_hours")  # attributes that change with the frame


def start_following_frames():
    """Install the handler."""
    if follow_frame not in bpy.app.handlers.frame_change_post:
        bpy.app.handlers.frame_change_post.append(follow_frame)


def stop_following_frames():
    """Remove it."""
    if follow_frame in bpy.app.handlers.frame_change_post:
        bpy.app.handlers.frame_change_post.remove(follow_frame)


@persistent
def follow_frame(stage, *_):
    """Show the moment of a frame; after a file was opened or the city was weighed anew, compute the timeline first."""
    seeing = getattr(stage, "citypv_seeing", None)
    if seeing is None or not seeing.timeline:
        return
    city, _ = find_city(stage)
    if city is None:
        return
    if timeline_of(city) is not None:
        show_moment(stage)
    elif bpy.app.background:
        bpy.ops.citypv.timeline()
    elif not bpy.app.timers.is_registered(_compute_again):
        # Not from within a handler: it runs in the background.
        bpy.app.timers.register(_compute_again, first_interval=0.1)


def timeline_of(city):
    """Timeline of a city, or None if there is none of its present energy."""
    session = find_session(city)
    kept = session.timeline if session is not None else None
    return kept[1] if kept is not None and kept[0] is session.energy else None


def show_moment(stage):
    """Write light and yield of the scene's frame on the faces, and set sun and sky; return the moment as text."""
    from ...core.timeline.timeline import describe_moment

    city, ground = find_city(stage)
    timeline = timeline_of(city)
    moment = min(max(stage.frame_current - 1, 0), FRAMES - 1)
    faces = read_face_attribute(city.data, "surface")
    values = timeline.irradiance(moment), timeline.hours_by_month[:, moment // HOURS]
    for name, of_surfaces in zip(TIMED, values, strict=True):
        write_face_attribute(city.data, name, of_surfaces[faces].astype(np.float32))
        if ground is not None and PREFIX + name not in ground.data.attributes:
            write_face_attribute(ground.data, name, np.full(len(ground.data.polygons), np.nan))
    shown = city.get(PREFIX + "colour_attribute")
    if shown in TIMED:
        scale = read_scale(city)
        write_colours(city.data, colours_of_values(scale, read_face_attribute(city.data, shown)))
        city.data.update()
        if wears_colours(city):
            wear_colours(city)
    light_scene(stage, timeline.direction[moment], timeline.dni[moment], timeline.dhi[moment])
    city[MOMENT] = describe_moment(timeline, moment)
    return city[MOMENT]


def _compute_again():
    from ..run_step import Step

    if Step.current is not None:
        return 0.5
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window):
        if bpy.ops.citypv.timeline.poll():
            bpy.ops.citypv.timeline("INVOKE_DEFAULT")
    return None


SUN, SKY = "CityPV sun", "CityPV timeline sky"
STRENGTH = 0.005  # of the lamp, per Wm⁻²: 5 at full sun suits Blender's view transforms
BRIGHTNESS = 0.004  # of the sky, per Wm⁻² of DHI
ANGLE = 0.0093  # of the sun's disc [rad]


def light_scene(stage, direction, dni, dhi):
    """Set lamp and sky.

    Parameters
    ----------
    stage : bpy.types.Scene
    direction : (3,) float
        Towards the sun.
    dni, dhi : float [Wm⁻²]
    """
    up = direction[2] > 0
    lamp = bpy.data.objects.get(SUN) or _add_lamp(stage)
    lamp.rotation_euler = Vector([float(part) for part in direction]).to_track_quat("Z", "Y").to_euler()
    lamp.data.energy = STRENGTH * dni if up else 0.0
    world = bpy.data.worlds.get(SKY) or _add_sky()
    texture, background = (world.node_tree.nodes[name] for name in ("Sky Texture", "Background"))
    texture.sun_direction = [float(direction[0]), float(direction[1]), max(float(direction[2]), 0.0)]
    background.inputs["Strength"].default_value = BRIGHTNESS * dhi if up else 0.0
    if stage.world != world:
        stage.world = world


def remove_light():
    """Remove lamp and sky."""
    lamp, world = bpy.data.objects.get(SUN), bpy.data.worlds.get(SKY)
    if lamp is not None:
        data = lamp.data
        bpy.data.objects.remove(lamp)
        bpy.data.lights.remove(data)
    if world is not None:
        bpy.data.worlds.remove(world)


def _add_lamp(stage):
    light = bpy.data.lights.new(SUN, "SUN")
    light.angle = ANGLE
    lamp = bpy.data.objects.new(SUN, light)
    lamp[PREFIX + "part"] = "sun"
    show_objects(stage, lamp)
    return lamp


def _add_sky():
    world = bpy.data.worlds.new(SKY)
    if world.node_tree is None:
        world.use_nodes = True
    nodes = world.node_tree.nodes
    nodes.clear()
    texture, background = nodes.new("ShaderNodeTexSky"), nodes.new("ShaderNodeBackground")
    output = nodes.new("ShaderNodeOutputWorld")
    texture.name, background.name = "Sky Texture", "Background"
    texture.sky_type = "HOSEK_WILKIE"  # the same in all versions of Blender
    world.node_tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    world.node_tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    return world
