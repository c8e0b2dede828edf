"""Show a result: the panel's choice *Show*, the colours of the faces and the view say the same.

A result that was kept as *before* may stand beside the city, in the same colours.
"""

import bpy
import numpy as np

from ...core.settings.errors import InputError
from ..city.attributes import CHANGE, PREFIX, read_face_attribute
from ..city.keys import Key
from ..city.panel import StepPanel
from ..city.read_materials import remember_materials
from ..city.run_step import Action, OfCity, leave_edit_mode
from ..city.session import Session, find_city, list_cities
from ..city.source_objects import list_taken
from .colour_faces import build_scale, colour_faces, paint_mesh, read_scale, show_exact_colours
from .colour_user_meshes import colour_user_meshes, uncolour_user_meshes
from .show_city import give_back_shading, keep_shading, show_city
from .show_modules import show_modules

_state = {"quiet": False}  # what a step sets in the panel is coloured already


def show_result(context, city, ground, attribute):
    """Choose a result in the panel, colour the faces by it, and show them.

    Parameters
    ----------
    context : bpy.types.Context
    city, ground : bpy.types.Object or None
    attribute : str
        Name without prefix.

    Returns
    -------
    ColourScale

    Raises
    ------
    InputError
        The faces do not have this result.
    """
    settings = context.scene.citypv
    city.pop(Key.HIGHLIGHT, None)  # of what was selected or probed on another map
    # Ends that were given for another result mean nothing for this one.
    own = not settings.auto_range and city.get(Key.COLOUR_ATTRIBUTE) == attribute
    ends = (settings.low, settings.high) if own else None
    if own and not settings.low < settings.high:
        raise InputError(
            "Range", f"{settings.low:g} to {settings.high:g} is empty", "give a Low below High"
        )
    scale = colour_faces(city, ground, attribute, ends, settings.colour_map)
    _state["quiet"] = True
    settings.attribute = attribute
    if not scale.classes:
        settings.low, settings.high = scale.low, scale.high
    _state["quiet"] = False
    _show_colours(context, city)
    show_modules(context)
    before = find_before(context.scene)
    if before is not None and not before.hide_viewport:
        _show_before(before, visible=True, scale=scale)
    return scale


def _show_colours(context, city):
    """Show the colours of a city, or the shape and the user's own materials where *Colours*
    is off.
    """
    wanted = context.scene.citypv.show_colours
    if list_taken(city):
        (colour_user_meshes if wanted else uncolour_user_meshes)(city)
    if wanted:
        keep_shading(context)
        show_exact_colours(context.scene)
        show_city(context)
    else:
        give_back_shading(context)


def follow_switch(settings, context):
    """Show or take off the colours when the switch *Colours* changes."""
    city, _ = find_city(context.scene)
    if not _state["quiet"] and city is not None and Key.COLOUR_ATTRIBUTE in city:
        leave_edit_mode(context)
        _show_colours(context, city)


def follow_choice(settings, context):
    """Colour the faces anew when a setting of *Colour* changes (`update` of its properties).

    Where the city has no such result, or the range is empty, nothing changes: the panel says why.
    """
    city, ground = find_city(context.scene)
    if _state["quiet"] or city is None or not has_result(city, settings.attribute):
        return
    same = city.get(Key.COLOUR_ATTRIBUTE) == settings.attribute
    if same and not settings.auto_range and not settings.low < settings.high:
        return
    leave_edit_mode(context)
    session = Session.of(city)
    if session is not None and session.city is not None:
        remember_materials(city, ground, session)
    show_result(context, city, ground, settings.attribute)


def has_result(city, attribute):
    """Whether the faces of a city have a result."""
    return PREFIX + attribute in city.data.attributes


class ColourCity(OfCity, Action, bpy.types.Operator):
    """Colour the faces by the chosen result"""

    bl_idname, bl_label = "citypv.colour", "Colour faces"
    needs, lacking = Key.KIND, "Classify the city first"

    def act(self, context, city, ground):
        """Colour the faces, and store the range used."""
        leave_edit_mode(context)
        scale = show_result(context, city, ground, context.scene.citypv.attribute)
        return f"Coloured by {scale.title[0].lower()}{scale.title[1:]}"


def find_before(stage, city=None):
    """What the result of a city is compared with: a variant of it, or the result kept as *before*.

    Returns
    -------
    bpy.types.Object or None
    """
    against = city.get(Key.AGAINST) if city is not None else None
    for item in list_cities(stage) if against else ():
        if item != city and item.get(Key.IDENTITY) == against:
            return item
    return next((item for item in stage.objects if item.get(Key.PART) == "before"), None)


def _show_before(item, *, visible, scale=None):
    """Show the earlier result to the west of the city, in the colours of a scale, or hide it.

    Parameters
    ----------
    item : bpy.types.Object
    visible : bool
    scale : ColourScale, optional
        Of the city; for a difference the earlier result itself is shown, from the 2nd to the 98th
        percentile.
    """
    item.hide_viewport = item.hide_render = not visible
    if not visible:
        return
    across = [corner[0] for corner in item.bound_box]
    item.location.x = 1.1 * (min(across) - max(across))
    name = None if scale is None else scale.name.removeprefix(CHANGE)
    values = read_face_attribute(item.data, name) if name else None
    if values is None:
        return
    if name != scale.name:
        low, high = (
            np.nanpercentile(values, [2, 98]).tolist() if np.isfinite(values).any() else (0.0, 1.0)
        )
        scale = build_scale(name, low, high if high > low else low + 1.0)
    paint_mesh(item.data, values, scale)


def follow_side_by_side(seeing, context):
    """Show or hide the earlier result (`update` of the property)."""
    before, (city, _) = find_before(context.scene), find_city(context.scene)
    if before is not None:
        _show_before(
            before,
            visible=seeing.side_by_side,
            scale=read_scale(city) if city is not None else None,
        )


class ColourPanel(StepPanel, bpy.types.Panel):
    """Colour."""

    bl_idname, bl_label, bl_order, bl_options = "CITYPV_PT_colour", "5  Colour", 8, set()

    def draw(self, context):
        """Show the settings of the step."""
        column, settings, city = self.start(context)
        ends = () if settings.auto_range else ("low", "high")
        self.draw_settings(
            column,
            settings,
            "show_colours",
            "attribute",
            "colour_map",
            "auto_range",
            *ends,
            "show_legend",
            "show_modules",
        )
        if city and not has_result(city, settings.attribute):
            self.draw_sentence(
                column.column(align=True), "Not computed yet: run the steps above", "INFO"
            )
        elif ends and not settings.low < settings.high:
            column.label(text="Low must be below High", icon="ERROR")
        self.draw_told(self.layout, city.get("citypv_stand_ins"))
        column.operator("citypv.colour", icon="COLOR")
        column.operator_menu_enum("citypv.render", "view", icon="RENDER_STILL")
