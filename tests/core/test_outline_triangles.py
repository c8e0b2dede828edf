"""Outlines from triangles are the polygons that were triangulated."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from cities import box, make_city

from citypv.core.city.outline_triangles import outline_triangles
from citypv.core.city.plan_geometry import join_triangles
from citypv.core.run.study import make_scene
from citypv.core.settings.request import Request

SIDE = 30.0
HOLES = [  # in a roof of 30 × 30 m: apart, and two that touch in a corner
    [[(8, 8), (8, 14), (14, 14), (14, 8)]],
    [[(5, 5), (5, 10), (10, 10), (10, 5)], [(10, 10), (10, 20), (20, 20), (20, 10)]],
]


@pytest.mark.parametrize("holes", HOLES)
@pytest.mark.parametrize("settings", [{}, {"racks": "tilt=10"}])
def test_rings_enclose_the_area_of_each_surface(holes, settings):
    """Whatever the patches: sums over rings, holes taken off, and racks by their corners."""
    parts = box("b0", 0, 0, SIDE, SIDE, 0, 9)
    building, thematic, (roof,) = parts[-1]
    parts[-1] = building, thematic, [roof, *([(*place, 9.0) for place in one] for one in holes)]
    parts += box("b1", 0, 40, 12, 8, 0, 15)
    scene = make_scene(make_city(parts), Request(latitude=50.0, longitude=8.0, **settings))
    outlines, surfaces = outline_triangles(scene), scene.surfaces
    assert len(outlines.surface_start) == len(surfaces) + 1
    for row in range(len(surfaces)):
        first, *others = (ring.astype(float) for ring in outlines.rings(row))
        vectors = [
            np.cross(ring - first[0], np.roll(ring, -1, axis=0) - first[0]).sum(axis=0) / 2
            for ring in (first, *others)
        ]
        # holes run the other way round, so that they are taken off
        assert sum(vectors) == pytest.approx(surfaces.area[row] * surfaces.normal[row], abs=0.05)
        assert len(others) == (0 if surfaces.surface_id[row] != "s5" else len(holes))
    (row,) = [k for k, name in enumerate(surfaces.surface_id) if name == "s5"]
    rings = [ring[:, :2].astype(float) for ring in outlines.rings(row)]
    assert shapely.Polygon(rings[0], rings[1:]).is_valid
    if settings:
        assert (
            np.diff(outlines.ring_start)[outlines.surface_start[:-1]][surfaces.kind == "rack"].max()
            == 4
        )


def test_a_surface_with_a_gap_takes_no_edges_of_another():
    """A sliver without one of its triangles has no ring; its neighbours keep theirs."""
    scene = make_scene(
        make_city(box("b0", 0, 0, 10, 8, 0, 9)), Request(latitude=50.0, longitude=8.0)
    )
    whole = outline_triangles(scene)
    # Of one wall a triangle is left, whose third edge lies on a sliver: two edges, no ring.
    row = int(np.flatnonzero(np.asarray(scene.surfaces.kind) == "facade")[0])
    own = np.flatnonzero(scene.triangle_surface == row)
    corner = scene.triangles[own[0]]
    bare = replace(
        scene,
        triangles=np.vstack([np.delete(scene.triangles, own[1:], axis=0), corner[[0, 2, 2]]]),
        triangle_surface=np.append(np.delete(scene.triangle_surface, own[1:]), row),
    )
    outlines = outline_triangles(bare)
    assert outlines.rings(row) == []
    for other in range(len(scene.surfaces)):
        if other != row:
            for one, ring in zip(whole.rings(other), outlines.rings(other), strict=True):
                assert {*map(tuple, one)} == {*map(tuple, ring)}


def test_cells_that_share_edges_in_part_are_joined_by_their_area():
    """8 + 1 m², by hand: GEOS takes no such pieces for a coverage."""
    whole = shapely.Polygon([(0, 0), (4, 0), (0, 4)])
    beside = shapely.Polygon([(0, 0), (1, -1), (2, 0)])
    with pytest.raises(shapely.errors.GEOSException):
        shapely.coverage_union_all([whole, beside, shapely.Polygon([(1, 0), (3, 0), (2, 1)])])
    (joined,) = join_triangles(np.array([whole, beside]), np.zeros(2, int))[1]
    assert joined.area == pytest.approx(9.0)
