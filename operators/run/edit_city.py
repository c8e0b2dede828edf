"""Edit a city: selected objects join it, a building becomes an object of its own, or goes; *Update*
computes it.
"""

import bpy
import numpy as np
from mathutils.geometry import tessellate_polygon

from ...core.settings.errors import InputError
from ..city.attributes import read_array, read_face_attribute, write_face_attribute
from ..city.build_meshes import suggest_buildings
from ..city.keys import Key
from ..city.run_step import Action, OfCity, leave_edit_mode
from ..city.session import Session, find_city
from ..city.source_objects import is_in_place, list_taken
from ..show.colour_user_meshes import colour_user_meshes
from . import city_design
from .members import list_members
from .shapes import describe_object
from .worn_faces import POLYGON, remember_wearers, write_sources


class EditAction(OfCity, Action):
    """Base of edits by a button: in a window the city is updated as after any edit, in a script at
    once.
    """

    def execute(self, context):
        """Edit, and update."""
        done = super().execute(context)
        if done == {"FINISHED"}:
            context.view_layer.update()
            city_design.note_edits(find_city(context.scene)[0])
            if (
                bpy.app.background
                and context.scene.citypv_seeing.live
                and bpy.ops.citypv.update.poll()
            ):
                bpy.ops.citypv.update()
        return done


class AddToCity(EditAction, bpy.types.Operator):
    """Add the selected objects, where they stand, to the city, as buildings or trees"""

    bl_idname, bl_label = "citypv.add_to_city", "Add to the city"

    def act(self, context, city, ground):
        """Note on the objects which city they are part of."""
        chosen = [item for item in context.selected_objects if Key.PART not in item]
        if not chosen:
            raise InputError(
                "Selected objects", "there are none beside the city", "select what joins it"
            )
        for item in chosen:
            item[Key.OWNER] = city[Key.IDENTITY]
            item.pop(Key.BUILDING_ID, None)
        return f"Part of {city.name}: {', '.join(item.name for item in chosen)}"


class _NameBuilding:
    """Mixin of operators that take a building; without an id they take the one of the selected
    faces, or ask.
    """

    building: bpy.props.StringProperty(
        name="Building",
        description="Its id; to have it filled in, click on the building with Probe first",
        search=suggest_buildings,
        options={"SKIP_SAVE"},
    )

    def invoke(self, context, event):
        """Ask for the id where none is given and no face is selected."""
        city, _ = find_city(context.scene)
        if not self.building and city is not None and city.get(Key.HIGHLIGHT):
            numbers = np.unique(
                read_face_attribute(city.data, "building")[
                    read_array(city.data.polygons, "select", dtype=bool)
                ]
            )
            self.building = city[Key.BUILDINGS][int(numbers[0])] if len(numbers) == 1 else ""
        return (
            self.execute(context)
            if self.building
            else context.window_manager.invoke_props_dialog(self)
        )


def _check_building(city, session, name):
    """Refuse a building that is none of the files.

    Raises
    ------
    InputError
    """
    if not name:
        raise InputError("Building", "none is named", "give the id of one")
    if is_in_place(city) or session is None or session.imported is None:
        raise InputError(
            city.name,
            "its buildings are not known from files",
            "edit its objects, or import it again",
        )
    if name not in session.imported.building_id:
        raise InputError(
            name, "no building of the city has this id", "take it from the list of buildings"
        )


class RemoveBuilding(_NameBuilding, EditAction, bpy.types.Operator):
    """Leave a building out of the city"""

    bl_idname, bl_label = "citypv.remove_building", "Remove building"
    needs, lacking = (
        "imported",
        "Import the city again first: its buildings are not kept in the file",
    )

    def act(self, context, city, ground):
        """Note it on the city; an object of it is removed."""
        for item in list_members(city):
            if self.building and item.get(Key.BUILDING_ID, item.name) == self.building:
                bpy.data.objects.remove(item)
                if self.building not in Session.of(city).imported.building_id:
                    return f"Removed: {self.building}"
        _check_building(city, Session.of(city), self.building)
        if self.building in city_design.removed_of(city):
            raise InputError(self.building, "it was removed already", "take another")
        if (
            not {*Session.of(city).imported.building_id}
            - city_design.removed_of(city)
            - {self.building}
        ):
            raise InputError(city.name, "no building would be left", "keep one at least")
        city[Key.REMOVED] = "\n".join(sorted(city_design.removed_of(city) | {self.building}))
        return f"Removed: {self.building}"


class EditBuilding(_NameBuilding, EditAction, bpy.types.Operator):
    """Make a building an object of its own, in place, with its ids, to move, scale or edit"""

    bl_idname, bl_label = "citypv.edit_building", "Edit building"
    needs, lacking = "scene", "Import and classify the city first"

    def act(self, context, city, ground):
        """Make the object, and let it show the colours of its faces."""
        session = Session.of(city)
        _check_building(city, session, self.building)
        if self.building in city_design.removed_of(city):
            raise InputError(
                self.building,
                "it is an object of its own already, or was removed",
                "edit that object",
            )
        leave_edit_mode(context)
        item = _make_object(city, session, self.building)
        for group in city.users_collection:
            group.objects.link(item)
        context.view_layer.update()
        item[Key.ORIGINAL] = describe_object(city, item).hex()
        city[Key.REMOVED] = "\n".join(sorted(city_design.removed_of(city) | {self.building}))
        taken = [(own, name) for _, own, name in list_taken(city)]
        remember_wearers(city, [*taken, (item, self.building)])
        write_sources(city, session.scene.surfaces.surface_id)
        colour_user_meshes(city)
        city.pop(Key.HIGHLIGHT, None)  # it would stay where the building was
        for other in context.selected_objects:
            other.select_set(False)
        item.select_set(True)
        context.view_layer.objects.active = item
        return f"{self.building} is the object {item.name}"


def _make_object(city, session, building):
    """Object of a building of the files, in place: bpy.types.Object, not linked yet.

    Its faces are the polygons, or triangles of those with holes; they know the ids. Its origin is
    on its foot.
    """

    imported = session.imported
    rows = [row for row, name in enumerate(imported.building_id) if name == building]
    corners, faces, number = [], [], []
    for place, row in enumerate(rows):
        rings = [session.scene.site.from_files(ring) for ring in imported.rings(row)]
        triangles = (
            tessellate_polygon([ring.tolist() for ring in rings])
            if len(rings) > 1
            else [range(len(rings[0]))]
        )
        faces += [np.array(face) + sum(map(len, corners)) for face in triangles]
        number += [place] * len(triangles)
        corners += rings
    points = np.concatenate(corners)
    foot = np.append((points.min(axis=0) + points.max(axis=0))[:2] / 2, points[:, 2].min()).round(2)
    places, same = np.unique(points.round(6), axis=0, return_inverse=True)
    mesh = bpy.data.meshes.new(building)
    mesh.from_pydata((places - foot).tolist(), [], [same.ravel()[face].tolist() for face in faces])
    write_face_attribute(mesh, POLYGON, np.array(number, np.int32))
    item = bpy.data.objects.new(building, mesh)
    item.location = (foot + np.array(city.location)).tolist()
    item[Key.OWNER], item[Key.BUILDING_ID] = city[Key.IDENTITY], building
    item[Key.POLYGONS] = "\n".join(imported.surface_id[row] for row in rows)
    return item
