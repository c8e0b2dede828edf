"""Which way the faces of a real city face: Manhattan, with the rays of the tests' own tracer."""

from functools import cache

import numpy as np
import pytest
from own_rays import BACK, SKY, OwnRays
from test_orientation import DATA, turned

from citypv.core.city import assemble_city
from citypv.core.city.build_scene import build_scene
from citypv.core.city.polygons import measure_polygons
from citypv.core.read.read_city import read_city


@cache
def manhattan():
    """Loose triangles of Manhattan as drawn, which of them are turned, and what they see from both sides."""
    name = DATA / "obj" / "nyc_midtown_citicorp_1km.obj.gz"
    drawn, city = read_city([name], orient="as-drawn"), read_city([name])
    chosen = np.array(turned(city))
    proposed = np.array(turned_by_volume(name))
    rows = np.union1d(chosen, proposed)
    scene = build_scene(drawn, 40.757, -73.97, ground="none", patch_size=None)
    assert (scene.triangle_surface == np.arange(len(drawn))).all()  # a polygon is a triangle
    own = OwnRays(scene, np.full(len(drawn), 2e-3))
    front = own.shares(rows, 32, 32, np.random.default_rng(3)).mean(axis=1)
    own.normal = -own.normal
    back = own.shares(rows, 32, 32, np.random.default_rng(4)).mean(axis=1)
    return rows, chosen, front, back, measure_polygons(drawn.points, drawn.ring_start, drawn.polygon_start)[0][rows]


def turned_by_volume(name):
    """What the signed volume of shells alone would turn."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assemble_city, "judge_turning", lambda shape, found, allowed: 2 * (found.flip & allowed,))
        return turned(read_city([name]))


@pytest.mark.slow
def test_no_lit_face_of_manhattan_is_turned_to_the_dark():
    """By another caster: what the volumes propose turns 51 triangles away from the sky, 1,180 m²; the rays turn none,
    and keep two thirds of those that are rightly turned."""
    rows, chosen, front, back, area = manhattan()
    gain = back[:, SKY] - front[:, SKY]
    done = np.isin(rows, chosen)
    assert (gain < -0.02).sum() > 40
    assert area[gain < -0.02].sum() > 1000
    assert not (done & (gain < -0.02)).any()
    assert (done & (gain > 0.02)).sum() > 60
    # Seen from the back as drawn, what is turned is no inside: there it sees the sky or what others see.
    assert area[done & (gain > 0.02)].sum() > 900
    assert not (done & (front[:, SKY] > 0.125) & (front[:, BACK] < 0.5)).any()
