"""Switch between several cities of a file: one is to be seen, the others are hidden."""

import os
from ast import literal_eval
from pathlib import Path

import bpy

from ...core.settings.errors import InputError
from ..city.build_meshes import read_vertices
from ..city.keys import Key
from ..city.run_step import Action, OfCity, leave_edit_mode
from ..city.session import find_city, list_cities
from ..city.source_objects import is_in_place, list_taken
from ..show.colour_user_meshes import colour_user_meshes, uncolour_user_meshes
from ..show.show_city import match_view
from ..show.show_modules import show_modules
from .members import list_members


class SwitchCity(OfCity, Action, bpy.types.Operator):
    """Show this city, and hide the others"""

    bl_idname, bl_label = "citypv.switch_city", "Show city"

    name: bpy.props.StringProperty(name="City", description="Name of the city's object")

    def act(self, context, city, ground):
        """Show one, hide the others."""
        chosen = find_named(context.scene, self.name)
        leave_edit_mode(context)
        # The chosen one last: others may have coloured the same objects.
        for item in sorted(list_cities(context.scene), key=lambda item: item == chosen):
            show_objects_of(item, visible=item == chosen)
        taken, asked = is_in_place(chosen), chosen.get(Key.ASKED + "import")
        if asked and not taken:  # the panel has the path again that the city was imported from
            path = literal_eval(asked)[0]  # `city_path`, the first of `STEPS`
            context.scene.citypv.city_path = path or context.scene.citypv.city_path
        same = chosen.get(Key.FAMILY) and chosen.get(Key.FAMILY) == (
            city.get(Key.FAMILY) if city is not None else None
        )
        show_modules(context)
        match_view(context, None if taken or same else read_vertices(chosen))


def find_named(stage, name):
    """A city by the name of its object.

    Raises
    ------
    InputError
    """
    cities = {item.name: item for item in list_cities(stage)}
    if name not in cities:
        raise InputError(name or "City", "there is no such city", f"give {' or '.join(cities)}")
    return cities[name]


def show_objects_of(city, *, visible):
    """Show or hide a city and its ground in viewport and pictures; what is hidden is not selected
    either.

    What was added to it comes and goes with it. The objects of the user that a city was taken from
    stay, but for a variant's; only its colours come and go.
    """
    for item in list_members(city) if Key.VARIANT in city or not is_in_place(city) else ():
        if not visible and item.visible_get():
            item[Key.PUT_AWAY] = True
            _put_away(item, True)
        elif visible and item.pop(Key.PUT_AWAY, False):
            _put_away(item, False)
    if is_in_place(city):
        city[Key.SEEN] = visible
        wanted = visible and Key.COLOUR_ATTRIBUTE in city and bpy.context.scene.citypv.show_colours
        (colour_user_meshes if wanted else uncolour_user_meshes)(city)
    for item in filter(None, (None if is_in_place(city) else city, city.get(Key.GROUND))):
        _put_away(item, not visible)
        item.hide_render = not visible


def _put_away(item, hidden):
    """Hide an object so that Alt H, which shows what the user hid, leaves it away; or show it
    again.
    """
    if hidden:
        item.select_set(False)
    else:
        item.hide_set(False)
    item.hide_viewport = hidden


class Retrace(OfCity, bpy.types.Operator):
    """Import the files, or the meshes, of this city again and run all steps"""

    bl_idname, bl_label = "citypv.retrace", "Import and trace again"
    bl_options = {"REGISTER", "UNDO"}
    needs = Key.FILES

    def execute(self, context):
        """Run the steps."""
        city, _ = find_city(context.scene)
        if is_in_place(city):
            for item in context.selected_objects:
                item.select_set(False)
            for _, item, _ in list_taken(city):
                item.hide_set(False)
                item.select_set(True)
            context.scene.citypv.collection = None
            return bpy.ops.citypv.take_meshes("INVOKE_DEFAULT")
        paths = [Path(path) for path in city[Key.FILES]]
        folder = os.path.commonpath([path.parent for path in paths])
        files = [{"name": str(path.relative_to(folder))} for path in paths]
        return bpy.ops.citypv.solar_city("INVOKE_DEFAULT", files=files, directory=folder)
