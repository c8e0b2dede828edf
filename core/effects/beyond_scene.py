"""`terrain-horizon`, `far-ground` and `perez`: what lies beyond the scene.

Terrain far from it hides suns and sky. The open ground beyond it, up to the horizon, reflects light
as if nothing shaded it. Where the near ground ends, buildings still shade it a little: at a
distance of r building heights a long row of them hides (1 - cos β)/2 of its sky, with tan β = 1/r,
and suns below β on one side. The sky of Perez is brighter around the sun and at the horizon,
instead of an even one.
"""

from dataclasses import replace

import numpy as np

from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.errors import show_number
from ..settings.request import BEST_SKY
from ..sky.horizon import is_above
from ..sky.sky_models import RAYS_SHARE, split_sky
from ..sun.solar_position import MINIMUM_ELEVATION, sun_direction
from ..sun.sun_sampling import match_suns
from .closed_form import ground_view_of_tilt, sky_view_of_tilt
from .effect import NO_SUNS, Effect, counted_surfaces
from .sunlit_year import UP, sunlit_year

TERRAIN = "terrain-horizon"
POINTS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")


def decide_terrain(inputs):
    """Whether the horizon of distant terrain hides suns and sky: Effect, with a bound on what is
    left out. Unless the user decides, it is called for when the horizon rises above the 2° below
    which no direct light is traced; the plan then gets the horizon, and the suns that it hides.
    """
    # Without a horizon there is nothing to decide, and no bound is known.
    if inputs.horizons is None:
        return Effect(TERRAIN, False, "none", "no --horizon is given: the horizon is level", None)
    # Highest point of the horizon, and where it is.
    horizon, corners = inputs.horizons
    highest, azimuth = horizon.elevation.max(), horizon.azimuth[horizon.elevation.argmax()]
    where = (
        f"{highest:.1f}° in the {_name_point(azimuth)} (azimuth "
        f"{azimuth:.0f}°){_seen_from(horizon)}"
    )
    # Too low, or switched off: what this leaves out is computed in closed form.
    if inputs.terrain is None:
        low = f"no higher than the {MINIMUM_ELEVATION:g}° below which no sun is traced"
        words = "switched off" if inputs.asked(TERRAIN) is False else low
        bound = _largest_share(
            inputs, lambda year, normal, albedo: year.light_behind(normal, horizon, albedo)
        )
        return Effect(TERRAIN, False, "none", f"{words}: it rises to {where}", bound)
    # The horizon of a building lies between the lowest and the highest edge of the corners'
    # horizons: the light between these two, as a share, is the bound.
    edges = [one.elevation for one in (horizon, *corners)]
    lowest, top = (
        replace(horizon, elevation=edge.reduce(edges)) for edge in (np.minimum, np.maximum)
    )

    def between(year, normal, albedo):
        low, high = (np.array(year.light_behind(normal, one, albedo)) for one in (lowest, top))
        return np.abs(high - low)

    bound = _largest_share(inputs, between, horizon)
    # Switched on: suns behind it are not traced, and corners of the scene may see another horizon.
    reason, hidden = f"it rises to {where}", _find_hidden(inputs, lowest)
    if len(hidden):
        reason += f"; {len(hidden)} of {len(inputs.suns)} suns are not traced"
    if corners:
        apart = max(float(np.abs(corner.elevation - horizon.elevation).max()) for corner in corners)
        reason += f"; corners of the scene see it up to {apart:.1f}° higher or lower"
    inputs.plan.terrain, inputs.plan.hidden_suns = horizon, hidden
    # What it hides of sky and sunlight of level ground, in words.
    extent = f"hides {horizon.lost_sky(UP)[0]:.1%} of the sky"
    if inputs.weather is not None:
        year = _year_of(inputs)
        behind, whole = (
            year.sum_direct(UP, some)[0] for some in (~is_above(horizon, year.towards), slice(None))
        )
        extent += f" and {behind / max(whole, 1e-9):.1%} of the sunlight of level ground"
    return Effect(TERRAIN, True, extent, reason, bound)


