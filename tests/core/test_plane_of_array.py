"""A year on eleven open planes at three stations, against pvlib's own reader, sun and plane-of-array functions."""

import gzip

import numpy as np
import pandas as pd
import pvlib
import pytest
from scenes import scene_of_triangles
from weathers import BARROW, DATA

from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light.trace_gather import trace_gather
from citypv.core.progress import silent
from citypv.core.request import Request
from citypv.core.sun.choose_suns import choose_suns
from citypv.core.weather.read_weather import read_weather

STATIONS = [
    (DATA / "USA_NY_New.York-CentralPark_TMY3.epw.gz", 40.78, -73.97),
    (DATA / "CHL_Santiago_TMYx.epw.gz", -33.39, -70.79),
    (BARROW, 71.32, -156.62),
]
PLANES = [
    *((90.0, azimuth) for azimuth in (0.0, 90.0, 180.0, 270.0, 225.0)),
    *((30.0, azimuth) for azimuth in (0.0, 90.0, 180.0, 270.0)),
    *((0.0, 0.0), (60.0, 135.0)),
]
ALBEDO = 0.25


def pvlib_alone(path, *, low_suns):
    """Annual sums on the planes [kWh/m²] from the file as it is: isotropic sky, ground lit by GHI.

    Unless `low_suns`, light of a sun below 2° counts as diffuse, as where DNI is computed and not measured.
    """
    with gzip.open(path, "rt", encoding="latin-1") as file:
        data, station = pvlib.iotools.read_epw(file)
    middle = data.index + pd.Timedelta(minutes=30)
    sun = pvlib.solarposition.get_solarposition(middle, station["latitude"], station["longitude"])
    sun.index = data.index
    if not low_suns:
        low = sun["apparent_elevation"] < 2
        data.loc[low, "dni"], data.loc[low, "dhi"] = 0.0, data.loc[low, "ghi"]
    sums = []
    for tilt, azimuth in PLANES:
        poa = pvlib.irradiance.get_total_irradiance(
            *(tilt, azimuth, sun["apparent_zenith"], sun["azimuth"], data["dni"], data["ghi"], data["dhi"]),
            albedo=ALBEDO,
            model="isotropic",
        )
        sums.append(poa["poa_global"].sum() / 1000)
    return np.array(sums)


def open_plane(tilt, azimuth):
    """A triangle with nothing around it."""
    slope, turn = np.radians(tilt), np.radians(azimuth)
    across = np.array([-np.cos(turn), np.sin(turn), 0.0])
    upward = np.array([-np.cos(slope) * np.sin(turn), -np.cos(slope) * np.cos(turn), np.sin(slope)])
    corners = np.array([across * -1, across, upward]) * 2 + [0, 0, 5]
    return scene_of_triangles(corners, [[0, 1, 2]])


@pytest.mark.once
@pytest.mark.parametrize(("path", "latitude", "longitude"), STATIONS, ids=["New York", "Santiago", "Barrow"])
def test_a_year_on_open_planes(path, latitude, longitude):
    weather = read_weather(path, latitude, longitude)
    suns = choose_suns("typical-days:12", *weather.axis)
    low = weather.data["apparent_zenith"] > 88
    expected = pvlib_alone(path, low_suns=bool((weather.data["dni"][low] > 0).any()))
    for (tilt, azimuth), truth in zip(PLANES, expected, strict=True):
        scene = open_plane(tilt, azimuth)
        assert scene.surfaces.surface_tilt[0] == pytest.approx(tilt, abs=1e-6)
        if tilt > 0:
            assert scene.surfaces.surface_azimuth[0] == pytest.approx(azimuth, abs=1e-6)
        transfer = trace_gather(scene, suns, Request(ground_albedo=ALBEDO), silent)
        found = compute_energy(transfer, weather).poa_global_annual[0]
        assert found == pytest.approx(truth, rel=2e-3)
