"""What has to follow when the user undoes, redoes or opens a file."""

import bpy
from bpy.app.handlers import persistent

from .show_city import match_view


def start_following():
    """Install the handlers."""
    for handlers in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        if follow_undo not in handlers:
            handlers.append(follow_undo)


def stop_following():
    """Remove the handlers."""
    for handlers in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        if follow_undo in handlers:
            handlers.remove(follow_undo)


@persistent
def follow_undo(scene, *_):
    """Show the shape or the colours: an undo changes the city, but not the shading of a view."""
    match_view(scene)
