"""Broken numbers into geometry, sun and energy: each door names the array, the place and the cure."""

import copy
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from closed import box
from scenes import join, strip, suns_towards
from scipy.spatial import Delaunay
from towns import city_of_polygons, draw_town

from citypv.core.city.triangulate import triangulate
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import build_system
from citypv.core.errors import InputError
from citypv.core.ground.build_ground import build_ground
from citypv.core.ground.build_terrain import build_terrain
from citypv.core.ground.find_feet import find_feet
from citypv.core.ground.terrain import Layer, Terrain, measure_heights
from citypv.core.light.sun_sampling_error import trace_sun_samples
from citypv.core.light.trace_gather import trace_gather
from citypv.core.progress import silent
from citypv.core.request import Request
from citypv.core.scene.build_scene import build_scene
from citypv.core.scene.classify import classify, measure_tilt
from citypv.core.scene.grid_cells import split_into_cells
from citypv.core.scene.refine import refine_triangles
from citypv.core.sun.choose_suns import choose_suns
from citypv.core.sun.match_suns import match_suns
from citypv.core.sun.solar_position import solar_position, sun_direction
from citypv.core.weather.add_sun import add_sun
from citypv.core.weather.clear_sky import clear_sky

NUMBERS = [np.nan, np.inf, -np.inf, 1e38, -1e300, 1e10]
HOUR = pd.Timedelta(hours=1)
UTM = np.array([390_000, 5_818_000, 30.0])
CURES = ["ask", "check", "complete", "give", "leave", "let", "look", "see", "take", "trace", "use"]
TOWN = city_of_polygons(*draw_town(2, tiles=1))
PLACES = np.stack(np.meshgrid(*[np.linspace(-100, 200, 4)] * 2), axis=-1).reshape(-1, 2)
TERRAIN = Terrain("hill.asc", [Layer(np.column_stack([PLACES, np.zeros(16)]), Delaunay(PLACES).simplices)])


def spoiled(values, place, number):
    values = np.array(values, float)
    values[place] = number
    return values


def refused(words, door, *arguments, **settings):
    """An error of one line that ends with a cure."""
    with pytest.raises(InputError, match=words) as caught:
        door(*arguments, **settings)
    assert str(caught.value).count("\n") == 0
    assert caught.value.cure.split()[0] in CURES


# Geometry


@pytest.mark.parametrize("number", NUMBERS)
def test_a_city_with_a_broken_coordinate(number):
    city = replace(TOWN, points=spoiled(TOWN.points, (5, 1), number))
    for door in (lambda one: build_scene(one, 52, 13), lambda one: split_into_cells(one, 5.0)):
        refused("points: point 5, of surface 's1', is", door, city)
    refused("points: point 5 is", triangulate, city.points, city.ring_start, city.polygon_start)


def test_a_city_whose_parts_do_not_fit():
    starts = TOWN.ring_start
    for words, parts in (
        (r"points: shape \(100, 2\)", {"points": TOWN.points[:, :2]}),
        ("points: values of type object", {"points": np.full((100, 3), None)}),
        ("ring_start: runs from 0 to 96", {"ring_start": starts[:-1]}),
        ("ring_start: runs from 1", {"ring_start": starts + 1}),
        ("ring_start: row 1 has -1 members", {"ring_start": np.r_[0, 5, starts[2:-1] - 4, 100]}),
        ("ring_start: values of type float64", {"ring_start": starts.astype(float)}),
        ("polygon_start: row 2 has 0 members", {"polygon_start": np.r_[0, 1, 2, 2, np.arange(4, 26)]}),
        ("polygon_start: 25 rows for 25 surfaces", {"polygon_start": TOWN.polygon_start[1:]}),
        ("thematic: 24 rows for 25 surfaces", {"thematic": TOWN.thematic[1:]}),
        ("building_id: 0 rows for 25 surfaces", {"building_id": []}),
    ):
        refused(words, build_scene, replace(TOWN, **parts), 52, 13)
        refused(words, split_into_cells, replace(TOWN, **parts), 5.0)
    nothing = city_of_polygons([np.zeros((0, 3))])
    nothing.surface_id, nothing.building_id, nothing.thematic = [], [], []
    refused("city: contains no polygons", build_scene, nothing, 52, 13)


