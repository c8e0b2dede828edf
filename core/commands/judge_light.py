"""After a run: what effects left out of the light of the year, against their bounds.

`terrain-horizon` left out: the light behind the horizon is compared with that without; simulated: the light behind the
horizons that the corners of the scene have with that behind the one of its middle. Both are of the same Transfer, so
that nothing is traced again. What else is switched off, and what lies beyond the last reflection, is measured by pilots
(`effects.switched_off`).
"""

from dataclasses import replace

import numpy as np

from ..effects.judge_effects import judge
from ..effects.switched_off import JUDGED, is_left_out, measure_left_out
from ..horizon.lost_sky import lost_sky
from ..light.transfer import take_rows
from ..results.effect_shares import draw_surfaces
from ..sky.light_sources import SOURCES
from ..study import compute_energy

KEY = "terrain-horizon"
UP = np.array([[0.0, 0.0, 1.0]])
LEAST = 1e-9  # of a share, below which none is divided by it


def judge_light(transfer, plan, weather, request):
    """Write the outcome of effects that need the year's weather into the record of a Transfer.

    Parameters and return value as of `judge_terrain`.
    """
    transfer, inputs = judge_terrain(transfer, plan, weather, request), plan.inputs
    found = {key: measure_left_out(inputs, key) for key in JUDGED if inputs and is_left_out(inputs, key)}
    effects = [with_outcome(one, found.get(one["key"])) for one in transfer.record.effects]
    return replace(transfer, record=replace(transfer.record, effects=effects))


def with_outcome(effect, left_out):
    """An effect as dict with what paths found that it left out, unless the run itself has found more."""
    if left_out is None:
        return effect
    known = (effect["outcome"] or {}).get("left_out", 0.0)
    return effect | {"outcome": judge(max(left_out, known), effect["bound"])}


def judge_terrain(transfer, plan, weather, request):
    """Write outcome and share of `terrain-horizon` into the record of a Transfer; without a horizon there are none.

    Parameters
    ----------
    transfer : Transfer
    plan : EffectPlan
        Of its run.
    weather : Weather
    request : Request

    Returns
    -------
    Transfer
    """
    effect, record = plan[KEY], transfer.record
    if effect.setting is None:
        return transfer
    whole, largest = changes_of_light(transfer, effect.setting.others, weather, request)
    found = {"outcome": judge(max(largest, default=0.0), effect.bound)}
    if not effect.on:
        found["share"] = whole[0] / (1 + whole[0]) if whole[0] > -1 else None
    effects = [one | found if one["key"] == KEY else one for one in record.effects]
    return replace(transfer, record=replace(record, effects=effects))


def changes_of_light(transfer, horizons, weather, request):
    """What other horizons make of the light of a year.

    Parameters
    ----------
    transfer : Transfer
    horizons : list of TerrainHorizon
    weather : Weather
    request : Request

    Returns
    -------
    whole : list of float
        For each horizon, relative change of the irradiation of all surfaces that count.
    largest : list of float
        The same of the kind and orientation where it is largest, without sign.
    """
    rows, weight, group = draw_from_groups(transfer.surfaces)
    few = take_rows(transfer, rows)
    electric = replace(request, series=())

    def light_of(one):
        energy = compute_energy(one, weather, electric)
        return np.bincount(group, weight * np.nan_to_num(energy.poa_global_annual))

    own, whole, largest = light_of(few), [], []
    for horizon in horizons:
        other = light_of(behind(few, horizon))
        lit = own > 0
        whole.append(float(other.sum() / own.sum() - 1) if lit.any() else 0.0)
        largest.append(float(np.abs(other[lit] / own[lit] - 1).max(initial=0)))
    return whole, largest


def draw_from_groups(surfaces):
    """Some surfaces of each kind and orientation that count, and the area for which each stands.

    Returns
    -------
    rows : (k,) int
    weight : (k,) float64 [m²]
    group : (k,) int
    """
    eligible = np.asarray(surfaces.eligible, bool)
    wanted = eligible if eligible.any() else np.ones(len(eligible), bool)
    names = np.char.add(np.char.add(np.asarray(surfaces.kind, str), " "), np.asarray(surfaces.orientation, str))
    rows, weight, group = [], [], []
    for index, name in enumerate(np.unique(names[wanted])):
        chosen, share = draw_surfaces(replace(surfaces, eligible=wanted & (names == name)))
        area = float(np.asarray(surfaces.area)[wanted & (names == name)].sum())
        rows.append(chosen)
        weight.append(share * area / max(share.sum(), LEAST))
        group.append(np.full(len(chosen), index))
    return tuple(map(np.concatenate, (rows, weight, group)))


def behind(transfer, horizon):
    """A Transfer, and its state without leaves, as it would be behind another horizon.

    Of the sky between the two horizons each surface sees as much as of all the sky that it faces. Terrain reflects what
    the far ground does. What other surfaces reflect changes as the light of level ground.

    Parameters
    ----------
    transfer : Transfer
    horizon : TerrainHorizon

    Returns
    -------
    Transfer
    """
    normal = np.asarray(transfer.surfaces.normal, float)
    before, after = ((0.0 if one is None else lost_sky(normal, one)) for one in (transfer.terrain, horizon))
    of_level = [0.0 if one is None else float(lost_sky(UP, one)[0]) for one in (transfer.terrain, horizon)]
    seen = np.maximum((1 + normal[:, 2]) / 2 - before, LEAST)
    openness = np.clip(transfer.sky_view_factor / seen, 0, 1)
    hidden, dark = (after - before) * openness, 1 - transfer.ground_albedo
    first = transfer.sky_view_factor + transfer.ground_albedo * transfer.far_ground_view_factor
    reflected = np.maximum(transfer.diffuse_relative - first, 0)
    ground = transfer.far_ground_view_factor + (hidden if transfer.ground_albedo else 0.0)
    return replace(
        transfer,
        bare=transfer.bare and behind(transfer.bare, horizon),
        terrain=horizon,
        sky_view_factor=np.maximum(transfer.sky_view_factor - hidden, 0),
        far_ground_view_factor=np.clip(ground, 0, 1),
        diffuse_relative=transfer.diffuse_relative - dark * (hidden + reflected * (of_level[1] - of_level[0])),
        sources={
            name: source_behind(light, SOURCES[name], (transfer.terrain, horizon), normal, openness)
            for name, light in transfer.sources.items()
        },
    )


def source_behind(light, source, horizons, normal, openness):
    """Light of a traced source as it would be behind another horizon: SourceLight.

    Where the first horizon hides all of it, as much of it is seen behind the other as of the sky.
    """
    before, after = (source.seen(normal, one) for one in horizons)
    seen = before > LEAST
    ratio = np.divide(after, before, out=np.zeros(len(normal)), where=seen)
    unknown = np.where(seen, 0.0, openness * after * source.unshaded(normal))
    values = {name: getattr(light, name) * ratio + unknown for name in ("view_factor", "relative")}
    return replace(light, **values)
