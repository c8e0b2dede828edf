"""Variants of a city: each with objects and results of its own; one is seen, and compared with any
other.
"""

import uuid
from dataclasses import replace
from string import ascii_uppercase

import bpy

from ...core.settings.errors import InputError
from ..city.attributes import CHANGE
from ..city.build_meshes import remove_objects
from ..city.keys import Key
from ..city.run_step import Action, OfCity, leave_edit_mode
from ..city.session import Session
from ..city.source_objects import list_taken
from ..show.show_result import find_before, show_result
from .compare_results import compare_with_before, find_variants
from .members import list_members, list_seen
from .switch_city import find_named, show_objects_of
from .update_city import tell_errors
from .worn_faces import remember_wearers


class NewVariant(OfCity, Action, bpy.types.Operator):
    """Go on with a copy of the city and its objects; the present one stays, to compare with"""

    bl_idname, bl_label = "citypv.new_variant", "New variant"
    needs, lacking = Key.KWP, "Compute the energy first"

    def act(self, context, city, ground):
        """Copy, and show the copy."""
        leave_edit_mode(context)
        city[Key.FAMILY] = city.get(Key.FAMILY) or city[Key.IDENTITY]
        copy = _copy_variant(city, ground)
        for item in (copy,) if Key.VARIANT in city else (city, copy):
            used = {
                variant.get(Key.VARIANT)
                for variant in find_variants(context.scene, item)
                if variant != item
            }
            item[Key.VARIANT] = next(
                (letter for letter in ascii_uppercase if letter not in used), f"{len(used) + 1}"
            )
        show_objects_of(city, visible=False)
        show_objects_of(copy, visible=True)
        context.view_layer.update()
        own, shown = copy.get(Key.GROUND), context.scene.citypv.attribute
        # What is seen as colours is the change against the variant that it was copied from: none so
        # far.
        if compare_with_before(context.scene, copy, own) and shown.startswith(CHANGE):
            show_result(context, copy, own, shown)
        return f"Variant {copy[Key.VARIANT]}, compared with {city[Key.VARIANT]}"


class CompareResults(OfCity, Action, bpy.types.Operator):
    """Show the present result less the one kept as before, or less the one of a variant"""

    bl_idname, bl_label = "citypv.compare", "Show difference"
    needs, lacking = Key.KWP, "Compute the energy first"

    name: bpy.props.StringProperty(
        name="City",
        description="Name of a variant's object; empty: what was compared last, or kept as before",
        options={"SKIP_SAVE"},
    )

    def act(self, context, city, ground):
        """Write and show the difference, with the errors of the rays that both share."""
        if self.name:
            other = find_named(context.scene, self.name)
            city[Key.AGAINST] = other[Key.IDENTITY]
            session, earlier = Session.of(city), Session.of(other)
            if session is not None and session.energy is not None and earlier is not None:
                kept = session.weather, session.energy, session.request
                session.change = tell_errors(earlier.base, session.base, *kept)
        before = find_before(context.scene, city)
        if before is None or not compare_with_before(context.scene, city, ground):
            raise InputError(
                city.name,
                "nothing is kept as before, or it has no energy, or is of another city: no surface "
                "has the same shape",
                "keep a result of this city as before",
            )
        show_result(context, city, ground, CHANGE + "full_load_hours")
        return f"{city.get(Key.VARIANT, city.name)} less {before.get(Key.VARIANT, before.name)}"


class DeleteVariant(OfCity, Action, bpy.types.Operator):
    """Delete a variant with its objects"""

    bl_idname, bl_label = "citypv.delete_variant", "Delete variant"

    name: bpy.props.StringProperty(name="City", description="Name of the variant's object")

    def act(self, context, city, ground):
        """Delete it; where it was seen, another one is."""
        leave_edit_mode(context)
        gone = find_named(context.scene, self.name)
        others = [item for item in find_variants(context.scene, gone) if item != gone]
        if not others:
            raise InputError(gone.name, "it is the only variant", "keep it")
        text = gone.get(Key.VARIANT, gone.name)
        own = [item for item in list_members(gone) if Key.OWNER in item]
        remove_objects(gone, gone.get(Key.GROUND), *own)
        if gone == city:
            show_objects_of(others[-1], visible=True)
        return f"Deleted: variant {text}"


def _copy_variant(city, ground):
    """Copy a city with its results, its ground and its objects, which keep the ids of their
    buildings; it is linked.

    Returns
    -------
    bpy.types.Object
    """
    copies, names, members = {}, list_seen(city), list_members(city)
    for item in filter(None, (city, ground, *members)):
        copies[item] = item.copy()
        if item.data is not None:
            copies[item].data = item.data.copy()
        for group in item.users_collection:
            group.objects.link(copies[item])
    copy = copies[city]
    copy[Key.IDENTITY], copy[Key.AGAINST] = uuid.uuid4().hex, city[Key.IDENTITY]
    if ground is not None:
        copy[Key.GROUND], copies[ground].parent = copies[ground], copy
    for item in members:
        copies[item][Key.OWNER], copies[item][Key.BUILDING_ID] = (
            copy[Key.IDENTITY],
            names.get(item, item.get(Key.BUILDING_ID, item.name)),
        )
    remember_wearers(copy, [(copies[item], building) for _, item, building in list_taken(city)])
    if Session.of(city) is not None:
        replace(Session.of(city)).open(copy)
    return copy
