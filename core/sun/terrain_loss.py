"""What distant terrain takes from unobstructed surfaces, or adds to them: closed forms, of the sky and of a year.

           sky: lost between the horizontal and the horizon         sun: lost while it stands below the horizon
   ▲          ＿＿                                                   terrain: reflects what a lit plain does
 ／ ╲＿＿＿＿／    ╲   horizon
──────────────────── horizontal
"""

from dataclasses import dataclass

import numpy as np

from ..settings.errors import UNIT, check_array
from .horizon import is_above
from .horizon_band import SOURCES, by_normal
from .solar_position import sun_direction

UP = np.array([[0.0, 0.0, 1.0]])


def lost_sky(normal, horizon):
    """Cosine-weighted share of the hemisphere of unobstructed surfaces between the horizontal and the horizon.

    For each azimuth the integral over elevation is exact: with c the component of the normal along that azimuth,
    ∫ (c cos e + n_z sin e) cos e de = c (e/2 + sin 2e / 4) + n_z sin² e / 2. A horizon of equal height h takes sin² h
    from a level surface, and (h + sin h cos h)/π, h in radians, from a wall.

    Parameters
    ----------
    normal : array_like, (n, 3)
        Unit vectors.
    horizon : TerrainHorizon

    Returns
    -------
    numpy.ndarray, (n,)
        What (1 + cos tilt)/2 loses, and the view of the ground gains.
    """
    normal = check_array("normal", normal, ("n", 3), least=-1 - UNIT, most=1 + UNIT)
    turn, height = np.radians(horizon.azimuth), np.radians(horizon.elevation)

    def lose(normal):
        along = normal[:, :1] * np.sin(turn) + normal[:, 1:2] * np.cos(turn)  # (n, STEPS)
        up = np.broadcast_to(normal[:, 2:], along.shape)
        # Where the surface's own plane rises or falls across the sky, it is the limit.
        plane = np.arctan2(np.abs(along), np.abs(up))
        low = np.where((along < 0) & (up > 0), plane, 0.0)
        high = np.where((along > 0) & (up < 0), np.minimum(height, plane), height)
        faces = (high > low) & ((along > 0) | (up > 0))
        share = along * (high - low + (np.sin(2 * high) - np.sin(2 * low)) / 2) / 2
        share += up * (np.sin(high) ** 2 - np.sin(low) ** 2) / 2
        return np.maximum(np.where(faces, share, 0.0), 0).sum(axis=1) * 2 / len(turn)  # da/π = 2/STEPS

    return by_normal(lose, normal, 9)


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
    dark = float(sum_direct(year, UP, hidden)[0])  # what the open ground loses of the sun
    lit = float(sum_direct(year, UP, ~hidden)[0]) + year.dome
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
