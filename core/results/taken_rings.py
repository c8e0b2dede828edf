"""Parts of surfaces that are taken, as rings for transfer.nc, and back."""

import numpy as np
import shapely

from ..city.city import starts_of
from ..city.grid_cells import Outlines


def rings_of_parts(parts):
    """Parts, (n, k), as rings: Outlines of n·k shapes with corners (m, 2) in their planes.

    Outer rings run counter-clockwise; holes, which follow theirs, clockwise.
    """
    known = [place for place, part in enumerate(parts.flat) if part is not None]
    pieces, place = shapely.get_parts(parts.flat[known], return_index=True)
    areas = shapely.get_type_id(pieces) == shapely.GeometryType.POLYGON
    pieces, place = pieces[areas], place[areas]
    rings, piece = shapely.get_rings(
        shapely.orient_polygons(pieces, exterior_cw=False), return_index=True
    )
    places, ring = shapely.get_coordinates(rings, return_index=True)
    opened = np.append(ring[1:] == ring[:-1], False)[: len(ring)]  # without repeated first corners
    number = np.array(known, np.int64)[place[piece]]
    return Outlines(
        places[opened].astype(np.float32),
        starts_of(np.bincount(ring[opened], minlength=len(rings))).astype(np.int32),
        starts_of(np.bincount(number, minlength=parts.size)).astype(np.int32),
    )


def parts_of_rings(rings, columns):
    """Parts, (n, k) of shapely geometries or None, from `rings_of_parts`; `columns` is k."""
    count = len(rings.surface_start) - 1
    parts = np.full(count, None, object)
    for place in np.flatnonzero(np.diff(rings.surface_start)):
        polygons = []
        for corners in rings.rings(place):
            ring = shapely.linearrings(corners.astype(float))
            if shapely.is_ccw(ring):
                polygons.append((ring, []))
            else:
                polygons[-1][1].append(ring)
        parts[place] = shapely.union_all(
            [shapely.polygons(ring, holes or None) for ring, holes in polygons]
        )
    return parts.reshape(-1, columns)
