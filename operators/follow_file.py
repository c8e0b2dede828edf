"""What has to follow when the user undoes, redoes, saves or opens a file."""

import bpy
from bpy.app.handlers import persistent

from .keep_transfer import keep_transfers
from .session import close_sessions
from .show_city import match_view
from .watch_edits import follow_edits


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
