"""The scene of an edited city, made of the one before, is that of the edited city alone."""

from dataclasses import replace

import numpy as np
import pytest
from cities import box, make_city

from citypv.core.city import lay_ground
from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.city.edit_city import Change, edit_city

SAME = ("triangle_surface", "footprint", "closure", "sheet", "drawn", "floating")


def town(side=20, seed=5):
    """Pairs of houses with a party wall, and a carport beside some, no two of which stand alike."""
    generator, parts = np.random.default_rng(seed), []
    for k in range(side * side):
        x, y = 34.0 * np.array(divmod(k, side)) + generator.uniform(0, 8, 2)
        wide, deep, low, high = generator.uniform([7, 8, 4, 6], [12, 16, 8, 30])
        parts += [*box(f"a{k}", x, y, wide, deep, 0, low), *box(f"b{k}", x + wide, y, wide, deep, 0, high)]
        if k % 3 == 0:
            z = generator.uniform(2.2, 3)
            roof = [(x, y - 6, z), (x + 5, y - 6, z), (x + 5, y - 2, z), (x, y - 2, z)]
            parts.append((f"a{k}", "RoofSurface", [roof]))
    return make_city(parts)


CITY = town()
NEW = make_city(box("tower", 357.3, 344.9, 6.1, 7.3, 0, 55))
EDITS = {
    "nothing": Change(),
    "added": Change(added=(NEW,)),
    "removed": Change(removed=["a190"]),
    "moved": Change(moved={"b211": (3.2, -2.9)}),
    "raised": Change(raised={"a228": 7.5}),
    "at the rim": Change(removed=["a3", "b3"]),
    "at both ends": Change(removed=["a14"], raised={"b371": 9.0}),
}


NEAR = ("nothing", "added", "removed", "moved", "raised")


@pytest.fixture(scope="module")
def before():
    return build_scene(CITY, 52.0, 13.0)


@pytest.mark.parametrize("name", EDITS)
def test_the_scene_of_an_edit_is_that_of_the_city_alone(before, name, monkeypatch):
    city, place = edit_city(CITY, EDITS[name]), SceneOptions(site=before.site, lattice=before.lattice)
    alone = build_scene(city, options=place)
    if name in NEAR:  # else the ground is laid anew as a whole
        monkeypatch.setattr(lay_ground, "build_ground", lambda *_, **__: pytest.fail("all ground was generated"))
    found = build_scene(city, options=replace(place, before=before))
    assert np.array_equal(found.vertices[found.triangles], alone.vertices[alone.triangles])
    for field in SAME:
        assert np.array_equal(getattr(found, field), getattr(alone, field)), field
    for field, values in vars(alone.surfaces).items():
        assert np.array_equal(getattr(found.surfaces, field), values), field
    assert vars(found.report) == vars(alone.report)
