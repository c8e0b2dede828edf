"""`perez`: a sky that is brighter around the sun and at the horizon, instead of an even one."""

import numpy as np

from ..sky.sky_models import split_sky
from ..sun.solar_position import sun_direction
from .effect import Effect

KEY = "perez"
MOST_HOURS = 1 << 22  # of the planes at a time, to limit memory


def decide(inputs):
    """The sky of Perez where inclined surfaces count and the weather tells direct and diffuse light apart."""
    sky, surfaces = inputs.request.sky, inputs.scene.surfaces
    counted = np.asarray(surfaces.eligible, bool) & ~np.isin(surfaces.kind, ("flat", "ground"))
    area = float(np.asarray(surfaces.area)[counted].sum())
    known = inputs.weather is None or {"dni", "dhi"} <= set(inputs.weather.data.columns)
    on = inputs.asked(KEY, sky == "perez" or (sky == "auto" and area > 0 and known))
    change = 0.0, 0.0
    if area > 0 and known and inputs.weather is not None:
        planes = typical_planes(surfaces, counted)
        change = change_unshaded(inputs.weather, *planes, inputs.request.ground_albedo)
    words = f"unshaded, it changes the light of what counts by {min(change):+.1%} to {max(change):+.1%}"
    if on:
        reason = "as asked" if sky == "perez" or inputs.asked(KEY) else f"{area:,.0f} m² of inclined surfaces count"
        reason += f"; {words}" if any(change) else ""
        return Effect(KEY, True, "dome, circumsolar light and horizon", reason, 0.0, setting=KEY)
    bound = None if not known or (area > 0 and not any(change)) else bound_change(inputs.weather, change)
    reason = "as asked" if sky == "isotropic" or inputs.asked(KEY) is False else why_not(area)
    reason += f"; {words}" if any(change) else ""
    return Effect(KEY, False, "isotropic sky", reason, bound, setting="isotropic")


def bound_change(weather, change):
    """What the isotropic sky leaves out at most: what Perez's sky changes on unshaded planes, or takes from a wall that
    never sees the sun, which is the circumsolar share of DHI; 0 where nothing inclined counts.
    """
    if not any(change):
        return 0.0
    parts = split_sky(weather, KEY)
    circumsolar = parts.circumsolar_horizontal.sum()
    return float(max(circumsolar / (circumsolar + parts.dome.sum()), *np.abs(change)))


def why_not(area):
    """Why the automatic choice is the isotropic sky."""
    return "the weather has no direct and diffuse light" if area > 0 else "no inclined surface counts"


def typical_planes(surfaces, counted):
    """Tilts and azimuths that stand for the surfaces that count: (k,) and (k,) [°], to 10° and 45°."""
    tilt = np.round(np.asarray(surfaces.surface_tilt, float)[counted], -1)
    azimuth = 45 * np.round(np.asarray(surfaces.surface_azimuth, float)[counted] / 45) % 360
    planes = np.unique(np.stack([tilt, azimuth]), axis=1)
    return planes[0], planes[1]


def change_unshaded(weather, tilt, azimuth, ground_albedo):
    """What Perez's sky changes in the annual irradiation of unshaded planes.

    Parameters
    ----------
    weather : Weather
    tilt, azimuth : (k,) [°]
    ground_albedo : float

    Returns
    -------
    (k,) float64
        Share of that under the isotropic sky.
    """
    sums = []
    for sky in ("isotropic", "perez"):
        sums.append(sum_unshaded(weather, split_sky(weather, sky), tilt, azimuth, ground_albedo))
    isotropic, perez = sums
    return np.divide(perez - isotropic, isotropic, out=np.zeros(len(tilt)), where=isotropic > 0)


def sum_unshaded(weather, parts, tilt, azimuth, ground_albedo):
    """Irradiation of unshaded planes over all intervals [Wm⁻²]: (k,)."""
    data = weather.data
    up, turn = np.radians(tilt), np.radians(azimuth)
    normal = np.stack([np.sin(up) * np.sin(turn), np.sin(up) * np.cos(turn), np.cos(up)])
    towards = sun_direction(data["apparent_zenith"], data["solar_azimuth"])
    sunward = data["dni"].to_numpy(float) + parts.circumsolar
    level = float((data["dni"] * np.maximum(towards[:, 2], 0)).sum() + parts.circumsolar_horizontal.sum())
    step = max(1, MOST_HOURS // len(data))
    direct = [sunward @ np.maximum(towards @ normal[:, k : k + step], 0) for k in range(0, len(tilt), step)]
    ground = ground_albedo * (1 - normal[2]) / 2 * (level + parts.dome.sum())
    return np.concatenate(direct) + parts.dome.sum() * (1 + normal[2]) / 2 + parts.horizon.sum() * np.sin(up) + ground
