"""Power that strings of modules keep when shade moves over them, hour by hour.

Each traced sun has the mean loss of a surface's strings at some shares d of diffuse and reflected
light (`light.string_shade`). An hour takes it from the suns that represent it, and between the two
nearest d.
"""

import numpy as np
from numba import njit

from ..light.string_shade import LOSS_STEP


def kept_by_strings(losses, hours, direct, diffuse, projection):
    """Power of strings over the power of modules with a maximum power point each.

    Parameters
    ----------
    losses : (s, d, n) uint8
        As of `string_shade.add_losses`, sun by sun.
    hours : Hours
        h of them.
    direct, diffuse : (h, n) float [Wm⁻²]
        Irradiance on the surfaces: from the sun's place, as a mean over lit and shaded parts, and
        all other.
    projection : (h, n) float
        Cosine of the angle of incidence.

    Returns
    -------
    (h, n) float
        1 where no shade moves over strings.
    """
    # In one type, for which one loop is compiled.
    kept = np.ones(direct.shape, np.float32)
    weight, sunward = hours.match_weight, np.ascontiguousarray(hours.sunward[:, 0])
    _keep(
        losses,
        (hours.match, *(part.astype(np.float32, copy=False) for part in (weight, sunward))),
        tuple(part.astype(np.float32, copy=False) for part in (direct, diffuse, projection)),
        # As many steps of d lie between 0 and 1 as the d at which losses are kept divide it into.
        (losses.shape[1] + 1, LOSS_STEP),
        kept,
    )
    return kept


@njit(nogil=True, cache=True)
def _keep(losses, hours, light, steps, kept):
    """Write the share of power that strings keep, where they lose any.

    d is the share of the light in full sun that is left in the shade. `losses` (suns, parts - 1,
    surfaces) count, in units of `step`, the power that is lost at d = 1/parts, 2/parts …, as a
    share of that in full sun; times whole / received it is a share of what the surface receives.
    `steps` are `parts` and `step`; further parameters as of `kept_by_strings`. `kept`, (h, n), is
    changed only at hours and surfaces with a loss.
    """
    (match, weight, sunward), (direct, diffuse, projection), (parts, step) = hours, light, steps
    some = np.zeros(kept.shape[1], np.uint8)
    for hour in range(len(kept)):
        # An hour without light from the sun's place keeps what stands in `kept`.
        if sunward[hour] <= 0:
            continue
        # Most strings are lit or dark as a whole. Surfaces without a loss at the middle d under any
        # sun of the hour are skipped, as are surfaces that face away from it.
        for surface in range(kept.shape[1]):
            some[surface] = 0
        for own in range(match.shape[1]):
            for surface in range(kept.shape[1]):
                some[surface] |= losses[match[hour, own], parts // 2 - 1, surface]
        for surface in range(kept.shape[1]):
            if some[surface] == 0 or projection[hour, surface] <= 0:
                continue
            # All light of a place in the sun, and the share of it that is left in the shade.
            whole = projection[hour, surface] * sunward[hour] + diffuse[hour, surface]
            received = direct[hour, surface] + diffuse[hour, surface]
            # The loss is taken in proportion between the two nearest d at which losses are kept.
            place = diffuse[hour, surface] / whole * parts
            node = min(int(place), parts - 1)
            above = place - node
            # Mean of the suns that represent the hour; nothing is lost at d = 0 and at d = 1.
            loss = 0.0
            for own in range(match.shape[1]):
                sun = match[hour, own]
                if node > 0:
                    loss += weight[hour, own] * (1 - above) * losses[sun, node - 1, surface]
                if node < parts - 1:
                    loss += weight[hour, own] * above * losses[sun, node, surface]
            share = step * loss * whole / received if received > 0 else 0.0
            if share > 0:
                kept[hour, surface] = max(1 - share, 0.0)