def _name_point(azimuth):
    """Point of the compass: "south-west" of 225°."""
    return POINTS[round(azimuth / 45) % 8]


def _seen_from(horizon):
    """Height of the ground from which a raster's terrain is seen, and where its heights end too
    early, in words.
    """
    if horizon.eye is None:
        return ""
    least = int(horizon.known.argmin())
    distance, point = horizon.known[least], _name_point(horizon.azimuth[least])
    # Heights should reach 49 km in all directions.
    far = (
        f"; heights end {distance / 1000:.1f} km away in the {point}" if distance < 49_000.0 else ""
    )
    return f" from ground at {horizon.eye:.0f} m{far}"


def _find_hidden(inputs, horizon):
    """Suns that represent no interval of the year with the sun above the horizon: (k, 3) float32.

    A sun just behind the horizon is needed where intervals in the open lie between it and the next
    one.
    """
    suns, weather = inputs.suns, inputs.weather
    if suns is None or weather is None or not len(suns):
        return NO_SUNS
    data = weather.data
    match = match_suns(suns, *weather.axis, position=data)
    # Not to be traced, a sun must stand 1° below the horizon in all intervals that it represents,
    # so that suns on the very edge are traced.
    lower = replace(horizon, elevation=np.maximum(horizon.elevation - 1.0, 0))
    open_sky = is_above(lower, sun_direction(data["apparent_zenith"], data["solar_azimuth"]))
    # How much light of the open hours each sun stands for.
    used = np.bincount(
        match.index[open_sky].ravel(), np.abs(match.weight[open_sky]).ravel(), len(suns)
    )
    return suns.direction[(used == 0) & ~is_above(lower, suns.direction)].astype(np.float32)


def _year_of(inputs):
    """SunlitYear of the weather, under the sky that the run asks for."""
    sky = inputs.request.asked_sky or BEST_SKY
    return sunlit_year(inputs.weather, split_sky(inputs.weather, sky))


def _largest_share(inputs, change, behind=None):
    """Largest change of the light on a plane that a receiver lies in, or on level ground, which
    reflects.

    Shares of what the plane receives unobstructed: shade makes the change smaller, and the light as
    well.

    Parameters
    ----------
    inputs : Inputs
    change : callable
        `change(year, normal, albedo)` gives what unobstructed surfaces lose and gain: (2, k).
    behind : TerrainHorizon, optional
        Whose losses the light has already suffered.

    Returns
    -------
    float or None
        None without weather.
    """
    if inputs.weather is None:
        return None
    year, albedo, surfaces = _year_of(inputs), inputs.scene.ground_albedo, inputs.scene.surfaces
    normal = np.concatenate([UP, _planes_of(surfaces, counted_surfaces(surfaces))])
    light = year.first_light(normal)
    if behind is not None:
        light = light - year.light_behind(normal, behind, albedo)[0]
    return float(np.max(change(year, normal, albedo) / np.maximum(light, 1e-9)))


def _planes_of(surfaces, members, *, step=5.0):
    """Normals of some surfaces, alike ones once: (k, 3) float64."""
    angles = np.stack([surfaces.surface_tilt, surfaces.surface_azimuth]).astype(float)[:, members]
    # it stands above its plane as a sun does
    # `step`: [°] to which tilts and azimuths are rounded.
    return sun_direction(*np.unique(step * np.round(angles / step), axis=1))


FAR_GROUND = "far-ground"


