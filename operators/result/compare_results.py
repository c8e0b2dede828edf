"""Before and after: keep a result, and show what a later one has more or less."""

import bpy
import numpy as np

from ...core.results.colour_map import MISSING
from ..attributes import CHANGE, COMPARED, PREFIX, read_face_attribute, remove_face_attribute, write_surface_values
from ..city.build_meshes import show_objects
from ..light.keep_transfer import find_kept, read_kept, reopen_session
from ..picture.colour_faces import (
    build_colour_material,
    build_plain_material,
    build_scale,
    colours_of_values,
    read_scale,
    write_colours,
)
from ..picture.show_result import has_result, show_result
from ..run_step import redraw_panels
from ..session import find_city, find_session
from .summarise import ENERGY

IDS, CHANGES, FOUND = PREFIX + "surface_ids", PREFIX + "changes", PREFIX + "matched"
PART, COPIED = "before", ("totals", "energy_totals", "weather", "buildings")  # properties that tell of the result
GAP = 1.1  # distance of the two results over the width of the city


def find_before(stage):
    """The result kept as *before* in a Blender scene: bpy.types.Object or None."""
    return next((item for item in stage.objects if item.get(PREFIX + "part") == PART), None)


def keep_before(stage, city):
    """Keep a copy of a city with its present results, hidden, in place of an earlier one.

    Parameters
    ----------
    stage : bpy.types.Scene
    city : bpy.types.Object
        With full load hours; its session has the traced light.

    Returns
    -------
    bpy.types.Object
    """
    forget_before(stage)
    item = bpy.data.objects.new(f"{city.name} before", city.data.copy())
    item.data.name = item.name
    item.matrix_world = city.matrix_world
    for key in (PREFIX + name for name in COPIED):
        if key in city:
            item[key] = city[key]
    item[PREFIX + "part"] = PART
    item[IDS] = list(find_session(city).transfer.surfaces.surface_id)
    show_objects(stage, item)
    show_before(item, visible=False)
    return item


def forget_before(stage):
    """Remove the result kept as *before*, if there is one."""
    item = find_before(stage)
    if item is not None:
        mesh = item.data
        bpy.data.objects.remove(item)
        bpy.data.meshes.remove(mesh)


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
        for name in COMPARED:
            remove_face_attribute(city, CHANGE + name)
            remove_face_attribute(ground, CHANGE + name)
        return False
    row_of = {name: row for row, name in enumerate(before[IDS])}
    rows = np.array([row_of.get(name, -1) for name in ids])
    for name in COMPARED:
        values = [values_of_surfaces(item, name, count) for item, count in ((before, len(row_of)), (city, len(ids)))]
        change = np.where(rows < 0, np.nan, values[1] - values[0][rows])
        write_surface_values(city, ground, CHANGE + name, change)
    new, gone = int((rows < 0).sum()), len(set(row_of) - set(ids))
    city[FOUND] = f"{len(ids) - new} surfaces matched by id; grey: {new} new" + (f"; {gone} are gone" if gone else "")
    city[CHANGES] = list_changes(before.get(ENERGY, {}), city.get(ENERGY, {}))
    return True


def values_of_surfaces(item, name, count):
    """Values of an attribute by surface: (count,) float64, NaN for surfaces without faces."""
    found, faces = np.full(count, np.nan), read_face_attribute(item.data, "surface")
    values = read_face_attribute(item.data, name)
    if values is not None:
        found[faces] = values
    return found


def list_changes(before, after):
    """Rows of the table of totals: name, before, after and difference [MWh per year], separated by bars."""
    names = [name for name in after if name in before]
    return ["|".join([name, *(write_energy(value) for value in _three(before[name], after[name]))]) for name in names]


def write_energy(value):
    """Energy [MWh] with a decimal below 100."""
    return f"{value:,.{0 if abs(value) >= 100 else 1}f}".replace(",", " ").replace("-", "−")


