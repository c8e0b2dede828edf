"""The part of a flat roof where racks may stand: away from its rim, its holes, and whatever rises above it."""

import numpy as np
import shapely

RISE = 0.1  # [m] above the roof: less is inaccuracy of the data


def free_area(rings, frame, rim, obstacles):
    """Free area of a roof in its own plane.

    Parameters
    ----------
    rings : list of array, (k, 3) float64 [m]
        The outline first.
    frame : RoofFrame
    rim : float [m]
    obstacles : Obstacles

    Returns
    -------
    shapely geometry
        In the first two axes of the frame [m].
    """
    flat = [((ring - frame.origin) @ frame.axes.T)[:, :2] for ring in rings]
    roof = shapely.make_valid(shapely.Polygon(flat[0], flat[1:]))
    free = shapely.buffer(roof, -rim, join_style="mitre")
    low, high = rings[0].min(axis=0)[:2] - rim, rings[0].max(axis=0)[:2] + rim
    risen = obstacles.above(frame, low, high)
    return shapely.difference(free, shapely.union_all(shapely.buffer(risen, rim))) if len(risen) else free


class Obstacles:
    """Triangles of a scene, to be asked what rises above a roof.

    Parameters
    ----------
    corners : array, (t, 3, 3) float64 [m]
    """

    def __init__(self, corners):
        self.corners = corners
        low, high = corners.min(axis=1), corners.max(axis=1)
        self.top = high[:, 2]
        self.tree = shapely.STRtree(shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1]))

    def above(self, frame, low, high):
        """Outlines of what rises above a roof's plane, in its frame.

        Each triangle is cut off at `RISE` above the plane; the rest is seen straight from above.

        Parameters
        ----------
        frame : RoofFrame
        low, high : array, (2,) float [m]
            Corners of the place that counts, seen from above.

        Returns
        -------
        array of shapely geometries
            Walls are lines.
        """
        near = self.tree.query(shapely.box(*low, *high))
        corners = self.corners[near]  # (n, 3, 3)
        normal = frame.axes[2]
        height = (corners - frame.origin) @ normal / normal[2]  # (n, 3) [m] straight above the plane
        rises = height.max(axis=1, initial=-np.inf) > RISE
        corners, height = corners[rises], height[rises]
        following = np.roll(corners, -1, axis=1), np.roll(height, -1, axis=1)
        # Corners above the cut, and where edges pass through it; other places repeat one that is above.
        highest = np.take_along_axis(corners, height.argmax(axis=1)[:, None, None], axis=1)
        above = np.where(height[..., None] > RISE, corners, highest)
        passes = (height > RISE) != (following[1] > RISE)
        share = np.divide(RISE - height, following[1] - height, out=np.zeros_like(height), where=passes)
        cuts = np.where(passes[..., None], corners + share[..., None] * (following[0] - corners), highest)
        places = np.concatenate([above, cuts], axis=1)  # (n, 6, 3)
        depth = (places - frame.origin) @ normal / normal[2]
        places = places - frame.origin
        places[..., 2] -= depth
        flat = places @ frame.axes[:2].T
        return shapely.convex_hull(shapely.multipoints(flat)) if len(flat) else np.empty(0, object)
