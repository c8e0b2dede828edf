"""How racks are called: after the roof that they stand on."""

import numpy as np

from ..city.grid_cells import whole_of_cell

RACK = "rack"  # the kind
MARK = "/rack"


def name_rack(roof, number):
    """Id of a roof's rack, counted from 1."""
    return f"{roof}{MARK}{number}"


def roof_of_rack(name):
    """Id of the roof that a rack stands on, as it was before it was cut into cells."""
    return name.rpartition(MARK)[0]


def find_racked_roofs(surface_id, kind):
    """Surfaces that racks stand on, and the cells of such.

    Parameters
    ----------
    surface_id, kind : sequence of str, (n,)

    Returns
    -------
    array, (n,) bool
    """
    roofs = {roof_of_rack(surface_id[rack]) for rack in np.flatnonzero(np.asarray(kind) == RACK)}
    if not roofs:
        return np.zeros(len(surface_id), bool)
    return np.array([name in roofs or whole_of_cell(name) in roofs for name in surface_id])
