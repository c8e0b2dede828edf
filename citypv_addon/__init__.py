"""Blender user interface of CityPV: properties, panels, registration. Nothing is computed here."""

import atexit
import importlib
import pkgutil

import bpy

from .. import operators
from ..operators.check_libraries import check_libraries
from ..operators.city.read_settings import find_preferences, use_cache_folder
from ..operators.edits.watch_edits import start_following, stop_following
from ..operators.picture.draw_results import run_command
from ..operators.picture.draw_view import start_drawing, stop_drawing
from ..operators.session import close_sessions
from .menus import CityMenu, draw_city_menu, draw_import_menu
from .panels import PANELS, MaterialPanel
from .properties import REFLECTION, Preferences, Seeing, Settings


def list_operators():
    """Operators and file handlers that the modules of the room operators define: list of type."""
    found = []
    for module in pkgutil.walk_packages(operators.__path__, f"{operators.__name__}."):
        for item in vars(importlib.import_module(module.name)).values():
            if getattr(item, "__module__", "") == module.name and hasattr(item, "bl_idname"):
                found.append(item)
    return found


CLASSES = (Settings, Seeing, Preferences, *list_operators(), *PANELS, MaterialPanel, CityMenu)

_commands = []


def register():
    """Register settings, operators, panels and the command line (which Blender has from 4.2 on)."""
    check_libraries()
    for item in CLASSES:
        bpy.utils.register_class(item)
    bpy.types.Scene.citypv = bpy.props.PointerProperty(type=Settings)
    bpy.types.Scene.citypv_seeing = bpy.props.PointerProperty(type=Seeing)
    bpy.types.Material.citypv_material = REFLECTION
    bpy.types.TOPBAR_MT_file_import.append(draw_import_menu)
    bpy.types.VIEW3D_MT_editor_menus.append(draw_city_menu)
    use_cache_folder(find_preferences())
    _commands.append(bpy.utils.register_cli_command("citypv", run_command))
    start_drawing()
    start_following()
    if bpy.app.module:
        # Blender as a Python module may crash on exit while classes are registered.
        atexit.register(unregister)


def unregister():
    """Unregister everything in reverse order; a second call does nothing."""
    atexit.unregister(unregister)
    if not hasattr(bpy.types.Scene, "citypv"):
        return
    stop_following()
    stop_drawing()
    bpy.utils.unregister_cli_command(_commands.pop())
    bpy.types.TOPBAR_MT_file_import.remove(draw_import_menu)
    bpy.types.VIEW3D_MT_editor_menus.remove(draw_city_menu)
    del bpy.types.Scene.citypv, bpy.types.Scene.citypv_seeing, bpy.types.Material.citypv_material
    for item in reversed(CLASSES):
        bpy.utils.unregister_class(item)
    close_sessions()