def decide_far_ground(inputs):
    """On if anything reflects; the error at the edge of the near ground is its bound where nothing
    else shades.

    The bound is the closed form of the kind and orientation that sees most of the far ground.
    """
    plan = inputs.plan
    if not inputs.asked(FAR_GROUND, inputs.request.far_ground):
        words = "switched off: rays that leave downwards carry nothing"
        return Effect(FAR_GROUND, False, "none", words, _share_left_out(inputs))
    if not plan.reflections:
        words = "it only shines by reflection, and nothing is reflected"
        return Effect(FAR_GROUND, False, "none", words, 0.0, share=0.0)
    plan.far_ground, plan.reach = True, measure_reach(inputs.scene, inputs.patches)
    words = (
        f"rays that leave downwards meet unshaded ground, {plan.reach:.1f} building heights away"
    )
    bound = _share_left_out(inputs) if inputs.unshaded else None
    if bound is not None:
        # Of the year of the weather and, as the same trace may be weighed with it, of an overcast
        # one: of an even sky.
        surfaces = inputs.scene.surfaces
        normal = np.asarray(surfaces.normal, float)[counted_surfaces(surfaces)]
        reflected = inputs.scene.ground_albedo * ground_view_of_tilt(normal, inputs.terrain)
        light = np.maximum(reflected + sky_view_of_tilt(normal, inputs.terrain), 1e-9)
        bound = max(bound, float((reflected / light).max())) * max(
            shade_at_edge(plan.reach, inputs.suns)
        )
    return Effect(FAR_GROUND, True, "once reflected", words, bound)


def _share_left_out(inputs):
    """Share of the light of any kind and orientation that a dark far ground takes at most; None
    without weather.

    Unshaded surfaces see (1 - cos tilt)/2 of it, and terrain below a horizon. Of light that other
    surfaces pass on it makes no larger share than of theirs.
    """
    terrain = inputs.terrain

    def light_of_ground(year, normal, albedo):
        direct = year.direct if terrain is None else year.direct * is_above(terrain, year.towards)
        level = year.dome + direct @ np.maximum(year.towards[:, 2], 0)
        return albedo * level * ground_view_of_tilt(normal, terrain)[None]

    gained = _largest_share(inputs, light_of_ground, terrain)
    return None if gained is None else gained / (1 + gained)


def measure_reach(scene, patches):
    """How far the near ground goes on beyond the city, in heights of its highest building.

    Returns
    -------
    float
        The shortest of the four sides; 0 without ground.
    """
    corners = np.asarray(scene.vertices, float)[scene.triangles[: len(patches)]]
    ground, city = corners[patches.ground].reshape(-1, 3), corners[~patches.ground].reshape(-1, 3)
    if not len(ground) or not len(city) or city[:, 2].max() <= np.median(ground[:, 2]):
        return 0.0
    room = np.minimum(
        (city - ground.min(axis=0)).min(axis=0), (ground.max(axis=0) - city).min(axis=0)
    )[:2]
    return float(max(room.min(), 0.0) / (city[:, 2].max() - np.median(ground[:, 2])))


