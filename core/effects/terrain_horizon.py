"""`terrain-horizon`: terrain far from the scene that hides suns and sky."""

import numpy as np

from ..horizon.horizon_share import bound_between, bound_of_horizon, hidden_shares, suns_of_year
from ..horizon.read_horizon import read_horizon
from ..sun.solar_position import MINIMUM_ELEVATION
from .effect import Effect

KEY = "terrain-horizon"
POINTS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")


def decide(inputs):
    """Called for when the horizon rises above the 2° below which no direct light is traced."""
    path, site = inputs.request.horizon, inputs.scene.site
    if path is None:
        return Effect(KEY, False, "none", "no --horizon is given: the horizon is level", None)
    horizon, corners = read_horizon(path, inputs.scene)
    suns = suns_of_year(site.latitude, site.longitude)
    top = int(horizon.elevation.argmax())
    highest, azimuth = horizon.elevation[top], horizon.azimuth[top]
    where = f"{highest:.1f}° in the {POINTS[round(azimuth / 45) % 8]} (azimuth {azimuth:.0f}°)"
    if not inputs.asked(KEY, highest > MINIMUM_ELEVATION):
        low = f"no higher than the {MINIMUM_ELEVATION:g}° below which no sun is traced"
        words = "switched off" if inputs.asked(KEY) is False else low
        return Effect(KEY, False, "none", f"{words}: it rises to {where}", bound_of_horizon(horizon, suns))
    sky, sun = hidden_shares(horizon, suns)
    extent = f"hides {sky[0]:.1%} of the sky and {sun[0]:.1%} of the sunlight of level ground"
    reason = f"it rises to {where}"
    if corners:
        apart = max(float(np.abs(corner.elevation - horizon.elevation).max()) for corner in corners)
        reason += f"; corners of the scene see it up to {apart:.1f}° higher or lower"
    return Effect(KEY, True, extent, reason, bound_between(horizon, corners, suns), setting=horizon)
