"""Outlines of the surfaces of a scene from their triangles: edges that two triangles of a surface
share lie inside; what is left are its rings.
"""

import numpy as np

from .grid_cells import Outlines
from .racks import RACK


def outline_triangles(scene):
    """Outlines of all surfaces of a Scene, in its frame, whatever the scene was made from.

    The largest ring of a surface is the first; corners where triangles were cut stay in the rings.
    Racks have their four corners. Triangles without area, which edits leave, are passed over.

    Parameters
    ----------
    scene : Scene
        Whose triangles have no corner on the edge of another one of the same surface.

    Returns
    -------
    Outlines
    """
    # Corners at the same place are one; edges run as the triangle does.
    place, corner = np.unique(scene.vertices, axis=0, return_inverse=True)
    racks = np.asarray(scene.surfaces.kind) == RACK
    # The last one: triangles of no surface.
    own = np.flatnonzero(np.append(~racks, False)[scene.triangle_surface])
    begin = corner.ravel()[scene.triangles[own]]
    end = np.roll(begin, -1, axis=1)
    surface = np.broadcast_to(scene.triangle_surface[own].astype(np.int64)[:, None], begin.shape)
    surface, begin, end = (part[begin != end] for part in (surface, begin, end))
    # Edges that no other triangle of the surface runs along in the opposite direction.
    count = len(place)
    there, back = (surface * count + begin) * count + end, (surface * count + end) * count + begin
    outer = np.flatnonzero(~np.isin(there, back))
    outer = outer[np.argsort(there[outer])]
    surface, begin, end = surface[outer], begin[outer], end[outer]
    # From each edge on to the one that begins where it ends, until the ring is closed; slivers
    # whose triangles are gone have edges that none follows (-1). What does not close, or has fewer
    # than three edges, is dropped.
    start, stop = surface * count + begin, surface * count + end
    after = np.searchsorted(start, stop)
    follows = np.append(start, -1)[after] == stop
    after = np.where(follows, after, -1).tolist()
    ring, left = [], np.ones(len(after), bool).tolist()
    for first in range(len(after)):
        members, edge = [], first
        while edge >= 0 and left[edge]:
            left[edge] = False
            members.append(edge)
            edge = after[edge]
            # Where rings touch, the other edge that begins there goes on.
            edge += not left[edge] and edge + 1 < len(after) and start[edge + 1] == start[edge]
        ring += [members] if edge >= 0 and len(members) > 2 else []
    of_ring = [surface[members[0]] for members in ring] + np.flatnonzero(racks).tolist()
    ring = [begin[members] for members in ring]
    points = place.astype(np.float32)
    if racks.any():
        ring += list(count + np.arange(4 * racks.sum()).reshape(-1, 4))
        points = np.concatenate([points, scene.racks.reshape(-1, 3).astype(np.float32)])
    # Rings by surface, the one around the largest box first.
    size = [-np.prod(1 + np.ptp(points[corners], axis=0)) for corners in ring]
    order = np.lexsort((size, of_ring))
    length = np.array([len(ring[k]) for k in order], int)
    bounds = np.searchsorted(np.array(of_ring, int)[order], np.arange(len(scene.surfaces) + 1))
    corners = np.concatenate([np.empty(0, int), *(ring[k] for k in order)])
    return Outlines(
        points[corners], np.append(0, np.cumsum(length)).astype(np.int32), bounds.astype(np.int32)
    )
