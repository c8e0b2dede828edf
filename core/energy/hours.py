"""Data of each hour shared by all surfaces: sun, weather, and the traced suns that represent it."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..sky.horizon import is_above
from ..sun.solar_position import MINIMUM_ELEVATION, is_sunny, sun_direction
from ..sun.sun_sampling import match_suns
from .energy import split_years
from .power import conditions_of_modules


@dataclass
class Hours:
    """The h intervals with any light, ordered by month; one row each."""

    interval: np.ndarray  # (h,) int, index into the weather's time axis
    # (h,) int, 0 to 11, of mid-interval, in UTC or the calendar of `weather.zone`
    month: np.ndarray
    # (h,) int, among the whole years if the weather has several; -1 outside of them
    year: np.ndarray
    direction: np.ndarray  # (h, 3) towards the sun at mid-interval
    sunny: np.ndarray  # (h, 1) 1.0 if the sun is at least 2° high, else 0.0
    # (h, 1) 1.0 if the sun stands above the horizon of distant terrain, else 0.0; no DNI then
    open: np.ndarray
    dni: np.ndarray  # (h, 1) [Wm⁻²]
    # (h, 1) [Wm⁻²] normal irradiance from the place of the sun: DNI and circumsolar light
    sunward: np.ndarray
    dome: np.ndarray  # (h, 1) [Wm⁻²] part of DHI that comes evenly from the whole sky
    # (h, k) [Wm⁻²] by each traced source, in its unit; negative where it is darker than the dome
    sources: np.ndarray
    level: np.ndarray  # (h, 1) [Wm⁻²] of unshaded ground by DNI and circumsolar light
    temp_air: np.ndarray  # (h, 1) [°C] cell temperature without irradiance
    spectral_factor: np.ndarray  # (h, 1) f₁ of the Sandia model, see `spectral_factor`
    # (h, m) [Km²W⁻¹] cell above air temperature, per POA irradiance, of each mounting
    heating: np.ndarray
    match: np.ndarray  # (h, k) int, traced suns that represent the hour
    match_weight: np.ndarray  # (h, k) float

    def __len__(self):
        return len(self.interval)

    def rows(self, first, last):
        """Hours first to last-1, as views."""
        return Hours(**{name: values[first:last] for name, values in vars(self).items()})

    def chunks(self, *, chunk=128):
        """Runs of at most CHUNK hours within one month of one year: list of (first, last)."""
        change = np.flatnonzero((np.diff(self.month) != 0) | (np.diff(self.year) != 0)) + 1
        bounds = [0, *change.tolist(), len(self)]
        # `chunk`: hours at a time.
        return [
            (start, min(start + chunk, last))
            for first, last in pairwise(bounds)
            for start in range(first, last, chunk)
        ]

    @property
    def year_count(self):
        """Number of years that are summed one by one; 0 for a single one."""
        return int(self.year.max(initial=-1)) + 1


def prepare_hours(suns, weather, system, sky, terrain=None):
    """Prepare the data shared by all surfaces, for the intervals with any light.

    Parameters
    ----------
    suns : Suns
        As traced.
    weather : Weather
    system : PvSystem
    sky : SkyParts
        Of the weather.
    terrain : TerrainHorizon, optional
        Of distant terrain: no light from the sun and its surroundings while the sun of mid-interval
        stands behind it.

    Returns
    -------
    Hours
        Direction and irradiance of the sun, light of the sky, state of the cells, and the traced
        suns that represent each interval, month by month, in float64. Cell heating is the Sandia
        model of the system's mountings, :doi:`10.2172/919131`.
    """
    # Hours with light, of irradiance or a sun at least 2° high, sorted by month in the calendar of
    # the weather, so that the hours of a month lie together.
    data = weather.data
    sunny = is_sunny(data["apparent_zenith"])
    used = np.flatnonzero((data["ghi"] > 0) | (data["dni"] > 0) | sunny)
    middle = data.index + weather.interval / 2
    month = (middle if weather.zone is None else middle.tz_convert(weather.zone)).month.to_numpy()[
        used
    ] - 1
    used = used[np.argsort(month, kind="stable")]
    # Calendar years are numbered where there are several.
    year, years = np.full(len(data), -1), split_years(data.index, weather.interval)
    for number, (_, inside) in enumerate(years if len(years) > 1 else []):
        year[inside] = number
    data, sunny = data.iloc[used], sunny[used]
    # sunward  normal irradiance from the sun's place, circumsolar light included [Wm⁻²].
    sunward = (data["dni"].to_numpy() + sky.circumsolar[used])[:, None]
    # No sun below 2° was traced: if light comes from there, the nearest one represents it.
    lowest = 0.0 if (sunward[~sunny] > 0).any() else MINIMUM_ELEVATION
    match = match_suns(suns, *weather.axis._replace(times=data.index), lowest=lowest, position=data)
    # Air mass for the spectrum, and cell temperature per irradiance for each way of mounting.
    spectral, dark, heating = conditions_of_modules(data, system)
    dni = data["dni"].to_numpy()[:, None]
    # Where the sun stands, and whether terrain hides it; level  what falls on level ground [Wm⁻²].
    direction = sun_direction(data["apparent_zenith"], data["solar_azimuth"])
    above = is_above(terrain, direction).astype(float)[:, None]
    level = dni * np.maximum(direction[:, 2:], 0.0) + sky.circumsolar_horizontal[used, None]
    return Hours(
        interval=used,
        month=np.sort(month, kind="stable"),
        year=year[used],
        direction=direction,
        sunny=sunny.astype(float)[:, None],
        open=above,
        dni=dni * above,
        sunward=sunward * above,
        dome=sky.dome[used, None],
        sources=sky.of_sources[used],
        level=level * above,
        spectral_factor=spectral[:, None],
        temp_air=dark[:, None],
        heating=heating,
        match=match.index,
        match_weight=match.weight.astype(float),
    )
