"""The number of reflections, against a closed form and against runs that follow 30."""

from dataclasses import replace

import numpy as np
import pytest
from radiosity import bowl
from scenes import run_gather, suns_towards
from small_city import house, write_gml, write_small_city

from citypv.core.effects.rays import GROUP_LIMIT, MOST_BOUNCES, WHOLE_LIMIT, count_surely
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.settings.request import Request
from citypv.core.study import read_scene, read_year, trace_scene

CHEAP = {"suns": "days:4", "samples": 64, "shadow_samples": 4, "threads": 1}
MANY = 30


def write_city(path, name):
    """Three houses, or a street of 10 m between two rows of 60 m that run east."""
    if name == "houses":
        return write_small_city(path)
    rows = [house(row, (0, north), (60, 12, 18), ridge=0.01) for row, north in (("a", 0), ("b", 22))]
    return write_gml(path, *rows)


def light_of_groups(transfer, weather):
    """Irradiation of each kind and orientation that counts: (g,)."""
    surfaces, energy = transfer.surfaces, compute_energy(transfer, weather, threads=1, sky="perez")
    names, counts = np.char.add(surfaces.kind, surfaces.orientation), np.asarray(surfaces.eligible, bool)
    light = surfaces.area * np.nan_to_num(energy.poa_global_annual)
    return np.array([light[counts & (names == name)].sum() for name in np.unique(names[counts])])


@pytest.mark.once
@pytest.mark.parametrize(("city", "albedo"), [("houses", 0.6), ("street", 0.1), ("street", 0.25)])
def test_no_group_loses_more_in_clear_and_overcast_years(tmp_path, city, albedo):
    """Beside a run with the same rays and many reflections."""
    light = {"albedo": albedo, "ground_albedo": albedo, "weather": "clear-sky", **CHEAP}
    scene = read_scene([write_city(tmp_path / "city.gml", city)], Request(**light))
    clear = read_year(scene.site, Request(**light))
    few, many = (trace_scene(scene, clear, Request(**light, max_bounces=count)) for count in (None, MANY))
    (effect,) = (one for one in few.record.effects if one["key"] == "reflections")
    assert effect["outcome"]["holds"] and effect["outcome"]["left_out"] <= WHOLE_LIMIT
    below = 0.25 * clear.data["ghi"]  # what a closed cover of clouds lets through (Kasten, Czeplak 1980)
    overcast = replace(clear, data=clear.data.assign(ghi=below, dni=0.0, dhi=below))
    for weather in (clear, overcast):
        found, known = (light_of_groups(one, weather) for one in (few, many))
        assert 0 < (1 - found / known).max() <= GROUP_LIMIT
        assert 0 < 1 - found.sum() / known.sum() <= WHOLE_LIMIT


@pytest.mark.parametrize("albedo", [0.2, 0.4, 0.6, 0.8])
def test_in_a_half_sphere_the_number_is_that_of_a_geometric_series(albedo):
    """E_n = 1/2 (albedo/2)^n everywhere under the sky, so (albedo/2)^(n+1) of the light lies beyond n reflections."""
    settings = {"albedo": albedo, "far_ground": False, "samples": 256, "shadow_samples": 16}
    transfer = run_gather(bowl(), suns_towards([[0, 0, 1]]), threads=1, **settings)
    assert transfer.record.max_bounces == next(n for n in range(1, 30) if (albedo / 2) ** (n + 1) <= WHOLE_LIMIT)
    (effect,) = (one for one in transfer.record.effects if one["key"] == "reflections")
    expected = (albedo / 2) ** (transfer.record.max_bounces + 1)
    assert effect["outcome"]["left_out"] == pytest.approx(expected, rel=0.1)
    area = transfer.surfaces.area
    found = area @ transfer.diffuse_relative / area.sum()  # facets are a little flatter than the sphere
    assert found == pytest.approx(0.5 / (1 - albedo / 2) * (1 - expected), rel=0.02)


def test_by_albedo_alone_where_no_solver_tells():
    """Photons are followed until ρⁿ⁺¹/(1 - ρ), the most that any scene reflects beyond, is below 0.2 %."""
    assert [count_surely(albedo) for albedo in (0.1, 0.25, 0.6)] == [2, 4, 13]
    assert count_surely(1.0) == MOST_BOUNCES
