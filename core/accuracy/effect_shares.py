"""What effects of the modules, and Perez's sky, make of the full load hours: computed with each of them switched."""

from dataclasses import replace

import numpy as np

from ..energy.compute_energy import compute_energy
from ..energy.pv_system import ELECTRIC
from ..light.transfer import SourceLight, take_rows
from ..sun.sky_models import sources_of

MOST_SURFACES = 64  # looked at, as evenly over the area as the eligible surfaces are

SWITCHED_ON = {"on": True, "extent": "simulated", "reason": "switched on", "bound": 0.0, "outcome": None}
SWITCHED_OFF = {"on": False, "extent": "left out", "reason": "switched off", "bound": None, "outcome": None}
KEY = "perez"
ISOTROPIC = "isotropic"


def shares_of_effects(transfer, weather, system, threads=None, *, sky="isotropic"):
    """Share of full load hours that each effect of the modules adds, or takes if negative.

    Parameters
    ----------
    transfer : Transfer
        Of it MOST_SURFACES eligible surfaces are looked at, or all if no more are eligible.
    weather : Weather
    system : PvSystem
    threads : int, optional
    sky : str
        Model of the diffuse sky, as of `compute_energy`.

    Returns
    -------
    dict of str to float
        (with - without)/with, of the area-weighted full load hours; empty if no surface is eligible.
    """
    rows, weight = draw_surfaces(transfer.surfaces)
    few = take_rows(transfer, rows)
    if not len(rows):
        return {}

    def hours(switched):
        energy = compute_energy(few, weather, replace(system, **switched), threads, sky=sky)
        return float(weight @ np.nan_to_num(energy.full_load_hours))

    as_set, found = hours({}), {}
    for key in ELECTRIC:
        as_switched = getattr(system, key)
        other = hours({key: not as_switched})
        on, off = (as_set, other) if as_switched else (other, as_set)
        found[key] = (on - off) / on if on > 0 else 0.0
    return found


def state_effects(summary, transfer, weather, system, *, sky, threads=None):
    """Write the measured shares into the effects of a summary; without a plan (a file of long ago) there are none.

    Parameters
    ----------
    summary : dict
        Of `summarise`; changed.
    transfer : Transfer
    weather : Weather
    system : PvSystem
        Of this year's electricity, which may differ from that of the run that was traced, as may the sky.
    sky : str
        Model of the sky that weighed the Transfer.
    threads : int, optional

    Returns
    -------
    dict of str to float
        Of `shares_of_effects`.
    """
    shares = shares_of_effects(transfer, weather, system, threads, sky=sky)
    if shares:
        found = {key: (share, abs(share), getattr(system, key)) for key, share in shares.items()}
        found[KEY] = *share_of_sky(transfer, weather, system, threads), sky == KEY
        state_shares(summary, found)
    return shares


def state_shares(summary, found):
    """Write share and outcome of effects, `found` by key: share, what is left out without it, and whether it is on."""
    for effect in summary["traced"].get("effects") or ():
        if effect["key"] not in found:
            continue
        share, most, on = found[effect["key"]]
        if on != effect.get("on", on):  # decided anew by `citypv yield`
            effect.update(SWITCHED_ON if on else SWITCHED_OFF)
        effect["share"] = share
        if not on or not effect.get("outcome"):
            left_out = 0.0 if on else most
            bound = left_out if effect.get("bound") is None else effect["bound"]
            effect["outcome"] = {"left_out": left_out, "holds": bool(left_out <= bound)}


def draw_surfaces(surfaces):
    """Eligible surfaces, or of many some at equal steps of their summed area, ordered by tilt and azimuth.

    Returns
    -------
    rows : (k,) int
    weight : (k,) float64
    """
    rows = np.flatnonzero(surfaces.eligible)
    if len(rows) <= MOST_SURFACES:
        return rows, surfaces.area[rows]
    order = rows[np.lexsort([surfaces.surface_azimuth[rows], surfaces.surface_tilt[rows]])]
    area = np.cumsum(surfaces.area[order])
    steps = (np.arange(MOST_SURFACES) + 0.5) / MOST_SURFACES * area[-1]
    return order[np.searchsorted(area, steps)], np.ones(MOST_SURFACES)


def share_of_sky(transfer, weather, system, threads=None):
    """Share of full load hours that Perez's sky adds, or takes if negative.

    Where a source of light was not traced, each surface sees as much of it as of the sky that it faces.

    Returns
    -------
    share : float
        (Perez - isotropic)/Perez, of the area-weighted full load hours.
    largest : float
        The same of the kind and orientation where it is largest, without sign.
    """
    rows, weight = draw_surfaces(transfer.surfaces)
    few = with_sources(take_rows(transfer, rows))
    of_sky = [compute_energy(few, weather, system, threads, sky=sky).full_load_hours for sky in (KEY, ISOTROPIC)]
    names = np.char.add(np.asarray(few.surfaces.kind, str), np.asarray(few.surfaces.orientation, str))
    groups = [np.where(names == name, weight, 0) for name in np.unique(names)]
    perez, isotropic = np.nan_to_num(of_sky)
    sums = ((one @ perez, one @ (perez - isotropic)) for one in (weight, *groups))
    share, *of_groups = (float(change / whole) if whole > 0 else 0.0 for whole, change in sums)
    return share, max(map(abs, of_groups))


def with_sources(transfer):
    """A Transfer, and its state without leaves, whose surfaces see as much of each source of light as of the sky."""
    bare = transfer.bare and with_sources(transfer.bare)
    normal = np.asarray(transfer.surfaces.normal, float)
    openness = np.clip(transfer.sky_view_factor / np.maximum((1 + normal[:, 2]) / 2, 1e-9), 0, 1)
    views = {one.name: one.unshaded(normal) * openness for one in sources_of(KEY)}
    estimated = {name: SourceLight(view, view, np.zeros(len(view))) for name, view in views.items()}
    return replace(transfer, bare=bare, sources=estimated | transfer.sources)
