"""`far-ground`: light from the open ground beyond the scene, up to the horizon.

It is lit as if nothing shaded it. Where the near ground ends, buildings still shade it a little: at a distance of r
building heights a long row of them hides (1 - cos β)/2 of its sky, with tan β = 1/r, and suns below β on one side.
"""

import numpy as np

from .effect import Effect

KEY = "far-ground"


def decide(inputs):
    """On if anything reflects; the error at the edge of the near ground is its bound."""
    request = inputs.request
    pilot = inputs.pilot_if_wanted
    share = None if pilot is None else sum(shares_of_far_ground(pilot, inputs.direct_over_diffuse))
    if not inputs.asked(KEY, request.far_ground):
        words = "switched off: rays that leave downwards carry nothing"
        return Effect(KEY, False, "none", words, request.ground_albedo / 2)
    if not inputs.decided["reflections"].on:
        return Effect(KEY, False, "none", "it only shines by reflection, and nothing is reflected", 0.0, share=0.0)
    reach = measure_reach(inputs.scene, inputs.patches)
    words = f"rays that leave downwards meet unshaded ground, {reach:.1f} building heights away"
    bound = None if pilot is None else edge_error(pilot, reach, inputs.suns, inputs.direct_over_diffuse)
    return Effect(KEY, True, "once reflected", words, bound, setting=reach, share=share)


def measure_reach(scene, patches):
    """How far the near ground goes on beyond the city, in heights of its highest building.

    Returns
    -------
    float
        The shortest of the four sides; 0 without ground.
    """
    corners = np.asarray(scene.vertices, float)[scene.triangles[: len(patches)]]
    ground, city = corners[patches.ground].reshape(-1, 3), corners[~patches.ground].reshape(-1, 3)
    if not len(ground) or not len(city):
        return 0.0
    height = city[:, 2].max() - np.median(ground[:, 2])
    room = np.minimum((city - ground.min(axis=0)).min(axis=0), (ground.max(axis=0) - city).min(axis=0))[:2]
    return float(max(room.min(), 0.0) / height) if height > 0 else 0.0


def edge_error(pilot, reach, suns, ratio):
    """Share of light that shade beyond the near ground would take away.

    Parameters
    ----------
    pilot : Pilot
    reach : float
        Of `measure_reach`.
    suns : Suns or None
    ratio : float
        Direct normal over diffuse irradiance of the year.

    Returns
    -------
    float
    """
    lowest = np.arctan2(1.0, reach)
    of_sky = (1 - np.cos(lowest)) / 2
    of_sun = 0.0
    if suns is not None and len(suns):
        height = np.maximum(suns.direction[:, 2], 0) * np.maximum(suns.weight, 0)
        of_sun = height[suns.direction[:, 2] < np.sin(lowest)].sum() / height.sum() / 2 if height.any() else 0.0
    sky, sun = shares_of_far_ground(pilot, ratio)
    return float(sky * of_sky + sun * of_sun)


def shares_of_far_ground(pilot, ratio):
    """Share of all light that the far ground passes on, from the sky and from the suns: two float."""
    whole = pilot.weight @ (pilot.sky.sum(axis=1, dtype=float) + ratio * pilot.sun.sum(axis=1, dtype=float))
    if not whole > 0:
        return 0.0, 0.0
    return float(pilot.weight @ pilot.far_sky / whole), float(ratio * (pilot.weight @ pilot.far_sun) / whole)
