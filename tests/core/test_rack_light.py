"""Light on racks: long rows against pvlib's infinite sheds, what shades them and what they shade;
and their tables.
"""

import numpy as np
import pytest
from cities import box
from flat_roofs import rectangle, roof, rows_of, scene_with
from pvlib.bifacial import infinite_sheds
from scenes import run_gather, suns_towards
from thorough import mark_cases
from weathers import DATA

from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.counted_area import find_counted_area
from citypv.core.energy.pv_system import dc_system
from citypv.core.light.trace_gather import trace_gather
from citypv.core.patches.read_albedo import albedo_of_triangles
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.read_weather import read_weather


def trace(scene, weather, suns="days:24", **more):
    year = weather.data.index, weather.interval, scene.site.latitude, scene.site.longitude
    settings = {"far_ground": False, "max_bounces": 1, "samples": 128} | more
    return trace_gather(scene, choose_suns(suns, *year), Request(**settings), silent)


@pytest.fixture(scope="module")
def new_york():
    return read_weather(DATA / "USA_NY_New.York-CentralPark_TMY3.epw.gz", 40.78, -73.97)


def infinite_rows(weather, tilt, azimuth, pitch, *, height, albedo):
    """Front side of rows without end, black backs, one reflection from the ground: annual sum
    [kWh/m²].
    """
    data = weather.data
    ghi = data["dhi"] + data["dni"] * np.cos(np.radians(data["apparent_zenith"])).clip(lower=0)
    poa = infinite_sheds.get_irradiance_poa(
        *(
            tilt,
            azimuth,
            data["apparent_zenith"],
            data["solar_azimuth"],
            1.0 / pitch,
            height,
            pitch,
        ),
        *(ghi, data["dhi"], data["dni"], albedo),
        model="isotropic",
    )
    return poa["poa_global"].fillna(0).sum() / 1000


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tilt", "azimuth", "pitch"),
    mark_cases([(10, 180, 1.1), (30, 180, 1.6), (35, 150, 2.5), (20, 90, 1.3)], kept=1),
)
def test_a_long_row_between_others_is_one_of_infinite_sheds(new_york, tilt, azimuth, pitch):
    """pvlib's two-dimensional model (Mikofski et al. 2019, doi:10.1109/PVSC40753.2019.8980572), to
    1 %.
    """
    turn = np.radians(azimuth)
    across, along = np.array([np.sin(turn), np.cos(turn)]), np.array([np.cos(turn), -np.sin(turn)])
    corners = [
        60 * i * along + (4.5 * pitch + 0.6) * k * across
        for i, k in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    words = f"tilt={tilt},azimuth={azimuth},spacing={pitch},rim=0"
    scene = scene_with(words, roof(*map(tuple, corners)), latitude=40.78, longitude=-73.97)
    rows = rows_of(scene)
    assert len(rows) >= 9 and scene.surfaces.area[rows].max() == pytest.approx(120, rel=0.01)
    transfer = trace(scene, new_york, suns="hourly", albedo=0.25)
    found = compute_energy(transfer, new_york).poa_global_annual[rows]
    height = 0.1 + 0.5 * np.sin(np.radians(tilt))
    expected = infinite_rows(new_york, tilt, azimuth, pitch, height=height, albedo=0.25)
    assert found[len(rows) // 2] == pytest.approx(expected, rel=0.01)
    # A model without rows in front would not do.
    alone = infinite_rows(new_york, tilt, azimuth, 1000.0, height=height, albedo=0.25)
    assert abs(alone / expected - 1) > 0.012


@pytest.mark.slow
@pytest.mark.law
def test_narrow_rows_shade_each_other(new_york):
    hours = []
    for spacing in (1.05, 1.3, 2.0, 3.0):
        scene = scene_with(
            f"tilt=25,spacing={spacing}", rectangle(30, 20), latitude=40.78, longitude=-73.97
        )
        rows, energy = rows_of(scene), compute_energy(trace(scene, new_york), new_york)
        front_row, others = energy.full_load_hours[rows[0]], energy.full_load_hours[rows[1:]]
        assert (others < front_row * 1.001).all()  # nothing stands before the southernmost
        assert energy.eligible[rows].all() and energy.reason[0] == "racks"
        hours.append(others[:-1].mean() / front_row)
    assert (np.diff(hours) > 0.003).all() and hours[0] < 0.95 and hours[-1] > 0.99


def test_pairs_that_face_east_and_west_are_alike(new_york):
    """Under suns that stand as often in the east as in the west, mirrored rows get the
    same light.
    """
    scene = scene_with("east-west,tilt=15", rectangle(30.0, 20.0), latitude=40.78, longitude=-73.97)
    rows, surfaces = rows_of(scene), scene.surfaces
    east, west = rows[0::2], rows[1::2]
    np.testing.assert_allclose(surfaces.surface_azimuth[east], 90, atol=1e-3)
    np.testing.assert_allclose(surfaces.surface_azimuth[west], 270, atol=1e-3)
    np.testing.assert_allclose(surfaces.area[east], surfaces.area[west], rtol=1e-6)
    assert surfaces.orientation[rows].tolist() == ["east", "west"] * len(east)
    seen = scene.racks + np.array(scene.site.origin)
    # The easternmost pair stands as far from its rim as the westernmost from the other, and is its
    # mirror image.
    np.testing.assert_allclose(seen[..., 0].min() + seen[..., 0].max(), 30, atol=1e-5)
    elevation = np.radians(np.linspace(5, 85, 9))
    suns = np.array([(side * np.cos(h), 0, np.sin(h)) for h in elevation for side in (1, -1)])
    transfer = run_gather(
        scene, suns_towards(suns), far_ground=False, shadow_samples=256, samples=512
    )
    direct = transfer.visible_share @ np.ones(len(suns))
    np.testing.assert_allclose(direct[rows], direct[rows[::-1]], rtol=0.02)
    np.testing.assert_allclose(
        transfer.diffuse_relative[east], transfer.diffuse_relative[west[::-1]], rtol=0.01
    )


@pytest.mark.slow
def test_light_backs_send_light_to_the_row_behind(new_york):
    scenes = [
        scene_with(f"tilt=30,spacing=1.5,back-albedo={albedo}", rectangle(30, 20))
        for albedo in (0.0, 0.6)
    ]
    black, light = (trace(scene, new_york, max_bounces=3).diffuse_relative for scene in scenes)
    rows = rows_of(scenes[0])[1:]
    assert (light[rows] > black[rows] + 0.003).all()
    backs = scenes[1].rack_of_back >= 0
    albedo = albedo_of_triangles(scenes[1], Request())
    assert (
        set(albedo[backs]) == {0.6}
        and set(albedo[~backs]) == {0.25}
        and not scenes[1].closure.any()
    )


@pytest.mark.slow
def test_what_stands_beside_is_shaded_and_far_things_are_not(new_york):
    houses = [*box("a", 0, 0, 20, 12, 0, 9), *box("z", 300, 0, 10, 10, 0, 9)]
    plain, racked = (
        scene_with(words, houses, ground="auto") for words in (None, "tilt=10,area=200")
    )
    before, after = (trace(scene, new_york).diffuse_relative for scene in (plain, racked))
    assert len(before) == 12 and set(rows_of(racked)) == set(range(12, len(after)))
    np.testing.assert_allclose(after[[1, 2, 3, 4, 11]], before[[1, 2, 3, 4, 11]], rtol=0.01)
    # The roof between the rows sees what they leave of the sky: its light goes down, not to
    # nothing.
    assert 0.2 * before[5] < after[5] < 0.7 * before[5]
    assert trace(racked, new_york).covered_share[5] < 0.02


@pytest.mark.slow
def test_roofs_with_racks_count_once(new_york):
    houses = [*box("a", 0, 0, 20, 12, 0, 9), *box("z", 60, 0, 5, 2, 0, 9)]
    scene = scene_with("tilt=10", houses, ground="auto")
    counted = find_counted_area(trace(scene, new_york, "typical-days:2"), dc_system())
    rows = rows_of(scene)
    level = (counted.kind == "flat") & (counted.counted_area > 0)
    assert level.tolist() == [False] * 11 + [True] + [False] * len(rows)
    np.testing.assert_allclose(counted.module_area[rows], scene.surfaces.area[rows], rtol=1e-6)
    assert counted.module_area[5] == 0
