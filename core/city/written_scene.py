"""The scene of a city after edits, as it is written: in the order of the city, without what is
gone.

Edits leave triangles and surfaces their numbers. Triangles that are gone have no area, and no
surface of the city.
"""

from dataclasses import replace

import numpy as np

from .racks import RACK


def owner_of_triangles(scene):
    """Surface that each triangle is a part of, the back of, or the underside of: (t,) int; -1:
    ground.
    """
    owner = np.array(scene.triangle_surface)
    if scene.back_of is not None:
        owner = np.where(scene.back_of >= 0, owner[scene.back_of], owner)
    if scene.rack_of_back is not None:
        owner = np.where(scene.rack_of_back >= 0, scene.rack_of_back, owner)
    return owner


def remove_triangles(scene, gone):
    """The scene with some triangles without area: all of their corners are their first one."""
    triangles = scene.triangles.copy()
    triangles[gone] = triangles[gone, :1]
    return replace(scene, triangles=triangles)


def live_triangles(scene, rows):
    """Triangles that are not gone, by their surface in the order of some rows, those without one
    last: (k,) int.
    """
    number = np.full(len(scene.surfaces) + 1, len(rows))
    number[rows] = np.arange(len(rows))
    a, b, c = scene.triangles.T
    kept = np.flatnonzero((a != b) & (b != c))
    return kept[np.argsort(number[scene.triangle_surface[kept]], kind="stable")]


def written_scene(scene, rows):
    """The scene with its surfaces in the order in which they are written, without what is gone:
    Scene.

    Parameters
    ----------
    scene : Scene
        With the backs of its sheets.
    rows : (k,) int
        Of `SceneChange`.
    """
    # A scene in this order already is returned as it is.
    if len(rows) == len(scene.surfaces) and (rows == np.arange(len(rows))).all():
        return scene
    # New numbers of the surfaces that stay (-1: gone), and of their triangles.
    number = np.full(len(scene.surfaces) + 1, -1, np.int32)
    number[rows] = np.arange(len(rows))
    own, kept = number[scene.triangle_surface], live_triangles(scene, rows)
    place = np.full(len(scene.triangles) + 1, -1, np.int32)
    place[kept] = np.arange(len(kept))
    # What is kept of each triangle, and references between triangles and to surfaces renumbered.
    taken = {"footprint": scene.footprint[kept], "closure": scene.closure[kept]}
    taken |= {"sheet": None if scene.sheet is None else scene.sheet[kept]}
    taken |= {"back_of": None if scene.back_of is None else place[scene.back_of[kept]]}
    taken |= {
        "rack_of_back": None if scene.rack_of_back is None else number[scene.rack_of_back[kept]]
    }
    # Fronts of racks are stored by rack: racks that stay keep theirs, in their new order.
    racks = np.asarray(scene.surfaces.kind) == RACK
    fronts = None if scene.racks is None else scene.racks[(np.cumsum(racks) - 1)[rows[racks[rows]]]]
    # Corners of what is gone go too: else they would add up over the edits of edits.
    used, corners = np.unique(scene.triangles[kept], return_inverse=True)
    return replace(
        scene,
        vertices=scene.vertices[used],
        triangles=corners.reshape(-1, 3).astype(scene.triangles.dtype),
        triangle_surface=own[kept],
        surfaces=scene.surfaces.take(rows),
        racks=fronts,
        **taken,
    )
