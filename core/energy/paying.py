"""Which of the surfaces that may carry modules do: those with enough full load hours that the user
did not leave out.

The choice acts on modules, their power and sums alone. Groups, light and errors hold for all
surfaces that count.
"""

from dataclasses import fields, replace

import numpy as np

from .counted_area import CountedArea
from .left_out import words_of_surfaces


def choose_modules(energy, surfaces, system):
    """Take the modules off surfaces with too few hours, and off those that the user leaves out.

    They get the reason left-out, with the user's words as its note, or low-hours, and lose number,
    area, power and places of modules, but keep their hours. An earlier choice is taken back first;
    the Energy keeps all modules in `every`. Without either setting nothing is taken off.

    Parameters
    ----------
    energy : Energy
    surfaces : Surfaces
    system : PvSystem
        Of which `least_hours` and `leave_out` are used.

    Returns
    -------
    Energy
    """
    # Take back an earlier choice.
    if energy.every is not None:
        energy = replace(energy, every=None, **vars(energy.every))
    if not (system.least_hours or system.leave_out):
        return energy
    # What is left out, with the user's words on it.
    words = (
        words_of_surfaces(surfaces, system.leave_out)
        if system.leave_out
        else [None] * len(energy.kwp)
    )
    # Modules have the hours of the area that counts.
    area, carries = np.asarray(surfaces.area, float), energy.reason == ""
    hours = np.divide(
        energy.full_load_hours * area,
        energy.counted_area,
        out=np.zeros(len(area)),
        where=carries,
    )
    left_out = carries & np.array([word is not None for word in words], bool)
    # The user's words go before the least hours; unknown hours are too few.
    few = carries & ~left_out & ~(hours >= system.least_hours)
    changed = {
        "reason": np.select([left_out, few], ["left-out", "low-hours"], energy.reason),
        "reason_note": np.where(left_out, [word or "" for word in words], energy.reason_note),
    }
    # All that is of modules goes.
    for name in ("module_count", "module_area", "kwp", "area_kwp"):
        changed[name] = np.where(left_out | few, 0.0, getattr(energy, name))
    if energy.layout is not None:
        changed["layout"] = energy.layout.take(~(left_out | few)[energy.layout.surface])
    # All modules are kept aside for the next choice.
    every = CountedArea(**{part.name: getattr(energy, part.name) for part in fields(CountedArea)})
    return replace(energy, every=every, **changed)
