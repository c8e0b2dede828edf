"""Before and after: keep a result, and show what a later one has more or less."""

import bpy
import numpy as np

from ...core.settings.errors import InputError, count_of
from ..attributes import CHANGE, COMPARED, PREFIX, read_face_attribute, remove_face_attributes, write_surface_values
from ..city.build_meshes import remove_objects, show_objects
from ..light.keep_transfer import find_kept, read_kept, reopen_session
from ..picture.show_result import BEFORE, find_before, has_result, show_before, show_result
from ..run_step import Action, OfCity
from ..session import find_session
from .summarise import ENERGY

IDS, CHANGES, FOUND = PREFIX + "surface_ids", PREFIX + "changes", PREFIX + "matched"
COPIED = ("totals", "energy_totals", "weather", "buildings")  # properties that tell of the result


def compare_with_before(stage, city, ground):
    """Write after minus before on the faces of a city; return whether there is a result to compare with.

    Surfaces are matched by their ids. Those that only one of the results has are NaN. A city without any common surface
    is another one, and not compared.

    Parameters
    ----------
    stage : bpy.types.Scene
    city, ground : bpy.types.Object or None
        With results; its session has the traced light.
    """
    before = find_before(stage)
    ids = find_session(city).transfer.surfaces.surface_id
    if before is None or not set(ids) & set(before[IDS]):
        for key in (CHANGES, FOUND):
            city.pop(key, None)
        remove_face_attributes(city, ground, *(CHANGE + name for name in COMPARED))
        return False
    row_of = {name: row for row, name in enumerate(before[IDS])}
    rows = np.array([row_of.get(name, -1) for name in ids])
    for name in COMPARED:
        earlier, later = values_of_surfaces(before, name, len(row_of)), values_of_surfaces(city, name, len(ids))
        write_surface_values(city, ground, CHANGE + name, np.where(rows < 0, np.nan, later - earlier[rows]))
    new, gone = int((rows < 0).sum()), len(set(row_of) - set(ids))
    city[FOUND] = f"{count_of(len(ids) - new, 'surface')} matched by id; grey: {new} new" + (
        f"; {gone} are gone" if gone else ""
    )
    totals = before.get(ENERGY, {})
    rows = [(name, totals[name], after) for name, after in city.get(ENERGY, {}).items() if name in totals]
    city[CHANGES] = ["|".join([name, *map(write_energy, (old, later, later - old))]) for name, old, later in rows]
    return True


def values_of_surfaces(item, name, count):
    """Values of an attribute by surface: (count,) float64, NaN for surfaces without faces."""
    found, faces = np.full(count, np.nan), read_face_attribute(item.data, "surface")
    values = read_face_attribute(item.data, name)
    if values is not None:
        found[faces] = values
    return found


def write_energy(value):
    """Energy [MWh] with a decimal below 100."""
    return f"{value:,.{0 if abs(value) >= 100 else 1}f}".replace(",", " ").replace("-", "−")


class KeepBefore(OfCity, Action, bpy.types.Operator):
    """Keep the present result as "before": every later result is shown as the difference from it"""

    bl_idname, bl_label = "citypv.keep_before", "Keep as before"
    needs, lacking = PREFIX + "full_load_hours", "Compute the energy first"

    def act(self, context, city, ground):
        """Keep a copy of the city, hidden, in place of an earlier one."""
        read_kept(reopen_session(city), find_kept(city))
        remove_objects(find_before(context.scene))
        item = bpy.data.objects.new(f"{city.name} before", city.data.copy())
        item.data.name, item.matrix_world = item.name, city.matrix_world
        for key in (PREFIX + name for name in COPIED):
            if key in city:
                item[key] = city[key]
        item[PREFIX + "part"] = BEFORE
        item[IDS] = list(find_session(city).transfer.surfaces.surface_id)
        show_objects(context.scene, item)
        show_before(item, visible=False)
        context.scene.citypv_seeing.side_by_side = False
        return "Kept as before: change what you like, then trace and compute the energy"


class CompareBefore(Action, bpy.types.Operator):
    """Show the present result less the one kept as before"""

    bl_idname, bl_label = "citypv.compare", "Show difference"

    @classmethod
    def poll(cls, context):
        """There are two results."""
        cls.poll_message_set("Keep a result as before, then compute another")
        return find_before(context.scene) is not None and KeepBefore.poll(context)

    def act(self, context, city, ground):
        """Write and show the difference."""
        read_kept(reopen_session(city), find_kept(city))
        if not compare_with_before(context.scene, city, ground):
            problem = "is of another city: no surface has the same id"
            raise InputError("The result kept as before", problem, "keep one of this city")
        show_result(context, city, ground, CHANGE + "full_load_hours")


class ForgetBefore(Action, bpy.types.Operator):
    """Remove the result kept as before, and the differences from it"""

    bl_idname, bl_label = "citypv.forget_before", "Forget before"

    @classmethod
    def poll(cls, context):
        """There is one."""
        return find_before(context.scene) is not None

    def act(self, context, city, ground):
        """Remove it."""
        remove_objects(find_before(context.scene))
        shown = context.scene.citypv.attribute
        if city is not None:
            if shown.startswith(CHANGE) and has_result(city, shown.removeprefix(CHANGE)):
                show_result(context, city, ground, shown.removeprefix(CHANGE))
            compare_with_before(context.scene, city, ground)
