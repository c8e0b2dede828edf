"""The error budget of a run: what each source of error does to full load hours, of groups and of
single surfaces.
"""

import numpy as np
import pandas as pd

from ..effects.beyond_scene import change_unshaded
from ..energy.standard_errors import errors_of_energy
from ..light.trace_gather import SUNS
from ..light.traced import SKY_DOME
from ..settings.progress import describe_duration
from ..sky.sky_models import split_sky
from .rounds_to_target import rounds_needed
from .sun_sampling import name_groups
from .yield_errors import CURES, SAMPLED, SOURCES, seconds_of_rounds, split_errors


def bound_cut_reflections(transfer, weather, energy, margin=1.25):
    """Share of the full load hours that reflections after the last one would add at most.

    Of sky and suns, whose shares hold whatever the weather, the larger one counts; light of sources
    in the sky, such as Perez' horizon, has its own. The margin is for the weather, which weighs
    single suns otherwise than the run, and for hours that are not in proportion to light: against
    40 reflections it takes up to 1.12.

    Parameters
    ----------
    transfer : Transfer
    weather : Weather
    energy : Energy

    Returns
    -------
    dict of str to float or None
        Of each kind and orientation, and "all". None: no bound is known.
    """
    # per_hour  from sums of irradiance [Wm⁻²] to a year's [kWh/m²].
    names, sky, bounds = name_groups(transfer.surfaces), split_sky(weather, energy.sky), {}
    per_hour = weather.interval / pd.Timedelta(hours=1) / energy.years / 1000.0
    # The bounds that tracing left, for trees in leaf and bare: the larger one counts.
    counted = energy.eligible & np.isfinite(energy.poa_global_annual)
    states = [one.record for one in (transfer, transfer.bare) if one is not None]
    told = [(state and state.cut_reflections) or {} for state in states]
    for name in ["all", *(" ".join(group) for group in energy.groups)]:
        # Light of the group in a year, by area; without it, or without a bound, nothing is known.
        weight = np.where(counted & ((names == name) | (name == "all")), energy.counted_area, 0)
        light = weight[counted] @ energy.poa_global_annual[counted]
        shares = [of_state.get(name) or {} for of_state in told]
        most = {key: [one.get(key) for one in shares] for key in (SKY_DOME, SUNS, *sky.sources)}
        if not light > 0 or any(None in of_light for of_light in most.values()):
            bounds[name] = None
            continue
        # Part of that light from each traced source, to which its own bound applies; the rest has
        # the one of sky and suns, whichever is larger.
        parts = {
            key: weight @ transfer.sources[key].relative * of_source.sum() * per_hour / light
            for key, of_source in sky.sources.items()
        }
        share = max(most[SKY_DOME] + most[SUNS]) * (1 - sum(parts.values()))
        share += sum(max(most[key]) * max(part, 0.0) for key, part in parts.items())
        bounds[name] = float(margin * share)
    return bounds


def budget_groups(transfer, weather, energy, cut):
    """Error budget of the mean full load hours of each group.

    Parameters
    ----------
    transfer : Transfer
    weather : Weather
    energy : Energy
    cut : dict
        Of `bound_cut_reflections`.

    Returns
    -------
    dict
        Kind and orientation -> source -> {"hours", "percent"}, of the group's mean full load hours;
        both None where the source was not measured. Sources: sampling, sun_sampling,
        cut_reflections, patch_size, far_ground, string_shade, sky_model.
    """
    # Errors of single surfaces, and what the run recorded of its effects.
    errors = errors_of_energy(transfer, weather, energy)
    area, names = np.asarray(transfer.surfaces.area, float), name_groups(transfer.surfaces)
    effects = {
        effect["key"]: effect for effect in (transfer.record.effects if transfer.record else ())
    }
    # Surfaces of each group whose error is known, and the direction that they face on the whole.
    parts = [
        (names == " ".join(name)) & energy.eligible & np.isfinite(errors.own)
        for name in energy.groups
    ]
    facing = np.array(
        [area[members] @ transfer.surfaces.normal[members] for members in parts]
    ).reshape(-1, 3)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-12)
    # For information: what Perez's sky changes on unshaded planes that face as the groups do.
    sky_model, budgets = change_unshaded(weather, facing, transfer.ground_albedo), {}
    # Each source as a share of the group's mean hours; None where it was not measured, or where the
    # group has no hours to compare it with. Suns and far ground have one share for the whole city.
    for name, members, change in zip(energy.groups, parts, sky_model.tolist(), strict=True):
        weight = area[members] / max(energy.counted_area[members].sum(), 1e-12)
        hours = float(weight @ energy.full_load_hours[members])
        share = {
            "sampling": np.sqrt(errors.noise_of_mean(weight, members)) / hours
            if hours > 0
            else None,
            "sun_sampling": transfer.sun_sampling_share("of_groups"),
            "cut_reflections": cut.get(" ".join(name)),
            "patch_size": weight @ errors.discretisation[members] / hours if hours > 0 else None,
            "far_ground": effects.get("far-ground", {}).get("bound"),
            "string_shade": _known(weight @ energy.string_loss[members] / hours)
            if hours > 0
            else None,
            "sky_model": change,
        }
        # Told in hours and in percent of the mean.
        budgets[" ".join(name)] = {
            source: {
                "hours": None if part is None else part * hours,
                "percent": None if part is None else 100 * part,
            }
            for source, part in share.items()
        }
    return budgets


