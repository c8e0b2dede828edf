"""One or several years of weather at one place."""

from dataclasses import dataclass, field

import pandas as pd


@dataclass
class Weather:
    """Weather of one site, independent of any surface."""

    data: pd.DataFrame  # index: tz-aware start of each interval (UTC); see below
    interval: pd.Timedelta  # length of every interval
    latitude: float  # [°] of the sun: the requested place, or that of the station
    longitude: float  # [°]
    altitude: float  # [m]
    label: str  # shown with the results: "ERA5 era5_berlin_2017.nc", "clear sky (upper bound)"
    notes: list = field(default_factory=list)  # of str: findings on the file, for the user
    checks: dict = field(default_factory=dict)  # year -> fields of SunTimes: how well the irradiance fits the sun

    # Columns of data, all float64:
    # ghi, dhi, dni [Wm⁻²], temp_air [°C], wind_speed [ms⁻¹], pressure [Pa]
    # and, of the sun at mid-interval, solar_zenith, apparent_zenith, solar_azimuth [°].
    # Below 2° of apparent elevation dni is the measured one, or 0 if it would have to be derived; see add_sun.
