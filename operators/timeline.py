"""Timeline: Blender's frames are the hours of the months' average days."""

import bpy

from .colour_faces import RANGE
from .follow_frame import FRAMES, TIMED, show_moment, timeline_of
from .keep_transfer import read_kept
from .run_step import Step, redraw_panels
from .session import find_city, find_own_city
from .show_result import has_result, show_result
from .sun_and_sky import remove_light
from .traced_step import OfTransfer
from .write_attributes import remove_face_attribute, write_results

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
        from ..core.energy.pv_system import build_system
        from ..core.energy.timeline import build_timeline
        from ..core.study import check_settings, compute_energy, read_year

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
    from ..core.results.colour_map import choose_range

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
