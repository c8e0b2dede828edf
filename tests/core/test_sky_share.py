"""What Perez's sky makes of the full load hours, against pvlib's own sky and modules called directly."""

import numpy as np
import pvlib
import pytest
from transfers import unshaded_transfer
from weathers import ERA5

from citypv.core.energy.pv_system import build_system
from citypv.core.request import Request
from citypv.core.results.share_of_sky import share_of_sky, state_sky
from citypv.core.sky.light_sources import choose_share
from citypv.core.sky.sky_models import SkyParts
from citypv.core.sun.choose_suns import choose_suns
from citypv.core.weather.read_weather import read_weather

MODULE = "SunPower_SPR_300_WHT__2007__E__"
TILT, AZIMUTH = [90, 90, 90, 30], [180, 90, 0, 180]
PLAIN = {"aoi": False, "spectrum": False, "temperature": False}


@pytest.fixture(scope="module")
def berlin():
    weather = read_weather(ERA5, 52.51, 13.39)
    suns = choose_suns("hourly", weather.data.index, weather.interval, weather.latitude, weather.longitude)
    return weather, unshaded_transfer(suns, TILT, AZIMUTH)


def power_by_pvlib(weather, tilt, azimuth, sky):
    """Full load hours of an unshaded plane at 25 °C without losses at the glass, from pvlib."""
    data, module = weather.data, pvlib.pvsystem.retrieve_sam("SandiaMod")[MODULE]
    zenith, sun_azimuth = data["apparent_zenith"], data["solar_azimuth"]
    direct = pvlib.irradiance.beam_component(tilt, azimuth, zenith, sun_azimuth, data["dni"])
    extra = pvlib.irradiance.get_extra_radiation(data.index + weather.interval / 2).to_numpy()
    airmass = pvlib.atmosphere.get_relative_airmass(zenith)
    even = pvlib.irradiance.isotropic(tilt, data["dhi"])
    uneven = pvlib.irradiance.perez(tilt, azimuth, data["dhi"], data["dni"], extra, zenith, sun_azimuth, airmass)
    diffuse = even if sky == "isotropic" else np.where(airmass.notna() & (data["dhi"] > 0), uneven, even)
    horizontal = data["dhi"] + data["dni"] * np.maximum(np.cos(np.radians(zenith)), 0)
    light = direct + diffuse + pvlib.irradiance.get_ground_diffuse(tilt, horizontal, 0.25)
    power = pvlib.pvsystem.sapm(light, 25.0 + 0 * light, module)["p_mp"]
    return power.fillna(0).sum() / (module["Impo"] * module["Vmpo"])


def test_share_and_outcome_of_the_sky_are_those_of_pvlib(berlin):
    """The horizon of these unshaded planes was not traced: they see all of it."""
    weather, transfer = berlin
    assert not transfer.sources
    area = np.where(transfer.surfaces.eligible, transfer.surfaces.area, 0)
    planes = list(zip(TILT, AZIMUTH, strict=True))
    perez, even = (
        np.array([power_by_pvlib(weather, *plane, sky) for plane in planes]) for sky in ("perez", "isotropic")
    )
    system = build_system(Request(effects=PLAIN))
    share, largest = share_of_sky(transfer, weather, system, 1)
    assert share == pytest.approx(area @ (perez - even) / (area @ perez), abs=2e-3)
    assert largest == pytest.approx(np.abs(1 - even / perez)[area > 0].max(), abs=5e-3)

    # Left out, the bound is compared with what it would have changed; simulated, nothing is left out.
    plan = {"key": "perez", "on": False, "extent": "isotropic sky", "reason": "as asked", "bound": 0.2}
    summary = {"traced": {"effects": [dict(plan), {"key": "aoi", "on": True}]}}
    state_sky(summary, transfer, weather, system, sky="isotropic", threads=1)
    assert summary["traced"]["effects"][0]["outcome"] == {"left_out": largest, "holds": True}
    state_sky(summary, transfer, weather, system, sky="perez", threads=1)
    again = summary["traced"]["effects"][0]
    assert again["on"] and again["outcome"]["left_out"] == 0 and again["share"] == share
    assert summary["traced"]["effects"][1] == {"key": "aoi", "on": True}


def test_rays_towards_a_source_follow_its_light():
    """A source with a tenth of the light of the dome gets an eighth of its rays: 8 · 0.1² of the variance."""
    dome = np.full(10, 100.0)
    for light, share in ((50.0, 4), (12.0, 4), (10.0, 8), (-10.0, 8), (5.0, 16), (0.1, 16)):
        assert choose_share(SkyParts(dome, 0 * dome, 0 * dome, {"horizon": 0 * dome + light})) == share
    assert choose_share(SkyParts(0 * dome, 0 * dome, 0 * dome, {"horizon": dome})) == 4
