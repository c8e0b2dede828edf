"""One or several years of weather at one place."""

from dataclasses import dataclass, field, replace

import pandas as pd

from ..sun.suns import TimeAxis


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

    @property
    def axis(self):
        """Its intervals and its place: TimeAxis."""
        return TimeAxis(self.data.index, self.interval, self.latitude, self.longitude)


def darken_hours(weather, dark):
    """The same weather with night in some hours, (t,) bool: no irradiance, and the sun at the nadir."""
    night = {"ghi": 0.0, "dni": 0.0, "dhi": 0.0, "apparent_zenith": 180.0}
    data = weather.data.assign(**{name: weather.data[name].mask(dark, value) for name, value in night.items()})
    return replace(weather, data=data)
