"""Broken numbers into geometry, sun and energy: each door names the array, the place and
the cure.
"""

import copy
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from broken import COUNT, HOUSE, NUMBERS, SUNS, refused, spoiled
from scenes import run_gather
from scipy.spatial import Delaunay
from towns import city_of_polygons, draw_town

from citypv.core.city.build_ground import PlacedCity, build_ground
from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.city.build_terrain import build_terrain
from citypv.core.city.classify import classify, measure_tilt
from citypv.core.city.find_feet import find_feet
from citypv.core.city.grid_cells import split_into_cells
from citypv.core.city.locate_site import AS_IN_FILES
from citypv.core.city.polygons import triangulate
from citypv.core.city.split_edges import refine_triangles
from citypv.core.city.terrain import Layer, Terrain, measure_heights
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import build_system
from citypv.core.light.sun_sampling_error import trace_sun_samples
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sun.solar_position import solar_position, sun_direction
from citypv.core.sun.sun_sampling import choose_suns, match_suns
from citypv.core.weather.add_sun import add_sun
from citypv.core.weather.climate import clear_sky

pytestmark = pytest.mark.every_python

HOUR = pd.Timedelta(hours=1)
BERLIN = (52, 13)
UTM = np.array([390_000, 5_818_000, 30.0])
TOWN = city_of_polygons(*draw_town(2, tiles=1))
PLACES = np.stack(np.meshgrid(*[np.linspace(-100, 200, 4)] * 2), axis=-1).reshape(-1, 2)
LAYER = Layer(np.column_stack([PLACES, np.zeros(16)]), Delaunay(PLACES).simplices)
TERRAIN = Terrain("hill.asc", [LAYER])
WEATHER = add_sun(clear_sky(52.5, 13.4, 40.0, 2021), HOUR)
TRANSFER = run_gather(HOUSE, SUNS, samples=16, shadow_samples=1)


# Geometry


@pytest.mark.parametrize("number", NUMBERS)
def test_a_city_with_a_broken_coordinate(number):
    city = replace(TOWN, points=spoiled(TOWN.points, (5, 1), number))
    refused("points: point 5, of surface 's1', is", build_scene, city, *BERLIN)
    refused("points: point 5, of surface 's1', is", split_into_cells, city, 5.0)
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
        (
            "polygon_start: row 2 has 0 members",
            {"polygon_start": np.r_[0, 1, 2, 2, np.arange(4, 26)]},
        ),
        ("polygon_start: 25 rows for 25 surfaces", {"polygon_start": TOWN.polygon_start[1:]}),
        ("thematic: 24 rows for 25 surfaces", {"thematic": TOWN.thematic[1:]}),
        ("building_id: 0 rows for 25 surfaces", {"building_id": []}),
    ):
        refused(words, build_scene, replace(TOWN, **parts), *BERLIN)
    nothing = city_of_polygons([np.zeros((0, 3))])
    nothing.surface_id, nothing.building_id, nothing.thematic = [], [], []
    refused("city: contains no polygons", build_scene, nothing, *BERLIN)


def test_settings_of_a_scene():
    for words, settings in (
        ("--patch-size: 0 is not", {"patch_size": 0}),
        ("--patch-size: nan is not", {"patch_size": np.nan}),
        ("--patch-size: 0.0001 m gives about", {"patch_size": 1e-4}),
        ("--grid-size: nan is not", {"options": SceneOptions(grid_size=np.nan)}),
        ("--grid-size: 0.001 m gives", {"options": SceneOptions(grid_size=1e-3)}),
        ("--ground: 'moon' is unknown", {"ground": "moon"}),
        ("--latitude: nan", {"latitude": np.nan}),
        ("--longitude: inf", {"longitude": np.inf}),
    ):
        refused(words, build_scene, TOWN, **{"latitude": 52, "longitude": 13} | settings)


