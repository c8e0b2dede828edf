"""Light of a year that distant terrain takes from unobstructed surfaces, or adds to it: closed forms.

           sky: lost between the horizontal and the horizon         sun: lost while it stands below the horizon
   ▲          ＿＿                                                   terrain: reflects what a lit plain does
 ／ ╲＿＿＿＿／    ╲   horizon
──────────────────── horizontal
"""

from dataclasses import dataclass

import numpy as np

from ..horizon.horizon import is_above
from ..horizon.lost_sky import lost_sky
from ..sun.solar_position import sun_direction
from .light_sources import SOURCES


@dataclass
class SunlitYear:
    """Sums over a year: what light there is, and from where."""

    towards: np.ndarray  # (t, 3) float64, to the sun, of the intervals in which it shines
    direct: np.ndarray  # (t,) float64 [Wm⁻²], normal irradiance from there, circumsolar light included
    dome: float  # [Wm⁻²] summed over all intervals
    sources: dict  # name -> float [Wm⁻²], the same by each traced source, in its unit


def sunlit_year(weather, parts):
    """What shines in the year of a Weather, from its SkyParts: SunlitYear."""
    data = weather.data
    direct = data["dni"].to_numpy(float) + parts.circumsolar
    lit = direct > 0
    towards = sun_direction(data["apparent_zenith"].to_numpy()[lit], data["solar_azimuth"].to_numpy()[lit])
    sources = {name: float(light.sum()) for name, light in parts.sources.items()}
    return SunlitYear(towards, direct[lit], float(parts.dome.sum()), sources)


def first_light(year, normal):
    """Light of sun and sky on unobstructed surfaces, without reflections: (k,) float64 [Wm⁻²], summed over the year.

    Parameters
    ----------
    year : SunlitYear
    normal : (k, 3) float64
    """
    of_sources = sum(light * SOURCES[name].unshaded(normal) for name, light in year.sources.items())
    return year.dome * (1 + normal[:, 2]) / 2 + of_sources + sum_direct(year, normal, slice(None))


def light_behind(year, normal, horizon, ground_albedo):
    """What a horizon takes from unobstructed surfaces, and what they gain where terrain is brighter than the sky.

    Parameters
    ----------
    year : SunlitYear
    normal : (k, 3) float64
    horizon : TerrainHorizon
    ground_albedo : float
        Of the terrain.

    Returns
    -------
    lost, gained : (k,) float64 [Wm⁻²]
        Summed over the year.
    """
    hidden = ~is_above(horizon, year.towards)
    level = np.array([[0.0, 0.0, 1.0]])
    dark = float(sum_direct(year, level, hidden)[0])  # what the open ground loses of the sun
    lit = float(sum_direct(year, level, ~hidden)[0]) + year.dome
    # Terrain takes the place of the sky in the same directions: what hides one hides the other.
    of_sky = [lost_sky(normal, horizon) * (year.dome - ground_albedo * lit)]
    for name, light in year.sources.items():
        source = SOURCES[name]
        of_sky.append(light * source.unshaded(normal) * (1 - source.seen(normal, horizon)))
    lost = sum_direct(year, normal, hidden) + ground_albedo * (1 - normal[:, 2]) / 2 * dark
    return lost + np.maximum(of_sky, 0).sum(axis=0), np.maximum(np.negative(of_sky), 0).sum(axis=0)


def sum_direct(year, normal, members):
    """Direct light of some intervals on unobstructed surfaces: (k,) float64 [Wm⁻²]."""
    direct, towards = year.direct[members], year.towards[members]
    return np.array([direct @ np.maximum(towards @ one, 0) for one in normal])
