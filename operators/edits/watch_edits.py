"""Notice that a mesh was edited after a city was made of it: its results are stale then."""

import hashlib

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ..attributes import PREFIX
from ..in_place import is_in_place, list_taken
from ..light.keep_transfer import KEPT, keep_transfers
from ..picture.show_city import match_view
from ..session import close_sessions, list_cities, part_sessions

SHAPE, EDITED = PREFIX + "shape", PREFIX + "edited"  # properties of the city
PLAIN = ("BOOLEAN", "INT", "FLOAT", "STRING", "ENUM")


def remember_shape(city):
    """Store on a city the shape of the meshes that it is made of."""
    city[SHAPE], city[EDITED] = describe_shape(city), False


def inherit_shape(city, earlier):
    """Let a city have the shape of the one that it replaces."""
    city[SHAPE], city[EDITED] = earlier.get(SHAPE, ""), earlier.get(EDITED, False)


def is_edited(city):
    """Whether the meshes of a city were edited since it was made."""
    return city is not None and bool(city.get(EDITED))


def describe_shape(city):
    """Digest of vertices, faces, places and modifiers of a city's mesh, or of the objects that it was taken from."""
    digest = hashlib.sha256()
    if not is_in_place(city):
        # It may be moved, but not turned: that is another city for the sun.
        digest.update(np.array(city.matrix_world.to_3x3()).tobytes())
        _add_mesh(digest, city.data)
        return digest.hexdigest()
    for _, item, _ in list_taken(city):
        digest.update(np.array(item.matrix_world).tobytes())
        if item.type == "MESH":
            _add_mesh(digest, item.data)
        for modifier in item.modifiers:
            plain = [p.identifier for p in modifier.bl_rna.properties if p.type in PLAIN and not p.is_readonly]
            kept = [name for name in plain if name not in ("show_expanded", "is_active")]
            digest.update(repr([str(getattr(modifier, name)) for name in kept]).encode())
    return digest.hexdigest()


def follow_edits(scene, graph):
    """Mark the cities whose meshes were edited, and unmark those whose edit was undone."""
    if graph.id_type_updated("OBJECT"):
        # A copy of a whole scene has copies of its cities, too.
        cities = {city for one in bpy.data.scenes for city in list_cities(one)}
        part_sessions(sorted(cities, key=lambda city: city.session_uid), KEPT)
    touched = {
        update.id.original for update in graph.updates if update.is_updated_geometry or update.is_updated_transform
    }
    for city in list_cities(scene) if touched else ():
        own = [city] if not is_in_place(city) else [item for _, item, _ in list_taken(city)]
        if SHAPE not in city or not touched & {part for item in own for part in (item, item.data)}:
            continue
        if any(item.mode == "EDIT" for item in own):
            continue
        edited = describe_shape(city) != city[SHAPE]
        if edited != is_edited(city):
            city[EDITED] = edited
            _redraw()


def _add_mesh(digest, mesh):
    points, corners = np.empty(3 * len(mesh.vertices), np.float32), np.empty(len(mesh.loops), np.int32)
    mesh.vertices.foreach_get("co", points)
    mesh.loops.foreach_get("vertex_index", corners)
    digest.update(points.tobytes())
    digest.update(corners.tobytes())


def _redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def start_following():
    """Install the handlers."""
    for name, follow in HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if follow not in handlers:
            handlers.append(follow)


def stop_following():
    """Remove the handlers."""
    for name, follow in HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if follow in handlers:
            handlers.remove(follow)


@persistent
def follow_undo(scene, *_):
    """Show the shape or the colours: an undo changes the city, but not the shading of a view."""
    match_view(scene)


@persistent
def follow_update(scene, graph):
    """Mark the results of meshes that were edited."""
    follow_edits(scene, graph)


@persistent
def follow_save(path, *_):
    """Keep the traced light beside the file."""
    if path:
        keep_transfers(path)


@persistent
def follow_load(*_):
    """Forget the cities of the file before: those of the new one may have the same keys and other results."""
    close_sessions()


HANDLERS = (
    ("undo_post", follow_undo),
    ("redo_post", follow_undo),
    ("depsgraph_update_post", follow_update),
    ("save_pre", follow_save),
    ("load_pre", follow_load),
)
