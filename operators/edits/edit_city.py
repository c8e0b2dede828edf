"""Edit an imported city: add selected objects, remove a building; only what the edit touches is traced anew."""

from dataclasses import replace

import bpy
import numpy as np

from ...core.settings.errors import InputError
from ..city.build_meshes import BUILDINGS
from ..city.classify_city import show_kinds
from ..city.read_settings import read_settings
from ..in_place import is_in_place
from ..light.trace_city import keep_light
from ..picture.show_result import find_before
from ..result.compare_results import KeepBefore
from ..result.compute_energy import WeighEnergy
from ..run_step import OfCity, Step, leave_edit_mode
from ..session import Session, find_city, find_own_city, find_session
from .take_meshes import read_meshes

AGAIN = "trace the light first: edits start from what its rays met (an opened file, rounds and forward keep none)"


class EditStep(OfCity, Step):
    """Base of edits: they trace what changes, compute the energy, and show who gains and who loses."""

    stages = {"sky and reflections": 2, "suns": 3, "electricity": 2}

    def take_base(self, context):
        """Session with the traced city that is edited, and the settings of the energy.

        Raises
        ------
        InputError
            There is none.
        """
        city, _ = find_city(context.scene)
        session = find_session(city)
        if is_in_place(city):
            raise InputError(city.name, "it is made of your own objects", "edit them, then take the meshes again")
        if session is None or session.base is None or session.base[1] is not session.transfer:
            raise InputError(city.name, "its light cannot be edited", AGAIN)
        leave_edit_mode(context)
        return session, read_settings(context.scene.citypv)

    @staticmethod
    def work(task, progress):
        """Edit the city and put it on its ground; trace what changes; weigh it with the weather."""
        from ...core.city.edit_city import edit_city
        from ...core.light.edit_light import edit_light
        from ...core.patches.read_albedo import describe_albedo
        from ...core.results.list_findings import list_findings
        from ...core.study import stand_city

        session, make_change, request = task
        base, before = session.base
        site = before.site
        city = edit_city(session.city, make_change(site, session.city.crs), site.convergence)
        scene = stand_city(city, base.request, like=base.leaf.prepared.scene)
        edited = edit_light(base, scene, progress)
        transfer = edited.transfer
        new = Session(city=city, scene=scene, base=(edited, transfer), transfer=transfer)
        weighed = WeighEnergy.work((new, None, request), progress)
        findings = list_findings(scene, transfer.covered_share)
        return session, (new, weighed[1], transfer, findings, (describe_albedo(scene, base.request), [])), weighed

    def finish(self, context, result):
        """Keep the result before the first edit, and show the edited city with what it gains or loses."""
        session, traced, weighed = result
        if find_before(context.scene) is None:
            KeepBefore.act(self, context, *find_own_city(context.scene, session))
        new, _, _, findings, _ = traced
        show_kinds(context, session, new, findings)
        keep_light(context, *traced)
        self.tidy(context)
        return WeighEnergy.finish(self, context, weighed)

    def tidy(self, context):
        """What is left to do once the edited city is shown."""


class AddToCity(EditStep, bpy.types.Operator):
    """Add the selected objects to the city where they stand, as buildings or trees, and see who gains and who loses"""

    bl_idname, bl_label = "citypv.add_to_city", "Add to the city"
    needs, lacking = "transfer", "Trace the light of the city first"

    def prepare(self, context):
        """Read the objects, in metres from the city's origin."""
        session, request = self.take_base(context)
        city, _ = find_city(context.scene)
        chosen = [item for item in context.selected_objects if item != city and "citypv_part" not in item]
        self._taken = [item.name for item in chosen]
        content, unit = read_meshes("Selected objects", chosen, context), context.scene.unit_settings.scale_length
        shift = np.array(city.matrix_world.translation, float)
        return session, add_objects(content, unit, shift, request), request

    def tidy(self, context):
        """Hide the objects: the city has their faces now."""
        for name in self._taken:
            if name in context.scene.objects:
                context.scene.objects[name].hide_set(True)


def add_objects(content, unit, shift, request):
    """A function (site, crs) → Change that adds what was read of objects.

    Parameters
    ----------
    content : FileContent
        In metres of Blender's world.
    unit : float
        Metres of Blender's unit; a city has one unit a metre.
    shift : (3,) float
        Place of the city in Blender's world.
    request : Request
    """
    from ...core.city.edit_city import Change, move_tree, place_local
    from ...core.city.join_contents import join_contents

    def from_city(points):
        return points / unit - shift

    def make_change(site, crs):
        added = join_contents([content], orient=request.orient)
        trees = [move_tree(tree, from_city) for tree in added.trees]
        added = replace(added, points=from_city(added.points), trees=trees)
        return Change(added=(place_local(added, site, crs),))

    return make_change


class RemoveBuilding(EditStep, bpy.types.Operator):
    """Remove a building from the city, and see who gains and who loses"""

    bl_idname, bl_label = "citypv.remove_building", "Remove building"
    needs, lacking = "transfer", "Trace the light of the city first"

    building: bpy.props.StringProperty(
        name="Building",
        description="Its id",
        search=lambda self, context, text: [
            name for name in (find_city(context.scene)[0] or {}).get(BUILDINGS, ()) if text.lower() in name.lower()
        ],
    )

    def invoke(self, context, event):
        """Ask for the id where none is given."""
        return super().invoke(context, event) if self.building else context.window_manager.invoke_props_dialog(self)

    def prepare(self, context):
        """Take the id."""
        from ...core.city.edit_city import Change

        session, request = self.take_base(context)
        if not self.building:
            raise InputError("Building", "none is named", "give the id of one")
        return session, lambda site, crs: Change(removed=(self.building,)), request
