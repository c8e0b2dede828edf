"""`reflections`: how often light is followed from surface to surface."""

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from ..sun.plausible_years import even_year, hours_of_suns, plausible_years
from ..sun.sky_models import split_sky
from ..sun.terrain_loss import sunlit_year
from .effect import Effect
from .perez import choose_model
from .pilot import LONGEST, surroundings_in, trace_pilot

KEY = "reflections"
WHOLE_TARGET = 0.002  # share of the light of all receivers that automatic reflections may leave out
GROUP_TARGET = 0.005  # of those of one kind and orientation
CERTAINTY = 2  # standard errors added to what the pilot measures; of many groups as many more as hold as surely for all
NONE = "no bounce, no matrix"


class Lit(NamedTuple):
    """Light of a year that m paths find, per light of the sky's dome."""

    beyond: np.ndarray  # (m, LONGEST + 2) float64, column n: reflected n times or more
    alive: np.ndarray  # (m,) float32, weight after the last reflection
    most: float  # the most that a place that sees all of the year could receive
    weight: np.ndarray  # (m,) float64
    group: np.ndarray  # (m,) int


def decide(inputs):
    """How many bounces: as asked, or the fewest beyond which the pilot finds next to no light."""
    request = inputs.request
    ground_albedo = request.ground_albedo if inputs.asked("far-ground", request.far_ground) else 0.0
    brightest = max(float(inputs.patches.albedo.max(initial=0)), ground_albedo)
    count = request.max_bounces
    if brightest == 0 and not inputs.asked(KEY):
        return Effect(KEY, False, NONE, "every albedo is 0", 0.0, setting=0, share=0.0)
    share = expected_share(inputs)
    if not inputs.asked(KEY, count != 0):
        bound = bound_beyond(look_if_wanted(inputs), 0, brightest)
        return Effect(KEY, False, NONE, "switched off", bound, setting=0, share=share)
    reason = "as asked"
    if count is None or count == 0:
        count, reason = choose_count(inputs, brightest)
    bound = 0.0 if inputs.unshaded else bound_beyond(look_if_wanted(inputs), count, brightest)
    words = f"{count} bounce{'s' if count != 1 else ''}"
    return Effect(KEY, True, words, reason, bound, setting=count, share=share)


def choose_count(inputs, brightest):
    """Number of bounces and the reason for it."""
    if inputs.unshaded:
        return 1, "nothing but the far ground stands in front of the surfaces"
    lit = look_at_years(inputs)
    for count in range(1, LONGEST):
        bound = bound_beyond(lit, count, brightest)
        whole = [left_out(one, count, brightest) for one in lit]
        if bound is not None and bound <= GROUP_TARGET and max(whole, default=0.0) <= WHOLE_TARGET:
            words = f"a pilot finds at most {100 * max(whole, default=0.0):.2f} % of the light beyond, "
            return count, f"{words}{100 * bound:.2f} % of any group's"
    return LONGEST, "the most that are followed; the pilot finds light beyond them"


def look_if_wanted(inputs):
    """The same as `look_at_years` if they have been looked at, or may be; else None. None where nothing shades."""
    return None if inputs.pilot_if_wanted is None else look_at_years(inputs)


def look_at_years(inputs):
    """Paths lit by the year of the weather, a clear and an overcast one, in every state of the trees: list of Lit."""
    if inputs.lit_years is None:
        foliage = inputs.decided["trees"].setting
        states = (True, False) if foliage is not None and foliage.seasonal else (False,)  # bare, in leaf
        inputs.lit_years = []
        for year in years_of(inputs):
            for bare in states:
                canopy = foliage and foliage.canopy(bare)
                around = surroundings_in(year, inputs.far_ground_albedo, canopy=canopy, terrain=inputs.terrain)
                pilot = trace_pilot(inputs.ray_scene, inputs.patches, inputs.scene, around, inputs.request.seed)
                inputs.lit_years += [] if pilot is None else [light_beyond(pilot, year)]
    return inputs.lit_years


def years_of(inputs):
    """What may light the scene: list of SunlitYear; an even sky where nothing is known of the suns."""
    model, weather, suns = choose_model(inputs), inputs.weather, inputs.suns
    if weather is not None:
        return [sunlit_year(weather, split_sky(weather, model)), *plausible_years(weather, model)]
    return [even_year()] if suns is None or not len(suns) else plausible_years(hours_of_suns(suns), model)


def light_beyond(pilot, year):
    """Light of the paths of a pilot that `year` lit: Lit."""
    dome = max(year.dome, 1e-9)
    ratio = year.direct.sum() / dome
    light = pilot.sky.astype(float) + ratio * pilot.sun
    beyond = np.zeros((len(light), LONGEST + 2))
    beyond[:, :-1] = light[:, ::-1].cumsum(axis=1)[:, ::-1]
    most = 1 + ratio + sum(max(light, 0.0) / dome for light in year.sources.values())
    counted = ~pilot.inside  # covered parts of surfaces carry no modules
    return Lit(beyond[counted], pilot.alive[counted], most, pilot.weight[counted], pilot.group[counted])


def share_beyond(lit, bounces, members=slice(None)):
    """Share of light that is reflected more often than `bounces` times, with its standard error.

    Parameters
    ----------
    lit : Lit
    bounces : int
    members : (m,) bool, optional
        Paths of one group.

    Returns
    -------
    tuple of two float
    """
    weight, whole, beyond = lit.weight[members], lit.beyond[members, 0], lit.beyond[members, bounces + 1]
    mean = weight @ whole
    if not mean > 0:
        return 0.0, 0.0
    share = weight @ beyond / mean
    # Linearised variance of a ratio of two weighted means of independent paths.
    return float(share), float(np.sqrt(((weight * (beyond - share * whole)) ** 2).sum()) / mean)


def left_out(lit, count, brightest, members=slice(None), certainty=CERTAINTY):
    """Share of light beyond a number of bounces, with its uncertainty; None if paths are still on their way."""
    share, error = share_beyond(lit, count, members)
    alive = float(lit.weight[members] @ lit.alive[members])
    if alive and brightest >= 1:
        return None
    whole = float(lit.weight[members] @ lit.beyond[members, 0]) or 1.0
    return share + certainty * error + (alive * lit.most / (1 - brightest) / whole if alive else 0.0)


def bound_beyond(lit, count, brightest):
    """The largest share of light that any group of receivers loses in any year beyond a number of bounces.

    Without paths the worst case: ρⁿ⁺¹/(1 - ρ) of the first light, at the brightest albedo. None: no bound exists.
    """
    if lit is None:
        return brightest ** (count + 1) / (1 - brightest) if brightest < 1 else None
    found = [0.0]
    for one in lit:
        groups = np.unique(one.group)
        surely = certainty_of(len(groups))
        found += [left_out(one, count, brightest, one.group == index, surely) for index in groups]
    return None if None in found else max(found)


def certainty_of(groups):
    """Standard errors with which all of so many groups hold as surely as one with CERTAINTY: float."""
    return float(-ndtri(ndtr(-CERTAINTY) / max(groups, 1)))


def expected_share(inputs):
    """Share of full load hours that reflections between surfaces make, without the far ground's first one."""
    pilot = inputs.pilot_if_wanted
    if pilot is None:
        return None
    ratio = inputs.direct_over_diffuse
    light = pilot.weight @ (pilot.sky.astype(float) + ratio * pilot.sun)
    far = pilot.weight @ (pilot.far_sky.astype(float) + ratio * pilot.far_sun)
    return float((light[1:].sum() - far) / light.sum()) if light.sum() > 0 else None
