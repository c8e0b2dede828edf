"""`perez`: a sky that is brighter around the sun and at the horizon, instead of an even one."""

import numpy as np

from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..sun.horizon import UP, first_light, sunlit_year
from ..sun.sky_models import RAYS_SHARE, choose_share, split_sky
from ..sun.solar_position import sun_direction
from .effect import Effect

KEY = "perez"
LIT = ("facade", "roof", "steep", "rack")  # kinds that have full load hours and may be inclined
LEVEL = 1.0  # [°] of tilt up to which both skies give the same


def decide(inputs):
    """The sky of Perez where inclined surfaces count; every weather has the direct and diffuse light that it needs."""
    sky, asked, surfaces = inputs.request.sky, inputs.asked(KEY), inputs.scene.surfaces
    counted = surfaces_that_count(surfaces)
    area = float(np.asarray(surfaces.area)[counted].sum())
    change = np.zeros(0)
    if inputs.weather is not None and counted.any():
        tilt = np.round(np.asarray(surfaces.surface_tilt, float)[counted], -1)
        azimuth = 45 * np.round(np.asarray(surfaces.surface_azimuth, float)[counted] / 45) % 360
        planes = np.unique(np.stack([tilt, azimuth]), axis=1)
        change = change_unshaded(inputs.weather, *planes, inputs.request.ground_albedo)
    words = (
        f"; it changes unshaded ones by {100 * change.min():+.1f} to {100 * change.max():+.1f} %" if len(change) else ""
    )
    counts = sky == "auto" and area > 0
    if sky == KEY or counts if asked is None else asked:
        reason = f"{area:,.0f} m² of inclined surfaces count" if sky == "auto" and asked is None else "as asked"
        inputs.plan.sky = KEY
        if inputs.weather is not None and inputs.plan.receivers is not None:  # else all surfaces get all rays
            # Rays of a replicate, as a power of two no larger: further rounds go on in such steps.
            rays = 1 << max(inputs.request.samples // HEMISPHERE_REPLICATES, 1).bit_length() - 1
            inputs.plan.rays_share = min(choose_share(split_sky(inputs.weather, KEY)), max(RAYS_SHARE, rays))
        extent = f"dome, circumsolar light and horizon, one horizon ray for {inputs.plan.rays_share} of the dome"
        return Effect(KEY, True, extent, reason + words, 0.0)
    reason = "no inclined surface counts" if sky == "auto" and asked is None else "as asked"
    bound = bound_change(inputs.weather, change) if len(change) else 0.0 if area == 0 else None
    return Effect(KEY, False, "isotropic sky", reason + words, bound)


def surfaces_that_count(surfaces):
    """Inclined surfaces that are eligible or, where none is, all that light of the sky reaches: (n,) bool."""
    eligible = np.asarray(surfaces.eligible, bool)
    wanted = eligible if eligible.any() else np.isin(surfaces.kind, LIT)
    return wanted & (np.asarray(surfaces.surface_tilt) > LEVEL)


def bound_change(weather, change):
    """Share of light that the isotropic sky leaves out, or finds too much, at most.

    What Perez's sky changes on unshaded planes, or takes from a wall that never sees the sun: all but its dome's part
    of DHI. Both as shares of the light under Perez's sky, like those of all effects that are switched off.
    """
    parts = split_sky(weather, KEY)
    dome, circumsolar = float(parts.dome.sum()), float(parts.circumsolar_horizontal.sum())
    return max(circumsolar / max(dome, 1e-9), *(abs(one) / max(1 + one, 1e-9) for one in change.tolist()))


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
    normal = sun_direction(tilt, azimuth)  # it stands above its plane as a sun does
    years = [sunlit_year(weather, split_sky(weather, sky)) for sky in ("isotropic", KEY)]
    reflected = ground_albedo * (1 - normal[:, 2]) / 2
    isotropic, perez = (first_light(year, normal) + reflected * first_light(year, UP) for year in years)
    return np.divide(perez - isotropic, isotropic, out=np.zeros(len(tilt)), where=isotropic > 0)