def test_one_building_that_stands_elsewhere_by_mistake():
    """At 0, 0, while the others have UTM coordinates: this asked for 30 GB, or made float32 noise
    of all others.
    """
    points = TOWN.points + UTM
    points[:24] -= UTM
    refused(
        "5,818 km wide; surface 's[0-5]' is", build_scene, replace(TOWN, points=points), *BERLIN
    )
    points = TOWN.points + UTM
    points[1] = 0  # one corner only
    refused("5,818 km wide; surface 's0' is", build_scene, replace(TOWN, points=points), *BERLIN)


def test_a_city_that_is_too_small_to_be_one():
    """A kilometre in units of 10 km, say: the sun's light came out as NaN."""
    across = np.ptp(TOWN.points, axis=0).max()
    points = TOWN.points * 0.099 / across
    refused("only 99 mm across; check --unit", build_scene, replace(TOWN, points=points), *BERLIN)
    assert (
        len(build_scene(replace(TOWN, points=points * 1.02), *BERLIN, patch_size=None).surfaces)
        == 25
    )


def test_pieces_of_geometry():
    one, names = np.ones(3), [""] * 3
    refused("area: row 1 is nan", classify, spoiled(one, 1, np.nan), one, one, names)
    refused("surface_tilt: row 0 is 190", classify, one, spoiled(one, 0, 190), one, names)
    refused("surface_azimuth: row 0 is -5", classify, one, one, spoiled(one, 0, -5), names)
    refused(r"normal: row 0 is \[nan", measure_tilt, np.full((2, 3), np.nan))
    vertices, triangles = np.array([[0, 0, 0], [30, 0, 0], [0, 30, 0.0]]), np.array([[0, 1, 2]])
    refused(
        "vertices: vertex 1 is",
        refine_triangles,
        spoiled(vertices, (1, 0), np.inf),
        triangles,
        10.0,
    )
    refused("triangles: triangle 0 is", refine_triangles, vertices, triangles + 1, 10.0)
    refused("vertices: shape", refine_triangles, vertices[:, :2], triangles, 10.0)
    refused("--patch-size: -1", refine_triangles, vertices, triangles, -1)
    assert len(refine_triangles(np.zeros((0, 3)), np.zeros((0, 3), int), 1.0)[1]) == 0
    assert len(triangulate(np.zeros((0, 3)), np.zeros(1, int), np.zeros(1, int))[0]) == 0


def test_ground_and_terrain():
    scene = build_scene(TOWN, *BERLIN, ground="none", patch_size=None)
    footprint = np.array(TOWN.thematic) == "GroundSurface"
    placed = PlacedCity(TOWN, TOWN.points, scene.surfaces, footprint, AS_IN_FILES)
    feet = find_feet(TOWN, TOWN.points, scene.surfaces, footprint)

    def stand_on(*layers):
        return build_scene(
            TOWN, *BERLIN, options=SceneOptions(terrain=Terrain("hill.asc", [*layers]))
        )

    for number in NUMBERS:
        broken = spoiled(TOWN.points, (5, 1), number)
        refused("points: point 5 is", build_ground, placed._replace(points=broken))
        refused("points: point 5 is", build_terrain, feet, broken, TERRAIN)
        high = replace(LAYER, points=spoiled(LAYER.points, (5, 2), number))
        refused("hill.asc: vertices: vertex 5 is .* leave a gap", stand_on, high)
        lost = replace(feet, start=spoiled(feet.start, (0, 0), number))
        refused("start of the feet: row 0 is", build_terrain, lost, TOWN.points, TERRAIN)
    refused("footprint: shape", build_ground, placed._replace(footprint=footprint[1:]))
    refused("footprint: values", build_ground, placed._replace(footprint=footprint.astype(float)))
    refused("--patch-size: -10", build_ground, placed, -10.0)
    refused("--patch-size: nan", build_terrain, feet, TOWN.points, TERRAIN, np.nan)
    for layers in ([], [Layer(np.zeros((0, 3)), np.zeros((0, 3), int))]):
        refused("hill.asc: contains no triangles", stand_on, *layers)
    beyond = replace(LAYER, triangles=LAYER.triangles + 5)
    refused("hill.asc: triangles: triangle . is", stand_on, beyond)
    refused("places: row 2 is", measure_heights, TERRAIN, spoiled(np.zeros((3, 2)), (2, 0), np.nan))
    assert measure_heights(TERRAIN, np.zeros((0, 2))).shape == (0,)


