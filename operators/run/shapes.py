"""Digests of what is seen: places and shapes of objects, of a city's own mesh and of its ground."""

import hashlib

import numpy as np

from ..city.attributes import read_array, read_corners
from ..city.keys import Key
from ..city.source_objects import is_in_place
from ..show.colour_user_meshes import own_modifiers


def describe_object(city, item):
    """Digest of an object's place and shape: bytes. The place is relative to a city of files."""
    digest, matrix = hashlib.sha256(), np.array(item.matrix_world)
    if not is_in_place(city):
        matrix[:3, 3] -= np.array(city.location)
    digest.update(matrix.tobytes())
    digest.update(_describe_shape(city, item))
    for part in item.instance_collection.all_objects if item.instance_collection else ():
        digest.update(np.array(part.matrix_world).tobytes() + _describe_shape(city, part))
    return digest.digest()


def _describe_shape(city, item):
    """Mesh of an object beside a city after the user's modifiers, wherever it stands: bytes."""
    if item.type != "MESH":
        return b""
    if own_modifiers(item) and city.users_scene:
        item = item.evaluated_get(city.users_scene[0].view_layers[0].depsgraph)
    return read_array(item.data.vertices, "co", 3).tobytes() + read_corners(item.data).tobytes()


def describe_mesh(city):
    """Digest of a city's own mesh; it may be moved, but not turned: that is another city for the
    sun.
    """
    digest = hashlib.sha256()
    if not is_in_place(city):
        digest.update(np.array(city.matrix_world.to_3x3()).tobytes() + _describe_shape(city, city))
    return digest.hexdigest()


def describe_ground(city):
    """Digest of a city's ground as it lies below the city: str; "" without one in the scene: then
    no other is seen.
    """
    ground = city.get(Key.GROUND)
    if ground is None or not ground.users_scene:
        return ""
    place = np.array(ground.matrix_basis).round(4)
    return hashlib.sha256(place.tobytes() + _describe_shape(city, ground)).hexdigest()
