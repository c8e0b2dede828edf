"""Write arrays of core to face attributes of Blender meshes, and read them back."""

import numpy as np

from ..core.errors import InputError
from .attributes import CODES, PREFIX, QUANTITIES, VIEWS

_TYPES = {"INT": np.int32, "FLOAT": np.float32}


def write_face_attribute(mesh, name, values):
    """Write one number per face as the attribute `citypv_` + name.

    Parameters
    ----------
    mesh : bpy.types.Mesh
        A mesh of f faces.
    name : str
        Name without the prefix.
    values : (f,) array of int or float
        Integers become an INT, floats a FLOAT attribute of the domain FACE.
    """
    values = np.asarray(values)
    data_type = "INT" if values.dtype.kind in "iu" else "FLOAT"
    attribute = mesh.attributes.get(PREFIX + name)
    if attribute is not None and (attribute.data_type, attribute.domain) != (data_type, "FACE"):
        mesh.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = mesh.attributes.new(PREFIX + name, data_type, "FACE")
    attribute.data.foreach_set("value", np.ascontiguousarray(values, dtype=_TYPES[data_type]))


def read_face_attribute(mesh, name):
    """Read the attribute `citypv_` + name: (f,) int32 or float32, or None if the mesh has no such attribute."""
    attribute = mesh.attributes.get(PREFIX + name)
    if attribute is None:
        return None
    values = np.empty(len(mesh.polygons), dtype=_TYPES[attribute.data_type])
    attribute.data.foreach_get("value", values)
    return values


def write_classes(city, ground, surfaces):
    """Write kind and orientation as codes to the city's faces, and the code tables to the objects.

    Parameters
    ----------
    city, ground : bpy.types.Object or None
        Objects as `build_meshes` makes them; the ground may be None.
    surfaces : core.scene.scene.Surfaces
        n surfaces.
    """
    faces = _faces_of_surfaces(city, len(surfaces))
    for name, codes in CODES.items():
        write_face_attribute(city.data, name, encode(getattr(surfaces, name), codes)[faces])
    if ground is not None:
        count = len(ground.data.polygons)
        write_face_attribute(ground.data, "kind", np.full(count, CODES["kind"]["ground"]))
        write_face_attribute(ground.data, "orientation", np.full(count, CODES["orientation"]["none"]))
    for item in filter(None, (city, ground)):
        item[PREFIX + "kind_codes"] = CODES["kind"]
        item[PREFIX + "orientation_codes"] = CODES["orientation"]


def write_results(city, ground, transfer, energy=None):
    """Write results per surface to the faces; generated ground gets NaN.

    Parameters
    ----------
    city, ground : bpy.types.Object or None
        Objects as `build_meshes` makes them; the ground may be None.
    transfer : core.light.transfer.Transfer
        Results of n surfaces.
    energy : core.energy.energy.Energy, optional
        Results of the same surfaces; without it, attributes of an earlier energy are removed.
    """
    faces = _faces_of_surfaces(city, len(transfer.surfaces))
    carriers = {"transfer": transfer, "energy": energy}
    for quantity in QUANTITIES:
        if carriers[quantity.owner] is None:
            remove_face_attribute(city, quantity.name)
            remove_face_attribute(ground, quantity.name)
            continue
        values = np.asarray(getattr(carriers[quantity.owner], quantity.name), dtype=np.float64)
        write_face_attribute(city.data, quantity.name, values[faces])
        if ground is not None:
            write_face_attribute(ground.data, quantity.name, np.full(len(ground.data.polygons), np.nan))
    for view in VIEWS if energy is None else ():
        remove_face_attribute(city, view.name)
        remove_face_attribute(ground, view.name)


def write_surface_values(city, ground, name, values):
    """Write one number per surface, (n,), to the faces as the attribute `citypv_` + name; generated ground gets NaN."""
    values = np.asarray(values, dtype=np.float64)
    write_face_attribute(city.data, name, values[_faces_of_surfaces(city, len(values))])
    if ground is not None:
        write_face_attribute(ground.data, name, np.full(len(ground.data.polygons), np.nan))


def remove_face_attribute(item, name):
    """Remove the attribute `citypv_` + name from an object's mesh, if present."""
    attribute = item.data.attributes.get(PREFIX + name) if item is not None else None
    if attribute is not None:
        item.data.attributes.remove(attribute)


def encode(words, codes):
    """Integer codes of an array of strings: (n,) str → (n,) int32."""
    unique, inverse = np.unique(np.asarray(words), return_inverse=True)
    return np.array([codes[word] for word in unique.tolist()], dtype=np.int32)[inverse]


def _faces_of_surfaces(city, count):
    # Every face stores its surface; an edited mesh may have too few or too many.
    faces = read_face_attribute(city.data, "surface")
    if faces is None or len(faces) == 0 or faces.min() < 0 or faces.max() >= count:
        raise InputError(city.name, "its faces do not match the surfaces that were traced", "classify the city again")
    return faces