def _known(share):
    """A number, or None where it is NaN."""
    return None if np.isnan(share) else share


def _budget_surfaces(errors):
    """Error of half and of 95 % of the eligible area, from each source alone and from all: dict of
    percent.
    """
    # Each source alone is all errors without the other sources.
    without = {source: [other for other in SOURCES if other != source] for source in SOURCES} | {
        "all": ()
    }
    return {
        source: {
            "median": errors.at_share(without=others, share=0.5),
            "at_95": errors.at_share(without=others),
        }
        for source, others in without.items()
    }


def suggest_more(transfer, weather, energy, *, timed=True):
    """One sentence on what would halve the error, or "".

    `timed`: whether the seconds of the run tell what more would take; not where it compiled.
    """
    errors = split_errors(transfer, weather, energy)
    largest = errors.largest()
    if largest is None or transfer.record is None or not errors.at_share() > 0:
        return ""
    # If samples lower the largest part, say for how long; else name the option that does.
    start = (
        f"Full load hours: standard error at most {errors.at_share():.2f} % on 95 % of the "
        "area with modules; "
    )
    needed = rounds_needed(errors, errors.at_share() / 2)
    if np.isfinite(needed) and largest in SAMPLED:
        seconds = seconds_of_rounds(transfer) * (needed - 1)
        more = (
            f"{describe_duration(seconds)} more"
            if timed and np.isfinite(seconds)
            else f"{needed:.1f} times the samples"
        )
        return f"{start}{more} would halve it: most of it is due to {SOURCES[largest]}."
    return f"{start}most of it is due to {SOURCES[largest]}: {CURES[largest]} would lower it."


def budget_errors(transfer, energy, weather):
    """Error budget of the full load hours, in percent.

    - `sampling_total`: standard error of the mean over the counted area of all eligible surfaces,
      from rays and points.
    - `sampling_median`, `sampling_95`: standard error of single eligible surfaces, median and 95th
      percentile by
      counted area, among those with at least a tenth of the mean hours: walls hidden by a neighbour
      have a few or none.
    - `surfaces`: what each source alone does to a surface: shadow points, rays, light passed on,
      discretisation, choice of suns.
    - `groups`: what each source does to the mean of each group, in hours and percent, as `meaning`
      says.
    - `bounces`: upper bound of what reflections beyond the last one could add; by photons to all
      light, else to the
      eligible surfaces' hours, and of each group in `groups`.
    - `string_shade`: what strings of modules lose in shade, of the energy of single modules; not
      set here, but by the summary.
    - `patches`: discretisation error of reflected light, from light uneven within the cells of
      patches; one third of
      the measured effect of light that is uneven between the cells.
    - `sun_sampling`: the record of what the choice of suns does, as tracing measured it.

    Entries on sampling, surfaces and groups are missing where no eligible surface has hours,
    `patches` and `sun_sampling` where they were not measured; `bounces` is None where no bound is
    known.
    """
    # What further reflections would add: the bound that tracing left. A run by photons has none:
    # there the sum of a geometric series counts.
    record, budget = transfer.record, {"unit": "percent", "bounces": None}
    cut = bound_cut_reflections(transfer, weather, energy)
    if cut["all"] is not None:
        budget["bounces"] = 100 * cut["all"]
    elif record is not None and record.photons_per_source and record.brightest_albedo < 1:
        # The energy of each reflection is at most the albedo times the one before.
        last = (
            max(record.last_bounce_share_diffuse, record.last_bounce_share_direct)
            if record.max_bounces
            else 1.0
        )
        budget["bounces"] = 100 * last * record.brightest_albedo / (1 - record.brightest_albedo)
    # Errors by sampling of the mean, of single surfaces, and of groups, if there are any hours.
    eligible = energy.eligible & np.isfinite(energy.full_load_hours)
    whole = float(energy.full_load_hours[eligible] @ transfer.surfaces.area[eligible])
    errors = split_errors(transfer, weather, energy)
    if whole > 0:
        budget["sampling_total"] = (
            100 * energy.sampling_error * energy.counted_area[eligible].sum() / whole
        )
        budget["sampling_median"], budget["sampling_95"] = (
            errors.at_share(share=0.5),
            errors.at_share(),
        )
        budget["surfaces"] = _budget_surfaces(errors)
        budget["groups"] = budget_groups(transfer, weather, energy, cut)
        # Source -> what its number is.
        budget["meaning"] = {
            "sampling": (
                "standard error: rays and shadow points, with the light that other surfaces pass on"
            ),
            "sun_sampling": (
                "standard error: what the traced suns change against every hour's, measured on "
                "patches of the city, as rms over its groups"
            ),
            "cut_reflections": "bound: light that reflections after the last one would add",
            "patch_size": (
                "estimate, signed: light that is uneven within the elements of patches, of "
                "surfaces where it counts"
            ),
            "far_ground": "bound: what was left out of the light of the far ground",
            "string_shade": (
                "for information: what strings of modules lose in shade, counted with --strings "
                "string only"
            ),
            "sky_model": (
                "for information: unshaded planes that face as the group does, by the Perez over "
                "the isotropic sky"
            ),
        }
    # Errors by discretisation and by the choice of suns, as tracing measured them.
    if record and record.discretisation_error:
        budget["patches"] = 100 * max(map(abs, record.discretisation_error.values())) / 3
    if record and record.sun_sampling:
        budget["sun_sampling"] = record.sun_sampling
    return budget
