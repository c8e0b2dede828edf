"""Blender user interface of CityPV: properties, panels, registration. Nothing is computed here."""

import atexit

import bpy

from ..operators.check_libraries import check_libraries
from ..operators.city.classify_city import ClassifyCity
from ..operators.city.declare_settings import FindModule
from ..operators.city.import_city import ChooseCity, ImportCity
from ..operators.city.read_settings import find_preferences, use_cache_folder
from ..operators.edits.edit_city import AddToCity, EditBuilding, RemoveBuilding
from ..operators.edits.switch_city import Retrace, SwitchCity
from ..operators.edits.take_meshes import TakeMeshes
from ..operators.edits.update_city import UpdateCity
from ..operators.edits.variants import CompareVariant, DeleteVariant, NewVariant
from ..operators.edits.watch_edits import start_following, stop_following
from ..operators.light.plan_trace import ExplainEffect, PlanEffects, PredictPrices, UsePreset
from ..operators.light.trace_city import TraceCity
from ..operators.picture.draw_results import run_command
from ..operators.picture.draw_view import start_drawing, stop_drawing
from ..operators.picture.show_result import ColourCity
from ..operators.picture.stage_picture import RenderCity
from ..operators.picture.timeline import StartTimeline, StopTimeline
from ..operators.result.compare_results import CompareBefore, ForgetBefore, KeepBefore
from ..operators.result.compute_energy import ShowBuilding, WeighEnergy
from ..operators.result.export_results import ExportResults
from ..operators.result.keep_report import CopyGroup, ShowReport
from ..operators.result.probe_faces import ProbeFaces
from ..operators.result.select_faces import DeselectFaces, SelectBuildings, SelectGroup
from ..operators.run_step import CancelStep
from ..operators.session import close_sessions
from ..operators.solar_city import BerlinExample, CityHandler, DropWeather, SolarCity, WeatherHandler
from .menus import CityMenu, draw_city_menu, draw_import_menu
from .panels import PANELS, MaterialPanel
from .properties import REFLECTION, Preferences, Seeing, Settings

STEPS = (SolarCity, ChooseCity, ImportCity, TakeMeshes, ClassifyCity, TraceCity, WeighEnergy, ColourCity, RenderCity)
OTHERS = (
    *(DropWeather, CityHandler, WeatherHandler, BerlinExample, SwitchCity, Retrace, CancelStep),
    *(UsePreset, PlanEffects, ExplainEffect, PredictPrices, FindModule),
    *(SelectGroup, SelectBuildings, DeselectFaces, CopyGroup, ShowReport, ProbeFaces, ShowBuilding, ExportResults),
    *(StartTimeline, StopTimeline, KeepBefore, CompareBefore, ForgetBefore, AddToCity, EditBuilding, RemoveBuilding),
    UpdateCity,
    *(NewVariant, CompareVariant, DeleteVariant),
)
CLASSES = (Settings, Seeing, Preferences, *STEPS, *OTHERS, *PANELS, MaterialPanel, CityMenu)

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
