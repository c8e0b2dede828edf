"""What Perez's sky makes of the full load hours, against pvlib's own sky and modules called
directly.
"""

import numpy as np
import pvlib
import pytest
from cities import box, make_city
from planes import DC, run_chain
from transfers import unshaded_transfer
from weathers import HOUR

from citypv.core.accuracy.measure_effects import share_of_sky
from citypv.core.city.build_scene import build_scene
from citypv.core.effects.beyond_scene import bound_change
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import build_system
from citypv.core.run.study import prepare_study, read_year, trace_scene
from citypv.core.settings.request import Request
from citypv.core.sky.sky_models import SkyParts
from citypv.core.sun.sun_sampling import choose_suns

TILT, AZIMUTH = [90, 90, 90, 30], [180, 90, 0, 180]
PLAIN = {"aoi": False, "spectrum": False, "temperature": False}


def hours_by_pvlib(weather, sky):
    """Full load hours of the planes at 25 °C without losses at the glass."""
    planes = zip(TILT, AZIMUTH, strict=True)
    return np.array(
        [run_chain(weather.data, *plane, sky=sky, without=PLAIN)[1].sum() for plane in planes]
    )


@pytest.mark.slow
def test_share_and_outcome_of_the_sky_are_those_of_pvlib(berlin):
    """The horizon of these unshaded planes was not traced: they see all of it."""
    transfer = unshaded_transfer(choose_suns("hourly", *berlin.axis), TILT, AZIMUTH)
    assert not transfer.sources
    area = np.where(transfer.surfaces.eligible, transfer.surfaces.area, 0)
    perez, even = (hours_by_pvlib(berlin, sky) for sky in ("perez", "isotropic"))
    system = build_system(Request(effects=PLAIN, **DC))
    share, largest = share_of_sky(transfer, berlin, system, 1)
    assert share == pytest.approx(area @ (perez - even) / (area @ perez), abs=2e-3)
    assert largest == pytest.approx(np.abs(1 - even / perez)[area > 0].max(), abs=5e-3)


def test_a_wall_without_sun_loses_all_but_the_dome_as_pvlib_has_it(berlin):
    """The bound of the isotropic sky: DHI over the dome's part of it, for unshaded planes that
    change less.
    """
    data = berlin.data
    zenith, sun_azimuth = data["apparent_zenith"], data["solar_azimuth"]
    extra = pvlib.irradiance.get_extra_radiation(data.index + HOUR / 2).to_numpy()
    airmass = pvlib.atmosphere.get_relative_airmass(zenith)
    sky = data["dhi"], data["dni"], extra, zenith, sun_azimuth, airmass
    parts = pvlib.irradiance.perez(0, 180, *sky, return_components=True)
    # spelled in two ways by its versions
    dome = next(parts[name] for name in parts if name.endswith("isotropic"))
    dome = np.where(airmass.notna() & (data["dhi"] > 0), dome, data["dhi"])
    expected = data["dhi"].sum() / dome.sum() - 1
    assert expected > 0.5
    assert bound_change(berlin, np.array([-0.2, 0.3])) == pytest.approx(expected, rel=1e-3)
    assert bound_change(berlin, np.array([-0.6, 0.3])) == pytest.approx(0.6 / 0.4)


@pytest.mark.slow
def test_a_dark_light_well_gains_no_more_from_an_isotropic_sky_than_its_bound():
    """Four walls of 40 m around 2 × 2 m; the wall to the north, which hardly sees the sun."""
    walls = [
        box("n", -1, 1, 2, 4, 0, 40),
        box("s", -1, -5, 2, 4, 0, 40),
        box("e", 1, -1, 4, 2, 0, 40),
    ]
    walls.append(box("w", -5, -1, 4, 2, 0, 40))
    scene = build_scene(make_city([polygon for wall in walls for polygon in wall]), 45.0, 10.0)
    inner = (scene.surfaces.orientation == "north") & (
        np.asarray(scene.surfaces.building_id) == "s"
    )
    scene.surfaces.eligible[:] = inner & (scene.surfaces.kind == "facade")
    settings = {
        "albedo": 0.0,
        "ground_albedo": 0.0,
        "suns": "days:12",
        "samples": 256,
        "threads": 1,
    }
    light = {}
    for sky in ("perez", "isotropic"):
        request = Request(sky=sky, weather="clear-sky", **settings)
        weather = read_year(scene.site, request)
        prepared = prepare_study(scene, weather, request)
        transfer = trace_scene(scene, weather, request, prepared=prepared)
        light[sky] = compute_energy(transfer, weather, threads=1, sky=sky).poa_global_annual[
            scene.surfaces.eligible
        ]
    gained = float(light["isotropic"][0] / light["perez"][0] - 1)
    assert 0.7 < gained <= prepared.plan["perez"].bound < 1.3


def test_rays_towards_a_source_follow_its_light():
    """A source with a tenth of the light of the dome gets an eighth of its rays: 8 · 0.1² of the
    variance.
    """
    dome = np.full(10, 100.0)
    for light, share in ((50.0, 4), (12.0, 4), (10.0, 8), (-10.0, 8), (5.0, 16), (0.1, 16)):
        assert (
            SkyParts(dome, 0 * dome, 0 * dome, {"horizon": 0 * dome + light}).rays_share() == share
        )
    assert SkyParts(0 * dome, 0 * dome, 0 * dome, {"horizon": dome}).rays_share() == 4
