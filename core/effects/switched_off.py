"""What effects that are switched off leave out, or find too much: pilots with and without them.

Light beyond the last reflection is left out in the same way.

Each is looked at by itself, against light in which it is on. Before the run this gives its bound, with crowns in leaf
all year and some standard errors on top; after the run its outcome, from other random paths and with the crowns of each
month. Both are shares of light, of the kind and orientation of receivers that they change most.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..materials.read_albedo import brdfs_of_triangles
from ..sky.sky_models import split_sky
from ..sky.terrain_loss import sunlit_year
from ..trees.foliage import choose_foliage
from .closed_form import ground_view_of_tilt, sky_view_of_tilt
from .pilot import LONGEST, height_of_suns, surroundings_in, trace_pilot
from .specular import find_mirrors

BOUNDED = ("trees", "sky-rays", "shadow-rays", "reflections", "specular")
SURPLUS = ("trees", "sky-rays", "shadow-rays")  # without them too much light is found
JUDGED = (*BOUNDED, "far-ground")  # whose bound is a closed form
PATHS = 4 * 8192  # shares of single kinds and orientations are wanted
CERTAINTY = 4  # standard errors in a bound
OTHER = 0x07E2  # added to the seed for paths that are independent of those of the bound


class Light(NamedTuple):
    """Light of a year that m paths find, per DHI."""

    on: np.ndarray  # (m,) float64
    off: np.ndarray  # (m,) float64, with the effect switched off
    weight: np.ndarray  # (m,) float64
    group: np.ndarray  # (m,) int


def is_switched_off(inputs, key):
    """Whether the user has switched off an effect that something could be left out by."""
    request, effect = inputs.request, inputs.decided[key]
    usual = {"reflections": request.max_bounces != 0, "far-ground": request.far_ground}
    return not effect.on and effect.bound != 0 and not inputs.asked(key, usual.get(key, True))


def bound_off(inputs, key):
    """Bound of an effect that is switched off, or None if nothing receives light.

    Parameters
    ----------
    inputs : Inputs
        With all decisions.
    key : str
        Of BOUNDED.
    """
    found = shares_of_groups(light_of_year(inputs, key, inputs.request.seed, leafy=True))
    return max((share + CERTAINTY * error for share, error in found), default=None)


def is_left_out(inputs, key):
    """Whether paths can tell what is left out: of what is switched off, and beyond the last reflection."""
    return is_switched_off(inputs, key) or (key == "reflections" and bool(inputs.decided[key].bound))


def measure_left_out(inputs, key):
    """What an effect left out or found too much, from paths of their own: float or None.

    Parameters
    ----------
    inputs : Inputs
        With all decisions.
    key : str
        Of JUDGED.
    """
    found = shares_of_groups(light_of_year(inputs, key, inputs.request.seed + OTHER, leafy=False))
    return max((share for share, _ in found), default=None)


def shares_of_groups(light):
    """Difference of light as a share of it, without sign, and its standard error, of each group that has light.

    Parameters
    ----------
    light : Light or None

    Returns
    -------
    list of (float, float)
    """
    found = []
    for index in np.unique(light.group) if light is not None else ():
        members = light.group == index
        weight, on, off = light.weight[members], light.on[members], light.off[members]
        whole = weight @ on
        if whole > 0:
            share = weight @ (off - on) / whole
            # Linearised variance of a ratio of two weighted means of independent paths.
            error = np.sqrt(((weight * (off - on - share * on)) ** 2).sum()) / whole
            found.append((abs(float(share)), float(error)))
    return found


def light_of_year(inputs, key, seed, *, leafy):
    """Light with and without an effect, over the states of the trees: Light or None.

    Parameters
    ----------
    inputs : Inputs
    key : str
    seed : int
    leafy : bool
        Crowns carry leaves all year: what they take is most.
    """
    around, places = surroundings_of_year(inputs, key), counted_places(inputs, key)
    foliage = foliage_of(inputs) if key == "trees" else inputs.decided["trees"].setting
    share = 1.0 if leafy or foliage is None or not foliage.seasonal else share_in_leaf(inputs.weather, foliage.months)
    on = off = 0.0
    for bare, part in ((False, share), (True, 1 - share)):
        if not part:
            continue
        around = replace(around, canopy=foliage and foliage.canopy(bare))
        pilot = look(inputs, around, seed)
        if pilot is None:
            return None
        on = on + part * light_of_paths(pilot.sky, pilot.sun, around.suns.weight.sum(), places)
        off = off + part * light_without(inputs, key, pilot, around, seed)
    counted = ~pilot.inside  # covered parts of surfaces carry no modules
    return Light(*(values[counted] for values in (on, off, pilot.weight, pilot.group)))


def bounces_of(inputs):
    """Number of reflections, or the most that paths follow where the run finds it."""
    count = inputs.decided["reflections"].setting
    return LONGEST if count is None else count


def light_without(inputs, key, pilot, around, seed):
    """Light of the paths of a pilot if an effect is switched off: (m,) float64."""
    ratio, places = (
        around.suns.weight.sum(),
        1 + bounces_of(inputs),
    )
    if key == "shadow-rays":
        return light_of_paths(pilot.sky, pilot.open_sun, ratio, places)
    if key == "reflections":
        return light_of_paths(pilot.sky, pilot.sun, ratio, places)
    if key == "sky-rays":
        return light_of_open_sky(inputs.patches.normal[pilot.start].astype(float), around) + ratio * pilot.sun[:, 0]
    changed = {"trees": {"canopy": None}, "far-ground": {"ground_albedo": 0.0}, "specular": {"mirrors": None}}[key]
    without = look(inputs, replace(around, **changed), seed)  # from the same starts
    return light_of_paths(without.sky, without.sun, ratio, places)


def light_of_open_sky(normal, around):
    """Light of sky and far ground on (m, 3) normals with nothing in front of them: (m,) float64.   # Eq 6, 7"""
    sky = sky_view_of_tilt(normal, around.terrain)
    for source, ratio in around.sources:
        sky = sky + ratio * source.unshaded(normal) * source.seen(normal, around.terrain)
    level = 1 + around.suns.weight.sum() * (height_of_suns(around.suns, around.terrain) if len(around.suns) else 0.0)
    return sky + around.ground_albedo * level * ground_view_of_tilt(normal, around.terrain)


