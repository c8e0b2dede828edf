"""What shines in the year of a weather: the sun's light by its places, sums of the dome and of
further sources, and what of it unobstructed surfaces get in closed form.
"""

from dataclasses import dataclass

import numpy as np

from ..sky.horizon import is_above
from ..sky.horizon_band import SOURCES
from ..sun.solar_position import sun_direction

UP = np.array([[0.0, 0.0, 1.0]])


@dataclass
class _SunlitYear:
    """Sums over a year: what light there is, and from where."""

    towards: np.ndarray  # (t, 3) float64, to the sun, of the intervals in which it shines
    # (t,) float64 [Wm⁻²], normal irradiance from there, circumsolar light included
    direct: np.ndarray
    dome: float  # [Wm⁻²] summed over all intervals
    sources: dict  # name -> float [Wm⁻²], the same by each traced source, in its unit

    def first_light(self, normal):
        """Light of sun and sky on unobstructed surfaces, without reflections: (k,) float64 [Wm⁻²],
        summed over the year.

        Parameters
        ----------
        normal : (k, 3) float64
        """
        of_sources = sum(
            light * SOURCES[name].unshaded(normal) for name, light in self.sources.items()
        )
        return (
            self.dome * (1 + normal[:, 2]) / 2 + of_sources + self.sum_direct(normal, slice(None))
        )

    def light_behind(self, normal, horizon, ground_albedo):
        """What a horizon takes from unobstructed surfaces, and what they gain where terrain is
        brighter than the sky.

        Parameters
        ----------
        normal : (k, 3) float64
        horizon : TerrainHorizon
        ground_albedo : float
            Of the terrain.

        Returns
        -------
        lost, gained : (k,) float64 [Wm⁻²]
            Summed over the year.
        """
        # The sun behind terrain is lost to surfaces; the ground that they see loses it too, and
        # reflects less.
        hidden = ~is_above(horizon, self.towards)
        dark = float(self.sum_direct(UP, hidden)[0])  # what the open ground loses of the sun
        lit = float(self.sum_direct(UP, ~hidden)[0]) + self.dome
        # Terrain takes the place of the sky in the same directions: what hides one hides the other.
        of_sky = [horizon.lost_sky(normal) * (self.dome - ground_albedo * lit)]
        for name, light in self.sources.items():
            source = SOURCES[name]
            of_sky.append(light * source.unshaded(normal) * (1 - source.seen(normal, horizon)))
        # Lost are the sun's direct light, and what the darker ground would have reflected; (1 -
        # n_z)/2 is the view of the ground from an unobstructed surface.
        lost = self.sum_direct(normal, hidden) + ground_albedo * (1 - normal[:, 2]) / 2 * dark
        return lost + np.maximum(of_sky, 0).sum(axis=0), np.maximum(np.negative(of_sky), 0).sum(
            axis=0
        )

    def sum_direct(self, normal, members):
        """Direct light of some intervals on unobstructed surfaces: (k,) float64 [Wm⁻²]."""
        direct, towards = self.direct[members], self.towards[members]
        return np.array([direct @ np.maximum(towards @ one, 0) for one in normal])


def sunlit_year(weather, parts):
    """What shines in the year of a Weather, from its SkyParts: SunlitYear."""
    # All that comes from the place of the sun, in the hours in which there is any; sums suffice for
    # the rest, as their light does not move.
    data = weather.data
    direct = data["dni"].to_numpy(float) + parts.circumsolar
    lit = direct > 0
    towards = sun_direction(
        data["apparent_zenith"].to_numpy()[lit], data["solar_azimuth"].to_numpy()[lit]
    )
    sources = {name: float(light.sum()) for name, light in parts.sources.items()}
    return _SunlitYear(towards, direct[lit], float(parts.dome.sum()), sources)
