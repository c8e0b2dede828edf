"""What the electricity of a whole city takes, from that of some surfaces."""

import time

import numpy as np

from ..energy.compute_energy import compute_energy
from ..energy.pv_system import build_system
from ..light.transfer import take_rows
from ..sky.choose_sky import choose_sky

FEWER, MORE = 256, 2_048  # surfaces timed; tables are made for either


def time_electricity(transfer, weather, request):
    """Seconds that `compute_energy` takes for all surfaces of a Transfer.

    Parameters
    ----------
    transfer : Transfer
    weather : Weather
    request : Request

    Returns
    -------
    float
        [s] of wall time.
    """
    count, seconds = len(transfer.surfaces), []
    system, sky = build_system(request), choose_sky(request, transfer)
    sizes = (count,) if count <= MORE else (FEWER, MORE)
    for size in sizes:
        part = take_rows(transfer, np.linspace(0, count - 1, size).astype(int))
        started = time.perf_counter()
        compute_energy(part, weather, system, request.threads, sky=sky)
        seconds.append(time.perf_counter() - started)
    each = max(seconds[-1] - seconds[0], 0.0) / (MORE - FEWER)
    return seconds[-1] + each * (count - sizes[-1])
