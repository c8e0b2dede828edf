"""`blender --command citypv …`: the command line inside Blender."""

import bpy

from ..operators.picture.draw_results import run_command

_registered = []


def register_command():
    """Register the command; Blender has such commands from 4.2 on."""
    if hasattr(bpy.utils, "register_cli_command"):
        _registered.append(bpy.utils.register_cli_command("citypv", run_command))


def unregister_command():
    """Take the command back."""
    while _registered:
        bpy.utils.unregister_cli_command(_registered.pop())