def test_settings_of_a_scene():
    for words, settings in (
        ("--patch-size: 0 is not", {"patch_size": 0}),
        ("--patch-size: -1 is not", {"patch_size": -1}),
        ("--patch-size: nan is not", {"patch_size": np.nan}),
        ("--patch-size: 0.0001 m gives about", {"patch_size": 1e-4}),
        ("--grid-size: nan is not", {"grid_size": np.nan}),
        ("--grid-size: 0.001 m gives", {"grid_size": 1e-3}),
        ("--ground: 'moon' is unknown", {"ground": "moon"}),
        ("--latitude: nan", {"latitude": np.nan}),
        ("--longitude: inf", {"longitude": np.inf}),
    ):
        refused(words, build_scene, TOWN, **{"latitude": 52, "longitude": 13} | settings)


def test_one_building_that_stands_elsewhere_by_mistake():
    """At 0, 0, while the others have UTM coordinates: this asked for 30 GB, or made float32 noise of all others."""
    points = TOWN.points + UTM
    points[:24] -= UTM
    refused("5,818 km wide; surface 's[0-5]' is", build_scene, replace(TOWN, points=points), 52, 13)
    points = TOWN.points + UTM
    points[1] = 0  # one corner only
    refused("5,818 km wide; surface 's0' is", build_scene, replace(TOWN, points=points), 52, 13)


def test_pieces_of_geometry():
    one = np.ones(3)
    refused("area: row 1 is nan", classify, spoiled(one, 1, np.nan), one, one, [""] * 3)
    refused(r"area: shape \(2,\)", classify, one[:2], one, one, [""] * 3)
    refused("surface_tilt: row 0 is 190", classify, one, spoiled(one, 0, 190), one, [""] * 3)
    refused("surface_azimuth: row 0 is -5", classify, one, one, spoiled(one, 0, -5), [""] * 3)
    refused(r"normal: row 0 is \[nan", measure_tilt, np.full((2, 3), np.nan))
    refused(r"normal: shape \(3,\)", measure_tilt, one)
    vertices, triangles = np.array([[0, 0, 0], [30, 0, 0], [0, 30, 0.0]]), np.array([[0, 1, 2]])
    for number in NUMBERS:
        refused("vertices: vertex 1 is", refine_triangles, spoiled(vertices, (1, 0), number), triangles, 10.0)
    refused("triangles: triangle 0 is", refine_triangles, vertices, triangles + 1, 10.0)
    refused("vertices: shape", refine_triangles, vertices[:, :2], triangles, 10.0)
    refused("--patch-size: -1", refine_triangles, vertices, triangles, -1)
    refused("--patch-size: 0.001 m gives about", refine_triangles, vertices, triangles, 1e-3)
    assert len(refine_triangles(np.zeros((0, 3)), np.zeros((0, 3), int), 1.0)[1]) == 0
    assert len(triangulate(np.zeros((0, 3)), np.zeros(1, int), np.zeros(1, int))[0]) == 0


def test_ground_and_terrain():
    scene = build_scene(TOWN, 52, 13, ground="none", patch_size=None)
    footprint = np.array(TOWN.thematic) == "GroundSurface"
    feet = find_feet(TOWN, TOWN.points, scene.surfaces, footprint)
    for number in NUMBERS:
        broken = spoiled(TOWN.points, (5, 1), number)
        refused("points: point 5 is", build_ground, TOWN, broken, scene.surfaces, footprint)
        refused("points: point 5 is", build_terrain, feet, broken, TERRAIN)
        high = Terrain(
            "hill.asc", [Layer(spoiled(TERRAIN.layers[0].points, (5, 2), number), TERRAIN.layers[0].triangles)]
        )
        refused("hill.asc: vertices: vertex 5 is .* leave a gap", build_scene, TOWN, 52, 13, terrain=high)
        lost = replace(feet, start=spoiled(feet.start, (0, 0), number))
        refused("start of the feet: row 0 is", build_terrain, lost, TOWN.points, TERRAIN)
    refused("footprint: shape", build_ground, TOWN, TOWN.points, scene.surfaces, footprint[1:])
    refused("footprint: values", build_ground, TOWN, TOWN.points, scene.surfaces, footprint.astype(float))
    refused("--patch-size: -10", build_ground, TOWN, TOWN.points, scene.surfaces, footprint, -10.0)
    refused("--patch-size: nan", build_terrain, feet, TOWN.points, TERRAIN, np.nan)
    for layers in ([], [Layer(np.zeros((0, 3)), np.zeros((0, 3), int))]):
        refused("hill.asc: contains no triangles", build_scene, TOWN, 52, 13, terrain=Terrain("hill.asc", layers))
    beyond = Terrain("hill.asc", [Layer(TERRAIN.layers[0].points, TERRAIN.layers[0].triangles + 5)])
    refused("hill.asc: triangles: triangle . is", build_scene, TOWN, 52, 13, terrain=beyond)
    refused(r"places: shape \(3, 3\)", measure_heights, TERRAIN, np.zeros((3, 3)))
    refused("places: row 2 is", measure_heights, TERRAIN, spoiled(np.zeros((3, 2)), (2, 0), np.nan))
    assert measure_heights(TERRAIN, np.zeros((0, 2))).shape == (0,)


