"""Refuse weather from a place too far from the city."""

import numpy as np
import pyproj

from ..settings.errors import InputError

FARTHEST = 150.0  # [km] from the city to the place of the weather, unless the user allows more
KM_PER_DEGREE = 111.2  # along a meridian


def check_distance(weather, site, allowed=None, suns=None):
    """Refuse weather from a place too far from the city, or from the latitude of the traced suns.

    Parameters
    ----------
    weather : Weather
    site : Site
        latitude and longitude of the city [°].
    allowed : float, optional
        [km] Default 150.
    suns : Suns, optional
        Suns of a Transfer, which can be used with any weather of about the same latitude, or of any place if they are a
        sky grid.

    Raises
    ------
    InputError
    """
    farthest = FARTHEST if allowed is None else allowed
    place = f"its place ({weather.latitude:.2f}°, {weather.longitude:.2f}°)"
    if suns is None:
        away = distance_of_weather(weather, site)
        if away > farthest:
            raise InputError(
                weather.label,
                f"{place} is {away:,.0f} km from the city ({site.latitude:.2f}°, {site.longitude:.2f}°)",
                f"give weather of the city's own place, or {allow(away)}",
            )
    elif not suns.way.startswith("sky-grid"):
        away = KM_PER_DEGREE * abs(weather.latitude - site.latitude)
        if away > farthest:
            raise InputError(
                weather.label,
                f"{place} is {away:,.0f} km from the latitude {site.latitude:.2f}° that was traced",
                f"give weather of that latitude, trace --suns sky-grid:N, or {allow(away)}",
            )


def allow(away):
    """The option that allows a distance [km]."""
    return f"--allow-distance {int(np.ceil(away / 10) * 10)}"


def describe_distance(weather, site):
    """Where the weather comes from as text, "" if it is the city's own place (within 1 km)."""
    away = distance_of_weather(weather, site)
    return f"from a place {away:,.0f} km away, whose sun is used" if away >= 1 else ""


def distance_of_weather(weather, site):
    """[km] from the city to the place of the weather, along the ellipsoid."""
    globe = pyproj.Geod(ellps="WGS84")
    return globe.inv(site.longitude, site.latitude, weather.longitude, weather.latitude)[2] / 1000
