"""Read a city as it is seen: what was imported, without what was removed, with objects of the user,
and its own mesh.

Reading takes place in Blender's thread; what was read is made a City in the thread of the work.
"""

from dataclasses import dataclass, replace

import numpy as np
from mathutils import Matrix

from ...core.city.city import FileContent, Polygon, whole_of_cell
from ...core.settings.errors import InputError
from ..city import attributes
from ..city.keys import Key
from ..city.source_objects import is_in_place
from ..show.colour_user_meshes import own_modifiers
from . import city_design
from .members import list_seen, site_of
from .take_meshes import read_meshes


@dataclass
class _EditedCity:
    """A city as it is seen."""

    imported: object  # core.city.city.City, of the files; None for a city of meshes
    design: str  # digest of it, of `members.describe_design`
    lineage: str
    orient: str
    site: object  # core.city.scene.Site of its mesh
    removed: set  # ids of its buildings that are left out
    content: FileContent | None  # of objects
    taken: list  # of (`session_uid` of an object, name of its building), of `read_meshes`
    reshaped: tuple | None  # of `_read_reshaped`

    def make(self):
        """Make the city of what was read: the files' City with what was edited in its own mesh,
        None without files, and the City of all that is seen.
        """
        from ...core.city.edit_city import CityChange, edit_city, join_cities, place_local
        from ...core.city.join_contents import join_contents

        # Without files: what stands in the scene is all of it.
        if self.imported is None:
            return None, join_contents([self.content], orient=self.orient)

        # Polygons that were edited in the city's mesh take the place of the files'.
        imported = self.imported
        if self.reshaped is not None:
            broken, content = self.reshaped
            imported = left = imported.take(~np.isin(imported.surface_id, list(broken)))
            if content.polygons:
                added = place_local(
                    join_contents([content], orient="as-drawn"), self.site, left.grid
                )
                imported = join_cities(left, added)
                # they are parts of buildings that are there
                imported.building_id[len(left) :] = added.building_id
        # Other objects come in addition, and buildings that were removed go.
        added = ()
        if self.content is not None:
            added = (
                place_local(
                    join_contents([self.content], orient=self.orient),
                    self.site,
                    imported.grid,
                ),
            )
        gone = self.removed & {*imported.building_id}
        city = edit_city(imported, CityChange(removed=gone, added=added))
        # A building that became an object of its own is still what its files tell of it.
        return imported, replace(city, attributes=imported.attributes | city.attributes)


def read_edited_city(context, city, session):
    """Read a city as it is seen: EditedCity.

    Raises
    ------
    InputError
        Its own mesh was turned, or faces of objects were edited in it.
    """
    context.view_layer.update()
    seen, reshaped = list_seen(city), city.get(Key.EDITED) and session.scene is not None
    lineage = city_design.next_lineage(city) if reshaped else city.get(Key.LINEAGE, "")
    originals = set() if is_in_place(city) else city_design.originals_of(city, seen)
    read, content, taken = (
        {item: name for item, name in seen.items() if name not in originals},
        None,
        [],
    )
    if read or is_in_place(city):
        frame = None if is_in_place(city) else np.array(Matrix.Translation(-city.location))
        content, taken = read_meshes(
            "Objects of the city", list(read), context, named=read, frame=frame
        )
    return _EditedCity(
        None if is_in_place(city) else session.imported,
        city_design.describe_design(city, lineage),
        lineage,
        context.scene.citypv.orient,
        site_of(city),
        city_design.removed_of(city) - originals,
        content,
        taken + [(item.session_uid, name) for item, name in seen.items() if name in originals],
        _read_reshaped(city, session) if reshaped else None,
    )


def _read_reshaped(city, session):
    """Which polygons of the files were edited in the city's own mesh, and what they are now.

    Returns
    -------
    broken : set of str
        Ids of polygons that are not as before.
    content : FileContent
        The faces that they have now.

    Raises
    ------
    InputError
        The mesh was turned or has modifiers, or something else than a building of the files was
        edited.
    """
    # A mesh that was turned, scaled or has modifiers cannot be read back, and is refused.
    if not np.allclose(np.array(city.matrix_world.to_3x3()), np.eye(3)):
        raise InputError(city.name, "it was turned or scaled", "undo that, and edit its buildings")
    if own_modifiers(city):
        raise InputError(city.name, "its mesh has modifiers", "apply or remove them")
    # Triangles before and now are compared by surface and corners; what has no equal was edited.
    scene, mesh = session.scene, city.data
    ids, owner = scene.surfaces.surface_id, scene.surfaces.building_id
    own = scene.triangle_surface >= 0
    before = _key_triangles(scene.triangle_surface[own], scene.vertices[scene.triangles[own]])
    start, total = (
        attributes.read_array(mesh.polygons, name, dtype=np.int32)
        for name in ("loop_start", "loop_total")
    )
    points, surface = (
        attributes.read_array(mesh.vertices, "co", 3)[attributes.read_corners(mesh)],
        attributes.read_face_attribute(mesh, "surface"),
    )
    plain = np.flatnonzero(total == 3)
    now = _key_triangles(surface[plain], points[start[plain][:, None] + np.arange(3)])
    same = np.zeros(len(total), bool)
    same[plain] = np.isin(now, before)
    # They must be of the files; cells stand for the polygon that they are of.
    rows = np.union1d(surface[~same], scene.triangle_surface[own][~np.isin(before, now)])
    broken = {whole_of_cell(ids[row]) for row in rows.tolist()}
    others = sorted(broken - {*session.imported.surface_id})
    if others:
        raise InputError(
            city.name,
            f"{others[0]} was edited, which is not of its files",
            "undo that, edit the object",
        )
    # The faces that these polygons have now, each a polygon of its building.
    content, number = FileContent(city.name), {}
    parts = [row for row, name in enumerate(ids) if whole_of_cell(name) in broken]
    for face in np.flatnonzero(np.isin(surface, parts)):
        building = owner[surface[face]]
        place = number.setdefault(building, len(number))
        ring = points[start[face] : start[face] + total[face]].astype(float)
        name = f"{whole_of_cell(ids[surface[face]])}~{face}"
        content.polygons.append(
            Polygon(name, place, 0, "", ("",), "surface", [np.concatenate([ring, ring[:1]])])
        )
    content.buildings = list(number)
    return broken, content


def _key_triangles(surface, corners):
    """A key for each triangle, of its surface, (t,) int, and its corners, (t, 3, 3): (t,)
    of bytes.
    """
    corners = np.ascontiguousarray(corners, np.float32).reshape(len(corners), 9).view(np.int32)
    keys = np.column_stack([surface.astype(np.int32), corners])
    return np.ascontiguousarray(keys).view(np.dtype((np.void, keys.dtype.itemsize * 10))).ravel()