# Sun

TIMES = pd.date_range("2021-06-01", "2021-06-05", freq="h", inclusive="left", tz="UTC")


@pytest.mark.parametrize(
    ("latitude", "longitude"), [(np.nan, 13), (91, 13), (None, 13), (52, np.inf), (52, 361)]
)
def test_places_off_the_earth(latitude, longitude):
    name = "latitude" if longitude == 13 else "longitude"
    suns = choose_suns("hourly", TIMES, HOUR, *BERLIN)
    refused(f"--{name}: ", solar_position, TIMES, HOUR, latitude, longitude)
    refused(f"--{name}: ", match_suns, suns, TIMES, HOUR, latitude, longitude)
    refused(f"--{name}: ", choose_suns, "typical-days:2", TIMES, HOUR, latitude, longitude)


def test_broken_times_and_choices():
    for times, words in (
        (TIMES.insert(2, pd.NaT), "row 2 is not a time"),
        ([1, 2], "times: a list"),
    ):
        refused(words, solar_position, times, HOUR, *BERLIN)
        refused(words, choose_suns, "hourly", times, HOUR, *BERLIN)
    for interval in (pd.Timedelta(0), -HOUR, pd.Timedelta(days=2), 3600, pd.NaT):
        refused("interval: ", choose_suns, "hourly", TIMES, interval, *BERLIN)
    nothing = TIMES[:0]
    assert (
        len(choose_suns("hourly", nothing, HOUR, *BERLIN))
        == len(solar_position(nothing, HOUR, *BERLIN))
        == 0
    )
    refused("1 days of 0 days", choose_suns, "days:1", nothing, HOUR, *BERLIN)
    refused("--suns: ", choose_suns, None, TIMES, HOUR, *BERLIN)


def test_broken_suns_to_match():
    suns, year = choose_suns("hourly", TIMES, HOUR, *BERLIN), (TIMES, HOUR, *BERLIN)
    for number in NUMBERS:
        broken = replace(suns, direction=spoiled(suns.direction, (3, 1), number))
        refused("direction of the suns: row 3 is", match_suns, broken, *year)
    refused("the sampling 'moon' is unknown", match_suns, replace(suns, sampling="moon"), *year)
    for words, one, count in (
        ("suns: none was traced", suns, 0),
        ("3 directions of sky-grid:64", choose_suns("sky-grid:64", *year), 3),
    ):
        few = {name: getattr(one, name)[:count] for name in ("direction", "weight", "day", "step")}
        refused(words, match_suns, replace(one, **few), *year)
    refused("apparent_zenith: row 0 is nan", sun_direction, [np.nan], [0.0])
    refused(r"solar_azimuth: shape \(3,\)", sun_direction, [1.0, 2.0], [0.0, 1.0, 2.0])


# Energy

SINGLE = ("covered_share", "sky_view_factor", "far_ground_view_factor", "diffuse_relative")
ERRORS = ("diffuse_relative_standard_error", "direct_annual_standard_error")


