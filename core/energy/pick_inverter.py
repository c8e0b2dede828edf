"""The inverter: the PVWatts curve, or one of pvlib's library, scaled to the modules."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pvlib

from ..settings.errors import InputError
from .search_library import read_library, search_library

PVWATTS = "pvwatts"
EFFICIENCY = 0.96  # of PVWatts' inverter at full load (Dobos 2014, NREL/TP-6A20-62641)
NEEDED = ("Paco", "Pdco", "Vdco", "Pso", "C0", "C1", "C2", "C3", "Pnt")


@dataclass(frozen=True)
class Inverter:
    """An inverter that is scaled to the modules."""

    name: str
    parameters: dict  # of Sandia's model, name -> float; empty for PVWatts
    dc_ac_ratio: float = 1.0  # nominal power of the modules over the largest AC power


@lru_cache
def pick_inverter(name, dc_ac_ratio=1.0):
    """An inverter by its name, or part of its name.

    Parameters
    ----------
    name : str
        pvwatts, or a name of pvlib's library of inverters.
    dc_ac_ratio : float
        Nominal power of the modules over the inverter's largest AC power.

    Returns
    -------
    Inverter

    Raises
    ------
    InputError
        If no inverter or several match the name, or the library lacks a parameter of it.
    """
    if name.lower() == PVWATTS:
        return Inverter(PVWATTS, {}, dc_ac_ratio)
    library, key = search_library(name, ("CECInverter", "SandiaInverter"), option="--inverter")
    row = read_library(library)[key]
    parameters = {parameter: float(row[parameter]) for parameter in NEEDED}
    missing = [parameter for parameter, value in parameters.items() if not math.isfinite(value)]
    if missing:
        raise InputError("--inverter", f"{key} has no {', '.join(missing)} in the library", "choose another inverter")
    return Inverter(key, parameters, dc_ac_ratio)


def convert_power(power, inverter):
    """AC power of an inverter with as many modules as its size requires.

    The input voltage is the inverter's nominal one: strings are assumed to fit. Consumption at night is neglected.

    Parameters
    ----------
    power : numpy.ndarray
        DC power over the modules' nominal power.
    inverter : Inverter

    Returns
    -------
    numpy.ndarray
        AC power over the modules' nominal DC power, not negative.
    """
    power, own = np.asarray(power, float), inverter.parameters
    if inverter.name == PVWATTS:
        return pvlib.inverter.pvwatts(power, 1.0 / inverter.dc_ac_ratio / EFFICIENCY, EFFICIENCY)
    size = own["Paco"] * inverter.dc_ac_ratio  # [W] of modules
    return np.maximum(pvlib.inverter.sandia(own["Vdco"], power * size, own), 0.0) / size
