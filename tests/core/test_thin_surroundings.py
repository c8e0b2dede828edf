"""Tiles with few patches around them: which stand for which, and the light that is left."""

from types import SimpleNamespace

import numpy as np
import pytest
from small_city import house, write_gml

from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.rays.random_numbers import mix
from citypv.core.run.study import read_scene, read_year, trace_scene
from citypv.core.run.thin_surroundings import draw_members, thin_surroundings
from citypv.core.run.tiles import assign_tiles, box_pieces, prepare_whole, surround, take_part
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns

SIDE, STEP, TILE = 9, 28.0, 40.0
REQUEST = Request(weather="clear-sky", threads=1, samples=256, shadow_samples=16, max_bounces=3)


@pytest.fixture(scope="module")
def tile(tmp_path_factory):
    """The tile in the middle of a town of houses of 16 to 23 m, in a scene of its own and as part
    of the whole.
    """
    places = [(column, row) for column in range(SIDE) for row in range(SIDE)]
    houses = [
        house(
            f"h{x}_{y}",
            (STEP * x + (y % 3), STEP * y + (x % 4)),
            (14, 12, 16 + (5 * x + 3 * y) % 8),
            ridge=3.0,
        )
        for x, y in places
    ]
    scene = read_scene([write_gml(tmp_path_factory.mktemp("town") / "town.gml", *houses)], REQUEST)
    weather = read_year(scene.site, REQUEST)
    suns = choose_suns("days:4", *weather.axis, position=weather.data)
    whole = prepare_whole(scene)
    pieces, squares = box_pieces(whole), dict(assign_tiles(whole, TILE))
    rows = squares["002_002"]
    tile = surround("", rows, pieces, REQUEST.ground_albedo)
    cut, known, _ = take_part(whole, pieces, tile)
    prepared = prepare_scene(cut, REQUEST, suns=suns).build_tree(REQUEST)
    own = np.searchsorted(known, rows)
    return SimpleNamespace(
        whole=scene, weather=weather, suns=suns, rows=rows, cut=cut, own=own, prepared=prepared
    )


def test_a_patch_is_drawn_as_often_as_it_is_met():
    """Of three patches met 0, 1 and 3 times; of two that no ray met, by area. Binomial errors."""
    clusters = 4_000
    cluster = np.repeat(np.arange(2 * clusters), 3)
    met = np.concatenate([np.tile([0, 1, 3], clusters), np.zeros(3 * clusters, int)])
    key = mix(np.arange(6 * clusters, dtype=np.uint64))
    patches = SimpleNamespace(key=key, area=np.tile([0.0, 1.0, 2.0], 2 * clusters))
    drawn = draw_members(cluster, met, patches)
    assert np.array_equal(cluster[drawn], np.arange(2 * clusters))
    for members, share in ((drawn[:clusters], 3 / 4), (drawn[clusters:], 2 / 3)):
        last = np.mean(members % 3 == 2)
        assert not (members % 3 == 0).any()
        assert last == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / clusters))


@pytest.mark.slow
def test_light_is_that_of_all_patches(tile):
    """What blocks rays is exact; light from neighbours differs by less than the standard error of a
    surface.
    """
    few = thin_surroundings(tile.cut, tile.prepared, tile.own)
    assert len(few.prepared.patches) < 0.4 * len(tile.prepared.patches)
    found = trace_scene(few.scene, tile.weather, REQUEST, silent, prepared=few.prepared)
    expected = trace_scene(tile.cut, tile.weather, REQUEST, silent, prepared=tile.prepared)
    own = np.searchsorted(few.surfaces, tile.own)
    assert found.surfaces.surface_id[own[0]] == tile.whole.surfaces.surface_id[tile.rows[0]]
    for name in ("visible_share", "sky_view_factor", "covered_share"):
        np.testing.assert_array_equal(getattr(found, name)[own], getattr(expected, name)[tile.own])
    area = np.where(found.surfaces.eligible[own], found.surfaces.area[own], 0.0)
    traced = (found, own), (expected, tile.own)
    one, other = (result.direct_reflected[rows] @ tile.suns.weight for result, rows in traced)
    assert area @ one == pytest.approx(area @ other, rel=5e-3)
    one, other = found.diffuse_relative[own], expected.diffuse_relative[tile.own]
    assert area @ one == pytest.approx(area @ other, rel=1e-3)
    assert (
        np.mean(
            np.abs(one - other)[area > 0] <= found.diffuse_relative_standard_error[own][area > 0]
        )
        > 0.95
    )