# Sun

TIMES = pd.date_range("2021-06-01", "2021-06-05", freq="h", inclusive="left", tz="UTC")


@pytest.mark.parametrize(("latitude", "longitude"), [(np.nan, 13), (91, 13), (None, 13), (52, np.inf), (52, 361)])
def test_places_off_the_earth(latitude, longitude):
    name = "latitude" if longitude == 13 else "longitude"
    suns = choose_suns("hourly", TIMES, HOUR, 52, 13)
    refused(f"--{name}: ", solar_position, TIMES, HOUR, latitude, longitude)
    refused(f"--{name}: ", match_suns, suns, TIMES, HOUR, latitude, longitude)
    for way in ("hourly", "days:2", "typical-days:2", "sky-grid:64"):
        refused(f"--{name}: ", choose_suns, way, TIMES, HOUR, latitude, longitude)


def test_broken_times():
    for times, words in ((TIMES.insert(2, pd.NaT), "row 2 is not a time"), ([1, 2], "times: a list")):
        refused(words, solar_position, times, HOUR, 52, 13)
        refused(words, choose_suns, "hourly", times, HOUR, 52, 13)
    with pytest.raises(TypeError, match="no time zone; see"):
        choose_suns("hourly", TIMES.tz_localize(None), HOUR, 52, 13)
    for interval in (pd.Timedelta(0), -HOUR, pd.Timedelta(days=2), 3600, pd.NaT):
        refused("interval: ", choose_suns, "hourly", TIMES, interval, 52, 13)
    nothing = TIMES[:0]
    assert len(choose_suns("hourly", nothing, HOUR, 52, 13)) == len(solar_position(nothing, HOUR, 52, 13)) == 0
    refused("1 days of 0 days", choose_suns, "days:1", nothing, HOUR, 52, 13)
    refused("1 typical days of 0 days", choose_suns, "typical-days:1", nothing, HOUR, 52, 13)


def test_broken_choices():
    for way in (None, "", "moon", "typical-days", "typical-days:0", "sky-grid:3", "sky-grid:99999999999", "hourly:2"):
        refused("--suns: ", choose_suns, way, TIMES, HOUR, 52, 13)
    for seed in (-1, 2**32, 1.5, np.nan, None):
        refused("--seed: ", choose_suns, "typical-days:2", TIMES, HOUR, 52, 13, seed)


def test_broken_suns_to_match():
    suns = choose_suns("hourly", TIMES, HOUR, 52, 13)
    for number in NUMBERS:
        broken = replace(suns, direction=spoiled(suns.direction, (3, 1), number))
        refused("direction of the suns: row 3 is", match_suns, broken, TIMES, HOUR, 52, 13)
    refused("the way 'moon' is unknown", match_suns, replace(suns, way="moon"), TIMES, HOUR, 52, 13)
    few = {name: getattr(suns, name)[:0] for name in ("direction", "weight", "day", "step")}
    refused("suns: none was traced", match_suns, replace(suns, **few), TIMES, HOUR, 52, 13)
    grid = choose_suns("sky-grid:64", TIMES, HOUR, 52, 13)
    few = {name: getattr(grid, name)[:3] for name in few}
    refused("3 directions of sky-grid:64", match_suns, replace(grid, **few), TIMES, HOUR, 52, 13)
    refused("apparent_zenith: row 0 is nan", sun_direction, [np.nan], [0.0])
    refused(r"solar_azimuth: shape \(3,\)", sun_direction, [1.0, 2.0], [0.0, 1.0, 2.0])


# Energy

HOUSE = join([strip([-20, -20, 0], [40, 0, 0], [0, 40, 0], 2), *box((-5, -5, 0), (5, 5, 10))])
WEATHER = add_sun(clear_sky(52.5, 13.4, 40.0, 2021), HOUR)
SUNS = suns_towards(np.array([[0.3, -0.8, 0.6], [-0.5, 0.6, 0.4], [0, 0, 1], [0.9, 0.1, 0.15], [0.2, 0.2, 0.9]]))
TRANSFER = trace_gather(HOUSE, SUNS, Request(samples=16, shadow_samples=1), silent)


