"""What has to follow when the frame changes while the timeline is on."""

import bpy
import numpy as np
from bpy.app.handlers import persistent

from .attributes import PREFIX
from .colour_faces import read_scale, write_colours
from .colour_scale import colours_of_values
from .legend_note import MOMENT
from .session import find_city, find_session
from .sun_and_sky import light_scene
from .wear_colours import wear_colours, wears_colours
from .write_attributes import read_face_attribute, write_face_attribute

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
    from ..core.energy.timeline import describe_moment

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
    from .run_step import Step

    if Step.current is not None:
        return 0.5
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window):
        if bpy.ops.citypv.timeline.poll():
            bpy.ops.citypv.timeline("INVOKE_DEFAULT")
    return None