def light_of_paths(sky, sun, ratio, places):
    """Light of the first places of each path, one more than reflections: (m,) float64."""
    return sky[:, :places].sum(axis=1, dtype=float) + ratio * sun[:, :places].sum(axis=1, dtype=float)


def counted_places(inputs, key):
    """Places of a path whose light counts where an effect is on: the run's reflections, or all that paths follow."""
    return LONGEST + 1 if key == "reflections" else 1 + bounces_of(inputs)


def look(inputs, around, seed):
    """A pilot with surroundings of its own, without whose mirrors such faces are black: Pilot or None."""
    patches, laws = inputs.patches, brdfs_of_triangles(inputs.scene, inputs.request, inputs.materials)
    if (laws.index >= 0).any():
        share = np.float32(around.mirrors is not None)  # what mirrors reflect is known where paths go on
        patches = replace(patches, albedo=np.where(laws.index >= 0, share, patches.albedo))
    return trace_pilot(inputs.ray_scene, patches, inputs.scene, around, seed, PATHS)


def surroundings_of_year(inputs, key):
    """What lights a scene in the year of the weather, per light of the sky's dome: Surroundings without crowns.

    The suns are those of all hours; their weights are normal irradiance, circumsolar light included.
    """
    request = inputs.request
    year = sunlit_year(inputs.weather, split_sky(inputs.weather, inputs.decided["perez"].setting.model))
    reflected = inputs.decided["reflections"].on or key == "reflections"
    albedo = request.ground_albedo if key == "far-ground" else inputs.far_ground_albedo if reflected else 0.0
    # Without reflections no mirror is followed either: what mirrors would show is a part of what is left out.
    unseen = key == "reflections" and not inputs.decided[key].on and inputs.asked("specular", True)
    mirrors = find_mirrors(inputs) if key == "specular" or inputs.decided["specular"].on or unseen else None
    return surroundings_in(year, albedo, terrain=inputs.terrain, mirrors=mirrors)


def foliage_of(inputs):
    """Foliage of the trees that are switched off; None without any."""
    crowns = inputs.scene.trees
    if crowns is None:
        return None
    return choose_foliage(crowns, inputs.request, inputs.scene.site.latitude)


def share_in_leaf(weather, months):
    """Share of the year's light on level ground in the months with leaves."""
    data = weather.data
    light = np.nan_to_num(data["ghi"].to_numpy(float))
    return float(light[np.isin((data.index + weather.interval / 2).month, months)].sum() / max(light.sum(), 1e-9))
