"""What Perez's sky makes of the full load hours, computed from the same Transfer with both skies."""

from dataclasses import replace

import numpy as np

from ..effects.judge_effects import judge
from ..energy.compute_energy import compute_energy
from ..light.transfer import SourceLight, take_rows
from ..sky.light_sources import sources_of
from .effect_shares import draw_surfaces

KEY = "perez"
ISOTROPIC = "isotropic"


def state_sky(summary, transfer, weather, system, *, sky, threads=None):
    """Write share and outcome of `perez` into the effects of a summary; without a plan there are none.

    Parameters
    ----------
    summary : dict
        Of `summarise`; changed.
    transfer : Transfer
        Of which at most `effect_shares.MOST_SURFACES` surfaces are looked at.
    weather : Weather
    system : PvSystem
    sky : str
        Model of the sky that weighed the Transfer.
    threads : int, optional
    """
    effect = next((one for one in summary["traced"].get("effects") or () if one["key"] == KEY), None)
    if effect is None or not transfer.surfaces.eligible.any():
        return
    on, (share, largest) = sky == KEY, share_of_sky(transfer, weather, system, threads)
    if on != effect["on"]:  # decided anew by `citypv yield`
        effect |= {"on": on, "reason": "as asked", "bound": 0.0 if on else None, "outcome": None}
        effect["extent"] = "dome, circumsolar light and horizon" if on else "isotropic sky"
    effect["share"] = share
    if not on or not effect.get("outcome"):
        effect["outcome"] = judge(0.0 if on else largest, effect["bound"])


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
    share, *of_groups = (change(*np.nan_to_num(of_sky), one) for one in (weight, *groups))
    return share, max(map(abs, of_groups))


def change(perez, isotropic, weight):
    """Relative difference of weighted sums; 0 where there is nothing."""
    whole = float(weight @ perez)
    return float(weight @ (perez - isotropic)) / whole if whole > 0 else 0.0


def with_sources(transfer):
    """A Transfer, and its state without leaves, whose surfaces see as much of each source of light as of the sky."""
    bare = transfer.bare and with_sources(transfer.bare)
    normal = np.asarray(transfer.surfaces.normal, float)
    openness = np.clip(transfer.sky_view_factor / np.maximum((1 + normal[:, 2]) / 2, 1e-9), 0, 1)
    views = {one.name: one.unshaded(normal) * openness for one in sources_of(KEY)}
    estimated = {name: SourceLight(view, view, np.zeros(len(view))) for name, view in views.items()}
    return replace(transfer, bare=bare, sources=estimated | transfer.sources)