def shade_at_edge(reach, suns):
    """Shares of the sky and of the suns' light that a long row of buildings hides from ground at
    some distance.

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
    lowest, of_sun = np.arctan2(1.0, reach), 0.0
    if suns is not None:
        light = np.maximum(suns.direction[:, 2], 0) * np.maximum(suns.weight, 0)
        of_sun = light[suns.direction[:, 2] < np.sin(lowest)].sum() / max(light.sum(), 1e-9) / 2
    return float((1 - np.cos(lowest)) / 2), float(of_sun)


def decide_sky(inputs):
    """Whether the sky is not equally bright: Effect. Unless a sky is asked for, it is called for
    where inclined surfaces count; every weather has the direct and diffuse light that it needs.
    The plan gets the model of the sky, and for how many rays to the dome one goes to the horizon.
    """
    # Does it change anything? Its effect on planes in the open that face as the surfaces do.
    request, surfaces, plan = inputs.request, inputs.scene.surfaces, inputs.plan
    counted = surfaces_that_count(surfaces)
    area = float(np.asarray(surfaces.area)[counted].sum())
    change, words = np.zeros(0), ""
    plan.sky = sky_of_surfaces(request, surfaces)
    compared = BEST_SKY if plan.sky == "isotropic" else plan.sky
    if inputs.weather is not None and counted.any():
        change = change_unshaded(
            inputs.weather, _planes_of(surfaces, counted), inputs.scene.ground_albedo, compared
        )
        low, high = (show_number(100 * one, 1, plus=True) for one in (change.min(), change.max()))
        words = f"; it changes unshaded ones by {low} to {high} %"
    # With it, rays go to the horizon too: as few as its noise allows.
    if plan.sky != "isotropic":
        scene_calls = f"{area:,.0f} m² of inclined surfaces count"
        if inputs.weather is not None and plan.receivers is not None:  # else all get all rays
            # Rays of a replicate, as a power of two no larger: further rounds go on in such steps.
            rays = 1 << max(request.samples // HEMISPHERE_REPLICATES, 1).bit_length() - 1
            plan.rays_share = min(
                split_sky(inputs.weather, plan.sky).rays_share(), max(RAYS_SHARE, rays)
            )
        extent = (
            f"dome, circumsolar light and horizon, one horizon ray for {plan.rays_share} of the "
            "dome"
        )
        reason = "as asked" if request.asked_sky else scene_calls
        return Effect(BEST_SKY, True, extent, reason + words, 0.0)
    # Without it, the change on these planes bounds what is left out; without weather no bound is
    # known, unless no inclined surface counts.
    reason = "as asked" if request.asked_sky else "no inclined surface counts"
    bound = bound_change(inputs.weather, change) if len(change) else 0.0 if area == 0 else None
    return Effect(BEST_SKY, False, "isotropic sky", reason + words, bound)


def sky_of_surfaces(request, surfaces):
    """Model of the sky that these surfaces call for, or that is asked for: str."""
    counted = np.asarray(surfaces.area)[surfaces_that_count(surfaces)].sum() > 0
    return request.asked_sky or (BEST_SKY if counted else "isotropic")


def surfaces_that_count(surfaces):
    """Inclined surfaces that are eligible or, where none is, all that light of the sky reaches:
    (n,) bool.
    """
    eligible = np.asarray(surfaces.eligible, bool)
    # Kinds that have full load hours and may be inclined.
    wanted = (
        eligible if eligible.any() else np.isin(surfaces.kind, ("facade", "roof", "steep", "rack"))
    )
    # Up to a tilt of 1° both skies give the same.
    return wanted & (np.asarray(surfaces.surface_tilt) > 1.0)


def bound_change(weather, change):
    """Share of light that the isotropic sky leaves out, or finds too much, at most.

    What Perez's sky changes on unshaded planes, or takes from a wall that never sees the sun: all
    but its dome's part of DHI. Both as shares of the light under Perez's sky, as for all effects
    that are switched off.
    """
    parts = split_sky(weather, BEST_SKY)
    dome, circumsolar = float(parts.dome.sum()), float(parts.circumsolar_horizontal.sum())
    return max(
        circumsolar / max(dome, 1e-9), *(abs(one) / max(1 + one, 1e-9) for one in change.tolist())
    )


def change_unshaded(weather, normal, ground_albedo, sky=BEST_SKY):
    """What a model of the sky changes in the annual irradiation of unshaded planes.

    Parameters
    ----------
    weather : Weather
    normal : (k, 3) float64
    ground_albedo : float
    sky : str

    Returns
    -------
    (k,) float64
        Share of that under the isotropic sky.
    """
    years = [sunlit_year(weather, split_sky(weather, model)) for model in ("isotropic", sky)]
    reflected = ground_albedo * (1 - normal[:, 2]) / 2
    isotropic, other = (
        year.first_light(normal) + reflected * year.first_light(UP) for year in years
    )
    return np.divide(other - isotropic, isotropic, out=np.zeros(len(normal)), where=isotropic > 0)