@pytest.mark.parametrize("number", NUMBERS)
def test_a_broken_transfer(number):
    def broken(name, place):
        return replace(TRANSFER, **{name: spoiled(getattr(TRANSFER, name), place, number)})

    for name in (*SINGLE, *ERRORS):
        if name in SINGLE or not np.isnan(number):
            refused(f"{name}: row 3 is", compute_energy, broken(name, 3), WEATHER)
        else:  # unknown, which is no fault
            assert np.isnan(
                compute_energy(broken(name, 3), WEATHER).full_load_hours_standard_error[3:4]
            ).all()
    for name in ("visible_share", "direct_reflected"):
        refused(
            f"{name}: row 3 holds .* in column 4", compute_energy, broken(name, (3, 4)), WEATHER
        )
    for name in ("area", "normal"):
        other = copy.deepcopy(TRANSFER)
        getattr(other.surfaces, name)[3] = number
        refused(f"{name}: row 3 is", compute_energy, other, WEATHER)
    refused("ground_albedo: ", compute_energy, replace(TRANSFER, ground_albedo=number), WEATHER)


def test_a_transfer_whose_parts_do_not_fit():
    share, surfaces = TRANSFER.visible_share, TRANSFER.surfaces
    for words, parts in (
        ("visible_share: shape", {"visible_share": share[:, 1:]}),
        ("direct_reflected: shape", {"direct_reflected": share[1:]}),
        ("covered_share: values", {"covered_share": np.full(COUNT, "x")}),
        ("kind: shape", {"surfaces": replace(surfaces, kind=surfaces.kind[1:])}),
    ):
        refused(words, compute_energy, replace(TRANSFER, **parts), WEATHER)


def test_a_broken_weather():
    columns = (
        "ghi",
        "dni",
        "dhi",
        "temp_air",
        "wind_speed",
        "pressure",
        "apparent_zenith",
        "solar_azimuth",
    )
    for place, name in enumerate(columns):
        for number in (np.nan, NUMBERS[place % 5 + 1]):
            data = WEATHER.data.copy()
            data.iloc[4000, data.columns.get_loc(name)] = number
            refused(
                f"{name} of the weather: hour 4000 is",
                compute_energy,
                TRANSFER,
                replace(WEATHER, data=data),
            )
    refused(
        "no column dni",
        compute_energy,
        TRANSFER,
        replace(WEATHER, data=WEATHER.data.drop(columns="dni")),
    )
    refused(
        "it has no hours", compute_energy, TRANSFER, replace(WEATHER, data=WEATHER.data.iloc[:0])
    )
    refused("interval: ", compute_energy, TRANSFER, replace(WEATHER, interval=pd.Timedelta(0)))
    refused("--latitude", compute_energy, TRANSFER, replace(WEATHER, latitude=np.nan))
    refused("--module", build_system, Request(module="no such module"))


# The suns that errors are measured with


def test_no_surface_to_measure_errors_on():
    """No surface is eligible: two empty Transfers, not an error inside numpy."""
    surfaces = replace(HOUSE.surfaces, eligible=np.zeros(COUNT, bool))
    scene, transfer = replace(HOUSE, surfaces=surfaces), replace(TRANSFER, surfaces=surfaces)
    for one in trace_sun_samples(scene, transfer, [SUNS, SUNS], Request(), silent):
        assert len(one.surfaces) == 0
        assert one.visible_share.shape == (0, 5)
        assert len(compute_energy(one, WEATHER).full_load_hours) == 0


def test_broken_suns_to_measure_errors_with():
    broken = replace(SUNS, direction=spoiled(SUNS.direction, (1, 1), np.nan))
    few = Request(shadow_samples=0)
    refused("shadow-samples", trace_sun_samples, HOUSE, TRANSFER, [SUNS], few, silent)
    refused(
        "direction of the suns: row 1 is",
        trace_sun_samples,
        HOUSE,
        TRANSFER,
        [SUNS, broken],
        Request(),
        silent,
    )
    other = trace_sun_samples(HOUSE, TRANSFER, [SUNS], Request(), silent)[0]
    refused(
        "transfer: [0-9]+ surfaces for a scene of 16",
        trace_sun_samples,
        HOUSE,
        other,
        [SUNS],
        Request(),
        silent,
    )
