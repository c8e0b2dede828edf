"""Blender user interface of CityPV: properties, panels, registration. Nothing is computed here."""

import atexit
import importlib
import pkgutil

import bpy

from .. import operators
from ..__main__ import main
from ..operators.city.check_libraries import check_libraries
from ..operators.city.preferences import use_cache_folder
from ..operators.city.read_materials import REFLECTION
from ..operators.run.watch_edits import start_watching, stop_watching
from ..operators.show.draw_view import DRAWN
from .manual import map_manual
from .menus import CityMenu, draw_city_menu, draw_import_menu
from .properties import Seeing, Settings
from .translations import TABLES

# Operators, panels and file handlers: what the modules of the room operators define, the panel that
# has others in it before these.
_names = [
    module.name for module in pkgutil.walk_packages(operators.__path__, f"{operators.__name__}.")
]
_found = [
    item
    for name in _names
    for item in vars(importlib.import_module(name)).values()
    if hasattr(item, "bl_idname")
]
OPERATORS = sorted(
    (item for item in dict.fromkeys(_found) if item.__module__ in _names),
    key=lambda item: hasattr(item, "bl_parent_id"),
)
CLASSES = (Settings, Seeing, *OPERATORS, CityMenu)

_commands, _drawn = [], []


def register():
    """Register settings, operators, panels, handlers and the command line (which Blender has from
    4.2 on).
    """
    check_libraries()
    for item in CLASSES:
        bpy.utils.register_class(item)
    bpy.types.Scene.citypv = bpy.props.PointerProperty(type=Settings)
    bpy.types.Scene.citypv_seeing = bpy.props.PointerProperty(type=Seeing)
    bpy.types.Material.citypv_material = REFLECTION
    bpy.types.TOPBAR_MT_file_import.append(draw_import_menu)
    bpy.types.VIEW3D_MT_editor_menus.append(draw_city_menu)
    bpy.utils.register_manual_map(map_manual)
    bpy.app.translations.register(__name__, TABLES)
    use_cache_folder()
    _commands.append(bpy.utils.register_cli_command("citypv", main))
    start_watching()
    if not bpy.app.background:
        for draw, moment in DRAWN:
            _drawn.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", moment))
    if bpy.app.module:
        # Blender as a Python module may crash on exit while classes are registered.
        atexit.register(unregister)


def unregister():
    """Unregister everything in reverse order; a second call does nothing."""
    atexit.unregister(unregister)
    if not hasattr(bpy.types.Scene, "citypv"):
        return
    stop_watching()
    while _drawn:
        bpy.types.SpaceView3D.draw_handler_remove(_drawn.pop(), "WINDOW")
    bpy.app.translations.unregister(__name__)
    bpy.utils.unregister_manual_map(map_manual)
    bpy.utils.unregister_cli_command(_commands.pop())
    bpy.types.TOPBAR_MT_file_import.remove(draw_import_menu)
    bpy.types.VIEW3D_MT_editor_menus.remove(draw_city_menu)
    del bpy.types.Scene.citypv, bpy.types.Scene.citypv_seeing, bpy.types.Material.citypv_material
    for item in reversed(CLASSES):
        bpy.utils.unregister_class(item)