def show_before(item, *, visible, scale=None):
    """Show the earlier result to the west of the city, in the colours of a scale, or hide it.

    Parameters
    ----------
    item : bpy.types.Object
    visible : bool
    scale : ColourScale, optional
        Of the city; for a difference the earlier result itself is shown in it, where it has one.
    """
    item.hide_viewport = item.hide_render = not visible
    if not visible:
        return
    width = max(corner[0] for corner in item.bound_box) - min(corner[0] for corner in item.bound_box)
    item.location.x = -GAP * width
    name = None if scale is None else scale.attribute.removeprefix(CHANGE)
    values = read_face_attribute(item.data, name) if name else None
    if values is not None:
        wear_scale(item, values, scale if name == scale.attribute else scale_of_values(name, values))


def follow_scale(stage, scale):
    """Show the earlier result as the city is shown now, where it stands beside it."""
    item = find_before(stage)
    if item is not None and not item.hide_viewport:
        show_before(item, visible=True, scale=scale)


def scale_of_values(name, values):
    """Scale from the 2nd to the 98th percentile, where a difference has none for the result itself."""
    low, high = np.nanpercentile(values, [2, 98]) if np.isfinite(values).any() else (0.0, 1.0)
    return build_scale(name, float(low), float(high if high > low else low + 1.0))


def wear_scale(item, values, scale):
    """Colour the earlier result."""
    names = "CityPV colours before", "CityPV missing"
    item.data.materials.clear()
    item.data.materials.append(build_colour_material(scale, names[0]))
    item.data.materials.append(build_plain_material(names[1], MISSING))
    missing = ~np.isfinite(values.astype(np.float64))
    item.data.polygons.foreach_set("material_index", missing.astype(np.int32))
    write_colours(item.data, colours_of_values(scale, values))
    item.data.update()


def _three(before, after):
    return before, after, after - before


class KeepBefore(bpy.types.Operator):
    """Keep the present result as "before": every later result is shown as the difference from it"""

    bl_idname = "citypv.keep_before"
    bl_label = "Keep as before"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There are full load hours."""
        cls.poll_message_set("Compute the energy first")
        city, _ = find_city(context.scene)
        return city is not None and PREFIX + "full_load_hours" in city.data.attributes

    def execute(self, context):
        """Keep a copy."""
        city, _ = find_city(context.scene)
        read_kept(reopen_session(city), find_kept(city))
        keep_before(context.scene, city)
        context.scene.citypv_seeing.side_by_side = False
        self.report({"INFO"}, "Kept as before: change what you like, then trace and compute the energy")
        return {"FINISHED"}


class CompareBefore(bpy.types.Operator):
    """Show the present result less the one kept as before"""

    bl_idname = "citypv.compare"
    bl_label = "Show difference"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There are two results."""
        cls.poll_message_set("Keep a result as before, then compute another")
        return find_before(context.scene) is not None and KeepBefore.poll(context)

    def execute(self, context):
        """Write and show the difference."""
        city, ground = find_city(context.scene)
        read_kept(reopen_session(city), find_kept(city))
        if not compare_with_before(context.scene, city, ground):
            self.report({"ERROR"}, "The result kept as before is of another city: no surface has the same id")
            return {"CANCELLED"}
        show_result(context, city, ground, CHANGE + "full_load_hours")
        redraw_panels(context, views=True)
        return {"FINISHED"}


class ForgetBefore(bpy.types.Operator):
    """Remove the result kept as before, and the differences from it"""

    bl_idname = "citypv.forget_before"
    bl_label = "Forget before"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There is one."""
        return find_before(context.scene) is not None

    def execute(self, context):
        """Remove it."""
        forget_before(context.scene)
        city, ground = find_city(context.scene)
        if city is not None:
            shown = context.scene.citypv.attribute
            if shown.startswith(CHANGE) and has_result(city, shown.removeprefix(CHANGE)):
                show_result(context, city, ground, shown.removeprefix(CHANGE))
            compare_with_before(context.scene, city, ground)
        redraw_panels(context, views=True)
        return {"FINISHED"}


def follow_side_by_side(seeing, context):
    """Show or hide the earlier result (`update` of the property)."""
    before, (city, _) = find_before(context.scene), find_city(context.scene)
    if before is not None:
        show_before(before, visible=seeing.side_by_side, scale=read_scale(city) if city is not None else None)
