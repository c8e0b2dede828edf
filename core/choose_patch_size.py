"""How large patches of light may be for the error of reflections that is asked for, by a pilot on the scene itself."""

from dataclasses import replace

import numpy as np

from .light.trace_transfer import trace_transfer
from .progress import silent
from .sun.suns import Suns

PILOT = {"samples": 64, "shadow_samples": 4, "max_bounces": 1, "suns": "hourly", "estimator": "gather"}
PILOT_SIZE = 10.0  # [m]
LEAST, MOST = 2.0, 20.0  # [m] within which the error was seen to grow in proportion to the size
SUNS_WORSE = 1.25  # how much more uneven the light of suns is than that of the sky


def choose_patch_size(stand, request, progress=silent):
    """Longest edge of a patch so that light that is uneven within it changes reflections by no more than is asked.

    Each patch hands on its light from 16 cells a quarter as long. The pilot, with 4 cells half as long, measures what
    the step from whole patches to cells changes under the sky; the error is proportional to the length of a cell, so
    half of this change is left with 16 cells.

    Parameters
    ----------
    stand : callable
        `stand(request)` makes the scene, with the request's `patch_size`.
    request : Request
        `patch_error` is what is asked for, in percent of the reflected light of all eligible surfaces.
    progress : callable
        See `core.progress`.

    Returns
    -------
    patch_size : float [m]
    expected : float
        Error that is expected with it, in percent.
    """
    pilot = replace(request, patch_size=PILOT_SIZE, patch_error=None, **PILOT)
    nothing = np.zeros(0, np.int32)
    suns = Suns("hourly", np.zeros((0, 3)), np.zeros(0), nothing, nothing)
    settings = trace_transfer(stand(pilot), suns, pilot, progress).settings
    left = 100 * SUNS_WORSE * abs(settings["change_by_even_patches"]["diffuse"]) / 2
    largest = PILOT_SIZE * request.patch_error / left if left > 0 else MOST
    patch_size = float(np.clip(largest, LEAST, MOST))
    return patch_size, left * patch_size / PILOT_SIZE
