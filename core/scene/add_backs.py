"""Backs of sheets: each triangle of a sheet gets a second one for its back, which receives and reflects light."""

from dataclasses import replace

import numpy as np


def add_backs(scene):
    """The scene with a reversed triangle appended for each triangle of a sheet.

    These belong to no row of the tables; `back_of` has the triangle whose back each is. Rays do not hit them: they hit
    the sheet, from one side or the other.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    Scene
        The same object if there are no sheets.
    """
    if scene.sheet is None or not scene.sheet.any() or scene.back_of is not None:
        return scene
    rows = np.flatnonzero(scene.sheet)
    count, nothing, racks = len(scene.triangles), np.zeros(len(rows), bool), scene.rack_of_back
    return replace(
        scene,
        triangles=np.concatenate([scene.triangles, scene.triangles[rows][:, [0, 2, 1]]]),
        triangle_surface=np.concatenate([scene.triangle_surface, np.full(len(rows), -1, np.int32)]),
        footprint=np.concatenate([scene.footprint, nothing]),
        closure=np.concatenate([scene.closure, nothing]),
        sheet=np.concatenate([scene.sheet, nothing]),
        back_of=np.concatenate([np.full(count, -1, np.int32), rows.astype(np.int32)]),
        rack_of_back=None if racks is None else np.concatenate([racks, np.full(len(rows), -1, np.int32)]),
    )


def surface_of_triangles(scene):
    """Surface that each triangle is a part of, or the back of: (t,) int, -1 on generated ground."""
    surface = scene.triangle_surface
    if scene.back_of is not None:
        surface = np.where(scene.back_of >= 0, surface[scene.back_of], surface)
    if scene.rack_of_back is not None:
        surface = np.where(scene.rack_of_back >= 0, scene.rack_of_back, surface)
    return surface


def other_sides(scene):
    """The triangle on the other side of each triangle of a sheet: (t,) int32, -1 for all others."""
    other = np.full(len(scene.triangles), -1, np.int32)
    if scene.back_of is not None:
        backs = np.flatnonzero(scene.back_of >= 0)
        other[backs] = scene.back_of[backs]
        other[scene.back_of[backs]] = backs
    return other
