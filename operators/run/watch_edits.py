"""Handlers of Blender: notice edits of cities, whose results are of before then; follow undo,
saving and opening.

With *Live* an edit is computed as soon as it is finished: the mouse released, edit mode left.
"""

import bpy
from bpy.app.handlers import persistent

from ...core.settings.errors import InputError
from ..city import session, source_objects
from ..city.build_meshes import remove_objects, renew_holders
from ..city.keep_transfer import keep_transfers
from ..city.keys import Key
from ..city.read_settings import read_settings
from ..city.run_step import Step
from ..show.colour_user_meshes import draw_as_before
from ..show.show_city import match_view
from ..show.timeline import follow_frame
from . import city_design, members
from .choose_faces import renew_choice
from .update_city import UpdateCity, is_editing

TICK = 0.1  # [s]
# `session_uid` of a scene: names of its cities, and its arrangement when they were noted last
_arranged = {}
_grounds = {}  # `session_uid` of each city: its ground's, None without one


@persistent
def follow_undo(scene, *_):
    """Show the shape or the colours: an undo changes the city, but not the shading of a view."""
    city_design.forget_edited()
    _arranged.clear()
    match_view(bpy.context)
    bpy.context.view_layer.update()
    for city in session.list_cities(scene):
        city_design.note_edits(city)
    renew_choice(session.find_city(scene)[0], scene.citypv)


@persistent
def _follow_edits(scene, graph):
    """Mark the cities that were edited, and unmark those whose edit was undone."""
    renew_holders()
    updates = [
        update
        for update in graph.updates
        if update.is_updated_geometry or update.is_updated_transform
    ]
    touched = {update.id.original for update in updates}
    # Quick way: only the touched objects are looked at, and how the scene was arranged at the last
    # call is held against now.
    names, before = _arranged.get(scene.session_uid, ([], {}))
    cities = [bpy.data.objects.get(name) for name in names]
    if cities and all(cities):
        # Where Blender tells of changed places and shapes only, the arrangement is as before. Else
        # an object may have come, gone or been hidden, renamed or only selected, which is not told
        # apart: the arrangement is read again.
        told = not graph.id_type_updated("SCENE") and len(updates) == len(graph.updates)
        now = before if told else _arrange(scene, cities)
        came = [bpy.data.objects.get(now[uid][0], {}) for uid in now.keys() - before.keys()]
        # No more is needed unless a city came, or one of the cities cannot tell.
        known = not any(item.get(Key.PART) == "city" for item in came)
        if known and all([city_design.note_changed(city, touched, before, now) for city in cities]):
            _arranged[scene.session_uid] = names, now
            return
    # Else all objects are looked at.
    city_design.forget_edited(touched)
    if graph.id_type_updated("OBJECT"):
        # Copied cities get keys of their own, also where a whole scene was copied.
        every = {city for one in bpy.data.scenes for city in session.list_cities(one)}
        members.part_sessions(sorted(every, key=lambda city: city.session_uid))
    cities = session.list_cities(scene)
    for city in cities:
        ground = city.get(Key.GROUND)
        city_design.note_edits(
            city, own=bool(touched & {city, city.data, ground, ground and ground.data})
        )
    names = [city.name for city in cities]
    _arranged[scene.session_uid] = names, _arrange(scene, cities)


def _arrange(scene, cities):
    """`arrangement_of` a scene, by what is known of its cities: dict."""
    return members.arrangement_of(scene, cities, city_design.taken_parts(cities))


def remove_left_grounds():
    """Remove the grounds of cities that the user deleted since this was called last; draw objects
    as before whose faces these cities showed.
    """
    cities = {
        city.session_uid: city for scene in bpy.data.scenes for city in session.list_cities(scene)
    }
    grounds = {uid: city.get(Key.GROUND) for uid, city in cities.items()}
    if gone := _grounds.keys() - cities.keys():
        left_grounds = members.find_objects(_grounds[city] for city in gone)
        left = set(left_grounds.values()) - set(grounds.values())
        # Of a city that is gone its modules have no parent any more.
        left |= {
            item
            for item in bpy.context.scene.objects
            if item.get(Key.PART) == "modules" and item.parent is None
        }
        if left:
            remove_objects(*left)
        shown = {item for city in cities.values() for _, item, _ in source_objects.list_taken(city)}
        for item in set(bpy.data.objects) - shown:
            draw_as_before(item)
    _grounds.clear()
    _grounds.update(
        {city: None if ground is None else ground.session_uid for city, ground in grounds.items()}
    )


def _find_work():
    """Window with a city that is to be updated, and its state: (bpy.types.Window, tuple),
    or None.
    """
    for window in bpy.context.window_manager.windows:
        scene = window.scene
        city, _ = session.find_city(scene)
        if (
            city is None
            or not source_objects.is_seen(city)
            or not city_design.has_edits(city)
            or city_design.hinders_update(city)
            or not session.Session.can_update(city)
        ):
            continue
        with bpy.context.temp_override(window=window):
            if is_editing(bpy.context):
                continue
        try:
            settings = read_settings(scene.citypv)
        except InputError:  # a file of the settings is missing: the step that needs it tells
            continue
        state = city_design.describe_edited(city), repr(settings)
        if scene.citypv_seeing.live or session.Session.find_cached(state) is not None:
            return window, state
    return None


@persistent
def _watch():
    """Update what was edited once the edit is finished; a newer edit cancels the computation of an
    older one.
    """
    renew_holders()
    remove_left_grounds()
    edited = _find_work()
    if edited is None and Step.current is None:  # undone: the same edit, made again, is tried again
        UpdateCity.tried = None
    if edited is None or UpdateCity.tried == edited[1]:
        return TICK
    window, _ = edited
    if Step.current is None:
        for area in [area for area in window.screen.areas if area.type == "VIEW_3D"][:1]:
            with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
                bpy.ops.citypv.update("INVOKE_DEFAULT")
    elif Step.current.title == UpdateCity.bl_label:
        Step.current.cancel(drop=True)
    return TICK


_HANDLERS = (
    ("undo_post", follow_undo),
    ("redo_post", follow_undo),
    ("depsgraph_update_post", _follow_edits),
    ("save_pre", keep_transfers),
    ("load_pre", session.close_sessions),
    ("frame_change_post", follow_frame),
)


def start_watching():
    """Add the handlers and, where there is a window, look for edits in it."""
    for name, follow in _HANDLERS:
        getattr(bpy.app.handlers, name).append(follow)
    if not bpy.app.background:
        bpy.app.timers.register(_watch, first_interval=TICK, persistent=True)


def stop_watching():
    """Remove the handlers; what runs ends at its next report, and nobody hears of it."""
    if Step.current is not None:
        Step.current.cancel(drop=True)
    Step.forget_running(bpy.context)
    if bpy.app.timers.is_registered(_watch):
        bpy.app.timers.unregister(_watch)
    for name, follow in _HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if follow in handlers:
            handlers.remove(follow)
    session.close_sessions()