@pytest.mark.parametrize("number", NUMBERS)
def test_a_broken_transfer(number):
    for name in ("covered_share", "sky_view_factor", "far_ground_view_factor", "diffuse_relative"):
        broken = replace(TRANSFER, **{name: spoiled(getattr(TRANSFER, name), 3, number)})
        refused(f"{name}: row 3 is", compute_energy, broken, WEATHER)
    for name in ("visible_share", "direct_reflected"):
        broken = replace(TRANSFER, **{name: spoiled(getattr(TRANSFER, name), (3, 4), number)})
        refused(f"{name}: row 3 holds .* in column 4", compute_energy, broken, WEATHER)
    for name in ("diffuse_relative_standard_error", "direct_annual_standard_error"):
        broken = replace(TRANSFER, **{name: spoiled(getattr(TRANSFER, name), 3, number)})
        if np.isnan(number):  # unknown, which is no fault
            assert np.isnan(compute_energy(broken, WEATHER).full_load_hours_standard_error[3:4]).all()
        else:
            refused(f"{name}: row 3 is", compute_energy, broken, WEATHER)
    for name in ("area", "normal"):
        broken = copy.deepcopy(TRANSFER)
        getattr(broken.surfaces, name)[3] = number
        refused(f"{name}: row 3 is", compute_energy, broken, WEATHER)
    refused("ground_albedo: ", compute_energy, replace(TRANSFER, ground_albedo=number), WEATHER)


def test_a_transfer_whose_parts_do_not_fit():
    for name in ("visible_share", "direct_reflected"):
        refused(f"{name}: shape", compute_energy, replace(TRANSFER, **{name: TRANSFER.visible_share[:, 1:]}), WEATHER)
        refused(f"{name}: shape", compute_energy, replace(TRANSFER, **{name: TRANSFER.visible_share[1:]}), WEATHER)
    refused("covered_share: values", compute_energy, replace(TRANSFER, covered_share=np.full(16, "x")), WEATHER)
    fewer = replace(TRANSFER, surfaces=replace(TRANSFER.surfaces, kind=TRANSFER.surfaces.kind[1:]))
    refused("kind: shape", compute_energy, fewer, WEATHER)


@pytest.mark.parametrize("number", NUMBERS)
def test_a_broken_weather(number):
    for name in ("ghi", "dni", "dhi", "temp_air", "wind_speed", "pressure", "apparent_zenith", "solar_azimuth"):
        data = WEATHER.data.copy()
        data.iloc[4000, data.columns.get_loc(name)] = number
        refused(f"{name} of the weather: hour 4000 is", compute_energy, TRANSFER, replace(WEATHER, data=data))


def test_a_weather_that_lacks_something():
    refused("no column dni", compute_energy, TRANSFER, replace(WEATHER, data=WEATHER.data.drop(columns="dni")))
    refused("it has no hours", compute_energy, TRANSFER, replace(WEATHER, data=WEATHER.data.iloc[:0]))
    refused("interval: ", compute_energy, TRANSFER, replace(WEATHER, interval=pd.Timedelta(0)))
    refused("--latitude", compute_energy, TRANSFER, replace(WEATHER, latitude=np.nan))
    refused("--module", build_system, Request(module="no such module"))


# The pilot


def test_a_pilot_with_nothing_to_look_at():
    """No surface is eligible: two empty Transfers, not an error inside numpy."""
    surfaces = replace(HOUSE.surfaces, eligible=np.zeros(16, bool))
    scene, transfer = replace(HOUSE, surfaces=surfaces), replace(TRANSFER, surfaces=surfaces)
    for one in trace_sun_samples(scene, transfer, [SUNS, SUNS], Request(), silent):
        assert len(one.surfaces) == 0
        assert one.visible_share.shape == (0, 5)
        assert len(compute_energy(one, WEATHER).full_load_hours) == 0


def test_a_broken_pilot():
    pilot = [HOUSE, TRANSFER, [SUNS], Request(), silent]
    refused("shadow-samples", trace_sun_samples, *pilot[:3], Request(shadow_samples=0), silent)
    for number in NUMBERS:
        broken = replace(SUNS, direction=spoiled(SUNS.direction, (1, 1), number))
        refused("direction of the suns: row 1 is", trace_sun_samples, *pilot[:2], [SUNS, broken], *pilot[3:])
    other = trace_sun_samples(*pilot)[0]
    refused("transfer: [0-9]+ surfaces for a scene of 16", trace_sun_samples, HOUSE, other, *pilot[2:])
