"""Handlers of Blender: notice edited meshes, whose results are stale then; follow undo, saving and opening a file."""

import bpy
from bpy.app.handlers import persistent

from ..in_place import ADDED, EDITED, SHAPE, describe_added, describe_shape, is_in_place, list_taken
from ..light.keep_transfer import keep_transfers
from ..picture.show_city import match_view
from ..picture.timeline import follow_frame
from ..run_step import redraw_panels
from ..session import close_sessions, list_cities, part_sessions


@persistent
def follow_undo(scene, *_):
    """Show the shape or the colours: an undo changes the city, but not the shading of a view."""
    match_view(bpy.context)
    for city in list_cities(scene):
        note_change(city, ADDED, describe_added(city))


@persistent
def follow_edits(scene, graph):
    """Mark the cities whose meshes were edited, and unmark those whose edit was undone."""
    if graph.id_type_updated("OBJECT"):
        # A copy of a whole scene has copies of its cities, too.
        cities = {city for one in bpy.data.scenes for city in list_cities(one)}
        part_sessions(sorted(cities, key=lambda city: city.session_uid))
    updates = [update for update in graph.updates if update.is_updated_geometry or update.is_updated_transform]
    touched = {update.id.original for update in updates}
    for city in list_cities(scene):
        note_change(city, ADDED, describe_added(city))
        if not touched:
            continue
        own = [item for _, item, _ in list_taken(city)] if is_in_place(city) else [city]
        if SHAPE not in city or not touched & {part for item in own for part in (item, item.data)}:
            continue
        if any(item.mode == "EDIT" for item in own):
            continue
        note_change(city, EDITED, describe_shape(city) != city[SHAPE])


def note_change(city, key, value):
    """Store on a city what was edited, where that is news; panels and legend tell it."""
    if value != city.get(key, type(value)()):
        city[key] = value
        redraw_panels(bpy.context, views=True)


HANDLERS = (
    ("undo_post", follow_undo),
    ("redo_post", follow_undo),
    ("depsgraph_update_post", follow_edits),
    ("save_pre", keep_transfers),
    ("load_pre", close_sessions),
    ("frame_change_post", follow_frame),
)


def start_following():
    """Install the handlers."""
    for name, follow in HANDLERS:
        getattr(bpy.app.handlers, name).append(follow)


def stop_following():
    """Remove the handlers."""
    for name, follow in HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if follow in handlers:
            handlers.remove(follow)
