"""Switch between several cities of a file: one is to be seen, the others are hidden."""

import bpy

from ..core.settings.errors import InputError
from .attributes import PREFIX
from .build_meshes import read_vertices
from .colour_faces import read_scale
from .in_place import SEEN, is_in_place
from .run_step import redraw_panels
from .select_faces import leave_edit_mode
from .session import find_city, list_cities
from .show_city import match_view
from .step_state import asked_path
from .wear_colours import take_off_colours, wear_colours


class SwitchCity(bpy.types.Operator):
    """Show this city, and hide the others"""

    bl_idname = "citypv.switch_city"
    bl_label = "Show city"
    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty(name="City", description="Name of the city's object")

    @classmethod
    def poll(cls, context):
        """There is a city."""
        cls.poll_message_set("Import a city first")
        return find_city(context.scene)[0] is not None

    def execute(self, context):
        """Show one, hide the others."""
        cities = list_cities(context.scene)
        try:
            chosen = find_by_name(cities, self.name)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        leave_edit_mode(context)
        for item in cities:
            show_objects_of(item, visible=item == chosen)
        taken = is_in_place(chosen)
        if not taken and asked_path(chosen):
            context.scene.citypv.city_path = asked_path(chosen)
        match_view(context.scene, None if taken else read_vertices(chosen))
        redraw_panels(context, views=True)
        return {"FINISHED"}


def find_by_name(cities, name):
    """City with this name.

    Raises
    ------
    InputError
        There is none.
    """
    for item in cities:
        if item.name == name:
            return item
    raise InputError(name or "City", "there is no such city", f"give {' or '.join(item.name for item in cities)}")


def show_objects_of(city, *, visible):
    """Show or hide a city and its ground in viewport and pictures; what is hidden is not selected either.

    The objects of the user that a city was taken from stay; only its colours on them come and go.
    """
    if is_in_place(city):
        city[SEEN] = visible
        wanted = visible and read_scale(city) is not None and bpy.context.scene.citypv.show_colours
        (wear_colours if wanted else take_off_colours)(city)
        ground = city.get(PREFIX + "ground")
        if ground is not None:
            ground.hide_set(not visible)
        return
    for item in filter(None, (city, city.get(PREFIX + "ground"))):
        if not visible:
            item.select_set(False)
        item.hide_set(not visible)
        item.hide_render = not visible
