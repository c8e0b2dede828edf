"""`far-ground`: light from the open ground beyond the scene, up to the horizon.

It is lit as if nothing shaded it. Where the near ground ends, buildings still shade it a little: at a distance of r
building heights a long row of them hides (1 - cos β)/2 of its sky, with tan β = 1/r, and suns below β on one side.
"""

import numpy as np

from ..horizon.horizon import is_above
from .closed_form import ground_view_of_tilt, sky_view_of_tilt
from .effect import Effect
from .terrain_horizon import largest_share

KEY = "far-ground"


def decide(inputs):
    """On if anything reflects; the error at the edge of the near ground is its bound where nothing else shades."""
    plan = inputs.plan
    if not inputs.asked(KEY, inputs.request.far_ground):
        words = "switched off: rays that leave downwards carry nothing"
        return Effect(KEY, False, "none", words, share_left_out(inputs))
    if not plan.reflections:
        return Effect(KEY, False, "none", "it only shines by reflection, and nothing is reflected", 0.0, share=0.0)
    plan.far_ground, plan.reach = True, measure_reach(inputs.scene, inputs.patches)
    words = f"rays that leave downwards meet unshaded ground, {plan.reach:.1f} building heights away"
    return Effect(KEY, True, "once reflected", words, bound_of_edge(inputs, plan.reach))


def share_left_out(inputs):
    """Share of the light of any kind and orientation that a dark far ground takes at most; None without weather.

    Unshaded surfaces see (1 - cos tilt)/2 of it, and terrain below a horizon. Of light that other surfaces pass on it
    makes no larger share than of theirs.
    """
    if inputs.weather is None:
        return None
    terrain = inputs.terrain

    def light_of_ground(year, normal, albedo):
        direct = year.direct if terrain is None else year.direct * is_above(terrain, year.towards)
        level = year.dome + direct @ np.maximum(year.towards[:, 2], 0)
        return albedo * level * ground_view_of_tilt(normal, terrain)[None]

    gained = largest_share(inputs, light_of_ground, terrain)
    return gained / (1 + gained)


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


def bound_of_edge(inputs, reach):
    """Share of light that shade beyond the near ground would take away, at most; None where something else shades.

    It is the closed form of the kind and orientation that sees most of the far ground, in the year of the weather and
    in an overcast one, with which the same trace may be weighed.
    """
    share = share_left_out(inputs) if inputs.unshaded else None
    return None if share is None else max(share, overcast_share(inputs)) * max(shade_at_edge(reach, inputs.suns))


def overcast_share(inputs):
    """Share of the far ground in the light of an even sky, of the unshaded receiver that sees most of it: float."""
    surfaces, albedo = inputs.scene.surfaces, inputs.request.ground_albedo
    normal = np.asarray(surfaces.normal, float)
    normal = normal[np.asarray(surfaces.eligible)] if np.any(surfaces.eligible) else normal
    reflected = albedo * ground_view_of_tilt(normal, inputs.terrain)
    return float(np.max(reflected / np.maximum(reflected + sky_view_of_tilt(normal, inputs.terrain), 1e-9)))


def shade_at_edge(reach, suns):
    """Shares of the sky and of the suns' light that a long row of buildings hides from ground at some distance.

    Parameters
    ----------
    reach : float
        Distance in building heights.
    suns : Suns or None

    Returns
    -------
    of_sky, of_sun : float
        Half of the light of suns below the row's edge.
    """
    lowest = np.arctan2(1.0, reach)
    of_sun = 0.0
    if suns is not None and len(suns):
        height = np.maximum(suns.direction[:, 2], 0) * np.maximum(suns.weight, 0)
        of_sun = height[suns.direction[:, 2] < np.sin(lowest)].sum() / height.sum() / 2 if height.any() else 0.0
    return float((1 - np.cos(lowest)) / 2), float(of_sun)
